//! States and faults, each in one table.
//!
//! A device wakes up `Disarmed` and vented. Only the host's requests lead towards `Running`; any fault leads to `Fault`
//! from wherever it is noticed, and only the host's `clear` leads out again, to `Disarmed`.

use model_core::link::messages::{Fault, FaultReport, Faults, Refusal, State};
use model_core::link::settings::Reaction;

/// What can change the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The host arms.
    Arm,
    /// The host starts a mode.
    Start,
    /// The host stops.
    Stop,
    /// The host disarms.
    Disarm,
    /// The host clears the latched fault.
    Clear,
    /// A watch noticed a fault.
    Fault,
}

/// Every transition there is. A pair that is not here is refused.
pub const TRANSITIONS: &[(State, Cause, State)] = &[
    (State::Disarmed, Cause::Arm, State::Armed),
    (State::Disarmed, Cause::Disarm, State::Disarmed),
    (State::Disarmed, Cause::Fault, State::Fault),
    (State::Armed, Cause::Arm, State::Armed),
    (State::Armed, Cause::Start, State::Running),
    (State::Armed, Cause::Stop, State::Armed),
    (State::Armed, Cause::Disarm, State::Disarmed),
    (State::Armed, Cause::Fault, State::Fault),
    (State::Running, Cause::Start, State::Running),
    (State::Running, Cause::Stop, State::Armed),
    (State::Running, Cause::Disarm, State::Disarmed),
    (State::Running, Cause::Fault, State::Fault),
    (State::Fault, Cause::Stop, State::Fault),
    (State::Fault, Cause::Disarm, State::Fault),
    (State::Fault, Cause::Fault, State::Fault),
    (State::Fault, Cause::Clear, State::Disarmed),
];

/// In which states a fault is watched for. While running and after a fault every one is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// Only while something is controlled or held.
    Running,
    /// From arming on.
    Armed,
    /// Always: pressure or force in a muscle that must be vented, of any cause.
    Always,
}

/// How a fault behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rule {
    /// The fault.
    pub fault: Fault,
    /// From which state on it is watched for.
    pub watched: Watched,
    /// Whether the settings may make it hold the last command. Faults that mean too much pressure, or that nothing is
    /// known of the muscle any more, always vent, and end a hold.
    pub may_hold: bool,
}

const fn rule(fault: Fault, watched: Watched, may_hold: bool) -> Rule {
    Rule { fault, watched, may_hold }
}

/// Every fault, in the order of its code. How long each takes to be noticed is in [`watch`](crate::watch).
pub const RULES: [Rule; Fault::ALL.len()] = [
    rule(Fault::SensorRange, Watched::Armed, true),
    rule(Fault::SensorStuck, Watched::Running, true),
    rule(Fault::SensorNoisy, Watched::Armed, true),
    rule(Fault::SensorsDisagree, Watched::Running, true),
    rule(Fault::SensorsSilent, Watched::Armed, false),
    rule(Fault::PressureNotRising, Watched::Running, true),
    rule(Fault::PressureNotFalling, Watched::Always, false),
    rule(Fault::OverPressure, Watched::Always, false),
    rule(Fault::OverStroke, Watched::Armed, true),
    rule(Fault::OverSpeed, Watched::Running, true),
    rule(Fault::OverForce, Watched::Always, false),
    rule(Fault::SetPointSilence, Watched::Running, true),
    rule(Fault::LoopOverrun, Watched::Running, true),
    rule(Fault::TableMissing, Watched::Armed, true),
    rule(Fault::TableInvalid, Watched::Armed, true),
    rule(Fault::BrownOut, Watched::Armed, false),
    rule(Fault::Watchdog, Watched::Armed, false),
    rule(Fault::NotANumber, Watched::Running, false),
    rule(Fault::HostSilence, Watched::Running, true),
    rule(Fault::SettingsInvalid, Watched::Always, false),
    rule(Fault::NotVented, Watched::Always, false),
    rule(Fault::HoldEnded, Watched::Running, false),
    rule(Fault::ClockFailed, Watched::Always, false),
    rule(Fault::ValveTest, Watched::Always, false),
    rule(Fault::PressureSensorsDisagree, Watched::Armed, false),
    rule(Fault::SupplyPressureLow, Watched::Armed, true),
    rule(Fault::EnableOpen, Watched::Armed, false),
];

/// The rule of a fault.
pub fn rule_of(fault: Fault) -> Rule {
    RULES[usize::from(fault.code()) % RULES.len()]
}

/// Whether a fault is watched for in a state.
pub fn is_watched(fault: Fault, state: State) -> bool {
    match rule_of(fault).watched {
        Watched::Always => true,
        Watched::Armed => state != State::Disarmed,
        Watched::Running => matches!(state, State::Running | State::Fault),
    }
}

/// What a fault does under the settings' `hold_on`.
pub fn reaction(fault: Fault, hold_on: u32) -> Reaction {
    if rule_of(fault).may_hold && hold_on >> fault.code() & 1 != 0 { Reaction::Hold } else { Reaction::Vent }
}

