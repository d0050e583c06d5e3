//! The other files of the same bench: they may show what is uncertain from one file.

use std::path::{Path, PathBuf};

use super::sample::{Sample, SampleColumn};

/// Files that are looked at.
const COMPARED: usize = 30;

/// Files beside the first.
pub(super) struct Others<'a> {
    pub files: &'a [PathBuf],
    /// The sheet of workbooks.
    pub sheet: Option<&'a str>,
}

impl Others<'_> {
    /// The least and the greatest number of a column in each file that has it. Files that cannot be read are left out.
    pub(super) fn ranges(&self, header: &str) -> Vec<(f64, f64)> {
        let range = |file: &PathBuf| {
            // What a pipe gives once is left for the reader.
            let sample = file.is_file().then(|| Sample::read(file, self.sheet).ok())??;
            sample.columns.iter().find(|c| c.header == header).map(SampleColumn::range)
        };
        self.files.iter().take(COMPARED).filter_map(range).collect()
    }

    /// Their names without folders.
    pub(super) fn names(&self) -> impl Iterator<Item = String> {
        self.files
            .iter()
            .filter_map(|file| Path::file_name(file))
            .map(|name| name.to_string_lossy().into_owned())
    }
}
