//! An import description by looking at a file: what separates its cells, where its rows begin, which column is what, where its runs are.
//!
//! Names are compared with a table of synonyms, units with a table of spellings; values only supply what a name does not say, and each
//! such choice is listed for the user to check. What cannot be known, such as the calibration of a load cell in volts, is left out.
//!
//! ```
//! use pam_data::recording::import_guess::guess;
//! use pam_data::recording::{Import, Reader};
//!
//! let rows: String = (0..20).map(|i| format!("{},{:02};3,5;{},1;40,{}\n", i / 10, i % 10 * 10, i, 10 + i)).collect();
//! let file = tempfile::NamedTempFile::with_suffix(".csv")?;
//! std::fs::write(&file, format!("Zeit [s];Druck [bar];Weg [mm];Kraft [N]\n{rows}"))?;
//! let guessed = guess(file.path(), None)?;
//! let import = Import::parse(&guessed.description)?;
//! let recording = &Reader::new().import(Some(&import)).file(file.path())?[0];
//! assert_eq!((recording.pressure[0], recording.len()), (350e3, 20));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod absolute;
mod constant_pressure;
mod file_name_length;
mod forms;
mod joined_time;
mod layout;
mod lookup;
mod names;
mod notes;
mod others;
mod problems;
mod roles;
mod runs;
mod sample;
mod side_by_side;
mod stroke;
mod text;
mod time;
mod values;

use std::path::{Path, PathBuf};

use super::quantity::Quantity;
use crate::error::Result;
use lookup::Listed;
pub use notes::Note;
use others::Others;
use sample::Sample;

/// Where a column of a description is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// In the file, by its number, counted from 1.
    Number(usize),
    /// In the file, by its name.
    Named(String),
    /// In the table beside the file that lists its runs.
    Listed(String),
}

/// One column that was understood.
#[derive(Debug, Clone, PartialEq)]
pub struct GuessedColumn {
    /// What it is.
    pub quantity: Quantity,
    /// Where it is.
    pub source: Source,
    /// What the file calls it.
    pub header: String,
    /// The unit after scale and offset.
    pub unit: &'static str,
    /// Value in `unit` = cell · scale + offset.
    pub scale: f64,
    /// See `scale`.
    pub offset: f64,
    /// Whether it grows as the muscle gets longer.
    pub extension: bool,
    /// Whether the stroke counts from the greatest length.
    pub from_longest: bool,
    /// Words with their direction.
    pub values: Vec<(String, i8)>,
    /// Of a time of day, the column of the dates.
    pub date: Option<Source>,
    /// Of a time, the column of the parts of a second that it lacks, and their unit.
    pub fraction: Option<(Source, &'static str)>,
    /// The least and the greatest cell.
    pub range: Option<(f64, f64)>,
}

/// A constant that a regular expression takes from a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GuessedPattern {
    /// What it is.
    pub quantity: Quantity,
    /// The text, as the description calls it: `file_name` or `preamble`.
    pub text: &'static str,
    /// The expression.
    pub expression: String,
}

/// What a file seems to be.
#[derive(Debug, Clone, Default)]
pub struct Guess {
    /// The file's name.
    pub file: String,
    /// Rows that were read, and whether these are all.
    pub rows: usize,
    /// See `rows`.
    pub whole: bool,
    /// The sheet of a workbook.
    pub sheet: Option<String>,
    /// Lines before the header, or before the first row where the header is not used.
    pub skip_lines: usize,
    /// Whether the description uses the header's names.
    pub header: bool,
    /// `comma`, `tab`, `semicolon`, `space` or a character; none for files of named columns.
    pub delimiter: Option<String>,
    /// Whether decimals are written with a comma.
    pub decimal_comma: bool,
    /// What lines of remarks begin with.
    pub remarks: Option<char>,
    /// What separates thousands.
    pub thousands: Option<char>,
    /// Whether rows without a number in a column that is used are left out.
    pub skip_missing: bool,
    /// Seconds between rows, where the lines above the table say it and no column is the time.
    pub sample_interval_s: Option<f64>,
    /// Constants that are taken from the file's name or from the lines above the table.
    pub patterns: Vec<GuessedPattern>,
    /// Columns that set runs apart.
    pub split_by: Vec<String>,
    /// Whether a run begins where the time goes back.
    pub new_run_by_clock: bool,
    /// How many recordings are side by side, and how many columns are from one to the next.
    pub side_by_side: Option<(usize, usize)>,
    /// Columns that were understood.
    pub columns: Vec<GuessedColumn>,
    /// A filter for the rows of one muscle.
    pub filters: Vec<(String, String)>,
    /// Columns that are not used.
    pub unused: Vec<String>,
    /// What could not be understood.
    pub unknown: Vec<Note>,
    /// What the user has to check.
    pub checks: Vec<Note>,
    /// The import description.
    pub description: String,
    lookup: Option<Listed>,
}

impl Guess {
    /// The table beside the file that says how long the muscle was.
    #[must_use]
    pub fn list_of_runs(&self) -> Option<&str> {
        self.lookup.as_ref().map(|l| l.file.as_str())
    }

    /// Whether the description says no more than names and units: signs, zeros, offsets, runs and constants are as they are without it.
    #[must_use]
    pub fn only_names(&self) -> bool {
        let plain = |c: &GuessedColumn| {
            let scaled = c.scale != 1.0 || c.offset != 0.0;
            !(scaled || c.extension || c.from_longest || !c.values.is_empty())
        };
        let one = !self.new_run_by_clock && self.side_by_side.is_none() && self.sample_interval_s.is_none();
        let whole = one && self.split_by.is_empty() && self.patterns.is_empty() && self.filters.is_empty();
        whole && self.lookup.is_none() && self.columns.iter().all(plain)
    }

    /// All that could not be understood, in one line.
    #[must_use]
    pub fn all_unknown(&self) -> String {
        self.unknown.iter().map(Note::text).collect::<Vec<_>>().join("; ")
    }

    /// Whether a quantity was found.
    #[must_use]
    pub fn has(&self, quantity: Quantity) -> bool {
        self.columns.iter().any(|c| c.quantity == quantity)
    }
}

/// Whether a column's name says that it is this quantity.
pub(super) fn is_reading_of(name: &str, quantity: Quantity) -> bool {
    names::Name::of(name).quantity().is_some_and(|(named, _)| named == quantity)
}

/// Looks at a file and describes it.
///
/// # Errors
/// A file that cannot be read, or that holds no table.
pub fn guess(path: &Path, sheet: Option<&str>) -> Result<Guess> {
    guess_among(path, &[], sheet)
}

/// Looks at a file and describes it. Other files of the same bench show whether a length was held in each of them,
/// and their names may say which one.
///
/// # Errors
/// A file that cannot be read, or that holds no table; others whose columns have other places or units, where nothing else would notice
/// it. Others that cannot be read are left out.
pub fn guess_among(path: &Path, others: &[PathBuf], sheet: Option<&str>) -> Result<Guess> {
    let sample = Sample::read(path, sheet).map_err(|e| e.file(path))?;
    let mut guess = roles::assign(path, &sample, &Others::of(others, sheet)).map_err(|e| e.file(path))?;
    guess.description = text::description(&guess);
    Ok(guess)
}
