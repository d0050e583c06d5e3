//! The weight of each point.
//!
//! ```text
//! w = n_i / n_c / (σ²/n_c + (0.002 F_B(P))²)
//! ```
//! with `n_i` rows in the point, `n_c` in its chunk of stroke, pressure and direction, and `σ` the noise of a row: a place where the
//! recording dwelled does not outweigh the others. `F_B(P)` is not fitted yet where weights are needed first: it is the largest force
//! that was read, in proportion to `P − P0`, and at least a tenth of it. Large residuals count in proportion to their size, not to its
//! square (P. J. Huber, Ann. Math. Statist. 35 (1964) 73, doi 10.1214/aoms/1177703732).

use super::design::Row;
use super::points::{Point, Range};
use super::problem::Problem;
use super::screen::{PointUse, Screen};
use super::smoothing::Smoothing;
use pam_data::statistics::{deviation_from_median, median};

/// The model error that is acceptable for control, as a share of the blocked force. Below it more rows do not raise a weight.
const INEXACT: f64 = 0.002;

/// Chunks of the stroke's range, and of the pressure's where pressure moves.
const CHUNKS: usize = 64;

/// The weights of all points.
pub(super) struct Weights {
    /// One per point, about 1/variance in N⁻²; zero where it does not take part.
    pub values: Vec<f64>,
    /// Chunks of stroke, pressure and direction that have points: the number of independent samples that the weights assume.
    pub cells: f64,
}

impl Weights {
    /// Every chunk of stroke at every pressure and direction has the same weight, as far as its rows support it.
    pub(super) fn of(problem: &Problem, screen: &Screen, parameters: &[f64]) -> Self {
        let points = &problem.points;
        let held = problem.pressures.held;
        let deadband = problem.design.origin + parameters.first().copied().unwrap_or(0.0);
        let (stroke, pressure) = (points.stroke, points.pressure);
        let chunk = |x: f64, range: Range, n: f64| {
            if range.span() > 0.0 { ((x - range.low) / range.span() * n).min(n - 1.0) as usize } else { 0 }
        };
        let cell = |i: usize, p: &Point| {
            let place = if held { problem.group_of(i) } else { chunk(p.pressure, pressure, CHUNKS as f64) };
            let branch = (p.direction + 1.0) as usize;
            (place * CHUNKS + chunk(p.stroke, stroke, CHUNKS as f64)) * 3 + branch
        };
        let places = if held { problem.design.groups.max(1) } else { CHUNKS };
        let mut counts = vec![0.0; places * CHUNKS * 3];
        for (i, (p, used)) in points.list.iter().zip(&screen.used).enumerate() {
            if *used == PointUse::Fitted {
                counts[cell(i, p)] += f64::from(p.rows);
            }
        }
        let force = points.force.high.abs().max(points.force.low.abs());
        let noise = points.row_noise.max(1e-6 * force).powi(2);
        let scale = (pressure.high - deadband).max(0.1 * pressure.high.abs()).max(1.0);
        let weight = |(i, (p, used)): (usize, (&Point, &PointUse))| {
            if *used != PointUse::Fitted {
                return 0.0;
            }
            let n = counts[cell(i, p)].max(1.0);
            // Blocked force is proportional to P − P0: errors are judged against it, pressure by pressure.
            let blocked = force * ((p.pressure - deadband) / scale).clamp(0.1, 1.0);
            f64::from(p.rows) / n / (noise / n + (INEXACT * blocked).powi(2))
        };
        Self {
            values: points.list.iter().zip(&screen.used).enumerate().map(weight).collect(),
            cells: counts.iter().filter(|n| **n > 0.0).count().max(1) as f64,
        }
    }
}

/// Scatter of the residuals in each group of pressure, N: a standard deviation from the median of their sizes.
pub(super) fn scatter(problem: &Problem, screen: &Screen, residuals: &[f64]) -> Vec<f64> {
    let mut by_group: Vec<Vec<f64>> = vec![Vec::new(); problem.design.groups.max(1)];
    for (i, (used, r)) in screen.used.iter().zip(residuals).enumerate() {
        if *used == PointUse::Fitted {
            by_group[problem.group_of(i)].push(r.abs());
        }
    }
    let force = problem.points.force.span();
    by_group
        .iter_mut()
        .map(|r| deviation_from_median(median(r)).max(problem.points.row_noise).max(1e-6 * force))
        .collect()
}

/// Huber's weights and the parameters that belong to them: a residual beyond four times the scatter counts in proportion to its size.
///
/// Weights and parameters depend on each other, so they are found in turns. After one round distant readings would still hold the
/// parameters where they had pulled them.
pub(super) fn robust(
    problem: &Problem,
    screen: &Screen,
    whole: &[f64],
    parameters: Vec<f64>,
    smoothing: Smoothing,
) -> (Vec<f64>, Vec<f64>) {
    const ROUNDS: usize = 20;
    let design = &problem.design;
    let (mut weights, mut parameters) = (whole.to_vec(), parameters);
    let mut residuals = design.residuals(&parameters);
    for _ in 0..ROUNDS {
        let by_group = scatter(problem, screen, &residuals);
        let scatter_of = |row: &Row| by_group[design.bins[row.bin as usize].group as usize];
        let scatter: Vec<f64> = design.rows.iter().map(scatter_of).collect();
        let soft = |i: usize| whole[i] * (4.0 * scatter[i] / residuals[i].abs()).min(1.0);
        weights = (0..whole.len()).map(soft).collect();
        parameters = problem.solve(&parameters, &weights, smoothing, 8);
        let moved = design.residuals(&parameters);
        let settled = (0..whole.len()).all(|i| (moved[i] - residuals[i]).abs() <= 0.02 * scatter[i]);
        residuals = moved;
        if settled {
            break;
        }
    }
    (weights, parameters)
}
