//! The thread that owns the connection to the controller: orders in, telemetry and states out, and safety when no page is open.
//!
//! A new connection is opened and checked elsewhere ([`Connected::open`]) and handed over whole, so that a port that does not answer
//! neither delays the present controller nor costs it its connection.

mod connected;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use model_core::link::messages::State;
use tokio::sync::{broadcast, oneshot};

pub use self::connected::Connected;
use super::answers::Answer;
use super::events::{Message, tell};
use super::vent::Vent;
use crate::change_watch::Reference;
use pam_data::error::{DataCode, Error, Result};
use pam_device::Address;
use pam_device::calibration::{Pair, Sensor};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};

/// What the page may request of the controller, except to vent: that has its own path ([`Vent`]).
#[derive(Debug)]
pub enum Order {
    /// Take over a connection that was opened and checked; the present one is vented and its recording ended first.
    Replace(Box<Connected>),
    /// Answers whether this is the address of the present connection.
    IsConnected(Address),
    /// Vent what the page has started, and close the connection.
    Disconnect,
    /// Arm the controller, so that it accepts a start.
    Arm,
    /// Follow a setpoint profile.
    Follow(Quantity, SetpointProfile),
    /// Faults as text.
    Faults,
    /// Forget the latched fault.
    Clear,
    /// Means of the signals of the sensors since this was ordered before.
    Signals,
    /// The scale of a sensor through known values and the signals at them; kept in the settings if true.
    Calibrate(Sensor, Vec<Pair>, bool),
    /// Step the pressure between two values, Pa, and find the regulator.
    Identify(f64, f64),
    /// Keep the regulator that was found in the settings.
    KeepRegulator,
    /// Change settings, each `KEY=VALUE`; the answer is all of them.
    Settings(Vec<String>),
    /// Let something go wrong on the emulated bench.
    Mishap(u8),
    /// What would change if this table were sent.
    Difference(PathBuf),
    /// Send this table.
    Flash(PathBuf),
    /// Begin a recording.
    Record(PathBuf),
    /// End it.
    EndRecord,
    /// Compare what runs with this from now on, or with nothing.
    Watch(Option<Arc<Reference>>),
}

impl Order {
    /// Whether the muscle may move because of it.
    fn moves(&self) -> bool {
        matches!(self, Self::Arm | Self::Follow(..) | Self::Identify(..))
    }
}

/// An order, the number of vents when it was given, and where its answer goes.
#[derive(Debug)]
pub struct Request {
    /// What is to be done.
    pub order: Order,
    /// [`Vent::count`] at that time.
    pub vents: u64,
    /// Where the answer goes.
    pub answer: oneshot::Sender<Result<Answer>>,
}

/// How long an armed controller may go without any page that shows it.
const UNWATCHED: Duration = Duration::from_millis(1_500);

/// Serves orders until the page's server ends; then vents.
///
/// # Errors
/// A controller that did not confirm that last vent, or a recording that could not be ended.
pub fn serve(orders: &Receiver<Request>, say: &broadcast::Sender<String>, vent: &Vent) -> Result<()> {
    let mut session = Session { connected: None, vents: vent.count(), vent, say };
    let mut watched = Instant::now();
    loop {
        let wait = Duration::from_millis(if session.connected.is_some() { 1 } else { 200 });
        match orders.recv_timeout(wait) {
            Ok(request) => {
                let outcome = session.obey(request.order, request.vents);
                // A page that is gone does not wait for its answer.
                let _ = request.answer.send(outcome);
                report(session.connected.as_mut(), say);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        session.confirm_vent();
        if say.receiver_count() > 0 {
            watched = Instant::now();
        }
        session.listen();
        if watched.elapsed() > UNWATCHED {
            session.vent_unwatched();
        }
    }
    session.close()
}

struct Session<'a> {
    connected: Option<Connected>,
    /// Vents that were confirmed over the conversation.
    vents: u64,
    vent: &'a Vent,
    say: &'a broadcast::Sender<String>,
}

impl Session<'_> {
    fn obey(&mut self, order: Order, vents: u64) -> Result<Answer> {
        if order.moves() && vents != self.vent.count() {
            return Err(Error::new(
                DataCode::CallInvalid,
                "the controller was vented after this was requested",
            )
            .help("request it again"));
        }
        match order {
            Order::Replace(fresh) => self.replace(*fresh),
            Order::IsConnected(address) => {
                let present = self.connected.as_ref();
                Ok(Answer::Truth(present.is_some_and(|c| c.address().same_place(&address))))
            }
            Order::Disconnect => {
                let vented = self.close();
                vented.map(|()| Answer::Done)
            }
            Order::Identify(low, high) => {
                let stop = || vents != self.vent.count() || self.say.receiver_count() == 0;
                self.connected.as_mut().ok_or_else(no_controller)?.identify(low, high, &stop)
            }
            other => self.connected.as_mut().ok_or_else(no_controller)?.obey(other),
        }
    }

    /// What the page has started on the present controller is vented and its recording ended before its connection is given up.
    fn replace(&mut self, fresh: Connected) -> Result<Answer> {
        if let Some(present) = &mut self.connected {
            present.release().map_err(|e| {
                e.concerning("the present controller stays connected").help("vent it, or disconnect it first")
            })?;
        }
        self.close()?;
        self.vent.connect(fresh.vent_line()?);
        self.connected = Some(fresh);
        Ok(Answer::Done)
    }

    /// Vents over the conversation, too, what was vented beside it: an order that was under way may have come after that.
    fn confirm_vent(&mut self) {
        let count = self.vent.count();
        if count == self.vents {
            return;
        }
        self.vents = count;
        if let Some(present) = &mut self.connected {
            if let Err(error) = present.vent() {
                tell(self.say, "bad", &error);
            }
            report(Some(present), self.say);
        }
    }

    fn listen(&mut self) {
        let Some(present) = &mut self.connected else { return };
        if let Err(error) = present.listen(self.say) {
            tell(self.say, "bad", &error);
            // What was recorded until the cable was pulled is kept.
            if let Err(error) = present.end_recording() {
                tell(self.say, "bad", &error);
            }
            self.vent.disconnect();
            self.connected = None;
            report(None, self.say);
        }
    }

    fn vent_unwatched(&mut self) {
        if let Some(present) = &mut self.connected
            && matches!(present.state(), State::Armed | State::Running)
        {
            // No page is open: the next one sees by the state itself whether this failed.
            let _ = present.release();
        }
    }

    /// Vents what this page has started, ends the recording and closes the connection, each also when the one before failed.
    fn close(&mut self) -> Result<()> {
        let Some(mut present) = self.connected.take() else { return Ok(()) };
        let vented = present.release();
        // A controller that is gone has no stream to leave.
        let quiet = if vented.is_ok() { present.end_telemetry() } else { Ok(()) };
        let ended = present.end_recording();
        self.vent.disconnect();
        vented.and(ended.map(|_| ())).and(quiet)
    }
}

fn report(connected: Option<&mut Connected>, say: &broadcast::Sender<String>) {
    let controller = connected.map(Connected::report);
    let message = Message::State { connected: controller.is_some(), controller };
    // Without a page nothing receives it.
    let _ = say.send(message.line());
}

fn no_controller() -> Error {
    Error::new(DataCode::CallInvalid, "no controller is connected")
        .help("connect to a port, or start an emulated one")
}
