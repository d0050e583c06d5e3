//! Files of other formats by description: a small TOML file, written once per bench.
//!
//! ```toml
//! skip_lines = 5                    # lines before the header, or before the first row
//! header = false                    # then columns are named by their number, from 1
//! delimiter = "tab"                 # "comma", "tab", "semicolon", "space" (runs of blanks) or one character
//! comment = "#"                     # lines that begin so are skipped
//! thousands = "."                   # what separates thousands: "," "." " " or "'"; nothing unless said otherwise
//! decimal = "comma"                 # how decimals are written; "point" unless said otherwise
//! missing = "skip"                  # leave out rows with empty cells or NaN; "error" unless said otherwise
//! sheet = "Run 1"                   # of a workbook; the only one with contents unless said otherwise
//! sample_interval_s = 0.01          # when there is no column of time
//! file_name = '(?<pressure_kPa>[0-9.]+)kPa'   # regular expression; what its named groups catch is constant per file
//! preamble = 'pressure: (?<pressure_psi>[0-9.]+)' # the same for the skipped lines
//! split_by = ["run"]                # one recording per value
//! new_run = "clock"                 # a recording begins where the time goes back
//!
//! [columns.displacement]            # time, pressure, displacement, length, contraction, force, temperature,
//! column = 2                        # pressure_command, cycle, direction, rest_length
//! unit = "in"                       # of a time also "timestamp", "timestamp-month-first", "timestamp-day-first": 2026-11-21T13:30:00.25, 21.11.2026 13:30:00, or 13:30:00.25
//! scale = 1.0                       # value in `unit` = cell · scale + offset
//! offset = 0.0
//! positive = "extension"            # or "contraction"
//! zero = "longest"                  # stroke 0 is at the greatest length; or "first", "largest-force", or a number
//!
//! [columns.time]
//! column = "Time"
//! unit = "timestamp"
//! date = "Date"                     # dates in a column beside times of day
//! fraction = { column = "Milliseconds", unit = "ms" }   # parts of the second in a column beside: "s", "ms", "us", "ns"
//!
//! [columns.direction]
//! column = "phase"
//! values = { up = 1, down = -1 }    # text to number, for any quantity
//!
//! [constants]
//! pressure_kPa = 207
//!
//! [where]
//! rest_length_mm = "{rest_length_mm}"   # the muscle's own; also "{name}"; or plain text or a number
//! run = [8, 9]                          # one of several
//! condition = { not = "Kinked69mm" }    # everything else
//!
//! [lookup]                          # a table beside the file; its columns can be used like the file's own
//! file = "runs.csv"
//! match = { file = "{file}", run = "run" }   # column of the table = column of the file
//!
//! [side_by_side]                    # recordings beside each other, with columns by number
//! recordings = 2
//! columns = 5                       # columns from one to the next
//!
//! [grid]                            # a static map: a row for each pressure, a column of force for each length
//! columns = 'F_(?<length_mm>[0-9.]+)mm'  # headings of its columns; what the named groups catch goes with the column
//! values = "force_N"                # what its cells are
//! ```
//!
//! A quantity that is not described is looked for in the header under its usual name.

mod column;
mod side_by_side;
mod value;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::quantity::{Quantity, Unit};
use super::thousands::SEPARATORS;
use crate::error::{DataCode, Error, Result, nearest};
use crate::file_kind::FileKind;
use crate::toml_errors::toml_error;

pub use column::{Column, ColumnRef, FoundZero, Fraction, Positive, Zero};
pub(super) use column::{FRACTIONS, time_stamp_unit};
pub use side_by_side::SideBySide;
pub use value::Value;

/// A table beside the recording, such as a list of runs with their geometry.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lookup {
    /// Path relative to the recording's folder.
    pub file: String,
    /// Column of the table = column of the recording, or `{file}` for the recording's file name.
    #[serde(rename = "match")]
    pub keys: BTreeMap<String, String>,
}

/// A static map: a row for each pressure, a column of force for each length. Each column is read as a recording.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// A regular expression for the headings of its columns. What its named groups catch goes with the column.
    pub columns: String,
    /// What its cells are: a name with its unit.
    pub values: String,
}

/// Where a recording begins, beside a change of the columns in `split_by`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NewRun {
    /// Where the time goes back.
    Clock,
}

/// How decimals are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Decimal {
    /// With a point: `12.5`.
    #[default]
    Point,
    /// With a comma: `12,5`.
    Comma,
}

/// What becomes of a row without a number in a column that is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Missing {
    /// The file is refused, with the place of the first such row.
    #[default]
    Error,
    /// The row is left out, and counted.
    Skip,
}

