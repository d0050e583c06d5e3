//! The pressure regulator: the response of it and its line to a command, and the command that gives the muscle the demanded pressure.
//!
//! ```text
//! target  = gain · (command + offset)
//! dp₁/dt  = clamp((target − p₁) / lag, ±rate), 0 while |target − p₁| < deadband         at the regulator
//! dp/dt   = (p₁ − p) / (line · V/V₀) − (p + p_atm) · V̇/V                                in the muscle
//! ```
//! The line fills a muscle of volume `V`, which follows from the braid at every stroke: a wide muscle takes longer, and one
//! that widens draws air through the line. Gain and offset are inverted exactly. Line and lag are compensated by lead, to the extent
//! that the settings define. The rate of each lead is smoothed over a seventh of the lag; without smoothing, sensor noise would grow ten
//! times or more. The delay of this smoothing and of the loop itself is compensated by lead too, or by an earlier demand where the
//! setpoint is known ahead ([`Demand::lookahead_pa`]). A rate limit and a deadband cannot be inverted; they are only predicted for the
//! watch on pressure. The difference between predicted and measured pressure is added slowly to the command
//! ([`RegulatorState::observe`]).

use model_core::link::settings::{Limits, Regulator};
use model_core::scalar::Scalar;

use crate::tick::TICK_S;

/// Time constant of the observer of what the regulator's model leaves out, s: slower than the waves that a muscle follows, quicker than
/// the drift of a regulator. A quick one takes an error of the model's line for drift, and adds it to waves a quarter of a period later:
/// with 0.15 s, force in a wave of 2 Hz against a mass on a spring was off by 1.04 % of blocked force instead of 0.98 %.
const OBSERVER_S: f32 = 0.6;
/// The most that the observer adds, as a part of the largest command.
const BIAS: f32 = 0.02;
/// Delay of the loop itself: a command holds for a tick.
const LOOP_S: f32 = 0.5 * TICK_S;
/// Share of the lag over which the lead's rates are smoothed.
pub const SMOOTHING: f32 = 0.15;
/// Pressure of the air around, Pa.
const ATMOSPHERE_PA: f32 = 101_325.0;

/// The air in the muscle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// `V/V₀`: the volume as a part of that at rest length.
    pub fill: f32,
    /// `V̇/V`, 1/s.
    pub widening_per_s: f32,
}

impl Default for Air {
    /// A muscle without a table.
    fn default() -> Self {
        Self { fill: 1.0, widening_per_s: 0.0 }
    }
}

/// What is demanded of the regulator in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Pressure in the muscle, Pa.
    pub pressure_pa: f32,
    /// Part of the last change of that pressure that was known ahead, Pa; it is demanded [`ahead`] ticks early.
    pub lookahead_pa: f32,
}

/// Ticks by which a setpoint that is known ahead is demanded early.
pub fn ahead(regulator: &Regulator) -> usize {
    if regulator.lead > 0.0 { ((LOOP_S + SMOOTHING * regulator.lag_s) / TICK_S) as usize } else { 0 }
}

/// Keeps the regulator's model and the last demanded pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RegulatorState {
    pressure_demand_pa: f32,
    rate_pa_per_s: f32,
    /// Smoothed demand at the regulator's outlet, and the part of its rate that was known ahead.
    outlet_pa: f32,
    foreseen_pa_per_s: f32,
    /// The model: pressure at the regulator and in the muscle.
    supplied_pa: f32,
    model_pa: f32,
    command_pa: f32,
    /// Observed error of the regulator's model, added to the command.
    bias_pa: f32,
}

/// What [`RegulatorState::step`] decided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Driven {
    /// Demanded pressure after slew and limits, Pa.
    pub pressure_demand_pa: f32,
    /// Command, Pa.
    pub command_pa: f32,
    /// Whether a limit cut the demand: an integrator behind it must not continue.
    pub saturated: bool,
}

impl RegulatorState {
    /// Starts where the muscle is.
    pub fn begin(&mut self, pressure_pa: f32) {
        let pressure_pa = if pressure_pa.is_finite() { pressure_pa.at_least(0.0) } else { 0.0 };
        *self = Self {
            pressure_demand_pa: pressure_pa,
            outlet_pa: pressure_pa,
            supplied_pa: pressure_pa,
            model_pa: pressure_pa,
            command_pa: self.command_pa,
            ..Self::default()
        };
    }

