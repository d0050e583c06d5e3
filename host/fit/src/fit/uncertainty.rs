//! How uncertain the parameters are: a jackknife over blocks of the motion.
//!
//! Residuals are correlated in time (noise that is coloured, misfit that lasts), so single rows are no independent witnesses.
//! Blocks are stretches of a half-stroke several autocorrelation times long. Each is left out in turn; around the
//! solution that is a subtraction from the normal equations:
//!
//! ```text
//! θ₍₋b₎ − θ = −(N + S − N_b)⁻¹ s_b          C = (n_b − 1)/n_b Σ_b (θ₍₋b₎ − θ)(θ₍₋b₎ − θ)ᵀ
//! ```
//! with `N_b = Σ w J Jᵀ` and `s_b = Σ w J r` of the block, `S` the penalty. Leaving out, instead of only weighing, accounts for
//! blocks that the fit follows closely because little else determines the same parameters (B. Efron and C. Stein,
//! Ann. Statist. 9 (1981) 586, doi 10.1214/aos/1176345462).

use std::ops::Range;

use super::design::{Design, Layout};
use super::problem::Problem;
use super::screen::Screen;
use super::solution::Solution;
use super::weights::scatter;
use crate::numerics::covariance_root::CovarianceRoot;
use crate::numerics::jackknife::covariance_root;
use crate::numerics::symmetric::Symmetric;

/// The uncertainty of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// Root of the covariance of the parameters in the order of [`Layout`].
    pub root: CovarianceRoot,
    /// The number of blocks left out in turn.
    pub blocks: usize,
    /// Integrated autocorrelation time of the residuals, in points.
    pub correlation: f64,
}

/// At most this many blocks: more cost time and add nothing.
const MOST_BLOCKS: usize = 240;

/// Runs the jackknife. `deadband_std` is the standard deviation of a `P0` that is held, Pa.
pub(super) fn jackknife(
    problem: &Problem,
    screen: &Screen,
    weights: &[f64],
    parameters: &[f64],
    penalty: &Symmetric,
    deadband_std: Option<f64>,
) -> Uncertain {
    let correlation = correlation_time(problem, screen, weights, parameters);
    let blocks = blocks(problem, weights, correlation);
    let mut root = leave_out(&problem.design, parameters, weights, penalty, &blocks);
    if let Some(std) = deadband_std {
        root.append(&follow_deadband(&problem.design, weights, parameters, penalty, std));
    }
    Uncertain { root, blocks: blocks.len(), correlation }
}

/// How all parameters follow when a held `P0` moves by `std`, Pa.
fn follow_deadband(
    design: &Design,
    weights: &[f64],
    parameters: &[f64],
    penalty: &Symmetric,
    std: f64,
) -> Vec<f64> {
    let mut matrix = design.normal(parameters, weights).matrix;
    matrix.add_scaled(penalty, 1.0);
    let mut right = vec![0.0; matrix.n];
    right[Layout::DEADBAND] = design.hold_deadband * std;
    matrix.factor().solve(&right)
}

fn leave_out(
    design: &Design,
    parameters: &[f64],
    weights: &[f64],
    penalty: &Symmetric,
    blocks: &[Range<usize>],
) -> CovarianceRoot {
    let curves = design.curves(parameters);
    let mut whole = design.normal(parameters, weights).matrix;
    whole.add_scaled(penalty, 1.0);
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(blocks.len());
    for block in blocks {
        let part = design.normal_of(block.clone(), parameters, &curves, weights);
        if part.weight <= 0.0 {
            continue;
        }
        let mut without = whole.clone();
        without.add_scaled(&part.matrix, -1.0);
        columns.push(without.factor().solve(&part.right));
    }
    covariance_root(&columns, design.layout().len())
}

/// `1 + 2 Σ ρ_l` of the weighted residuals within half-strokes, summed until `ρ` falls below a twentieth.
fn correlation_time(problem: &Problem, screen: &Screen, weights: &[f64], parameters: &[f64]) -> f64 {
    let residuals = problem.design.residuals(parameters);
    let scatter = scatter(problem, screen, &residuals);
    let list = &problem.points.list;
    let standard: Vec<f64> = (0..list.len())
        .map(|i| {
            if weights[i] > 0.0 {
                (residuals[i] / scatter[problem.group_of(i)]).clamp(-4.0, 4.0)
            } else {
                f64::NAN
            }
        })
        .collect();
    let product = |lag: usize| {
        let (mut sum, mut n) = (0.0, 0.0);
        for i in 0..list.len().saturating_sub(lag) {
            let p = standard[i] * standard[i + lag];
            if list[i].block == list[i + lag].block && p.is_finite() {
                sum += p;
                n += 1.0;
            }
        }
        if n > 0.0 { sum / n } else { 0.0 }
    };
    let variance = product(0);
    let mut time = 1.0;
    if variance > 0.0 {
        for lag in 1..400 {
            let rho = product(lag) / variance;
            if rho < 0.05 {
                break;
            }
            time += 2.0 * rho;
        }
    }
    time
}

/// Stretches of half-strokes, at least four correlation times long where the half-stroke is.
fn blocks(problem: &Problem, weights: &[f64], correlation: f64) -> Vec<Range<usize>> {
    let list = &problem.points.list;
    let used = weights.iter().filter(|w| **w > 0.0).count();
    let length = (4.0 * correlation).max(used as f64 / MOST_BLOCKS as f64).max(1.0);
    let mut blocks = Vec::new();
    let mut start = 0;
    while start < list.len() {
        let end = start + list[start..].iter().take_while(|p| p.block == list[start].block).count();
        let fitted: Vec<usize> = (start..end).filter(|i| weights[*i] > 0.0).collect();
        if !fitted.is_empty() {
            let pieces = ((fitted.len() as f64 / length) as usize).max(1);
            for k in 0..pieces {
                let from = fitted[k * fitted.len() / pieces];
                let to = if k + 1 < pieces { fitted[(k + 1) * fitted.len() / pieces] } else { end };
                blocks.push(from..to);
            }
        }
        start = end;
    }
    // Half-strokes shorter than that are joined with their neighbours, so that the number of blocks stays bounded.
    while blocks.len() > 2 * MOST_BLOCKS {
        blocks = blocks.chunks(2).map(|c| c[0].start..c[c.len() - 1].end).collect();
    }
    blocks
}

/// The root for the numbers of a table: `P0`, `E_k` at every given pressure (Pa), `k_F` at every one.
#[must_use]
pub fn table_root(solution: &Solution, root: &CovarianceRoot, pressures: &[f64]) -> CovarianceRoot {
    let design = &solution.problem.design;
    let layout = design.layout();
    let mut rows = Vec::with_capacity(1 + (layout.order + 1) * pressures.len());
    let mut unit = vec![0.0; layout.len()];
    unit[Layout::DEADBAND] = 1.0;
    rows.push(unit);
    let phis: Vec<Vec<f64>> = pressures.iter().map(|p| design.basis.at(*p)).collect();
    for i in 0..layout.order {
        for phi in &phis {
            let mut row = vec![0.0; layout.len()];
            for k in i..layout.order {
                let t = design.orthonormal.t[i * layout.order + k];
                for (j, v) in phi.iter().enumerate() {
                    row[layout.elastic(k, j)] = t * v;
                }
            }
            rows.push(row);
        }
    }
    for phi in &phis {
        let mut row = vec![0.0; layout.len()];
        for (j, v) in phi.iter().enumerate() {
            row[layout.friction(j)] = *v;
        }
        rows.push(row);
    }
    root.transformed(&rows)
}
