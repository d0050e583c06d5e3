//! The sub-commands, one file each: arguments in, library calls, results out.

pub mod completions;
pub mod table;
