//! One weighing of all changes: how strongly the cells support each, with the time course through AFTER that suits it best.

use nalgebra::DVector;

use super::cells::{Cell, rms_after};
use super::contrast::{Contrast, evidence};
use super::criteria::{LAG_CONTRADICTED, LAG_CORRECTED, SIZES};
use super::lag::{self, Shift};
use super::leave_one_mounting_out::{self, WeighedChange};
use super::posterior::{Cause, Posterior};
use super::shapes::{Change, Course, ForceShape};
use super::surface::Surface;
use super::time_course::{self, Candidate, TimeCourse};
use super::unknown;

/// The size of a change if it is the only one left, SI.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub change: Change,
    pub size: f64,
    pub std: f64,
    /// rms of the shape over AFTER per unit of size, N.
    pub rms: f64,
}

/// One weighing of all changes.
pub(super) struct Round {
    pub posterior: Posterior,
    pub estimates: Vec<Estimate>,
    /// The best time course of every change that settled cells show.
    pub time_courses: Vec<(Change, TimeCourse)>,
    pub local: Option<(usize, f64)>,
    /// Log evidence of the best name.
    pub best: f64,
}

/// How inexact shapes are, share of their size, and the evidence of the best name so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inexact {
    pub share: f64,
    pub first: f64,
}

impl Inexact {
    /// A shape that is wrong by a share of its size leaves that share of what it explains, and another shape may take it: evidence
    /// counts as with a variance larger by so much.
    fn temper(self, all: &mut [(Cause, f64)]) -> f64 {
        let named = all.iter().filter(|(c, _)| matches!(c, Cause::Named(_)));
        let best = named.map(|(_, log)| *log).fold(0.0, f64::max);
        let factor = 1.0 + 2.0 * self.share * self.share * best.max(self.first);
        for (_, log) in all.iter_mut().filter(|(_, log)| log.is_finite()) {
            *log = best - (best - *log) / factor;
        }
        best
    }
}

/// What a weighing depends on beside the cells.
#[derive(Clone, Copy)]
pub(super) struct Weighing<'a> {
    pub surface: &'a Surface,
    /// The changes that are tested, in order.
    pub tested: &'a [Change],
    /// The lag between the channels, where it is tested.
    pub lag: Option<&'a Shift>,
    pub inexact: Inexact,
    /// Whether the runs are parts of recordings in which length and pressure move together.
    pub moving: bool,
    pub prior_none: f64,
}

/// A change with the time courses with which it is tested. Parts of a motion overlap in time: there only what begins later, as a slip does,
/// has another time course than the whole.
fn candidate(cells: &[Cell], change: Change, moving: bool) -> Option<Candidate> {
    match whole(cells, change) {
        Some(shape) if moving => Some(Candidate { shape, courses: &[Course::Whole] }),
        _ => time_course::candidate(cells, change),
    }
}

/// The shape of a change that was there from the beginning of AFTER.
fn whole(cells: &[Cell], change: Change) -> Option<DVector<f64>> {
    let of = |c: &Cell| change.throughout(&c.means, c.direction).map(|s| if c.after { s } else { 0.0 });
    let values: Option<Vec<f64>> = cells.iter().map(of).collect();
    values.map(DVector::from_vec)
}

/// The size of a change as the only one.
fn estimate(cells: &[Cell], contrast: &Contrast, change: Change, shape: &DVector<f64>) -> Option<Estimate> {
    let rms = rms_after(cells, shape);
    let (a, b) = contrast.products(shape);
    (rms > 0.0 && a > 0.0).then(|| Estimate { change, size: b / a, std: (contrast.scale() / a).sqrt(), rms })
}

/// Weighs every change that the cells can carry.
pub(super) fn weigh(cells: &[Cell], contrast: &Contrast, by: Weighing<'_>) -> Round {
    let scale = contrast.scale();
    let sizes = SIZES.map(|s| s * by.surface.largest);
    let still = by.lag.map_or(0.0, |l| l.unchanged);
    let mut estimates = Vec::new();
    let mut time_courses: Vec<(Change, TimeCourse)> = Vec::new();
    for &change in by.tested {
        let candidate = candidate(cells, change, by.moving);
        let time_course = candidate.and_then(|c| time_course::of(cells, contrast, &c, scale, &sizes));
        let Some(time_course) = time_course.filter(|c| c.log.is_finite()) else { continue };
        let shape = whole(cells, change).unwrap_or_else(|| time_course.shape.clone());
        estimates.extend(estimate(cells, contrast, change, &shape));
        time_courses.push((change, time_course));
    }
    let units: Vec<DVector<f64>> =
        time_courses.iter().map(|(_, c)| &c.shape / rms_after(cells, &c.shape)).collect();
    let mut changes: Vec<WeighedChange<'_>> = time_courses
        .iter()
        .zip(&units)
        .map(|((change, time_course), shape)| WeighedChange {
            change: *change,
            shape,
            log: time_course.log,
            begins: time_course.start.at > 0.0,
        })
        .collect();
    leave_one_mounting_out::limit(cells, contrast, &mut changes, &sizes);
    let mut all: Vec<(Cause, f64)> =
        changes.iter().map(|a| (Cause::Named(a.change), a.log + still)).collect();
    all.push((Cause::None, still));
    let range = by.surface.high - by.surface.low;
    let unknown = unknown::weighed(cells, contrast, range, by.surface.largest);
    if let Some(unknown) = unknown {
        all.push((Cause::Unknown, unknown.log + still));
    }
    if let Some(lag) = by.lag
        && let Some((change, log)) = weigh_lag(cells, contrast, lag)
    {
        all.push((Cause::Named(change), log));
        let rms = rms_after(cells, &lag::trace(cells)) / lag.lag.abs().max(1e-9);
        estimates.push(Estimate { change, size: lag.lag.abs(), std: lag.variance.sqrt(), rms });
    }
    let best = by.inexact.temper(&mut all);
    Round {
        best,
        posterior: Posterior::of(&all, by.prior_none),
        estimates,
        time_courses,
        local: unknown.and_then(|u| u.local),
    }
}

/// The lag with its trace in the settled cells, which it must not contradict.
fn weigh_lag(cells: &[Cell], contrast: &Contrast, lag: &Shift) -> Option<(Change, f64)> {
    let trace = lag::trace(cells);
    let scale = contrast.scale();
    let late = if lag.lag > 0.0 { ForceShape::LateForce } else { ForceShape::LatePressure };
    let change = Change::of_shape(late)?;
    if trace.iter().all(|v| *v == 0.0) {
        return Some((change, lag.changed));
    }
    let freed = &contrast.residual - &trace;
    let image = &contrast.projector * &freed;
    let gain = 0.5 * (contrast.energy - freed.dot(&image)) / scale;
    let (a, b) = (trace.dot(&(&contrast.projector * &trace)), trace.dot(&image));
    let own = evidence(a, b, scale, &[LAG_CORRECTED]);
    Some((change, gain + own.max(LAG_CONTRADICTED) + lag.changed))
}
