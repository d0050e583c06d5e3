//! Documents of commands that need no device.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use serde::Serialize;

use pam_data::compare::Comparison;
use pam_diagnose::isolability::Isolability;

/// `host compare --json`: B minus A.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Compare {
    pub schema: &'static str,
    pub rows: usize,
    pub overlap_s: f64,
    pub columns: Vec<Column>,
}

impl Compare {
    pub(crate) fn of(found: &Comparison) -> Self {
        let columns = found.columns.iter().map(|c| Column {
            name: c.name,
            unit: c.unit,
            rms: c.rms,
            mean: c.mean,
            largest: c.largest,
            largest_at_s: c.largest_at,
        });
        Self {
            schema: "pam-compare/1",
            rows: found.rows,
            overlap_s: found.overlap,
            columns: columns.collect(),
        }
    }
}

/// One quantity.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Column {
    pub name: &'static str,
    pub unit: &'static str,
    pub rms: f64,
    pub mean: f64,
    pub largest: f64,
    pub largest_at_s: f64,
}

/// `host plan --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Plan<'a> {
    pub schema: &'static str,
    pub effects: Vec<EffectVisibility<'a>>,
}

/// What a protocol shows of one effect.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct EffectVisibility<'a> {
    pub effect: &'a str,
    /// Share of its energy that tables free over pressure cannot imitate.
    pub visible: f64,
    /// Effects that the protocol does not distinguish from it, with the cosine.
    pub confounded_with: &'a [(String, f64)],
}

impl<'a> EffectVisibility<'a> {
    pub(crate) fn of(row: &'a Isolability) -> Self {
        Self { effect: &row.effect, visible: row.visible, confounded_with: &row.confounded_with }
    }
}

/// `host plan --muscle --json`: protocols, best first.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct PlanOfRecordings<'a> {
    pub schema: &'static str,
    pub muscle: &'a str,
    /// `fit`, `diagnosis` or `both`.
    pub purpose: &'static str,
    /// Recordings that the plan continues.
    pub recordings: usize,
    /// Why the plan ends there, in one sentence.
    pub ended_by: &'a str,
    /// Predicted standard error of the table on unseen pressures and strokes before the plan.
    pub predicted_error_N: Option<f64>,
    /// Effects that the recordings so far leave possible.
    pub possible: Vec<String>,
    pub steps: Vec<PlannedStep>,
}

/// One step of a plan.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct PlannedStep {
    pub number: usize,
    pub name: String,
    pub what: String,
    /// Why, in one sentence.
    pub why: String,
    pub seconds: f64,
    pub table_nats: f64,
    pub effect_nats: f64,
    pub unseen_nats: f64,
    /// Predicted standard error of the table after the step; absent before there is a table.
    pub predicted_error_N: Option<f64>,
    /// The protocol file; absent for a check of the bench.
    pub protocol: Option<String>,
    /// For the operator, one sentence each.
    pub instructions: Vec<String>,
}

/// `host settings --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct SettingsFiles<'a> {
    pub schema: &'static str,
    pub files: Vec<String>,
    pub settings: Vec<Setting<'a>>,
}

/// One setting.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Setting<'a> {
    pub command: &'a str,
    pub option: &'a str,
    pub values: &'a [String],
    pub file: String,
    pub line: u64,
}

/// `host demo --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Demo<'a> {
    pub schema: &'static str,
    pub muscle: &'a str,
    pub controller: &'a str,
    pub fit_mean_error_pct: f64,
    pub deadband_kPa: f64,
    pub blocked_force_N: f64,
    pub tracking: Vec<Tracking>,
    pub telemetry_rows: usize,
    pub telemetry_rms_N: f64,
    pub seconds: f64,
}

/// Force tracking with one feed-forward; percent of the blocked force.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Tracking {
    pub feed_forward: &'static str,
    pub sine_rms_N: f64,
    pub sine_rms_pct: f64,
    pub steps_rms_N: f64,
    pub steps_rms_pct: f64,
    pub rms_pct: f64,
}

/// `host emulate --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Emulate<'a> {
    pub schema: &'static str,
    pub port: &'a str,
    pub controller: &'a str,
    /// Where the axis of `--axis` listens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<&'a str>,
}

/// `host studio --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Studio<'a> {
    pub schema: &'static str,
    pub address: &'a str,
}

/// `host recover --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Recover {
    pub schema: &'static str,
    pub recovered: Vec<Recovered>,
}

/// One recording that was cut off; null where it held nothing.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Recovered {
    pub part: String,
    pub recording: Option<String>,
    /// The original where it is kept.
    pub original: Option<String>,
    /// Samples recovered.
    pub samples: u64,
    pub samples_lost: u64,
    pub bytes_lost: u64,
    /// Damaged places.
    pub gaps: u64,
}
