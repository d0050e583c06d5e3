//! Telemetry of a controller that this program only watches: samples and events until the time is over.

use std::time::{Duration, Instant};

use model_core::link::endpoints::GetStatus;
use model_core::link::messages::{Event, Telemetry};

use crate::error::DeviceCode;
use crate::run::Ending;
use crate::{Client, Subscription, Topic, messages};
use pam_data::error::{Error, Result};

/// Silence of the telemetry after which the device's status is read.
const SILENCE: Duration = Duration::from_secs(2);

/// What a device sends.
#[derive(Debug)]
pub enum Happened<'a> {
    /// A sample, and the time since the first one, ms.
    Sample(&'a Telemetry, u64),
    /// A fault, a change of state, a full trace.
    Event(&'a Event),
}

/// Hands on every sample and event until `seconds` of device time are over or `stop` says so. The telemetry is left as it was before.
///
/// # Errors
/// A device that is silent, refuses, or restarts; what `take` returns.
pub fn watch(
    client: &mut Client,
    every_ticks: u16,
    seconds: Option<f64>,
    take: impl FnMut(Happened<'_>) -> Result<()>,
    stop: impl Fn() -> bool,
) -> Result<Ending> {
    let mut stream = Subscription::begin(client, every_ticks)?;
    let watched = follow(client, &mut stream, seconds, take, stop);
    // A device that is gone cannot stop its telemetry; why it is gone is the better news.
    let quiet = stream.end(client);
    let ending = watched?;
    quiet?;
    Ok(ending)
}

fn follow(
    client: &mut Client,
    stream: &mut Subscription,
    seconds: Option<f64>,
    mut take: impl FnMut(Happened<'_>) -> Result<()>,
    stop: impl Fn() -> bool,
) -> Result<Ending> {
    let silence = stream.silence(SILENCE);
    // Samples that an earlier run left on the line have another rate.
    let begun = client.call::<GetStatus>(&())?.time_us;
    let (mut first, mut last) = (None, 0);
    let mut last_received = Instant::now();
    while !stop() {
        match client.topic(Duration::from_millis(50))? {
            Some(Topic::Telemetry(sample)) if first.is_none() && sample.time_us < begun => {}
            Some(Topic::Telemetry(sample)) => {
                last_received = Instant::now();
                if sample.time_us < last {
                    return Err(Error::new(
                        DeviceCode::DeviceSilent,
                        "the device restarted during the recording",
                    )
                    .help("`host device faults` shows whether a fault caused it; check the power supply"));
                }
                last = sample.time_us;
                let elapsed = last - *first.get_or_insert(last);
                if seconds.is_some_and(|end| elapsed as f64 * 1e-6 >= end) {
                    return Ok(Ending::Done);
                }
                if stream.takes(client, &sample) {
                    take(Happened::Sample(&sample, elapsed / 1000))?;
                }
            }
            Some(Topic::Event(event)) => take(Happened::Event(&event))?,
            Some(Topic::Log(_)) => {}
            None if last_received.elapsed() > silence => {
                let status = client.call::<GetStatus>(&())?;
                return Err(Error::new(
                    DeviceCode::DeviceSilent,
                    format!("the device answers, but sends no telemetry; it is {}", messages::state(status.state)),
                )
                .help("it may have restarted: `host device info` shows its time since start and whether ticks advance"));
            }
            None => stream.renew(client)?,
        }
    }
    Ok(Ending::Stopped)
}
