//! The diagnosed model: the table refitted beside the effects that were named, and the bench's corrections apart from it.

use model_core::effects::{FittedEffect, MEMORY};
use model_core::muscle::Muscle;

use super::planned::moments;
use super::verdict::{Diagnosis, Verdict};
use crate::bench::Candidate;
use crate::error::Result;
use crate::fit::{Options as FitOptions, fit};
use crate::muscle_description::MuscleDescription;
use crate::predict::predict;
use crate::recording::Campaign;
use crate::table_file::{About, Correction, TableFile};

/// A refitted table file and how well it does on the recordings.
#[derive(Clone, Debug)]
pub struct Refitted {
    /// The table with the muscle's effects; the bench's corrections stay in what is about it.
    pub file: TableFile,
    /// Error of the plain table on the recordings, N.
    pub rms_before: f64,
    /// Error of the refitted one, N.
    pub rms_after: f64,
    /// What the fit warned of, and whether the effects were left out.
    pub warnings: Vec<String>,
}

/// Rounds of fitting the table to the force without the effects.
const ROUNDS: usize = 3;
/// A measured fault of the bench that tables had swallowed may cost them this factor on the same recordings.
const SWALLOWED: f64 = 1.1;

/// Fits the table anew beside the named effects. An effect is kept only where the recordings are then
/// predicted better: a table must not get worse by a diagnosis; one that the user gave is kept in any case.
///
/// # Errors
/// Recordings that cannot be fitted.
pub fn refit(campaign: &Campaign, muscle: &MuscleDescription, diagnosis: &Diagnosis) -> Result<Refitted> {
    let plain = fit(campaign, muscle, &FitOptions::default())?;
    let about = |fitted: &crate::fit::result::Fit, corrections: Vec<Correction>| About {
        muscle: muscle.name.clone(),
        tool: format!("host {}", env!("CARGO_PKG_VERSION")),
        fit: fitted.summary.quality(),
        uncertainty: Some(fitted.stored_uncertainty()),
        corrections,
        ..About::default()
    };
    let bare = TableFile { table: plain.table.clone(), about: about(&plain, Vec::new()) };
    let before = predict(&bare, campaign)?.rms.unwrap_or(0.0);
    let mut warnings = plain.summary.warnings.clone();
    let (effects, corrections) = parts(diagnosis);
    let nothing = effects.is_empty() && corrections.is_empty();
    let given = diagnosis.missing.iter().any(|m| m.given);
    if nothing || (diagnosis.verdict == Verdict::Consistent && !given) {
        return Ok(Refitted { file: bare, rms_before: before, rms_after: before, warnings });
    }
    let mut with = TableFile { table: plain.table.clone(), about: about(&plain, corrections.clone()) };
    with.table.effects = effects.iter().cloned().collect();
    for _ in 0..ROUNDS {
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
        with.table = again.table.clone();
        with.table.effects = effects.iter().cloned().collect();
        with.about = about(&again, corrections.clone());
    }
    let after = predict(&with, campaign)?.rms.unwrap_or(f64::INFINITY);
    // What a check has measured is there, even where tables would swallow it.
    let measured = diagnosis.missing.iter().all(|m| m.checked);
    let better = if measured { after <= SWALLOWED * before } else { after < before };
    if given && after >= before && with.table.check().is_ok() {
        warnings.push(format!(
            "with the effects that were given the recordings are predicted no better ({after:.3} N against {before:.3} N); the \
             table was written with them all the same"
        ));
    } else if with.table.check().is_err() || !better {
        warnings.push(format!(
            "with the named effects the recordings are predicted no better ({after:.3} N against {before:.3} N): the table was \
             written without them"
        ));
        return Ok(Refitted { file: bare, rms_before: before, rms_after: before, warnings });
    }
    remember(&mut with, campaign);
    Ok(Refitted { file: with, rms_before: before, rms_after: after, warnings })
}

/// Leaves in each effect what the recordings left in the muscle, so that a controller takes over a muscle that was worked.
fn remember(file: &mut TableFile, campaign: &Campaign) {
    let Ok(muscle) = Muscle::<f64>::build(&file.table) else { return };
    let contexts = moments(&muscle, campaign);
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
        match Candidate::from_name(&m.effect) {
            Some(Candidate::Muscle(effect)) => {
                effects.push(FittedEffect::new(effect, &values));
            }
            Some(Candidate::Bench(_)) => {
                corrections.push(Correction { effect: m.effect.clone(), parameters: values });
            }
            None => {}
        }
    }
    (effects, corrections)
}
