//! The first rows of a file, column by column, before anything is known of their meaning.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use super::Note;
use super::forms::{self, Forms};
use super::joined_time::{self, Joined};
use super::layout::{Layout, cells, is_missing};
use super::names::Name;
use crate::date::{DateOrder, date_in, time_stamp_in};
use crate::error::{DataCode, Error, Result};
use crate::recording::Quantity;
use crate::recording::column_table::Column as Stored;
use crate::recording::container::{self, Container};
use crate::recording::header::mac_lines;
use crate::recording::line::{decode, is_remark};
use crate::recording::mcap::Needed;
use crate::recording::read::unpacked;
use crate::recording::source;
use crate::recording::time_of_day;
#[cfg(feature = "excel")]
use crate::recording::workbook;
use crate::statistics::{extremes, quantile};

/// Bytes of a text that are read: some hundred thousand rows.
const LOOKED_AT: u64 = 32 << 20;
/// Rows that are read.
const ROWS: usize = 300_000;
/// Columns of a container have no form of their own.
const PLAIN: Forms = Forms { decimal_comma: false, thousands: None, order: DateOrder::YearFirst };
/// A column with more different values than this is a measurement, no label.
const LABELS: usize = 1000;

/// One column.
#[derive(Debug, Clone, Default)]
pub(super) struct SampleColumn {
    /// As the file has it; a number where it has none.
    pub header: String,
    pub name: Name,
    /// Numbers, of time stamps and dates their seconds; NaN where a cell holds none.
    pub numbers: Vec<f64>,
    /// Cells that are empty or not finite.
    pub missing: usize,
    /// Cells that are neither numbers nor missing.
    pub texts: usize,
    /// The first of these.
    pub first_text: Option<String>,
    /// The first row of a new day, counted from 1, where times of day pass midnight.
    pub midnight: Option<usize>,
    /// How many of these are dates with a time of day, or times of day.
    pub stamps: usize,
    /// How many of these are dates alone.
    pub dates: usize,
    /// The different cells, where there are few, and which of them each row has.
    pub levels: Option<Levels>,
}

/// Cells as numbers into a vocabulary.
#[derive(Debug, Clone, Default)]
pub(super) struct Levels {
    pub words: Vec<String>,
    pub codes: Vec<u32>,
    index: HashMap<String, u32>,
}

impl Levels {
    /// Adds a cell; `false` where there are too many different ones.
    fn push(&mut self, cell: &str) -> bool {
        let code = match self.index.get(cell) {
            Some(code) => *code,
            None => {
                let code = self.words.len() as u32;
                self.words.push(cell.to_owned());
                self.index.insert(cell.to_owned(), code);
                code
            }
        };
        self.codes.push(code);
        self.words.len() <= LABELS
    }
}

impl SampleColumn {
    fn with_name(header: &str, name: Name) -> Self {
        Self { header: header.to_owned(), name, levels: Some(Levels::default()), ..Self::default() }
    }

    fn push(&mut self, cell: &str, forms: Forms) {
        let cell = cell.trim();
        let value = forms.number(cell);
        let stamp = if value.is_none() { time_stamp_in(cell, forms.order) } else { None };
        let date = if value.is_none() { date_in(cell, forms.order) } else { None };
        match value {
            None if is_missing(cell) => self.missing += 1,
            None => {
                self.texts += 1;
                self.first_text.get_or_insert_with(|| cell.to_owned());
                self.stamps += usize::from(stamp.is_some());
                self.dates += usize::from(date.is_some());
            }
            Some(_) => {}
        }
        self.numbers.push(value.or(stamp).or(date).unwrap_or(f64::NAN));
        if self.levels.as_mut().is_some_and(|l| !l.push(cell)) {
            self.levels = None;
        }
    }

    /// The quantity that its name says.
    pub(super) fn quantity_by_name(&self) -> Option<Quantity> {
        self.name.quantity().map(|(quantity, _)| quantity)
    }

    /// Whether it holds numbers.
    pub(super) fn is_numeric(&self) -> bool {
        self.texts == 0 && self.missing < self.numbers.len()
    }

    /// Whether it holds dates with a time of day, or times of day.
    pub(super) fn is_stamped(&self) -> bool {
        self.holds_only(self.stamps) && !self.is_dated()
    }

