//! `host table … --json`: `pam-table/1`, `pam-check/1`, `pam-export/1`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use serde::Serialize;

/// A table file.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct TableDocument<'a> {
    pub schema: &'static str,
    pub muscle: &'a str,
    pub date: &'a str,
    pub tool: &'a str,
    /// contractile or push.
    pub kind: &'static str,
    pub rest_length_mm: f32,
    pub braid_angle_deg: f32,
    pub bladder_outer_diameter_mm: f32,
    pub bladder_wall_mm: f32,
    pub tip_correction: bool,
    pub order: usize,
    pub deadband_kPa: f32,
    pub goes_slack: bool,
    pub blocked_force_N: f32,
    pub max_pressure_kPa: f32,
    pub tested: Tested,
    pub pressures: Vec<Node>,
    pub effects: Vec<Effect>,
    /// Errors of the bench, never sent to a controller.
    pub corrections: Vec<Correction<'a>>,
    pub fit: Fit<'a>,
    pub sources: Vec<Source<'a>>,
}

/// Lowest and highest tested value.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Tested {
    pub pressure_kPa: [f32; 2],
    pub contraction: [f32; 2],
}

/// The coefficients at one pressure.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Node {
    pub pressure_kPa: f32,
    pub E_MPa: Vec<f32>,
    pub k_F: f32,
}

/// An effect of the muscle.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Effect {
    pub effect: &'static str,
    pub parameters: Vec<Parameter>,
}

/// A parameter, SI.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Parameter {
    pub name: &'static str,
    pub value: f32,
    pub unit: &'static str,
}

/// A correction of the bench.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Correction<'a> {
    pub effect: &'a str,
    pub parameters: &'a [f64],
}

/// Quality of the fit; errors in percent of the blocked force.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Fit<'a> {
    pub samples: u64,
    pub rms_N: f64,
    pub mean_error_pct: f64,
    pub max_error_pct: f64,
    pub left_out_pressure_mean_error_pct: Option<f64>,
    pub warnings: &'a [String],
}

/// A recording that the table was fitted to.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Source<'a> {
    pub path: &'a str,
    pub sha256: &'a str,
    pub samples: u64,
}

/// The judgement of `host table check`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Check {
    pub schema: &'static str,
    /// Whether a controller can use it.
    pub valid: bool,
    /// What limits its use.
    pub remarks: Vec<String>,
    /// What makes it useless for control.
    pub faults: Vec<String>,
}

/// What `host table export` wrote.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Export {
    pub schema: &'static str,
    pub table: String,
    pub output: String,
    pub bytes: usize,
}
