//! Effects that the user gives as known: fitted with the base like selected ones, without a test of the evidence, and then compared with what the
//! recordings support.

use model_core::effects::Imitates;
use rayon::prelude::*;

use super::baselines::{self, Kind};
use super::candidate_fit::CandidateFit;
use super::candidate_scoring::Scorer;
use super::candidates::Candidate;
use super::criteria::candidates::LEAST_SIGMA;
use super::criteria::selection::{FAMILY_ALPHA, LEAST_EXCESS, LEAST_SCORE, LEAST_SCORE_ALONE, MOST_SELECTED};
use super::criteria::uncertainty::HELD_OUT_LEAVES;
use super::cross_validation::HeldOutRows;
use super::forward_selection::forward_selection;
use super::likelihood::Scale;
use super::linear::energy;
use super::rows::Rows;
use super::selection_step::{JointFit, SelectedEffect, Selection, competitors, refit, scan_step};
use super::verdict::{HeldOut, Missing, Why};
use super::why::UnseenError;
use pam_data::error::{DataCode, Error, Result};
use pam_fit::bench::Candidate as Law;

/// Refuses what cannot be given: too many effects, the same one twice, or a part of the base model.
pub(super) fn check(given: &[Law]) -> Result<()> {
    let refused = |why: String, help: &str| Err(Error::new(DataCode::CallInvalid, why).help(help.to_owned()));
    if given.len() > MOST_SELECTED {
        return refused(
            format!(
                "{} effects are given; {MOST_SELECTED} are the most that recordings can bear",
                given.len()
            ),
            "give those that matter most",
        );
    }
    for (i, law) in given.iter().enumerate() {
        match law.traits().imitates {
            Some(Imitates::Deadband) => {
                return refused(
                    format!(
                        "`{}` cannot be given: it is the deadband, which is fitted in any case",
                        law.name()
                    ),
                    "leave it out",
                );
            }
            Some(Imitates::ElasticOrders) => {
                return refused(
                    format!("`{}` cannot be given: it is offered before any effect is tested", law.name()),
                    "leave it out, or fit with `host fit --order`",
                );
            }
            _ if given[..i].contains(law) => {
                return refused(format!("`{}` is given twice", law.name()), "give each effect once");
            }
            _ => {}
        }
    }
    Ok(())
}

/// Fits the given members of the library beside the base, each beside the others.
pub(super) fn fitted(
    rows: &Rows,
    library: &[Candidate],
    blocked: f64,
    step: f64,
    given: &[usize],
) -> (Selection, HeldOut) {
    // The usual selection, with every candidate refused: it gives noise, base and a first scan of all effects.
    let everything: Vec<usize> = (0..library.len()).collect();
    let mut selection = forward_selection(rows, library, blocked, step, &everything);
    let weight = energy(rows.root_weight()).max(1e-12);
    let scale = Scale {
        weight,
        independent: selection.noise.independent.max(rows.blocks as f64),
        sigma: selection.noise.sigma.max(LEAST_SIGMA * blocked),
        blocked,
    };
    let noise_energy = scale.sigma * scale.sigma * weight;
    let mut chosen: Vec<CandidateFit> = Vec::new();
    for &index in given {
        let rows = &selection.rows;
        let scorer = Scorer::new(&selection.joint, scale);
        let (best, p) = if chosen.is_empty() {
            (selection.first_scan.clone(), selection.first_p.clone())
        } else {
            scan_step(library, rows, &scorer, blocked, &chosen)
        };
        let place = best.iter().position(|t| t.candidate == index);
        let fit = place
            .map(|i| best[i].clone())
            .filter(|t| t.gain > 0.0)
            .unwrap_or_else(|| forced(index, &scorer, library, rows));
        let kind = Kind::Soft(fit.prior);
        let metric = baselines::fit(rows, kind, &[]);
        let mut competitors = competitors(&fit, &best, library, rows, &scorer, &metric.span);
        competitors.retain(|r| !given.contains(&r.0));
        if chosen.is_empty() {
            selection.excess_energy = (fit.before - noise_energy).max(LEAST_EXCESS * fit.before).max(1e-12);
        }
        let share = fit.gain / selection.excess_energy;
        chosen.push(fit.clone());
        let joint = refit(rows, kind, chosen, library);
        chosen = joined(&mut selection, joint);
        selection.base_alone = metric;
        let p = place.map_or(1.0, |i| p[i]);
        selection.selected.push(SelectedEffect {
            fit,
            p,
            share,
            competitors,
            rms: selection.joint.rms(&selection.rows),
        });
    }
    // Each effect is fitted once more beside all others.
    for place in 0..chosen.len().saturating_sub(1) {
        let mut others = chosen.clone();
        let own = others.remove(place);
        let without = refit(&selection.rows, selection.joint.kind, others, library);
        let again = Scorer::new(&without.base, scale).refine(&own, library, &without.rows);
        if again.gain > 0.0 {
            chosen[place] = again;
        }
        let joint = refit(&without.rows, selection.joint.kind, chosen, library);
        chosen = joined(&mut selection, joint);
    }
    for (selected, fit) in selection.selected.iter_mut().zip(chosen) {
        selected.fit = fit;
        selected.rms = selection.joint.rms(&selection.rows);
    }
    let held = HeldOutRows::new(&selection.rows, selection.joint.kind, &selection.traces)
        .held_out(&selection.traces, scale.sigma);
    (selection, held)
}

