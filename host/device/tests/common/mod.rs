//! A peer for tests of the link, byte by byte, that can misbehave in one way at a time.
#![allow(clippy::unwrap_used, reason = "a helper of tests: a failure here is a failure of the test")]

#[cfg(unix)]
mod line;

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

use model_core::check;
use model_core::link::endpoints::{
    Arm, BeginTable, CommitTable, Disarm, Endpoint, GetInfo, GetStatus, KeepAlive, ReadTable, SendTablePiece,
    SetTelemetry, SetTo, StartMode, Stop, TELEMETRY,
};
use model_core::link::frame::{Accumulator, Header, Kind, MAX_WIRE, encode, encode_bytes};
use model_core::link::hello::{self, Hello};
use model_core::link::messages::{
    DeviceInfo, Mode, Refusal, Side, SideSample, StartedBy, State, Status, TableBegin, TableFault, TableInfo,
    TablePiece, TableRead, Telemetry, TelemetryRate,
};
use model_core::link::{LINK_VERSION, SCHEMA_HASH};
use pam_device::Address;

/// What a peer does wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vice {
    None,
    /// Reads and never answers.
    Silent,
    /// Sends back what it is sent.
    Echo,
    /// Answers anything with a greeting of its own.
    Chatter,
    /// Speaks another schema.
    OtherSchema,
    /// Loses the first answer to every piece of a table.
    LosesAnswers,
    /// One bit of what it keeps flips.
    ForgetsABit,
    /// Refuses every table.
    RefusesTables,
    /// Sends telemetry with the number 3 missing, and noise between frames.
    SkipsSamples,
    /// Another program vents it between the start of a mode and the first sample; its clock stands after the start, or begins again.
    Vented {
        /// Whether the clock begins again, as after a restart.
        restarts: bool,
    },
}

/// The state of a peer.
pub struct Peer {
    vice: Vice,
    begun: Option<TableBegin>,
    pieces: Vec<u8>,
    kept: Option<Vec<u8>>,
    lost: usize,
    samples: u16,
}

impl Peer {
    pub fn new(vice: Vice) -> Self {
        Self { vice, begun: None, pieces: Vec::new(), kept: None, lost: usize::MAX, samples: 0 }
    }

    /// Serves until the line closes.
    pub fn serve(mut self, mut line: impl Read + Write) {
        let mut accumulator = Accumulator::new();
        let mut buffer = [0; 256];
        while let Ok(count) = line.read(&mut buffer) {
            if count == 0 {
                return;
            }
            match self.vice {
                Vice::Silent => continue,
                Vice::Echo => {
                    let _ = line.write_all(&buffer[..count]);
                    continue;
                }
                Vice::Chatter => {
                    let _ = line.write_all(b"login: \r\nwrong password\r\n");
                    continue;
                }
                _ => {}
            }
            for &byte in &buffer[..count] {
                let Some(Ok(frame)) = accumulator.push(byte) else { continue };
                let (header, body) = (frame.header, frame.body.to_vec());
                if let Some(bytes) = self.answer(header, &body)
                    && line.write_all(&bytes).is_err()
                {
                    return;
                }
            }
        }
    }

