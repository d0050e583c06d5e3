//! The program `host`: its commands, the live view, the demo, settings.

mod campaign;
pub mod change_watch;
pub mod cli;
pub mod commands;
pub mod console;
pub mod demo;
mod documents;
pub mod error;
mod program_name;
pub mod progress;
pub mod settings;
pub mod studio;
