//! The frame between crosshead, muscle and load cell, and what the cell makes of it.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What stands between the instruments and the muscle; everything off is a stiff, massless rig.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rig {
    /// Spring rate of frame and couplings, N/m; 0 for rigid. The muscle pulls its frame along and is shorter than the
    /// crosshead shows.
    pub stiffness: f64,
    /// Play of a joint, m: the muscle's end follows the crosshead only at the play's edges, which are soft.
    pub play: f64,
    /// Zero error of the stroke, m: the muscle is shorter by this than the crosshead shows.
    pub offset: f64,
    /// Moving mass between muscle and cell, kg.
    pub mass: f64,
    /// Weight that hangs in the cell's reading, N.
    pub weight: f64,
    /// Force at the cell per pressure of the hose, N/Pa.
    pub hose: f64,
    /// Angle between muscle and cell axis, rad: the cell sees the cosine, and a guide rubs with the sine.
    pub misalignment: f64,
    /// Friction coefficient of the guide that carries the side load.
    pub guide: f64,
    /// Zero of the cell as it warms up: amount, N, and time, s.
    pub warm_up: (f64, f64),
    /// A room that breathes: amplitude of the cell's zero, N, and period, s. Outside the catalogue.
    pub room: (f64, f64),
    /// Mounts that stick and jump: amplitude, N, and the travel between jumps, m. Outside the catalogue.
    pub stick_slip: (f64, f64),
    /// Mains hum seen through the sampling: amplitude, N, and the beat's frequency, Hz. Outside the catalogue.
    pub hum: (f64, f64),
}

/// The rig's memory.
#[derive(Debug, Clone)]
pub(crate) struct RigState {
    with: Rig,
    played: Option<f64>,
    last: Option<(f64, f64)>,
    guide: f64,
    stuck: f64,
    clock: f64,
}

/// How exactly the give of the frame is known, m: a hundredth of a newton at the stiffest frame and muscle.
const SOLVED: f64 = 1e-10;
/// Steps towards it at most.
const SOLUTION_STEPS: usize = 60;

/// Travel in which the guide's friction builds up, m.
const GUIDE_TRAVEL: f64 = 20e-6;

impl RigState {
    /// A rig that has not been loaded yet.
    pub fn new(with: Rig) -> Self {
        Self { with, played: None, last: None, guide: 0.0, stuck: 0.0, clock: 0.0 }
    }

    /// Stroke of the muscle (m) when the crosshead is at `crosshead` (m). `force` gives the pull of the muscle at a stroke, N.
    pub fn stroke(&mut self, crosshead: f64, force: impl Fn(f64) -> f64) -> f64 {
        let mut stroke = crosshead + self.with.offset;
        if self.with.stiffness > 0.0 {
            stroke += self.give(|give| force(self.through_play(stroke + give)));
        }
        let stroke = self.through_play(stroke);
        self.played = Some(stroke);
        stroke
    }

    /// How far frame and couplings give, m: their spring holds what the muscle pulls with where this has brought it, `force` of the give, N.
    ///
    /// A muscle pulls the less, the shorter it is, so the solution is one, between none and what the force without any give would do. It is
    /// found by false position in Illinois form (M. Dowell, P. Jarratt, BIT 11 (1971) 168–174): strands that stick make the muscle many
    /// times stiffer from one point to the next.
    fn give(&self, force: impl Fn(f64) -> f64) -> f64 {
        let too_far = |give: f64| give - force(give) / self.with.stiffness;
        let at_none = too_far(0.0);
        let (mut low, mut high) = (0.0, -at_none);
        let (mut at_low, mut at_high) = (at_none, too_far(high));
        let mut last_side = 0;
        for _ in 0..SOLUTION_STEPS {
            let across = at_high - at_low;
            if across == 0.0 || (high - low).abs() < SOLVED {
                break;
            }
            let middle = low - at_low * (high - low) / across;
            let at_middle = too_far(middle);
            if at_middle.abs() < SOLVED {
                return middle;
            }
            let side = if (at_middle > 0.0) == (at_high > 0.0) { 1 } else { -1 };
            if side > 0 {
                (high, at_high) = (middle, at_middle);
                if last_side > 0 {
                    at_low *= 0.5;
                }
            } else {
                (low, at_low) = (middle, at_middle);
                if last_side < 0 {
                    at_high *= 0.5;
                }
            }
            last_side = side;
        }
        0.5 * (low + high)
    }

