//! The diagnosed model: the table refitted beside the effects that were named, and the bench's corrections apart from it.

use model_core::effects::{FittedEffect, MAX_EFFECTS, MEMORY};
use model_core::muscle::Muscle;

use super::criteria::judgement::{CHECKED_COST, PREDICTIVE_COST, REFIT_ROUNDS};
use super::history;
use super::history::table_fit;
use super::protocol_simulation::moments;
use super::refit_comparison::RefitComparison;
use super::verdict::{Diagnosis, Verdict};
use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_data::recording::dropouts::Screened;
use pam_fit::bench::Candidate;
use pam_fit::predict::predict;
use pam_fit::table_file::{Correction, TableFile};
use pam_fit::{Options as FitOptions, fit};

/// A refitted table file and how well it does on the recordings.
#[derive(Clone, Debug)]
pub struct Refitted {
    /// The table with the muscle's effects; the bench's corrections stay in what is about it.
    pub file: TableFile,
    /// Error of the plain table on the recordings, N.
    pub rms_before: f64,
    /// Error of the refitted one, N.
    pub rms_after: f64,
    /// Mean error at a pressure left out of the fit, without and with the effects, % of blocked force; none of a single pressure.
    pub left_out: Option<(f64, f64)>,
    /// What the fit warned of.
    pub warnings: Vec<String>,
    /// What is to be known of the effects in the table: that they were left out of it, or kept on the user's word alone.
    pub comparison: Option<RefitComparison>,
}

/// Refits the table beside the named effects. They are kept only where the recordings are then predicted better, or about as well
/// and a pressure left out of the fit no worse: a table must not get worse by a diagnosis. What the user gave is kept in any case.
/// First runs that the diagnosis leaves out are left out.
///
/// # Errors
/// Recordings that cannot be fitted.
pub fn refit(campaign: &Campaign, muscle: &MuscleDescription, diagnosis: &Diagnosis) -> Result<Refitted> {
    let campaign = &*history::without_first_runs(campaign, diagnosis);
    let plain = fit(campaign, muscle, &FitOptions::default())?;
    let tool = || format!("host {}", env!("CARGO_PKG_VERSION"));
    let bare = plain.table_file(tool());
    let before = predict(&bare, campaign)?.rms.unwrap_or(0.0);
    if let Some(remembering) = with_memory(campaign, muscle, diagnosis, before)? {
        return Ok(remembering);
    }
    let unseen = plain.summary.left_out_pressure_mean_error_pct;
    let mut warnings = plain.summary.warnings.clone();
    let (effects, corrections) = parts(diagnosis);
    let nothing = effects.is_empty() && corrections.is_empty();
    let given = diagnosis.missing.iter().any(|m| m.given);
    if nothing || (diagnosis.verdict() == Verdict::Consistent && !given) {
        return Ok(without_effects(bare, before, warnings, None));
    }
    let mut left_out = None;
    let mut with = bare.clone();
    with.about.corrections.clone_from(&corrections);
    with.about.beginning = diagnosis.beginning;
    with.table.effects = effects.iter().cloned().collect();
    for _ in 0..REFIT_ROUNDS {
        let mut without = with.clone();
        without.table.effects.clear();
        without.about.corrections.clear();
        let (full, base) = (predict(&with, campaign)?, predict(&without, campaign)?);
        let mut freed = campaign.clone();
        for ((recording, f), b) in freed.recordings.iter_mut().zip(&full.recordings).zip(&base.recordings) {
            if let Some(force) = &mut recording.force {
                for ((force, f), b) in force.iter_mut().zip(&f.force).zip(&b.force) {
                    *force -= f - b;
                }
            }
        }
        let again = fit(&freed, muscle, &FitOptions::default())?;
        with = again.table_file(tool());
        with.table.effects = effects.iter().cloned().collect();
        with.about.corrections.clone_from(&corrections);
        with.about.beginning = diagnosis.beginning;
        left_out = unseen.zip(again.summary.left_out_pressure_mean_error_pct);
        warnings.clone_from(&again.summary.warnings);
    }
    let after = predict(&with, campaign)?.rms.unwrap_or(f64::INFINITY);
    // A fault that a check measured is there, even where tables absorb it.
    let measured = diagnosis.missing.iter().all(|m| m.checked);
    let foretells = left_out.is_some_and(|(plain, with)| with <= plain);
    let better = after < before
        || measured && after <= CHECKED_COST * before
        || foretells && after <= PREDICTIVE_COST * before;
    let possible = with.table.check().is_ok();
    let no_better = |kept: bool| RefitComparison { kept, with: after, without: before, left_out };
    let mut comparison = None;
    if given && !better && possible {
        comparison = Some(no_better(true));
    } else if !(better && possible) {
        return Ok(without_effects(bare, before, warnings, Some(no_better(false))));
    }
    remember(&mut with, campaign);
    Ok(Refitted { file: with, rms_before: before, rms_after: after, left_out, warnings, comparison })
}

