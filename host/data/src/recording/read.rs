//! Files to recordings.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::assemble::{Job, LookupTable, assemble};
use super::blocks::{BlockError, Blocks, Rows, read_rows};
use super::campaign::Campaign;
use super::column_plan::{ColumnPlan, Context, plan};
use super::column_table::{Column, ColumnTable, select};
use super::columns::Recording;
use super::container::{self, Container};
use super::header::Header;
use super::import::{Decimal, Import, Missing, Value};
use super::line::decode;
use super::lookup::read_lookup;
use super::mcap::Needed;
use super::quantity::{HeaderName, Quantity, parse_header};
use super::source;
use super::time_of_day;
use crate::bounds::Budget;
use crate::error::{DataCode, Error, Result};
use crate::file_kind::FileKind;
use crate::muscle_description::MuscleDescription;
use crate::progress::Progress;

mod constants;
mod error_messages;
mod filter_values;
mod grid;
mod side_by_side;

use constants::Constants;
pub(super) use error_messages::unpacked;
use error_messages::{block_error, rows_error};
pub use filter_values::FilterValues;

/// How to read recordings, and what is known of the muscle that made them.
#[derive(Debug, Clone, Default)]
pub struct Reader<'a> {
    /// L0 in metres; needed when files give lengths or contractions instead of a stroke.
    pub rest_length: Option<f64>,
    /// The muscle's name, which an import description can select rows by.
    pub muscle_name: Option<&'a str>,
    /// For files that are not in our own form.
    pub import: Option<&'a Import>,
    /// Further row filters: column and the text or number that it must have, as [`Value::of_option`] reads them. Several on one column take
    /// the values of each, and leave out what one of them excludes.
    pub filters: Vec<(String, String)>,
    /// Whether these may name values that no row of a campaign has.
    pub absent_values: bool,
    /// Takes what the columns of these hold; a campaign has its own.
    pub filter_values: Option<Arc<FilterValues>>,
    /// What becomes of rows without a number in a column that is used; as the import description says where it is `None`.
    pub missing: Option<Missing>,
    /// The sheet of a workbook; as the import description says where it is `None`.
    pub sheet: Option<String>,
    /// Files with fewer rows are refused.
    pub min_rows: usize,
    /// Receives every byte that is read.
    pub progress: Option<Arc<dyn Progress>>,
    /// Takes the SHA-256 of every file that is read.
    pub hashes: Option<Arc<Hashes>>,
}

/// SHA-256 of files as they were read: of a pipe nothing is left to hash later, and a file may have changed.
#[derive(Debug, Default)]
pub struct Hashes(Mutex<HashMap<PathBuf, String>>);

impl Hashes {
    /// Of each of these files, in hexadecimal.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`] for one that was not read.
    pub fn of(&self, files: &[PathBuf]) -> Result<Vec<String>> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let one = |file: &PathBuf| {
            known.get(file).cloned().ok_or_else(|| {
                Error::new(DataCode::FileUnreadable, "the file was not read to its end").file(file)
            })
        };
        files.iter().map(one).collect()
    }
}

/// Lines below what was taken for the header among which the header itself is looked for.
const LOOKED_BELOW: usize = 100;
#[cfg(feature = "excel")]
use super::workbook::is_one as workbook_magic;

/// Whether a text has numbers such as `"0,25"` in quotation marks.
#[cfg(feature = "excel")]
fn has_commas_in_quotes(text: &[u8]) -> bool {
    text.split(|b| *b == b'"').skip(1).step_by(2).any(|cell| {
        let bare = cell.strip_prefix(b"-").unwrap_or(cell);
        bare.contains(&b',') && bare.iter().all(|b| b.is_ascii_digit() || *b == b',')
    })
}

/// Distinguishes workbooks from text in builds that do not read workbooks.
#[cfg(not(feature = "excel"))]
fn workbook_magic(magic: &[u8]) -> bool {
    magic.starts_with(b"PK\x03\x04") || magic.starts_with(b"\xd0\xcf\x11\xe0")
}

/// Fewer rows than this are not a recording of a muscle, but a mistake.
const MIN_ROWS: usize = 10;

impl<'a> Reader<'a> {
    /// For recordings of a muscle that is not known.
    #[must_use]
    pub fn new() -> Self {
        Self { min_rows: MIN_ROWS, ..Self::default() }
    }

