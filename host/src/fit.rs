//! From recordings to a muscle's table.
//!
//! ```text
//! F = (1 − s k_F(P)) [ (P − P0) g(L) + Σ_k E_k(P) c_k(L) ]
//! ```
//! `P0`, the `E_k` and `k_F` at every node of pressure are found together (thesis of E. G. Hocking, University of Maryland
//! 2012, chapter 3, has each pressure by itself). The steps, one file each:
//!
//! | step | file |
//! | --- | --- |
//! | rows to means over short pieces of motion | [`points`] |
//! | which pressures were tested, where curves get nodes | [`nodes`] |
//! | which points may take part | [`screen`] |
//! | columns of the linear problem | [`basis`] |
//! | the solution | [`joint`], [`linear`] |
//! | how much curves may bend | [`smoothing`] |
//! | effective dimensions | [`geometry`] |
//! | errors as the thesis measures them | [`errors`], [`midline`] |
//! | the thesis's models side by side | [`models`] |
//! | errors on what a fit did not see, published formulas | [`hold_out`], [`published`] |
//! | how uncertain it all is | [`uncertainty`] |
//! | all of it in order | [`prepare`], [`result`] |

pub mod basis;
pub mod direction;
pub mod errors;
pub mod geometry;
pub mod hold_out;
pub mod joint;
pub mod linear;
pub mod midline;
pub mod models;
pub mod nodes;
pub mod points;
pub mod prepare;
pub mod published;
pub mod result;
pub mod screen;
pub mod smoothing;
pub mod uncertainty;
pub mod warnings;

use crate::error::Result;
use crate::muscle_description::MuscleDescription;
use crate::recording::Campaign;

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// `M`, the order of the elastic polynomial, 1 to 6.
    pub order: usize,
    /// Whether `L′` replaces `L` in the forces.
    pub tip_correction: bool,
    /// Weight of the penalty on bending curves; chosen by leaving pressures out where absent.
    pub smoothing: Option<f64>,
    /// Whether effective dimensions are found too.
    pub fit_geometry: bool,
    /// Whether the length of each mounting may be corrected.
    pub fit_lengths: bool,
    /// Whether the bladder's stress must rise with strain.
    pub physical: bool,
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
        }
    }
}

/// Fits a muscle's table to a campaign.
///
/// # Errors
/// [`crate::error::Code::FitUnderdetermined`] where the recordings cannot give a table at all, and
/// [`crate::error::Code::CallInvalid`] for options out of range.
pub fn fit(campaign: &Campaign, muscle: &MuscleDescription, options: &Options) -> Result<result::Fit> {
    let prepared = prepare::Prepared::new(campaign, muscle, options)?;
    result::Fit::of(prepared, campaign, muscle, options)
}
