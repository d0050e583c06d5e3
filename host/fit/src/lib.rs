//! Fits a muscle's force table to recordings, stores it, and predicts force from it.
//!
//! | what | where |
//! | --- | --- |
//! | recordings to a table | [`fit()`], [`Fit`], [`Options`] |
//! | the table file `*.pam` | [`table_file`] |
//! | a table as CSV, C header or MATLAB file | [`table_export`] |
//! | force predicted from a table | [`predict`] |
//! | confidence band of the force | [`confidence_band`] |
//! | corrections of sensors and frame | [`mod@bench`] |
//! | recordings of the bench without its muscle | [`checks`] |
//! | muscles of one stock, fitted together | [`stock`] |
//! | least squares, jackknife, splines, order statistics | [`numerics`] |
//!
//! It builds on `pam-data` (recordings in SI units) and `model-core` (the model's equations), and knows no report and no device.
//!
//! ```
//! use pam_fit::{Options, fit};
//! use pam_data::muscle_description::MuscleDescription;
//! use pam_data::recording::{Campaign, Recording};
//! use model_core::muscle::Muscle;
//! use model_core::units::{Length, Pressure};
//!
//! // Two loops at each of three pressures, of a known table: P0 = 76.5 kPa, k_F = 0.12, 0.08, 0.047.
//! let known = Muscle::<f64>::build(&model_core::table::example())?;
//! let recordings = [276e3, 414e3, 552e3].iter().enumerate().map(|(file, &p)| {
//!     let stroke: Vec<f64> = (0..=800).map(|i| 1.5e-3 * (1.0 - (1.0 - (i % 400) as f64 / 200.0).abs())).collect();
//!     // At a reversal friction still has the sign of the motion before it.
//!     let direction = |i: usize| if i == 0 || (i - 1) % 400 < 200 { 1.0 } else { -1.0 };
//!     let force = |(i, x): (usize, &f64)| known.force(Pressure::from_pascals(p), Length::from_metres(*x), direction(i)).newtons();
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
//! // Errors of the mid-lines in percent of the blocked force: data of the model itself leave next to none.
//! assert!(fitted.summary.mean_error_pct < 0.05, "{} %", fitted.summary.mean_error_pct);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(unreachable_pub)]

pub mod beginning;
pub mod bench;
pub mod checks;
pub mod confidence_band;
pub mod effect_columns;
pub mod error;
mod fit;
pub mod numerics;
pub mod predict;
pub mod stock;
pub mod table_export;
pub mod table_faults;
pub mod table_file;
pub mod vented_rest;

pub use fit::basis::{Columns, columns};
pub use fit::by_recording::{RecordingResidual, ResidualSums, by_recording, recording_table};
pub use fit::design::{Design, Layout, Measured};
pub use fit::dimensions::{Adjusted, Mounting};
pub use fit::errors::ChunkError;
pub use fit::identifiability::{Correlations, NotDetermined};
pub use fit::midline::{MidPoint, midline};
pub use fit::models::{Model, moduli_at_one_pressure, side_by_side};
pub use fit::nodes::{Pressures, pressures};
pub use fit::points::{HeldMounting, Point, Points, Range, points};
pub use fit::problem::Problem;
pub use fit::result::Fit;
pub use fit::screen::{Clip, Outlier, PointUse, Screen, clip};
pub use fit::smoothing::Smoothing;
pub use fit::solution::Solution;
pub use fit::summary::{AtPressure, ModelError, OutlierRow, PhysicalCost, RowUse, Summary};
pub use fit::table_friction::with_friction;
pub use fit::uncertainty::{Uncertain, table_root};
pub use fit::{Options, fit, fit_with_progress, table_alone};
