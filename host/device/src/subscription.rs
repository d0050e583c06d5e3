//! Telemetry on a line that programs share: the device has one rate for all of them.
//!
//! A subscription never makes the stream of another program coarser, and takes the samples of its own rate from a finer stream. It asks
//! again after a silence. At its end it leaves the stream as it found it.

use std::time::{Duration, Instant};

use model_core::link::endpoints::SetTelemetry;
use model_core::link::messages::{Telemetry, TelemetryRate};

use super::{Client, messages};
use pam_data::error::Result;

/// How long to listen for a stream that is there already: one of 8 Hz is found.
const LISTEN: Duration = Duration::from_millis(250);
/// Silence after which the stream is requested again: another program may have ended it.
const AGAIN: Duration = Duration::from_millis(500);
/// Periods of the stream that count as silence where they last longer.
const PERIODS: u32 = 3;
/// A tick of the controller.
const TICK: Duration = Duration::from_millis(1);

/// One program's part of the telemetry.
#[derive(Debug)]
pub struct Subscription {
    /// Ticks between two samples that this program takes.
    every_ticks: u16,
    /// Ticks between two samples that the device sends.
    sent_ticks: u16,
    /// What another program had requested before.
    before: Option<u16>,
    /// Tick of the next sample that this program takes.
    next: Option<u64>,
    heard: Instant,
    requested: Instant,
}

impl Subscription {
    /// Requests one sample every `every_ticks` ticks.
    ///
    /// # Errors
    /// What the device refuses, or silence.
    pub fn begin(client: &mut Client, every_ticks: u16) -> Result<Self> {
        let before = client.telemetry_rate(LISTEN)?;
        let sent_ticks = before.map_or(every_ticks, |before| before.min(every_ticks));
        if before != Some(sent_ticks) {
            request(client, sent_ticks)?;
        }
        let now = Instant::now();
        Ok(Self { every_ticks, sent_ticks, before, next: None, heard: now, requested: now })
    }

    /// Whether a sample is one of this program's: of a finer stream it takes those of its own rate.
    pub fn takes(&mut self, sample: &Telemetry) -> bool {
        self.heard = Instant::now();
        let every = u64::from(self.every_ticks);
        let next = match self.next {
            // Before the last one: the device has restarted.
            Some(next) if sample.tick < next && sample.tick + every >= next => return false,
            Some(next) if sample.tick >= next && sample.tick - next < every => next + every,
            _ => sample.tick + every,
        };
        self.next = Some(next);
        true
    }

    /// Silence after which something is wrong: longer than `least` for a slow stream.
    #[must_use]
    pub fn silence(&self, least: Duration) -> Duration {
        least.max(TICK * u32::from(self.every_ticks) * PERIODS)
    }

    /// Requests the stream again after a silence, from time to time.
    ///
    /// # Errors
    /// What the device refuses, or silence.
    pub fn renew(&mut self, client: &mut Client) -> Result<()> {
        let patience = self.silence(AGAIN);
        if self.heard.elapsed() > patience && self.requested.elapsed() > patience {
            self.requested = Instant::now();
            // Who had requested it before has ended it.
            (self.before, self.sent_ticks) = (None, self.every_ticks);
            request(client, self.every_ticks)?;
        }
        Ok(())
    }

    /// Leaves the stream as it was. One that this program began continues while another session owns the device.
    ///
    /// # Errors
    /// What the device refuses, or silence.
    pub fn end(self, client: &mut Client) -> Result<()> {
        match self.before {
            Some(before) if before == self.sent_ticks => Ok(()),
            Some(before) => request(client, before),
            None if client.is_owned_by_another()? => Ok(()),
            None => request(client, 0),
        }
    }
}

fn request(client: &mut Client, every_ticks: u16) -> Result<()> {
    client
        .try_call::<SetTelemetry>(&TelemetryRate { every_ticks })?
        .map(drop)
        .map_err(|refusal| messages::refused("telemetry", refusal))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(every_ticks: u16, ticks: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let now = Instant::now();
        let mut subscription =
            Subscription { every_ticks, sent_ticks: 1, before: None, next: None, heard: now, requested: now };
        let mut sample = Telemetry::default();
        ticks
            .into_iter()
            .filter(|tick| {
                sample.tick = *tick;
                subscription.takes(&sample)
            })
            .collect()
    }

    #[test]
    fn a_program_takes_the_samples_of_its_own_rate() {
        assert_eq!(taken(1, 5..9), [5, 6, 7, 8]);
        assert_eq!(taken(10, 5..40), [5, 15, 25, 35]);
        assert_eq!(taken(10, (0..40).step_by(3)), [0, 12, 21, 30], "the mean rate is kept");
        assert_eq!(taken(10, (5..20).chain(100..115)), [5, 15, 100, 110], "after a gap");
        assert_eq!(taken(10, (500..512).chain(1..13)), [500, 510, 1, 11], "after a restart of the device");
    }

    #[test]
    fn a_slow_stream_is_not_called_silent() {
        let now = Instant::now();
        let slow = Subscription {
            every_ticks: 10_000,
            sent_ticks: 10_000,
            before: None,
            next: None,
            heard: now,
            requested: now,
        };
        assert_eq!(slow.silence(Duration::from_secs(2)), Duration::from_secs(30));
    }
}
