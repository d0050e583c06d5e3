//! One name after the other: what is named is taken out, and the rest is tested again.

use nalgebra::DVector;

use super::cells::{Cell, cells, rms_after, row};
use super::contrast::Contrast;
use super::criteria::{
    COMBINED_SHAPE_ERROR, LAG_FLOOR, MOST_CHANGES, NAMED, NAMED_SHAPE_ERROR, OWN_SLOPE_ROUNDS, SIZES,
};
use super::lag;
use super::pairs::{self, Pair};
use super::posterior::{Cause, Posterior};
use super::runs::{Run, Runs};
use super::shapes::{Change, Class, ForceShape};
use super::surface::Surface;
use super::table_surface;
use super::time_course::{self, TimeCourse};
use super::weighing::{Inexact, Round, Weighing, weigh};

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
    pub time_course: Option<TimeCourse>,
}

/// What names depend on beside the cells.
pub(super) struct About<'a> {
    pub runs: &'a Runs,
    /// How many lags are tried first.
    pub lags_first: usize,
    /// The first weighing.
    pub by: Weighing<'a>,
}

/// The changes that were named.
pub(super) struct NamedChanges {
    /// With the trace of the lag that was tested last.
    pub cells: Vec<Cell>,
    pub accepted: Vec<Accepted>,
    /// The weighing after the last name.
    pub last: Posterior,
}

/// The cells with the trace of a lag.
pub(super) fn traced(runs: &Runs, surface: &Surface, late: f64) -> Vec<Cell> {
    let of = |run: &Run| lag::effect(run, surface, late);
    cells(runs, surface, (late.abs() > LAG_FLOOR).then_some(&of as &dyn Fn(&Run) -> Vec<f64>))
}

/// The runs without what was named, in their rows.
fn without(runs: &Runs, surface: &Surface, accepted: &[Accepted]) -> Runs {
    let mut freed = runs.clone();
    for run in freed.runs.iter_mut().filter(|r| r.after) {
        let added = |i: usize| -> f64 {
            let means = row(run, i, surface, runs.duration);
            accepted
                .iter()
                .filter_map(|a| {
                    let time_course = a.time_course.as_ref()?;
                    Some(a.size * time_course.at(means.clock) * a.change.in_full(&means, run.direction[i])?)
                })
                .sum()
        };
        let force: Vec<f64> = (0..run.time.len()).map(|i| run.force[i] - added(i)).collect();
        run.force = force;
    }
    freed
}

