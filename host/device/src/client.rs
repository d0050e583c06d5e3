//! A conversation with a controller: hello, typed calls, topics, and what was lost on the way.

mod exchange;
mod patience;
mod session;
mod topics;

use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use model_core::link::endpoints::Endpoint;
use model_core::link::frame::{Accumulator, Header, Kind};
use model_core::link::hello::{self, Hello};
use model_core::link::messages::{Refusal, Session};
use model_core::link::{LINK_VERSION, SCHEMA_HASH};

pub use self::patience::Patience;
use self::topics::Topics;
pub use self::topics::{Losses, Topic};
use super::line_activity::{LineActivity, version_error};
use super::{Address, Port, VentLine, messages};
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

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
        if address.is_whole_bus() {
            return Err(Error::new(DataCode::CallInvalid, "this port names all devices on a CAN bus")
                .value(address.to_string())
                .help("name one, 1 to 8; only `host vent` goes to all"));
        }
        Self::connect(Port::open(address)?, Patience::default())
    }

    /// Says hello over an open port.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn connect(port: Port, patience: Patience) -> Result<Self> {
        let client = Self::greet(port, patience)?;
        let hello = client.hello;
        if !client.is_of_this_version() {
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
        let mut activity = LineActivity::default();
        let mut attempt = 0;
        while attempt < patience.tries.max(1) || (activity.frames > 0 && attempt < patience.noisy_tries) {
            attempt += 1;
            // A zero ends whatever half frame an earlier program left on the line.
            client.send(&[0])?;
            let sequence = client.next_sequence();
            let header = Header { kind: Kind::Request, id: hello::ID, sequence };
            let answer = client
                .transmit(header, &[])
                .and_then(|()| client.await_answer(hello::ID, sequence, patience.answer, &mut activity))?;
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
        Err(activity.error(&client.port))
    }

    /// Whether the device speaks this program's version of the link.
    #[must_use]
    pub(crate) fn is_of_this_version(&self) -> bool {
        self.hello.link_version == LINK_VERSION && self.hello.schema_hash == SCHEMA_HASH
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

    /// Ticks between two samples of the stream that another program has requested, after listening for at most `patience`; the
    /// samples stay in their queue.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceSilent`] when the line is gone.
    pub(crate) fn telemetry_rate(&mut self, patience: Duration) -> Result<Option<u16>> {
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
}

/// A number that two programs are unlikely to share: the standard library seeds each hasher at random.
fn random_id() -> u32 {
    RandomState::new().hash_one(std::process::id()) as u32
}
