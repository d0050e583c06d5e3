//! The document of `host health --json`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use serde::Serialize;

/// Whether a table describes its muscle.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Health {
    pub schema: &'static str,
    /// `unknown`, `describes` or `changed`.
    pub verdict: &'static str,
    pub blocks: u32,
    pub independent_blocks: f64,
    pub residual_rms_N: f64,
    pub tolerance_N: f64,
    /// The most important first.
    pub changed: Vec<Change>,
}

/// What has changed.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Change {
    pub effect: &'static str,
    pub parameter: &'static str,
    pub value: f64,
    /// 95 %.
    pub interval: [f64; 2],
    pub unit: &'static str,
    pub share_explained: f64,
    pub confusable_with: Vec<&'static str>,
    pub remedy: &'static str,
}