/// An import description.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Import {
    /// What this describes, for the reader of the file.
    pub description: Option<String>,
    /// Lines to skip before the header, or before the first row when there is none.
    #[serde(default)]
    pub skip_lines: usize,
    /// Whether a header names the columns; yes unless said otherwise.
    pub header: Option<bool>,
    /// `comma`, `tab`, `semicolon`, `space` or one character; found out by default.
    pub delimiter: Option<String>,
    /// Lines that begin so are skipped.
    pub comment: Option<char>,
    /// How decimals are written.
    #[serde(default)]
    pub decimal: Decimal,
    /// What separates thousands: `,`, `.`, a blank or an apostrophe; nothing by default.
    pub thousands: Option<char>,
    /// What becomes of rows with empty cells, NaN or `---` in a column that is used.
    #[serde(default)]
    pub missing: Missing,
    /// The sheet of a workbook; the only one with contents by default.
    pub sheet: Option<String>,
    /// Seconds between rows, when no column gives the time.
    pub sample_interval_s: Option<f64>,
    /// A regular expression for the file's name.
    pub file_name: Option<String>,
    /// A regular expression for the skipped lines.
    pub preamble: Option<String>,
    /// Columns whose values set recordings apart.
    #[serde(default)]
    pub split_by: Vec<String>,
    /// Where a recording begins beside that.
    pub new_run: Option<NewRun>,
    /// Recordings beside each other.
    pub side_by_side: Option<SideBySide>,
    /// By quantity.
    #[serde(default)]
    pub columns: BTreeMap<String, Column>,
    /// By header name with unit.
    #[serde(default)]
    pub constants: BTreeMap<String, f64>,
    /// Rows to keep: all of these must hold.
    #[serde(default, rename = "where")]
    pub filters: BTreeMap<String, Value>,
    /// A table beside the file.
    pub lookup: Option<Lookup>,
    /// A static map in place of a table over time.
    pub grid: Option<Grid>,
}

impl Import {
    /// Reads and checks a description.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`] or [`DataCode::ImportInvalid`] with the line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = FileKind::Import.read_text(path)?;
        Self::parse(&text).map_err(|e| FileKind::Import.wanted(path, e))
    }

    /// Parses and checks the text of a description.
    ///
    /// # Errors
    /// [`DataCode::ImportInvalid`] with the line.
    pub fn parse(text: &str) -> Result<Self> {
        let import: Self = toml::from_str(text).map_err(|e| toml_error(DataCode::ImportInvalid, text, &e))?;
        import.check()?;
        Ok(import)
    }

    fn check(&self) -> Result<()> {
        let invalid = |cause: String| Error::new(DataCode::ImportInvalid, cause);
        for (name, column) in &self.columns {
            let quantity = self::quantity(name)?;
            if std::iter::once(&column.column).chain(column.further()).any(|c| *c == ColumnRef::Number(0)) {
                return Err(invalid("columns are counted from 1".into()).column(name));
            }
            if !(column.scale.is_finite() && column.scale != 0.0 && column.offset.is_finite()) {
                return Err(
                    invalid("scale must be a number other than 0, and offset a number".into()).column(name)
                );
            }
            if let Some(unit) = &column.unit
                && quantity.unit(unit).is_none()
                && column.stamp(quantity).is_none()
            {
                return Err(invalid(format!("{name} has no unit `{unit}`"))
                    .column(name)
                    .help(format!("use {}, with scale and offset for anything else", quantity.unit_list())));
            }
            self::check_parts(quantity, column).map_err(|e| e.column(name))?;
            let arbitrary = column.positive.is_some() || column.zero.is_some();
            if arbitrary && quantity != Quantity::Displacement {
                return Err(invalid("`positive` and `zero` are for displacements".into()).column(name));
            }
            if matches!(column.zero, Some(Zero::At(at)) if !at.is_finite()) {
                return Err(invalid("zero must be a number".into()).column(name));
            }
        }
        for (name, value) in &self.constants {
            constant(name)?;
            if !value.is_finite() {
                return Err(invalid("a constant must be a number".into()).column(name));
            }
        }
        if let Some(interval) = self.sample_interval_s
            && !(interval > 0.0 && interval.is_finite())
        {
            return Err(invalid("sample_interval_s must be a positive number".into()));
        }
        if self.comment.is_some_and(|c| !c.is_ascii()) {
            return Err(invalid("comment must be one plain character".into()));
        }
        pattern("file_name", self.file_name.as_deref())?;
        pattern("preamble", self.preamble.as_deref())?;
        pattern("grid.columns", self.grid.as_ref().map(|g| g.columns.as_str()))?;
        self.delimiter()?;
        self.thousands()?;
        self.check_side_by_side()
    }

    /// What separates thousands.
    pub(super) fn thousands(&self) -> Result<Option<u8>> {
        let Some(separator) = self.thousands else { return Ok(None) };
        let decimal = if self.decimal == Decimal::Comma { ',' } else { '.' };
        let known = SEPARATORS.iter().find(|s| char::from(**s) == separator && separator != decimal);
        known.map(|s| Some(*s)).ok_or_else(|| {
            Error::new(DataCode::ImportInvalid, "this cannot separate thousands")
                .column("thousands")
                .value(separator.to_string())
                .help("use \",\", \".\", \" \" or \"'\", and not the decimal sign")
        })
    }

    /// The character that begins a remark; `None` for one that is not a single byte.
    pub(super) fn comment_byte(&self) -> Option<u8> {
        self.comment.and_then(|c| u8::try_from(c).ok())
    }

    pub(super) fn delimiter(&self) -> Result<Option<u8>> {
        Ok(match self.delimiter.as_deref() {
            None => None,
            Some("comma") => Some(b','),
            Some("tab") => Some(b'\t'),
            Some("semicolon") => Some(b';'),
            Some("space") => Some(b' '),
            Some(text) => match text.as_bytes() {
                [byte]
                    if byte.is_ascii_punctuation() && !b"\"+-.".contains(byte)
                        || *byte == b'\t'
                        || *byte == b' ' =>
                {
                    Some(*byte)
                }
                _ => {
                    return Err(Error::new(DataCode::ImportInvalid, "this cannot be a delimiter")
                        .column("delimiter")
                        .value(text)
                        .help("use \"comma\", \"tab\", \"semicolon\", \"space\" or one character"));
                }
            },
        })
    }

    /// The names of all columns of the file that the description uses; `None` where it gives one by its number.
    pub(super) fn names_in_file(&self) -> Option<Vec<String>> {
        let columns = self.columns.values().flat_map(|c| std::iter::once(&c.column).chain(c.further()));
        let described = columns.map(|column| match column {
            ColumnRef::Name(name) => Some(name.clone()),
            ColumnRef::Number(_) => None,
        });
        let mut names: Vec<String> = described.collect::<Option<_>>()?;
        names.extend(self.split_by.iter().chain(self.filters.keys()).cloned());
        names.extend(self.lookup.iter().flat_map(|l| l.keys.values().chain(l.keys.keys())).cloned());
        Some(names)
    }

    pub(super) fn described(&self, quantity: Quantity) -> Option<&Column> {
        self.columns.get(quantity.name())
    }
}

