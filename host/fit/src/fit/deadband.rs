//! `P0` from a higher order of the elastic polynomial, where a low order would bias it.

use model_core::table::MAX_ORDER;

use super::Options;
use super::design::Layout;
use super::problem::Problem;
use super::screen::Screen;
use super::smoothing::{self, Smoothing};
use super::uncertainty::jackknife_root;
use super::weights::robust;

/// `P0` with its standard deviation, Pa.
#[derive(Debug, Clone, Copy)]
pub(super) struct Deadband {
    pub value: f64,
    pub std: f64,
}

/// Finds `P0` by the highest order that the strokes determine. `None` where the dimensions are fitted too, where there is only one
/// pressure, or where the strokes determine no higher order.
///
/// At rest length no elastic term acts, so `P0` is the intercept of the blocked force. Away from it `P0` and the `E_k` are correlated,
/// and the part of the bladder that a low order cannot describe would enter `P0`: with M = 4 on a hyperelastic wall it is off by up to 1 kPa,
/// with M = 6 by a fifth of that. Where no row is near rest length the curve is extrapolated, and a low order misses `P0` by many times
/// its scatter (by 8 kPa from 0.8 % of contraction on, with M = 4). Then the change that the last order made indicates how far the
/// next ones might go, and half of it joins the standard deviation.
pub(super) fn find(
    problem: &Problem,
    screen: &Screen,
    weights: &[f64],
    parameters: &[f64],
    options: &Options,
) -> Option<Deadband> {
    if options.fit_geometry || options.fit_lengths || problem.pressures.levels.len() < 2 {
        return None;
    }
    let near = problem.deadband(parameters);
    let by = |order: usize| by_order(problem, screen, weights, near, order, options);
    let (order, found) = (options.order + 1..=MAX_ORDER).rev().find_map(|m| Some((m, by(m)?)))?;
    let extrapolated = if reaches_rest(problem) {
        0.0
    } else {
        by(order - 1).map_or(0.0, |before| 0.5 * (found.value - before.value))
    };
    Some(Deadband { std: found.std.hypot(extrapolated), ..found })
}

/// The problem with `P0` held at a value, and the parameters for it: the prior is stiffer than all points together.
pub(super) fn hold(
    mut problem: Problem,
    weights: &[f64],
    mut parameters: Vec<f64>,
    value: f64,
) -> (Problem, Vec<f64>) {
    parameters[Layout::DEADBAND] = 0.0;
    problem.design.origin = value;
    let of_points = problem.design.normal(&parameters, weights).matrix.at(Layout::DEADBAND, Layout::DEADBAND);
    problem.design.hold_deadband = 1e4 * of_points;
    (problem, parameters)
}

/// Whether rows lie near enough to rest length to measure the blocked force.
fn reaches_rest(problem: &Problem) -> bool {
    problem.points.stroke.low <= 0.02 * problem.points.stroke.high
}

/// `P0` by a fit of this order, from a start `near`, Pa; `None` where the strokes do not determine as many coefficients.
fn by_order(
    problem: &Problem,
    screen: &Screen,
    weights: &[f64],
    near: f64,
    order: usize,
    options: &Options,
) -> Option<Deadband> {
    let finer = problem.of_order(screen, order);
    if finer.design.orthonormal.rank < order {
        return None;
    }
    let parameters = finer.solve(&finer.design.start(near), weights, Smoothing::START, 8);
    let smoothing = match options.smoothing {
        Some(weight) => Smoothing { elastic: weight, friction: weight },
        None => {
            let groups = finer.design.normal_by_group(&finer.design.bin_sums(&parameters, weights));
            smoothing::choose(&finer.design, &parameters, &groups, smoothing::points_with_weight(weights)).0
        }
    };
    let (weights, parameters) = robust(&finer, screen, weights, parameters, smoothing);
    let data = finer.design.normal(&parameters, &weights);
    let penalty = finer.penalty(&data, smoothing);
    let root = jackknife_root(&finer, screen, &weights, &parameters, (&data, &penalty));
    Some(Deadband { value: finer.deadband(&parameters), std: root.std(Layout::DEADBAND) })
}