    fn answer(&mut self, header: Header, body: &[u8]) -> Option<Vec<u8>> {
        let reply = |kind| Header { kind, ..header };
        let mut wire = vec![0; MAX_WIRE];
        let refuse = |refusal: Refusal| {
            let mut wire = vec![0; MAX_WIRE];
            let length = encode(reply(Kind::Refusal), &refusal, &mut wire).unwrap();
            wire.truncate(length);
            Some(wire)
        };
        let ok = reply(Kind::Response);
        let length = match header.id {
            hello::ID => encode_bytes(ok, &self.hello().to_bytes(), &mut wire),
            GetInfo::ID => encode(ok, &self.info(), &mut wire),
            GetStatus::ID if self.vice == Vice::SkipsSamples => {
                let mut out = b"noise\0".to_vec();
                for sequence in [65_534, 65_535, 0, 1, 2, 4, 5] {
                    let header = Header { kind: Kind::Topic, id: TELEMETRY, sequence };
                    let length = encode(header, &sample(u64::from(sequence)), &mut wire).unwrap();
                    out.extend_from_slice(&wire[..length]);
                }
                let length = encode(ok, &status(), &mut wire).unwrap();
                out.extend_from_slice(&wire[..length]);
                return Some(out);
            }
            Arm::ID | StartMode::ID | SetTo::ID | Stop::ID | Disarm::ID | GetStatus::ID
                if matches!(self.vice, Vice::Vented { .. }) =>
            {
                let state = match header.id {
                    StartMode::ID | SetTo::ID => State::Running,
                    _ => State::Armed,
                };
                encode(ok, &Status { state, time_us: 5_000_000, ..status() }, &mut wire)
            }
            SetTelemetry::ID => encode(ok, &TelemetryRate { every_ticks: 1 }, &mut wire),
            KeepAlive::ID => {
                let restarts = self.vice == Vice::Vented { restarts: true };
                self.samples += 1;
                let tick = u64::from(self.samples) + if restarts { 0 } else { 5_000 };
                let header = Header { kind: Kind::Topic, id: TELEMETRY, sequence: self.samples };
                let length = encode(header, &sample(tick), &mut wire).unwrap();
                let mut out = wire[..length].to_vec();
                let length = encode(ok, &(), &mut wire).unwrap();
                out.extend_from_slice(&wire[..length]);
                return Some(out);
            }
            GetStatus::ID => encode(ok, &status(), &mut wire),
            BeginTable::ID if self.vice == Vice::RefusesTables => {
                return refuse(Refusal::Table(TableFault::NotOrdered));
            }
            BeginTable::ID => {
                self.begun = postcard::from_bytes(body).ok();
                self.pieces.clear();
                encode(ok, &(), &mut wire)
            }
            SendTablePiece::ID => {
                let piece: TablePiece = postcard::from_bytes(body).unwrap();
                if piece.offset as usize != self.pieces.len() {
                    return refuse(Refusal::Table(TableFault::Gap(self.pieces.len() as u32)));
                }
                self.pieces.extend_from_slice(&piece.bytes);
                if self.vice == Vice::LosesAnswers && self.lost != self.pieces.len() {
                    self.lost = self.pieces.len();
                    return None;
                }
                encode(ok, &(self.pieces.len() as u32), &mut wire)
            }
            CommitTable::ID => {
                let begun = self.begun.take().unwrap();
                if check::of_image(&self.pieces) != begun.crc || self.pieces.len() != begun.length as usize {
                    return refuse(Refusal::Table(TableFault::Check));
                }
                self.kept = Some(std::mem::take(&mut self.pieces));
                encode(ok, &self.info().tables[0].unwrap(), &mut wire)
            }
            ReadTable::ID => {
                let asked: TableRead = postcard::from_bytes(body).unwrap();
                let mut kept = self.kept.clone().unwrap_or_default();
                if self.vice == Vice::ForgetsABit {
                    kept[5] ^= 1;
                }
                let rest = kept.get(asked.offset as usize..).unwrap_or_default();
                let bytes = heapless::Vec::from_slice(&rest[..rest.len().min(100)]).unwrap();
                encode(ok, &TablePiece { offset: asked.offset, bytes }, &mut wire)
            }
            _ => return refuse(Refusal::NotSupported),
        };
        wire.truncate(length.unwrap());
        Some(wire)
    }

    fn hello(&self) -> Hello {
        let schema_hash = if self.vice == Vice::OtherSchema { 0x1234 } else { SCHEMA_HASH };
        let link_version = if self.vice == Vice::OtherSchema { LINK_VERSION + 1 } else { LINK_VERSION };
        Hello {
            release: (0, 1, 0),
            link_version,
            table_format: 1,
            store_format: 1,
            schema_hash,
            board: 0,
            muscles: 1,
            serial: *b"test peer 01",
            starts: 3,
        }
    }

    fn info(&self) -> DeviceInfo {
        let table = self.kept.as_ref().map(|image| TableInfo {
            length: image.len() as u32,
            crc: check::of_image(image),
            generation: 1,
            has_previous: false,
        });
        DeviceInfo {
            ticks_per_s: 1000,
            muscles: 1,
            table_capacity: 1024,
            trace_capacity: 0,
            reference_capacity: 0,
            tables: [table, None],
            started_by: StartedBy::Power,
        }
    }
}

fn status() -> Status {
    Status {
        state: State::Disarmed,
        mode: Mode::Vent,
        fault: None,
        time_us: 1,
        ticks: 1,
        overruns: 0,
        frames_good: 0,
        frames_bad: 0,
        telemetry_dropped: 0,
        saturated_ticks: 0,
        line_errors: 0,
        bus_offs: 0,
        tables: Default::default(),
    }
}

fn sample(tick: u64) -> Telemetry {
    Telemetry {
        time_us: tick * 1000,
        tick,
        state: State::Disarmed,
        mode: Mode::Vent,
        setpoint: 0.0,
        setpoint_second: 0.0,
        sides: [SideSample::default()].into_iter().collect(),
    }
}

/// A peer behind a TCP port.
pub fn tcp(vice: Vice) -> Address {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let stream: TcpStream = stream.unwrap();
            stream.set_nodelay(true).unwrap();
            Peer::new(vice).serve(stream);
        }
    });
    Address::Tcp { host: "127.0.0.1".into(), port }
}

/// A peer behind a serial device: the other end of a pseudo-terminal.
#[cfg(unix)]
pub fn pty(vice: Vice) -> (Address, std::fs::File) {
    use std::os::fd::AsRawFd;
    let (master, path) = line::open_pty();
    // The far end stays open while the test runs, or reads of the near end fail until the host has opened it.
    let keep = std::fs::OpenOptions::new().read(true).write(true).open(&path).unwrap();
    assert!(keep.as_raw_fd() >= 0);
    thread::spawn(move || Peer::new(vice).serve(master));
    (Address::Serial(path), keep)
}

/// Something that is always a table side.
pub const SIDE: Side = Side::Agonist;
