//! From recordings to a muscle's table.
//!
//! ```text
//! F = (1 − s k_F(P)) [ (P − P0) g(L) + Σ_k E_k(P) c_k(L) ]
//! ```
//! `F` in N of pressure `P` (Pa) and length `L` (m); `g` and `c_k` (m²) are geometry alone and stand in [`basis`]; `s` is +1 while the
//! muscle shortens, −1 while it lengthens. `P0` (Pa), the `E_k` (Pa) and `k_F` at every node of pressure are found together (thesis of
//! E. G. Hocking, University of Maryland 2012, chapter 3, has each pressure by itself). The steps, one file each:
//!
//! | step | file |
//! | --- | --- |
//! | rows to means over short pieces of motion | [`points`] |
//! | which pressures were tested, where curves get nodes | [`nodes`] |
//! | which points may take part | [`screen`] |
//! | which readings do not belong to the rest, where the muscle is slack, where friction turns round | [`outliers`], [`slack`], [`turns`] |
//! | how much each point counts | [`weights`] |
//! | columns of the linear problem, the problem | [`basis`], [`design`] |
//! | the solution | [`normal`], [`penalty`], [`joint`], [`linear`] |
//! | `P0` by itself | [`deadband`] |
//! | how much curves may bend, stress that rises with strain | [`smoothing`], [`physical`] |
//! | effective dimensions | [`dimensions`], [`geometry`] |
//! | errors as the thesis measures them | [`chunks`], [`errors`], [`midline`] |
//! | the thesis's models side by side | [`models`] |
//! | how uncertain it all is, what is not determined | [`uncertainty`], [`determined`] |
//! | each pressure predicted from the others | [`left_out`] |
//! | all of it in order | [`prepared`], [`prepare`], [`result`], [`summary`] |
//!
//! ```
//! use pam_fit::fit::{Options, fit};
//! use pam_data::muscle_description::MuscleDescription;
//! use pam_data::recording::{Campaign, Recording};
//! use model_core::muscle::Muscle;
//! use model_core::units::{Length, Pressure};
//!
//! // Two loops at each of three pressures, of a table that is known: P0 = 76.5 kPa, k_F = 0.12, 0.08, 0.047.
//! let known = Muscle::<f64>::build(&model_core::table::example())?;
//! let recordings = [276e3, 414e3, 552e3].iter().enumerate().map(|(file, &p)| {
//!     let stroke: Vec<f64> = (0..=800).map(|i| 1.5e-3 * (1.0 - (1.0 - (i % 400) as f64 / 200.0).abs())).collect();
//!     // At a turn friction still points as on the way there: the motion that turns it round comes after.
//!     let way = |i: usize| if i == 0 || (i - 1) % 400 < 200 { 1.0 } else { -1.0 };
//!     let force = |(i, x): (usize, &f64)| known.force(Pressure::from_pascals(p), Length::from_metres(*x), way(i)).newtons();
//!     Recording {
//!         name: format!("{file}"),
//!         time: (0..=800).map(|i| 100.0 * file as f64 + 0.1 * i as f64).collect(),
//!         pressure: vec![p; 801],
//!         force: Some(stroke.iter().enumerate().map(force).collect()),
//!         stroke,
//!         ..Recording::default()
//!     }
//! });
//! let muscle = MuscleDescription::parse(
//!     "name = 'mini'\nkind = 'contractile'\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
//!      bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n",
//! )?;
//! let fitted = fit(&Campaign::new(recordings.collect()), &muscle, &Options::default())?;
//! assert!((fitted.summary.deadband_kPa - 76.5).abs() < 0.1, "P0 {} kPa", fitted.summary.deadband_kPa);
//! for (found, k_f) in fitted.summary.pressures.iter().zip([0.12, 0.08, 0.047]) {
//!     assert!((found.k_F - k_f).abs() < 0.005, "k_F {} at {} kPa", found.k_F, found.pressure_kPa);
//! }
//! // Errors of the mid-lines in percent of blocked force: data of the model itself leave next to nothing.
//! assert!(fitted.summary.mean_error_pct < 0.05, "{} %", fitted.summary.mean_error_pct);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod basis;
pub mod chunks;
pub mod deadband;
pub mod design;
pub mod determined;
pub mod dimensions;
pub mod errors;
pub mod geometry;
pub mod joint;
pub mod left_out;
pub mod linear;
pub mod midline;
pub mod models;
pub mod nodes;
pub mod normal;
pub mod outliers;
pub mod penalty;
pub mod physical;
pub mod points;
pub mod prepare;
pub mod prepared;
pub mod result;
pub mod screen;
pub mod slack;
pub mod smoothing;
pub mod summary;
pub mod turns;
pub mod uncertainty;
pub mod warnings;
pub mod weights;

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::progress::{Progress, Silent};
use pam_data::recording::Campaign;

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
/// [`pam_fit::error::FitCode::FitUnderdetermined`] where the recordings cannot give a table at all, and
/// [`pam_data::error::DataCode::CallInvalid`] for options out of range.
pub fn fit(campaign: &Campaign, muscle: &MuscleDescription, options: &Options) -> Result<result::Fit> {
    watched(campaign, muscle, options, &Silent)
}

/// The same, and tells what is being done. Only what goes by equal steps tells the time that is left.
///
/// # Errors
/// As [`fit`].
pub fn watched(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    options: &Options,
    progress: &dyn Progress,
) -> Result<result::Fit> {
    let prepared = prepared::Prepared::new(campaign, muscle, options, progress)?;
    let mut fitted = result::Fit::of(prepared, campaign, muscle, options, progress)?;
    if options.physical {
        let free = Options { physical: false, ..options.clone() };
        let free = watched(campaign, muscle, &free, progress)?.summary;
        fitted.summary.physical = Some(summary::PhysicalCost {
            free_mean_error_pct: free.mean_error_pct,
            free_max_error_pct: free.max_error_pct,
        });
    }
    Ok(fitted)
}
