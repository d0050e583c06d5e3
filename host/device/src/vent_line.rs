//! Venting beside the conversation with a controller: the frames are written immediately and no answer is waited for, so that a
//! conversation that waits for an answer, a file or a flash memory does not delay them.

use std::io;
use std::sync::{Arc, Mutex, TryLockError};
use std::time::{Duration, Instant};

use model_core::link::endpoints::{Disarm, Endpoint, Stop};
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode};

use super::Port;
use super::line_activity::lost;
use pam_data::error::{DataCode, Error, Result};

/// How long a frame that the conversation is writing at this moment may delay the vent. The longest frame takes 6 ms at 1 Mbaud; a
/// longer wait means that the line takes nothing, and then the order of the frames no longer matters.
const OTHER_WRITER: Duration = Duration::from_millis(20);

/// A second writer on the line of a [`Client`](super::Client) that can only vent.
#[derive(Debug)]
pub struct VentLine {
    port: Port,
    writing: Arc<Mutex<()>>,
    sequence: u16,
}

impl VentLine {
    pub(super) fn new(port: Port, writing: Arc<Mutex<()>>) -> Self {
        Self { port, writing, sequence: 0 }
    }

    /// Writes the requests to stop and to disarm. Whether the controller obeyed is seen in its telemetry, or by
    /// [`vent`](super::run::vent) over the conversation.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`](super::error::DeviceCode::DeviceSilent) when the line is gone or takes nothing.
    pub fn send(&mut self) -> Result<()> {
        let mut wire = [0; 1 + 2 * MAX_WIRE];
        // The zero ends a frame that another writer left unfinished.
        let mut length = 1;
        self.sequence = self.sequence.wrapping_add(1);
        for id in [Stop::ID, Disarm::ID] {
            let header = Header { kind: Kind::Request, id, sequence: self.sequence };
            length += encode(header, &(), &mut wire[length..]).map_err(|e| {
                Error::new(DataCode::CallInvalid, format!("the request to vent cannot be encoded: {e}"))
            })?;
        }
        self.write(&wire[..length]).map_err(|e| lost(&self.port, &e))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let deadline = Instant::now() + OTHER_WRITER;
        let _guard = loop {
            match self.writing.try_lock() {
                Ok(guard) => break Some(guard),
                Err(TryLockError::Poisoned(poisoned)) => break Some(poisoned.into_inner()),
                Err(TryLockError::WouldBlock) if Instant::now() < deadline => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Err(TryLockError::WouldBlock) => break None,
            }
        };
        self.port.write_all(bytes)
    }
}