/// Enters a joint fit into what was found; gives the effects with its amplitudes.
fn joined(selection: &mut Selection, joint: JointFit) -> Vec<CandidateFit> {
    (selection.rows, selection.joint, selection.traces) = (joint.rows, joint.base, joint.traces);
    joint.fits
}

/// The best fit of an effect whose score is below zero.
fn forced(index: usize, scorer: &Scorer<'_>, library: &[Candidate], rows: &Rows) -> CandidateFit {
    let candidate = &library[index];
    let tried: Vec<CandidateFit> =
        candidate.grid().par_iter().map(|shapes| scorer.fit(index, candidate, shapes, rows, false)).collect();
    let best = tried.iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
    let Some(best) = best else { unreachable!("a grid has at least one point") };
    let refined = scorer.refine(best, library, rows);
    if refined.gain > 0.0 { refined } else { scorer.fit(index, candidate, &best.shapes, rows, true) }
}

/// Marks the effects as given, and enters whether the recordings support each.
pub(super) fn judge(missing: &mut [Missing], selection: &Selection, held: &HeldOut) {
    let unseen_rows = HeldOutRows::new(&selection.rows, selection.joint.kind, &selection.traces);
    for (i, (m, selected)) in missing.iter_mut().zip(&selection.selected).enumerate() {
        let fit = &selected.fit;
        let sized = fit.amplitudes.iter().any(|a| *a != 0.0);
        let likely = fit.score >= if selected.p <= FAMILY_ALPHA { LEAST_SCORE } else { LEAST_SCORE_ALONE };
        let mut others = selection.traces.clone();
        others.remove(i);
        let without = if others.is_empty() { held.rms_before_N } else { unseen_rows.error(&others) };
        let helps = held.rms_after_N < HELD_OUT_LEAVES * without;
        let unseen = UnseenError { without, with: held.rms_after_N };
        m.given = true;
        m.probability = 1.0;
        m.supported = sized && likely && helps;
        if !m.supported {
            // An absent effect has no competitors.
            m.confusable_with.clear();
        }
        if !sized {
            m.peak_N = 0.0;
        }
        m.why = if !sized {
            Why::GivenWithoutSize
        } else if let (true, Why::Found(evidence)) = (m.supported, &m.why) {
            Why::GivenSupported(evidence.clone(), unseen)
        } else if likely {
            Why::GivenNoImprovement(unseen)
        } else {
            Why::GivenNoEvidence { share: m.share_explained, unseen }
        };
    }
}