    /// Takes a tick's measured pressure: its difference from the model is added slowly to the command. This corrects drift of the
    /// regulator's zero and gain, and its ripple; lag and line are in the model and cause no correction.
    pub fn observe(&mut self, dt: f32, measured_pa: f32, regulator: &Regulator) {
        let lack = self.model_pa - measured_pa;
        if lack.is_finite() {
            let most = BIAS * regulator.command_max_pa;
            self.bias_pa = (self.bias_pa + lack * dt / OBSERVER_S).within(-most, most);
        }
    }

    /// Pressure in the muscle by the regulator's model, Pa.
    pub fn model_pa(&self) -> f32 {
        self.model_pa
    }

    /// Last command, Pa.
    pub fn command_pa(&self) -> f32 {
        self.command_pa
    }

    /// One tick of `dt` seconds towards a demanded pressure, which is limited to `high_pa`.
    #[inline]
    pub fn step(
        &mut self,
        dt: f32,
        demand: Demand,
        high_pa: f32,
        air: &Air,
        regulator: &Regulator,
        limits: &Limits,
    ) -> Driven {
        let slew = limits.slew_pa_per_s * dt;
        let high = high_pa.at_least(0.0);
        let wanted = demand
            .pressure_pa
            .within(0.0, high)
            .within(self.pressure_demand_pa - slew, self.pressure_demand_pa + slew);
        let smoothing = SMOOTHING * regulator.lag_s;
        let share = dt / (dt + smoothing);
        self.rate_pa_per_s += ((wanted - self.pressure_demand_pa) / dt - self.rate_pa_per_s) * share;
        let foreseen = demand.lookahead_pa.within(-slew, slew) / dt;
        self.foreseen_pa_per_s += (foreseen - self.foreseen_pa_per_s) * share;
        self.pressure_demand_pa = wanted;
        let line = regulator.line_s * air.fill;
        let draught = (wanted + ATMOSPHERE_PA) * air.widening_per_s;
        let outlet_rate =
            (wanted + line * (self.rate_pa_per_s + draught) - self.outlet_pa) / (dt + smoothing);
        self.outlet_pa += outlet_rate * dt;
        let late = LOOP_S + smoothing;
        let led = self.outlet_pa + (regulator.lag_s + late) * outlet_rate
            - ahead(regulator) as f32 * TICK_S * self.foreseen_pa_per_s;
        // Lead never commands more than the muscle may bear, not even for a moment: a regulator may be faster than its model.
        let target = (wanted + regulator.lead * (led - wanted)).within(0.0, high);
        let modelled = (target / regulator.gain - regulator.offset_pa).within(0.0, regulator.command_max_pa);
        let free = (target + self.bias_pa) / regulator.gain - regulator.offset_pa;
        let command =
            free.within(0.0, regulator.command_max_pa.at_most(high / regulator.gain - regulator.offset_pa));
        self.predict(dt, modelled, air, regulator);
        self.command_pa = command;
        Driven {
            pressure_demand_pa: wanted,
            command_pa: command,
            saturated: wanted != demand.pressure_pa || command != free,
        }
    }

    /// Zero pressure immediately. Nothing of what was demanded is left, only what is still in line and muscle.
    pub fn vent(&mut self, dt: f32, air: &Air, regulator: &Regulator) {
        *self = Self { supplied_pa: self.supplied_pa, model_pa: self.model_pa, ..Self::default() };
        self.predict(dt, 0.0, air, regulator);
    }

    /// Whether line and muscle are empty and stay so at no command, without a movement that draws air in.
    pub fn is_empty(&self, regulator: &Regulator) -> bool {
        self.supplied_pa == 0.0 && self.model_pa == 0.0 && regulator.offset_pa <= 0.0
    }

    /// A command of someone else's: only the model follows it.
    pub fn expect(&mut self, command_pa: f32, regulator: &Regulator) {
        self.predict(TICK_S, command_pa, &Air::default(), regulator);
    }

    /// The last command again.
    pub fn hold(&mut self, dt: f32, air: &Air, regulator: &Regulator) {
        self.predict(dt, self.command_pa, air, regulator);
    }

