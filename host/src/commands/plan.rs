//! `host plan`: which effects a planned protocol can identify.

use std::path::PathBuf;

use clap::Args;
use model_core::muscle::Muscle;

use crate::console::Console;
use crate::documents::{bench, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::write_whole;
use pam_diagnose::isolability::isolability;
use pam_diagnose::protocol_simulation;
use pam_fit::table_file::TableFile;

/// Arguments of `host plan`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  host plan --table mini.pam protocol.toml\n\n\
    The table is that of the muscle or of a similar one; the protocol is a file for virtual-bench.")]
pub struct Arguments {
    /// A table of the muscle, or of a similar one.
    #[arg(long, value_name = "T.pam")]
    table: PathBuf,
    /// The planned protocol.
    #[arg(value_name = "PROTOCOL.toml")]
    protocol: PathBuf,
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
        let file = TableFile::read(&self.table)?;
        let muscle = Muscle::<f64>::build(&file.table)
            .map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
        let protocol = protocol_simulation::read(&self.protocol)?;
        let rows = isolability(&protocol, &muscle).map_err(|e| e.file(&self.protocol))?;
        if let Some(path) = &self.json {
            let effects = rows.iter().map(bench::Planned::of).collect();
            let json = text(&bench::Plan { schema: "pam-plan/1", effects })?;
            write_whole(path, (json + "\n").as_bytes())?;
        }
        if self.json.as_deref() != Some(std::path::Path::new("-")) {
            console.result(format!("{:<26}{:>9}   not distinguished from (cosine)", "effect", "visible"));
            for r in &rows {
                let others: Vec<String> =
                    r.not_told_from.iter().map(|(n, c)| format!("{n} ({c:.2})")).collect();
                let seen =
                    if r.visible < 1e-5 { "no".to_owned() } else { format!("{:.2} %", 100.0 * r.visible) };
                console.result(format!("{:<26}{seen:>9}   {}", r.effect, others.join(", ")));
            }
            console.note(
                "visible: share of the effect's energy that the tables cannot absorb; cosine: similarity of two effects after the tables \
                 are refitted (1: not identifiable)",
            );
        }
        Ok(())
    }
}
