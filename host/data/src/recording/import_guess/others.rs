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

/// Where the numbers of a column lie in one file.
#[derive(Clone, Copy)]
pub(super) struct Range {
    pub low: f64,
    pub high: f64,
    /// The width of the middle nine tenths: noise of a sensor makes the whole range wider with every row.
    pub width: f64,
}

impl Range {
    pub(super) fn of(column: &SampleColumn) -> Self {
        let (low, high) = column.range();
        let mut numbers: Vec<f64> = column.values().collect();
        numbers.sort_unstable_by(f64::total_cmp);
        let at =
            |share: f64| numbers.get((share * numbers.len() as f64) as usize).copied().unwrap_or(f64::NAN);
        Self { low, high, width: at(0.95) - at(0.05) }
    }
}

impl Others<'_> {
    /// The range of a column in each file that has it. Files that cannot be read are left out.
    pub(super) fn ranges(&self, header: &str) -> Vec<Range> {
        let range = |file: &PathBuf| {
            // What a pipe gives once is left for the reader.
            let sample = file.is_file().then(|| Sample::read(file, self.sheet).ok())??;
            sample.columns.iter().find(|c| c.header == header).map(Range::of)
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
