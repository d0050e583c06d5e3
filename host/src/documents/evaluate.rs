//! `host evaluate --json`, `pam-evaluate/1`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use serde::Serialize;
use serde_json::Value;

/// Errors on held-out data.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Evaluate {
    pub schema: &'static str,
    pub muscles: Vec<Muscle>,
}

/// One muscle.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Muscle {
    pub muscle: String,
    /// Friction-free, at rest length and the highest tested pressure, by the fit to all rows.
    pub blocked_force_N: f64,
    /// The largest measured force; percentages refer to it.
    pub largest_force_N: f64,
    pub unseen_runs: Option<HeldOut>,
    pub unseen_contractions: Option<HeldOut>,
    pub unseen_length: Option<OtherLength>,
    /// With all muscles fitted together; null with fewer than three.
    pub with_stock: Option<WithStock>,
}

/// Everything of one kind left out in turn.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct HeldOut {
    pub table: Score,
    /// Of these, at contractions between others: interpolation. Null where runs are left out.
    pub between: Option<Score>,
    /// At the smallest and the largest contraction: extrapolation. Null where runs are left out.
    pub ends: Option<Score>,
    /// Of the published formula on the same rows.
    pub published: Option<Score>,
    pub r#where: Vec<Spot>,
    /// The errors of each recording when it was left out.
    pub recordings: Value,
    /// Fitted dimensions and lengths of the fit to all rows.
    pub adjusted: Value,
}

/// Predicted from the tables of muscles of other lengths.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct OtherLength {
    pub end_effect_mm: f64,
    pub table: Score,
    pub r#where: Vec<Spot>,
}

/// Predicted with all muscles fitted together, without what is predicted.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct WithStock {
    /// Total length of the ends that do not pull, by the other muscles.
    pub ends_mm: f64,
    /// The whole muscle left out.
    pub unseen_length: Score,
    /// Mean error that unknown lengths, zero and scale alone would give, percent of the largest force.
    pub length_expected_pct: f64,
    pub length_where: Vec<Spot>,
    /// Each held contraction left out; null for a muscle that moves.
    pub unseen_contractions: Option<Score>,
    /// Mean error that the unknown length and zero of each mounting alone would give, percent of the largest force.
    pub contractions_expected_pct: f64,
    pub contractions_where: Vec<Spot>,
}

/// Errors of measured minus computed force.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Score {
    pub rows: f64,
    /// Mean absolute error.
    pub mean_N: f64,
    pub rms_N: f64,
    /// Percent of the largest measured force.
    pub mean_pct: f64,
    pub rms_pct: f64,
    /// Mean error with its sign.
    pub bias_N: f64,
}

/// The error at one contraction and direction of what was left out.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Spot {
    pub left_out: String,
    pub contraction: f64,
    pub direction: i8,
    pub bias_N: f64,
    pub rms_N: f64,
    pub rows: f64,
}
