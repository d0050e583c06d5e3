//! Hysteresis as a finding: how large the gap between filling and emptying is, what explains it, and what does not.

use model_core::effects::EffectName;

use super::Fits;
use super::answer::{Estimate, Finding, FindingDetail, GapBesideMemory, InPlaceOfMemory, NeededEffect};
use super::campaign::Points;
use super::criteria::GAP_EXPLAINED;
use super::findings::{self, Contrast, Visits};
use pam_fit::bench::Candidate;
use pam_fit::numerics::student::half_width_95;

/// The finding; `None` without a mounting at full length and a shortened one.
pub(super) fn finding(points: &Points, fits: &Fits<'_>, visits: &Visits, named: bool) -> Option<Finding> {
    let (by_mounting, by_run) = findings::gap(points, visits);
    let positive = |c: &Option<Contrast>| c.as_ref().is_some_and(Contrast::is_positive);
    let (contrast, of) = match (by_mounting, by_run) {
        (Some(m), _) if positive(&by_mounting) => (m, "mounting"),
        (_, Some(r)) if positive(&by_run) => (r, "run"),
        (Some(m), _) => (m, "mounting"),
        (None, Some(r)) => (r, "run"),
        (None, None) => return None,
    };
    let found = contrast.is_positive();
    let (_, unseen) = fits.best();
    let left = findings::gap_left(points, &unseen.predicted);
    // A memory that leaves most of the gap is not its cause.
    let explains = left.as_ref().is_none_or(|l| l.mean.abs() < (1.0 - GAP_EXPLAINED) * contrast.mean);
    let needed = fits.needed.as_ref();
    let cause = match (found, named && explains, needed) {
        (true, true, _) => Some(Candidate::Muscle(EffectName::LogCreep)),
        (true, false, Some(n)) => Some(n.effect),
        _ => None,
    };
    let left = left.map(|l| Estimate::new(l.mean, l.half, "N", "run"));
    let beside_memory = || GapBesideMemory { left, beside: beside(fits), instead: instead(points, fits) };
    let alternatives = if cause.is_some() && named { fits.instead.alternatives.clone() } else { Vec::new() };
    Some(Finding {
        found,
        size: Estimate::new(contrast.mean, contrast.half, "N", of),
        units: contrast.units,
        squares: contrast.squares,
        cause,
        alternatives,
        mounting: None,
        run: None,
        detail: FindingDetail::Gap((found && named).then(beside_memory)),
    })
}

/// Friction beside the memory.
fn beside(fits: &Fits<'_>) -> Option<NeededEffect> {
    let n = fits.needed.as_ref()?;
    let (_, unseen) = fits.best();
    let half = n.error / n.value.abs().max(f64::MIN_POSITIVE)
        * half_width_95(unseen.folds.len().saturating_sub(1))
        * n.peak;
    Some(NeededEffect {
        effect: n.effect,
        peak: Estimate::new(n.peak, Some(half), "N", "run"),
        without_N: n.rms.0,
        with_N: n.rms.1,
    })
}

/// Friction in place of the memory's fast part.
fn instead(points: &Points, fits: &Fits<'_>) -> Option<InPlaceOfMemory> {
    let (whole, friction) = fits.instead.rms?;
    let percent = 100.0 / points.largest_force().max(f64::MIN_POSITIVE);
    Some(InPlaceOfMemory {
        friction_pct: percent * friction,
        memory_pct: percent * whole,
        excluded: fits.instead.alternatives.is_empty(),
    })
}
