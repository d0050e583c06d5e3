//! The relaxing part of the bladder's stress as states with one time constant a decade.
//!
//! ```text
//! dz_k/dt = (u − z_k)/τ_k        z̄ = (1/K) Σ z_k
//! ```
//! For a drive `u` that runs straight between two points the step is exact, whatever their distance:
//! `z ← a z + α u_0 + β u_1`, `a = e^(−dt/τ)`, `β = 1 − τ(1 − a)/dt`, `α = (1 − a) − β`. The states restart with each mounting.

use super::campaign::Points;
use super::criteria::{VENT_TIME, VENTED_BEFORE};

/// One time at which the drive is known: a settled point, or a moment at which the muscle is vented.
#[derive(Clone, Copy, Debug)]
struct Node {
    point: Option<usize>,
    /// Whether a mounting begins here.
    begins: bool,
}

/// The steps of the states over a campaign, for one assumption on the pauses between runs.
#[derive(Clone, Debug)]
pub(super) struct StateSteps {
    nodes: Vec<Node>,
    /// `a, α, β` for each node and time constant.
    steps: Vec<[f64; 3]>,
    times: Vec<f64>,
    /// Time since the mounting's first run began, s, of each point.
    pub since: Vec<f64>,
}

/// `a, α, β` of a step.
fn step(dt: f64, time: f64) -> [f64; 3] {
    if !(dt > 0.0) {
        return [1.0, 0.0, 0.0];
    }
    let x = dt / time;
    let faded = -(-x).exp_m1();
    // The difference of two nearly equal numbers where the step is short.
    let late = if x < 1e-4 { 0.5 * x - x * x / 6.0 } else { 1.0 - faded / x };
    [1.0 - faded, faded - late, late]
}

impl StateSteps {
    /// The steps over a campaign. `pause` is what is assumed between runs, s; the bench's clock is used instead where it is known.
    pub(super) fn new(points: &Points, pause: f64, times: &[f64]) -> Self {
        let mut steps = Self {
            nodes: Vec::new(),
            steps: Vec::new(),
            times: times.to_vec(),
            since: vec![0.0; points.len()],
        };
        for mounting in &points.mountings {
            let mut start = 0.0;
            let mut last = 0.0;
            let zero = mounting.runs.first().and_then(|r| points.runs[*r].start);
            for (order, r) in mounting.runs.iter().enumerate() {
                let run = &points.runs[*r];
                if let (Some(zero), Some(own)) = (zero, run.start) {
                    start = own - zero;
                }
                steps.push(Node { point: None, begins: order == 0 }, start - last);
                last = start;
                for i in run.points.0..run.points.1 {
                    let now = start + points.time[i];
                    steps.since[i] = now;
                    steps.push(Node { point: Some(i), begins: false }, now - last);
                    last = now;
                }
                let following = mounting.runs.get(order + 1).and_then(|n| points.runs[*n].start);
                let pause = match (zero, following) {
                    (Some(zero), Some(next)) => (next - zero - last).max(0.0),
                    _ => pause,
                };
                let vented = VENT_TIME.min(0.5 * pause);
                steps.push(Node { point: None, begins: false }, vented);
                start = last + pause;
                last += vented;
            }
        }
        steps
    }

    fn push(&mut self, node: Node, dt: f64) {
        self.nodes.push(node);
        self.steps.extend(self.times.iter().map(|t| step(dt, *t)));
    }

    /// `z̄` at each point for a drive `u` at each point (0 while vented), and a muscle that had carried a drive of 1 for `loaded` seconds before
    /// each mounting's first run.
    pub(super) fn mean_state(&self, drive: &[f64], loaded: f64) -> Vec<f64> {
        let count = self.times.len();
        let fresh: Vec<f64> =
            self.times.iter().map(|t| -(-loaded / t).exp_m1() * (-VENTED_BEFORE / t).exp()).collect();
        let mut states = fresh.clone();
        let mut before = 0.0;
        let mut mean = vec![0.0; self.since.len()];
        for (node, steps) in self.nodes.iter().zip(self.steps.chunks_exact(count)) {
            if node.begins {
                states.copy_from_slice(&fresh);
                before = 0.0;
                continue;
            }
            let now = node.point.map_or(0.0, |i| drive[i]);
            for (z, [a, early, late]) in states.iter_mut().zip(steps) {
                *z = a * *z + early * before + late * now;
            }
            before = now;
            if let Some(i) = node.point {
                mean[i] = states.iter().sum::<f64>() / count as f64;
            }
        }
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::super::campaign::{Mounting, Run};
    use super::*;

    fn held(runs: usize, mountings: usize) -> Points {
        let mut p = Points::default();
        for m in 0..mountings {
            p.mountings.push(Mounting { stroke: 1e-3 * m as f64, contraction: 0.0, runs: Vec::new() });
            for number in 1..=runs {
                let from = p.len();
                for i in 0..100 {
                    p.time.push(0.5 * f64::from(i + 1));
                    p.pressure.push(300.0);
                    p.force.push(100.0);
                    p.direction.push(1);
                    p.mounting.push(m);
                    p.run.push(p.runs.len());
                }
                p.mountings[m].runs.push(p.runs.len());
                let points = (from, p.len());
                p.runs.push(Run { mounting: m, number, recording: 0, points, start: None, zero: 0.0 });
            }
        }
        p
    }

    #[test]
    fn a_ramp_then_a_hold_is_answered_as_in_closed_form() {
        let points = held(1, 1);
        let z = StateSteps::new(&points, 5.0, &[10.0]).mean_state(&vec![1.0; 100], 0.0);
        // dz/dt = (t/0.5 − z)/10 to 0.5 s, then (1 − z)/10.
        let ramped = (0.5 - 10.0 * (1.0 - (-0.05_f64).exp())) / 0.5;
        for (i, time) in [(0, 0.0_f64), (50, 25.0), (99, 49.5)] {
            let exact = 1.0 - (1.0 - ramped) * (-time / 10.0).exp();
            assert!((z[i] - exact).abs() < 1e-12, "{i}: {} {exact}", z[i]);
        }
    }

    #[test]
    fn the_states_outlive_a_pause_and_restart_with_a_mounting() {
        let points = held(2, 2);
        let z =
            StateSteps::new(&points, 5.0, &super::super::criteria::TIMES).mean_state(&vec![1.0; 400], 0.0);
        assert!(z[100] > z[0] + 0.2, "the second run starts from the first: {} {}", z[0], z[100]);
        assert_eq!(z[..200], z[200..]);
    }

    #[test]
    fn steps_sum_to_the_same_whether_short_or_long() {
        let [a, early, late] = step(1e-3, 1e4);
        assert!((a + early + late - 1.0).abs() < 1e-15 && (early / late - 1.0).abs() < 1e-6);
        let [_, early, late] = step(1.0001, 1e4);
        assert!((early / late - 1.0).abs() < 1e-3);
    }
}
