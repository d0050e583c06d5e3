//! Effects that the user knows to be there: fitted with the base by the same steps as names that are found, whatever the evidence; and
//! what the recordings themselves say of them.

use model_core::effects::Imitates;
use rayon::prelude::*;

use super::baselines::{self, Kind};
use super::candidates::Candidate;
use super::criteria::candidates::LEAST_SIGMA;
use super::criteria::selection::{FAMILY_ALPHA, LEAST_EXCESS, LEAST_SCORE, LEAST_SCORE_ALONE, MAX_NAMED};
use super::criteria::uncertainty::HELD_OUT_LEAVES;
use super::evidence::Scale;
use super::ground::Ground;
use super::held_out::Unseen;
use super::linear::energy;
use super::rows::Rows;
use super::search::search;
use super::select::{Found, Joint, Taken, look, refit, rivals};
use super::trial::Trial;
use super::verdict::{HeldOut, Missing, Why};
use super::why::UnseenError;
use pam_data::error::{DataCode, Error, Result};
use pam_fit::bench::Candidate as Law;

/// Refuses what cannot be given: too many effects, one twice, or a part of the base model.
pub(super) fn check(given: &[Law]) -> Result<()> {
    let refused = |why: String, help: &str| Err(Error::new(DataCode::CallInvalid, why).help(help.to_owned()));
    if given.len() > MAX_NAMED {
        return refused(
            format!("{} effects are given; {MAX_NAMED} are the most that recordings can bear", given.len()),
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
                    format!("`{}` cannot be given: it is offered before any effect is weighed", law.name()),
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
) -> (Found, HeldOut) {
    // The search as it always is, which may take nothing: noise, base and a first look at every effect.
    let everything: Vec<usize> = (0..library.len()).collect();
    let mut found = search(rows, library, blocked, step, &everything);
    let weight = energy(rows.root_weight()).max(1e-12);
    let scale = Scale {
        weight,
        independent: found.noise.independent.max(rows.blocks as f64),
        sigma: found.noise.sigma.max(LEAST_SIGMA * blocked),
        blocked,
    };
    let noise_energy = scale.sigma * scale.sigma * weight;
    let mut chosen: Vec<Trial> = Vec::new();
    for &index in given {
        let rows = &found.rows;
        let ground = Ground::new(&found.full, scale);
        let (best, p) = if chosen.is_empty() {
            (found.first_look.clone(), found.first_p.clone())
        } else {
            look(library, rows, &ground, blocked)
        };
        let place = best.iter().position(|t| t.candidate == index);
        let trial = place
            .map(|i| best[i].clone())
            .filter(|t| t.gain > 0.0)
            .unwrap_or_else(|| forced(index, &ground, library, rows));
        let kind = Kind::Soft(trial.give);
        let metric = baselines::fit(rows, kind, &[]);
        let mut rivals = rivals(&trial, &best, library, rows, &ground, &metric.span);
        rivals.retain(|r| !given.contains(&r.0));
        if chosen.is_empty() {
            found.above = (trial.before - noise_energy).max(LEAST_EXCESS * trial.before).max(1e-12);
        }
        let share = trial.gain / found.above;
        chosen.push(trial.clone());
        let joint = refit(rows, kind, chosen, library);
        chosen = joined(&mut found, joint);
        found.bare = metric;
        let p = place.map_or(1.0, |i| p[i]);
        found.taken.push(Taken { trial, p, share, rivals, rms: found.full.rms(&found.rows) });
    }
    // What was fitted first did not know of what came after it.
    for place in 0..chosen.len().saturating_sub(1) {
        let mut others = chosen.clone();
        let own = others.remove(place);
        let without = refit(&found.rows, found.full.kind, others, library);
        let again = Ground::new(&without.base, scale).refine(&own, library, &without.rows);
        if again.gain > 0.0 {
            chosen[place] = again;
        }
        let joint = refit(&without.rows, found.full.kind, chosen, library);
        chosen = joined(&mut found, joint);
    }
    for (taken, trial) in found.taken.iter_mut().zip(chosen) {
        taken.trial = trial;
        taken.rms = found.full.rms(&found.rows);
    }
    let held = Unseen::new(&found.rows, found.full.kind, &found.traces).held_out(&found.traces, scale.sigma);
    (found, held)
}

/// Enters a joint fit into what was found; gives the effects with its amplitudes.
fn joined(found: &mut Found, joint: Joint) -> Vec<Trial> {
    (found.rows, found.full, found.traces) = (joint.rows, joint.base, joint.traces);
    joint.trials
}

/// The best of an effect where it is not worth its free numbers: something of it rather than nothing.
fn forced(index: usize, ground: &Ground<'_>, library: &[Candidate], rows: &Rows) -> Trial {
    let candidate = &library[index];
    let tried: Vec<Trial> = candidate
        .grid()
        .par_iter()
        .map(|shapes| ground.attempt(index, candidate, shapes, rows, false))
        .collect();
    let best = tried.iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
    let Some(best) = best else { unreachable!("a grid has at least one point") };
    let refined = ground.refine(best, library, rows);
    if refined.gain > 0.0 { refined } else { ground.attempt(index, candidate, &best.shapes, rows, true) }
}

/// Marks the names as given, and says what the recordings say of each.
pub(super) fn judge(missing: &mut [Missing], found: &Found, held: &HeldOut) {
    let unseen_rows = Unseen::new(&found.rows, found.full.kind, &found.traces);
    for (i, (m, taken)) in missing.iter_mut().zip(&found.taken).enumerate() {
        let trial = &taken.trial;
        let sized = trial.amplitudes.iter().any(|a| *a != 0.0);
        let likely = trial.score >= if taken.p <= FAMILY_ALPHA { LEAST_SCORE } else { LEAST_SCORE_ALONE };
        let mut others = found.traces.clone();
        others.remove(i);
        let without = if others.is_empty() { held.rms_before_N } else { unseen_rows.error(&others) };
        let helps = held.rms_after_N < HELD_OUT_LEAVES * without;
        let unseen = UnseenError { without, with: held.rms_after_N };
        m.given = true;
        m.probability = 1.0;
        m.supported = sized && likely && helps;
        if !m.supported {
            // What is not there has no rivals.
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
