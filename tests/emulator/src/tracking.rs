//! How well a controller follows: one run over the link, judged by what was true on the bench.

use std::time::{Duration, Instant};

use model_core::link::endpoints::{
    ClearFault, Disarm, GetSettings, GetStatus, SetSettings, SetTelemetry, StartMode, Stop,
};
use model_core::link::messages::{
    Event, FaultReport, Mode, Reference, SetPoint, Start, State, Telemetry, TelemetryRate,
};
use model_core::link::settings::{FeedForward, Settings};
use pam_device::{Client, Topic};

use crate::machine::HOPELESS;

/// Waits for the event of a fault.
///
/// # Panics
/// When none is reported.
pub fn stopped(client: &mut Client) -> FaultReport {
    let deadline = Instant::now() + HOPELESS;
    while Instant::now() < deadline {
        client.keep_alive().expect("the line is there");
        let topic = client.topic(Duration::from_millis(50)).expect("the line is there");
        if let Some(Topic::Event(Event::Fault(report))) = topic {
            return report;
        }
    }
    panic!("no fault was reported");
}

/// the setpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// A setpoint.
    Point(SetPoint),
    /// A wave of the device.
    Wave(Reference),
}

/// A stretch of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// the setpoint.
    pub wanted: Wanted,
    /// For how many ticks.
    pub ticks: u64,
    /// Ticks at its beginning that are not judged: the way from one wave to another.
    pub unjudged: u64,
}

/// Sends settings: those in force with a change.
///
/// # Panics
/// When the device refuses them.
pub fn set(client: &mut Client, change: impl FnOnce(&mut Settings)) {
    let mut settings = client.call::<GetSettings>(&()).expect("its settings");
    change(&mut settings);
    client.call_once::<SetSettings>(&settings).expect("it takes them");
}

/// Settings for a comparison: where the pressure comes from, and a trim of force.
pub fn compare(feed_forward: FeedForward, proportional: f32, integral: f32) -> impl FnOnce(&mut Settings) {
    move |settings| {
        settings.feed_forward = feed_forward;
        settings.force_loop.proportional_pa_per_n = proportional;
        settings.force_loop.integral_pa_per_n_s = integral;
        settings.force_loop.trim_limit_pa = if proportional + integral > 0.0 { 600e3 } else { 0.0 };
    }
}

/// The next sample, or the event that stopped the device.
///
/// # Panics
/// When nothing comes any more.
pub fn sample(client: &mut Client) -> Result<Telemetry, Event> {
    let deadline = Instant::now() + HOPELESS;
    loop {
        client.keep_alive().expect("the line is there");
        match client.topic(Duration::from_millis(500)).expect("the line is there") {
            Some(Topic::Telemetry(sample)) => return Ok(sample),
            Some(Topic::Event(event @ Event::Fault(_))) => return Err(event),
            Some(Topic::Event(_) | Topic::Log(_)) => {}
            None => assert!(Instant::now() < deadline, "no telemetry"),
        }
    }
}

/// Brings a device to `Running` from wherever it is, at full telemetry. It continues without a request however long this process has to wait for a
/// busy machine, on a bench that may answer three times as fast as a watch goes.
///
/// # Panics
/// When it refuses.
pub fn start(client: &mut Client, mode: Mode) {
    let status = client.call::<GetStatus>(&()).expect("a status");
    if status.state == State::Fault {
        client.call::<ClearFault>(&()).expect("it clears");
    }
    set(client, |settings| settings.watch.autonomous = true);
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 1 }).expect("telemetry");
    // The first readings must be there before anything is armed.
    for _ in 0..3 {
        sample(client).expect("no fault while disarmed");
    }
    pam_device::run::arm(client).expect("it arms");
    client.call::<StartMode>(&Start { mode, session: client.session() }).expect("it starts");
}

/// Runs stretches of one mode and gives the samples that are judged; ends disarmed.
///
/// # Panics
/// When the device refuses or a fault stops it.
pub fn run(client: &mut Client, mode: Mode, stretches: &[Stretch]) -> Vec<Telemetry> {
    start(client, mode);
    let mut judged = Vec::new();
    for stretch in stretches {
        let began = match stretch.wanted {
            Wanted::Point(point) => client.set_point(point).expect("a set-point"),
            Wanted::Wave(wave) => client.reference(wave).expect("a wave"),
        };
        loop {
            let sample = sample(client).unwrap_or_else(|event| panic!("stopped by {event:?}"));
            let Some(at) = sample.tick.checked_sub(began.ticks + 1) else { continue };
            if at >= stretch.ticks {
                break;
            }
            if at >= stretch.unjudged {
                judged.push(sample);
            }
        }
    }
    client.call::<Stop>(&()).expect("it stops");
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
    client.call::<Disarm>(&()).expect("it disarms");
    judged
}

/// Root mean square of `asked − value`.
pub fn rms(samples: &[Telemetry], value: impl Fn(&Telemetry) -> f32) -> f64 {
    let sum: f64 = samples.iter().map(|s| f64::from(s.setpoint - value(s)).powi(2)).sum();
    (sum / samples.len().max(1) as f64).sqrt()
}

/// Measured force of the first muscle.
pub fn force(sample: &Telemetry) -> f32 {
    sample.sides.first().map_or(f32::NAN, |side| side.force_n)
}

/// Measured stroke of the first muscle.
pub fn stroke(sample: &Telemetry) -> f32 {
    sample.sides.first().map_or(f32::NAN, |side| side.stroke_m)
}
