//! What the recordings say so far: the fitted table, and the diagnosis as sets of possible effects.

use std::path::PathBuf;

use model_core::muscle::Muscle;
use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::history::is_from_history;
use pam_diagnose::verdict::Missing;
use pam_diagnose::{Diagnosis, Options as DiagnoseOptions};
use pam_fit::bench::Candidate;
use pam_fit::checks::Checks;
use pam_fit::{Fit, Options, fit};

use crate::hypothesis::Hypothesis;

/// Recordings of one muscle, and what is known of it.
#[derive(Debug)]
pub struct Findings {
    /// The fitted table.
    pub fit: Fit,
    /// Its model.
    pub model: Muscle<f64>,
}

/// Fits the table; nothing where the recordings do not determine one yet.
#[must_use]
pub fn fitted(recordings: &[Recording], muscle: &MuscleDescription) -> Option<Findings> {
    let campaign = Campaign::new(recordings.to_vec());
    let fit = fit(&campaign, muscle, &Options::default()).ok()?;
    let model = Muscle::<f64>::build(&fit.table).ok()?;
    Some(Findings { fit, model })
}

/// Diagnoses the recordings beside the checks of the bench that were made.
///
/// # Errors
/// Checks that cannot be read; recordings without rows.
pub fn diagnosed(
    recordings: &[Recording],
    muscle: &MuscleDescription,
    checks: &[PathBuf],
) -> Result<Diagnosis> {
    let campaign = Campaign::new(recordings.to_vec());
    let options = DiagnoseOptions {
        muscle: muscle.name.clone(),
        checks: Checks::read(checks)?,
        ..DiagnoseOptions::default()
    };
    pam_diagnose::history::diagnose(&campaign, &muscle.geometry(), &options)
}

/// Each name of a diagnosis with those that it is confusable with, by probability.
#[must_use]
pub(crate) fn sets(diagnosis: &Diagnosis) -> Vec<Vec<Hypothesis>> {
    diagnosis.missing.iter().filter(|m| !is_from_history(m)).filter_map(set).collect()
}

fn set(missing: &Missing) -> Option<Vec<Hypothesis>> {
    let law = Candidate::from_name(&missing.effect)?;
    let competitors: Vec<Candidate> =
        missing.confusable_with.iter().filter_map(|n| Candidate::from_name(n)).collect();
    // A probability of 1 would leave nothing to ask.
    let own = missing.probability.clamp(0.05, 0.95);
    let others = competitors.len() as f64;
    let mut set = vec![Hypothesis {
        law,
        weight: if competitors.is_empty() { 1.0 } else { own },
        parameters: (!missing.parameters.is_empty())
            .then(|| missing.parameters.iter().map(|p| p.value).collect()),
    }];
    set.extend(competitors.into_iter().map(|law| Hypothesis {
        law,
        weight: (1.0 - own) / others,
        parameters: None,
    }));
    Some(set)
}

/// The names that are possible, in order.
#[must_use]
pub fn names(diagnosis: &Diagnosis) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for m in &diagnosis.missing {
        for name in std::iter::once(&m.effect).chain(&m.confusable_with) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
    }
    names
}
