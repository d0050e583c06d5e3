//! How uncertain the parameters are: a jackknife over blocks of the motion.
//!
//! Residuals are correlated in time (noise that is coloured, misfit that lasts), so single rows are not independent witnesses.
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
use super::normal_equations::NormalEquations;
use super::problem::Problem;
use super::screen::Screen;
use super::solution::Solution;
use super::weights::scatter;
use crate::numerics::covariance_root::CovarianceRoot;
use crate::numerics::jackknife::covariance_root;
use crate::numerics::student::half_width_95;
use crate::numerics::symmetric::Symmetric;
use pam_data::statistics::NORMAL_95;

/// The uncertainty of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// Root of the covariance of the parameters in the order of [`Layout`].
    pub root: CovarianceRoot,
    /// The number of blocks left out in turn.
    pub blocks: usize,
    /// Integrated autocorrelation time of the residuals, in points.
    pub correlation: f64,
    /// Autocorrelation of the residuals within half-strokes, by lag in points, from lag 0.
    pub autocorrelation: Vec<f64>,
}

/// At most this many blocks: more cost time and add nothing.
const MOST_BLOCKS: usize = 240;

/// Lags of the autocorrelation that reports show.
const SHOWN_LAGS: usize = 60;

/// The normal equations at the parameters, and the penalty that belongs to them.
pub(super) type Equations<'a> = (&'a NormalEquations, &'a Symmetric);

/// Runs the jackknife. `deadband_std` is the standard deviation of a `P0` that is held, Pa.
pub(super) fn jackknife(
    problem: &Problem,
    screen: &Screen,
    weights: &[f64],
    parameters: &[f64],
    equations: Equations<'_>,
    deadband_std: Option<f64>,
) -> Uncertain {
    let residuals = Residuals::of(problem, screen, weights, parameters);
    let correlation = residuals.correlation_time();
    let blocks = blocks(problem, weights, correlation);
    let mut root = leave_out(&problem.design, parameters, weights, equations, &blocks);
    if let Some(std) = deadband_std {
        root.append(&follow_deadband(&problem.design, equations, std));
    }
    let autocorrelation = (0..=SHOWN_LAGS).map(|lag| residuals.autocorrelation(lag)).collect();
    Uncertain { root, blocks: blocks.len(), correlation, autocorrelation }
}

/// The root of the covariance alone, of a `P0` that is not held.
pub(super) fn jackknife_root(
    problem: &Problem,
    screen: &Screen,
    weights: &[f64],
    parameters: &[f64],
    equations: Equations<'_>,
) -> CovarianceRoot {
    let correlation = Residuals::of(problem, screen, weights, parameters).correlation_time();
    leave_out(&problem.design, parameters, weights, equations, &blocks(problem, weights, correlation))
}

/// How all parameters follow when a held `P0` moves by `std`, Pa.
fn follow_deadband(design: &Design, (data, penalty): Equations<'_>, std: f64) -> Vec<f64> {
    let mut matrix = data.matrix.clone();
    matrix.add_scaled(penalty, 1.0);
    let mut right = vec![0.0; matrix.n];
    right[Layout::DEADBAND] = design.hold_deadband * std;
    matrix.factor().solve(&right)
}

fn leave_out(
    design: &Design,
    parameters: &[f64],
    weights: &[f64],
    (data, penalty): Equations<'_>,
    blocks: &[Range<usize>],
) -> CovarianceRoot {
    let curves = design.curves(parameters);
    let mut whole = data.matrix.clone();
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
    let mut root = covariance_root(&columns, design.layout().len());
    root.scale(few_blocks(columns.len()));
    root
}

/// Factor on the standard deviations by which `NORMAL_95` of them are the 95 % interval of Student's t, of a jackknife over so few blocks.
fn few_blocks(blocks: usize) -> f64 {
    half_width_95(blocks.saturating_sub(1).max(1)) / NORMAL_95
}

