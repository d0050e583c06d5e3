//! The JSON of a diagnosis, `pam-diagnose/1`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use pam_diagnose::verdict::{
    Considered, Diagnosis, HeldOut, Missing, NextExperiment, ParameterValue, PathStep, Profile, Region,
    Trace, Unconfirmed, Verdict,
};
use serde::Serialize;

use super::history::HistoryDocument;
use crate::effect_page::place;
use crate::wording;

/// The judgement.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum VerdictName {
    Consistent,
    Explained,
    PartlyExplained,
    Unexplained,
}

/// Where the squared residual above the noise is concentrated along one coordinate.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct RegionDocument<'a> {
    /// recording, time, cycle, pressure, contraction, direction, speed, acceleration, force, pressure-rate, temperature,
    /// since-reversal, hold-time, largest-contraction-so-far or frequency.
    coordinate: &'a str,
    from: f64,
    to: f64,
    /// Share of the squared residual above the noise.
    share: f64,
    /// Share of the rows.
    rows: f64,
    /// How often shuffled blocks are as concentrated.
    p: f64,
    unit: &'a str,
    words: String,
}

/// A parameter in SI units; `std` is one standard deviation, null where it is not identifiable.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ParameterDocument<'a> {
    name: &'a str,
    value: f64,
    std: Option<f64>,
    unit: &'a str,
    outside_known_range: bool,
}

/// An effect that the model lacks.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct MissingDocument<'a> {
    effect: &'a str,
    /// Calibrated probability that the name is right.
    probability: f64,
    /// Before calibration.
    model_weight: f64,
    share_explained: f64,
    parameters: Vec<ParameterDocument<'a>>,
    /// Effects that these recordings do not distinguish from it.
    confusable_with: &'a [String],
    place: &'static str,
    /// Whether it is an error of the bench, which never goes to a controller.
    correction: bool,
    /// Whether a check of the bench measured it.
    checked: bool,
    /// Whether the user gave it.
    given: bool,
    supported: bool,
    summary: &'a str,
    source: &'a str,
    /// Largest force in these recordings, N.
    peak_N: f64,
    p: f64,
    why: String,
}

/// What no named effect explains.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct UnexplainedDocument<'a> {
    share: f64,
    pattern: String,
    /// Effects that would remove much of it, where nothing is named. They are no findings: chance or slow noise could do the same.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, schemars(default))]
    unconfirmed: Vec<UnconfirmedDocument<'a>>,
}

/// An effect that would remove much of the error.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct UnconfirmedDocument<'a> {
    effect: &'a str,
    /// Share of the squared error that it would remove.
    share: f64,
}

/// Root mean square errors on held-out rows, N.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct HeldOutDocument {
    split: String,
    rms_before_N: f64,
    rms_after_N: f64,
    noise_N: f64,
    with_turns_before_N: f64,
    with_turns_after_N: f64,
}

/// The recording that would separate confusable effects.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct NextExperimentDocument<'a> {
    separates: &'a [String],
    /// A protocol file, TOML.
    protocol: &'a str,
    expected_difference_N: f64,
    words: String,
}

/// An effect that was considered and not named.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ConsideredDocument<'a> {
    effect: &'a str,
    gain: f64,
    why_not: String,
    /// Largest peak that could be hidden; null where the recordings do not excite it.
    hidden_up_to_N: Option<f64>,
    checked: bool,
    visible: f64,
}

/// One step of the forward selection.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct PathStepDocument<'a> {
    effect: &'a str,
    rms_N: f64,
    /// Error on held-out rows with the effects up to this one, N.
    held_out_rms_N: Option<f64>,
    p: f64,
    /// Name and residual, N.
    runners_up: &'a [(String, f64)],
}

/// The residual along one coordinate, N.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ProfileDocument<'a> {
    coordinate: &'a str,
    unit: &'a str,
    at: &'a [f64],
    mean_before: &'a [f64],
    rms_before: &'a [f64],
    rms_after: &'a [f64],
}

/// The residual over time, downsampled for drawing; s and N.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct TraceDocument<'a> {
    time: &'a [f64],
    before: &'a [f64],
    after: &'a [f64],
    effects: &'a [f64],
}

/// The result of `host diagnose --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields, title = "pam-diagnose/1"))]
pub struct DiagnosisDocument<'a> {
    schema: &'static str,
    muscle: &'a str,
    samples: usize,
    /// False where there was nothing to judge: then nothing was fitted, and the first remark gives the reason.
    judged: bool,
    verdict: VerdictName,
    noise_N: f64,
    misfit_rms_N: f64,
    r#where: Vec<RegionDocument<'a>>,
    missing: Vec<MissingDocument<'a>>,
    unexplained: UnexplainedDocument<'a>,
    held_out: HeldOutDocument,
    next_experiment: Option<NextExperimentDocument<'a>>,
    considered: Vec<ConsideredDocument<'a>>,
    path: Vec<PathStepDocument<'a>>,
    blocked_force_N: f64,
    noise_memory_s: f64,
    remarks: Vec<String>,
    profiles: Vec<ProfileDocument<'a>>,
    trace: TraceDocument<'a>,
    /// What the muscle remembers over a campaign of isometric staircases; absent of other campaigns.
    #[serde(skip_serializing_if = "Option::is_none")]
    history: Option<HistoryDocument<'a>>,
}

