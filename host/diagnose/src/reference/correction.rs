//! What the answer means for a table: a correction of the bench beside it, the change applied to it, or a refit on AFTER.

use super::answer::{ChangeReport, Changed, Verdict};
use super::updated;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_fit::predict::predict;
use pam_fit::table_file::{About, Correction, TableFile};
use pam_fit::{Options as FitOptions, fit};

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Done {
    /// Nothing changed: the table of before stands.
    Unchanged,
    /// The bench's correction is beside the table of before.
    Corrected,
    /// The table of before with the changes of the actuator: AFTER is not a whole campaign.
    Updated,
    /// The table is fitted again to AFTER.
    Refitted,
}

/// A table fitted to recordings.
///
/// # Errors
/// Recordings that cannot be fitted.
pub fn fitted(campaign: &Campaign, muscle: &MuscleDescription) -> Result<TableFile> {
    let fitted = fit(campaign, muscle, &FitOptions::default())?;
    let about = About {
        muscle: muscle.name.clone(),
        tool: format!("host {}", env!("CARGO_PKG_VERSION")),
        fit: fitted.summary.quality(),
        uncertainty: Some(fitted.stored_uncertainty()),
        ..About::default()
    };
    Ok(TableFile { table: fitted.table, about })
}

/// The correction of a change of the bench, in the catalogue's parameters; `None` where its size does not correct later readings.
fn correction(changed: &Changed) -> Option<Correction> {
    let change = changed.change;
    let effect = change.effect().filter(|e| e.is_bench() && change.about().changed.correctable)?;
    let size = changed.parameters.first()?.value;
    let mut parameters = vec![0.0; effect.info().parameters.len()];
    // The catalogue counts the pressure that a gauge lacks, a change what it reads too much.
    *parameters.first_mut()? = change.sign() * size;
    Some(Correction { effect: changed.effect.clone(), parameters })
}

/// The table that follows from the answer. `before`: the table of before, or the recordings of before, to be fitted.
///
/// # Errors
/// An answer that names nothing although something changed, changes that no correction can express, recordings that cannot be fitted.
pub fn table(
    report: &ChangeReport,
    before: impl FnOnce() -> Result<TableFile>,
    after: &Campaign,
    muscle: &MuscleDescription,
) -> Result<(TableFile, Done)> {
    let refused = |why: String, help: &str| Err(Error::new(DataCode::CallInvalid, why).help(help));
    match report.verdict {
        Verdict::Consistent => return Ok((before()?, Done::Unchanged)),
        Verdict::Unexplained => {
            return refused(
                "no table is written: something changed that has no name".into(),
                "leave -o out, look at the report, and fit again with `host fit` once the bench is in order",
            );
        }
        Verdict::Explained | Verdict::PartlyExplained => {}
    }
    let repair = |m: &Changed| {
        let cause = format!(
            "no table is written: `{}` is to be repaired at the bench, not corrected in a table",
            m.effect
        );
        refused(cause, "leave -o out")
    };
    if let Some(m) = report.missing.iter().find(|m| updated::is_repaired(m)) {
        return repair(m);
    }
    let of_actuator = report.missing.iter().any(|m| !m.correction);
    let old = before();
    let campaign = old.as_ref().map_or(true, |old| updated::covers(after, &old.table));
    if of_actuator && campaign {
        return Ok((fitted(after, muscle)?, Done::Refitted));
    }
    let mut file = old?;
    let plain = file.clone();
    for m in report.missing.iter().filter(|m| m.correction) {
        let Some(correction) = correction(m) else { return repair(m) };
        file.about.corrections.push(correction);
    }
    if !of_actuator {
        return Ok((file, Done::Corrected));
    }
    let (with, file) = match updated::updated(&file, report, after) {
        Ok(updated) => updated,
        Err(effect) => {
            return refused(
                format!(
                    "no table is written: a table has no place for `{effect}`, and AFTER is not a whole campaign"
                ),
                "record a campaign like the one before, or fit again with `host fit`",
            );
        }
    };
    let without = predict(&plain, after)?.rms.unwrap_or(f64::INFINITY);
    if !(with < without && file.table.check().is_ok()) {
        return refused(
            format!(
                "no table is written: with the change applied it would predict AFTER with an error of {with:.2} N, without it with {without:.2} N"
            ),
            "record a campaign like the one before, or fit again with `host fit`",
        );
    }
    Ok((file, Done::Updated))
}
