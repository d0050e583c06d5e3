//! The other files of the same bench: they may show what is uncertain from one file.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use super::sample::{Sample, SampleColumn};

/// Files that are read.
const COMPARED: usize = 30;

/// Files beside the first.
pub(super) struct Others<'a> {
    pub files: &'a [PathBuf],
    /// The sheet of workbooks.
    sheet: Option<&'a str>,
    seen: OnceCell<Vec<Seen>>,
}

/// What a file holds.
struct Seen {
    file: String,
    headers: Vec<String>,
    /// The units of a row of their own below the names.
    units: Option<Vec<String>>,
    /// Whether lines begin with a number sign.
    remarks: bool,
    /// Of each column of numbers.
    ranges: Vec<(String, Range)>,
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

impl<'a> Others<'a> {
    /// These files beside the first; they are read once, when something needs their contents.
    pub(super) fn of(files: &'a [PathBuf], sheet: Option<&'a str>) -> Self {
        Self { files, sheet, seen: OnceCell::new() }
    }

    /// The files that can be read.
    fn seen(&self) -> &[Seen] {
        let of_file = |file: &PathBuf| -> Option<Seen> {
            // What a pipe gives once is left for the reader.
            let sample = file.is_file().then(|| Sample::read(file, self.sheet).ok())??;
            let numeric = sample.columns.iter().filter(|c| c.is_numeric());
            Some(Seen {
                file: file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
                headers: sample.columns.iter().map(|c| c.header.clone()).collect(),
                units: sample.layout.as_ref().and_then(|l| l.units.clone()),
                remarks: sample.layout.as_ref().is_some_and(|l| l.remarks),
                ranges: numeric.map(|c| (c.header.clone(), Range::of(c))).collect(),
            })
        };
        self.seen.get_or_init(|| self.files.iter().take(COMPARED).filter_map(of_file).collect())
    }

    /// The range of a column in each file that has it. Files that cannot be read are left out.
    pub(super) fn ranges(&self, header: &str) -> Vec<Range> {
        let one = |file: &Seen| file.ranges.iter().find(|(h, _)| h == header).map(|(_, range)| *range);
        self.seen().iter().filter_map(one).collect()
    }

    /// The files in which one of these columns, by its index, has another name or another unit below its name than in the first.
    pub(super) fn with_other_columns(&self, first: &Sample, columns: &[usize]) -> Vec<&str> {
        let own = first.layout.as_ref().and_then(|l| l.units.as_ref());
        let unit =
            |units: Option<&Vec<String>>, n: usize| units.and_then(|u| u.get(n)).cloned().unwrap_or_default();
        let differs = |file: &&Seen| {
            columns.iter().any(|n| {
                file.headers.get(*n) != first.columns.get(*n).map(|c| &c.header)
                    || unit(file.units.as_ref(), *n) != unit(own, *n)
            })
        };
        self.seen().iter().filter(differs).map(|file| file.file.as_str()).collect()
    }

    /// Whether one of them has lines that begin with a number sign.
    pub(super) fn have_remarks(&self) -> bool {
        self.seen().iter().any(|file| file.remarks)
    }

    /// Their names without folders.
    pub(super) fn names(&self) -> impl Iterator<Item = String> {
        self.files
            .iter()
            .filter_map(|file| Path::file_name(file))
            .map(|name| name.to_string_lossy().into_owned())
    }
}
