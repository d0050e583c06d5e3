//! The frame between crosshead, muscle and load cell, and what the cell makes of it.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What stands between the instruments and the muscle; everything off is a stiff, massless rig.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rig {
    /// Spring rate of frame and couplings, N/m; 0 for rigid. The muscle pulls its frame along and is shorter than the
    /// crosshead tells.
    pub stiffness: f64,
    /// Play of a joint, m: the muscle's end follows the crosshead only at the play's edges, which are soft.
    pub play: f64,
    /// Zero error of the stroke, m: the muscle is shorter by this than the crosshead tells.
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
pub struct RigState {
    with: Rig,
    pull: f64,
    /// Where the muscle's end was in the last step, m; and before, with the force that it then gave, N.
    muscle_at: f64,
    bore: Option<(f64, f64)>,
    /// Recent stiffness of the muscle, N/m.
    muscle_stiffness: f64,
    played: Option<f64>,
    last: Option<(f64, f64)>,
    guide: f64,
    stuck: f64,
    clock: f64,
}

/// Travel in which the guide's friction builds up, m.
const GUIDE_TRAVEL: f64 = 20e-6;

impl RigState {
    /// Unloaded.
    pub fn new(with: Rig) -> Self {
        Self {
            with,
            pull: 0.0,
            muscle_at: 0.0,
            bore: None,
            muscle_stiffness: 0.0,
            played: None,
            last: None,
            guide: 0.0,
            stuck: 0.0,
            clock: 0.0,
        }
    }

    /// Stroke of the muscle (m) when the crosshead is at `crosshead` (m) under the force of the last step (N).
    pub fn stroke(&mut self, crosshead: f64, force: f64) -> f64 {
        let mut stroke = crosshead + self.with.offset;
        if self.with.stiffness > 0.0 {
            // A step of Newton's method, by how stiff the muscle has just shown itself: while its strands stick it is many times stiffer
            // than while they slide, and the two must not chase each other.
            if let Some((x, f)) = self.bore {
                let seen = if self.muscle_at == x { 0.0 } else { ((force - f) / (self.muscle_at - x)).abs() };
                self.muscle_stiffness = seen.max(0.9 * self.muscle_stiffness);
            }
            self.bore = Some((self.muscle_at, force));
            let part = self.with.stiffness / (self.with.stiffness + self.muscle_stiffness);
            self.pull += part.min(0.5) * (force - self.pull);
            stroke += self.pull / self.with.stiffness;
        }
        if self.with.play > 0.0 {
            let at = self.played.unwrap_or(stroke);
            let gap = stroke - at;
            // Soft edges: the joint bears on a tenth of the play.
            let edge = 0.5 * self.with.play;
            let soft = 0.1 * self.with.play;
            let beyond = (gap.abs() - edge + soft).max(0.0);
            let push = if beyond < 2.0 * soft { beyond * beyond / (4.0 * soft) } else { beyond - soft };
            self.played = Some(at + gap.signum() * push.min(gap.abs()));
            stroke = self.played.unwrap_or(stroke);
        }
        self.muscle_at = stroke;
        stroke
    }

    /// Force at the cell, N.
    pub fn at_cell(&mut self, force: f64, pressure: f64, stroke: f64, dt: f64) -> f64 {
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
            end = r.stroke(f64::from(i) * 1e-6, 0.0);
        }
        assert!((1e-3 - end - 0.5e-4).abs() < 1e-5, "lags by half the play: {end}");
        let turned = r.stroke(1e-3 - 0.5e-4, 0.0);
        assert!((turned - end).abs() < 1e-6, "and stays there on the way back: {turned} {end}");
    }

    #[test]
    fn a_soft_frame_and_a_muscle_that_sticks_come_to_rest() {
        // Strands that stick: four times as stiff as the frame, until the friction of 40 N is full.
        let mut r = RigState::new(Rig { stiffness: 1e5, ..Rig::default() });
        let (mut force, mut last) = (0.0, [0.0; 2]);
        for i in 0..400 {
            let x = r.stroke(1e-6 * f64::from(i.min(200)), force);
            force = 100.0 - (4e5 * x).min(40.0) - 2e3 * x;
            last = [last[1], force];
        }
        assert!((last[1] - last[0]).abs() < 1e-6, "the force no longer changes: {last:?}");
    }

    #[test]
    fn a_soft_frame_shortens_the_muscle_by_force_over_rate() {
        let mut r = RigState::new(Rig { stiffness: 1e5, ..Rig::default() });
        let end = (0..60).map(|_| r.stroke(1e-3, 50.0)).last().expect("steps");
        assert!((end - 1.5e-3).abs() < 1e-9, "{end}");
    }
}
