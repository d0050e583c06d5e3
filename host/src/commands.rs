//! The sub-commands, one file each: arguments in, library calls, results out.

pub mod batch;
pub mod compare;
pub mod completions;
pub mod demo;
pub mod device;
pub mod diagnose;
pub mod effects;
pub mod emulate;
pub mod evaluate;
pub mod fit;
pub mod flash;
pub mod fleet;
pub mod history;
pub mod man;
pub mod new;
pub mod plan;
pub mod port;
pub mod predict;
pub mod record;
pub mod recordings;
pub mod reports;
pub mod run;
pub mod settings;
pub mod stock;
pub mod studio;
pub mod table;
