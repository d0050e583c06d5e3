//! Recordings of muscles to tables: reading, fitting, checking, writing.

pub mod band;
pub mod bench;
pub mod checks;
pub mod cli;
pub mod commands;
pub mod compare;
pub mod console;
pub mod counted;
pub mod demo;
pub mod device;
pub mod diagnose;
pub mod emulated;
pub mod error;
pub mod file_kind;
pub mod fit;
pub mod muscle_description;
pub mod output;
pub mod possible;
pub mod predict;
pub mod progress;
pub mod recording;
pub mod report;
pub mod settings;
pub mod studio;
pub mod table_export;
pub mod table_file;
mod toml_words;
