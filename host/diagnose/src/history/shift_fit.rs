//! A free static curve for each mounting on a pressure that is shifted: `F = S_m(P + Σ q_j θ_j)`.
//!
//! Gauss–Newton in which the splines stay linear: at `θ`, with `B` at the shifted pressures and `S′` the present slope,
//! `min ‖y − B w − S′ q Δθ‖²`. The splines are evaluated at the shifted pressure: made linear about no shift, the knee of the
//! curve would be lost. Bands of four and a border of `J` columns: `O(rows (4 + J)²)`.

use super::campaign::Points;
use super::criteria::{DAMPING, KNOTS, RIDGE, SHIFT_FIT_PRIOR, SMOOTHNESS, SMOOTHNESS_STATIC};
use super::spline::Banded;
use pam_fit::numerics::bspline::CubicSplines;

/// Coefficients of shifts, and of the curve of each mounting.
#[derive(Clone, Debug, Default)]
pub(super) struct ShiftFit {
    pub theta: Vec<f64>,
    pub curves: Vec<Vec<f64>>,
}

/// The splines of a campaign: knots every 1, 2 or 5 × 10ⁿ kPa, about `KNOTS` below the highest pressure.
pub(super) fn knot_step(highest: f64) -> f64 {
    let aimed = highest.max(1e-3) / KNOTS;
    let decade = 10.0_f64.powf(aimed.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|s| s * decade);
    let nearer = |a: &f64, b: &f64| (a / aimed).ln().abs().total_cmp(&(b / aimed).ln().abs());
    steps.into_iter().min_by(nearer).unwrap_or(aimed)
}

/// On shifted pressures: one knot below zero, four above the highest pressure.
pub(super) fn shifted_spline(highest: f64) -> CubicSplines {
    let step = knot_step(highest);
    CubicSplines::clamped(-step, step, (highest / step).ceil() as usize + 5)
}

/// On measured pressures.
pub(super) fn static_spline(highest: f64) -> CubicSplines {
    let step = knot_step(highest);
    CubicSplines::clamped(0.0, step, (highest / step).ceil() as usize + 1)
}

/// `Σ q_j θ_j` at a point.
pub(super) fn shift(columns: &[Vec<f64>], theta: &[f64], i: usize) -> f64 {
    columns.iter().zip(theta).map(|(q, t)| q[i] * t).sum()
}

/// The normal equations of one mounting.
struct Block {
    band: Banded,
    border: Vec<Vec<f64>>,
    moment: Vec<f64>,
}

/// Solves once about present shifts of pressure: the curves, and the change of the coefficients where slopes are given.
///
/// `columns` are the derivatives of the shift in each coefficient, kPa.
pub(super) fn solve(
    points: &Points,
    spline: &CubicSplines,
    use_point: &[bool],
    shifts: &[f64],
    columns: &[Vec<f64>],
    slopes: Option<&[Vec<f64>]>,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (count, free) = (spline.len(), if slopes.is_some() { columns.len() } else { 0 });
    let mut blocks: Vec<Block> = (0..points.mountings.len())
        .map(|_| Block {
            band: Banded::penalty(count, SMOOTHNESS, RIDGE),
            border: vec![vec![0.0; count]; free],
            moment: vec![0.0; count],
        })
        .collect();
    let mut gram = vec![vec![0.0; free]; free];
    let mut right = vec![0.0; free];
    let mut own = vec![0.0; free];
    for i in (0..points.len()).filter(|i| use_point[*i]) {
        let local = spline.at(points.pressure[i] + shifts[i]);
        let slope = slopes.map_or(0.0, |curves| local.slope(&curves[points.mounting[i]]));
        let block = &mut blocks[points.mounting[i]];
        block.band.add(&local, 1.0);
        for k in 0..4 {
            block.moment[local.first + k] += local.value[k] * points.force[i];
        }
        for (o, q) in own.iter_mut().zip(columns) {
            *o = slope * q[i];
        }
        for j in 0..free {
            for k in 0..4 {
                block.border[j][local.first + k] += local.value[k] * own[j];
            }
            right[j] += own[j] * points.force[i];
            for l in 0..free {
                gram[j][l] += own[j] * own[l];
            }
        }
    }
    border(blocks, gram, right)
}

