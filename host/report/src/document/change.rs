//! The JSON of a comparison with a reference: `pam-diagnose/1` with an object `reference`.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use pam_diagnose::reference::answer::{
    ChangeReport, Changed, Considered, Place, Probability, Repeatability, Since, Size, Verdict,
};
use pam_diagnose::reference::shapes::{Class, Owner};
use serde::Serialize;

use crate::wording::change as wording;

#[cfg(test)]
mod schema;

/// What changed.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ChangedDocument<'a> {
    effect: &'a str,
    /// How probable this very name is.
    probability: f64,
    /// How probable its class is.
    class_probability: f64,
    #[cfg_attr(test, schemars(with = "schema::Class"))]
    class: Class,
    /// Share of the difference's energy that is gone on recordings held out, this change alone.
    share_explained: f64,
    /// SI units, with the 95 % interval.
    #[cfg_attr(test, schemars(with = "Vec<schema::Size>"))]
    parameters: &'a [Size],
    /// Names that these recordings do not distinguish from it.
    confusable_with: &'a [String],
    #[cfg_attr(test, schemars(with = "schema::Since"))]
    since: &'a Since,
    #[cfg_attr(test, schemars(with = "schema::Owner"))]
    owner: Owner,
    /// Whether it is the bench's: it corrects the data and never goes to a controller.
    correction: bool,
    law: &'static str,
    remedy: &'static str,
    /// rms of the force that it adds in AFTER, N.
    rms_N: f64,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct UnexplainedDocument {
    /// Share of the difference's energy.
    share: f64,
    pattern: String,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct HeldOutDocument {
    split: &'static str,
    rms_before_N: f64,
    rms_after_N: f64,
    noise_N: f64,
}

/// A change that is not named.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ConsideredDocument<'a> {
    effect: &'a str,
    /// Its probability.
    gain: f64,
    why_not: &'static str,
    /// The size that would have been seen with 90 %, SI; null where these recordings cannot show it.
    detectable: Option<f64>,
    unit: &'a str,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct ReferenceDocument<'a> {
    files: &'a [String],
    table: Option<&'a str>,
    samples: usize,
    repeatability_N: f64,
    #[cfg_attr(test, schemars(with = "schema::Repeatability"))]
    repeatability_from: Repeatability,
    mounted_anew: bool,
    not_comparable: Vec<String>,
}

/// The answer of `host diagnose --reference`.
#[derive(Debug, Serialize)]
#[cfg_attr(
    test,
    derive(schemars::JsonSchema),
    schemars(deny_unknown_fields, title = "pam-diagnose/1 with a reference")
)]
struct ChangeDocument<'a> {
    schema: &'static str,
    muscle: Option<&'a str>,
    samples: usize,
    #[cfg_attr(test, schemars(with = "schema::Verdict"))]
    verdict: Verdict,
    noise_N: f64,
    misfit_rms_N: f64,
    largest_force_N: f64,
    #[cfg_attr(test, schemars(with = "Vec<schema::Place>"))]
    r#where: &'a [Place],
    missing: Vec<ChangedDocument<'a>>,
    unexplained: UnexplainedDocument,
    held_out: HeldOutDocument,
    /// Always null: what to do is with each change.
    next_experiment: Option<()>,
    considered: Vec<ConsideredDocument<'a>>,
    /// Of the first weighing, in falling order.
    #[cfg_attr(test, schemars(with = "Vec<schema::Probability>"))]
    probabilities: &'a [Probability],
    /// Causes that hold 95 % of the probability.
    set: &'a [String],
    remarks: Vec<String>,
    reference: ReferenceDocument<'a>,
}

/// As JSON text.
#[must_use]
pub fn change_json(r: &ChangeReport) -> String {
    // Strings, finite numbers and options of them: this cannot fail.
    serde_json::to_string_pretty(&document(r)).unwrap_or_default()
}

fn document(r: &ChangeReport) -> ChangeDocument<'_> {
    let h = &r.held_out;
    ChangeDocument {
        schema: "pam-diagnose/1",
        muscle: r.muscle.as_deref(),
        samples: r.samples,
        verdict: r.verdict,
        noise_N: r.noise_N,
        misfit_rms_N: r.misfit_rms_N,
        largest_force_N: r.largest_force_N,
        r#where: &r.r#where,
        missing: r.missing.iter().map(changed).collect(),
        unexplained: UnexplainedDocument {
            share: r.unexplained.share,
            pattern: wording::pattern(&r.unexplained),
        },
        held_out: HeldOutDocument {
            split: wording::split(h.split),
            rms_before_N: h.rms_before_N,
            rms_after_N: h.rms_after_N,
            noise_N: h.noise_N,
        },
        next_experiment: None,
        considered: r.considered.iter().map(considered).collect(),
        probabilities: &r.probabilities,
        set: &r.set,
        remarks: r.remarks.iter().map(wording::remark).collect(),
        reference: ReferenceDocument {
            files: &r.reference.files,
            table: r.reference.table.as_deref(),
            samples: r.reference.samples,
            repeatability_N: r.reference.repeatability_N,
            repeatability_from: r.reference.repeatability_from,
            mounted_anew: r.reference.mounted_anew,
            not_comparable: r.reference.not_comparable.iter().map(wording::not_comparable).collect(),
        },
    }
}

fn changed(c: &Changed) -> ChangedDocument<'_> {
    ChangedDocument {
        effect: &c.effect,
        probability: c.probability,
        class_probability: c.class_probability,
        class: c.class,
        share_explained: c.share_explained,
        parameters: &c.parameters,
        confusable_with: &c.confusable_with,
        since: &c.since,
        owner: c.owner,
        correction: c.correction,
        law: c.change.about().changed.law,
        remedy: wording::remedy(c.change),
        rms_N: c.rms_N,
    }
}

fn considered(c: &Considered) -> ConsideredDocument<'_> {
    ConsideredDocument {
        effect: &c.effect,
        gain: c.gain,
        why_not: wording::why_not(c.why_not),
        detectable: c.detectable,
        unit: &c.unit,
    }
}