    fn predict(&mut self, dt: f32, command_pa: f32, air: &Air, regulator: &Regulator) {
        self.command_pa = command_pa;
        let target = (regulator.gain * (command_pa + regulator.offset_pa)).at_least(0.0);
        let gap = target - self.supplied_pa;
        if gap.abs() >= regulator.deadband_pa {
            // The exact step of the lag is 1 − e^(−dt/lag); this form is late by a thousandth of it and never overshoots.
            let step = gap * dt / (0.5 * dt + regulator.lag_s).at_least(dt);
            let most = regulator.rate_pa_per_s * dt;
            self.supplied_pa += step.within(-most, most);
        }
        let flow = dt / (regulator.line_s * air.fill).at_least(1.0e-6);
        let widening = (air.widening_per_s * dt).within(-0.5, 0.5);
        let filled = self.model_pa + flow * self.supplied_pa - ATMOSPHERE_PA * widening;
        self.model_pa = (filled / (1.0 + flow + widening)).at_least(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::settings::Settings;

    fn plain(pressure_pa: f32) -> Demand {
        Demand { pressure_pa, lookahead_pa: 0.0 }
    }

    #[test]
    fn gain_and_offset_are_inverted_exactly() {
        let settings = Settings::default();
        let regulator = Regulator { gain: 1.25, offset_pa: -4_000.0, ..settings.regulator };
        let mut state = RegulatorState::default();
        let mut driven = Driven::default();
        for _ in 0..1000 {
            driven = state.step(1e-3, plain(300e3), 600e3, &Air::default(), &regulator, &settings.limits);
        }
        assert!((driven.command_pa - (300e3 / 1.25 + 4_000.0)).abs() < 1.0);
        assert!((state.model_pa() - 300e3).abs() < 10.0, "{}", state.model_pa());
        assert!(!driven.saturated);
    }

    #[test]
    fn a_wish_beyond_the_limit_is_cut_and_said() {
        let settings = Settings::default();
        let mut state = RegulatorState::default();
        let driven =
            state.step(1e-3, plain(900e3), 500e3, &Air::default(), &settings.regulator, &settings.limits);
        assert!(driven.saturated && driven.command_pa <= 500e3);
    }

    #[test]
    fn a_drift_of_the_regulator_is_taken_away_and_a_broken_one_is_not_chased() {
        let settings = Settings::default();
        let run = |drift: f32| {
            let mut state = RegulatorState::default();
            let mut pressure = 0.0_f32;
            for _ in 0..3000 {
                let driven = state.step(
                    1e-3,
                    plain(300e3),
                    600e3,
                    &Air::default(),
                    &settings.regulator,
                    &settings.limits,
                );
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
    fn after_a_vent_nothing_of_what_was_wanted_comes_back() {
        let settings = Settings::default();
        let regulator = Regulator { line_s: 5e-3, ..settings.regulator };
        let step = |state: &mut RegulatorState, wanted: f32| {
            let foreseen = Demand { pressure_pa: wanted, lookahead_pa: 100.0 };
            state.step(1e-3, foreseen, 600e3, &Air::default(), &regulator, &settings.limits)
        };
        let mut vented = RegulatorState::default();
        for tick in 0..500 {
            step(&mut vented, 600.0 * tick as f32);
            vented.observe(1e-3, 0.0, &regulator);
        }
        vented.vent(1e-3, &Air::default(), &regulator);
        assert!(vented.model_pa() > 100e3, "the muscle is not empty immediately");
        // What is commanded next is what a new one would command.
        let mut new = RegulatorState::default();
        for wanted in [0.0, 5e3, 20e3] {
            assert_eq!(step(&mut vented, wanted), step(&mut new, wanted));
        }
    }

    #[test]
    fn what_is_empty_stays_so_when_it_is_vented() {
        for (offset_pa, pressure_pa, empty) in
            [(0.0, 0.0, true), (-4e3, 0.0, true), (4e3, 0.0, false), (0.0, 1.0, false)]
        {
            let regulator = Regulator { offset_pa, ..Settings::default().regulator };
            let mut state = RegulatorState::default();
            state.begin(pressure_pa);
            let before = state;
            assert_eq!(state.is_empty(&regulator), empty, "{offset_pa}, {pressure_pa}");
            state.vent(1e-3, &Air::default(), &regulator);
            assert_eq!(state == before, empty, "{offset_pa}, {pressure_pa}");
        }
        let failed = Regulator { offset_pa: f32::NAN, ..Settings::default().regulator };
        assert!(!RegulatorState::default().is_empty(&failed));
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
                state.step(1e-3, plain(wanted), 600e3, &Air::default(), &regulator, &settings.limits);
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
