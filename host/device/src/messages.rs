//! Messages for people about a device: its faults with their remedies, its refusals, its states.

use model_core::link::messages::{Mode, Side, StartedBy, State};

mod faults;
mod refusals;

pub(crate) use faults::stopped;
pub use faults::{FaultMessage, fault, report};
pub use refusals::in_use;
pub(crate) use refusals::refused;

/// A state's name.
#[must_use]
pub const fn state(state: State) -> &'static str {
    match state {
        State::Disarmed => "disarmed",
        State::Armed => "armed",
        State::Running => "running",
        State::Fault => "fault",
    }
}

/// A mode's name.
#[must_use]
pub const fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Vent => "vent",
        Mode::Pressure => "pressure",
        Mode::Force => "force",
        Mode::Stroke => "stroke",
        Mode::Pair => "pair",
    }
}

/// A muscle's name.
#[must_use]
pub const fn side(side: Side) -> &'static str {
    match side {
        Side::Agonist => "agonist",
        Side::Antagonist => "antagonist",
    }
}

/// Why a device started.
#[must_use]
pub const fn started_by(started_by: StartedBy) -> &'static str {
    match started_by {
        StartedBy::Power => "power",
        StartedBy::Request => "request",
        StartedBy::Watchdog => "watchdog",
        StartedBy::BrownOut => "brown-out",
    }
}
