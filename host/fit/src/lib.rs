//! From recordings to a muscle's table, and from a table to forces.

pub mod bench;
pub mod checks;
pub mod confidence_band;
pub mod error;
pub mod fit;
pub mod predict;
pub mod table_export;
pub mod table_file;
