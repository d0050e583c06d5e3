//! A pair of fast on/off valves as a pressure regulator: how long each of them opens in a period.
//!
//! ```text
//! rate wanted   r = (command − p) / lag + (p + p_atm) · V̇/V
//! fill valve    r_f(p) = fill · ψ((p + p_atm) / (p_s + p_atm)) / (V/V₀)
//! vent valve    r_v(p) = vent · (p + p_atm) / (p_s + p_atm) · ψ(p_atm / (p + p_atm)) / (V/V₀)
//! flow          ψ(b) = 1 for b ≤ b_c, √(1 − ((b − b_c) / (1 − b_c))²) above
//! open for      T · r / r_f  or  T · −r / r_v, and the dead time of the valve
//! ```
//! Symbols: `p_s` supply, `T` period, `V/V₀` volume as a part of that at rest length; air at constant temperature. Source of ψ: ISO 6358-1:2013,
//! with the critical ratio `b_c` of [`CRITICAL`]. The rates `fill` and `vent` are measured ([`ValvePair`]).
//!
//! Valves have no shorter pulse than the least one. What it would have let through is added to the next pulse of the same direction, so that
//! the mean is kept. The resolution is half of what the least pulse changes. Where the direction changes, the pulse leaves the other valve
//! time to close. No command, or one that is not a number, vents; a reading that is not a number closes both.

use model_core::link::settings::{Settings, ValvePair};
use model_core::scalar::Scalar;

use crate::board::Command;
use crate::regulator::Air;
use crate::tick::{TICK_S, TICK_US};

mod answer;

pub use answer::Volume;

use answer::{Answer, Pulse};

/// Critical ratio of pressures of a valve, from which on its flow depends on the pressure behind it: 0.2 to 0.5 by data sheets.
pub const CRITICAL: f32 = 0.3;
/// Pressure of the air around, Pa.
const ATMOSPHERE_PA: f32 = 101_325.0;
/// The least part of the full flow that is counted on, where the pressures on both sides are nearly equal.
const LEAST_FLOW: f32 = 0.1;

/// What a board does with the two valves in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Valves {
    /// No pair is fitted.
    #[default]
    Absent,
    /// The period that has begun continues.
    Continue,
    /// A period begins. Each valve opens for its time, at the period's end; behind the period both are closed.
    Period {
        /// Time of the fill valve, µs.
        fill_us: u16,
        /// Time of the vent valve, µs.
        vent_us: u16,
        /// The period, µs.
        length_us: u16,
    },
    /// Both closed immediately: only the dump valve acts.
    Closed,
    /// The fill valve closed and the vent valve open, immediately.
    Vent,
}

/// What a pair remembers. A new one is vented.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairOfValves {
    /// Ticks that remain of the period.
    left: u16,
    /// Time that was too short to open for, s: of the fill valve, or negative of the vent valve.
    carry_s: f32,
    /// Pulse of the period before, s, signed in the same way: its valve may still be open.
    before_s: f32,
    /// Error of pressure while a valve is open as long as it can be, Pa; else zero.
    limited_pa: f32,
    /// What the pulse of the period before has done.
    pulse: Pulse,
    answer: Answer,
}

impl Default for PairOfValves {
    fn default() -> Self {
        Self {
            left: 0,
            carry_s: 0.0,
            before_s: -1.0,
            limited_pa: 0.0,
            pulse: Pulse::default(),
            answer: Answer::default(),
        }
    }
}

/// `ψ`: part of the choked flow at a ratio of pressures behind and before a valve.
fn flow(ratio: f32) -> f32 {
    let past = ((ratio - CRITICAL) / (1.0 - CRITICAL)).within(0.0, 1.0);
    (1.0 - past * past).at_least(0.0).sqrt()
}

/// Rate of pressure through an open valve, Pa/s: `fills`, or vents.
fn rate(valves: &ValvePair, pressure_pa: f32, air: &Air, fills: bool) -> f32 {
    let (inside, supply) = (pressure_pa.at_least(0.0) + ATMOSPHERE_PA, valves.supply_pa + ATMOSPHERE_PA);
    let full = if fills {
        valves.fill_pa_per_s * flow(inside / supply).at_least(LEAST_FLOW)
    } else {
        valves.vent_pa_per_s * (inside / supply) * flow(ATMOSPHERE_PA / inside).at_least(LEAST_FLOW)
    };
    full / air.fill.at_least(0.1)
}

