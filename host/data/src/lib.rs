//! What the other libraries of the host stand on: recordings in SI units, campaigns, muscle descriptions, failures, whole files.

pub mod compare;
pub mod date;
pub mod error;
pub mod file_kind;
pub mod muscle_description;
pub mod output;
pub mod physical_limits;
pub mod pluralise;
pub mod progress;
pub mod recording;
pub mod statistics;
pub mod toml_errors;
