//! What a running actuator is compared with: earlier recordings, or its table.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use super::{ChangeWatch, Update};
use crate::commands::diagnose;
use crate::commands::recordings::Recordings;
use crate::console::Console;
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_diagnose::reference::{Against, Mounted};
use pam_fit::table_file::TableFile;
use pam_report::wording::change as wording;

/// Earlier recordings, or a table with its path.
#[derive(Debug)]
pub enum Reference {
    /// Earlier recordings.
    Recordings(Campaign),
    /// A table, with its path.
    Table(Box<TableFile>, String),
}

impl Reference {
    /// Reads recordings, the recordings of a folder, or one table.
    ///
    /// # Errors
    /// Files that cannot be read, a folder without recordings, a table among other files.
    pub fn read(files: &[PathBuf], import: Option<&PathBuf>, console: &Console) -> Result<Self> {
        let table = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("pam"));
        let files = match files {
            [one] if table(one) => {
                return Ok(Self::Table(Box::new(TableFile::read(one)?), one.display().to_string()));
            }
            [folder] if folder.is_dir() => in_folder(folder)?,
            many => many.to_vec(),
        };
        if files.iter().any(|f| table(f)) {
            return Err(Error::new(DataCode::CallInvalid, "a table among several references")
                .help("give --reference either one table (.pam) or recordings"));
        }
        let recordings = Recordings { files, import: import.cloned(), ..Recordings::default() };
        Ok(Self::Recordings(diagnose::reference::read(&recordings, None, console)?))
    }

    pub(super) fn against(&self) -> Against<'_> {
        match self {
            Self::Recordings(campaign) => Against::Recordings(campaign),
            Self::Table(table, path) => Against::Table(table, path),
        }
    }
}

/// The recordings of a folder, by name.
fn in_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let listed = std::fs::read_dir(folder).map_err(|e| Error::unreadable(folder, &e))?;
    let mut files: Vec<PathBuf> = listed
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| {
            p.extension().is_some_and(|e| ["csv", "tsv", "mcap"].iter().any(|k| e.eq_ignore_ascii_case(k)))
        })
        .collect();
    files.sort();
    // A recording in both forms is one recording.
    let all = files.clone();
    files.retain(|f| f.extension().is_none_or(|e| e != "mcap") || !all.contains(&f.with_extension("csv")));
    if files.is_empty() {
        return Err(Error::new(DataCode::RecordingEmpty, "the folder has no recordings (.csv, .tsv, .mcap)")
            .file(folder));
    }
    Ok(files)
}

/// Options of commands that watch a controller.
#[derive(Debug, Clone, Default, Args)]
pub struct ReferenceOptions {
    /// Say while it runs what has changed since these earlier recordings of the same actuator (files, or a folder of them), or since one
    /// table (.pam). The first answer comes after 25 s of motion under pressure.
    #[arg(long, value_name = "REF", num_args = 1.., help_heading = "Comparison")]
    reference: Vec<PathBuf>,
    /// How to read a reference that is not in the usual form: an import description.
    #[arg(long, value_name = "IMPORT.toml", requires = "reference", help_heading = "Comparison")]
    reference_import: Option<PathBuf>,
    /// The actuator was taken off and remounted since the reference: a shift of the length by 1 mm is not a change.
    #[arg(long, requires = "reference", help_heading = "Comparison")]
    remounted: bool,
}

impl ReferenceOptions {
    /// Begins to watch, where a reference is given.
    ///
    /// # Errors
    /// A reference that cannot be read.
    pub fn start(&self, console: &Console) -> Result<Option<ChangeWatch>> {
        if self.reference.is_empty() {
            return Ok(None);
        }
        let reference = Reference::read(&self.reference, self.reference_import.as_ref(), console)?;
        let mounted = if self.remounted { Mounted::Anew } else { Mounted::Same };
        ChangeWatch::start(Arc::new(reference), mounted).map(Some)
    }
}

/// Prints what is new, where the words differ from the last ones.
pub fn tell(watch: Option<&ChangeWatch>, last: &mut String, console: &Console) {
    let Some(update) = watch.and_then(ChangeWatch::news) else { return };
    let names = match &update {
        Update::Waiting(why) => why.clone(),
        Update::Answer(report) => wording::headline(report),
    };
    if names != *last {
        console.note(update.description());
        *last = names;
    }
}

/// The last answer, and its document.
pub fn finish(watch: Option<ChangeWatch>) -> Option<(String, serde_json::Value)> {
    let update = watch?.finish()?;
    Some(match &update {
        Update::Waiting(_) => (update.description(), serde_json::Value::Null),
        Update::Answer(report) => {
            let document = serde_json::from_str(&pam_report::document::change_json(report));
            (wording::summary(report), document.unwrap_or_default())
        }
    })
}
