//! Who controls a device: the requests of a session, and the keep-alive requests while it controls.

use std::time::{Duration, Instant};

use model_core::link::endpoints::{Arm, Disarm, Endpoint, KeepAlive, SetReference, SetTo, StartMode};
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode};
use model_core::link::messages::{
    Reference, ReferenceOrder, Refusal, Session, SetPoint, SetPointOrder, Status,
};

use super::Client;
use crate::messages;
use pam_data::error::{DataCode, Error, Result};

/// Time between two keep-alive requests of the session that armed the controller. Without them, the controller vents after
/// `watch.host_silence_ticks` (1 s by default).
const HEARTBEAT: Duration = Duration::from_millis(100);

impl Client {
    /// The identifier of this session, for the requests that arm the controller and start a mode.
    #[must_use]
    pub fn session(&self) -> Session {
        self.session
    }

    /// Whether this session armed the controller or started its mode, and has not disarmed it since.
    #[must_use]
    pub fn controls(&self) -> bool {
        self.controls
    }

    /// Sends a setpoint for the mode that this session has started.
    ///
    /// # Errors
    /// As [`Self::call`]; [`DeviceCode::DeviceInUse`](crate::error::DeviceCode::DeviceInUse) when another session started the mode.
    pub fn set_point(&mut self, set_point: SetPoint) -> Result<Status> {
        self.call::<SetTo>(&SetPointOrder { set_point, session: self.session })
    }

    /// Starts a reference generator for the mode that this session has started.
    ///
    /// # Errors
    /// As [`Self::set_point`].
    pub fn reference(&mut self, reference: Reference) -> Result<Status> {
        self.call::<SetReference>(&ReferenceOrder { reference, session: self.session })
    }

    /// Sends a keep-alive request if this session controls the device and the last one is 0.1 s old. Does not wait for the response.
    /// A session that only reads sends nothing, so it never keeps the run of another program alive.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`](crate::error::DeviceCode::DeviceSilent) when the line is gone; once, [`DeviceCode::DeviceInUse`](crate::error::DeviceCode::DeviceInUse) when another session has taken over.
    pub fn keep_alive(&mut self) -> Result<()> {
        if let Some(refusal) = self.displaced.take() {
            self.controls = false;
            return Err(messages::refused(KeepAlive::NAME, refusal));
        }
        self.heartbeat()
    }

    /// Whether another session owns the device: what it has started is neither vented nor made silent by the way.
    ///
    /// # Errors
    /// As [`Self::try_call`].
    pub fn is_owned_by_another(&mut self) -> Result<bool> {
        let session = self.session;
        Ok(matches!(self.try_call::<KeepAlive>(&session)?, Err(Refusal::OtherSession)))
    }

    pub(super) fn heartbeat(&mut self) -> Result<()> {
        if !self.controls || self.kept_alive.elapsed() < HEARTBEAT {
            return Ok(());
        }
        self.kept_alive = Instant::now();
        let sequence = self.next_sequence();
        self.kept_sequence = Some(sequence);
        let header = Header { kind: Kind::Request, id: KeepAlive::ID, sequence };
        let mut wire = [0; MAX_WIRE];
        let length = encode(header, &self.session, &mut wire)
            .map_err(|e| Error::new(DataCode::CallInvalid, format!("the request cannot be sent: {e}")))?;
        self.send(&wire[..length])
    }

    /// Notes whether this session controls the device, from a request that was granted.
    pub(super) fn note_control(&mut self, endpoint: u8) {
        match endpoint {
            Arm::ID | StartMode::ID => {
                self.controls = true;
                self.displaced = None;
                self.kept_alive = Instant::now();
            }
            Disarm::ID => self.controls = false,
            _ => {}
        }
    }
}
