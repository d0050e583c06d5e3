//! The shape of `host fit --json`, `pam-fit/1`, for its published schema: the fit library writes it and knows no schemas.

#![allow(non_snake_case, dead_code, reason = "only the shape counts")]

use schemars::JsonSchema;

/// A fit. Errors are in percent of the blocked force; `std` is one standard deviation.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Fit {
    schema: String,
    muscle: String,
    samples: usize,
    deadband_kPa: f64,
    deadband_std_kPa: f64,
    /// Friction-free force at rest length and the highest tested pressure.
    blocked_force_N: f64,
    rms_N: f64,
    mean_error_pct: f64,
    max_error_pct: f64,
    /// Each pressure predicted from the others; null where there is one only.
    left_out_pressure_mean_error_pct: Option<f64>,
    pressures: Vec<AtPressure>,
    models: Vec<Model>,
    rows: Rows,
    /// Weights of the penalty on the curvature of E_k(P) and k_F(P).
    smoothing: [f64; 2],
    /// Excluded distance from a reversal, share of the ranges of stroke and pressure.
    turn_zone: f64,
    /// Condition number of the scaled elastic columns; null where they are linearly dependent.
    condition: Option<f64>,
    correlations: Correlations,
    not_determined: Vec<NotDetermined>,
    physical: Option<Physical>,
    outliers: Vec<Outlier>,
    adjusted: Vec<Adjusted>,
    recordings: Vec<RecordingResidual>,
    /// The largest measured force: a scale that no fit enters.
    largest_force_N: f64,
    warnings: Vec<String>,
    /// What makes the table useless for control.
    faults: Vec<String>,
}

/// The fit at one tested pressure.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct AtPressure {
    pressure_kPa: f64,
    E_MPa: Vec<f64>,
    E_std_MPa: Vec<f64>,
    k_F: f64,
    k_F_std: f64,
    blocked_force_N: f64,
    free_contraction: Option<f64>,
    mean_error_pct: f64,
    max_error_pct: f64,
    left_out_mean_error_pct: Option<f64>,
    samples: usize,
}

/// The errors of one model.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Model {
    name: String,
    mean_error_pct: f64,
    max_error_pct: f64,
}

/// Rows fitted, and rows excluded by reason.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Rows {
    fitted: usize,
    near_turn: usize,
    unknown_direction: usize,
    slack: usize,
    clipped: usize,
    outliers: usize,
    /// Absent where there is none.
    #[serde(default)]
    pushed: usize,
    /// Absent where there is none.
    #[serde(default)]
    dropouts: usize,
}

/// Correlations of the parameters at one pressure; null where a deviation is zero.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Correlations {
    pressure_kPa: f64,
    names: Vec<String>,
    matrix: Vec<Vec<Option<f64>>>,
}

/// A parameter that is not identifiable.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct NotDetermined {
    parameter: String,
    pressures_kPa: Vec<f64>,
    everywhere: bool,
    reason: String,
}

/// Errors without the constraint of `--physical`.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Physical {
    free_mean_error_pct: f64,
    free_max_error_pct: f64,
}

/// An excluded reading.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Outlier {
    recording: String,
    row: usize,
    time_s: f64,
    force_N: f64,
    off_N: f64,
}

/// The residuals F − F_model of one recording.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct RecordingResidual {
    recording: String,
    mounting: String,
    rows: usize,
    mean_N: f64,
    rms_N: f64,
    /// Mean minus that of the other recordings of the mounting; null for the only one.
    against_others_N: Option<f64>,
}

/// A fitted dimension or length.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Adjusted {
    name: String,
    unit: String,
    nominal: f64,
    value: f64,
    std: f64,
    low: f64,
    high: f64,
    determined: f64,
    at_bound: bool,
}