/// The residuals in standard deviations of their group (NaN where a point does not take part), correlated within half-strokes only.
struct Residuals {
    values: Vec<f64>,
    /// The half-stroke of each.
    block: Vec<u32>,
    /// Sum of the squares of all values.
    square: f64,
}

impl Residuals {
    fn new(values: Vec<f64>, block: Vec<u32>) -> Self {
        let square = values.iter().filter(|v| v.is_finite()).map(|v| v * v).sum();
        Self { values, block, square }
    }

    fn of(problem: &Problem, screen: &Screen, weights: &[f64], parameters: &[f64]) -> Self {
        let residuals = problem.design.residuals(parameters);
        let scatter = scatter(problem, screen, &residuals);
        let list = &problem.points.list;
        let standard = |i: usize| {
            if weights[i] > 0.0 {
                (residuals[i] / scatter[problem.group_of(i)]).clamp(-4.0, 4.0)
            } else {
                f64::NAN
            }
        };
        Self::new((0..list.len()).map(standard).collect(), list.iter().map(|p| p.block).collect())
    }

    /// The autocorrelation at a lag.
    ///
    /// The sum of the products is divided by that of the squares of all values, not by its own count (the biased estimator: M. B.
    /// Priestley, Spectral Analysis and Time Series, Academic Press 1981, section 5.3.3). Divided by its count, a lag that only a few
    /// long blocks reach takes any value, also −1.
    fn autocorrelation(&self, lag: usize) -> f64 {
        if !(self.square > 0.0) {
            return if lag == 0 { 1.0 } else { 0.0 };
        }
        let (values, block) = (&self.values, &self.block);
        let pairs = values.iter().zip(block).zip(values.iter().zip(block).skip(lag));
        let products = pairs.filter(|((_, a), (_, b))| a == b).map(|((x, _), (y, _))| x * y);
        products.filter(|p| p.is_finite()).sum::<f64>() / self.square
    }

    /// `1 + 2 Σ ρ_l`, summed until `ρ` falls below a twentieth.
    fn correlation_time(&self) -> f64 {
        let lags = (1..400).map(|lag| self.autocorrelation(lag));
        1.0 + 2.0 * lags.take_while(|rho| *rho >= 0.05).sum::<f64>()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_blocks_widen_the_interval_by_students_t() {
        assert!((few_blocks(2) * NORMAL_95 - 12.706).abs() < 1e-2);
        assert!((few_blocks(6) * NORMAL_95 - 2.571).abs() < 1e-2);
        assert!((few_blocks(100_000) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_lag_that_one_block_reaches_is_uncertain() {
        // Forty short half-strokes and a long one whose ends differ in sign.
        let mut values: Vec<f64> = (0..400).map(|i| if i % 3 == 0 { 1.0 } else { -0.5 }).collect();
        let mut block: Vec<u32> = (0..400).map(|i| i / 10).collect();
        values.extend((0..60).map(|i| {
            if i < 10 {
                2.0
            } else if i < 50 {
                0.0
            } else {
                -2.0
            }
        }));
        block.extend([100; 60]);
        let residuals = Residuals::new(values, block);
        let far = residuals.autocorrelation(50);
        assert!(far < 0.0 && far > -0.2, "{far}");
        assert!((residuals.autocorrelation(0) - 1.0).abs() < 1e-12);
        assert!((0..70).all(|lag| residuals.autocorrelation(lag).abs() <= 1.0));
    }

    #[test]
    fn independent_values_have_no_memory_and_a_constant_block_is_one_value() {
        let mut state = 1_u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        let white: Vec<f64> = (0..4000).map(|_| draw()).collect();
        let one = vec![0; 4000];
        assert!(Residuals::new(white, one).correlation_time() < 1.3);
        // Half-strokes of 20 points with one error each: a point is worth a twentieth.
        let steps: Vec<f64> = (0..200).flat_map(|_| [draw(); 20]).collect();
        let block: Vec<u32> = (0..200).flat_map(|b| [b; 20]).collect();
        let time = Residuals::new(steps, block).correlation_time();
        assert!((18.0..21.0).contains(&time), "{time}");
    }
}
