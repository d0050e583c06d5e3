//! From the pressure command to the pressure in the muscle.
//!
//! The regulator follows the command with a first-order lag and a limit on its rate; it does not answer to changes inside its
//! deadband, and it ripples. A line of finite conductance `G` joins it to the muscle's volume V. Isothermal air:
//! `V dP/dt = G (P_reg − P) − (P + P_atm) dV/dt`, solved implicitly. Volume that changes with the stroke therefore moves the
//! pressure, however good the regulator.

use crate::rng::Rng;
use crate::valves::{Open, Valves};
use serde::{Deserialize, Serialize};

/// Atmospheric pressure, Pa.
pub(crate) const ATMOSPHERE: f64 = 101_325.0;

/// A regulator, its line and its faults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pneumatics {
    /// Regulator's lag, s.
    pub lag: f64,
    /// Fastest change of the regulator's output, Pa/s.
    pub rate: f64,
    /// Change of command that the regulator ignores, Pa.
    pub deadband: f64,
    /// Amplitude of the ripple, Pa, and its frequency, Hz.
    pub ripple: (f64, f64),
    /// Slow drift of the output: standard deviation, Pa, and correlation time, s.
    pub wander: (f64, f64),
    /// Time in which the line fills the muscle's rest volume, s.
    pub line: f64,
    /// Leak: share of the line's conductance.
    pub leak: f64,
    /// The pressure sensor is at the regulator, not at the muscle.
    pub sensor_at_regulator: bool,
}

impl Default for Pneumatics {
    /// An electronic proportional regulator with a short line.
    fn default() -> Self {
        Self {
            lag: 0.03,
            rate: 3e6,
            deadband: 300.0,
            ripple: (250.0, 3.7),
            wander: (300.0, 8.0),
            line: 0.004,
            leak: 0.0,
            sensor_at_regulator: false,
        }
    }
}

/// The air's state.
#[derive(Debug, Clone)]
pub(crate) struct Air {
    with: Pneumatics,
    held: f64,
    regulator: f64,
    muscle: f64,
    wander: f64,
    phase: f64,
    rest_volume: f64,
    volume: Option<f64>,
    rng: Rng,
}

impl Air {
    /// A vented muscle of `rest_volume` (m³).
    pub fn new(with: Pneumatics, rest_volume: f64, seed: u64) -> Self {
        let rng = Rng::stream(seed, "air");
        Self {
            with,
            held: 0.0,
            regulator: 0.0,
            muscle: 0.0,
            wander: 0.0,
            phase: 0.0,
            rest_volume,
            volume: None,
            rng,
        }
    }

    /// Advance by `dt` (s) under a command (Pa) to an inner volume (m³); gives the pressure in the muscle, Pa.
    pub fn advance(&mut self, dt: f64, command: f64, volume: f64) -> f64 {
        let w = &self.with;
        if (command - self.held).abs() > w.deadband || command <= 0.0 {
            self.held = command;
        }
        let open = (self.held / 20e3).clamp(0.0, 1.0);
        self.phase += std::f64::consts::TAU * w.ripple.1 * dt;
        if w.wander.0 > 0.0 && dt > 0.0 {
            let decay = (-dt / w.wander.1.max(1e-6)).exp();
            self.wander = self.wander * decay + w.wander.0 * (1.0 - decay * decay).sqrt() * self.rng.normal();
        }
        let aim = self.held + open * (self.wander + w.ripple.0 * self.phase.sin());
        let lagged = (aim - self.regulator) * (1.0 - (-dt / w.lag.max(1e-6)).exp());
        self.regulator = (self.regulator + lagged.clamp(-w.rate * dt, w.rate * dt)).max(0.0);
        let change = volume - self.volume.unwrap_or(volume);
        self.volume = Some(volume);
        let conductance = self.rest_volume / w.line.max(1e-5);
        let flow = dt * conductance / volume.max(0.1 * self.rest_volume);
        let squeeze = change / volume.max(0.1 * self.rest_volume);
        let pumped = self.muscle - ATMOSPHERE * squeeze + flow * self.regulator;
        self.muscle = (pumped / (1.0 + flow * (1.0 + w.leak) + squeeze)).max(0.0);
        self.muscle
    }

    /// Advance by `dt` (s) to an inner volume (m³) with a pair of valves in place of regulator and line; gives the pressure in the muscle, Pa.
    pub(crate) fn advance_valves(&mut self, dt: f64, valves: &mut Valves, signals: Open, volume: f64) -> f64 {
        let before = self.volume.unwrap_or(volume);
        self.volume = Some(volume);
        let gained = dt * valves.rate(dt, signals, self.muscle) * self.rest_volume;
        // Isothermal: the amount of air is (P + P_atm)·V.
        let amount = (self.muscle + ATMOSPHERE) * before + gained;
        self.muscle = (amount / volume.max(0.1 * self.rest_volume) - ATMOSPHERE).max(0.0);
        self.regulator = self.muscle;
        self.muscle
    }

    /// What it is made of, to break it while it runs.
    pub fn pneumatics(&mut self) -> &mut Pneumatics {
        &mut self.with
    }

    /// The pressure that the sensor sees, Pa.
    pub fn seen(&self) -> f64 {
        if self.with.sensor_at_regulator { self.regulator } else { self.muscle }
    }

    /// The pressure in the muscle, Pa.
    pub(crate) fn in_muscle(&self) -> f64 {
        self.muscle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_muscle_fills_to_the_command() {
        let mut a = Air::new(Pneumatics::default(), 1e-7, 1);
        for _ in 0..2000 {
            a.advance(1e-3, 300e3, 1e-7);
        }
        assert!((a.seen() - 300e3).abs() < 3e3, "{}", a.seen());
    }

    #[test]
    fn a_growing_volume_lowers_the_pressure_by_the_gas_law_when_the_line_is_shut() {
        let shut = Pneumatics { line: 1e9, ..Pneumatics::default() };
        let mut a = Air::new(shut, 1e-6, 1);
        (a.held, a.regulator, a.muscle) = (400e3, 400e3, 400e3);
        a.advance(1e-3, 400e3, 1e-6);
        for i in 1..=1000 {
            a.advance(1e-3, 400e3, 1e-6 * (1.0 + 0.1 * f64::from(i) / 1000.0));
        }
        let expected = (400e3 + ATMOSPHERE) / 1.1 - ATMOSPHERE;
        assert!((a.seen() - expected).abs() < 300.0, "{} {expected}", a.seen());
    }
}
