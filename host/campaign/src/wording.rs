//! The sentences of a campaign: why a step was chosen, what it showed, why it ended.

use pam_diagnose::Diagnosis;

use crate::analysis::{Findings, names};
use crate::information::Gain;
use crate::purpose::Purpose;
use crate::step::Step;

/// Why a campaign ends with a tare.
pub(crate) const CLOSING: &str = "Zeros at the end show whether the instruments drifted.";
/// Why a step was chosen before the first table.
pub(crate) const NO_TABLE: &str =
    "The recordings do not determine a table yet, so the steps of the menu are made in their order.";
/// Why a campaign ends although not everything is known.
pub(crate) const NOTHING_MORE: &str =
    "No step that this rig can do within the time left is expected to give more information.";

/// Why a plan ends before there is a table.
pub(crate) const PLAN_AGAIN: &str =
    "These steps come first; plan again with their recordings, which decide what follows.";

/// Why a plan ends that has as many steps as requested.
#[must_use]
pub(crate) fn plan_is_full(steps: usize) -> String {
    format!("The plan has the requested number of steps, {steps}.")
}

/// Why a step was chosen, with its expected information, in one sentence.
#[must_use]
pub(crate) fn why_with_gain(why: &str, gain: &Gain) -> String {
    format!(
        "{} (expected information in nats: table {:.2}, choice between effects {:.2}, undetected effects {:.2}).",
        why.trim_end_matches('.'),
        gain.table,
        gain.set,
        gain.unseen
    )
}

/// Why a step was chosen.
#[must_use]
pub(crate) fn why(gain: &Gain, diagnosis: Option<&Diagnosis>, step: &Step) -> String {
    if let Step::Rest { .. } = step {
        return "After a rest the muscle shows what it remembers of earlier loads.".into();
    }
    if gain.set >= gain.table && gain.set >= gain.unseen {
        let open = diagnosis.and_then(|d| d.missing.iter().find(|m| !m.confusable_with.is_empty()));
        if let Some(open) = open {
            return format!(
                "It gives the most information per second to separate {} from {}.",
                open.effect,
                open.confusable_with.join(", ")
            );
        }
    }
    if gain.table >= gain.unseen {
        return format!(
            "The table's force is least known there: the predicted error falls from {:.3} N to {:.3} N.",
            gain.error_before, gain.error_after
        );
    }
    "It would show effects that nothing recorded so far could have shown.".into()
}

/// What a step showed about the table.
#[must_use]
pub fn table(before: Option<f64>, findings: Option<&Findings>) -> String {
    let Some(findings) = findings else { return "The recordings do not determine a table yet.".into() };
    let s = &findings.fit.summary;
    match before {
        None => format!(
            "First table: deadband {:.1} kPa, mean error {:.2} % of blocked force.",
            s.deadband_kPa, s.mean_error_pct
        ),
        Some(kpa) => format!(
            "Deadband {kpa:.1} → {:.1} kPa; mean error {:.2} % of blocked force.",
            s.deadband_kPa, s.mean_error_pct
        ),
    }
}

/// What a diagnosis changed.
#[must_use]
pub(crate) fn diagnosis(earlier: Option<&[String]>, now: &Diagnosis) -> String {
    let list = |n: &[String]| if n.is_empty() { "nothing".to_owned() } else { n.join(", ") };
    let names = names(now);
    match earlier {
        Some(earlier) if earlier == names => format!(" Possible as before: {}.", list(&names)),
        Some(earlier) => format!(" Possible now: {} (before: {}).", list(&names), list(earlier)),
        None => format!(" Possible: {}.", list(&names)),
    }
}

/// Why a campaign that reached its aim ended.
#[must_use]
pub(crate) fn settled(diagnosis: Option<&Diagnosis>, purpose: Purpose) -> String {
    match (purpose, diagnosis) {
        (Purpose::Fit, _) | (_, None) => "The table is known to the target error.".into(),
        (_, Some(d)) if d.missing.is_empty() => {
            "The table is known to the target error, and no effect of 1 % of the blocked force is missing."
                .into()
        }
        (_, Some(d)) => format!(
            "The table is known to the target error, and what is missing has one name: {}.",
            d.missing.iter().map(|m| m.effect.as_str()).collect::<Vec<_>>().join(", ")
        ),
    }
}

/// How the reason of a campaign begins that ended at its limit.
pub(crate) const TIME_IS_OVER: &str = "The time of";

/// Why a campaign ended at its limit.
#[must_use]
pub(crate) fn time_is_over(budget_s: f64) -> String {
    format!("{TIME_IS_OVER} {:.0} min is used.", budget_s / 60.0)
}