    /// For recordings of the muscle that is described.
    #[must_use]
    pub fn of(muscle: &'a MuscleDescription) -> Self {
        Self { rest_length: Some(muscle.rest_length()), muscle_name: Some(&muscle.name), ..Self::new() }
    }

    /// For recordings of a muscle of this rest length (m), as a table knows it.
    #[must_use]
    pub fn with_rest_length(rest_length: f64) -> Self {
        Self { rest_length: Some(rest_length), ..Self::new() }
    }

    /// By an import description.
    #[must_use]
    pub fn import(mut self, import: Option<&'a Import>) -> Self {
        self.import = import;
        self
    }

    /// Reads files in chronological order.
    ///
    /// # Errors
    /// As [`Reader::file`], for the first file that is not right.
    pub fn campaign<P: AsRef<Path>>(&self, paths: impl IntoIterator<Item = P>) -> Result<Campaign> {
        let mut recordings = Vec::new();
        let mut budget = Budget::default();
        let values = Arc::new(FilterValues::of(&self.filters));
        let reader = Self { filter_values: Some(Arc::clone(&values)), ..self.clone() };
        for path in paths {
            let path = path.as_ref();
            let read = reader.file(path)?;
            budget.take(read.iter().map(Recording::values).sum()).map_err(|e| {
                e.file(path).help("the recordings together are too long: leave some out, or record fewer samples per second")
            })?;
            recordings.extend(read);
        }
        if recordings.is_empty() {
            return Err(Error::new(DataCode::CallInvalid, "no recording was given"));
        }
        if !self.absent_values {
            values.check()?;
        }
        let remark = time_of_day::on_following_days(&mut recordings);
        let mut campaign = Campaign::new(recordings);
        campaign.warnings.extend(remark);
        Ok(campaign)
    }

    /// Reads one file: one recording, or several when the import description splits it.
    ///
    /// Text (CSV, tab-separated, or as described), also compressed by gzip or zstd; MATLAB files of version 5 to 7.3, HDF5 and
    /// Parquet, whose columns have the names that a text file's header would have.
    ///
    /// ```
    /// use pam_data::recording::Reader;
    ///
    /// let file = tempfile::NamedTempFile::new()?;
    /// let rows: String = (0..10).map(|i| format!("{i},45,{},2\n", 0.1 * f64::from(i))).collect();
    /// std::fs::write(&file, format!("time_s,pressure_psi,displacement_in,force_lbf\n{rows}"))?;
    /// let recording = &Reader::new().file(file.path())?[0];
    /// // One pound-force per square inch is 6894.757 Pa, an inch 25.4 mm, one pound-force 4.448222 N.
    /// assert!((recording.pressure[0] - 45.0 * 6894.757).abs() < 0.1);
    /// assert!((recording.stroke[9] - 0.9 * 25.4e-3).abs() < 1e-9);
    /// assert!((recording.require_force()?[0] - 2.0 * 4.448222).abs() < 1e-5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Any `file::`, `recording::` or `import::` code, with file, line, column and value as far as they apply.
    pub fn file(&self, path: &Path) -> Result<Vec<Recording>> {
        self.open(path).map_err(|e| FileKind::Recording.wanted(path, e))
    }

