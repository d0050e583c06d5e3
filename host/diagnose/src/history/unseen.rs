//! Each run predicted from the other runs of the muscle: the static curves, and the law with memory.

use pam_fit::numerics::jackknife;
use rayon::prelude::*;

use super::campaign::Points;
use super::criteria::{MOST_FOLDS, NESTED_RUNS};
use super::law::{Law, Layer};
use super::shift_fit::{self, ShiftFit};

/// What each run's points are predicted to be from the other runs, N; not a number where no other run can say it.
#[derive(Clone, Debug)]
pub(super) struct Unseen {
    pub predicted: Vec<f64>,
    /// The fit without each run; empty for static curves.
    pub folds: Vec<Law>,
}

/// Sizes of errors over the points that count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sizes {
    /// Root mean square, N.
    pub rms: f64,
    /// Mean absolute, N.
    pub mean: f64,
    /// How many points.
    pub count: usize,
}

impl Unseen {
    /// The error at a point, N.
    pub(super) fn error(&self, points: &Points, i: usize) -> f64 {
        points.force[i] - self.predicted[i]
    }

    /// Sizes of the errors over chosen points; points without a prediction do not count.
    pub(super) fn sizes(&self, points: &Points, chosen: impl Fn(usize) -> bool) -> Sizes {
        let (mut squares, mut sum, mut count) = (0.0, 0.0, 0);
        for i in (0..points.len()).filter(|i| chosen(*i)) {
            let e = self.error(points, i);
            if e.is_finite() {
                squares += e * e;
                sum += e.abs();
                count += 1;
            }
        }
        let n = count.max(1) as f64;
        Sizes { rms: (squares / n).sqrt(), mean: sum / n, count }
    }

    /// Standard error of a quantity over delete-one-run folds (of many runs, delete-a-group), by the jackknife.
    pub(super) fn standard_error(&self, quantity: impl Fn(&Law) -> f64) -> f64 {
        let values: Vec<f64> = self.folds.iter().map(quantity).collect();
        jackknife::deviation(&values)
    }
}

/// Whether a run has others of its mounting to be predicted from.
fn has_others(points: &Points, run: usize) -> bool {
    points.mountings[points.runs[run].mounting].runs.len() > 1
}

/// Static curves, one for each mounting, or for each mounting and direction.
pub(super) fn static_curves(points: &Points, by_direction: bool) -> Unseen {
    let spline = shift_fit::static_spline(points.highest());
    let directions: &[Option<i8>] = if by_direction { &[Some(1), Some(-1)] } else { &[None] };
    let mut predicted = vec![f64::NAN; points.len()];
    for (r, run) in points.runs.iter().enumerate() {
        for direction in directions {
            let alike = |i: &usize| {
                points.mounting[*i] == run.mounting && direction.is_none_or(|d| points.direction[*i] == d)
            };
            let others = (0..points.len()).filter(|i| points.run[*i] != r && alike(i));
            let Some(curve) = shift_fit::static_curve(points, &spline, others) else { continue };
            for i in (run.points.0..run.points.1).filter(alike) {
                predicted[i] = spline.at(points.pressure[i]).value(&curve);
            }
        }
    }
    Unseen { predicted, folds: Vec::new() }
}

/// Which runs are left out together: each alone, of many runs every n-th, which lie in different mountings.
fn groups(points: &Points) -> Vec<Vec<usize>> {
    let runs = points.runs.len();
    let count = runs.min(MOST_FOLDS as usize);
    (0..count).map(|g| (g..runs).step_by(count).collect()).collect()
}

/// A curve for each mounting on pressures that are shifted by given columns, their coefficients refitted without each run: what is predicted,
/// and the coefficients of each fold.
pub(super) fn shifted_curves(
    layer: &Layer<'_>,
    columns: &[Vec<f64>],
    start: &[f64],
) -> (Unseen, Vec<Vec<f64>>) {
    let points = layer.points;
    let fits: Vec<(Vec<usize>, ShiftFit)> = groups(points)
        .into_par_iter()
        .map(|group| {
            let others: Vec<bool> = points.run.iter().map(|k| !group.contains(k)).collect();
            let fit = shift_fit::fit(points, &layer.spline, &others, columns, start, 3);
            (group, fit)
        })
        .collect();
    let mut predicted = vec![f64::NAN; points.len()];
    for (group, fit) in &fits {
        for r in group.iter().filter(|r| has_others(points, **r)) {
            for i in points.runs[*r].points.0..points.runs[*r].points.1 {
                predicted[i] = shift_fit::predict(points, &layer.spline, columns, fit, i);
            }
        }
    }
    (Unseen { predicted, folds: Vec::new() }, fits.into_iter().map(|(_, fit)| fit.theta).collect())
}

/// The law with memory, everything chosen without the run that is predicted: `c`, `P_b` and, of few runs, pause and earlier load (which are
/// `held` at those of the full fit where a variant is only compared).
pub(super) fn with_memory(layer: &Layer<'_>, full: &Law, further: &[Vec<f64>], held: bool) -> Unseen {
    let points = layer.points;
    let nested = !held && (points.runs.len() as f64) < NESTED_RUNS;
    let choice = (!nested).then_some(full.choice);
    let folds: Vec<(Law, Vec<(usize, f64)>)> = groups(points)
        .into_par_iter()
        .map(|group| {
            let others: Vec<bool> = points.run.iter().map(|k| !group.contains(k)).collect();
            let mut law = layer.fit(&others, choice, further, Some(full));
            let own = group.iter().filter(|r| has_others(points, **r));
            let own = own.flat_map(|r| points.runs[*r].points.0..points.runs[*r].points.1);
            let own = own.map(|i| (i, layer.predict(&law, i))).collect();
            // The shifts of all points are not computed again.
            law.columns.clear();
            (law, own)
        })
        .collect();
    let mut predicted = vec![f64::NAN; points.len()];
    let folds = folds
        .into_iter()
        .map(|(law, own)| {
            own.into_iter().for_each(|(i, force)| predicted[i] = force);
            law
        })
        .collect();
    Unseen { predicted, folds }
}
