//! What the server answers to the page's orders.

use serde::Serialize;

use crate::documents::bench::Compare;
use model_core::link::settings::Settings;
use pam_fit::Summary;

/// The answer to an order, as JSON without a tag: the page knows what it ordered.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Answer {
    /// It was done, and there is nothing to say.
    Done,
    /// Whether it is so.
    Truth(bool),
    /// Serial ports.
    Ports(Vec<String>),
    /// Where a vent goes, past everything else.
    VentPath(VentPath),
    /// The emulated controller that was started.
    Emulated(Emulated),
    /// The latched fault.
    Faults(Faults),
    /// The settings of the controller.
    Settings(Box<StoredSettings>),
    /// Signals and readings of the sensors.
    Signals(Signals),
    /// The scale of a sensor.
    Calibrated(Calibrated),
    /// The pressure regulator.
    Identified(Identified),
    /// The recording that was ended.
    Ended(Ended),
    /// What a table would change.
    Difference(Difference),
    /// The table that was sent.
    Flashed(Flashed),
    /// Recordings and table.
    Recordings(Recordings),
    /// The curves of a recording.
    Curves(Curves),
    /// Two recordings, compared.
    Compared(Compared),
    /// A fit.
    Fitted(Box<Fitted>),
    /// A diagnosis.
    Diagnosed(Diagnosed),
}

/// Where a vent goes.
#[derive(Debug, Serialize)]
pub struct VentPath {
    pub(super) address: String,
    pub(super) token: String,
}

/// An emulated controller.
#[derive(Debug, Serialize)]
pub struct Emulated {
    /// What it is, as text.
    pub(super) controller: String,
}

/// Faults as text.
#[derive(Debug, Serialize)]
pub struct Faults {
    pub(super) latched: Option<String>,
}

/// Settings in force, and those of a new controller.
#[derive(Debug, Serialize)]
pub struct StoredSettings {
    pub(super) stored: Settings,
    pub(super) defaults: Settings,
}

/// The sensors that the board measures.
#[derive(Debug, Serialize)]
pub struct Signals {
    pub(super) sensors: Vec<SensorSignal>,
}

/// One sensor.
#[derive(Debug, Serialize)]
pub struct SensorSignal {
    pub(super) sensor: &'static str,
    pub(super) unit: &'static str,
    /// Mean of the signal.
    pub(super) signal: f32,
    /// The reading that the present scale makes of it.
    pub(super) reading: f64,
}

/// A scale through known values, in the sensor's unit: value at a signal of zero, and value per unit of the signal.
#[derive(Debug, Serialize)]
pub struct Calibrated {
    pub(super) unit: &'static str,
    pub(super) before: [f64; 2],
    pub(super) now: [f64; 2],
    /// Value of the scale less known value, for each pair.
    pub(super) errors: Vec<f64>,
    /// Whether it is in the settings.
    pub(super) kept: bool,
}

/// A pressure regulator that was found.
#[derive(Debug, Serialize)]
pub struct Identified {
    pub(super) text: String,
    /// Whether it is in the settings.
    pub(super) kept: bool,
}

/// The recording that was ended.
#[derive(Debug, Serialize)]
pub struct Ended {
    /// `None` where nothing was recorded.
    pub(super) path: Option<std::path::PathBuf>,
}

/// What a table would change.
#[derive(Debug, Serialize)]
pub struct Difference {
    pub(super) text: String,
    /// The table that was compared.
    pub(super) table: String,
}

/// A table that was sent.
#[derive(Debug, Serialize)]
pub struct Flashed {
    /// Check sum, in hexadecimal.
    pub(super) crc: String,
    pub(super) bytes: u32,
    pub(super) generation: u32,
}

/// Recordings and the table of the last fit.
#[derive(Debug, Serialize)]
pub struct Recordings {
    pub(super) recordings: Vec<String>,
    pub(super) table: Option<String>,
    /// The description of the muscle of an example.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) muscle: Option<String>,
}

/// The curves of a recording, downsampled.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, reason = "the page's names")]
pub struct Curves {
    pub(super) name: String,
    /// Time after the start, s.
    pub(super) t: Vec<f64>,
    /// Force, N.
    pub(super) F: Option<Vec<f64>>,
    /// Pressure, kPa.
    pub(super) P: Vec<f64>,
    /// Stroke, mm.
    pub(super) x: Vec<f64>,
    /// Rows before thinning.
    pub(super) rows: usize,
}

/// Two recordings, compared.
#[derive(Debug, Serialize)]
pub struct Compared {
    #[serde(flatten)]
    pub(super) found: Compare,
    pub(super) text: String,
}

/// A fit, its table and its report.
#[derive(Debug, Serialize)]
pub struct Fitted {
    pub(super) summary: Summary,
    pub(super) text: String,
    pub(super) lines: Vec<LoadLine>,
    pub(super) table: String,
    /// Address of the report.
    pub(super) report: String,
}

/// A measured and fitted load line: contraction in percent, force in N.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, reason = "the page's names")]
pub struct LoadLine {
    pub(super) kPa: f64,
    pub(super) x: Vec<f64>,
    pub(super) F: Vec<f64>,
    /// The model's contractions, out and back.
    pub(super) mx: Vec<f64>,
    /// The model's forces.
    pub(super) mF: Vec<f64>,
}

/// A diagnosis and its report.
#[derive(Debug, Serialize)]
pub struct Diagnosed {
    pub(super) text: String,
    /// Address of the report.
    pub(super) report: String,
}

/// Why an order was not carried out.
#[derive(Debug, Serialize)]
pub(super) struct Failure<'a> {
    /// The cause.
    pub error: &'a str,
    /// The place.
    pub at: String,
    /// The remedy.
    pub help: Option<&'a str>,
    /// The code of the error.
    pub code: &'a str,
}