    fn open(&self, path: &Path) -> Result<Vec<Recording>> {
        if let Some((import, beside)) = self.import.and_then(|i| Some((i, i.side_by_side?))) {
            return self.side_by_side(path, import, beside.recordings);
        }
        let source = source::open(path, self.progress.as_ref(), self.hashes.is_some())?;
        if source.magic.is_empty() {
            return Err(Error::new(DataCode::RecordingEmpty, "the file is empty"));
        }
        let bytes = source.bytes.clone();
        let recordings = match Container::of(&source.magic) {
            Some(container) => self.container(path, container, source)?,
            None if workbook_magic(&source.magic) => self.workbook(path, source)?,
            None => self.text(path, source, self.description())?,
        };
        if let Some(hashes) = &self.hashes
            && let Some(hash) = bytes.sha256().map_err(|e| Error::unreadable(path, &e))?
        {
            hashes.0.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned(), hash);
        }
        Ok(recordings)
    }

    /// A sheet of a workbook is read as the CSV file that it would be saved as.
    #[cfg(feature = "excel")]
    fn workbook(&self, path: &Path, mut source: source::Source) -> Result<Vec<Recording>> {
        let mut description = self.description();
        let sheet = super::workbook::sheet(path, &mut source, description.sheet.as_deref())?;
        if description.delimiter.is_some() || description.decimal != Decimal::Point {
            // The numbers of a sheet have points, also where the text files of a bench have commas. Numbers that it holds as text keep theirs.
            let as_text = description.decimal == Decimal::Comma && has_commas_in_quotes(&sheet.text);
            let own = description.into_owned();
            description = Cow::Owned(if as_text {
                Import { delimiter: Some("comma".into()), ..own }
            } else {
                Import { delimiter: None, decimal: Decimal::Point, ..own }
            });
        }
        source.size = Some(sheet.text.len() as u64);
        source.reader = Box::new(std::io::Cursor::new(sheet.text));
        self.text(path, source, description)
    }

    #[cfg(not(feature = "excel"))]
    fn workbook(&self, _: &Path, _: source::Source) -> Result<Vec<Recording>> {
        Err(Error::new(DataCode::RecordingContainer, "this build does not read workbooks")
            .help("it was built without the feature `excel`: build it with it, or save the sheet as CSV"))
    }

    fn text(
        &self,
        path: &Path,
        source: source::Source,
        description: Cow<'_, Import>,
    ) -> Result<Vec<Recording>> {
        if let Some(grid) = &description.grid {
            return self.grid(path, source, &description, grid);
        }
        let mut blocks = Blocks::new(source.reader);
        let mut first = Vec::new();
        let start = match blocks.next(&mut first) {
            Ok(_) => source::check_text(&first)?,
            Err(BlockError::LongLine) => {
                source::check_text(&first)?;
                return Err(block_error(BlockError::LongLine));
            }
            Err(e) => return Err(block_error(e)),
        };
        let text = &first[start..];
        if text.iter().all(u8::is_ascii_whitespace) {
            return Err(Error::new(DataCode::RecordingEmpty, "the file contains only blanks"));
        }
        let header = Header::read(text, &description)?;
        let rest = &text[header.bytes..];
        let average = header.average_line(rest);
        blocks.put_back(rest);
        let preamble = decode(&text[..header.preamble]);
        let layout = self.layout(path, &header.names, &description, &preamble).map_err(|e| {
            let below = if self.import.is_none() { header_below(text, &header) } else { None };
            match below {
                Some(line) if e.code() == DataCode::RecordingMissingColumn => e.help(format!(
                    "line {line} looks like the header: give skip_lines = {} in an import description (--import)",
                    line - 1
                )),
                _ => e,
            }
        })?;
        let rows = read_rows(
            blocks,
            header.dialect,
            &layout.plan.wanted,
            header.names.len(),
            &header.lines_above,
            source.size.or(average),
            Budget::default(),
        )
        .map_err(|e| rows_error(e, &header, &description))?;
        self.finish(path, &description, &header.names, &layout, header.lines + 1, rows)
    }

    /// A container gives recordings by the same rules as text.
    fn container(
        &self,
        path: &Path,
        container: Container,
        mut source: source::Source,
    ) -> Result<Vec<Recording>> {
        let names = self.import.and_then(Import::names_in_file).map(|mut names| {
            names.extend(self.filters.iter().map(|(name, text)| Value::of_option(name, text).0));
            names
        });
        let pressure =
            self.import.and_then(|i| i.described(Quantity::Pressure)).map(|c| c.column.to_string());
        let needed = Needed { columns: names.as_deref(), pressure: pressure.as_deref() };
        let (table, _) = container::columns(path, container, &mut source, needed)?;
        self.take_columns(path, table)
    }

    /// Reads columns that are in memory by the rules of a file with this name: names that end in the unit, filters, splitting.
    ///
    /// ```
    /// use pam_data::recording::{Reader, TableColumn};
    ///
    /// let numbers = |of: fn(f64) -> f64| TableColumn::Numbers((0..10).map(|i| of(f64::from(i))).collect());
    /// let table = vec![
    ///     ("time_ms".to_owned(), numbers(|i| 100.0 * i)),
    ///     ("pressure_bar".to_owned(), numbers(|_| 3.0)),
    ///     ("displacement_mm".to_owned(), numbers(|i| i)),
    /// ];
    /// let recording = &Reader::new().table("run 1", table)?[0];
    /// assert!((recording.pressure[0] - 3e5).abs() < 1e-6 && (recording.time[9] - 0.9).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Reader::file`]; the place is the row, counted from 1.
    pub fn table(&self, name: &str, columns: Vec<(String, Column)>) -> Result<Vec<Recording>> {
        let path = Path::new(name);
        self.take_columns(path, columns).map_err(|e| if e.place().file.is_none() { e.file(path) } else { e })
    }

    fn take_columns(&self, path: &Path, table: ColumnTable) -> Result<Vec<Recording>> {
        let description = self.description();
        let names: Vec<String> = table.iter().map(|(n, _)| n.clone()).collect();
        let layout = self.layout(path, &names, &description, "")?;
        let rows = select(&table, &layout.plan.wanted, description.missing)?;
        drop(table);
        self.finish(path, &description, &names, &layout, 1, rows)
    }

    fn description(&self) -> Cow<'a, Import> {
        // What a file of no description has for sure: a line that begins with a number sign is a remark.
        let own = || Cow::Owned(Import { comment: Some('#'), ..Import::default() });
        let description = self.import.map_or_else(own, Cow::Borrowed);
        if self.missing.is_none() && self.sheet.is_none() {
            return description;
        }
        let own = description.into_owned();
        let (missing, sheet) =
            (self.missing.unwrap_or(own.missing), self.sheet.clone().or(own.sheet.clone()));
        Cow::Owned(Import { missing, sheet, ..own })
    }

    /// Decides what to read of columns with these names.
    fn layout(&self, path: &Path, names: &[String], import: &Import, preamble: &str) -> Result<Layout> {
        let mut constants = Constants::default();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        constants.catch("the file's name is", "file_name", import.file_name.as_deref(), &name)?;
        constants.catch("the skipped lines are", "preamble", import.preamble.as_deref(), preamble)?;
        let lookup = import.lookup.as_ref().map(|l| read_lookup(path, &l.file)).transpose()?;
        let mut filters: Vec<(String, Value)> =
            import.filters.iter().map(|(k, v)| (k.clone(), v.clone())).collect();
        let called = combined(&self.filters);
        // A filter of the call replaces that of the description; what it excludes is excluded beside that.
        filters.retain(|(name, _)| !called.iter().any(|(n, value)| n == name && !value.excludes()));
        filters.extend(called);
        let context = Context {
            import,
            foreign: self.import.is_some(),
            constants: constants.quantities,
            filters: filters.iter().map(|(n, _)| n.clone()).collect(),
            lookup: lookup.as_ref().map(|l| l.header.as_slice()),
        };
        Ok(Layout { plan: plan(names, &context)?, filters, lookup, labels: constants.labels })
    }

    fn finish(
        &self,
        path: &Path,
        import: &Import,
        names: &[String],
        layout: &Layout,
        first_line: u64,
        rows: Rows,
    ) -> Result<Vec<Recording>> {
        let job = Job {
            path,
            min_rows: self.min_rows,
            rest_length: self.rest_length,
            muscle_name: self.muscle_name,
            import,
            filters: &layout.filters,
            filter_values: self.filter_values.as_deref(),
            plan: &layout.plan,
            names,
            lookup: layout.lookup.as_ref(),
            first_line,
            labels: layout.labels.clone(),
        };
        assemble(&job, rows)
    }
}

