//! Faults of one tick, from what all watches see.

use model_core::link::messages::{Fault, Mode, Side, State};

use super::Controller;
use crate::board::Inputs;
use crate::watch::{Finding, Seen};

impl Controller {
    pub(super) fn watch(&mut self, inputs: &Inputs) -> Option<(Side, Finding)> {
        let settings = &self.settings;
        self.overruns = self.overruns.saturating_add(u32::from(inputs.missed_ticks));
        self.missed_in_a_row = if inputs.missed_ticks > 0 {
            self.missed_in_a_row.saturating_add(inputs.missed_ticks)
        } else {
            0
        };
        let mut found = None;
        for side in Side::ALL {
            if !self.uses(side) {
                continue;
            }
            let actuator = &mut self.sides[side.index()];
            let seen = Seen {
                readings: inputs.sides[side.index()],
                speed_m_per_s: actuator.motion.motion().speed,
                command: actuator.command,
                expected_pa: actuator.regulator.model_pa(),
                model_n: actuator.model_n,
            };
            let finding = actuator.watch.check(&seen, settings);
            found = found.or(finding.map(|finding| (side, finding)));
        }
        let plain =
            |fault, value, limit| Some((Side::Agonist, Finding { fault, sensor: None, value, limit }));
        if found.is_some() {
            return found;
        }
        if inputs.supply_low {
            return plain(Fault::BrownOut, 0.0, 0.0);
        }
        if self.missed_in_a_row >= settings.watch.overrun_ticks.max(1) {
            return plain(
                Fault::LoopOverrun,
                f32::from(self.missed_in_a_row),
                f32::from(settings.watch.overrun_ticks),
            );
        }
        self.host_age = self.host_age.saturating_add(1);
        let silence = settings.watch.host_silence_ticks;
        let controls = self.machine.state() == State::Running && self.mode != Mode::Vent;
        if controls && !settings.watch.autonomous && self.host_age > silence {
            return plain(Fault::HostSilence, self.host_age as f32, silence as f32);
        }
        self.asked_age = self.asked_age.saturating_add(1);
        let silence = settings.watch.silence_ticks;
        if controls && silence > 0 && self.generator.is_set_point() && self.asked_age > silence {
            return plain(Fault::SetPointSilence, self.asked_age as f32, silence as f32);
        }
        None
    }
}
