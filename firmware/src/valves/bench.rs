//! A muscle of real air between two valves: amounts of gas through orifices, valves that open and close late, a volume that changes.

use model_core::link::settings::ValvePair;

use super::Valves;

pub(crate) const GAS_J_PER_MOL_K: f64 = 8.314;
pub(crate) const AIR_K: f64 = 293.15;
const ATMOSPHERE: f64 = 101_325.0;
/// Volume at rest length, m³.
pub(crate) const REST: f64 = 20e-6;
/// Step of the physics, s.
const STEP_S: f64 = 20e-6;
/// Time that a valve usually takes to close, s; it opens by the dead time later.
const CLOSES_S: f64 = 1e-3;

/// A valve that is open from some time after its signal on until some time after the signal's end.
#[derive(Clone, Copy, Default)]
struct Valve {
    /// Amount through it at 1 Pa before it, mol/(s·Pa), choked.
    conductance: f64,
    on_s: f64,
    off_s: f64,
    open: bool,
}

impl Valve {
    /// One step of the physics under its signal, from a pressure to another: mol.
    fn through(&mut self, on: bool, [opens_s, closes_s]: [f64; 2], before: f64, behind: f64) -> f64 {
        if on {
            (self.on_s, self.off_s) = (self.on_s + STEP_S, 0.0);
        } else {
            (self.on_s, self.off_s) = (0.0, self.off_s + STEP_S);
        }
        self.open = if on { self.open || self.on_s > opens_s } else { self.open && self.off_s <= closes_s };
        if !self.open || behind >= before {
            return 0.0;
        }
        let past = ((behind / before - 0.3) / 0.7).max(0.0);
        self.conductance * before * (1.0 - past * past).sqrt() * STEP_S
    }
}

/// A muscle between the two valves, at rest and empty.
pub(crate) struct Muscle {
    valves: ValvePair,
    fill: Valve,
    vent: Valve,
    /// Amount of gas, mol.
    gas: f64,
    /// Volume as a part of that at rest, and its change, 1/s.
    pub(crate) volume: f64,
    pub(crate) widening: f64,
    /// Leak, mol/(s·Pa).
    pub(crate) leak: f64,
    /// Time that a valve takes to close, s.
    pub(crate) closes_s: f64,
    /// Whether the fill valve stays open without a signal.
    pub(crate) fill_jammed: bool,
    signal: (u32, u32, u32),
    since_us: u32,
    /// Pulses of each valve that were ordered.
    pub(crate) pulses: [u32; 2],
    /// Steps of the physics with both valves open.
    pub(crate) both_open: u32,
}

impl Muscle {
    /// Between valves that are what their settings say.
    pub(crate) fn new(valves: &ValvePair) -> Self {
        // Conductances by which the rates are those of the settings: `V dp/dt = RT dn/dt`.
        let supply = f64::from(valves.supply_pa) + ATMOSPHERE;
        let by_rate = |rate: f32| f64::from(rate) * REST / (GAS_J_PER_MOL_K * AIR_K * supply);
        let valve = |rate| Valve { conductance: by_rate(rate), ..Valve::default() };
        Self {
            valves: *valves,
            fill: valve(valves.fill_pa_per_s),
            vent: valve(valves.vent_pa_per_s),
            gas: ATMOSPHERE * REST / (GAS_J_PER_MOL_K * AIR_K),
            volume: 1.0,
            widening: 0.0,
            leak: 0.0,
            closes_s: CLOSES_S,
            fill_jammed: false,
            signal: (0, 0, 1),
            since_us: 0,
            pulses: [0; 2],
            both_open: 0,
        }
    }

    /// Gauge pressure.
    pub(crate) fn pressure_pa(&self) -> f64 {
        self.gas * GAS_J_PER_MOL_K * AIR_K / (REST * self.volume) - ATMOSPHERE
    }

    /// A tick in which the board does this with the valves.
    pub(crate) fn pass(&mut self, done: Valves) {
        match done {
            Valves::Period { fill_us, vent_us, length_us } => {
                assert!(fill_us == 0 || vent_us == 0, "never both");
                self.signal = (fill_us.into(), vent_us.into(), length_us.into());
                self.since_us = 0;
                self.pulses[0] += u32::from(fill_us > 0);
                self.pulses[1] += u32::from(vent_us > 0);
            }
            Valves::Continue => {}
            Valves::Vent => (self.signal, self.since_us) = ((0, 1_000, 1_000), 0),
            Valves::Closed | Valves::Absent => (self.signal, self.since_us) = ((0, 0, 1_000), 0),
        }
        let delays_s = [CLOSES_S + f64::from(self.valves.dead_s), self.closes_s];
        let supply = f64::from(self.valves.supply_pa) + ATMOSPHERE;
        for _ in 0..(1e-3 / STEP_S) as u32 {
            let (fill_us, vent_us, length_us) = self.signal;
            let in_pulse = |time_us: u32| self.since_us >= length_us - time_us && self.since_us < length_us;
            let inside = self.pressure_pa() + ATMOSPHERE;
            self.gas += self.fill.through(in_pulse(fill_us) || self.fill_jammed, delays_s, supply, inside);
            self.gas -= self.vent.through(in_pulse(vent_us), delays_s, inside, ATMOSPHERE);
            self.gas -= self.leak * (inside - ATMOSPHERE) * STEP_S;
            self.both_open += u32::from(self.fill.open && self.vent.open);
            self.volume += self.widening * STEP_S;
            self.since_us += (STEP_S * 1e6) as u32;
        }
    }
}
