//! What `host record` and `host run` say of a recording: in its side file `NAME.json`, and with `--json`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use pam_device::reachability::Unreached;
use pam_device::recorder::{About, Ended};
use serde::Serialize;
use serde_json::Value;

/// `NAME.json` beside a recording of `host record`.
#[derive(Debug, Serialize)]
pub(crate) struct Record {
    #[serde(flatten)]
    pub about: About,
    pub samples_per_s: f64,
    /// Absent until the recording has ended.
    #[serde(flatten)]
    pub end: Option<RecordEnd>,
}

/// How a recording of `host record` ended.
#[derive(Debug, Serialize)]
pub(crate) struct RecordEnd {
    #[serde(flatten)]
    pub ended: Ended,
    /// What changed since the reference, as `pam-diagnose/1`.
    pub changed: Option<Value>,
    pub files: Vec<String>,
}

/// `host record --json`.
#[derive(Debug, Serialize)]
pub(crate) struct Recorded<'a> {
    #[serde(flatten)]
    pub record: &'a Record,
    pub rows: u64,
}

/// `NAME.json` beside the recording of a run, and `host run --json`.
#[derive(Debug, Serialize)]
pub(crate) struct Run {
    #[serde(flatten)]
    pub about: About,
    /// Absent where the live view or the demonstration records.
    #[serde(flatten)]
    pub request: Option<RunRequest>,
    /// Absent until the recording has ended.
    #[serde(flatten)]
    pub ended: Option<Ended>,
    /// Absent as [`Self::request`] and [`Self::ended`].
    #[serde(flatten)]
    pub outcome: Option<RunOutcome>,
}

impl Run {
    /// Of a recording without an order of its own, as it begins.
    pub(crate) fn watched(about: About) -> Self {
        Self { about, request: None, ended: None, outcome: None }
    }
}

/// The request of a run.
#[derive(Debug, Serialize)]
pub(crate) struct RunRequest {
    pub mode: &'static str,
    pub setpoint_profile: Option<String>,
    /// Of the joint; null without an angle.
    pub stiffness_Nm_per_rad: Option<f64>,
    /// The unit of the setpoint.
    pub unit: &'static str,
}

/// How a run went.
#[derive(Debug, Serialize)]
pub(crate) struct RunOutcome {
    pub samples: u64,
    /// Deviation from the setpoint; null without a sample.
    pub tracking_rms: Option<f64>,
    pub tracking_rms_after_1_s: Option<f64>,
    /// Ticks in saturation; null after a fault.
    pub saturated_ticks: Option<u32>,
    /// Null without a table, and for a run of pressure.
    pub reach: Option<Unreached>,
    /// What changed since the reference, as `pam-diagnose/1`.
    pub changed: Option<Value>,
}

/// The shapes for the published schemas: the device library writes its part and knows no schemas.
#[cfg(test)]
pub(crate) mod schema {
    #![allow(dead_code, reason = "only the shape counts")]

    use schemars::JsonSchema;
    use serde_json::{Map, Value};

    /// A recording of `host record`. Fields of the end are absent while it grows.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    pub(crate) struct Record {
        #[schemars(flatten)]
        about: About,
        samples_per_s: f64,
        files: Option<Vec<String>>,
        #[schemars(flatten)]
        end: End,
    }

    /// The recording of a run. Fields of the end are absent while it grows.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    pub(crate) struct Run {
        #[schemars(flatten)]
        about: About,
        mode: Option<String>,
        setpoint_profile: Option<String>,
        /// Of the joint; null without an angle.
        stiffness_Nm_per_rad: Option<f64>,
        /// The unit of the setpoint, and of the deviation from it.
        unit: Option<String>,
        samples: Option<u64>,
        tracking_rms: Option<f64>,
        tracking_rms_after_1_s: Option<f64>,
        saturated_ticks: Option<u32>,
        reach: Option<Reach>,
        #[schemars(flatten)]
        end: End,
    }

    /// What is known when a recording begins.
    #[derive(JsonSchema)]
    struct About {
        schema: String,
        /// When the recording began, ISO 8601 in UTC.
        date: String,
        /// Release of the host program.
        host: String,
        port: String,
        device: LinkedDevice,
    }

    /// A device, and the messages that it understands.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    struct LinkedDevice {
        #[schemars(flatten)]
        device: Device,
        /// Hash of the messages of the link, in hexadecimal.
        schema: String,
    }

    /// A device.
    #[derive(JsonSchema)]
    pub(crate) struct Device {
        board: String,
        link_version: u16,
        release: String,
        serial: String,
        /// All settings, by group.
        settings: Map<String, Value>,
        starts: u32,
        store_format: u16,
        table_format: u16,
        /// The table of each muscle; null where there is none.
        tables: Vec<Option<StoredTable>>,
        ticks_per_s: u32,
    }

    /// A table in a device.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    struct StoredTable {
        bytes: u32,
        /// Check sum, in hexadecimal.
        crc: String,
        generation: u32,
    }

    /// How a recording ended.
    #[derive(JsonSchema)]
    struct End {
        losses: Option<Losses>,
        /// `time`, `interrupt`, `the page`, or what went wrong.
        ended_by: Option<String>,
        /// What changed since the reference, as `pam-diagnose/1`.
        changed: Option<Value>,
        rows: Option<u64>,
        /// Samples that were not numbers, or not later than the one before.
        left_out: Option<u64>,
        events: Option<Vec<Event>>,
    }

    /// What did not arrive.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    struct Losses {
        samples: u64,
        gaps: u64,
        unreceived: u64,
        bad_frames: u64,
        repeated_requests: u64,
        unread: u64,
    }

    /// What the device reported without a request.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    struct Event {
        /// `fault`, `state` or `trace-full`.
        event: String,
        text: String,
        time_s: Option<f64>,
        remedy: Option<String>,
    }

    /// How long the setpoint was beyond what the table can do, or was tested for.
    #[derive(JsonSchema)]
    #[schemars(deny_unknown_fields)]
    struct Reach {
        beyond_blocked_force_s: f64,
        below_deadband_s: f64,
        not_rising_s: f64,
        outside_tested_s: f64,
    }
}
