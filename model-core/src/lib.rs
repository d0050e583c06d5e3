//! The quasi-static force model of a pneumatic artificial muscle, its tables and its inverse.
//!
//! One source serves the host (`f64`) and a microcontroller (`f32`): no standard library, no allocation, no clock, no
//! input or output. State is a value that is handed in and out.
//!
//! | where is … | |
//! | --- | --- |
//! | length to radius, wall and strains | [`braid`] |
//! | curves over pressure | [`spline`] |
//! | what a fit finds and a file keeps | [`table`], [`image`], [`check`] |
//! | values as bytes, as a small device reads and writes them | [`mod@fields`] |
//! | force and its slope | [`muscle`] |
//! | pressure for a demanded force | [`inverse`] |
//! | which way friction points | [`motion`] |
//! | physics beyond the base model | [`effects`] |
//! | all of it as a controller calls it | [`single_precision`] |
//! | what host and controller say to each other | [`link`] |
//!
//! Force of a table, and the pressure for a force at the same stroke:
//!
//! ```
//! use model_core::inverse::Attainability;
//! use model_core::muscle::Muscle;
//! use model_core::table;
//! use model_core::units::{Length, Pressure};
//!
//! let muscle = Muscle::<f64>::build(&table::example()).expect("a valid table");
//! let (stroke, shortening) = (Length::from_metres(1e-3), 1.0);
//! let force = muscle.force(Pressure::from_kilopascals(400.0), stroke, shortening);
//!
//! let guess = Pressure::from_kilopascals(300.0);
//! let found = muscle.pressure_for(force, &muscle.at_stroke(stroke), shortening, guess, &muscle.search());
//! assert_eq!(found.attainability, Attainability::Attainable);
//! assert!((found.pressure.pascals() - 400e3).abs() < 1.0, "to within 1 Pa");
//! ```
//!
//! Source of the model: E. G. Hocking, thesis on miniature and push-type pneumatic artificial muscles, University of
//! Maryland (2012), chapters 2 and 3.

#![cfg_attr(not(test), no_std)]
#![deny(missing_docs)]

pub mod braid;
pub mod check;
pub mod effects;
pub mod fields;
pub mod firmware_image;
pub mod image;
pub mod inverse;
pub mod link;
pub mod motion;
pub mod muscle;
pub mod scalar;
pub mod single_precision;
pub mod spline;
pub mod table;
pub mod units;
