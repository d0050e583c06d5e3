//! From recordings to a muscle's table.
//!
//! ```text
//! F = (1 − s k_F(P)) [ (P − P0) g(L) + Σ_k E_k(P) c_k(L) ]
//! ```
//! `F` in N of pressure `P` (Pa) and length `L` (m); `g` and `c_k` (m²) depend on geometry alone ([`basis`]); `s` is +1 while the
//! muscle shortens, −1 while it lengthens. `P0` (Pa), the `E_k` (Pa) and `k_F` at every node of pressure are found together (the
//! thesis of E. G. Hocking, University of Maryland 2012, chapter 3, fits each pressure separately).
//!
//! Data flow one way; every step takes values and returns new ones:
//!
//! | step | value | file |
//! | --- | --- | --- |
//! | rows to means over short pieces of motion | `Points` | [`points`] |
//! | tested pressures, nodes of the curves | `Pressures` | [`nodes`] |
//! | which points take part | `Screen` | [`screen`], [`outliers`], [`slack`], [`reversals`] |
//! | geometry, columns, the linear problem | `Problem` | [`problem`], [`basis`], [`design`] |
//! | weight of each point | `Weights` | [`weights`] |
//! | its solution | `Solution` | [`normal_equations`], [`penalty`], [`gauss_newton`], [`solution`] |
//! | `P0` from a higher order | `Deadband` | [`deadband`] |
//! | smoothing of the curves, stress that rises with strain | `Smoothing` | [`smoothing`], [`monotonic_stress`] |
//! | effective dimensions | `Problem` | [`dimensions`], [`dimension_search`] |
//! | dimensions that held lengths require | `Solution` | [`held_lengths`] |
//! | errors as the thesis measures them | `ChunkError` | [`chunks`], [`errors`], [`midline`] |
//! | models to compare with | `Model` | [`models`] |
//! | uncertainty, and what the data do not determine | `Uncertain` | [`uncertainty`], [`identifiability`] |
//! | each pressure predicted from the others | | [`cross_validation`] |
//! | the order of all steps | | [`solve`](mod@solve), [`result`], [`summary`], [`warnings`] |

pub(crate) mod basis;
pub(crate) mod by_recording;
pub(crate) mod chunks;
mod condensed;
mod cross_validation;
mod deadband;
pub(crate) mod design;
mod dimension_search;
pub(crate) mod dimensions;
pub(crate) mod errors;
mod gauss_newton;
mod held_lengths;
pub(crate) mod identifiability;
pub(crate) mod midline;
pub(crate) mod models;
mod monotonic_stress;
pub(crate) mod nodes;
pub(crate) mod normal_equations;
mod outliers;
mod penalty;
pub(crate) mod points;
pub(crate) mod problem;
pub(crate) mod result;
mod reversals;
pub(crate) mod screen;
mod slack;
pub(crate) mod smoothing;
pub(crate) mod solution;
mod solve;
pub(crate) mod summary;
pub(crate) mod table_friction;
pub(crate) mod uncertainty;
mod warnings;
mod weights;

use model_core::table::MuscleTable;
use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::progress::{Progress, Silent};
use pam_data::recording::Campaign;

use crate::table_file::{StoredMounting, stored_mountings};

/// Options of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// `M`, the order of the elastic polynomial in strain, 1 to 6.
    pub order: usize,
    /// Whether the length `L′` between the tips of the braid replaces `L` in the force.
    pub tip_correction: bool,
    /// Weight of the penalty on the curvature of the curves over pressure, relative to the data. `None` chooses it by
    /// cross-validation over pressures.
    pub smoothing: Option<f64>,
    /// Whether braid angle, bladder diameter and wall are fitted too.
    pub fit_geometry: bool,
    /// Whether the length of each mounting is fitted too, within 1 mm.
    pub fit_lengths: bool,
    /// Whether the bladder's stress is constrained to rise with strain.
    pub physical: bool,
    /// Whether dimensions and lengths stay as described where recordings at held lengths require others; see `held_lengths`.
    pub as_described: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            order: 4,
            tip_correction: false,
            smoothing: None,
            fit_geometry: false,
            fit_lengths: false,
            physical: false,
            as_described: false,
        }
    }
}

/// Fits a muscle's table to a campaign.
///
/// # Errors
/// [`FitUnderdetermined`](crate::error::FitCode::FitUnderdetermined) where the recordings do not determine a table, and
/// [`CallInvalid`](pam_data::error::DataCode::CallInvalid) for options out of range.
pub fn fit(campaign: &Campaign, muscle: &MuscleDescription, options: &Options) -> Result<result::Fit> {
    fit_with_progress(campaign, muscle, options, &Silent)
}

/// The table of [`fit`] and its mountings, without uncertainty, errors and comparisons: for those who fit many times.
///
/// # Errors
/// As [`fit`].
pub fn table_alone(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
) -> Result<(MuscleTable, Vec<StoredMounting>)> {
    let solution = solve::solve(campaign, muscle, options, &Silent)?;
    Ok((result::table(&solution, muscle)?, stored_mountings(&solution.problem)))
}

/// [`fit`], and reports its stages. Only stages of equal steps have a remaining time.
///
/// # Errors
/// As [`fit`].
pub fn fit_with_progress(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
    progress: &dyn Progress,
) -> Result<result::Fit> {
    let solution = solve::solve(campaign, muscle, options, progress)?;
    let mut fitted = result::Fit::of(solution, campaign, muscle, options, progress)?;
    if options.physical {
        let free = Options { physical: false, ..options.clone() };
        let free = fit_with_progress(campaign, muscle, &free, progress)?.summary;
        fitted.summary.physical = Some(summary::PhysicalCost {
            free_mean_error_pct: free.mean_error_pct,
            free_max_error_pct: free.max_error_pct,
        });
    }
    Ok(fitted)
}