/// Names changes until none is more probable than not.
pub(super) fn name(
    about: &About<'_>,
    contrast: &Contrast,
    (given, first): (&[Cell], &Round),
) -> NamedChanges {
    let by = about.by;
    let mut cells = given.to_vec();
    let mut shift = by.lag.copied();
    let mut present = contrast.clone();
    let mut accepted: Vec<Accepted> = Vec::new();
    let share = if by.moving { COMBINED_SHAPE_ERROR } else { NAMED_SHAPE_ERROR };
    let mut inexact = Inexact { share, first: first.best };
    let mut weighed: Option<Round> = None;
    loop {
        let round = weighed.as_ref().unwrap_or(first);
        let none = round.posterior.probability(Cause::None);
        let more = round.posterior.leader().filter(|_| none < NAMED && accepted.len() < MOST_CHANGES);
        let late = shift.map_or(0.0, |s| s.lag);
        let next = more.and_then(|(change, p)| accept(&cells, round, change, p, late));
        // A second change of the same kind is what the first one's shape is inexact by.
        let other = |n: &Accepted| accepted.iter().all(|a| a.change.class() != n.change.class());
        let next = next.map(|n| with_time_course(&cells, &present, by.surface, n));
        let next = next.map(|n| with_own_slopes(about.runs, &mut cells, &present, by.surface, n));
        let Some(next) = next.filter(other) else {
            let left = none < NAMED && !by.moving && !accepted.iter().any(|a| a.change.is_lag());
            let without_lag = Weighing { lag: None, inexact, ..by };
            let mut last = round.posterior.clone();
            if left
                && accepted.len() < 2
                && let Some(pair) = pairs::search(&cells, contrast, without_lag, first)
            {
                accepted = both(&cells, by.surface, &pair);
                last = weigh(&cells, &beyond(contrast, &accepted), without_lag).posterior;
            }
            let base = without_lags(contrast, &accepted, &cells);
            if !by.moving && revisit(&cells, &base, without_lag, &mut accepted) {
                last = weigh(&cells, &beyond(&base, &accepted), without_lag).posterior;
            }
            refit(&base, &mut accepted, &cells);
            return NamedChanges { cells, accepted, last };
        };
        if next.change.is_lag() {
            let trace = lag::trace(&cells);
            let before = present.energy;
            present = present.with_residual(&present.residual - &trace).without_shapes(&[trace]);
            inexact.first = inexact.first.max(0.5 * (before - present.energy) / present.scale());
            shift = None;
        } else {
            present = present.without_shapes(std::slice::from_ref(&next.shape));
        }
        accepted.push(next);
        if shift.is_some() {
            // Rows in motion are scored without what was named.
            let rubs = accepted.iter().any(|a| a.change.class() == Class::Friction);
            let freed = without(about.runs, by.surface, &accepted);
            let found = lag::between(&freed, by.surface, about.lags_first, rubs);
            let with = traced(&freed, by.surface, found.lag);
            cells.iter_mut().zip(with).for_each(|(c, w)| c.means.lag = w.means.lag);
            shift = Some(found);
        }
        let round = weigh(&cells, &present, Weighing { lag: shift.as_ref(), inexact, ..by });
        inexact.first = inexact.first.max(round.best);
        weighed = Some(round);
    }
}

/// Both changes of a pair, each where the other one is taken out.
fn both(cells: &[Cell], surface: &Surface, pair: &Pair) -> Vec<Accepted> {
    let one = |k: usize| {
        let (change, round, rest) = (pair.changes[k], &pair.rounds[k], &pair.rests[k]);
        let found = accept(cells, round, change, round.posterior.probability(Cause::Named(change)), 0.0)?;
        Some(with_time_course(cells, rest, surface, found))
    };
    (0..2).filter_map(one).collect()
}

fn accept(cells: &[Cell], round: &Round, change: Change, probability: f64, late: f64) -> Option<Accepted> {
    let estimate = round.estimates.iter().find(|e| e.change == change)?;
    let time_course = round.time_courses.iter().find(|c| c.0 == change).map(|c| c.1.clone());
    let shape = match &time_course {
        Some(time_course) => time_course.shape.clone(),
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
        time_course,
    })
}

/// The same change with its time course and its size; the time course where the spread of the runs is judged without the change.
fn with_time_course(cells: &[Cell], present: &Contrast, surface: &Surface, found: Accepted) -> Accepted {
    if found.change.is_lag() {
        return found;
    }
    let sizes = SIZES.map(|s| s * surface.largest);
    let scale = present.without_shapes(std::slice::from_ref(&found.shape)).scale();
    let candidate = time_course::candidate(cells, found.change);
    let Some(time_course) = candidate.and_then(|c| time_course::of(cells, present, &c, scale, &sizes)) else {
        return found;
    };
    let (a, b) = present.products(&time_course.shape);
    if !(a > 0.0) {
        return found;
    }
    // The spread of the runs with the change in it: what the shape leaves is a part of it.
    let std = (present.scale() / a).sqrt();
    Accepted { shape: time_course.shape.clone(), size: b / a, std, time_course: Some(time_course), ..found }
}

