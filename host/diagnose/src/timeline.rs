//! An actuator over its life: quantities and effects of several campaigns in the order of their dates, and when they changed.
//!
//! ```text
//! campaigns → conditions that all share → quantities with bands → change points ┐
//!           → each against the reference campaign → effects with bands ─────────┴→ timeline
//! ```
//! | file | what |
//! | --- | --- |
//! | [`series`] | a quantity over the campaigns |
//! | [`change_points`] | change points: a step or a slope against scatter, by evidence |
//! | `held` | quantities of pressure sweeps at held lengths |
//! | `stroked` | quantities of strokes at regulated pressures |
//! | `fitted` | quantities of a table fitted to each campaign |
//! | `effects` | the comparison of each campaign with the reference |
//! | `mean` | means over conditions with standard errors from repeats |
//!
//! The comparison of two campaigns is [`crate::reference`]; what a muscle remembers within one campaign is [`crate::history`].

pub mod change_points;
mod effects;
mod fitted;
mod held_length;
mod mean;
pub mod series;
mod stroked;
#[cfg(test)]
mod tests;

use pam_data::date::DateSource;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;

use crate::criteria::reference::OTHER_ACTUATOR;
use crate::criteria::timeline::FEWEST_CAMPAIGNS;
use crate::reference::{ChangeReport, Mounted, protocol_is_held};
use change_points::ChangePoints;
use series::{Kind, Series};

/// One campaign of the actuator.
#[derive(Debug, Clone)]
pub struct Visit {
    /// Its folder's or file's name.
    pub name: String,
    /// s since 1970.
    pub date: f64,
    /// Where the date is from.
    pub dated_by: DateSource,
    /// Its recordings.
    pub campaign: Campaign,
}

/// What the caller may choose.
#[derive(Debug, Clone, Default)]
pub struct Options<'a> {
    /// The muscle, whose table is fitted to each campaign.
    pub muscle: Option<&'a MuscleDescription>,
    /// Index of the campaign that the others are compared with.
    pub reference: usize,
    /// Whether the actuator was remounted between campaigns.
    pub mounted: Mounted,
}

/// The whole answer.
#[derive(Debug, Clone)]
pub struct Timeline {
    /// Index of the reference.
    pub reference: usize,
    /// Every quantity and every effect that is named in some campaign, with its change points.
    pub series: Vec<(Series, ChangePoints)>,
    /// The comparison of each campaign with the reference; `None` for the reference.
    pub comparisons: Vec<Option<ChangeReport>>,
    /// What could not be computed, by campaign, and why.
    pub left_out: Vec<(usize, String)>,
}

fn of_campaign(visit: &Visit, error: Error) -> Error {
    error.concerning(format_args!("campaign `{}`", visit.name))
}

/// Follows an actuator through its campaigns, which are in the order of their dates.
///
/// # Errors
/// Fewer than two campaigns, different protocols, columns in other units, another actuator, nothing in common.
pub fn timeline(visits: &[Visit], options: &Options<'_>) -> Result<Timeline> {
    let Some(reference) = visits.get(options.reference).filter(|_| visits.len() >= FEWEST_CAMPAIGNS) else {
        return Err(Error::new(DataCode::CallInvalid, "a history needs two campaigns or more").help(
            "give a folder or a file for each campaign; two sets of recordings of one day are compared with `host diagnose --reference`",
        ));
    };
    let held = protocol_is_held(&reference.campaign).map_err(|e| of_campaign(reference, e))?;
    let comparisons = effects::comparisons(visits, options)?;
    refuse_others(visits, &comparisons)?;
    let mut all = effects::series(&comparisons);
    let measured = if held {
        held_length::series(visits, options.reference)?
    } else {
        stroked::series(visits, options.reference)?
    };
    all.extend(measured);
    let mut left_out = Vec::new();
    if let Some(muscle) = options.muscle {
        all.extend(fitted::series(visits, muscle, &mut left_out));
    }
    let dates: Vec<f64> = visits.iter().map(|v| v.date).collect();
    let with_change_points = |s: Series| {
        let change_points = change_points::find(&dates, &s);
        (s, change_points)
    };
    let series = all.into_iter().filter(|s| s.count() > 0).map(with_change_points).collect();
    Ok(Timeline { reference: options.reference, series, comparisons, left_out })
}

/// Refuses a campaign whose forces are of another size and shape: its quantities would be taken for changes.
fn refuse_others(visits: &[Visit], comparisons: &[Option<ChangeReport>]) -> Result<()> {
    for (visit, report) in visits.iter().zip(comparisons) {
        let Some(r) = report else { continue };
        if r.misfit_rms_N > OTHER_ACTUATOR * r.largest_force_N {
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                format!(
                    "campaign `{}` seems to be of another actuator: its force differs from the reference's by {:.0} % of the largest, rms",
                    visit.name,
                    100.0 * r.misfit_rms_N / r.largest_force_N
                ),
            )
            .help("leave it out; `host diagnose --reference` compares it with one other campaign"));
        }
    }
    Ok(())
}

impl Timeline {
    /// Series with a change.
    pub fn changed(&self) -> impl Iterator<Item = &(Series, ChangePoints)> {
        self.series.iter().filter(|(_, c)| !c.changes.is_empty())
    }

    /// Series of one kind.
    pub fn of_kind(&self, kind: Kind) -> impl Iterator<Item = &(Series, ChangePoints)> {
        self.series.iter().filter(move |(s, _)| s.kind == kind)
    }
}
