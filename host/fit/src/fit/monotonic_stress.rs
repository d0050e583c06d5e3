//! The constraint that the bladder's stress rises with strain, on request.

use model_core::units::Length;

use super::points::Range;
use super::problem::Problem;
use super::screen::{PointUse, Screen};
use super::smoothing::Smoothing;
use crate::numerics::symmetric::{Symmetric, dot};

/// Most rounds of growing penalty.
const ROUNDS: usize = 10;

/// Constrains the stress `Σ E_k ε^k` to rise with strain, at every node and wherever the recordings strained the bladder in hoop or in
/// axial direction. A slope that would fall is held at zero by a penalty that doubles until it does not fall.
///
/// Returns the problem with that penalty, and its solution.
pub(super) fn constrain(
    problem: &Problem,
    screen: &Screen,
    weights: &[f64],
    parameters: Vec<f64>,
    smoothing: Smoothing,
) -> (Problem, Vec<f64>) {
    let (mut problem, mut parameters) = (problem.clone(), parameters);
    let slopes = slopes(&problem, screen);
    let layout = problem.design.layout();
    let mut weight = 10.0;
    for _ in 0..ROUNDS {
        let data = problem.design.normal(&parameters, weights);
        let scale = data.weight / layout.nodes as f64;
        let mut held = Symmetric::zeros(layout.len());
        let mut worst = 0.0_f64;
        for j in 0..layout.nodes {
            for a in &slopes {
                let size = dot(a, a).sqrt();
                let row: Vec<(usize, f64)> =
                    a.iter().enumerate().map(|(k, v)| (layout.elastic(k, j), v / size)).collect();
                let slope: f64 = row.iter().map(|(i, v)| v * parameters[*i]).sum();
                worst = worst.min(slope);
                if slope < 0.0 {
                    held.add_row(&row, weight * scale);
                }
            }
        }
        if worst > -1e-4 * problem.points.force.span() {
            break;
        }
        // What was held stays held, or the next step would fall back.
        match &mut problem.design.held {
            Some(all) => all.add_scaled(&held, 1.0),
            none => *none = Some(held),
        }
        weight *= 2.0;
        parameters = problem.solve(&parameters, weights, smoothing, 6);
    }
    (problem, parameters)
}

/// `dσ/dε` as rows of coefficients of the `ẽ_k`, at strains spread over what the recordings reached.
fn slopes(problem: &Problem, screen: &Screen) -> Vec<Vec<f64>> {
    let used = |u: &PointUse| matches!(u, PointUse::Fitted | PointUse::NearReversal);
    let strokes = Range::of(
        problem
            .points
            .list
            .iter()
            .zip(&screen.used)
            .zip(&problem.shift)
            .filter(|((_, u), _)| used(u))
            .map(|((p, _), s)| p.stroke + s),
    );
    let at = |x: f64| problem.braid.posture(Length::from_metres(x));
    let (a, b) = (at(strokes.low), at(strokes.high));
    let order = problem.design.layout().order;
    let t = &problem.design.orthonormal.t;
    let strains = (0..=24).flat_map(|i| {
        let part = f64::from(i) / 24.0;
        let between = |x: f64, y: f64| x + (y - x) * part;
        [between(a.radial_strain, b.radial_strain), between(a.axial_strain, b.axial_strain)]
    });
    // dσ/dε = Σ_i i E_i ε^(i−1) with E = T ẽ.
    strains
        .map(|e| {
            (0..order)
                .map(|k| (0..=k).map(|i| (i + 1) as f64 * e.powi(i as i32) * t[i * order + k]).sum())
                .collect()
        })
        .collect()
}
