//! What the server sends to the page without a request: samples, faults, and the ranges of the sensors.

use model_core::link::messages::{Mode, SideSample, State, Telemetry};
use model_core::link::settings::Settings;
use serde_json::{Value, json};
use tokio::sync::broadcast;

use crate::change_watch::Update;
use pam_data::error::Error;
use pam_device::messages;
use pam_diagnose::reference::Verdict;

/// Something went wrong.
pub(super) fn tell(say: &broadcast::Sender<String>, level: &str, error: &Error) {
    let _ = say
        .send(json!({ "k": "e", "level": level, "text": error.cause(), "help": error.advice() }).to_string());
}

/// What changed since the reference, in one line.
pub(super) fn compared(update: &Update) -> String {
    let changed = matches!(update, Update::Answer(report) if report.verdict != Verdict::Consistent);
    json!({ "k": "c", "text": update.words(), "changed": changed }).to_string()
}

/// Between what each fitted sensor can read, and the unit, by the names and in the units of [`batch`].
pub(super) fn credible(settings: &Settings) -> Value {
    let sensors = [
        ("F", &settings.force, 1.0, "N"),
        ("P", &settings.pressure, 1e-3, "kPa"),
        ("x", &settings.stroke, 1e3, "mm"),
    ];
    sensors
        .into_iter()
        .filter(|(_, watch, ..)| watch.fitted)
        .map(|(name, watch, scale, unit)| {
            let end = |v: f32| (f64::from(v) * scale * 1e3).round() / 1e3;
            (name.to_owned(), json!([end(watch.low), end(watch.high), unit]))
        })
        .collect::<serde_json::Map<_, _>>()
        .into()
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
    json!({
        "k": "t",
        "t": samples.iter().map(|s| s.time_us as f64 * 1e-6).collect::<Vec<_>>(),
        "F": side(&|s| f64::from(s.force_n), 1e3),
        "P": side(&|s| f64::from(s.pressure_pa) * 1e-3, 1e2),
        "x": side(&|s| f64::from(s.stroke_m) * 1e3, 1e4),
        "c": side(&|s| f64::from(s.command_pa) * 1e-3, 1e2),
        "m": driven(&model),
        "a": driven(&|s| f64::from(s.setpoint) * scale),
        "mode": samples.last().map(|s| messages::mode(s.mode)),
    })
    .to_string()
}
