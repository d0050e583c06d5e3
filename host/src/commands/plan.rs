//! `host plan`: which recordings to make next, and what a planned protocol can distinguish.

mod next;
mod protocol;

use std::path::PathBuf;

use clap::Args;

use super::campaign::For;
use super::recording_files::positive;
use crate::console::Console;
use pam_data::error::{DataCode, Error, Result};

/// Arguments of `host plan`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Examples:\n  \
    host plan --muscle mini.toml -o plan\n  \
    host plan --muscle mini.toml loops/*.csv -o plan --for diagnosis\n  \
    host plan --table mini.pam protocol.toml\n\n\
    With --muscle the plan continues the recordings: each step is the one with the most expected information per second after those before \
    it, as in `host campaign`. The folder receives plan.md with instructions for the operator, and one protocol file for each step, \
    which `virtual-bench record --protocol` runs. The same data give the same plan.\n\n\
    With --table the command judges a protocol: which effects it shows, and which of them it does not distinguish.")]
pub struct Arguments {
    /// The muscle's description: plan the next recordings.
    #[arg(long, value_name = "M.toml", required_unless_present = "table", conflicts_with = "table")]
    muscle: Option<PathBuf>,
    /// A table of the muscle, or of a similar one: judge a protocol.
    #[arg(long, value_name = "T.pam")]
    table: Option<PathBuf>,
    /// Recordings that exist, in chronological order; with --table the planned protocol.
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Folder for the plan; it must be new or empty, or hold an earlier plan.
    #[arg(short, long, value_name = "FOLDER", conflicts_with = "table")]
    output: Option<PathBuf>,
    /// What the recordings are for.
    #[arg(long = "for", value_enum, value_name = "PURPOSE", default_value_t = For::Both, conflicts_with = "table")]
    purpose: For,
    /// Steps at most, not counting the tare at the end.
    #[arg(long, value_name = "N", default_value_t = 5, conflicts_with = "table")]
    steps: u16,
    /// Bench time of all steps at most, min.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 30.0,
        allow_negative_numbers = true,
        conflicts_with = "table"
    )]
    minutes: f64,
    /// What the rig can do. By default it moves the muscle at a speed of choice, and checks of the bench can be made.
    #[arg(long, value_name = "rig.toml", conflicts_with = "table")]
    rig: Option<PathBuf>,
    /// A check of the bench that was made already. May be given more than once.
    #[arg(long, value_name = "CHECK.csv", conflicts_with = "table")]
    check: Vec<PathBuf>,
    /// How to read files that are not in the usual form: an import description.
    #[arg(long, value_name = "IMPORT.toml", conflicts_with = "table")]
    import: Option<PathBuf>,
    /// Write the result as JSON to a file; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    /// Files that cannot be read, or a protocol that cannot be carried out.
    pub fn run(self, console: &Console) -> Result<()> {
        positive([("--minutes", Some(self.minutes))])?;
        match (&self.table, self.files.as_slice()) {
            (None, _) => next::run(&self, console),
            (Some(table), [file]) => protocol::run(table, file, self.json.as_deref(), console),
            (Some(_), _) => {
                Err(Error::new(DataCode::CallInvalid, "with --table the command judges one protocol")
                    .help("give one protocol file, or plan recordings with --muscle M.toml"))
            }
        }
    }
}