/// The state of safety with its latch and its counts.
#[derive(Clone, Debug, Default)]
pub struct Machine {
    state: State,
    faults: Faults,
    /// Reports that the store has not been given yet: the latched one, and the one that ended a hold.
    unsaved: [Option<FaultReport>; 2],
}

impl Machine {
    /// The state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Latch and counts.
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// The latched fault.
    pub fn latched(&self) -> Option<Fault> {
        self.faults.latched.map(|report| report.fault)
    }

    /// Takes a report that has not been kept yet, in the order in which they happened.
    pub fn take_unsaved(&mut self) -> Option<FaultReport> {
        let [first, second] = &mut self.unsaved;
        first.take().or_else(|| second.take())
    }

    /// A fault that ended a hold: counted, and kept beside the latched one.
    pub fn ended_hold(&mut self, report: &FaultReport) {
        self.count(report.fault);
        self.unsaved[1] = Some(*report);
    }

    fn count(&mut self, fault: Fault) {
        let count = &mut self.faults.counts[usize::from(fault.code()) % RULES.len()];
        *count = count.saturating_add(1);
    }

    /// Where a request would lead.
    ///
    /// # Errors
    /// As [`Machine::request`].
    pub fn allows(&self, cause: Cause) -> Result<State, Refusal> {
        let to = TRANSITIONS.iter().find(|(from, with, _)| *from == self.state && *with == cause);
        match (to, self.latched()) {
            (Some((_, _, to)), _) => Ok(*to),
            (None, Some(fault)) => Err(Refusal::Latched(fault)),
            (None, None) => Err(Refusal::WrongState(self.state)),
        }
    }

    /// A request of the host.
    ///
    /// # Errors
    /// [`Refusal::Latched`] while a fault stands, else [`Refusal::WrongState`].
    pub fn request(&mut self, cause: Cause) -> Result<State, Refusal> {
        let state = self.allows(cause)?;
        self.state = state;
        if cause == Cause::Clear {
            self.faults.latched = None;
        }
        Ok(state)
    }

    /// A fault: counted each time, latched if it is the first. Returns whether it was.
    pub fn fault(&mut self, report: &FaultReport) -> bool {
        self.count(report.fault);
        if self.faults.latched.is_some() {
            return false;
        }
        self.faults.latched = Some(*report);
        self.unsaved[0] = Some(*report);
        // The table has a way to `Fault` from every state.
        let _ = self.request(Cause::Fault);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::{Mode, Side, SideSample};

    const STATES: [State; 4] = [State::Disarmed, State::Armed, State::Running, State::Fault];

    fn report(fault: Fault) -> FaultReport {
        FaultReport {
            fault,
            side: Side::Agonist,
            sensor: None,
            from: State::Running,
            mode: Mode::Force,
            time_us: 0,
            value: 0.0,
            limit: 0.0,
            last: SideSample::default(),
        }
    }

    #[test]
    fn every_state_can_be_faulted_and_running_is_reached_from_armed_only() {
        for state in STATES {
            assert!(TRANSITIONS.contains(&(state, Cause::Fault, State::Fault)));
        }
        for (from, _, to) in TRANSITIONS {
            if *to == State::Running {
                assert!(matches!(from, State::Armed | State::Running));
            }
            if *from == State::Fault && *to != State::Fault {
                assert_eq!(*to, State::Disarmed);
            }
        }
        for (at, (from, cause, _)) in TRANSITIONS.iter().enumerate() {
            assert!(TRANSITIONS[..at].iter().all(|(f, c, _)| (f, c) != (from, cause)), "one answer each");
        }
    }

    #[test]
    fn the_rules_are_in_the_order_of_the_codes() {
        for (code, rule) in RULES.iter().enumerate() {
            assert_eq!(usize::from(rule.fault.code()), code);
            assert_eq!(Fault::ALL[code], rule.fault);
        }
    }

    #[test]
    fn the_first_fault_is_latched_and_the_rest_are_counted() {
        let mut machine = Machine::default();
        assert!(machine.request(Cause::Arm).is_ok() && machine.request(Cause::Start).is_ok());
        assert!(machine.fault(&report(Fault::OverStroke)));
        assert!(!machine.fault(&report(Fault::OverPressure)));
        assert!(!machine.fault(&report(Fault::OverPressure)));
        assert_eq!(machine.latched(), Some(Fault::OverStroke));
        assert_eq!(machine.faults().counts[usize::from(Fault::OverPressure.code())], 2);
        assert_eq!(machine.request(Cause::Arm), Err(Refusal::Latched(Fault::OverStroke)));
        assert_eq!(machine.request(Cause::Clear), Ok(State::Disarmed));
        assert_eq!(machine.latched(), None);
        assert_eq!(machine.request(Cause::Clear), Err(Refusal::WrongState(State::Disarmed)));
    }

    #[test]
    fn too_much_pressure_never_holds() {
        for fault in [Fault::OverPressure, Fault::PressureNotFalling, Fault::SensorsSilent, Fault::NotANumber]
        {
            assert_eq!(reaction(fault, u32::MAX), Reaction::Vent);
        }
        assert_eq!(reaction(Fault::SetPointSilence, u32::MAX), Reaction::Hold);
        assert_eq!(reaction(Fault::SetPointSilence, 0), Reaction::Vent);
    }
}
