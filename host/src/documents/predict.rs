//! `host predict --json`, `pam-predict/1`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use serde::Serialize;

/// The scores of a prediction. Fields are in alphabetical order, as in all earlier releases.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Predict {
    pub recordings: Vec<Recording>,
    /// Root mean square of measured minus predicted force, N; null without a force column.
    pub rms_N: Option<f64>,
    pub schema: &'static str,
}

/// One recording.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Recording {
    /// Mean half-width of the 95 % confidence interval of the table's force, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_N: Option<f64>,
    pub file: String,
    /// Share of the readings inside the 95 % interval of single readings, percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inside_pct: Option<Option<f64>>,
    pub rms_N: Option<f64>,
    pub samples: usize,
    /// Rows behind `rms_N`: those without a failed sensor, and without readings at an end of the force sensor's range that the model
    /// agrees with.
    pub scored: usize,
}