/// The filters of a call: the values that several take from one column are one list, what they exclude is excluded by each.
fn combined(filters: &[(String, String)]) -> Vec<(String, Value)> {
    let mut all: Vec<(String, Value)> = Vec::new();
    for (name, text) in filters {
        let (name, value) = Value::of_option(name, text);
        match all.iter_mut().find(|(n, first)| *n == name && !first.excludes() && !value.excludes()) {
            Some((_, first)) => *first = Value::AnyOf(vec![first.clone(), value]),
            None => all.push((name, value)),
        }
    }
    all
}

/// The first of the next lines, counted from 1, that names columns as a header does: above it a program may have written other things.
fn header_below(text: &[u8], header: &Header) -> Option<u64> {
    let names = |line: &[u8]| {
        let line = String::from_utf8_lossy(line);
        let known = |n: &str| matches!(parse_header(n.trim().trim_matches('"')), HeaderName::Known(..));
        line.split([',', ';', '\t']).filter(|n| known(n)).count()
    };
    let below = text[header.bytes..].split(|b| *b == b'\n').take(LOOKED_BELOW);
    below.zip(header.lines + 1..).find_map(|(line, number)| (names(line) >= 2).then_some(number))
}

/// What is read of one file.
struct Layout {
    plan: ColumnPlan,
    filters: Vec<(String, Value)>,
    lookup: Option<LookupTable>,
    labels: Vec<(String, String)>,
}
