//! Findings: the selected effects with parameters and probabilities, and the other candidates with the reason against each.

use super::calibration;
use super::candidate_fit::CandidateFit;
use super::candidates::Candidate;
use super::change_point;
use super::criteria::candidates::{LEAST_SIGMA, SYSTEMATIC_ROWS};
use super::criteria::judgement::{ABSURD_SIZE, DETECTION, DETECTION_ROWS, SIZE_STEP};
use super::criteria::selection::{
    CONCEALED, FAMILY_ALPHA, LEAST_SCORE, LEAST_SHARE, MOST_REPORTED, REPORTED_COMPETITOR, SELECTION_FLOOR,
    STATIC_MOVED, STATIC_PEAK, UNCONFIRMED_SHARE,
};
use super::intervals::deviations;
use super::linear::energy;
use super::rows::Rows;
use super::selection_step::{self, Selection};
use super::verdict::{Considered, Missing, ParameterValue, Unconfirmed, Why, WhyNot, is_relevant};
use super::why::{Chance, Evidence};

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
                .map(|((p, v), std)| ParameterValue::of(p, *v, *std))
                .collect();
            let model_weight = selection_step::model_weight(&t.competitors);
            let confusable: Vec<String> = t
                .competitors
                .iter()
                .filter(|r| r.1 > REPORTED_COMPETITOR)
                .take(MOST_REPORTED)
                .map(|r| library[r.0].name().to_owned())
                .collect();
            let share = (explained * t.share / total).clamp(0.0, 1.0);
            let chance = if t.p <= FAMILY_ALPHA {
                Chance::Tested { effects: library.len(), p: t.p }
            } else {
                Chance::FewStrokes { p: t.p, log_ratio: t.fit.score / 2.0 }
            };
            let change_point = change_point::place(candidate, &t.fit)
                .map(|shape| change_point::of(t.fit.shapes[shape], rows));
            let why = Why::Found(Evidence { share, chance, change_point });
            Missing {
                model_weight,
                share_explained: share,
                parameters,
                confusable_with: confusable,
                correction: candidate.of_the_bench(),
                peak_N: t.fit.peak,
                p: t.p,
                ..Missing::of(info, calibration::probability(model_weight, explained), why)
            }
        })
        .collect()
}

/// Root mean square from which on a trace would be named, N; infinite where none would. Noise hides a smaller one, given how much of it the
/// base leaves, and what moves the force by less than the model's own inexactness is not named. Nor is a trace of which the base leaves
/// no more than its law is wrong by.
fn nameable(t: &CandidateFit, law_error: f64, selection: &Selection, sigma: f64, blocked: f64) -> f64 {
    let independent = selection.noise.independent.max(DETECTION_ROWS);
    let visible = t.visible.max(1e-12);
    let detectable = DETECTION * sigma / independent.sqrt() / visible.sqrt();
    let noise = sigma.max(LEAST_SIGMA * blocked);
    let score = |size: f64| {
        let seen = independent * (visible * (size / noise).powi(2)).ln_1p();
        seen - independent.min(SYSTEMATIC_ROWS) * (law_error * size / noise).powi(2).ln_1p()
    };
    let floor = if t.beyond_tables < CONCEALED { STATIC_MOVED } else { SELECTION_FLOOR };
    let mut size = detectable.max(floor * blocked / visible.sqrt());
    while score(size) < LEAST_SCORE {
        size *= SIZE_STEP;
        if size > blocked {
            return f64::INFINITY;
        }
    }
    size
}

/// The candidates that would remove much of the error, strongest first. What tables imitate is not among them.
pub(crate) fn unconfirmed(selection: &Selection, library: &[Candidate]) -> Vec<Unconfirmed> {
    let share = |t: &CandidateFit| t.gain / t.before.max(f64::MIN_POSITIVE);
    let fits = |t: &&CandidateFit| share(t) >= UNCONFIRMED_SHARE && t.beyond_tables >= CONCEALED;
    let mut found: Vec<&CandidateFit> = selection.first_scan.iter().filter(fits).collect();
    found.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let unconfirmed = |t: &CandidateFit| Unconfirmed {
        effect: library[t.candidate].name().into(),
        share: share(t).min(1.0),
        parameters: t.amplitudes.iter().chain(&t.shapes).copied().collect(),
    };
    found.into_iter().take(MOST_REPORTED).map(unconfirmed).collect()
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
            let hidden = (t.size > 0.0 && t.peak > 0.0).then(|| {
                let by_noise =
                    nameable(t, library[t.candidate].law_error(&selection.rows), selection, sigma, blocked);
                // Below the size from which an effect that tables imitate is named at all it could be there anyway; and so could what
                // fits the misfit and was not named for another reason.
                let least = if t.beyond_tables < CONCEALED { STATIC_PEAK * blocked } else { 0.0 };
                let fitted = if gain >= LEAST_SHARE { t.peak } else { 0.0 };
                (by_noise * t.peak / t.size).max(least).max(fitted)
            });
            let hidden = hidden.filter(|h| h.is_finite() && *h < ABSURD_SIZE * blocked);
            let unseen = is_relevant(hidden, blocked);
            let why_not = if confusable.iter().any(|c| c.as_str() == name) {
                WhyNot::Confusable
            } else if selection.remarks.iter().any(|r| r.drops(name)) {
                WhyNot::Refused
            } else if t.size <= 0.0 {
                WhyNot::NotExcited
            } else if unseen && t.score < LEAST_SCORE {
                WhyNot::Hidden
            } else if *p > FAMILY_ALPHA && t.score < LEAST_SCORE {
                WhyNot::Chance(*p)
            } else if missing.is_empty() && gain >= LEAST_SHARE {
                if selection.remarks.iter().any(|r| r.refuses(name)) {
                    WhyNot::Refused
                } else {
                    WhyNot::WithinInexactness
                }
            } else if missing.is_empty() {
                WhyNot::TooLittle
            } else {
                WhyNot::LessThanNamed
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
