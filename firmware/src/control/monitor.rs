//! Faults of one tick, from what all watches see.

use model_core::link::messages::{Fault, Mode, Side, State};
use model_core::link::settings::{Reaction, Settings};

use super::actuator::Actuator;
use super::arming::Arming;
use super::{Controller, in_register};
use crate::board::Inputs;
use crate::safety;
use crate::watch::{Finding, Seen};

/// Faults that were found in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Found {
    /// The first.
    first: Option<(Side, Finding)>,
    /// The first of those that vent under the present settings.
    venting: Option<(Side, Finding)>,
}

impl Found {
    /// The fault to act on: one that vents goes before one that may be held for.
    pub(super) fn gravest(&self) -> Option<(Side, Finding)> {
        self.venting.or(self.first)
    }

    /// The first that vents.
    pub(super) fn venting(&self) -> Option<(Side, Finding)> {
        self.venting
    }
}

/// All watches of a muscle. Apart from a calm tick, which needs nothing of it.
#[cold]
#[inline(never)]
fn check(actuator: &mut Actuator, seen: &Seen, settings: &Settings, report: &mut dyn FnMut(Finding)) {
    actuator.watch.check(seen, settings, report);
}

impl Controller {
    /// The faults that hold, as bits. A pair of valves continues to fill while a command is held: where the pressure does not answer, it is not.
    pub(super) fn hold_on(&self) -> u32 {
        let settings = &self.settings;
        let never = if settings.valves.is_fitted() { 1 << Fault::PressureNotRising.code() } else { 0 };
        settings.hold_on & !never
    }

    /// What is a fault in the present state. A muscle that the running mode does not use is watched as if disarmed. While valves are tested
    /// the device is watched as if armed: it is disarmed, but its muscles are under pressure.
    pub(super) fn watch(&mut self, inputs: &Inputs) -> Found {
        let mut found = Found::default();
        let hold_on = self.hold_on();
        let state = match self.machine.state() {
            State::Disarmed if self.arming != Arming::Idle => State::Armed,
            state => state,
        };
        let mut note = |side, state, finding: Finding| {
            if !safety::is_watched(finding.fault, state) {
                return;
            }
            found.first = found.first.or(Some((side, finding)));
            if safety::reaction(finding.fault, hold_on) == Reaction::Vent {
                found.venting = found.venting.or(Some((side, finding)));
            }
        };
        let relies = state == State::Running && matches!(self.mode, Mode::Stroke | Mode::Pair);
        for side in Side::ALL {
            let used = self.uses(side);
            let Self { sides, settings, .. } = self;
            let (actuator, settings) = (&mut sides[side.index()], in_register(settings));
            let readings = actuator.readings;
            if !used && readings.is_none() {
                continue;
            }
            if let Some(finding) = actuator.unanswered() {
                note(side, if used { state } else { State::Disarmed }, finding);
            }
            let mut most_above_n = 0.0;
            if relies && used {
                most_above_n = actuator.half_blocked_n();
                if let Some(finding) = actuator.stands(self.mode, settings) {
                    note(side, state, finding);
                }
            }
            let seen = actuator.seen(most_above_n, settings);
            if actuator.watch.pass(&seen, settings) {
                continue;
            }
            let state = if used { state } else { State::Disarmed };
            check(actuator, &seen, settings, &mut |finding| note(side, state, finding));
        }
        let mut note = |fault, value, limit| {
            note(Side::Agonist, state, Finding { fault, sensor: None, value, limit });
        };
        let settings = in_register(&self.settings);
        let watch = &settings.watch;
        if inputs.supply_low {
            note(Fault::BrownOut, 0.0, 0.0);
        }
        let least_pa = watch.supply_low_pa;
        let supply_pa = inputs.supply_air.map_or(0.0, |signal| settings.scales.supply.reading(signal));
        let low = least_pa > 0.0 && !(supply_pa >= least_pa);
        if self.supply_low.count(low, watch.follow_ticks) {
            note(Fault::SupplyPressureLow, supply_pa, least_pa);
        }
        if self.enable_open.count(inputs.enable_open, watch.debounce_ticks) && watch.enable_input {
            note(Fault::EnableOpen, 0.0, 0.0);
        }
        if inputs.missed_ticks == 0 {
            self.missed_in_a_row = 0;
        } else {
            self.overruns = self.overruns.saturating_add(u32::from(inputs.missed_ticks));
            self.missed_in_a_row = self.missed_in_a_row.saturating_add(inputs.missed_ticks);
            if self.missed_in_a_row >= watch.overrun_ticks {
                note(Fault::LoopOverrun, f32::from(self.missed_in_a_row), f32::from(watch.overrun_ticks));
            }
        }
        self.owner_age = self.owner_age.saturating_add(1);
        self.setpoint_age = self.setpoint_age.saturating_add(1);
        let runs = state == State::Running && self.mode != Mode::Vent;
        let held = state == State::Fault && self.sides.iter().any(|side| !side.command.vent);
        let silence = watch.host_silence_ticks;
        if self.owner_age > silence && (runs || held) && !watch.autonomous {
            note(Fault::HostSilence, self.owner_age as f32, silence as f32);
        }
        let silence = watch.silence_ticks;
        if self.setpoint_age > silence && runs && silence > 0 && self.generator.is_set_point() {
            note(Fault::SetPointSilence, self.setpoint_age as f32, silence as f32);
        }
        if !held {
            self.held_ticks = 0;
            return found;
        }
        self.held_ticks = self.held_ticks.saturating_add(1);
        if self.held_ticks > watch.hold_ticks {
            note(Fault::HoldEnded, self.held_ticks as f32, watch.hold_ticks as f32);
        }
        found
    }
}