/// The table with the memory that the history of the campaign shows, where it predicts the recordings better than the plain one. Its
/// static part has layers of its own (lengths of the mountings, zero of the load cell, contact), so that no other named effect is added.
fn with_memory(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    diagnosis: &Diagnosis,
    before: f64,
) -> Result<Option<Refitted>> {
    if !diagnosis.missing.iter().any(history::is_from_history) {
        return Ok(None);
    }
    let settled = table_fit::settled(&history::reliable_recordings(campaign));
    let Some(file) = table_fit::table(&settled, muscle)? else { return Ok(None) };
    let after = predict(&file, campaign)?.rms.unwrap_or(f64::INFINITY);
    let better = after < before && file.table.check().is_ok();
    let warnings = file.about.fit.warnings.clone();
    let refitted =
        Refitted { file, rms_before: before, rms_after: after, left_out: None, warnings, comparison: None };
    Ok(better.then_some(refitted))
}

/// The plain table, as the result where no effect goes into it.
fn without_effects(
    file: TableFile,
    rms: f64,
    warnings: Vec<String>,
    comparison: Option<RefitComparison>,
) -> Refitted {
    Refitted { file, rms_before: rms, rms_after: rms, left_out: None, warnings, comparison }
}

/// Leaves in each effect what the recordings left in the muscle, so that a controller takes over a muscle that was worked.
fn remember(file: &mut TableFile, campaign: &Campaign) {
    let Ok(muscle) = Muscle::<f64>::build(&file.table) else { return };
    let contexts = moments(&muscle, &Screened::of(campaign).campaign);
    for e in &mut file.table.effects {
        let parameters: Vec<f64> = e.parameters.iter().map(|p| f64::from(*p)).collect();
        let mut memory = [0.0; MEMORY];
        for context in &contexts {
            e.effect.step(&parameters, context, &mut memory);
        }
        *e = e.clone().left_with(&memory);
    }
}

/// The named effects as a table carries them, and as corrections.
fn parts(diagnosis: &Diagnosis) -> (Vec<FittedEffect>, Vec<Correction>) {
    let mut effects = Vec::new();
    let mut corrections = Vec::new();
    for m in &diagnosis.missing {
        let values: Vec<f64> = m.parameters.iter().map(|p| p.value).collect();
        if values.is_empty() {
            // A check shows it, and nothing its size.
            continue;
        }
        match Candidate::from_name(&m.effect) {
            // The memory found by the history layer goes into a table by its own fit, or not at all.
            Some(Candidate::Muscle(_)) if history::is_from_history(m) => {}
            // A table carries no more than that; those that were found first explain the most.
            Some(Candidate::Muscle(effect)) if effects.len() < MAX_EFFECTS => {
                effects.push(FittedEffect::new(effect, &values));
            }
            Some(Candidate::Bench(_)) => {
                corrections.push(Correction { effect: m.effect.clone(), parameters: values });
            }
            Some(Candidate::Muscle(_)) | None => {}
        }
    }
    (effects, corrections)
}
