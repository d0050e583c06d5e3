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
    /// Part of the last change of that pressure that was known ahead, Pa; it is demanded [`Law::ahead`] ticks early.
    pub lookahead_pa: f32,
}

/// Ticks in a second, as a number that rates are multiplied by.
const PER_S: f32 = 1.0 / TICK_S;

/// What follows from the settings of a regulator: worked out when they change, and not in every tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    lead: f32,
    line_s: f32,
    gain: f32,
    inv_gain: f32,
    offset_pa: f32,
    command_max_pa: f32,
    deadband_pa: f32,
    /// Ticks by which a setpoint that is known ahead is demanded early, and the same in seconds.
    ahead: usize,
    ahead_s: f32,
    /// Lag, delay of the loop and smoothing: what the lead compensates.
    late_s: f32,
    /// `Δt/(Δt + smoothing)`, and `1/(Δt + smoothing)`.
    share: f32,
    smoothed_per_s: f32,
    /// Part of its gap that the regulator closes in a tick, and the most that it moves.
    closes: f32,
    most_pa: f32,
    /// The most that a demand changes in a tick.
    slew_pa: f32,
    /// The most that the observer adds.
    bias_pa: f32,
}

impl Law {
    /// That of these settings.
    pub fn of(regulator: &Regulator, limits: &Limits) -> Self {
        let smoothing_s = SMOOTHING * regulator.lag_s;
        let ahead = if regulator.lead > 0.0 { ((LOOP_S + smoothing_s) / TICK_S) as usize } else { 0 };
        Self {
            lead: regulator.lead,
            line_s: regulator.line_s,
            gain: regulator.gain,
            inv_gain: 1.0 / regulator.gain,
            offset_pa: regulator.offset_pa,
            command_max_pa: regulator.command_max_pa,
            deadband_pa: regulator.deadband_pa,
            ahead,
            ahead_s: ahead as f32 * TICK_S,
            late_s: regulator.lag_s + LOOP_S + smoothing_s,
            share: TICK_S / (TICK_S + smoothing_s),
            smoothed_per_s: 1.0 / (TICK_S + smoothing_s),
            // The exact step of the lag is 1 − e^(−dt/lag); this form is late by a thousandth of it and never overshoots.
            closes: TICK_S / (0.5 * TICK_S + regulator.lag_s).at_least(TICK_S),
            most_pa: regulator.rate_pa_per_s * TICK_S,
            slew_pa: limits.slew_pa_per_s * TICK_S,
            bias_pa: BIAS * regulator.command_max_pa,
        }
    }

    /// Ticks by which a setpoint that is known ahead is demanded early.
    #[inline(always)]
    pub fn ahead(&self) -> usize {
        self.ahead
    }

    /// Limits for a muscle that may have this pressure.
    pub fn bounds(&self, high_pa: f32) -> Bounds {
        let high_pa = high_pa.at_least(0.0);
        let command_pa = self.command_max_pa.at_most(high_pa / self.gain - self.offset_pa);
        Bounds { high_pa, command_pa }
    }
}