impl PairOfValves {
    /// One tick: towards a command, from a measured pressure.
    pub fn step(
        &mut self,
        command: &Command,
        measured_pa: f32,
        air: &Air,
        volume: Volume,
        settings: &Settings,
    ) -> Valves {
        let valves = &settings.valves;
        if !valves.is_fitted() {
            return Valves::Absent;
        }
        if command.vent {
            *self = Self::default();
            // In the test of the dump valve only that valve lets the air out.
            return if command.pressure_pa > 0.0 { Valves::Closed } else { Valves::Vent };
        }
        if self.left > 0 {
            self.left -= 1;
            return Valves::Continue;
        }
        self.left = valves.period_ticks - 1;
        let length_s = f32::from(valves.period_ticks) * TICK_S;
        let length_us = valves.period_ticks * TICK_US as u16;
        let before = core::mem::take(&mut self.pulse);
        self.answer.judge(measured_pa, volume, before, settings);
        let open_s = self.open(command.pressure_pa, measured_pa, air, settings, length_s);
        // A pulse lies at the end of its period: before it there is time for the other valve to close.
        let most_s = if open_s * self.before_s < 0.0 { length_s - valves.apart_s } else { length_s };
        let open_s = open_s.within(-most_s, most_s);
        self.before_s = open_s;
        let fills = open_s > 0.0;
        let dead_s = if open_s.abs() < length_s { valves.dead_s } else { 0.0 };
        let flows_pa = rate(valves, measured_pa, air, fills) * (open_s.abs() - dead_s).at_least(0.0);
        self.pulse = Pulse {
            through_pa: if fills { flows_pa } else { -flows_pa },
            widened_pa: (measured_pa + ATMOSPHERE_PA) * air.widening_per_s * length_s,
        };
        let time_us = (open_s.abs() * 1e6 + 0.5) as u16;
        let (fill_us, vent_us) = if fills { (time_us, 0) } else { (0, time_us) };
        Valves::Period { fill_us: fill_us.min(length_us), vent_us: vent_us.min(length_us), length_us }
    }

    /// Error of pressure of which the valves cannot close more, Pa: integrators behind them must not continue in its direction.
    #[inline(always)]
    pub fn limited_pa(&self) -> f32 {
        self.limited_pa
    }

    /// What the fill valve has let in although the reading does not rise, Pa, once that is too much to be true.
    #[inline(always)]
    pub fn unanswered_pa(&self) -> Option<f32> {
        self.answer.missing_pa()
    }

    /// Time for which the signal to a valve is on in this period, s; negative for the vent valve.
    fn open(
        &mut self,
        command_pa: f32,
        measured_pa: f32,
        air: &Air,
        settings: &Settings,
        length_s: f32,
    ) -> f32 {
        let valves = &settings.valves;
        self.limited_pa = 0.0;
        // No pressure is demanded: a leaking fill valve must not fill the muscle, whatever its sensor says.
        if !(command_pa > 0.0) {
            self.carry_s = 0.0;
            return -length_s;
        }
        let error = command_pa - measured_pa;
        let widening = (measured_pa + ATMOSPHERE_PA) * air.widening_per_s;
        let wanted = error / settings.regulator.lag_s + widening;
        let open_rate = rate(valves, measured_pa, air, wanted > 0.0);
        let share = wanted / open_rate;
        if !share.is_finite() || error.abs() <= valves.band_pa {
            self.carry_s = 0.0;
            return 0.0;
        }
        if share.abs() >= 1.0 {
            self.limited_pa = error;
        }
        let flows_s = share.within(-1.0, 1.0) * length_s;
        let carried = if self.carry_s * flows_s > 0.0 { self.carry_s + flows_s } else { flows_s };
        // A least pulse that would go further beyond than the pressure is away would begin an oscillation.
        let least_step_pa = open_rate * valves.least_s;
        if carried.abs() < valves.least_s || least_step_pa > 2.0 * error.abs() {
            self.carry_s = carried.within(-valves.least_s, valves.least_s);
            return 0.0;
        }
        self.carry_s = 0.0;
        let dead = if carried > 0.0 { valves.dead_s } else { -valves.dead_s };
        (carried + dead).within(-length_s, length_s)
    }
}

#[cfg(test)]
pub(crate) mod bench;
#[cfg(test)]
mod tests;
