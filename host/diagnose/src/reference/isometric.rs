//! The whole chain for recordings at held lengths: from runs to weighed changes.

use nalgebra::DVector;

use super::cells::{Cell, cells, rms_after};
use super::contrast::Contrast;
use super::course::{self, Course};
use super::criteria::{
    COMBINED_SHAPE_ERROR, DIRECTIONS_PER_RUN, LAG_FLOOR, LAGS, MOST_CHANGES, NAMED, SIZES, SLOPE_ERROR,
    TABLE_ERROR_FACTORS, TABLE_LAGS,
};
use super::lag;
use super::posterior::{Cause, Posterior};
use super::repeatability::{Setting, covariance};
use super::runs::{Run, Runs};
use super::shapes::Change;
use super::surface::Surface;
use super::table_error;
use super::weighing::{Inexact, Round, Weighing, is_lag, weigh};
use pam_data::error::{DataCode, Error, Result};

/// A change that is named, with the shape that it has in the cells.
#[derive(Debug, Clone)]
pub(super) struct Accepted {
    pub change: Change,
    pub probability: f64,
    /// Other names that the set of this round holds.
    pub competitors: Vec<Change>,
    /// Per unit of size, N; zero on BEFORE.
    pub shape: DVector<f64>,
    pub size: f64,
    pub std: f64,
    /// Since when; unknown for a lag.
    pub course: Option<Course>,
}

/// Everything that was found.
pub(super) struct Analysis {
    pub runs: Runs,
    pub surface: Surface,
    pub cells: Vec<Cell>,
    /// Of the first round, without changes.
    pub contrast: Contrast,
    pub first: Round,
    pub accepted: Vec<Accepted>,
    /// The weighing after the last name.
    pub last: Posterior,
    /// Whether the reference is recordings, and no table.
    pub recorded: bool,
    /// The likeliest error of a table in a cell, N; zero for recordings.
    pub reference_error: f64,
}

/// Which level each cell belongs to, without gaps.
fn levels(cells: &[Cell]) -> Vec<usize> {
    let key = |c: &Cell| (c.mounting, c.direction < 0.0, c.bin);
    let mut all: Vec<_> = cells.iter().map(key).collect();
    all.sort_unstable();
    all.dedup();
    cells.iter().map(|c| all.binary_search(&key(c)).unwrap_or(0)).collect()
}

/// The reference and how good it is.
pub(super) struct Reference {
    pub surface: Surface,
    /// N; zero where the reference is recordings, whose levels are estimated with the rest.
    pub error: f64,
    /// Whether BEFORE has cells of its own.
    pub recorded: bool,
}

