//! The line to one device on a CAN bus, through a serial adapter.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use model_core::link::can::{self as codec, Format, Route, VENT};

use super::Port;
use super::line_activity::lost;
use super::slcan::{self, Parser, Received};
use crate::error::DeviceCode;
use pam_data::error::{Error, Result};

/// How long an adapter may take to answer a line. Those that answer do so within some milliseconds; those that do not cost this time.
const ANSWER: Duration = Duration::from_millis(200);
/// A pause after which no more answers come to the line that closes the channel.
const PAUSE: Duration = Duration::from_millis(50);
/// Longest wait for such a pause: something else may be talking without end.
const CLOSING: Duration = Duration::from_secs(1);
/// Attempts to join the bus.
const JOINS: u32 = 3;
/// Messages that are given to an adapter together: fewer than any keeps. Behind them it is left the time that they take on the bus, at up
/// to 135 bits each.
const BATCH: usize = 12;
const MESSAGE_BITS: u32 = 135;

/// A line to the device of an address.
pub(super) struct CanLine {
    adapter: Port,
    device: codec::Address,
    kbit_per_s: u16,
    parser: Parser,
    receiver: codec::Receiver,
    /// Shared by all handles: the device sees one sender.
    sender: Arc<Mutex<codec::Sender>>,
    pending: VecDeque<u8>,
    /// The last answer to a line, until it is taken.
    answer: Option<Received>,
    refused: u64,
    foreign: u64,
}

impl CanLine {
    /// Has an adapter join a bus.
    pub fn open(adapter: Port, device: codec::Address, kbit_per_s: u16) -> Result<Self> {
        let mut line = Self {
            adapter,
            device,
            kbit_per_s,
            parser: Parser::default(),
            receiver: codec::Receiver::new(Format::Classic),
            sender: Arc::new(Mutex::new(codec::Sender::new(Format::Classic))),
            pending: VecDeque::new(),
            answer: None,
            refused: 0,
            foreign: 0,
        };
        let name = line.adapter.name().to_owned();
        for attempt in 1..=JOINS {
            let (rate, opened) = line.join()?;
            if rate == Some(Received::Refused) || opened == Some(Received::Refused) {
                // A late answer to an earlier line may have been taken for this one's.
                if attempt < JOINS {
                    continue;
                }
                let what = if rate == Some(Received::Refused) {
                    format!("the CAN adapter refuses {kbit_per_s} kbit/s")
                } else {
                    "the CAN adapter does not join the bus".to_owned()
                };
                return Err(Error::new(DeviceCode::DevicePort, what)
                    .value(name)
                    .help("unplug the adapter and plug it in again; check that its bus has power"));
            }
            if line.foreign > 0 && rate.is_none() && opened.is_none() {
                return Err(Error::new(
                    DeviceCode::DeviceForeign,
                    "what answers on this port is not a CAN adapter with the slcan protocol",
                )
                .value(name)
                .help("check the port; a controller's own serial port has no `slcan:` before it"));
            }
            break;
        }
        (line.refused, line.foreign) = (0, 0);
        Ok(line)
    }

    /// Closes the channel, sets its bit rate and opens it; gives the answers to the last two.
    fn join(&mut self) -> Result<(Option<Received>, Option<Received>)> {
        // Ends what an earlier program left unfinished. A channel that is closed already refuses; that answer comes before a pause.
        self.command("\r\r\rC\r")?;
        let deadline = Instant::now() + CLOSING;
        while self.listen(PAUSE)? && Instant::now() < deadline {}
        self.parser = Parser::default();
        let rate = self.command(slcan::bit_rate(self.kbit_per_s))?;
        Ok((rate, self.command("O\r")?))
    }

    /// Sends a line to the adapter and waits for its answer, if it gives any.
    fn command(&mut self, text: &str) -> Result<Option<Received>> {
        self.adapter.write_all(text.as_bytes()).map_err(|e| lost(&self.adapter, &e))?;
        let deadline = Instant::now() + ANSWER;
        self.answer = None;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || self.answer.is_some() {
                return Ok(self.answer.take());
            }
            self.listen(left)?;
        }
    }

    /// Takes what the adapter says before it joins the bus; whether anything came.
    fn listen(&mut self, patience: Duration) -> Result<bool> {
        let mut bytes = [0; 256];
        let count = self.adapter.read(&mut bytes, patience).map_err(|e| lost(&self.adapter, &e))?;
        for byte in &bytes[..count] {
            match self.parser.push(*byte) {
                Some(said @ (Received::Done | Received::Refused)) => self.answer = Some(said),
                Some(Received::Foreign) => self.foreign += 1,
                Some(Received::Message(..) | Received::PassedOver) | None => {}
            }
        }
        Ok(count > 0)
    }

    /// The line to another device on the same bus.
    pub fn turn_to(&mut self, device: codec::Address) {
        self.device = device;
        self.receiver = codec::Receiver::new(Format::Classic);
        self.sender = Arc::new(Mutex::new(codec::Sender::new(Format::Classic)));
        self.pending.clear();
    }

    pub fn second_handle(&self) -> Result<Self> {
        Ok(Self {
            adapter: self.adapter.second_handle()?,
            device: self.device,
            kbit_per_s: self.kbit_per_s,
            parser: Parser::default(),
            receiver: codec::Receiver::new(Format::Classic),
            sender: Arc::clone(&self.sender),
            pending: VecDeque::new(),
            answer: None,
            refused: 0,
            foreign: 0,
        })
    }

    /// Messages that the adapter has refused, and lines of it that say nothing.
    pub fn troubles(&self) -> (u64, u64) {
        (self.refused, self.foreign)
    }

    /// Reads bytes of the link, waiting at most `patience` for the first.
    pub fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        let deadline = Instant::now() + patience;
        while self.pending.is_empty() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(0);
            }
            let mut bytes = [0; 2048];
            let count = self.adapter.read(&mut bytes, left)?;
            bytes[..count].iter().for_each(|byte| self.take(*byte));
        }
        let count = buffer.len().min(self.pending.len());
        for (place, byte) in buffer.iter_mut().zip(self.pending.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn take(&mut self, byte: u8) {
        match self.parser.push(byte) {
            Some(Received::Message(identifier, data))
                if Route::of(identifier) == Some(Route::From(self.device)) =>
            {
                self.pending.extend(self.receiver.take(&data));
            }
            Some(Received::Refused) => self.refused += 1,
            Some(Received::Foreign) => self.foreign += 1,
            Some(Received::Message(..) | Received::Done | Received::PassedOver) | None => {}
        }
    }

    /// Writes bytes of the link.
    pub fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        let identifier = Route::To(self.device).identifier();
        let mut lines = Vec::new();
        self.sender
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .send(bytes, |message| lines.push(slcan::transmit(identifier, message)));
        let batches = lines.len().div_ceil(BATCH);
        for (number, batch) in lines.chunks(BATCH).enumerate() {
            self.adapter.write_all(batch.concat().as_bytes())?;
            if number + 1 < batches {
                let bits = MESSAGE_BITS * u32::try_from(batch.len()).unwrap_or(u32::MAX);
                thread::sleep(Duration::from_millis(1) * bits / u32::from(self.kbit_per_s.max(1)));
            }
        }
        Ok(())
    }

    /// Sends the message that vents every device on the bus.
    pub fn vent_all(&mut self) -> io::Result<()> {
        self.adapter.write_all(slcan::transmit(Route::ToAll.identifier(), &VENT).as_bytes())
    }
}
