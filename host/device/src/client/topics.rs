//! What a controller sends without a request: telemetry, events, log lines; and what of it was lost.

use std::collections::VecDeque;

use model_core::link::endpoints::{EVENT, LOG, TELEMETRY};
use model_core::link::frame::Header;
use model_core::link::messages::{Event, Telemetry};
use serde::Serialize;

/// Telemetry that no one fetches is kept up to this many samples: a minute at 1 kHz.
const BACKLOG: usize = 60_000;

/// What a device sends without a request.
#[derive(Debug, Clone, PartialEq)]
pub enum Topic {
    /// A sample.
    Telemetry(Telemetry),
    /// Something that happened.
    Event(Event),
    /// A log line, for [`LogTable`](crate::log_table::LogTable).
    Log(Vec<u8>),
}

/// What did not arrive.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Losses {
    /// Samples that are missing at the rate of the subscription, by the tick counter of the device. Without a
    /// subscription, those that the sequence numbers miss.
    pub samples: u64,
    /// Gaps in which they are missing.
    pub gaps: u64,
    /// Samples that the device has numbered and that did not arrive: lost on the line, or without room in the device.
    pub unreceived: u64,
    /// Frames whose check failed, and bytes between frames that were none.
    pub bad_frames: u64,
    /// Requests that were sent again.
    #[serde(rename = "repeated_requests")]
    pub repeats: u64,
    /// Samples that arrived and were never fetched.
    pub unread: u64,
}

impl Losses {
    /// What was lost after `before`.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self {
            samples: self.samples.saturating_sub(before.samples),
            gaps: self.gaps.saturating_sub(before.gaps),
            unreceived: self.unreceived.saturating_sub(before.unreceived),
            bad_frames: self.bad_frames.saturating_sub(before.bad_frames),
            repeats: self.repeats.saturating_sub(before.repeats),
            unread: self.unread.saturating_sub(before.unread),
        }
    }
}

/// Topics in the order of their arrival, until they are fetched.
#[derive(Debug, Default)]
pub(super) struct Topics {
    queue: VecDeque<Topic>,
    /// Sequence number of the next sample, once there was one.
    expected: Option<u16>,
    /// What the sequence numbers miss: samples and gaps are those of [`Topics::losses`] until a subscription counts ticks.
    pub numbered: Losses,
    /// What a subscription misses by the tick counter: samples and gaps.
    by_ticks: Option<(u64, u64)>,
}

impl Topics {
    /// The oldest one.
    pub fn pop(&mut self) -> Option<Topic> {
        self.queue.pop_front()
    }

    /// Leaves out the samples that nothing has fetched yet.
    pub fn forget_samples(&mut self) {
        self.queue.retain(|topic| !matches!(topic, Topic::Telemetry(_)));
    }

    /// What did not arrive so far, without the frames that were damaged.
    pub fn losses(&self) -> Losses {
        let (samples, gaps) = self.by_ticks.unwrap_or((self.numbered.samples, self.numbered.gaps));
        Losses { samples, gaps, unreceived: self.numbered.samples, ..self.numbered }
    }

    /// Adds what a subscription finds missing before a sample that it takes.
    pub fn miss(&mut self, missing: u64) {
        let (samples, gaps) = self.by_ticks.unwrap_or_default();
        self.by_ticks = Some((samples + missing, gaps + u64::from(missing > 0)));
    }

    /// How many pairs of neighbouring samples wait, and the least number of ticks between the two of a pair.
    pub fn gaps(&self) -> (usize, Option<u64>) {
        let tick =
            |topic: &Topic| if let Topic::Telemetry(sample) = topic { Some(sample.tick) } else { None };
        let ticks: Vec<u64> = self.queue.iter().filter_map(tick).collect();
        let gaps = ticks.windows(2).filter_map(|pair| pair[1].checked_sub(pair[0]));
        (ticks.len().saturating_sub(1), gaps.min())
    }

    /// Takes a frame; one that cannot be decoded is dropped, and shows as a gap.
    pub fn take(&mut self, header: Header, body: &[u8]) {
        if header.id == TELEMETRY {
            let Ok(sample) = postcard::from_bytes::<Telemetry>(body) else { return };
            let missing = self.expected.map_or(0, |expected| header.sequence.wrapping_sub(expected));
            self.numbered.samples += u64::from(missing);
            self.numbered.gaps += u64::from(missing > 0);
            self.expected = Some(header.sequence.wrapping_add(1));
            self.queue.push_back(Topic::Telemetry(sample));
        } else if header.id == EVENT {
            let event = postcard::from_bytes::<Event>(body);
            self.queue.extend(event.ok().map(Topic::Event));
        } else if header.id == LOG {
            self.queue.push_back(Topic::Log(body.to_vec()));
        }
        while self.queue.len() > BACKLOG {
            self.queue.pop_front();
            self.numbered.unread += 1;
        }
    }
}