/// A slip beside a table with the slopes that AFTER shows once the slip is taken out of it: with the slip in them they are too small or
/// too large by a share of the slip.
fn with_own_slopes(
    runs: &Runs,
    cells: &mut [Cell],
    present: &Contrast,
    surface: &Surface,
    found: Accepted,
) -> Accepted {
    if found.change.shape() != Some(ForceShape::StrokeStep)
        || surface.curves.iter().all(|c| c.own_by_stroke.is_empty())
    {
        return found;
    }
    let mut found = found;
    let mut own = surface.clone();
    for _ in 0..OWN_SLOPE_ROUNDS {
        let freed = without(runs, &own, std::slice::from_ref(&found));
        table_surface::fill_own_slopes(&mut own, &freed);
        let with = traced(runs, &own, 0.0);
        cells.iter_mut().zip(with).for_each(|(c, w)| c.means.step_by_stroke = w.means.step_by_stroke);
        found = with_time_course(cells, present, surface, found);
    }
    found
}

/// The contrast without the shapes of names, at any size.
fn beyond<'a>(contrast: &Contrast, names: impl IntoIterator<Item = &'a Accepted>) -> Contrast {
    contrast.without_shapes(&names.into_iter().map(|a| a.shape.clone()).collect::<Vec<_>>())
}

/// Without what a named lag does, at any size.
fn without_lags(contrast: &Contrast, accepted: &[Accepted], cells: &[Cell]) -> Contrast {
    if !accepted.iter().any(|a| a.change.is_lag()) {
        return contrast.clone();
    }
    let trace = lag::trace(cells);
    contrast.with_residual(&contrast.residual - &trace).without_shapes(&[trace])
}

/// Weighs each name once more beside the others: the first one was found while the others were in the difference. Whether any changed.
fn revisit(cells: &[Cell], base: &Contrast, by: Weighing<'_>, accepted: &mut [Accepted]) -> bool {
    let places: Vec<usize> = (0..accepted.len()).filter(|i| !accepted[*i].change.is_lag()).collect();
    let mut changed = false;
    if accepted.len() < 2 {
        return changed;
    }
    for &i in &places {
        let others: Vec<usize> = places.iter().copied().filter(|o| *o != i).collect();
        let rest = beyond(base, others.iter().map(|o| &accepted[*o]));
        let round = weigh(cells, &rest, by);
        let Some((change, probability)) = round.posterior.leader().filter(|l| !l.0.is_lag()) else {
            continue;
        };
        if others.iter().any(|o| accepted[*o].change.class() == change.class()) {
            continue;
        }
        let Some(found) = accept(cells, &round, change, probability, 0.0) else { continue };
        accepted[i] = with_time_course(cells, &rest, by.surface, found);
        changed = true;
    }
    changed
}

/// Sizes of several changes beside each other. `base`: without what a named lag does.
fn refit(base: &Contrast, accepted: &mut [Accepted], cells: &[Cell]) {
    let places: Vec<usize> = (0..accepted.len()).filter(|i| !accepted[*i].change.is_lag()).collect();
    if places.is_empty() || accepted.len() < 2 {
        return;
    }
    let shapes: Vec<DVector<f64>> = places.iter().map(|i| accepted[*i].shape.clone()).collect();
    let rms: Vec<f64> = shapes.iter().map(|s| rms_after(cells, s).max(f64::MIN_POSITIVE)).collect();
    let x =
        nalgebra::DMatrix::from_columns(&shapes.iter().zip(&rms).map(|(s, r)| s / *r).collect::<Vec<_>>());
    let inner = x.tr_mul(&(&base.projector * &x));
    let Some(factor) = inner.cholesky() else { return };
    let sizes = factor.solve(&x.tr_mul(&base.projected));
    let covariance = factor.inverse() * base.without_shapes(&shapes).scale();
    for (k, i) in places.into_iter().enumerate() {
        accepted[i].size = sizes[k] / rms[k];
        accepted[i].std = covariance[(k, k)].max(0.0).sqrt() / rms[k];
    }
}
