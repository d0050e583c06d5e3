//! Evaluation of fits on recordings that they did not use, and against published formulas.
//!
//! | what | where |
//! | --- | --- |
//! | cross-validation: each run, or each held length, predicted from the others | [`cross_validation`] |
//! | a muscle of another length predicted from others of its stock | [`length_transfer`] |
//! | a muscle, or a contraction of it, predicted with its stock | [`stock_transfer`] |
//! | published force formulas | [`published`] |
//!
//! ```
//! use pam_data::muscle_description::MuscleDescription;
//! use pam_evaluate::published::Published;
//!
//! // The blocked force of a 281 mm Festo muscle of 10 mm at 620 kPa, by a published formula.
//! let muscle = MuscleDescription::parse(
//!     "name = 'm'\nkind = 'contractile'\nrest_length_mm = 281.0\nbraid_angle_deg = 61.4\n\
//!      bladder_outer_diameter_mm = 10.0\nbladder_wall_mm = 1.8\nmax_contraction = 0.174\n",
//! )?;
//! let force = Published::by_name("bolen-10mm")?.force(&muscle, 620e3, 0.0);
//! assert!((force - 419.1).abs() < 0.1, "{force} N");
//! # Ok::<(), pam_data::error::Error>(())
//! ```

#![warn(unreachable_pub)]

pub mod cross_validation;
pub mod length_transfer;
pub mod published;
pub mod stock_transfer;
