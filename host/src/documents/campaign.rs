//! The document of `host campaign`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use serde::Serialize;

/// `host campaign --json`, and `campaign.json` in its folder.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Campaign {
    pub schema: &'static str,
    pub muscle: String,
    pub controller: String,
    /// `fit`, `diagnosis` or `both`.
    pub purpose: String,
    /// Bench time that was allowed, min.
    pub minutes: f64,
    /// Bench time that was used, s.
    pub bench_s: f64,
    /// Whether it ended by a stopping rule; false after an interruption.
    pub complete: bool,
    /// Why it ended, in one sentence.
    pub ended_by: String,
    pub steps: Vec<Step>,
    pub table: Option<Table>,
    pub diagnosis: Option<Diagnosis>,
    /// Force tracking of the controller before and after its table is replaced by the campaign's.
    pub tracking: Vec<Tracking>,
}

/// One step of the campaign.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Step {
    pub number: u32,
    pub name: String,
    pub what: String,
    /// Why it was chosen, in one sentence.
    pub why: String,
    /// What it showed, as text.
    pub finding: String,
    pub file: String,
    pub rows: u64,
    pub begin_s: f64,
    pub end_s: f64,
    pub expected: Expected,
    /// Time that choosing took, s.
    pub choosing_s: f64,
    /// Why attempts were repeated.
    pub spoiled: Vec<String>,
}

/// The information that a step was expected to give.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Expected {
    pub table_nats: f64,
    pub effect_nats: f64,
    pub unseen_nats: f64,
    pub seconds: f64,
    /// Predicted standard error of the table on unseen pressures and strokes before the step; null while it is not known.
    pub predicted_error_N: Option<f64>,
}

/// The fitted table.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Table {
    pub file: String,
    pub deadband_kPa: f64,
    pub deadband_std_kPa: f64,
    pub blocked_force_N: f64,
    pub mean_error_pct: f64,
    pub left_out_pressure_mean_error_pct: Option<f64>,
    /// Predicted standard error on unseen pressures and strokes, percent of the blocked force.
    pub predicted_error_pct: Option<f64>,
    /// Its targets.
    pub target_error_pct: f64,
}

/// What is missing.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Diagnosis {
    pub verdict: String,
    /// Every name that is possible.
    pub possible: Vec<String>,
    pub missing: Vec<Missing>,
}

/// One effect.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Missing {
    pub effect: String,
    pub probability: f64,
    pub confusable_with: Vec<String>,
}

/// Force tracking with one feed-forward.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Tracking {
    pub feed_forward: String,
    pub rms_N: f64,
    pub rms_pct: f64,
}
