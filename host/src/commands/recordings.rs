//! The recordings of a call, and how they are read: the same options wherever recordings are taken.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};

use crate::console::Console;
use pam_data::error::{DataCode, Error, Result};
use pam_data::pluralise::pluralise;
use pam_data::progress::Progress;

use crate::progress::ProgressLine;
use pam_data::recording::{Campaign, Hashes, Import, Missing, Reader};

/// Recordings on the command line.
#[derive(Debug, Clone, Default, Args)]
pub struct Recordings {
    /// Recordings of one muscle, in chronological order; `-` is standard input.
    #[arg(required = true, value_name = "REC", value_parser = recording)]
    pub files: Vec<PathBuf>,
    /// How to read files that are not in the usual form: an import description.
    #[arg(long, value_name = "IMPORT.toml")]
    pub import: Option<PathBuf>,
    /// Take only rows where a column has this value, one of several (COLUMN=A,B), or not this value (COLUMN!=VALUE); may be given several
    /// times. Several values for one column take the rows with any of them.
    #[arg(long = "where", value_name = "COLUMN=VALUE")]
    pub filters: Vec<String>,
    /// Treatment of rows with empty cells, NaN or `---` in a column that is used [default: error, or as the import description says].
    #[arg(long, value_enum, value_name = "WHAT")]
    pub missing: Option<MissingRows>,
    /// The sheet of an Excel or OpenDocument workbook [default: the only one with contents].
    #[arg(long, value_name = "SHEET")]
    pub sheet: Option<String>,
    /// Whether filters may name values that no row has, as those of other campaigns of a history.
    #[arg(skip)]
    pub absent_values: bool,
}

/// What becomes of rows without a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MissingRows {
    /// The file is refused, with the place of the first such row.
    Error,
    /// The rows are left out, and counted in a warning.
    Skip,
}

/// A recording on the command line. Standard input is a file like any other pipe.
pub(super) fn recording(text: &str) -> std::result::Result<PathBuf, std::convert::Infallible> {
    Ok(PathBuf::from(if cfg!(unix) && text == "-" { "/dev/stdin" } else { text }))
}

/// The column and the value of a filter.
///
/// # Errors
/// A filter without `=`, or with another operator.
pub(super) fn filter(text: &str) -> Result<(String, String)> {
    /// What other programs compare with.
    const OPERATORS: [&str; 9] = ["<=", ">=", "=<", "=>", "==", "=~", "~", "<", ">"];
    let of = text.find(['=', '<', '>', '~']).map_or("", |at| &text[at..]);
    if let Some(operator) = OPERATORS.iter().find(|o| of.starts_with(**o)) {
        return Err(Error::new(DataCode::CallInvalid, format!("a filter does not compare by `{operator}`"))
            .value(text)
            .help("a filter takes values with `=` (run=8, run=8,9) or excludes them with `!=` (run!=8)"));
    }
    let (column, value) = text.split_once('=').ok_or_else(|| {
        Error::new(DataCode::CallInvalid, "a filter without `=`")
            .value(text)
            .help("write --where column=value, such as --where run=8")
    })?;
    Ok((column.trim().to_owned(), value.trim().to_owned()))
}

impl Recordings {
    /// Reads them all with a reader that knows the muscle.
    ///
    /// # Errors
    /// What is wrong with a file, or with an option.
    pub fn read(&self, reader: Reader<'_>) -> Result<Campaign> {
        let import = self.import.as_ref().map(Import::read).transpose()?;
        let mut reader = reader.import(import.as_ref());
        reader.missing = self.missing.map(|what| match what {
            MissingRows::Error => Missing::Error,
            MissingRows::Skip => Missing::Skip,
        });
        reader.sheet = self.sheet.clone();
        reader.absent_values = self.absent_values;
        for text in &self.filters {
            reader.filters.push(filter(text)?);
        }
        reader.campaign(&self.files)
    }

    /// As [`Recordings::read_watched`]; also gives the SHA-256 of each file, as it was read.
    ///
    /// # Errors
    /// As [`Recordings::read`].
    pub fn read_hashed(&self, mut reader: Reader<'_>, console: &Console) -> Result<(Campaign, Vec<String>)> {
        let hashes = Arc::new(Hashes::default());
        reader.hashes = Some(Arc::clone(&hashes));
        let campaign = self.read_watched(reader, console)?;
        Ok((campaign, hashes.of(&self.files)?))
    }

    /// As [`Recordings::read`], with a progress bar on an interactive console.
    ///
    /// # Errors
    /// As [`Recordings::read`].
    pub fn read_watched(&self, mut reader: Reader<'_>, console: &Console) -> Result<Campaign> {
        let sizes = self.files.iter().filter_map(|f| std::fs::metadata(f).ok());
        let progress = Arc::new(ProgressLine::new(console, "reading"));
        progress.total(sizes.map(|m| m.len()).sum());
        reader.progress = Some(progress);
        let campaign = self.read(reader)?;
        for recording in campaign.recordings.iter().filter(|r| r.skipped > 0) {
            let rows = pluralise(recording.skipped, "row");
            console.warning(format!("{}: {rows} without a number left out", recording.source.display()));
        }
        Ok(campaign)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_compare_by_equality_and_name_any_other_operator() {
        let pair = |column: &str, value: &str| (column.to_owned(), value.to_owned());
        assert_eq!(filter("run = 8").unwrap(), pair("run", "8"));
        assert_eq!(filter("run!=8,9").unwrap(), pair("run!", "8,9"));
        for (text, operator) in
            [("run>=1", ">="), ("run<1", "<"), ("run==1", "=="), ("run=~1", "=~"), ("run <= 2", "<=")]
        {
            let error = filter(text).unwrap_err();
            assert_eq!(error.cause(), format!("a filter does not compare by `{operator}`"));
        }
        assert!(filter("run").unwrap_err().cause().contains("without `=`"));
    }
}
