//! Model discrepancy: where recordings and model differ, which physical effect explains it, with what probability, and which experiment decides.
//!
//! ```text
//! recordings → rows → rest friction → base model, noise → forward selection → cross-validation → location → verdict
//! ```
//! [`diagnose`] is that chain; `diagnosis` reads as its summary. Every number that decides is listed in [`criteria`]; what is to be known of
//! an effect is in the effect's file ([`model_core::effects`], `pam_fit::bench`).
//!
//! | stage | module | what it does |
//! | --- | --- | --- |
//! | rows | `rows` | averages samples between reversals, with the motion in each; finds levels, blocks, vented rows |
//! | | `valve_pulses` | finds the readings that ring after the pulses of a valve; they are set aside |
//! | | `bench_checks` | corrects faults that checks of the bench measured, and enters them into the answer |
//! | | `as_read` | what a correction of the readings changes in an answer |
//! | | `preconditions` | says what can be judged |
//! | base model | `baselines` | tables free over pressure; one bladder for all pressures; one that may differ a little |
//! | | `rest_friction` | finds the law of friction at held length |
//! | | `noise` | estimates noise from repeats; tests by whole blocks |
//! | candidates | `candidates` | the library of effects as columns |
//! | | `beginnings` | the state of the muscle at the beginning of a recording |
//! | | `candidate_fit`, `candidate_scoring` | one candidate fitted beside a base; all of them scanned and refined |
//! | | `renewed_laws` | memories of the turn, seen from a base that was fitted beside them |
//! | | `likelihood` | how strongly the recordings support a candidate |
//! | selection | `forward_selection`, `selection_step` | which effects are selected, and when none is |
//! | | `free_zero` | whether a slow effect explains what a drifting zero of the load cell does not |
//! | | `cross_validation`, `confirmation` | the error on held-out rows, which a selected effect must reduce |
//! | | `known_effects` | effects that the user gives as known |
//! | findings | `findings`, `calibration` | parameters and probabilities; what could be hidden |
//! | | `intervals`, `change_point` | confidence intervals |
//! | | `location`, `spectrum`, `table_evidence` | where the error is: along coordinates, in time, in the tables |
//! | | [`history`] | what the muscle remembers over a campaign of isometric staircases, before the search |
//! | over campaigns | [`mod@reference`], [`timeline`] | what changed since a reference; quantities and change points over several campaigns |
//! | over muscles | [`mod@stock`] | what muscles of one stock share, and what each has of its own |
//! | answer | [`verdict`], [`outcome`], [`remark`], [`why`], [`verdict::WhyNot`], [`experiment`], [`refit_comparison`] | the answer as values; the report writes the sentences |
//! | | [`refitted_table`] | the table refitted beside the selected effects |
//! | | [`next_experiment`], [`isolability`], [`protocol_simulation`] | the experiment that decides; what a planned protocol can show |
//!
//! Everything is computed in a fixed order with fixed seeds: the same recordings give the same answer on any number of threads.

mod as_read;
mod baselines;
mod beginnings;
mod bench_checks;
mod calibration;
mod candidate_fit;
mod candidate_scoring;
mod candidates;
mod change_point;
mod confirmation;
pub mod criteria;
mod cross_validation;
mod description;
mod diagnosis;
pub mod experiment;
mod filtered_channels;
mod findings;
mod forward_selection;
mod free_zero;
pub mod health;
pub mod history;
mod intervals;
pub mod isolability;
mod known_effects;
mod likelihood;
mod linear;
mod location;
pub mod next_experiment;
mod noise;
mod options;
pub mod outcome;
mod paired;
mod preconditions;
pub mod protocol_simulation;
pub mod reference;
pub mod refit_comparison;
pub mod refitted_table;
pub mod remark;
mod renewed_laws;
mod resolution;
mod rest_friction;
mod rows;
mod selection_step;
mod spectrum;
pub mod stock;
mod table_evidence;
#[cfg(test)]
mod tests;
pub mod timeline;
mod valve_pulses;
pub mod verdict;
pub mod why;
mod why_not;

pub use description::diagnose_described;
pub use diagnosis::diagnose;
pub use options::Options;
pub use verdict::Diagnosis;
