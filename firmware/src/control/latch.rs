//! What a fault does: the first is latched and vents or holds; one that vents ends a hold.

use model_core::link::messages::{FaultReport, Side, State};
use model_core::link::settings::Reaction;

use super::{Controller, Notice};
use crate::safety;
use crate::watch::Finding;

impl Controller {
    /// Latches a fault.
    pub fn raise(&mut self, side: Side, finding: &Finding) {
        let report = self.report(side, finding);
        if !self.machine.fault(&report) {
            return;
        }
        self.notice = Some(Notice::Fault);
        self.trace.on_fault();
        self.held_ticks = 0;
        // A fault of a start that never ran leaves nothing pressurised.
        let vents = safety::reaction(finding.fault, self.hold_on()) == Reaction::Vent;
        if vents || report.from != State::Running || self.settings.watch.hold_ticks == 0 {
            self.vent_now();
        }
    }

    /// A fault while one is latched: counted when it comes up; one that vents ends a hold.
    pub(super) fn raise_while_latched(&mut self, side: Side, finding: &Finding, ends_hold: bool) {
        let holds = !self.is_vented();
        if !(holds && ends_hold) {
            if self.present != Some(finding.fault) {
                let report = self.report(side, finding);
                self.machine.fault(&report);
            }
            return;
        }
        let report = self.report(side, finding);
        self.machine.ended_hold(&report);
        self.vent_now();
        // The link's task keeps the report, now that nothing is held.
        self.notice = Some(Notice::State(State::Fault));
    }

    fn report(&self, side: Side, finding: &Finding) -> FaultReport {
        FaultReport {
            fault: finding.fault,
            side,
            sensor: finding.sensor,
            from: self.machine.state(),
            mode: self.mode,
            time_us: self.time_us(),
            value: finding.value,
            limit: finding.limit,
            last: self.sides[side.index()].sample,
        }
    }
}