    /// Whether it holds dates alone, which a spreadsheet writes with the midnight behind them.
    pub(super) fn is_dated(&self) -> bool {
        self.holds_only(self.dates)
    }

    fn holds_only(&self, of_these: usize) -> bool {
        self.texts > 0 && self.texts == of_these && self.texts + self.missing == self.numbers.len()
    }

    /// Its finite numbers.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.numbers.iter().copied().filter(|v| v.is_finite())
    }

    /// Whether the numbers reach further below zero than above it, without the farthest twentieth on each side: codes for missing readings,
    /// such as −999, are not readings.
    pub(super) fn is_mostly_negative(&self) -> bool {
        let mut values: Vec<f64> = self.values().collect();
        !values.is_empty() && -quantile(&mut values, 0.05) > quantile(&mut values, 0.95)
    }

    /// The least and the greatest number.
    pub(super) fn range(&self) -> (f64, f64) {
        extremes(self.values())
    }
}

/// The first rows of a file.
#[derive(Debug, Default)]
pub(super) struct Sample {
    /// The sheet of a workbook.
    pub sheet: Option<String>,
    /// The layout of its text; none for a file of named columns.
    pub layout: Option<Layout>,
    /// Whether the reader finds the names without help.
    pub has_header: bool,
    /// The lines above the names.
    pub preamble: Vec<String>,
    pub columns: Vec<SampleColumn>,
    pub rows: usize,
    /// Whether these are all rows.
    pub whole: bool,
    /// How dates with slashes are read.
    pub order: DateOrder,
    /// The columns of a time that is in several.
    pub joined: Option<Joined>,
    /// What separates thousands.
    pub thousands: Option<u8>,
    /// How the columns of a container were made, and what was found about the form of a text.
    pub notes: Vec<Note>,
    /// What is not clear about its form.
    pub unclear: Vec<Note>,
}

impl Sample {
    pub(super) fn read(path: &Path, sheet: Option<&str>) -> Result<Self> {
        let mut sample = Self::of_file(path, sheet)?;
        joined_time::join(&mut sample);
        Ok(sample)
    }

    fn of_file(path: &Path, sheet: Option<&str>) -> Result<Self> {
        #[cfg(not(feature = "excel"))]
        let _ = sheet;
        let mut source = source::open(path, None, false)?;
        if source.magic.is_empty() {
            return Err(Error::new(DataCode::RecordingEmpty, "the file is empty"));
        }
        match Container::of(&source.magic) {
            Some(container) => {
                let (table, notes) = container::columns(path, container, &mut source, Needed::default())?;
                let notes = notes.into_iter().map(Note::from).collect();
                Ok(Self { notes, ..Self::of_columns(&table) })
            }
            #[cfg(feature = "excel")]
            None if workbook::is_one(&source.magic) => {
                let sheet = workbook::sheet(path, &mut source, sheet)?;
                let mut sample = Self::of_text(&sheet.text)?;
                sample.sheet = Some(sheet.name);
                Ok(sample)
            }
            None => {
                let mut text = Vec::new();
                let read = source.reader.take(LOOKED_AT).read_to_end(&mut text);
                read.map_err(unpacked)?;
                Self::of_text(&text)
            }
        }
    }

    fn of_text(text: &[u8]) -> Result<Self> {
        let text = &text[source::check_text(text)?..];
        let whole = (text.len() as u64) < LOOKED_AT - 3;
        let mut lines: Vec<&[u8]> =
            text.split(|b| *b == b'\n').map(|l| l.strip_suffix(b"\r").unwrap_or(l)).take(2 * ROWS).collect();
        if !whole {
            lines.pop();
        }
        // A whole text that is one line without an end has none.
        if lines.first().is_some_and(|line| line.trim_ascii_end().contains(&b'\r')) {
            return Err(mac_lines());
        }
        // Spreadsheets write the delimiter for each other in a first line, which the reader understands without help.
        let Some(mut layout) = Layout::of(&lines) else {
            return Err(Error::new(DataCode::RecordingNotText, "no table of numbers is found in this file").help(
                "a recording has one row per reading, with equally many cells separated by commas, tabs, semicolons or blanks",
            ));
        };
        layout.comment = forms::sign_of_remarks(&lines, &layout);
        let remark = |line: &&[u8]| is_remark(line, Some(layout.comment));
        layout.remarks |= lines[layout.data_at..].iter().any(remark);
        let lossy = |l: &&[u8]| decode(l).trim_end().to_owned();
        let names_at = layout.names_at.unwrap_or(layout.data_at);
        let mut sample = Self {
            has_header: layout.has_header(&lines),
            preamble: lines[..names_at].iter().map(lossy).collect(),
            columns: columns_of(&layout),
            whole,
            ..Self::default()
        };
        let rows = sample.rows_of(&lines, &layout);
        let mut form = Forms::of(&layout);
        sample.fill(&rows, form);
        let cells_of = |n: usize| rows.iter().map(|row| row[n].as_str()).collect();
        let found = forms::find(&sample.columns, cells_of, &mut form);
        if form.thousands.is_some() || form.order != DateOrder::YearFirst {
            sample.columns = columns_of(&layout);
            sample.fill(&rows, form);
        }
        (sample.thousands, sample.order) = (form.thousands, form.order);
        sample.notes.extend(found.checks);
        sample.unclear.extend(found.unknown);
        sample.layout = Some(layout);
        Ok(sample)
    }

