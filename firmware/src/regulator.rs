//! The pressure regulator: what it will do with a command, and which command makes it do what is wanted.
//!
//! ```text
//! target = gain · (command + offset)
//! dp/dt  = clamp((target − p) / lag, ±rate), 0 while |target − p| < deadband
//! ```
//! Gain and offset are inverted exactly, the lag by lead as far as the settings ask: `target = p* + lead · (lag + 1.5 ticks) ·
//! dp*/dt`, the rate smoothed over a tenth of the lag so that a sensor's noise is not made ten times as large or more.
//! A rate limit and a deadband cannot be inverted; they are only predicted, so that the watch on pressure knows what to
//! expect. What the measured pressure lacks of the predicted is added slowly ([`RegulatorState::observe`]).

use model_core::link::settings::{Limits, Regulator};

use crate::tick::TICK_S;

/// Time constant of the observer of what the regulator's model leaves out, s: slower than its lag, quicker than its drift.
const OBSERVER_S: f32 = 0.15;
/// The most that the observer adds, as a part of the largest command.
const BIAS: f32 = 0.02;
/// What the loop itself is late by: readings are a tick old when they are answered, and a command holds for a tick.
const LOOP_S: f32 = 1.5 * TICK_S;
/// Share of the lag over which the lead's rate is smoothed.
const SMOOTHING: f32 = 0.1;

/// Keeps the regulator's model and the last wanted pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RegulatorState {
    wanted_pa: f32,
    rate_pa_per_s: f32,
    model_pa: f32,
    command_pa: f32,
    /// What the regulator's own model leaves out, added to what is commanded.
    bias_pa: f32,
}

/// What [`RegulatorState::step`] decided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Driven {
    /// Wanted pressure after slew and limits, Pa.
    pub wanted_pa: f32,
    /// Command, Pa.
    pub command_pa: f32,
    /// Whether a limit cut the wish: an integrator behind it must not go on.
    pub saturated: bool,
}

impl RegulatorState {
    /// Starts where the muscle is.
    pub fn begin(&mut self, pressure_pa: f32) {
        let pressure_pa = if pressure_pa.is_finite() { pressure_pa.max(0.0) } else { 0.0 };
        self.wanted_pa = pressure_pa;
        self.rate_pa_per_s = 0.0;
        self.model_pa = pressure_pa;
        self.bias_pa = 0.0;
    }

    /// Takes a tick's measured pressure: what it lacks of the model's is given slowly to the command. Zero and gain of a
    /// regulator drift, and it ripples; its lag is in the model and stirs nothing.
    pub fn observe(&mut self, dt: f32, measured_pa: f32, regulator: &Regulator) {
        let lack = self.model_pa - measured_pa;
        if lack.is_finite() {
            let most = BIAS * regulator.command_max_pa;
            self.bias_pa = (self.bias_pa + lack * dt / OBSERVER_S).clamp(-most, most);
        }
    }

    /// Pressure that the regulator should have brought about by now, Pa.
    pub fn model_pa(&self) -> f32 {
        self.model_pa
    }

    /// Last command, Pa.
    pub fn command_pa(&self) -> f32 {
        self.command_pa
    }

    /// One tick of `dt` seconds towards a wanted pressure, which is limited to `high_pa`.
    pub fn step(
        &mut self,
        dt: f32,
        wish_pa: f32,
        high_pa: f32,
        regulator: &Regulator,
        limits: &Limits,
    ) -> Driven {
        let slew = limits.slew_pa_per_s * dt;
        let wanted = wish_pa.clamp(0.0, high_pa.max(0.0)).clamp(self.wanted_pa - slew, self.wanted_pa + slew);
        let rate = (wanted - self.wanted_pa) / dt;
        self.rate_pa_per_s += (rate - self.rate_pa_per_s) * dt / (dt + SMOOTHING * regulator.lag_s);
        self.wanted_pa = wanted;
        // Lead never commands more than the muscle may bear, not even for a moment: a regulator may be faster than its model.
        let target = (wanted + regulator.lead * (regulator.lag_s + LOOP_S) * self.rate_pa_per_s)
            .clamp(0.0, high_pa.max(0.0));
        let modelled = (target / regulator.gain - regulator.offset_pa).clamp(0.0, regulator.command_max_pa);
        let free = (target + self.bias_pa) / regulator.gain - regulator.offset_pa;
        let command = free.clamp(
            0.0,
            regulator.command_max_pa.min(high_pa.max(0.0) / regulator.gain - regulator.offset_pa),
        );
        self.predict(dt, modelled, regulator);
        self.command_pa = command;
        Driven { wanted_pa: wanted, command_pa: command, saturated: wanted != wish_pa || command != free }
    }

