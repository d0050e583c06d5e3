//! Mistakes in what describes the recordings: units that no muscle agrees with, dimensions that leave the same error as an effect.
//!
//! A diagnosis takes units and dimensions as given. Wrong units make an error that some effect imitates, and so do dimensions that are
//! wrong by a degree or a tenth of a millimetre.

use pam_data::error::{Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::progress::SharedProgress;
use pam_data::recording::Campaign;
use pam_fit::table_faults::table_faults;
use pam_fit::{Fit, Options as FitOptions, fit};

use super::criteria::judgement::DIMENSIONS_LEAVE;
use super::history;
use super::options::Options;
use super::refitted_table::refit;
use super::remark::{Dimension, Remark, Unjudgeable};
use super::verdict::{Diagnosis, Outcome, Verdict, WhyNot};

/// Finds out what the model leaves out of a campaign, and whether the description of the recordings and of the muscle can be right. `plain`
/// is the fit to these recordings without effects.
///
/// A campaign is not judged where its units or signs leave no muscle: where that fit fails or its table is useless for control, also
/// with the named effects. Where other dimensions of the muscle explain all that an effect explains, a remark gives them.
///
/// # Errors
/// As [`history::diagnose`].
pub fn diagnose_described(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
    plain: std::result::Result<&Fit, &Error>,
) -> Result<Diagnosis> {
    let geometry = muscle.geometry();
    let mut diagnosis = history::diagnose(campaign, &geometry, options)?;
    // At held lengths a fit already looks for the dimensions, and the history judges the rest.
    let moves = campaign.mountings().is_none();
    if diagnosis.judged() && options.given.is_empty() && moves {
        if let Some(why) = implausible(campaign, muscle, &diagnosis, plain) {
            refuse(&mut diagnosis, why);
        } else if let Ok(plain) = plain {
            options.progress.stage("comparing with other dimensions of the muscle", 0);
            let other = dimensions(campaign, muscle, options, &diagnosis, plain);
            if let Some(other) = other {
                diagnosis.remarks.insert(0, Remark::Dimensions(other));
            }
        }
    }
    if let Ok(plain) = plain {
        diagnosis.adopt_blocked_force(plain.summary.blocked_force_N);
    }
    Ok(diagnosis)
}

/// Why no muscle makes these recordings, with the remedy.
fn implausible(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    diagnosis: &Diagnosis,
    plain: std::result::Result<&Fit, &Error>,
) -> Option<String> {
    let plain = match plain {
        Ok(plain) => plain,
        Err(error) => return Some(error.to_string()),
    };
    if let Some(share) = plain.solution.unusual_share_of_braid() {
        return Some(share);
    }
    let faults = &plain.summary.faults;
    if faults.is_empty() {
        return None;
    }
    // A large effect of the bench, such as a wrong zero, makes a useless table, too: with its name the table is a good one.
    let mended = !diagnosis.missing.is_empty()
        && refit(campaign, muscle, diagnosis).is_ok_and(|refitted| {
            let about = &refitted.file.about;
            table_faults(&refitted.file.table, about.uncertainty.as_ref(), &about.fit).is_empty()
        });
    (!mended).then(|| faults.join(". "))
}

fn refuse(diagnosis: &mut Diagnosis, why: String) {
    let reason = Unjudgeable::Implausible(why);
    diagnosis.remarks.insert(0, Remark::NotJudged(reason.clone()));
    diagnosis.outcome = Outcome::NotJudged(reason);
    diagnosis.missing.clear();
    diagnosis.r#where.clear();
    diagnosis.profiles.clear();
    diagnosis.next_experiment = None;
    for considered in &mut diagnosis.considered {
        considered.why_not = WhyNot::NotJudged;
        considered.hidden_up_to_N = None;
    }
}

/// The dimensions with which nothing is left to explain, where they differ from those described; `None` where there are none.
fn dimensions(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
    diagnosis: &Diagnosis,
    plain: &Fit,
) -> Option<Vec<Dimension>> {
    if diagnosis.missing.is_empty() && diagnosis.verdict() != Verdict::Unexplained {
        return None;
    }
    let free = FitOptions { fit_geometry: true, ..FitOptions::default() };
    let fitted = fit(campaign, muscle, &free).ok()?;
    let excess = |fit: &Fit| fit.summary.rms_N.powi(2) - diagnosis.noise_N.powi(2);
    if !(excess(&fitted) < DIMENSIONS_LEAVE * excess(plain)) {
        return None;
    }
    let quiet = Options { progress: SharedProgress::default(), ..options.clone() };
    let again = history::diagnose(campaign, &fitted.solution.problem.geometry, &quiet).ok()?;
    (again.judged() && again.verdict() == Verdict::Consistent).then(|| {
        let of = |a: &pam_fit::Adjusted| Dimension {
            name: a.name.clone(),
            unit: a.unit.into(),
            described: a.nominal,
            fitted: a.value,
        };
        fitted.summary.adjusted.iter().map(of).collect()
    })
}
