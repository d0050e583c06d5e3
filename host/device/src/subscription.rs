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
const RENEW_AFTER: Duration = Duration::from_millis(500);
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
    last_message: Instant,
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
        Ok(Self { every_ticks, sent_ticks, before, next: None, last_message: now, requested: now })
    }

    /// Whether a sample is one of this program's: of a finer stream it takes those of its own rate. A gap of the tick counter before
    /// it counts as lost, whatever its cause: the line, the queue of this program or of the device, another program that changed
    /// the stream.
    pub fn takes(&mut self, client: &mut Client, sample: &Telemetry) -> bool {
        self.last_message = Instant::now();
        let missing = self.place(sample.tick);
        if let Some(missing) = missing {
            client.miss(missing);
        }
        missing.is_some()
    }

    /// Notes that the stream is alive, for a sample that is of no use.
    pub(crate) fn mark_alive(&mut self) {
        self.last_message = Instant::now();
    }

    /// Takes the sample of a tick, if it is due; gives how many are missing before it.
    fn place(&mut self, tick: u64) -> Option<u64> {
        let every = u64::from(self.every_ticks.max(1));
        let (missing, next) = match self.next {
            Some(next) if tick < next && tick + every >= next => return None,
            Some(next) if tick >= next => {
                let missing = (tick - next) / every;
                (missing, if missing == 0 { next } else { tick } + every)
            }
            // The first one, or far before the last one: the device has restarted.
            _ => (0, tick + every),
        };
        self.next = Some(next);
        Some(missing)
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
        let patience = self.silence(RENEW_AFTER);
        if self.last_message.elapsed() > patience && self.requested.elapsed() > patience {
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

    /// Ticks of the samples that are taken, and how many are missing between them.
    fn taken(every_ticks: u16, ticks: impl IntoIterator<Item = u64>) -> (Vec<u64>, u64) {
        let now = Instant::now();
        let mut subscription = Subscription {
            every_ticks,
            sent_ticks: 1,
            before: None,
            next: None,
            last_message: now,
            requested: now,
        };
        let mut missing = 0;
        let due = |tick: &u64| subscription.place(*tick).inspect(|gap| missing += gap).is_some();
        (ticks.into_iter().filter(due).collect(), missing)
    }

    #[test]
    fn a_program_takes_the_samples_of_its_own_rate() {
        assert_eq!(taken(1, 5..9).0, [5, 6, 7, 8]);
        assert_eq!(taken(10, 5..40).0, [5, 15, 25, 35]);
        assert_eq!(taken(10, (0..40).step_by(3)).0, [0, 12, 21, 30], "the mean rate is kept");
        assert_eq!(taken(10, (5..20).chain(100..115)).0, [5, 15, 100, 110], "after a gap");
        assert_eq!(taken(10, (500..512).chain(1..13)).0, [500, 510, 1, 11], "after a restart of the device");
    }

    #[test]
    fn every_tick_without_a_sample_is_missing() {
        let missing = |every, ticks: &[u64]| taken(every, ticks.iter().copied()).1;
        assert_eq!(missing(1, &[5, 6, 7]), 0);
        assert_eq!(missing(1, &[5, 9, 10, 12]), 3 + 1);
        assert_eq!(missing(1, &[5, 6, 16, 26]), 9 + 9, "another program made the stream coarser");
        assert_eq!(missing(10, &[5, 15, 100, 110]), 7, "25 to 85; the next one is late");
        assert_eq!(taken(10, (0..2_000).step_by(9)).1, 0, "a finer stream that does not divide");
        assert_eq!(missing(1, &[500, 501, 1, 2]), 0, "a restart shows no number");
        assert_eq!(missing(1, &[0, u64::MAX - 2]), u64::MAX - 3);
    }

    #[test]
    fn a_slow_stream_is_not_called_silent() {
        let now = Instant::now();
        let slow = Subscription {
            every_ticks: 10_000,
            sent_ticks: 10_000,
            before: None,
            next: None,
            last_message: now,
            requested: now,
        };
        assert_eq!(slow.silence(Duration::from_secs(2)), Duration::from_secs(30));
    }
}
