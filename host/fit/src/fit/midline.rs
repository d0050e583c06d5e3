//! F_AVG: the mid-line of the hysteresis loop, chunk by chunk.
//!
//! In each chunk ([`super::chunks`]) force and stroke are averaged over both branches and all cycles, each branch first separately. A
//! chunk with one branch only has that branch's force with the fitted friction taken off.

use super::chunks::in_chunks;
use super::solution::Solution;

/// One chunk of a mid-line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MidPoint {
    /// Index of the tested level, or of the interval of a continuous range.
    pub group: u32,
    /// Mean pressure, Pa.
    pub pressure: f64,
    /// Mean stroke, m.
    pub stroke: f64,
    /// Contraction ΔL/L0.
    pub contraction: f64,
    /// The mid-line force `F_AVG`, N.
    pub force: f64,
    /// Mean force while shortening, N; `None` without that branch.
    pub shortening: Option<f64>,
    /// Mean force while lengthening, N; `None` without that branch.
    pub lengthening: Option<f64>,
    /// The blocked force `F_B` at this pressure, N.
    pub blocked: f64,
}

/// The mid-lines of all pressures, in order of group, finer pressure and contraction.
#[must_use]
pub fn midline(solution: &Solution) -> Vec<MidPoint> {
    let l0 = solution.problem.braid.rest_length();
    let samples = solution.counted_points().map(|(i, place)| {
        let p = &solution.problem.points.list[i];
        (place, [p.pressure, p.stroke + solution.problem.shift[i], p.force])
    });
    in_chunks(samples)
        .into_iter()
        .map(|chunk| {
            let [pressure, stroke, mean] = chunk.mean();
            let [lengthening, _, shortening] = chunk.branches.map(|b| b.map(|[.., force]| force));
            let friction =
                if solution.problem.design.friction { solution.curves_at(pressure).1 } else { 0.0 };
            let force = match (shortening, lengthening) {
                (Some(up), None) => up / (1.0 - friction),
                (None, Some(down)) => down / (1.0 + friction),
                _ => mean,
            };
            MidPoint {
                group: chunk.group,
                pressure,
                stroke,
                contraction: stroke / l0,
                force,
                shortening,
                lengthening,
                blocked: solution.blocked_for_errors(pressure),
            }
        })
        .collect()
}