/// Weighs everything.
///
/// # Errors
/// Recordings that leave no common cells, or numbers that cannot be used.
pub(super) fn analyse(runs: Runs, reference: Reference, prior_none: f64) -> Result<Analysis> {
    let Reference { surface, error, recorded } = reference;
    use rayon::prelude::*;
    // Rows of one part of a motion do not follow one another: they say nothing about lags.
    let tried: &[f64] = if recorded { &LAGS } else { &TABLE_LAGS };
    let shift = (!runs.moving).then(|| {
        let scores: Vec<_> = runs.runs.par_iter().map(|r| lag::score(r, &surface, tried)).collect();
        lag::shift(&runs, &scores)
    });
    let late = shift.as_ref().map_or(0.0, |s| s.lag);
    let traced = |run: &Run| lag::effect(run, &surface, late);
    let lag = (late.abs() > LAG_FLOOR).then_some(&traced as &dyn Fn(&Run) -> Vec<f64>);
    let cells = cells(&runs, &surface, lag);
    if !cells.iter().any(|c| c.after) {
        let values = || runs.side(true).flat_map(|r| r.pressure.iter().copied());
        return Err(Error::new(DataCode::RecordingOutOfRange, "AFTER and the reference have no pressures in common")
            .help(format!(
                "AFTER has {:.0} to {:.0} kPa, the reference {:.0} to {:.0} kPa: check the units, or record the same pressures",
                values().fold(f64::INFINITY, f64::min) / 1e3,
                values().fold(f64::NEG_INFINITY, f64::max) / 1e3,
                surface.low / 1e3,
                surface.high / 1e3
            )));
    }
    let setting = Setting {
        range: surface.high - surface.low,
        largest: surface.largest,
        remounted: runs.remounted,
        moving: runs.moving,
    };
    let contrasts = contrasts(&cells, &runs, &setting, (!recorded).then_some(error))?;
    let mut accepted: Vec<Accepted> = Vec::new();
    // Lag scores are of rows that still hold what was named before: a lag is named first or not at all.
    let inexact_share = if runs.moving { COMBINED_SHAPE_ERROR } else { SLOPE_ERROR };
    // Beside rests the first name is weighed as it is: no other one is left by it.
    let mut inexact = Inexact { share: if runs.moving { COMBINED_SHAPE_ERROR } else { 0.0 }, first: 0.0 };
    let by = Weighing { surface: &surface, lag: shift.as_ref(), inexact, moving: runs.moving, prior_none };
    let weighed = |c: Contrast| (weigh(&cells, &c, by), c);
    let (mut round, contrast, which) = likeliest(contrasts.into_iter().map(weighed).collect())?;
    let reference_error = if recorded { 0.0 } else { error * TABLE_ERROR_FACTORS[which] };
    let mut present = contrast.clone();
    let mut first: Option<Round> = None;
    loop {
        let leader = round.posterior.leader();
        let none = round.posterior.probability(Cause::None);
        // What a lag does to settled rows is not known well enough to look for more beneath it.
        let lagged = accepted.iter().any(|a| is_lag(a.change));
        let more = leader.filter(|_| !lagged && none < NAMED && accepted.len() < MOST_CHANGES);
        let next = more.and_then(|(change, p)| accept(&cells, &round, change, p, late));
        let next = next.map(|n| with_course(&cells, &present, &surface, n));
        let last = round.posterior.clone();
        inexact = Inexact { share: inexact_share, first: inexact.first.max(round.best) };
        first.get_or_insert(round);
        // A second change of the same kind is what the first one's shape is inexact by.
        let Some(next) = next.filter(|n| accepted.iter().all(|a| a.change.class() != n.change.class()))
        else {
            let Some(first) = first else {
                break Err(Error::new(DataCode::RecordingEmpty, "nothing to weigh"));
            };
            refit(&contrast, &mut accepted, &cells);
            break Ok(Analysis {
                runs,
                surface,
                cells,
                contrast,
                first,
                accepted,
                last,
                recorded,
                reference_error,
            });
        };
        if is_lag(next.change) {
            let residual = &present.residual - lag::trace(&cells);
            present = present.with_residual(residual);
        } else {
            present = present.without_shapes(std::slice::from_ref(&next.shape));
        }
        accepted.push(next);
        round = weigh(&cells, &present, Weighing { lag: None, inexact, ..by });
    }
}

/// Generalised least squares for every error that the reference may have; one, without an error, for recordings.
fn contrasts(
    cells: &[Cell],
    runs: &Runs,
    setting: &Setting,
    table_error: Option<f64>,
) -> Result<Vec<Contrast>> {
    let unusable =
        || Error::new(DataCode::RecordingNotFinite, "the recordings hold numbers that cannot be compared");
    let repeats = covariance(cells, setting);
    let y = DVector::from_iterator(cells.len(), cells.iter().map(|c| c.means.residual));
    let Some(error) = table_error else {
        let used: std::collections::BTreeSet<usize> = runs.runs.iter().map(|r| r.mounting).collect();
        // Runs repeated on one side, or else lengths beyond the first: what a single change leaves of their differences does not repeat.
        let repeated = runs.runs.len() as f64 - 2.0 * used.len() as f64;
        let taught = DIRECTIONS_PER_RUN * repeated.max(used.len() as f64 - 1.0).max(1.0);
        return Ok(vec![Contrast::new(repeats, Some(&levels(cells)), y, taught).ok_or_else(unusable)?]);
    };
    // What the error's size adapts to, the scale of what repeats must not take once more.
    let of = |factor: &f64| {
        let k = &repeats + table_error::covariance(cells, setting.range, factor * error);
        Contrast::new(k, None, y.clone(), 0.0).ok_or_else(unusable)
    };
    TABLE_ERROR_FACTORS.iter().map(of).collect()
}

