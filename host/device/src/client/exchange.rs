//! One request and its answer over the line, and what arrives in between.

use std::sync::PoisonError;
use std::time::{Duration, Instant};

use model_core::link::endpoints::{Endpoint, KeepAlive};
use model_core::link::frame::{Header, Kind, MAX_BODY, MAX_WIRE, encode, encode_bytes};
use model_core::link::messages::Refusal;

use super::Client;
use crate::error::DeviceCode;
use crate::line_activity::{LineActivity, lost};
use pam_data::error::{DataCode, Error, Result};

pub(super) struct Answer {
    pub header: Header,
    pub body: Vec<u8>,
}

impl Client {
    pub(super) fn ask<E: Endpoint>(
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

    pub(super) fn next_sequence(&mut self) -> u16 {
        self.sequence = self.sequence.wrapping_add(1);
        self.sequence
    }

    pub(super) fn transmit(&mut self, header: Header, body: &[u8]) -> Result<()> {
        let mut wire = [0; MAX_WIRE];
        debug_assert!(body.len() <= MAX_BODY);
        let length = encode_bytes(header, body, &mut wire)
            .map_err(|e| Error::new(DataCode::CallInvalid, format!("the request cannot be sent: {e}")))?;
        self.send(&wire[..length])
    }

    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<()> {
        let _guard = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        self.port.write_all(bytes).map_err(|e| lost(&self.port, &e))
    }

    /// Waits for the answer with this endpoint and number; late answers to earlier questions are passed over.
    pub(super) fn await_answer(
        &mut self,
        id: u8,
        sequence: u16,
        patience: Duration,
        activity: &mut LineActivity,
    ) -> Result<Option<Answer>> {
        let deadline = Instant::now() + patience;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            let answers = self.pump(left, activity)?;
            let ours = |a: &Answer| a.header.id == id && a.header.sequence == sequence;
            if let Some(answer) = answers.into_iter().find(ours) {
                return Ok(Some(answer));
            }
        }
    }

    /// Reads once, sorts what came: topics into their queue, answers to the caller.
    pub(super) fn pump(&mut self, patience: Duration, activity: &mut LineActivity) -> Result<Vec<Answer>> {
        let mut buffer = [0; 2048];
        let count = match self.port.read(&mut buffer, patience) {
            Ok(count) => count,
            Err(e) => {
                // Another program often hangs up on bytes that it does not understand: what it sent before shows more.
                return Err(if activity.bytes > 0 {
                    activity.error(&self.port)
                } else {
                    lost(&self.port, &e)
                });
            }
        };
        activity.take(&buffer[..count]);
        let mut answers = Vec::new();
        for &byte in &buffer[..count] {
            let Some(Ok(frame)) = self.accumulator.push(byte) else { continue };
            activity.frames += 1;
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
                Kind::Request => activity.echoes += 1,
            }
        }
        Ok(answers)
    }
}
