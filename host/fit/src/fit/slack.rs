//! Where the muscle is slack or pushed: its force stays at zero or below, and the model must not pull there.

use super::problem::Problem;
use super::screen::{PointUse, Screen};
use super::smoothing::Smoothing;
use super::weights::Weights;

/// Finds where the muscle is slack: the force is near zero where straight curves, fitted to the points that pull, would push.
/// Flexible curves would bend until they described slackness as elasticity. Where the rig pushes the muscle against its contraction stop
/// the force is well below zero: polynomials that followed it would be wrong where the muscle pulls.
///
/// Returns the screen and the parameters of the straight curves; where too few points have a force near zero, both as they were.
pub(super) fn find(problem: &Problem, screen: &Screen, parameters: Vec<f64>) -> (Screen, Vec<f64>) {
    let points = &problem.points;
    let force = points.force.high.max(-points.force.low);
    let floor = problem.clips.0.map_or(0.0, |c| c.force).max(points.force.low).min(0.0);
    let near_zero = floor + (0.02 * force).max(4.0 * points.row_noise);
    let candidates: Vec<bool> = points.list.iter().map(|p| p.force <= near_zero).collect();
    let rows: f64 =
        points.list.iter().zip(&candidates).filter(|(_, c)| **c).map(|(p, _)| f64::from(p.rows)).sum();
    if rows < 0.002 * points.rows as f64 {
        return (screen.clone(), parameters);
    }
    let exclude = |(used, candidate): (&PointUse, &bool)| {
        if *candidate && *used == PointUse::Fitted { PointUse::Slack } else { *used }
    };
    let pulling = screen.with_use(screen.used.iter().zip(&candidates).map(exclude).collect());
    let weights = Weights::of(problem, &pulling, &parameters);
    // No trend with pressure at all: the trend of other points would be continued to where the muscle is slack.
    let mut straight = problem.clone();
    straight.design.level = 10.0;
    let parameters = straight.solve(&parameters, &weights.values, Smoothing::STRAIGHT, 10);
    let curves = problem.design.curves(&parameters);
    let below_zero = floor - 0.03 * force;
    let mut used = screen.used.clone();
    let mut without_pull = 0.0;
    for i in (0..used.len()).filter(|i| candidates[*i]) {
        let e = problem.design.evaluate(i, &parameters, &curves);
        let state = if points.list[i].force < below_zero && e.force < near_zero {
            PointUse::Pushed
        } else if e.force < below_zero {
            PointUse::Slack
        } else {
            continue;
        };
        if !matches!(used[i], PointUse::Clipped | PointUse::Dropout) {
            used[i] = state;
        }
        without_pull += f64::from(points.list[i].rows);
    }
    let goes_slack = without_pull > 0.005 * points.rows as f64;
    if !goes_slack {
        for u in used.iter_mut().filter(|u| matches!(u, PointUse::Slack | PointUse::Pushed)) {
            *u = PointUse::Fitted;
        }
    }
    (Screen { goes_slack, ..screen.with_use(used) }, parameters)
}

/// The result of [`hold_down`].
pub(super) struct HeldDown {
    pub screen: Screen,
    pub weights: Vec<f64>,
    pub parameters: Vec<f64>,
}

/// Takes points of a slack muscle back into the fit where the model would pull: there the force is at most what was read.
pub(super) fn hold_down(
    problem: &Problem,
    screen: &Screen,
    weights: Vec<f64>,
    parameters: Vec<f64>,
    smoothing: Smoothing,
) -> HeldDown {
    const ROUNDS: usize = 16;
    /// From this round on no point is excluded again: otherwise two sets of points may alternate.
    const KEPT_FROM: usize = 4;
    let points = &problem.points;
    let before = &screen.used;
    let excluded = |u: PointUse| matches!(u, PointUse::Slack | PointUse::Clipped);
    let mut result = HeldDown { screen: screen.clone(), weights, parameters };
    if !before.iter().any(|u| excluded(*u)) {
        return result;
    }
    let tolerance = (0.005 * points.force.span()).max(2.0 * points.row_noise);
    let upper = problem.clips.1.map_or(f64::INFINITY, |c| c.force);
    for round in 0..ROUNDS {
        let curves = problem.design.curves(&result.parameters);
        let mut changed = 0;
        for (i, used) in result.screen.used.iter_mut().enumerate() {
            if !excluded(before[i]) || points.list[i].force >= upper {
                continue;
            }
            let model = problem.design.evaluate(i, &result.parameters, &curves).force;
            let above = model > points.list[i].force + tolerance;
            let kept = round >= KEPT_FROM && *used == PointUse::Fitted;
            let wanted = if above || kept { PointUse::Fitted } else { before[i] };
            changed += usize::from(wanted != *used);
            *used = wanted;
        }
        if changed == 0 {
            break;
        }
        result.weights = Weights::of(problem, &result.screen, &result.parameters).values;
        result.parameters = problem.solve(&result.parameters, &result.weights, smoothing, 6);
    }
    // They count in the fit, not in its errors: what the sensor reads of a slack muscle is not the muscle's force.
    result.screen.held_down = result.screen.used.iter().zip(before).map(|(u, b)| u != b).collect();
    result
}