/// Checks the columns of dates and of parts of a second beside a time.
fn check_parts(quantity: Quantity, column: &Column) -> Result<()> {
    let invalid = |cause: &str| Error::new(DataCode::ImportInvalid, cause);
    if column.further().next().is_some() && quantity != Quantity::Time {
        return Err(invalid("`date` and `fraction` are for the time"));
    }
    if column.date.is_some() && column.stamp(quantity).is_none() {
        return Err(
            invalid("`date` is the date of times of day").help("write unit = \"timestamp\" beside it")
        );
    }
    if let Some(fraction) = column.fraction.as_ref().filter(|f| f.scale().is_none()) {
        let units: Vec<String> = FRACTIONS.iter().map(|(unit, _)| format!("\"{unit}\"")).collect();
        return Err(invalid("this is no unit of parts of a second")
            .value(&fraction.unit)
            .help(format!("use {}", units.join(", "))));
    }
    Ok(())
}

/// Compiles a regular expression of a description.
pub(super) fn pattern(key: &str, pattern: Option<&str>) -> Result<Option<regex_lite::Regex>> {
    let compile = |p: &str| {
        regex_lite::Regex::new(p).map_err(|e| {
            Error::new(DataCode::ImportInvalid, format!("{key} is not a regular expression: {e}"))
                .value(p)
                .help("for example '(?<pressure_kPa>[0-9.]+)kPa'")
        })
    };
    pattern.map(compile).transpose()
}

/// The quantity of that name in an import description.
fn quantity(name: &str) -> Result<Quantity> {
    let all = || Quantity::IN_HEADERS.into_iter().chain([Quantity::Direction, Quantity::RestLength]);
    all().find(|q| q.name() == name).ok_or_else(|| {
        let names: Vec<_> = all().map(Quantity::name).collect();
        let help = match nearest(name, names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the quantities are {}", names.join(", ")),
        };
        Error::new(DataCode::ImportInvalid, format!("there is no quantity `{name}`")).help(help)
    })
}

/// What a constant's name means, such as `pressure_kPa`.
pub(super) fn constant(name: &str) -> Result<(Quantity, Unit)> {
    let known = Quantity::IN_HEADERS.into_iter().chain([Quantity::RestLength]);
    known
        .flat_map(|q| q.headers().zip(q.units()).map(move |(header, unit)| (header, q, *unit)))
        .find_map(|(header, quantity, unit)| (header == name).then_some((quantity, unit)))
        .ok_or_else(|| {
            Error::new(DataCode::ImportInvalid, format!("`{name}` is not a quantity with a unit"))
                .help("write it as in a header, for example pressure_kPa or rest_length_mm")
        })
}
