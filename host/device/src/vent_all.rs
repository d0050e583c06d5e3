//! Venting every controller on a CAN bus with one message, and asking each what became of it.

use std::time::Duration;

use model_core::link::can;
use model_core::link::endpoints::GetStatus;
use model_core::link::messages::{State, Status};

use super::{Address, Client, Patience, Port};
use crate::line_activity::lost;
use pam_data::error::Result;

/// How long a device may take to answer: some milliseconds on a full bus, and as long again for a busy adapter and computer.
const PATIENCE: Patience = Patience {
    answer: Duration::from_millis(100),
    slow_answer: Duration::from_millis(100),
    tries: 2,
    noisy_tries: 4,
};

/// A device that answered after the vent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answered {
    /// Its address.
    pub address: u8,
    /// What it is doing; none where it speaks another version of the link.
    pub state: Option<State>,
}

impl Answered {
    /// Whether nothing moves the muscle any more.
    #[must_use]
    pub fn is_vented(&self) -> bool {
        matches!(self.state, Some(State::Disarmed | State::Fault))
    }
}

/// Vents every device of a bus. The message is sent again before the question to each address, because an adapter may have lost it.
///
/// # Errors
/// The adapter cannot be opened, or is gone. A device that does not answer is left out: there need not be one at each address.
pub fn vent_all(bus: &Address) -> Result<Vec<Answered>> {
    let mut port = Port::open(bus)?;
    port.vent_all().map_err(|e| lost(&port, &e))?;
    let mut answered = Vec::new();
    for address in can::Address::all() {
        port.vent_all().map_err(|e| lost(&port, &e))?;
        let mut line = port.second_handle()?;
        line.turn_to(address);
        let Ok(mut client) = Client::greet(line, PATIENCE) else { continue };
        let state = client.is_of_this_version().then(|| client.call::<GetStatus>(&()));
        let state = state.transpose().ok().flatten().map(|status: Status| status.state);
        answered.push(Answered { address: address.number(), state });
    }
    Ok(answered)
}
