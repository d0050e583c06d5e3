//! A pair of on/off valves in place of a regulator: a fill valve from the supply, a vent valve to the air around.
//!
//! Flow of a perfect gas through an orifice (Saint-Venant and Wantzel), from an absolute pressure `p₁` to `p₂`:
//! `ψ = √(r^(2/κ) − r^((κ+1)/κ))`, with `r = max(p₂/p₁, (2/(κ+1))^(κ/(κ−1)))`, as a part of its largest value. A valve opens some time
//! after its signal begins and closes some time after it ends.

use crate::pneumatics::ATMOSPHERE;
use serde::{Deserialize, Serialize};

/// Ratio of the specific heats of air.
const KAPPA: f64 = 1.4;

/// What the two valves are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValvePair {
    /// Pressure of the supply, Pa gauge.
    pub supply: f64,
    /// Rate at which an empty muscle of rest volume begins to fill, Pa/s.
    pub fill: f64,
    /// Rate at which one of rest volume at the supply's pressure begins to empty, Pa/s.
    pub vent: f64,
    /// Time from the beginning of a signal until the valve is open, s, and from its end until it is closed.
    pub delays: (f64, f64),
    /// Time constant of the dump valve, s.
    pub dump: f64,
    /// The fill valve does not close.
    pub fill_jammed: bool,
}

impl Default for ValvePair {
    /// Valves that switch within 1.3 ms on a muscle of some cubic centimetres.
    fn default() -> Self {
        Self { supply: 700e3, fill: 4e6, vent: 4e6, delays: (1.3e-3, 1e-3), dump: 0.03, fill_jammed: false }
    }
}

/// Signals to the valves, or what they do: fill valve, vent valve, dump valve open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Open {
    /// The fill valve.
    pub fill: bool,
    /// The vent valve.
    pub vent: bool,
    /// The dump valve, which follows its signal immediately.
    pub dump: bool,
}

/// The valves at work.
#[derive(Debug, Clone)]
pub struct Valves {
    /// What they are, to break them while they run.
    pub with: ValvePair,
    open: [bool; 2],
    /// Time for which a signal has differed from its valve, s.
    differs: [f64; 2],
    both: f64,
}

/// Part of the largest flow from one absolute pressure to another.
fn orifice(before: f64, behind: f64) -> f64 {
    let critical = (2.0 / (KAPPA + 1.0)).powf(KAPPA / (KAPPA - 1.0));
    let psi = |r: f64| (r.powf(2.0 / KAPPA) - r.powf((KAPPA + 1.0) / KAPPA)).max(0.0).sqrt();
    if behind >= before { 0.0 } else { psi((behind / before).max(critical)) / psi(critical) }
}

impl Valves {
    /// Both closed.
    pub fn new(with: ValvePair) -> Self {
        Self { with, open: [false; 2], differs: [0.0; 2], both: 0.0 }
    }

    /// Rate of the pressure (Pa/s) of a muscle of rest volume at a pressure (Pa), under signals, over the next `dt` (s).
    pub fn rate(&mut self, dt: f64, signals: Open, pressure: f64) -> f64 {
        for (at, signal) in [signals.fill, signals.vent].into_iter().enumerate() {
            self.differs[at] = if signal == self.open[at] { 0.0 } else { self.differs[at] + dt };
            let delay = if signal { self.with.delays.0 } else { self.with.delays.1 };
            if self.differs[at] > delay {
                (self.open[at], self.differs[at]) = (signal, 0.0);
            }
        }
        let w = &self.with;
        let (inside, supply) = (pressure + ATMOSPHERE, w.supply + ATMOSPHERE);
        let [fill, vent] = [self.open[0] || w.fill_jammed, self.open[1]];
        let mut rate = 0.0;
        if fill {
            rate += w.fill * orifice(supply, inside);
        }
        if vent {
            rate -= w.vent * inside / supply * orifice(inside, ATMOSPHERE);
        }
        if signals.dump {
            rate -= pressure / w.dump.max(1e-4);
        } else if self.open == [true; 2] {
            self.both += dt;
        }
        rate
    }

    /// Time for which both were open while the dump valve was closed, s.
    pub fn both_open(&self) -> f64 {
        self.both
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_is_choked_up_to_the_critical_ratio_and_ends_at_equal_pressures() {
        assert_eq!(orifice(2.0, 1.0), 1.0);
        assert_eq!((orifice(1.0, 1.0), orifice(1.0, 2.0)), (0.0, 0.0));
        // ψ(0.8) = 0.211910 and ψ at the critical ratio 0.258804, from the formula in Python.
        assert!((orifice(1.0, 0.8) - 0.211_910 / 0.258_804).abs() < 1e-5, "{}", orifice(1.0, 0.8));
    }

    #[test]
    fn a_valve_opens_and_closes_late_and_a_short_signal_does_nothing() {
        let mut valves = Valves::new(ValvePair::default());
        let mut open_for = |signal: f64| {
            let mut time = 0.0_f64;
            for step in 0..200 {
                let fill = f64::from(step) * 1e-4 < signal;
                let rate = valves.rate(1e-4, Open { fill, ..Open::default() }, 0.0);
                time += if rate > 0.0 { 1e-4 } else { 0.0 };
            }
            time
        };
        assert_eq!(open_for(1.2e-3), 0.0);
        assert!((open_for(5e-3) - 4.7e-3).abs() < 3e-4);
    }
}