/// The diagnosis as JSON text.
///
/// Every number is finite: what could not be computed is absent or zero before it comes here.
#[must_use]
pub fn diagnosis_json(d: &Diagnosis) -> String {
    serde_json::to_string_pretty(&DiagnosisDocument::of(d)).unwrap_or_else(|_| "{}".to_owned())
}

impl<'a> DiagnosisDocument<'a> {
    /// The document of a diagnosis.
    #[must_use]
    pub fn of(d: &'a Diagnosis) -> Self {
        Self {
            schema: "pam-diagnose/1",
            muscle: &d.muscle,
            samples: d.samples,
            judged: d.judged(),
            verdict: match d.verdict() {
                Verdict::Consistent => VerdictName::Consistent,
                Verdict::Explained => VerdictName::Explained,
                Verdict::PartlyExplained => VerdictName::PartlyExplained,
                Verdict::Unexplained => VerdictName::Unexplained,
            },
            noise_N: d.noise_N,
            misfit_rms_N: d.misfit_rms_N,
            r#where: d.r#where.iter().map(region).collect(),
            missing: d.missing.iter().map(missing).collect(),
            unexplained: UnexplainedDocument {
                share: d.unexplained.share,
                pattern: wording::pattern(&d.unexplained.pattern),
                unconfirmed: d.unconfirmed().iter().map(unconfirmed).collect(),
            },
            held_out: held_out(&d.held_out),
            next_experiment: d.next_experiment.as_ref().map(next_experiment),
            considered: d.considered.iter().map(considered).collect(),
            path: d.path.iter().map(path_step).collect(),
            blocked_force_N: d.blocked_force_N,
            noise_memory_s: d.noise_memory_s,
            remarks: d.remarks.iter().map(wording::remark).collect(),
            profiles: d.profiles.iter().map(profile).collect(),
            trace: trace(&d.trace),
            history: d.history.as_ref().map(HistoryDocument::of),
        }
    }
}

fn region(r: &Region) -> RegionDocument<'_> {
    let words = wording::region(r);
    let Region { coordinate, from, to, share, rows, p, unit, .. } = r;
    RegionDocument { coordinate, from: *from, to: *to, share: *share, rows: *rows, p: *p, unit, words }
}

fn missing(m: &Missing) -> MissingDocument<'_> {
    MissingDocument {
        effect: &m.effect,
        probability: m.probability,
        model_weight: m.model_weight,
        share_explained: m.share_explained,
        parameters: m.parameters.iter().map(parameter).collect(),
        confusable_with: &m.confusable_with,
        place: place(m.place),
        correction: m.correction,
        checked: m.checked,
        given: m.given,
        supported: m.supported,
        summary: &m.summary,
        source: &m.source,
        peak_N: m.peak_N,
        p: m.p,
        why: wording::why(&m.why),
    }
}

fn parameter(p: &ParameterValue) -> ParameterDocument<'_> {
    let ParameterValue { name, value, std, unit, outside_known_range } = p;
    ParameterDocument { name, value: *value, std: *std, unit, outside_known_range: *outside_known_range }
}

fn held_out(h: &HeldOut) -> HeldOutDocument {
    HeldOutDocument {
        split: wording::split(h.split),
        rms_before_N: h.rms_before_N,
        rms_after_N: h.rms_after_N,
        noise_N: h.noise_N,
        with_turns_before_N: h.with_turns_before_N,
        with_turns_after_N: h.with_turns_after_N,
    }
}

fn next_experiment(n: &NextExperiment) -> NextExperimentDocument<'_> {
    NextExperimentDocument {
        separates: &n.separates,
        protocol: &n.protocol,
        expected_difference_N: n.expected_difference_N,
        words: wording::proposal(&n.proposal),
    }
}

fn considered(c: &Considered) -> ConsideredDocument<'_> {
    ConsideredDocument {
        effect: &c.effect,
        gain: c.gain,
        why_not: wording::why_not(c),
        hidden_up_to_N: c.hidden_up_to_N,
        checked: c.checked,
        visible: c.visible,
    }
}

fn unconfirmed(u: &Unconfirmed) -> UnconfirmedDocument<'_> {
    UnconfirmedDocument { effect: &u.effect, share: u.share }
}

fn path_step(s: &PathStep) -> PathStepDocument<'_> {
    let PathStep { effect, rms_N, held_out_rms_N, p, runners_up } = s;
    PathStepDocument { effect, rms_N: *rms_N, held_out_rms_N: *held_out_rms_N, p: *p, runners_up }
}

fn profile(p: &Profile) -> ProfileDocument<'_> {
    let Profile { coordinate, unit, at, mean_before, rms_before, rms_after } = p;
    ProfileDocument { coordinate, unit, at, mean_before, rms_before, rms_after }
}

fn trace(t: &Trace) -> TraceDocument<'_> {
    let Trace { time, before, after, effects } = t;
    TraceDocument { time, before, after, effects }
}

#[cfg(test)]
mod tests {
    use super::DiagnosisDocument;

    /// The published schema is generated; `SCHEMA=overwrite cargo test -p pam-report schema` rewrites it.
    #[test]
    fn the_published_schema_is_that_of_the_types() {
        let schema = schemars::schema_for!(DiagnosisDocument<'_>);
        let text = format!("{:#}\n", serde_json::to_value(&schema).unwrap());
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/schema/pam-diagnose-1.json");
        if std::env::var("SCHEMA").is_ok_and(|v| v == "overwrite") {
            std::fs::write(path, &text).unwrap();
        }
        assert_eq!(std::fs::read_to_string(path).unwrap_or_default(), text, "SCHEMA=overwrite rewrites it");
    }
}
