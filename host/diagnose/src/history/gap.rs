//! The gap between filling and emptying as a finding: how large it is, what explains it, and what does not.

use model_core::effects::EffectName;

use super::Fits;
use super::answer::{Estimate, Finding, FindingKind};
use super::campaign::Points;
use super::criteria::GAP_EXPLAINED;
use super::findings::{self, Contrast, Visits};
use super::judge::plus_minus;
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
        (true, true, _) => Some(EffectName::LogCreep.info().name.to_owned()),
        (true, false, Some(n)) => Some(n.effect.info().name.to_owned()),
        _ => None,
    };
    let after = left.map(|l| format!("; the memory leaves {}", plus_minus(&l))).unwrap_or_default();
    let words = format!(
        "emptying pulls {} more than filling when shortened, compared with full length ({} {of}s){}",
        plus_minus(&contrast),
        contrast.units,
        match (found, named) {
            (false, _) => "; its interval includes none".to_owned(),
            (true, false) => String::new(),
            (true, true) => format!("{after}{}{}", beside(fits), instead(points, fits)),
        }
    );
    let alternatives = if cause.is_some() && named {
        fits.instead.alternatives.iter().map(|e| e.info().name.to_owned()).collect()
    } else {
        Vec::new()
    };
    Some(Finding {
        kind: FindingKind::FillingEmptyingGap,
        found,
        size: Estimate::new(contrast.mean, contrast.half, "N", of),
        units: contrast.units,
        squares: contrast.squares,
        cause,
        alternatives,
        mounting: None,
        run: None,
        words,
    })
}

/// Friction beside the memory, as text.
fn beside(fits: &Fits<'_>) -> String {
    let Some(n) = fits.needed.as_ref() else {
        return "; dry friction beside it does not lower the error of unseen runs by enough to be named"
            .to_owned();
    };
    let (_, unseen) = fits.best();
    let half = n.error / n.value.abs().max(f64::MIN_POSITIVE)
        * half_width_95(unseen.folds.len().saturating_sub(1))
        * n.peak;
    format!(
        "; beside it {} of up to {:.1} ± {half:.1} N lowers the error of unseen runs from {:.2} to {:.2} N (rms)",
        n.effect.info().name,
        n.peak,
        n.rms.0,
        n.rms.1
    )
}

/// Friction in place of the memory's fast part, as text.
fn instead(points: &Points, fits: &Fits<'_>) -> String {
    let Some((whole, friction)) = fits.instead.rms else { return String::new() };
    let percent = 100.0 / points.largest_force().max(f64::MIN_POSITIVE);
    let errors = format!("{:.2} % against {:.2} % of the largest force", percent * friction, percent * whole);
    if fits.instead.alternatives.is_empty() {
        format!(
            "; dry friction in place of the memory within a run is excluded: it predicts unseen runs worse ({errors})"
        )
    } else {
        format!("; dry friction in place of the memory within a run is not excluded ({errors})")
    }
}