/// What may be demanded of a regulator, and commanded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Highest pressure in the muscle, Pa.
    pub high_pa: f32,
    /// Highest command, Pa.
    pub command_pa: f32,
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

    /// Demands again from where the muscle is; the model of line and muscle continues.
    pub fn demand_from(&mut self, pressure_pa: f32) {
        let Self { supplied_pa, model_pa, .. } = *self;
        self.begin(pressure_pa);
        *self = Self { supplied_pa, model_pa, ..*self };
    }

    /// Takes a tick's measured pressure: its difference from the model is added slowly to the command. This corrects drift of the
    /// regulator's zero and gain, and its ripple; lag and line are in the model and cause no correction.
    #[inline]
    pub fn observe(&mut self, measured_pa: f32, law: &Law) {
        let lack = self.model_pa - measured_pa;
        if lack.is_finite() {
            let most = law.bias_pa;
            self.bias_pa = (self.bias_pa + lack * (TICK_S / OBSERVER_S)).within(-most, most);
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

    /// One tick towards a demanded pressure, within its bounds.
    #[inline]
    pub fn step(&mut self, demand: Demand, bounds: &Bounds, air: &Air, law: &Law) -> Driven {
        let (slew, high) = (law.slew_pa, bounds.high_pa);
        let before = self.pressure_demand_pa;
        let wanted = demand.pressure_pa.within(0.0, high).within(before - slew, before + slew);
        self.rate_pa_per_s += ((wanted - before) * PER_S - self.rate_pa_per_s) * law.share;
        let foreseen = demand.lookahead_pa.within(-slew, slew) * PER_S;
        self.foreseen_pa_per_s += (foreseen - self.foreseen_pa_per_s) * law.share;
        self.pressure_demand_pa = wanted;
        let line = law.line_s * air.fill;
        let draught = (wanted + ATMOSPHERE_PA) * air.widening_per_s;
        let outlet_rate =
            (wanted + line * (self.rate_pa_per_s + draught) - self.outlet_pa) * law.smoothed_per_s;
        self.outlet_pa += outlet_rate * TICK_S;
        let led = self.outlet_pa + law.late_s * outlet_rate - law.ahead_s * self.foreseen_pa_per_s;
        // Lead never commands more than the muscle may bear, not even for a moment: a regulator may be faster than its model.
        let target = (wanted + law.lead * (led - wanted)).within(0.0, high);
        let modelled = (target * law.inv_gain - law.offset_pa).within(0.0, law.command_max_pa);
        let free = (target + self.bias_pa) * law.inv_gain - law.offset_pa;
        let command = free.within(0.0, bounds.command_pa);
        self.predict(modelled, line, air.widening_per_s, law);
        self.command_pa = command;
        Driven {
            pressure_demand_pa: wanted,
            command_pa: command,
            saturated: wanted != demand.pressure_pa || command != free,
        }
    }

    /// Zero pressure immediately. Nothing of what was demanded is left, only what is still in line and muscle.
    pub fn vent(&mut self, air: &Air, law: &Law) {
        *self = Self { supplied_pa: self.supplied_pa, model_pa: self.model_pa, ..Self::default() };
        self.follow(0.0, air, law);
    }

    /// Whether line and muscle are empty and stay so at no command, without a movement that draws air in.
    #[inline]
    pub fn is_empty(&self, law: &Law) -> bool {
        self.supplied_pa == 0.0 && self.model_pa == 0.0 && law.offset_pa <= 0.0
    }

    /// A command of someone else's: only the model follows it.
    pub fn expect(&mut self, command_pa: f32, law: &Law) {
        self.follow(command_pa, &Air::default(), law);
    }

    /// The last command again.
    pub fn hold(&mut self, air: &Air, law: &Law) {
        self.follow(self.command_pa, air, law);
    }

    #[inline(never)]
    fn follow(&mut self, command_pa: f32, air: &Air, law: &Law) {
        self.command_pa = command_pa;
        self.predict(command_pa, law.line_s * air.fill, air.widening_per_s, law);
    }

    /// What a command makes of line and muscle; `line` in seconds at this tick's volume.
    #[inline(always)]
    fn predict(&mut self, command_pa: f32, line_s: f32, widening_per_s: f32, law: &Law) {
        let target = (law.gain * (command_pa + law.offset_pa)).at_least(0.0);
        let gap = target - self.supplied_pa;
        if gap.abs() >= law.deadband_pa {
            self.supplied_pa += (gap * law.closes).within(-law.most_pa, law.most_pa);
        }
        let flow = TICK_S / line_s.at_least(1.0e-6);
        let widening = (widening_per_s * TICK_S).within(-0.5, 0.5);
        let filled = self.model_pa + flow * self.supplied_pa - ATMOSPHERE_PA * widening;
        self.model_pa = (filled / (1.0 + flow + widening)).at_least(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::settings::Settings;

    const HIGH_PA: f32 = 600e3;

    fn law(regulator: &Regulator) -> Law {
        Law::of(regulator, &Settings::default().limits)
    }

    fn plain(pressure_pa: f32) -> Demand {
        Demand { pressure_pa, lookahead_pa: 0.0 }
    }

    #[test]
    fn gain_and_offset_are_inverted_exactly() {
        let settings = Settings::default();
        let regulator = Regulator { gain: 1.25, offset_pa: -4_000.0, ..settings.regulator };
        let law = law(&regulator);
        let mut state = RegulatorState::default();
        let mut driven = Driven::default();
        for _ in 0..1000 {
            driven = state.step(plain(300e3), &law.bounds(HIGH_PA), &Air::default(), &law);
        }
        assert!((driven.command_pa - (300e3 / 1.25 + 4_000.0)).abs() < 1.0);
        assert!((state.model_pa() - 300e3).abs() < 10.0, "{}", state.model_pa());
        assert!(!driven.saturated);
    }

    #[test]
    fn a_setpoint_beyond_the_limit_is_limited_and_reported() {
        let settings = Settings::default();
        let mut state = RegulatorState::default();
        let law = law(&settings.regulator);
        let driven = state.step(plain(900e3), &law.bounds(500e3), &Air::default(), &law);
        assert!(driven.saturated && driven.command_pa <= 500e3);
    }

    #[test]
    fn a_drift_of_the_regulator_is_taken_away_and_a_broken_one_is_not_chased() {
        let settings = Settings::default();
        let law = law(&settings.regulator);
        let run = |drift: f32| {
            let mut state = RegulatorState::default();
            let mut pressure = 0.0_f32;
            for _ in 0..3000 {
                let driven = state.step(plain(300e3), &law.bounds(HIGH_PA), &Air::default(), &law);
                pressure += (driven.command_pa + drift - pressure) / 31.0;
                state.observe(pressure, &law);
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
        let law = law(&Regulator { line_s: 5e-3, ..settings.regulator });
        let step = |state: &mut RegulatorState, wanted: f32| {
            let foreseen = Demand { pressure_pa: wanted, lookahead_pa: 100.0 };
            state.step(foreseen, &law.bounds(HIGH_PA), &Air::default(), &law)
        };
        let mut vented = RegulatorState::default();
        for tick in 0..500 {
            step(&mut vented, 600.0 * tick as f32);
            vented.observe(0.0, &law);
        }
        vented.vent(&Air::default(), &law);
        assert!(vented.model_pa() > 100e3, "the muscle is not empty immediately");
        // What is commanded next is what a new one would command.
        let mut new = RegulatorState::default();
        for wanted in [0.0, 5e3, 20e3] {
            assert_eq!(step(&mut vented, wanted), step(&mut new, wanted));
        }
    }

    #[test]
    fn an_empty_regulator_stays_empty_when_vented() {
        for (offset_pa, pressure_pa, empty) in
            [(0.0, 0.0, true), (-4e3, 0.0, true), (4e3, 0.0, false), (0.0, 1.0, false)]
        {
            let law = law(&Regulator { offset_pa, ..Settings::default().regulator });
            let mut state = RegulatorState::default();
            state.begin(pressure_pa);
            let before = state;
            assert_eq!(state.is_empty(&law), empty, "{offset_pa}, {pressure_pa}");
            state.vent(&Air::default(), &law);
            assert_eq!(state == before, empty, "{offset_pa}, {pressure_pa}");
        }
        let failed = law(&Regulator { offset_pa: f32::NAN, ..Settings::default().regulator });
        assert!(!RegulatorState::default().is_empty(&failed));
    }

    #[test]
    fn lead_removes_the_lag_of_a_ramp() {
        let settings = Settings::default();
        let follow = |lead| {
            let law = law(&Regulator { lead, lag_s: 0.05, ..settings.regulator });
            let mut state = RegulatorState::default();
            let mut miss = 0.0_f32;
            for tick in 0..1000 {
                let wanted = 300.0 * tick as f32;
                state.step(plain(wanted), &law.bounds(HIGH_PA), &Air::default(), &law);
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
