//! A conversation with a controller: hello, typed calls, topics, and what was lost on the way.

mod patience;
mod topics;

use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use model_core::link::endpoints::{Arm, Disarm, Endpoint, KeepAlive, SetReference, SetTo, StartMode};
use model_core::link::frame::{Accumulator, Header, Kind, MAX_BODY, MAX_WIRE, encode, encode_bytes};
use model_core::link::hello::{self, Hello};
use model_core::link::messages::{
    Reference, ReferenceOrder, Refusal, Session, SetPoint, SetPointOrder, Status,
};
use model_core::link::{LINK_VERSION, SCHEMA_HASH};

pub use self::patience::Patience;
use self::topics::Topics;
pub use self::topics::{Losses, Topic};
use super::line_activity::{LineActivity, lost, version_error};
use super::{Address, Port, VentLine, messages};
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// Time between two keep-alive requests of the session that armed the controller. Without them, the controller vents after
/// `watch.host_silence_ticks` (1 s by default).
const HEARTBEAT: Duration = Duration::from_millis(100);

struct Answer {
    header: Header,
    body: Vec<u8>,
}

/// A controller that has said hello and speaks our schema.
pub struct Client {
    port: Port,
    accumulator: Accumulator,
    sequence: u16,
    hello: Hello,
    topics: Topics,
    patience: Patience,
    session: Session,
    /// Whether this session armed the controller or started its mode, and has not disarmed it since.
    controls: bool,
    /// The refusal of a keep-alive request, until [`Client::keep_alive`] reports it.
    displaced: Option<Refusal>,
    kept_alive: Instant,
    /// Number of the last keep-alive request. Other programs on the line have theirs refused.
    kept_sequence: Option<u16>,
    /// Held while a frame is written, so that those of a [`VentLine`] do not fall into its middle.
    writing: Arc<Mutex<()>>,
}

impl std::fmt::Debug for Client {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Client").field("port", &self.port).field("hello", &self.hello).finish_non_exhaustive()
    }
}

impl Client {
    /// Opens a port and says hello.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`], [`DeviceCode::DeviceSilent`] when nothing answers, [`DeviceCode::DeviceForeign`] when what answers is not
    /// a controller of ours, [`DeviceCode::DeviceVersion`] when it speaks another schema.
    pub fn open(address: &Address) -> Result<Self> {
        Self::connect(Port::open(address)?, Patience::default())
    }

