//! A test campaign that chooses its own steps: what to record next, whether it is good, when it is enough.
//!
//! | question | module |
//! | --- | --- |
//! | what can the rig do | [`rig`], [`menu`], [`step`], `step_profile` |
//! | what is known of the muscle's range | [`places`] |
//! | how much is a step expected to inform | `information` |
//! | what to do next, and when to stop | [`engine`] |
//! | what the operator does | [`instructions`], [`prompt`] |
//! | is the recording good | [`watch`] |
//! | who carries it out | [`actuation`]: [`mod@bench`], [`controller`] |
//! | what was done, also after an interruption | [`journal`], [`campaign`] |
//!
//! ```
//! use pam_campaign::{bench::VirtualBench, campaign, engine::{Engine, Purpose}, rig::Rig};
//! use pam_data::muscle_description::MuscleDescription;
//! use virtual_bench::{bench::BenchSpec, presets};
//!
//! let spec = BenchSpec::laboratory(presets::miniature(), 1);
//! let muscle = MuscleDescription::parse(&spec.muscle.description())?;
//! // Three minutes: the first steps of every campaign.
//! let mut engine = Engine::new(muscle, Rig::commanded(), Purpose::Fit, 180.0)?;
//! let steps = campaign::simulate(&mut engine, &mut VirtualBench::new(&spec), None)?;
//! assert!(steps.iter().any(|s| s.rows > 100));
//! # Ok::<(), pam_data::error::Error>(())
//! ```

pub mod actuation;
pub mod analysis;
pub mod bench;
pub mod campaign;
mod columns;
pub mod controller;
mod criteria;
pub mod engine;
mod hypothesis;
mod information;
pub mod instructions;
pub mod journal;
mod left_over;
pub mod menu;
pub mod places;
pub mod prompt;
mod purpose;
pub mod rig;
pub mod step;
mod step_profile;
pub mod stroke_axis;
pub mod watch;
mod wording;

pub use criteria::target_error;
