//! The types of the comparison as they are written, for the published schema; a test compares it with what is written.

use schemars::JsonSchema;

/// Changes that recordings often cannot distinguish.
#[derive(JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) enum Class {
    Zero,
    Gain,
    GaugeOffset,
    Friction,
    EndSlip,
    SensorDelay,
    PressureSensorLag,
    SlowSpeed,
    RateOrPhase,
    Softening,
    Relaxation,
    TurningMemory,
    TipEffect,
    ContactLoss,
    StrandJamming,
    PermanentSet,
    MullinsSoftening,
    BreakawayFriction,
    Inertia,
    Backlash,
}

/// Whose a change is.
#[derive(JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) enum Owner {
    Sensor,
    Rig,
    Muscle,
    SensorOrMuscle,
    RigOrMuscle,
}

/// The judgement.
#[derive(JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) enum Verdict {
    Consistent,
    Explained,
    PartlyExplained,
    Unexplained,
}

/// Where the repeatability is from.
#[derive(JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) enum Repeatability {
    Measured,
    Assumed,
}

/// Since when a change is there.
#[derive(JsonSchema)]
#[serde(tag = "course", rename_all = "kebab-case")]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) enum Since {
    Beginning,
    From { recording: String, moment: f64, low: f64, high: f64 },
    Gradual { recording: String, moment: f64, low: f64, high: f64 },
    NotDetermined,
}

/// The size of a change, SI, with its 95 % interval.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) struct Size {
    name: String,
    value: f64,
    std: f64,
    low: f64,
    high: f64,
    unit: String,
}

/// A part of the data in which the difference is concentrated.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) struct Place {
    coordinate: String,
    from: f64,
    to: f64,
    share: f64,
    rows: f64,
    unit: String,
}

/// A name, none or unknown, with its probability.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[allow(dead_code, reason = "only its schema is used")]
pub(super) struct Probability {
    cause: String,
    probability: f64,
}

/// The published schema is generated; `SCHEMA=overwrite cargo test -p pam-report schema` rewrites it.
#[test]
fn the_published_schema_is_that_of_the_types() {
    let schema = schemars::schema_for!(super::ChangeDocument<'_>);
    let text = format!("{:#}\n", serde_json::to_value(&schema).unwrap());
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/schema/pam-diagnose-1-reference.json");
    if std::env::var("SCHEMA").is_ok_and(|v| v == "overwrite") {
        std::fs::write(path, &text).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap_or_default(), text, "SCHEMA=overwrite rewrites it");
}
