//! Two muscles on one pulley: the benches of a board that drives a pair.
//!
//! `I θ'' = r (F₁ − F₂) − c θ' − τ`, strokes `x_rest ± r θ`. The board asks the first bench and then the second each tick; the
//! joint moves when both have received their pressure.

use std::sync::{Arc, Mutex, PoisonError};

use virtual_bench::bench::BenchSpec;
use virtual_bench::lockstep::{Answer, Station};
use virtual_bench::plant::{Motion, Plant};

/// Control period, s.
const TICK: f64 = 1e-3;

/// A joint.
#[derive(Debug)]
pub struct Joint {
    plants: [Plant; 2],
    /// Radius of the pulley, m.
    radius: f64,
    /// Stroke of both muscles at angle zero, m.
    rest: f64,
    /// Moment of inertia, kg·m².
    inertia: f64,
    /// Damping, N·m·s/rad.
    damping: f64,
    /// Torque against positive angles, N·m.
    pub load: f64,
    angle: f64,
    rate: f64,
}

impl Joint {
    /// Two muscles of one kind at angle zero.
    pub fn new(bench: &BenchSpec, radius: f64, rest: f64) -> Self {
        let held = Motion::Held { stroke_mm: rest * 1e3 };
        let other = BenchSpec { seed: bench.seed + 1, ..bench.clone() };
        let plants = [Plant::new(bench, &held), Plant::new(&other, &held)];
        Self { plants, radius, rest, inertia: 2e-3, damping: 0.05, load: 0.0, angle: 0.0, rate: 0.0 }
    }

    /// The same with another moment of inertia (kg·m²) and damping (N·m·s/rad).
    pub fn moving(mut self, inertia: f64, damping: f64) -> Self {
        (self.inertia, self.damping) = (inertia, damping);
        self
    }

    /// Angle, rad.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Pressures in the muscles, Pa.
    pub fn pressures(&self) -> [f64; 2] {
        [0, 1].map(|side: usize| self.plants[side].truth().pressure)
    }

    /// Stiffness at held pressures (Pa) and an angle (rad), N·m/rad: `r² Σ −∂F/∂x` of the true muscles without friction.
    pub fn stiffness_at(&self, pressures: [f64; 2], angle: f64) -> f64 {
        let h = 1e-5;
        let strokes = [self.rest + self.radius * angle, self.rest - self.radius * angle];
        let fall = |side: usize| {
            let force = |stroke: f64| self.plants[side].muscle().quasi_static(pressures[side], stroke);
            (force(strokes[side] - h) - force(strokes[side] + h)) / (2.0 * h)
        };
        self.radius * self.radius * (fall(0) + fall(1))
    }

    fn stroke(&self, side: usize) -> f64 {
        let turn = self.radius * self.angle;
        self.rest + if side == 0 { turn } else { -turn }
    }

    pub(crate) fn step(&mut self, side: usize, command: f64) {
        let stroke = self.stroke(side);
        self.plants[side].drive_to(stroke, TICK);
        self.plants[side].step(TICK, command);
        if side == 1 {
            let forces = [0, 1].map(|one: usize| self.plants[one].truth().force);
            let torque = self.radius * (forces[0] - forces[1]) - self.load;
            self.rate =
                (self.rate + TICK * torque / self.inertia) / (1.0 + TICK * self.damping / self.inertia);
            self.angle += TICK * self.rate;
        }
    }

    pub(crate) fn answer(&self, side: usize) -> Answer {
        let readings = self.plants[side].readings();
        Answer {
            pressure: readings.pressure as f32,
            stroke: readings.stroke as f32,
            force: readings.force as f32,
            ..Answer::default()
        }
    }
}

/// One muscle of a joint, behind a board's UART.
pub struct Side {
    joint: Arc<Mutex<Joint>>,
    side: usize,
}

impl Side {
    /// Both.
    pub fn both(joint: &Arc<Mutex<Joint>>) -> [Self; 2] {
        [0, 1].map(|side| Self { joint: Arc::clone(joint), side })
    }
}

impl Station for Side {
    fn reset(&mut self, _script: u16) -> Answer {
        self.joint.lock().unwrap_or_else(PoisonError::into_inner).answer(self.side)
    }

    fn step(&mut self, pressure_command: f32, _setpoint: f32) -> Answer {
        let mut joint = self.joint.lock().unwrap_or_else(PoisonError::into_inner);
        joint.step(self.side, f64::from(pressure_command));
        joint.answer(self.side)
    }
}
