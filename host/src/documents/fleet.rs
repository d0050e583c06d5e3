//! JSON of commands for many muscles.

// Field names carry their unit as the JSON does: kPa is not kpa.
#![allow(non_snake_case)]

use serde::Serialize;

/// A failure of one muscle.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct MuscleFailure<'a> {
    pub muscle: &'a str,
    /// manifest, read, fit or diagnose.
    pub stage: &'static str,
    pub code: &'a str,
    pub cause: &'a str,
    /// File, line, column and value, as far as they apply.
    pub place: &'a str,
    pub remedy: &'a str,
}

/// `host batch --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Batch<'a> {
    /// Name and version of this schema: `pam-batch/1`.
    pub schema: &'static str,
    pub tool: &'a str,
    pub manifest: String,
    pub output: String,
    /// Which shard of how many, from 1.
    pub shard: String,
    /// Muscles of this shard.
    pub muscles: u64,
    /// Computed by this run.
    pub computed: u64,
    /// Computed by an earlier run from the same inputs.
    pub reused: u64,
    /// Muscles with at least one failure, in this run or an earlier one.
    pub failed: u64,
    pub seconds: f64,
    /// The first failures of this run by name of the muscle, 100 at most; the table `failures` lists all.
    pub failures: Vec<MuscleFailure<'a>>,
}

/// Distribution of one quantity.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Quantity<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub muscles: usize,
    /// At 5, 25, 50, 75 and 95 %.
    pub quantiles: [f64; 5],
    /// 1.4826 times the median absolute deviation; null in small fleets.
    pub robust_std: Option<f64>,
}

/// A muscle outside the distribution of a quantity.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Outlying<'a> {
    pub muscle: &'a str,
    pub quantity: &'a str,
    pub value: f64,
    pub z: f64,
}

/// How often an effect was named.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Effect<'a> {
    pub effect: &'a str,
    /// Whether it is an error of the bench.
    pub bench: bool,
    pub muscles: usize,
    /// Share of the diagnosed muscles.
    pub share: f64,
}

/// A difference between the muscles with one tag and the others.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct GroupDifference<'a> {
    pub tag: &'a str,
    /// Empty for a trend over the date.
    pub value: &'a str,
    pub muscles: usize,
    /// effect-share, median or rank-correlation-with-date.
    pub kind: &'static str,
    /// The effect or the quantity.
    pub subject: &'a str,
    /// Share, median or correlation in the group.
    pub inside: f64,
    /// Share or median in the others.
    pub outside: Option<f64>,
    /// Probability by chance, times the number of tests.
    pub p: f64,
}

/// `host fleet --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Fleet<'a> {
    /// Name and version of this schema: `pam-fleet/1`.
    pub schema: &'static str,
    pub muscles: usize,
    pub fitted: usize,
    pub diagnosed: usize,
    pub failed: usize,
    /// Where curves over pressure are compared.
    pub pressure_kPa: Option<f64>,
    pub quantities: Vec<Quantity<'a>>,
    /// The size of z beyond which a muscle is outlying.
    pub outlying_z: f64,
    /// Probability that a fleet of normal values has any outlying muscle.
    pub false_alarm_probability: f64,
    pub outlying: Vec<Outlying<'a>>,
    /// Verdicts and their numbers of muscles.
    pub verdicts: &'a std::collections::BTreeMap<String, usize>,
    pub effects: Vec<Effect<'a>>,
    /// Tests between groups.
    pub tests: usize,
    pub differences: Vec<GroupDifference<'a>>,
    /// Codes and their numbers.
    pub failures: &'a std::collections::BTreeMap<String, usize>,
}

/// `host stock --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Stock<'a> {
    /// Name and version of this schema: `pam-stock/1`.
    pub schema: &'static str,
    pub muscle: &'a str,
    /// Muscles of the stock that were used.
    pub kin: usize,
    pub samples: usize,
    pub deadband_kPa: f64,
    pub blocked_force_N: f64,
    /// Residuals of the recordings, N.
    pub rms_N: f64,
    /// The same of the fit without the stock.
    pub rms_alone_N: f64,
    /// Factor by which the bands were widened so that they hold for the kin.
    pub bands_widened: f64,
    pub pressure_low_kPa: f64,
    pub pressure_high_kPa: f64,
}