    /// Where the muscle's end is beyond the play, when what holds it is at `stroke`, m.
    fn through_play(&self, stroke: f64) -> f64 {
        if self.with.play <= 0.0 {
            return stroke;
        }
        let at = self.played.unwrap_or(stroke);
        let gap = stroke - at;
        // Soft edges: the joint bears on a tenth of the play.
        let edge = 0.5 * self.with.play;
        let soft = 0.1 * self.with.play;
        let beyond = (gap.abs() - edge + soft).max(0.0);
        let push = if beyond < 2.0 * soft { beyond * beyond / (4.0 * soft) } else { beyond - soft };
        at + gap.signum() * push.min(gap.abs())
    }

    /// Force at the cell, N.
    pub(crate) fn at_cell(&mut self, force: f64, pressure: f64, stroke: f64, dt: f64) -> f64 {
        let w = &self.with;
        self.clock += dt;
        let (x, v) = self.last.unwrap_or((stroke, 0.0));
        let dx = stroke - x;
        let speed = if dt > 0.0 { dx / dt } else { 0.0 };
        let acceleration = if dt > 0.0 { (speed - v) / dt } else { 0.0 };
        self.last = Some((stroke, speed));
        let mut cell = force - w.mass * acceleration + w.weight + w.hose * pressure;
        if w.misalignment != 0.0 {
            let way = if dx > 0.0 { 1.0 } else { -1.0 };
            self.guide = way + (self.guide - way) * (-dx.abs() / GUIDE_TRAVEL).exp();
            let side = force.abs() * w.misalignment.sin().abs();
            cell += force * (w.misalignment.cos() - 1.0) - w.guide * side * self.guide;
        }
        if w.warm_up.1 > 0.0 {
            cell += w.warm_up.0 * (1.0 - (-self.clock / w.warm_up.1).exp());
        }
        if w.room.1 > 0.0 {
            cell += w.room.0 * (TAU * self.clock / w.room.1).sin();
        }
        if w.stick_slip.1 > 0.0 {
            self.stuck += dx;
            if self.stuck.abs() > w.stick_slip.1 {
                self.stuck = 0.0;
            }
            cell -= w.stick_slip.0 * self.stuck / w.stick_slip.1;
        }
        cell + w.hum.0 * (TAU * w.hum.1 * self.clock).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loose_joint_follows_only_at_its_edges() {
        let mut r = RigState::new(Rig { play: 1e-4, ..Rig::default() });
        let mut end = 0.0;
        for i in 0..=1000 {
            end = r.stroke(f64::from(i) * 1e-6, |_| 0.0);
        }
        assert!((1e-3 - end - 0.5e-4).abs() < 1e-5, "lags by half the play: {end}");
        let turned = r.stroke(1e-3 - 0.5e-4, |_| 0.0);
        assert!((turned - end).abs() < 1e-6, "and stays there on the way back: {turned} {end}");
    }

    #[test]
    fn a_soft_frame_balances_the_pull_of_a_muscle_with_sticking_strands() {
        // Four times as stiff as the frame, until the friction of 40 N is full.
        let mut r = RigState::new(Rig { stiffness: 1e5, ..Rig::default() });
        let force = |x: f64| 100.0 - (4e5 * x).min(40.0) - 2e3 * x;
        for i in 0..400 {
            let crosshead = 1e-6 * f64::from(i);
            let x = r.stroke(crosshead, force);
            assert!((1e5 * (x - crosshead) - force(x)).abs() < 1e-4, "{i}: {x}");
        }
    }

    #[test]
    fn a_frame_yields_while_the_pressure_rises_at_a_fixed_crosshead() {
        let mut r = RigState::new(Rig { stiffness: 1e6, ..Rig::default() });
        for newtons in 0..1000 {
            let x = r.stroke(0.0, |x| f64::from(newtons) - 8e4 * x);
            assert!((1e6 * x - (f64::from(newtons) - 8e4 * x)).abs() < 1e-3, "at {newtons} N: {x}");
        }
    }

    #[test]
    fn a_muscle_that_pushes_lengthens_in_a_soft_frame() {
        let mut r = RigState::new(Rig { stiffness: 1e5, ..Rig::default() });
        let x = r.stroke(1e-3, |x| -30.0 - 2e3 * x);
        assert!((1e5 * (x - 1e-3) - (-30.0 - 2e3 * x)).abs() < 1e-4, "{x}");
    }
}
