//! Left-out physics: where simulation and recordings differ, what is missing, how sure that is, what would tell.
//!
//! ```text
//! recordings → rows → two baselines → noise → where → which effects → joint refit → what remains → answer
//! ```
//! | file | what |
//! | --- | --- |
//! | `kinematics`, `rows` | block averages that keep turns, with the motion in each |
//! | `baselines` | tables free over pressure, one bladder for all pressures, and one that may differ a little |
//! | `rest` | what friction does while the length is held |
//! | `noise` | what repeats tell; tests by whole blocks |
//! | `known` | what checks of the bench measured is taken out first |
//! | `locate`, `frequency` | where the misfit sits; whether it beats in time |
//! | `evidence` | how strongly the recordings speak for an effect |
//! | `candidates` | the library of effects as columns |
//! | `select` | which effects, and when to abstain |
//! | `given` | effects that the user knows to be there |
//! | `named`, `calibration` | names with their parameters and probabilities; what could be hidden |
//! | `intervals` | how sure the parameters are |
//! | `held_out` | the improvement on rows that the fit had not seen |
//! | [`model`] | the table refitted beside the named effects |
//! | [`advise`], [`planned`] | the recording that would tell; what a planned protocol can tell |
//! | [`verdict`] | the answer as values and JSON |
//! | [`summary`] | the answer in words |
//!
//! Everything is computed in a fixed order with fixed seeds: the same recordings give the same answer on any number of threads.

pub mod advise;
mod answer;
mod baselines;
mod calibration;
mod candidates;
mod confirm;
mod evidence;
mod frequency;
mod given;
mod ground;
mod held_out;
mod intervals;
mod judgeable;
mod kinematics;
mod known;
mod linear;
mod locate;
pub mod model;
mod moment;
mod named;
mod noise;
pub mod planned;
pub mod reference;
mod rest;
mod rows;
mod search;
mod select;
pub mod summary;
mod tables;
#[cfg(test)]
mod tests;
mod trial;
pub mod verdict;

pub use answer::{Options, diagnose};
pub use verdict::Diagnosis;
