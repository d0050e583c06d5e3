//! Whole requests through the tasks, over a line of bytes.

use core::pin::pin;
use std::vec::Vec;

use embassy_futures::block_on;
use embedded_io_async::{ErrorKind, ErrorType};
use model_core::link::endpoints::{Endpoint, GetStatus, Restart};
use model_core::link::frame::{self, Header, Kind, MAX_WIRE};
use model_core::link::hello::Board;
use model_core::link::messages::StartedBy;
use model_core::link::settings::Settings;

use super::*;
use crate::board::{Identity, Inputs, Readings};
use crate::store::mock_flash::MockFlash;

/// Bytes that have been received; the port is gone after them.
struct Received(Vec<u8>);

impl ErrorType for Received {
    type Error = ErrorKind;
}

impl Read for Received {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let count = bytes.len().min(self.0.len());
        if count == 0 {
            return Err(ErrorKind::NotConnected);
        }
        bytes[..count].copy_from_slice(&self.0[..count]);
        self.0.drain(..count);
        Ok(count)
    }
}

/// Bytes that have been sent; the port is gone after n writes.
struct Sent(Vec<u8>, usize);

impl ErrorType for Sent {
    type Error = ErrorKind;
}

impl Write for Sent {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.1 = self.1.checked_sub(1).ok_or(ErrorKind::NotConnected)?;
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

/// Kinds and sequence numbers of the frames in some bytes.
fn frames(bytes: &[u8]) -> Vec<(Kind, u16)> {
    let mut accumulator = Accumulator::new();
    let mut found = Vec::new();
    for &byte in bytes {
        if let Some(frame) = accumulator.push(byte) {
            let header = frame.expect("whole").header;
            found.push((header.kind, header.sequence));
        }
    }
    found
}

/// The answers to a status, a restart and a status, on a line that takes n writes.
fn answers(writes: usize) -> Vec<(Kind, u16)> {
    let shared = Shared::new(Settings::default());
    let identity = Identity {
        board: Board::Native,
        muscles: 1,
        serial: [0; 12],
        started_by: StartedBy::Power,
        fault: None,
    };
    let server = Gate::new(Server::start(identity, MockFlash::erased(), &shared).expect("a store"));
    let mut received = Received(Vec::new());
    for (id, sequence) in [(GetStatus::ID, 1), (Restart::ID, 2), (GetStatus::ID, 3)] {
        let mut wire = [0; MAX_WIRE];
        let header = Header { kind: Kind::Request, id, sequence };
        let length = frame::encode(header, &(), &mut wire).expect("it fits");
        received.0.extend_from_slice(&wire[..length]);
    }
    let sender = Gate::new(Sent(Vec::new(), writes));
    block_on(pin!(link(Line::Serial, &mut received, &sender, &server, &shared)));
    frames(&sender.into_inner().0)
}

#[test]
fn requests_are_answered_up_to_a_restart_or_to_the_end_of_the_port() {
    assert_eq!(answers(10), [(Kind::Response, 1), (Kind::Response, 2)]);
    assert_eq!(answers(1), [(Kind::Response, 1)]);
    assert_eq!(answers(0), []);
}

#[test]
fn telemetry_is_sent_until_the_port_is_gone() {
    let shared = Shared::new(Settings::default());
    shared.with(|controller| controller.set_telemetry(1));
    let sender = Gate::new(Sent(Vec::new(), 1));
    let now = Readings { stroke_m: 1e-3, ..Readings::default() };
    for _ in 0..3 {
        shared.step(&Inputs { sides: [Some(now.into()), None], ..Inputs::default() });
    }
    // A second topic ends it: the line takes one.
    block_on(pin!(async {
        embassy_futures::select::select(telemetry(&sender, &shared, |_| {}), async {
            for _ in 0..100 {
                shared.step(&Inputs { sides: [Some(now.into()), None], ..Inputs::default() });
                embassy_futures::yield_now().await;
            }
        })
        .await
    }));
    let found = frames(&sender.into_inner().0);
    assert_eq!(found.iter().map(|(kind, _)| *kind).collect::<Vec<_>>(), [Kind::Topic]);
}

/// A line that takes nothing, without end.
struct Stuck;

impl ErrorType for Stuck {
    type Error = ErrorKind;
}

impl Write for Stuck {
    async fn write(&mut self, _bytes: &[u8]) -> Result<usize, ErrorKind> {
        core::future::pending().await
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

fn request(id: u8) -> Received {
    let mut wire = [0; MAX_WIRE];
    let header = Header { kind: Kind::Request, id, sequence: 1 };
    let length = frame::encode(header, &(), &mut wire).expect("it fits");
    Received(wire[..length].to_vec())
}

#[test]
fn a_line_that_takes_nothing_does_not_hold_up_another() {
    let shared = Shared::new(Settings::default());
    let identity = Identity {
        board: Board::Native,
        muscles: 1,
        serial: [0; 12],
        started_by: StartedBy::Power,
        fault: None,
    };
    let server = Gate::new(Server::start(identity, MockFlash::erased(), &shared).expect("a store"));
    let (stuck, sender) = (Gate::new(Stuck), Gate::new(Sent(Vec::new(), 10)));
    let (mut first, mut second) = (request(GetStatus::ID), request(GetStatus::ID));
    block_on(pin!(embassy_futures::select::select(
        link(Line::Can, &mut first, &stuck, &server, &shared),
        link(Line::Serial, &mut second, &sender, &server, &shared),
    )));
    assert_eq!(frames(&sender.into_inner().0), [(Kind::Response, 1)]);
}

#[test]
fn a_line_beside_is_offered_every_topic() {
    let shared = Shared::new(Settings::default());
    shared.with(|controller| controller.set_telemetry(1));
    let sender = Gate::new(Sent(Vec::new(), 2));
    for _ in 0..3 {
        shared.step(&Inputs { sides: [Some(Readings::default().into()), None], ..Inputs::default() });
    }
    let mut offered = Vec::new();
    block_on(pin!(telemetry(&sender, &shared, |frame| offered.extend_from_slice(frame))));
    // The third one is offered, and ends the port.
    assert_eq!((frames(&offered).len(), frames(&sender.into_inner().0).len()), (3, 2));
}
