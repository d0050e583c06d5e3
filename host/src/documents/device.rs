//! Documents of commands that talk to a controller.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use std::collections::BTreeMap;

use pam_device::recorder::Device;
use pam_device::table_diff::TableDiff;
use serde::Serialize;
use serde_json::{Map, Value};

/// `host device info --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Info {
    pub schema: &'static str,
    /// Identity, tables and settings, as every recording holds them.
    #[serde(flatten)]
    #[cfg_attr(test, schemars(with = "super::recording::schema::Device"))]
    pub device: Device,
    pub link_schema: String,
    pub muscles: u8,
    pub table_capacity: u32,
    pub trace_capacity: u32,
    pub reference_capacity: u32,
    pub started_by: &'static str,
    pub status: Status,
}

/// The present state.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Status {
    pub state: &'static str,
    pub mode: &'static str,
    pub fault: Option<&'static str>,
    pub time_s: f64,
    pub ticks: u64,
    pub overruns: u32,
    pub frames_good: u32,
    pub frames_bad: u32,
    pub telemetry_dropped: u32,
    pub saturated_ticks: u32,
    pub line_errors: u32,
    pub bus_offs: u32,
}

/// `host device faults --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Faults {
    pub schema: &'static str,
    pub latched: Option<Fault>,
    /// Since the start, by fault.
    pub counts: BTreeMap<String, u32>,
    pub past: Vec<Fault>,
}

/// A fault.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Fault {
    pub fault: &'static str,
    pub cause: &'static str,
    pub remedy: &'static str,
    pub time_s: f64,
    pub value: f32,
    pub limit: f32,
    pub muscle: &'static str,
    pub mode: &'static str,
    pub last: Last,
}

/// The last readings before a fault.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Last {
    pub pressure_Pa: f32,
    pub stroke_m: f32,
    pub force_N: f32,
}

/// `host device list --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Ports {
    pub schema: &'static str,
    pub ports: Vec<Port>,
}

/// A serial device.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(crate) enum Port {
    /// A controller answers there.
    Controller(Controller),
    /// None does.
    Other(Other),
}

/// A controller.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Controller {
    pub port: String,
    pub controller: bool,
    pub board: &'static str,
    pub serial: String,
    pub release: String,
    pub same_schema: bool,
}

/// A serial device without a controller.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Other {
    pub port: String,
    pub controller: bool,
    pub why: String,
}

/// `host device identify --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Regulator {
    pub schema: &'static str,
    pub gain: f64,
    pub offset_Pa: f64,
    pub lag_s: f64,
    pub line_s: f64,
    pub rate_Pa_per_s: f64,
    pub rate_limited: bool,
    pub deadband_Pa: Option<f64>,
    pub misfit_rms_Pa: f64,
    pub kept: bool,
}

/// `host update --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Firmware {
    pub schema: &'static str,
    /// The slot that runs.
    pub running: u8,
    pub slots: Vec<Option<FirmwareSlot>>,
}

/// `host update key --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct FirmwareKey {
    pub schema: &'static str,
    /// For `firmware/build --key`.
    pub public_key: String,
}

/// `host update pack --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct FirmwareFile {
    pub schema: &'static str,
    pub images: Vec<FirmwareImage>,
}

/// An image in a file of firmware.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct FirmwareImage {
    pub slot: u8,
    pub bytes: u32,
}

/// Firmware in a slot.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct FirmwareSlot {
    pub release: String,
    pub bytes: u32,
    pub crc: String,
    /// Whether a host has talked to it; without that it is given up after three starts.
    pub confirmed: bool,
}

/// `host device sensors --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Sensors {
    pub schema: &'static str,
    pub sensors: Vec<Sensor>,
    /// Whether the enable input is closed; none after a calibration.
    pub enable_closed: Option<bool>,
    /// The sensor that was calibrated.
    pub calibrated: Option<&'static str>,
    pub pairs: Vec<SensorPair>,
    /// Whether the new scale is in the settings of the device.
    pub kept: bool,
}

/// A sensor: `reading = at_zero + per_unit · signal`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Sensor {
    pub sensor: &'static str,
    /// What the board measures: volts at the pin of a board with converters.
    pub signal: f32,
    /// In its unit.
    pub reading: f64,
    pub unit: &'static str,
    pub at_zero: f32,
    pub per_unit: f32,
    pub filter_s: f32,
}

/// A known value and the signal at it.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct SensorPair {
    pub signal: f64,
    pub value: f64,
    /// Reading by the new scale, less the value.
    pub error: f64,
}

/// `host device settings --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Settings {
    pub schema: &'static str,
    /// By group and name.
    #[serde(flatten)]
    pub settings: Map<String, Value>,
}

/// `host device rollback --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Rollback {
    pub schema: &'static str,
    pub crc: String,
    pub bytes: u32,
    pub generation: u32,
    pub has_previous: bool,
}

/// `host device forget --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Forget {
    pub schema: &'static str,
    pub muscle: usize,
}

/// One line of `host device log --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct LogLine<'a> {
    pub schema: &'static str,
    /// Time of the device.
    pub time_s: Option<f64>,
    pub event: &'a str,
    pub text: &'a str,
    #[serde(flatten)]
    pub more: More,
}

/// What a line holds beside its text.
#[derive(Debug, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct More {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<String>,
}

/// `host device trace --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Trace<'a> {
    pub schema: &'static str,
    pub records: u32,
    pub every_ticks: u16,
    pub first_tick: u64,
    pub columns: BTreeMap<&'a str, &'a [f64]>,
}

/// `host flash --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Flash {
    pub schema: &'static str,
    pub port: String,
    pub crc: String,
    /// Between the device's table and the new one; null where there is none to compare with.
    pub difference: Option<Difference>,
    pub written: bool,
    /// Where the device's former table was saved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backup: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generation: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirmed_after_restart: Option<bool>,
}

/// The difference between two tables.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Difference {
    /// Quantities that differ; empty for equal tables.
    pub changes: Vec<Change>,
    /// Of the force over the new table's tested range; null where no force can be computed.
    pub force_max_N: Option<f64>,
    pub force_rms_N: Option<f64>,
}

/// One quantity that differs, with its unit.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Change {
    pub after: String,
    pub before: String,
    pub name: String,
}

impl Difference {
    pub(crate) fn of(found: TableDiff) -> Self {
        let changes = found.changes.into_iter();
        Self {
            changes: changes.map(|c| Change { after: c.after, before: c.before, name: c.name }).collect(),
            force_max_N: found.force.map(|f| f.0),
            force_rms_N: found.force.map(|f| f.1),
        }
    }
}

/// `host vent --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Vent {
    pub schema: &'static str,
    pub vented: bool,
    pub state: &'static str,
}
