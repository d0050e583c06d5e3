//! Which effects a planned protocol shows, and which of them it does not distinguish.

use std::path::Path;

use model_core::muscle::Muscle;

use crate::console::Console;
use crate::documents::{bench, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::write_whole;
use pam_diagnose::isolability::isolability;
use pam_diagnose::protocol_simulation;
use pam_fit::table_file::TableFile;

pub(super) fn run(table: &Path, file: &Path, json: Option<&Path>, console: &Console) -> Result<()> {
    let table = TableFile::read(table)?;
    let muscle =
        Muscle::<f64>::build(&table.table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    let protocol = protocol_simulation::read(file)?;
    let rows = isolability(&protocol, &muscle).map_err(|e| e.file(file))?;
    if let Some(path) = json {
        let effects = rows.iter().map(bench::EffectVisibility::of).collect();
        let json = text(&bench::Plan { schema: "pam-plan/1", effects })?;
        write_whole(path, (json + "\n").as_bytes())?;
    }
    if json != Some(Path::new("-")) {
        console.result(format!("{:<26}{:>9}   not distinguished from (cosine)", "effect", "visible"));
        for r in &rows {
            let others: Vec<String> =
                r.confounded_with.iter().map(|(n, c)| format!("{n} ({c:.2})")).collect();
            let seen = if r.visible < 1e-5 { "no".to_owned() } else { format!("{:.2} %", 100.0 * r.visible) };
            console.result(format!("{:<26}{seen:>9}   {}", r.effect, others.join(", ")));
        }
        console.note(
            "visible: share of the effect's energy that the tables cannot absorb; cosine: similarity of two effects after the tables \
             are refitted (1: not identifiable)",
        );
    }
    Ok(())
}
