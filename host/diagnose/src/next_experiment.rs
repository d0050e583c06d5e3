//! The cheapest next recording that separates effects which the present recordings cannot.

mod menu;

use model_core::effects::{Context, MEMORY};
use model_core::muscle::Muscle;
use rayon::prelude::*;

use self::menu::menu;
use super::criteria::planning::{
    COMPETITOR_GRID, COMPETITOR_GRID_SEVERAL, EXPECTED_NOISE, WORTHWHILE_DIFFERENCE,
};
use super::experiment::{Motion, Proposal, bench_check};
use super::history::is_from_history;
use super::isolability::tables;
use super::linear::{add_scaled, energy};
use super::protocol_simulation::{moments, play};
use super::remark::Remark;
use super::verdict::{Diagnosis, Missing, NextExperiment};
use pam_data::error::Result;
use pam_fit::bench::Candidate;

fn trace(law: Candidate, shape: &[f64], amplitudes: &[f64], contexts: &[Context<f64>]) -> Vec<f64> {
    let mut memory = [0.0; MEMORY];
    let columns = law.columns(contexts, shape, &mut memory);
    let mut sum = vec![0.0; contexts.len()];
    for (a, c) in amplitudes.iter().zip(&columns) {
        add_scaled(&mut sum, *a, c);
    }
    for v in &mut sum {
        if !v.is_finite() {
            *v = 0.0;
        }
    }
    sum
}

/// Whether an experiment could decide between effects that the recordings do not distinguish.
#[must_use]
pub fn is_open(diagnosis: &Diagnosis) -> bool {
    OpenQuestion::of(diagnosis).is_some()
}

/// Effects of which the recordings do not say which it is.
struct OpenQuestion {
    effect: String,
    /// Its numbers in the law's order, SI.
    parameters: Vec<f64>,
    others: Vec<String>,
}

impl OpenQuestion {
    /// The first name that others could have; or, where nothing is named, the effects that fit the error as well as slow noise does.
    fn of(diagnosis: &Diagnosis) -> Option<Self> {
        let open = |m: &&Missing| !m.confusable_with.is_empty() && !is_from_history(m);
        if let Some(m) = diagnosis.missing.iter().find(open) {
            return Some(Self {
                effect: m.effect.clone(),
                parameters: m.parameters.iter().map(|p| p.value).collect(),
                others: m.confusable_with.clone(),
            });
        }
        let (first, others) = diagnosis.unconfirmed().split_first()?;
        (!others.is_empty()).then(|| Self {
            effect: first.effect.clone(),
            parameters: first.parameters.clone(),
            others: others.iter().map(|u| u.effect.clone()).collect(),
        })
    }
}

/// The recording of the menu in which the named effect and those it is confused with differ most for its cost; where nothing is named, the
/// effects that would remove much of the error.
///
/// # Errors
/// None in practice; a protocol of the menu that cannot be played is passed over.
pub fn next_experiment(
    diagnosis: &Diagnosis,
    muscle: &Muscle<f64>,
    low: f64,
    high: f64,
) -> Result<Option<NextExperiment>> {
    let Some(open) = OpenQuestion::of(diagnosis) else { return Ok(None) };
    let Some(law) = Candidate::from_name(&open.effect) else { return Ok(None) };
    let competitors: Vec<Candidate> = open.others.iter().filter_map(|n| Candidate::from_name(n)).collect();
    let values = &open.parameters;
    let (amplitudes, shape) = values.split_at(law.amplitudes().len().min(values.len()));
    let tried: Vec<Option<(f64, f64, String, Motion)>> = menu(muscle, low, high)
        .par_iter()
        .map(|item| {
            let campaign = play(&item.protocol, muscle).ok()?;
            let contexts = moments(muscle, &campaign);
            let basis = tables(&contexts);
            let mine = trace(law, shape, amplitudes, &contexts);
            // The competitor takes its best shape and size: the remaining difference is what the experiment would show.
            let mut least = f64::INFINITY;
            for competitor in &competitors {
                let span = pam_fit::bench::Span::of(&contexts)?;
                let mut best = f64::INFINITY;
                for shape in competitor.grid(
                    if competitor.shapes().len() < 2 { COMPETITOR_GRID } else { COMPETITOR_GRID_SEVERAL },
                    &span,
                ) {
                    let mut with = basis.clone();
                    for c in competitor.columns(&contexts, &shape, &mut [0.0; MEMORY]) {
                        if c.iter().all(|v| v.is_finite()) {
                            with.push(c);
                        }
                    }
                    let mut left = mine.clone();
                    with.project_out(&mut left);
                    best = best.min((energy(&left) / left.len().max(1) as f64).sqrt());
                }
                least = least.min(best);
            }
            let text = item.protocol.to_toml().ok()?;
            Some((least / item.minutes.sqrt(), least, text, item.motion))
        })
        .collect();
    let floor = WORTHWHILE_DIFFERENCE * diagnosis.noise_N.max(EXPECTED_NOISE * diagnosis.blocked_force_N);
    // A rig that held the length throughout may be able to do nothing else.
    let held = diagnosis.remarks.contains(&Remark::HeldLength);
    let preferred =
        |difference: f64, motion: Motion| held && motion.holds_the_length() && difference >= floor;
    let best = tried
        .into_iter()
        .flatten()
        .max_by(|a, b| preferred(a.1, a.3).cmp(&preferred(b.1, b.3)).then(a.0.total_cmp(&b.0)));
    let mut separates = vec![open.effect];
    separates.extend(open.others);
    Ok(best.map(|(_, difference, protocol, motion)| {
        let check = bench_check(&separates);
        let proposal = Proposal { motion, check, motion_separates: check.is_none() || !(difference < floor) };
        NextExperiment { separates, protocol, expected_difference_N: difference, proposal }
    }))
}