/// The likeliest of several errors of the reference, with the probabilities of causes averaged over all of them.
fn likeliest(mut all: Vec<(Round, Contrast)>) -> Result<(Round, Contrast, usize)> {
    let log = |(round, contrast): &(Round, Contrast)| contrast.density + round.posterior.evidence;
    let logs: Vec<f64> = all.iter().map(log).collect();
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let best = logs.iter().position(|l| *l == top).unwrap_or(0);
    let weights: Vec<(f64, &Posterior)> =
        logs.iter().zip(&all).map(|(l, (round, _))| ((l - top).exp(), &round.posterior)).collect();
    // One has no mean; its weight may be of no meaning.
    let mean = (all.len() > 1).then(|| Posterior::mean(&weights));
    if best >= all.len() {
        return Err(Error::new(DataCode::RecordingEmpty, "nothing to weigh"));
    }
    let (mut round, contrast) = all.swap_remove(best);
    round.posterior = mean.unwrap_or(round.posterior);
    Ok((round, contrast, best))
}

fn accept(cells: &[Cell], round: &Round, change: Change, probability: f64, late: f64) -> Option<Accepted> {
    let estimate = round.estimates.iter().find(|e| e.change == change)?;
    let course = round.courses.iter().find(|c| c.0 == change).map(|c| c.1.clone());
    let shape = match &course {
        Some(course) => course.shape.clone(),
        None => lag::trace(cells) / late.abs().max(1e-9),
    };
    let competitors = round.posterior.set().into_iter().filter_map(|c| match c {
        Cause::Named(other) if other != change => Some(other),
        _ => None,
    });
    Some(Accepted {
        change,
        probability,
        competitors: competitors.collect(),
        shape,
        size: estimate.size,
        std: estimate.std,
        course,
    })
}

/// The same change with its course and its size; the course where the spread of the runs is judged without the change.
fn with_course(cells: &[Cell], present: &Contrast, surface: &Surface, found: Accepted) -> Accepted {
    if is_lag(found.change) {
        return found;
    }
    let sizes = SIZES.map(|s| s * surface.largest);
    let scale = present.without_shapes(std::slice::from_ref(&found.shape)).scale();
    let candidate = course::candidate(cells, found.change);
    let Some(course) = candidate.and_then(|c| course::of(cells, present, &c, scale, &sizes)) else {
        return found;
    };
    let (a, b) = present.products(&course.shape);
    if !(a > 0.0) {
        return found;
    }
    // The spread of the runs with the change in it: what the shape leaves is a part of it.
    let std = (present.scale() / a).sqrt();
    Accepted { shape: course.shape.clone(), size: b / a, std, course: Some(course), ..found }
}

/// Sizes of several changes beside each other.
fn refit(contrast: &Contrast, accepted: &mut [Accepted], cells: &[Cell]) {
    let lagged = accepted.iter().any(|a| is_lag(a.change));
    let freed = if lagged {
        contrast.with_residual(&contrast.residual - lag::trace(cells))
    } else {
        contrast.clone()
    };
    let places: Vec<usize> = (0..accepted.len()).filter(|i| !is_lag(accepted[*i].change)).collect();
    if places.is_empty() || accepted.len() < 2 {
        return;
    }
    let shapes: Vec<DVector<f64>> = places.iter().map(|i| accepted[*i].shape.clone()).collect();
    let rms: Vec<f64> = shapes.iter().map(|s| rms_after(cells, s).max(f64::MIN_POSITIVE)).collect();
    let x =
        nalgebra::DMatrix::from_columns(&shapes.iter().zip(&rms).map(|(s, r)| s / *r).collect::<Vec<_>>());
    let inner = x.tr_mul(&(&freed.projector * &x));
    let Some(factor) = inner.cholesky() else { return };
    let sizes = factor.solve(&x.tr_mul(&freed.projected));
    let covariance = factor.inverse() * freed.without_shapes(&shapes).scale();
    for (k, i) in places.into_iter().enumerate() {
        accepted[i].size = sizes[k] / rms[k];
        accepted[i].std = covariance[(k, k)].max(0.0).sqrt() / rms[k];
    }
}
