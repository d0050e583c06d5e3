//! What the server sends to the page without a request: samples, faults, and the ranges of the sensors.

use model_core::link::messages::{Mode, SideSample, State, Telemetry};
use model_core::link::settings::{SensorWatch, Settings};
use serde::Serialize;
use tokio::sync::broadcast;

use crate::change_watch::Update;
use pam_data::error::Error;
use pam_device::messages;
use pam_diagnose::reference::Verdict;

/// A message to the page, on a line of its own.
#[derive(Debug, Serialize)]
#[serde(tag = "k")]
pub(super) enum Message<'a> {
    /// Something went wrong.
    #[serde(rename = "e")]
    Error { level: &'a str, text: &'a str, help: Option<&'a str> },
    /// What changed since the reference.
    #[serde(rename = "c")]
    Compared { text: String, changed: bool },
    /// The state of the connection.
    #[serde(rename = "s")]
    State {
        connected: bool,
        #[serde(flatten)]
        controller: Option<Controller>,
    },
    /// Samples of the controller, column by column.
    #[serde(rename = "t")]
    Telemetry(Columns),
}

impl Message<'_> {
    pub(super) fn line(&self) -> String {
        // A structure of numbers and texts can always be written.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// What the page shows of a controller.
#[derive(Debug, Serialize)]
pub(super) struct Controller {
    pub port: String,
    pub board: &'static str,
    pub serial: String,
    pub release: String,
    /// Where the firmware of an emulated controller runs.
    pub emulated: Option<&'static str>,
    pub state: &'static str,
    pub mode: &'static str,
    pub fault: Option<String>,
    /// Samples that did not arrive.
    pub lost: u64,
    pub bad_frames: u64,
    /// Rows recorded so far.
    pub recording: Option<u64>,
    pub credible: Credible,
}

/// Between what each fitted sensor can read, and the unit, by the names and in the units of [`batch`].
#[derive(Debug, Serialize)]
#[allow(non_snake_case, reason = "the page's names")]
pub(super) struct Credible {
    #[serde(skip_serializing_if = "Option::is_none")]
    F: Option<Ends>,
    #[serde(skip_serializing_if = "Option::is_none")]
    P: Option<Ends>,
    #[serde(skip_serializing_if = "Option::is_none")]
    x: Option<Ends>,
}

/// The lowest and the highest reading, and the unit.
type Ends = (f64, f64, &'static str);

/// Samples as columns.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, reason = "the page's names")]
pub(super) struct Columns {
    /// Time, s.
    t: Vec<f64>,
    /// Force, N.
    F: Vec<f64>,
    /// Pressure, kPa.
    P: Vec<f64>,
    /// Stroke, mm.
    x: Vec<f64>,
    /// Commanded pressure, kPa.
    c: Vec<f64>,
    /// The table's force, N.
    m: Vec<Option<f64>>,
    /// The setpoint, in N, kPa or mm.
    a: Vec<Option<f64>>,
    mode: Option<&'static str>,
}

/// Something went wrong.
pub(super) fn tell(say: &broadcast::Sender<String>, level: &str, error: &Error) {
    let message = Message::Error { level, text: error.cause(), help: error.advice() };
    // Without a page nothing receives it.
    let _ = say.send(message.line());
}

/// What changed since the reference, in one line.
pub(super) fn compared(update: &Update) -> String {
    let changed = matches!(update, Update::Answer(report) if report.verdict != Verdict::Consistent);
    Message::Compared { text: update.description(), changed }.line()
}

/// Between what each fitted sensor can read.
pub(super) fn credible(settings: &Settings) -> Credible {
    let ends = |watch: &SensorWatch, scale: f64, unit: &'static str| {
        let end = |v: f32| (f64::from(v) * scale * 1e3).round() / 1e3;
        watch.fitted.then(|| (end(watch.low), end(watch.high), unit))
    };
    Credible {
        F: ends(&settings.force, 1.0, "N"),
        P: ends(&settings.pressure, 1e-3, "kPa"),
        x: ends(&settings.stroke, 1e3, "mm"),
    }
}

/// Samples as columns: times in s, forces in N, pressures in kPa, strokes in mm. The setpoint and the table's force are null while
/// the controller does not drive: no setpoint exists, and a table does not describe a vented muscle, which is slack.
pub(super) fn batch(samples: &[Telemetry]) -> String {
    let side = |pick: &dyn Fn(&SideSample) -> f64, digits: f64| -> Vec<f64> {
        let rounded = |v: f64| (v * digits).round() / digits;
        samples.iter().map(|s| s.sides.first().map_or(0.0, |x| rounded(pick(x)))).collect()
    };
    let scale = match samples.last().map(|s| s.mode) {
        Some(Mode::Pressure) => 1e-3,
        Some(Mode::Stroke) => 1e3,
        _ => 1.0,
    };
    let driven = |pick: &dyn Fn(&Telemetry) -> f64| -> Vec<Option<f64>> {
        samples.iter().map(|s| (s.state == State::Running).then(|| pick(s))).collect()
    };
    let model = |s: &Telemetry| s.sides.first().map_or(0.0, |x| (f64::from(x.model_n) * 1e3).round() / 1e3);
    Message::Telemetry(Columns {
        t: samples.iter().map(|s| s.time_us as f64 * 1e-6).collect(),
        F: side(&|s| f64::from(s.force_n), 1e3),
        P: side(&|s| f64::from(s.pressure_pa) * 1e-3, 1e2),
        x: side(&|s| f64::from(s.stroke_m) * 1e3, 1e4),
        c: side(&|s| f64::from(s.command_pa) * 1e-3, 1e2),
        m: driven(&model),
        a: driven(&|s| f64::from(s.setpoint) * scale),
        mode: samples.last().map(|s| messages::mode(s.mode)),
    })
    .line()
}
