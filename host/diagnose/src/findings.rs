//! Findings: the selected effects with parameters and probabilities, and the other candidates with the reason against each.

use super::calibration;
use super::candidates::{Candidate, link_in_words};
use super::change_point;
use super::criteria::judgement::{ABSURD_SIZE, DETECTION, DETECTION_ROWS, RELEVANT_SIZE};
use super::criteria::selection::{
    CONCEALED, FAMILY_ALPHA, LEAST_SCORE, LEAST_SHARE, MOST_REPORTED, REPORTED_RIVAL, SELECTION_FLOOR,
    STATIC_PEAK,
};
use super::intervals::deviations;
use super::linear::energy;
use super::next_experiment::experiment;
use super::rows::Rows;
use super::selection_step::Selection;
use super::verdict::{Considered, Missing, ParameterValue};

/// The selected effects with parameters and intervals, what they cannot be distinguished from, and their probabilities.
pub(crate) fn missing(selection: &Selection, library: &[Candidate], rows: &Rows) -> Vec<Missing> {
    let deviations = deviations(selection, library, rows);
    let explained = ((energy(&selection.base_alone.residual) - energy(&selection.joint.residual))
        / selection.excess_energy)
        .clamp(0.0, 1.0);
    let total: f64 = selection.selected.iter().map(|t| t.share.max(0.0)).sum::<f64>().max(1e-12);
    selection
        .selected
        .iter()
        .zip(&deviations)
        .map(|(t, d)| {
            let candidate = &library[t.fit.candidate];
            let info = candidate.info;
            let values = t.fit.amplitudes.iter().chain(&t.fit.shapes);
            let parameters = info
                .parameters
                .iter()
                .zip(values)
                .zip(d)
                .map(|((p, v), std)| ParameterValue {
                    name: p.name.into(),
                    value: *v,
                    std: *std,
                    unit: p.unit.into(),
                    outside_known_range: ParameterValue::is_outside(*v, p),
                })
                .collect();
            let sum: f64 = 1.0 + t.rivals.iter().map(|r| r.1).sum::<f64>();
            let belief = 1.0 / sum;
            let confusable: Vec<String> = t
                .rivals
                .iter()
                .filter(|r| r.1 > REPORTED_RIVAL)
                .take(MOST_REPORTED)
                .map(|r| library[r.0].name().to_owned())
                .collect();
            let share = (explained * t.share / total).clamp(0.0, 1.0);
            let chance = if t.p <= FAMILY_ALPHA {
                format!(
                    "by chance over all {} effects and their shapes this would happen with p = {:.4}",
                    library.len(),
                    t.p
                )
            } else {
                format!(
                    "it lives in too few half-strokes for a test by whole blocks (p = {:.2}), but is {} as likely as chance",
                    t.p,
                    times(t.fit.score / 2.0)
                )
            };
            let mut why = format!(
                "it takes {:.0} % of the misfit above noise with the base refitted; {chance}",
                share * 100.0
            );
            if let Some(shape) = change_point::place(candidate, &t.fit) {
                why.push_str("; it happened ");
                why.push_str(&change_point::in_words(t.fit.shapes[shape], rows));
            }
            Missing {
                effect: info.name.into(),
                probability: calibration::probability(belief, explained),
                belief,
                share_explained: share,
                parameters,
                confusable_with: confusable,
                place: link_in_words(info.link).into(),
                correction: candidate.of_the_bench(),
                checked: false,
                given: false,
                supported: true,
                summary: info.summary.into(),
                source: info.source.into(),
                peak_N: t.fit.peak,
                p: t.p,
                why,
            }
        })
        .collect()
}

/// The candidates that were not selected: the share they would explain, the size at which they could be hidden, and what would show them.
pub(crate) fn considered(
    selection: &Selection,
    library: &[Candidate],
    missing: &[Missing],
    sigma: f64,
    blocked: f64,
) -> Vec<Considered> {
    let named: Vec<&str> = missing.iter().map(|m| m.effect.as_str()).collect();
    let confusable: Vec<&String> = missing.iter().flat_map(|m| &m.confusable_with).collect();
    selection
        .first_scan
        .iter()
        .zip(&selection.first_p)
        .filter(|(t, _)| !named.contains(&library[t.candidate].name()))
        .map(|(t, p)| {
            let name = library[t.candidate].name();
            let gain = (t.gain / selection.excess_energy).clamp(0.0, 1.0);
            // The trace that noise could hide, given how much of it the base leaves; and below the size from which an effect that
            // tables imitate is named at all it could be there anyway.
            let hidden = (t.size > 0.0 && t.peak > 0.0).then(|| {
                let detectable = DETECTION * sigma
                    / (selection.noise.independent.max(DETECTION_ROWS)).sqrt()
                    / t.visible.max(1e-12).sqrt();
                // What moves the force by less than the model's own inexactness is not named either.
                let nameable = SELECTION_FLOOR * blocked / t.visible.max(1e-12).sqrt();
                let by_noise = detectable.max(nameable) * t.peak / t.size;
                let least = if t.beyond_tables < CONCEALED { STATIC_PEAK * blocked } else { 0.0 };
                by_noise.max(least)
            });
            let hidden = hidden.filter(|h| h.is_finite() && *h < ABSURD_SIZE * blocked);
            let size = match hidden {
                Some(h) => format!("up to {h:.2} N"),
                None => "at any size".to_owned(),
            };
            let could_be = format!(
                "it could be hidden in these recordings {size}; to know, {}",
                experiment(library[t.candidate].traits.shown_by)
            );
            let unseen = hidden.is_none_or(|h| h > RELEVANT_SIZE * blocked);
            let why_not = if confusable.iter().any(|c| c.as_str() == name) {
                "cannot be told from what is named".to_owned()
            } else if t.size <= 0.0 {
                format!("these recordings do not excite it: {could_be}")
            } else if unseen && t.score < LEAST_SCORE {
                could_be
            } else if *p > FAMILY_ALPHA && t.score < LEAST_SCORE {
                format!("no more than chance gives over all effects looked at (p = {p:.2}); {could_be}")
            } else if missing.is_empty() && gain >= LEAST_SHARE {
                let refused = if selection.remarks.iter().any(|r| r.contains(name)) {
                    "was not confirmed (see the remarks)"
                } else {
                    "the misfit is so small that the model's own inexactness may make it"
                };
                format!("would take much of the misfit, but {refused}; {could_be}")
            } else if missing.is_empty() {
                format!("takes too little of the misfit to be named; {could_be}")
            } else {
                format!("explains less than what is named, and little besides it; {could_be}")
            };
            Considered {
                effect: name.into(),
                gain,
                why_not,
                hidden_up_to_N: hidden,
                checked: false,
                visible: t.visible,
            }
        })
        .collect()
}

/// A ratio in words, from its logarithm.
fn times(logarithm: f64) -> String {
    if logarithm < 1e6_f64.ln() {
        format!("{:.0} times", logarithm.exp())
    } else {
        "more than a million times".to_owned()
    }
}