    /// The cells of the first rows. The lines above the table may stand among them again.
    fn rows_of(&mut self, lines: &[&[u8]], layout: &Layout) -> Vec<Vec<String>> {
        let has_letters = |line: &&[u8]| line.iter().any(u8::is_ascii_alphabetic);
        let lines_above: Vec<&[u8]> =
            lines[..layout.data_at].iter().map(|l| l.trim_ascii_end()).filter(has_letters).collect();
        let mut rows = Vec::new();
        let mut repeated = Vec::new();
        for (number, line) in (layout.data_at + 1..).zip(&lines[layout.data_at..]) {
            if lines_above.contains(&line.trim_ascii_end()) {
                repeated.push(number);
                continue;
            }
            let Some(row) = cells(line, layout.dialect()) else { continue };
            // The reader reports the line that has too few or too many cells.
            if row.len() != layout.names.len() || row.iter().all(String::is_empty) {
                continue;
            }
            if row.iter().all(|cell| layout.names.contains(cell)) {
                self.unclear.push(
                    format!(
                        "line {number} names the columns again in another order: make one file of each part"
                    )
                    .into(),
                );
            }
            rows.push(row);
            if rows.len() == ROWS {
                self.whole = false;
                break;
            }
        }
        if let Some(first) = repeated.first() {
            self.notes.push(format!(
                "lines above the table are repeated among the rows, first in line {first}, and are left out"
            ).into());
        }
        self.rows = rows.len();
        rows
    }

    /// Reads the cells.
    fn fill(&mut self, rows: &[Vec<String>], form: Forms) {
        for row in rows {
            for (column, cell) in self.columns.iter_mut().zip(row) {
                column.push(cell, form);
            }
        }
        for column in self.columns.iter_mut().filter(|c| c.is_stamped()) {
            let rows = time_of_day::past_midnight(&mut column.numbers, 1.0, 0.0);
            column.midnight = rows.first().map(|row| row + 1);
        }
    }

    fn of_columns(table: &[(String, Stored)]) -> Self {
        let mut sample = Self { has_header: true, whole: true, ..Self::default() };
        for (header, stored) in table {
            let mut column = SampleColumn::with_name(header, Name::of(header));
            match stored {
                Stored::Numbers(numbers) => {
                    sample.whole &= numbers.len() <= ROWS;
                    for value in numbers.iter().take(ROWS) {
                        column.push(&value.to_string(), PLAIN);
                    }
                }
                Stored::Texts(texts) => texts.iter().take(ROWS).for_each(|t| column.push(t, PLAIN)),
                Stored::Other(_) => continue,
            }
            sample.rows = sample.rows.max(column.numbers.len());
            sample.columns.push(column);
        }
        let rows = sample.rows;
        sample.columns.retain(|c| c.numbers.len() == rows);
        sample
    }
}

fn columns_of(layout: &Layout) -> Vec<SampleColumn> {
    let name = |(k, header): (usize, &String)| match layout.units.as_ref().and_then(|u| u.get(k)) {
        Some(unit) => SampleColumn::with_name(header, Name::with_unit_below(header, unit)),
        None => SampleColumn::with_name(header, Name::of(header)),
    };
    layout.names.iter().enumerate().map(name).collect()
}