    /// Says hello over an open port.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn connect(port: Port, patience: Patience) -> Result<Self> {
        let client = Self::greet(port, patience)?;
        let hello = client.hello;
        if hello.link_version != LINK_VERSION || hello.schema_hash != SCHEMA_HASH {
            return Err(version_error(&client.port, &hello));
        }
        Ok(client)
    }

    /// Says hello and leaves the comparison of versions to the caller: for asking a device what it is.
    ///
    /// # Errors
    /// As [`Self::open`], without [`DeviceCode::DeviceVersion`].
    pub fn greet(port: Port, patience: Patience) -> Result<Self> {
        let unknown = Hello {
            release: (0, 0, 0),
            link_version: 0,
            table_format: 0,
            store_format: 0,
            schema_hash: 0,
            board: 0,
            muscles: 0,
            serial: [0; 12],
            starts: 0,
        };
        let session = Session { id: random_id() };
        let mut client = Self {
            port,
            accumulator: Accumulator::new(),
            // Programs that share a line must not take each other's answers for their own.
            sequence: session.id as u16,
            hello: unknown,
            topics: Topics::default(),
            patience,
            session,
            controls: false,
            displaced: None,
            kept_alive: Instant::now(),
            kept_sequence: None,
            writing: Arc::default(),
        };
        let mut heard = LineActivity::default();
        let mut attempt = 0;
        while attempt < patience.tries.max(1) || (heard.frames > 0 && attempt < patience.noisy_tries) {
            attempt += 1;
            // A zero ends whatever half frame an earlier program left on the line.
            client.send(&[0])?;
            let sequence = client.next_sequence();
            let header = Header { kind: Kind::Request, id: hello::ID, sequence };
            let answer = client
                .transmit(header, &[])
                .and_then(|()| client.await_answer(hello::ID, sequence, patience.answer, &mut heard))?;
            let Some(answer) = answer else { continue };
            match Hello::from_bytes(&answer.body) {
                Ok(hello) if answer.header.kind == Kind::Response => {
                    client.hello = hello;
                    client.topics = Topics::default();
                    return Ok(client);
                }
                _ => {
                    return Err(Error::new(
                        DeviceCode::DeviceForeign,
                        "the peer uses this frame format, but its hello is not that of a controller",
                    )
                    .value(client.port.name())
                    .help("check that this is the port of the controller"));
                }
            }
        }
        Err(heard.error(&client.port))
    }

    /// Every version of the device, and which device it is.
    #[must_use]
    pub fn hello(&self) -> &Hello {
        &self.hello
    }

    /// The port's address.
    #[must_use]
    pub fn port(&self) -> &str {
        self.port.name()
    }

    /// A second writer on this line that vents the controller whatever this conversation is waiting for.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`] when the system gives no second handle of the port.
    pub fn vent_line(&self) -> Result<VentLine> {
        Ok(VentLine::new(self.port.second_handle()?, Arc::clone(&self.writing)))
    }

    /// What did not arrive so far.
    #[must_use]
    pub fn losses(&self) -> Losses {
        Losses { bad_frames: u64::from(self.accumulator.counts().bad), ..self.topics.losses() }
    }

    /// Counts samples that a subscription misses before one that it takes.
    pub(super) fn miss(&mut self, samples: u64) {
        self.topics.miss(samples);
    }

    /// Sends a request, again when no answer comes: for requests that may be repeated.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`], [`DeviceCode::DeviceInUse`] when another session owns the device, or
    /// [`DeviceCode::DeviceRefused`] with the device's reason as text.
    pub fn call<E: Endpoint>(&mut self, request: &E::Request) -> Result<E::Response> {
        match self.ask::<E>(request, self.patience.answer, self.patience.tries)? {
            Ok(response) => Ok(response),
            Err(refusal) => Err(messages::refused(E::NAME, refusal)),
        }
    }

    /// Asks once and waits long: for what must not happen twice, or waits for flash memory.
    ///
    /// # Errors
    /// As [`Self::call`].
    pub fn call_once<E: Endpoint>(&mut self, request: &E::Request) -> Result<E::Response> {
        match self.ask::<E>(request, self.patience.slow_answer, 1)? {
            Ok(response) => Ok(response),
            Err(refusal) => Err(messages::refused(E::NAME, refusal)),
        }
    }

    /// As [`Self::call`], with the refusal as a value, for callers that know what to do about it.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`] when no answer comes, [`DeviceCode::DeviceForeign`] when it cannot be read.
    pub fn try_call<E: Endpoint>(&mut self, request: &E::Request) -> Result<Result<E::Response, Refusal>> {
        self.ask::<E>(request, self.patience.answer, self.patience.tries)
    }

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
    /// As [`Self::call`]; [`DeviceCode::DeviceInUse`] when another session started the mode.
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
    /// [`DeviceCode::DeviceSilent`] when the line is gone; once, [`DeviceCode::DeviceInUse`] when another session has taken over.
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

    /// Ticks between two samples of the stream that another program has requested, after listening for at most `patience`; the
    /// samples stay in their queue.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`] when the line is gone.
    pub fn telemetry_rate(&mut self, patience: Duration) -> Result<Option<u16>> {
        /// Gaps of which the least is the rate: lost samples make some of them longer.
        const GAPS: usize = 4;
        let deadline = Instant::now() + patience;
        self.topics.forget_samples();
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let (gaps, least) = self.topics.gaps();
            if gaps >= GAPS || left.is_zero() {
                return Ok(least.and_then(|ticks| u16::try_from(ticks).ok()).filter(|ticks| *ticks > 0));
            }
            self.pump(left, &mut LineActivity::default())?;
        }
    }

    fn heartbeat(&mut self) -> Result<()> {
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
    fn note_control(&mut self, endpoint: u8) {
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

    /// As [`Self::try_call`], asked once: for what is repeated only after looking what became of it.
    ///
    /// # Errors
    /// As [`Self::try_call`].
    pub fn try_once<E: Endpoint>(&mut self, request: &E::Request) -> Result<Result<E::Response, Refusal>> {
        self.ask::<E>(request, self.patience.answer, 1)
    }

    /// The next thing the device said without a request, waiting at most `patience` for one.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`] when the line is gone.
    pub fn topic(&mut self, patience: Duration) -> Result<Option<Topic>> {
        let deadline = Instant::now() + patience;
        loop {
            if let Some(topic) = self.topics.pop() {
                return Ok(Some(topic));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.pump(left, &mut LineActivity::default())?;
        }
    }

    fn ask<E: Endpoint>(
        &mut self,
        request: &E::Request,
        patience: Duration,
        tries: u32,
    ) -> Result<Result<E::Response, Refusal>> {
        let unreadable = || {
            Error::new(DeviceCode::DeviceForeign, format!("the answer to `{}` cannot be decoded", E::NAME))
                .help("the device and this program use the same schema, so this is a defect in one of them: report it")
        };
        self.heartbeat()?;
        let mut wire = [0; MAX_WIRE];
        let bad = self.accumulator.counts().bad;
        let mut attempt = 0;
        while attempt < self.allowed(tries, bad) {
            self.topics.numbered.repeats += u64::from(attempt > 0);
            let sequence = self.next_sequence();
            let header = Header { kind: Kind::Request, id: E::ID, sequence };
            let length = encode(header, request, &mut wire).map_err(|e| {
                Error::new(DataCode::CallInvalid, format!("the request `{}` cannot be sent: {e}", E::NAME))
            })?;
            self.send(&wire[..length])?;
            attempt += 1;
            let Some(answer) = self.await_answer(E::ID, sequence, patience, &mut LineActivity::default())?
            else {
                continue;
            };
            return match answer.header.kind {
                Kind::Refusal => postcard::from_bytes(&answer.body).map(Err).map_err(|_| unreadable()),
                _ => {
                    self.note_control(E::ID);
                    postcard::from_bytes(&answer.body).map(Ok).map_err(|_| unreadable())
                }
            };
        }
        Err(Error::new(DeviceCode::DeviceSilent, format!("the device no longer answers `{}`", E::NAME))
            .value(self.port.name())
            .help(
                "check the cable and the supply; a running controller without its host vents automatically",
            ))
    }

    /// How often a request may be sent, given the number of bad frames before its first attempt.
    fn allowed(&self, tries: u32, bad_before: u32) -> u32 {
        if tries > 1 && self.accumulator.counts().bad != bad_before {
            self.patience.noisy_tries
        } else {
            tries.max(1)
        }
    }

    fn next_sequence(&mut self) -> u16 {
        self.sequence = self.sequence.wrapping_add(1);
        self.sequence
    }

    fn transmit(&mut self, header: Header, body: &[u8]) -> Result<()> {
        let mut wire = [0; MAX_WIRE];
        debug_assert!(body.len() <= MAX_BODY);
        let length = encode_bytes(header, body, &mut wire)
            .map_err(|e| Error::new(DataCode::CallInvalid, format!("the request cannot be sent: {e}")))?;
        self.send(&wire[..length])
    }

    fn send(&mut self, bytes: &[u8]) -> Result<()> {
        let _turn = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        self.port.write_all(bytes).map_err(|e| lost(&self.port, &e))
    }

    /// Waits for the answer with this endpoint and number; late answers to earlier questions are passed over.
    fn await_answer(
        &mut self,
        id: u8,
        sequence: u16,
        patience: Duration,
        heard: &mut LineActivity,
    ) -> Result<Option<Answer>> {
        let deadline = Instant::now() + patience;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            let answers = self.pump(left, heard)?;
            let ours = |a: &Answer| a.header.id == id && a.header.sequence == sequence;
            if let Some(answer) = answers.into_iter().find(ours) {
                return Ok(Some(answer));
            }
        }
    }

    /// Reads once, sorts what came: topics into their queue, answers to the caller.
    fn pump(&mut self, patience: Duration, heard: &mut LineActivity) -> Result<Vec<Answer>> {
        let mut buffer = [0; 2048];
        let count = match self.port.read(&mut buffer, patience) {
            Ok(count) => count,
            Err(e) => {
                // Another program often hangs up on bytes that it does not understand: what it sent before tells more.
                return Err(if heard.bytes > 0 { heard.error(&self.port) } else { lost(&self.port, &e) });
            }
        };
        heard.take(&buffer[..count]);
        let mut answers = Vec::new();
        for &byte in &buffer[..count] {
            let Some(Ok(frame)) = self.accumulator.push(byte) else { continue };
            heard.frames += 1;
            match frame.header.kind {
                Kind::Refusal
                    if frame.header.id == KeepAlive::ID
                        && self.kept_sequence == Some(frame.header.sequence) =>
                {
                    self.displaced = postcard::from_bytes(frame.body).ok();
                }
                Kind::Response | Kind::Refusal => {
                    answers.push(Answer { header: frame.header, body: frame.body.to_vec() });
                }
                Kind::Topic => self.topics.take(frame.header, frame.body),
                // A controller never asks: what arrives as a request is our own, sent back.
                Kind::Request => heard.echoes += 1,
            }
        }
        Ok(answers)
    }
}

/// A number that two programs are unlikely to share: the standard library seeds each hasher at random.
fn random_id() -> u32 {
    RandomState::new().hash_one(std::process::id()) as u32
}