    /// Zero pressure at once.
    pub fn vent(&mut self, dt: f32, regulator: &Regulator) {
        self.wanted_pa = 0.0;
        self.rate_pa_per_s = 0.0;
        self.predict(dt, 0.0, regulator);
    }

    /// The last command again.
    pub fn hold(&mut self, dt: f32, regulator: &Regulator) -> f32 {
        let command = self.command_pa;
        self.predict(dt, command, regulator);
        command
    }

    fn predict(&mut self, dt: f32, command_pa: f32, regulator: &Regulator) {
        self.command_pa = command_pa;
        let target = (regulator.gain * (command_pa + regulator.offset_pa)).max(0.0);
        let gap = target - self.model_pa;
        if gap.abs() >= regulator.deadband_pa {
            // Exact for a step of the first-order lag would be 1 − e^(−dt/lag); the implicit form never overshoots.
            let step = gap * dt / (dt + regulator.lag_s);
            let most = regulator.rate_pa_per_s * dt;
            self.model_pa += step.clamp(-most, most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::settings::Settings;

    #[test]
    fn gain_and_offset_are_inverted_exactly() {
        let settings = Settings::default();
        let regulator = Regulator { gain: 1.25, offset_pa: -4_000.0, ..settings.regulator };
        let mut state = RegulatorState::default();
        let mut driven = Driven::default();
        for _ in 0..1000 {
            driven = state.step(1e-3, 300e3, 600e3, &regulator, &settings.limits);
        }
        assert!((driven.command_pa - (300e3 / 1.25 + 4_000.0)).abs() < 0.1);
        assert!((state.model_pa() - 300e3).abs() < 10.0, "{}", state.model_pa());
        assert!(!driven.saturated);
    }

    #[test]
    fn a_wish_beyond_the_limit_is_cut_and_said() {
        let settings = Settings::default();
        let mut state = RegulatorState::default();
        let driven = state.step(1e-3, 900e3, 500e3, &settings.regulator, &settings.limits);
        assert!(driven.saturated && driven.command_pa <= 500e3);
    }

    #[test]
    fn a_drift_of_the_regulator_is_taken_away_and_a_broken_one_is_not_chased() {
        let settings = Settings::default();
        let run = |drift: f32| {
            let mut state = RegulatorState::default();
            let mut pressure = 0.0_f32;
            for _ in 0..3000 {
                let driven = state.step(1e-3, 300e3, 600e3, &settings.regulator, &settings.limits);
                pressure += (driven.command_pa + drift - pressure) / 31.0;
                state.observe(1e-3, pressure, &settings.regulator);
            }
            (pressure - 300e3, state.command_pa())
        };
        assert!(run(5e3).0.abs() < 50.0, "{:?}", run(5e3));
        let most = 300e3 + BIAS * settings.regulator.command_max_pa;
        assert!((run(-200e3).1 - most).abs() < 1.0, "{:?}", run(-200e3));
    }

    #[test]
    fn lead_removes_the_lag_of_a_ramp() {
        let settings = Settings::default();
        let follow = |lead| {
            let regulator = Regulator { lead, lag_s: 0.05, ..settings.regulator };
            let mut state = RegulatorState::default();
            let mut miss = 0.0_f32;
            for tick in 0..1000 {
                let wanted = 300.0 * tick as f32;
                state.step(1e-3, wanted, 600e3, &regulator, &settings.limits);
                if tick > 500 {
                    miss = miss.max((state.model_pa() - wanted).abs());
                }
            }
            miss
        };
        // A ramp of 300 kPa/s behind a lag of 50 ms stays 15 kPa behind; with lead it does not.
        assert!((follow(0.0) - 15e3).abs() < 1e3, "{}", follow(0.0));
        assert!(follow(1.0) < 2e3, "{}", follow(1.0));
    }
}