/// Eliminates the splines of each mounting, then the coefficients.
fn border(blocks: Vec<Block>, mut gram: Vec<Vec<f64>>, mut right: Vec<f64>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let free = right.len();
    let mut solved = Vec::with_capacity(blocks.len());
    for block in blocks {
        let factor = block.band.factor();
        let (mut alone, mut along) = (block.moment, block.border.clone());
        factor.solve(&mut alone);
        along.iter_mut().for_each(|c| factor.solve(c));
        for j in 0..free {
            right[j] -= dot(&block.border[j], &alone);
            for l in 0..free {
                gram[j][l] -= dot(&block.border[j], &along[l]);
            }
        }
        solved.push((alone, along));
    }
    for (j, row) in gram.iter_mut().enumerate() {
        row[j] += SHIFT_FIT_PRIOR;
    }
    let chosen: Vec<usize> = (0..free).collect();
    let change = crate::linear::solve_symmetric(&gram, &right, &chosen).unwrap_or_else(|| vec![0.0; free]);
    let curves = solved
        .into_iter()
        .map(|(mut alone, along)| {
            for (column, t) in along.iter().zip(&change) {
                alone.iter_mut().zip(column).for_each(|(w, c)| *w -= t * c);
            }
            alone
        })
        .collect();
    (change, curves)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Fits the coefficients of the shifts and a curve for each mounting to the points in use.
pub(super) fn fit(
    points: &Points,
    spline: &CubicSplines,
    use_point: &[bool],
    columns: &[Vec<f64>],
    start: &[f64],
    steps: usize,
) -> ShiftFit {
    let mut theta = start.to_vec();
    let shifts = |theta: &[f64]| (0..points.len()).map(|i| shift(columns, theta, i)).collect::<Vec<f64>>();
    let (_, mut curves) = solve(points, spline, use_point, &shifts(&theta), &[], None);
    if !columns.is_empty() {
        for step in 0..steps {
            let (change, next) = solve(points, spline, use_point, &shifts(&theta), columns, Some(&curves));
            let share = if step + 1 < steps { DAMPING } else { 1.0 };
            theta.iter_mut().zip(change).for_each(|(t, c)| *t += share * c);
            curves = next;
        }
        curves = solve(points, spline, use_point, &shifts(&theta), &[], None).1;
    }
    ShiftFit { theta, curves }
}

/// What a fit predicts at a point, N.
pub(super) fn predict(
    points: &Points,
    spline: &CubicSplines,
    columns: &[Vec<f64>],
    fit: &ShiftFit,
    i: usize,
) -> f64 {
    let local = spline.at(points.pressure[i] + shift(columns, &fit.theta, i));
    local.value(&fit.curves[points.mounting[i]])
}

/// `dS/dP` of a fit at a point, N/kPa.
pub(super) fn slope(
    points: &Points,
    spline: &CubicSplines,
    columns: &[Vec<f64>],
    fit: &ShiftFit,
    i: usize,
) -> f64 {
    let local = spline.at(points.pressure[i] + shift(columns, &fit.theta, i));
    local.slope(&fit.curves[points.mounting[i]])
}

/// A static curve through chosen points, on measured pressures; `None` of no point.
pub(super) fn static_curve(
    points: &Points,
    spline: &CubicSplines,
    chosen: impl Iterator<Item = usize>,
) -> Option<Vec<f64>> {
    let mut band = Banded::penalty(spline.len(), SMOOTHNESS_STATIC, RIDGE);
    let mut moment = vec![0.0; spline.len()];
    let mut any = false;
    for i in chosen {
        any = true;
        let local = spline.at(points.pressure[i]);
        band.add(&local, 1.0);
        for k in 0..4 {
            moment[local.first + k] += local.value[k] * points.force[i];
        }
    }
    band.factor().solve(&mut moment);
    any.then_some(moment)
}
