//! The whole chain for recordings at held lengths: from runs to tested changes.

use nalgebra::DVector;

use super::cells::Cell;
use super::contrast::Contrast;
use super::criteria::{COMBINED_SHAPE_ERROR, DIRECTIONS_PER_RUN, LAGS, LAGS_FIRST, TABLE_ERROR_FACTORS};
use super::lag;
use super::naming::{self, Accepted};
use super::posterior::Posterior;
use super::repeatability::{Setting, covariance};
use super::runs::Runs;
use super::shapes::Change;
use super::surface::Surface;
use super::table_error;
use super::weighing::{Inexact, Round, Weighing, weigh};
use pam_data::error::{DataCode, Error, Result};

/// Everything that was found.
pub(super) struct Analysis {
    pub runs: Runs,
    pub surface: Surface,
    pub cells: Vec<Cell>,
    /// Of the first round, without changes.
    pub contrast: Contrast,
    pub first: Round,
    pub accepted: Vec<Accepted>,
    /// The weighing after the last name.
    pub last: Posterior,
    /// The changes that were tested, in order.
    pub tested: Vec<Change>,
    /// Whether the reference is recordings, and no table.
    pub recorded: bool,
    /// The likeliest error of a table in a cell, N; zero for recordings.
    pub reference_error: f64,
}

/// Which level each cell belongs to, without gaps.
fn levels(cells: &[Cell]) -> Vec<usize> {
    let key = |c: &Cell| (c.mounting, c.direction < 0.0, c.bin);
    let mut all: Vec<_> = cells.iter().map(key).collect();
    all.sort_unstable();
    all.dedup();
    cells.iter().map(|c| all.binary_search(&key(c)).unwrap_or(0)).collect()
}

/// The reference and how good it is.
pub(super) struct Reference {
    pub surface: Surface,
    /// N; zero where the reference is recordings, whose levels are estimated with the rest.
    pub error: f64,
    /// Whether BEFORE has cells of its own.
    pub recorded: bool,
}

/// Weighs everything. `tested`: the changes that are tested, in order.
///
/// # Errors
/// Recordings that leave no common cells, or numbers that cannot be used.
pub(super) fn analyse(
    runs: Runs,
    reference: Reference,
    tested: Vec<Change>,
    prior_none: f64,
) -> Result<Analysis> {
    let Reference { surface, error, recorded } = reference;
    // Rows of one part of a motion do not follow one another: they do not show lags.
    // A table is often older: a filter of some seconds may have been added since.
    let tried = if recorded { LAGS_FIRST } else { LAGS.len() };
    let shift = (!runs.moving).then(|| lag::between(&runs, &surface, tried, false));
    let late = shift.as_ref().map_or(0.0, |s| s.lag);
    let cells = naming::traced(&runs, &surface, late);
    if !cells.iter().any(|c| c.after) {
        let values = || runs.side(true).flat_map(|r| r.pressure.iter().copied());
        return Err(Error::new(DataCode::RecordingOutOfRange, "AFTER and the reference have no pressures in common")
            .help(format!(
                "AFTER has {:.0} to {:.0} kPa, the reference {:.0} to {:.0} kPa: check the units, or record the same pressures",
                values().fold(f64::INFINITY, f64::min) / 1e3,
                values().fold(f64::NEG_INFINITY, f64::max) / 1e3,
                surface.low / 1e3,
                surface.high / 1e3
            )));
    }
    let setting = Setting {
        range: surface.high - surface.low,
        largest: surface.largest,
        remounted: runs.remounted,
        moving: runs.moving,
    };
    let contrasts = contrasts(&cells, &runs, &setting, (!recorded).then_some(error))?;
    // Beside rests the first name is tested as it is: no other one is left by it.
    let inexact = Inexact { share: if runs.moving { COMBINED_SHAPE_ERROR } else { 0.0 }, first: 0.0 };
    let by = Weighing {
        surface: &surface,
        tested: &tested,
        lag: shift.as_ref(),
        inexact,
        moving: runs.moving,
        prior_none,
    };
    let weighed = |c: Contrast| (weigh(&cells, &c, by), c);
    let (first, contrast, which) = likeliest(contrasts.into_iter().map(weighed).collect())?;
    let reference_error = if recorded { 0.0 } else { error * TABLE_ERROR_FACTORS[which] };
    let about = naming::About { runs: &runs, lags_first: tried, by };
    let named = naming::name(&about, &contrast, (&cells, &first));
    let naming::NamedChanges { cells, accepted, last } = named;
    Ok(Analysis { runs, surface, cells, contrast, first, accepted, last, tested, recorded, reference_error })
}

/// Generalised least squares for every error that the reference may have; one, without an error, for recordings.
fn contrasts(
    cells: &[Cell],
    runs: &Runs,
    setting: &Setting,
    table_error: Option<f64>,
) -> Result<Vec<Contrast>> {
    let unusable =
        || Error::new(DataCode::RecordingNotFinite, "the recordings hold numbers that cannot be compared");
    let repeats = covariance(cells, setting);
    let y = DVector::from_iterator(cells.len(), cells.iter().map(|c| c.means.residual));
    let Some(error) = table_error else {
        let used: std::collections::BTreeSet<usize> = runs.runs.iter().map(|r| r.mounting).collect();
        // Runs repeated on one side, or else lengths beyond the first: what a single change leaves of their differences does not repeat.
        let repeated = runs.runs.len() as f64 - 2.0 * used.len() as f64;
        let taught = DIRECTIONS_PER_RUN * repeated.max(used.len() as f64 - 1.0).max(1.0);
        return Ok(vec![Contrast::new(repeats, Some(&levels(cells)), y, taught).ok_or_else(unusable)?]);
    };
    // What the error's size adapts to, the scale of what repeats must not take once more.
    let of = |factor: &f64| {
        let k = &repeats + table_error::covariance(cells, setting.range, factor * error);
        Contrast::new(k, None, y.clone(), 0.0).ok_or_else(unusable)
    };
    TABLE_ERROR_FACTORS.iter().map(of).collect()
}

/// The likeliest of several errors of the reference, with the probabilities of causes averaged over all of them.
fn likeliest(mut all: Vec<(Round, Contrast)>) -> Result<(Round, Contrast, usize)> {
    let log = |(round, contrast): &(Round, Contrast)| contrast.density + round.posterior.evidence;
    let logs: Vec<f64> = all.iter().map(log).collect();
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let best = logs.iter().position(|l| *l == top).unwrap_or(0);
    let weights: Vec<(f64, &Posterior)> =
        logs.iter().zip(&all).map(|(l, (round, _))| ((l - top).exp(), &round.posterior)).collect();
    // One has no mean; its weight may be of no meaning.
    let mean = (all.len() > 1).then(|| Posterior::mean(&weights));
    if best >= all.len() {
        return Err(Error::new(DataCode::RecordingEmpty, "nothing to weigh"));
    }
    let (mut round, contrast) = all.swap_remove(best);
    round.posterior = mean.unwrap_or(round.posterior);
    Ok((round, contrast, best))
}
