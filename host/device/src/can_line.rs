//! The line to one device on a CAN bus, through a serial adapter.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use model_core::link::can::{self as codec, Format, Route, VENT};

use super::Port;
use super::slcan::{self, Heard, Parser};
use crate::error::DeviceCode;
use pam_data::error::{Error, Result};

/// How long an adapter may take to answer a line. Those that answer do so within some milliseconds; those that do not cost this time.
const ANSWER: Duration = Duration::from_millis(150);
/// Messages that are given to an adapter at once: fewer than any keeps. Behind them it is left the time that they take on the bus, at up
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
            refused: 0,
            foreign: 0,
        };
        // Ends what an earlier program left unfinished; a channel that is closed already refuses.
        line.command("\r\r\rC\r")?;
        line.command("\r")?;
        let rate = line.command(slcan::bit_rate(kbit_per_s))?;
        let opened = line.command("O\r")?;
        let name = line.adapter.name();
        if rate == Some(Heard::Refused) || opened == Some(Heard::Refused) {
            let what = if rate == Some(Heard::Refused) {
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
        line.refused = 0;
        Ok(line)
    }

    /// Sends a line to the adapter and waits for its answer, if it gives any.
    fn command(&mut self, text: &str) -> Result<Option<Heard>> {
        let gone = |port: &Port, e: &io::Error| super::line_activity::lost(port, e);
        self.adapter.write_all(text.as_bytes()).map_err(|e| gone(&self.adapter, &e))?;
        let deadline = Instant::now() + ANSWER;
        let mut answer = None;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || answer.is_some() {
                return Ok(answer);
            }
            let mut bytes = [0; 256];
            let count = self.adapter.read(&mut bytes, left).map_err(|e| gone(&self.adapter, &e))?;
            for byte in &bytes[..count] {
                match self.parser.push(*byte) {
                    Some(said @ (Heard::Done | Heard::Refused)) => answer = Some(said),
                    Some(Heard::Foreign) => self.foreign += 1,
                    Some(Heard::Message(..) | Heard::PassedOver) | None => {}
                }
            }
        }
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
            Some(Heard::Message(identifier, data)) if Route::of(identifier) == Some(Route::From(self.device)) => {
                self.pending.extend(self.receiver.take(&data));
            }
            Some(Heard::Refused) => self.refused += 1,
            Some(Heard::Foreign) => self.foreign += 1,
            Some(Heard::Message(..) | Heard::Done | Heard::PassedOver) | None => {}
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
