//! Lines of text to numbers: one block of whole lines at a time.

use super::decimal;
use super::line::{Cells, is_blank, is_remark, trim_end};
use super::text_column::TextColumn;
use super::usual_line::UsualLine;
use crate::date::{DateOrder, date_in, time_stamp_in};

/// How a text file is cut into cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// The separator of cells; a space means any run of blanks.
    pub delimiter: u8,
    /// Lines that begin with this are skipped.
    pub comment: Option<u8>,
    /// Decimals are written with a comma.
    pub decimal_comma: bool,
    /// What separates thousands.
    pub thousands: Option<u8>,
    /// Rows with a missing number are left out.
    pub skip_missing: bool,
}

impl Dialect {
    /// The decimal sign.
    pub(super) fn point(&self) -> u8 {
        if self.decimal_comma { b',' } else { b'.' }
    }
}

/// The requested form of one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Want {
    /// A number: SI value = number · scale + offset.
    Number { scale: f64, offset: f64 },
    /// A date with a time of day, or a time of day alone: s = its seconds · scale + offset.
    Stamp { scale: f64, offset: f64, order: DateOrder },
    /// A date alone: s since 1970.
    Date { order: DateOrder },
    /// The text itself, from a small vocabulary.
    Text,
}

/// A column that is requested. A plan's columns are in ascending order of `index`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    pub index: usize,
    pub want: Want,
}

/// What is wrong with a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    Empty,
    NotANumber,
    /// Neither a date with a time of day nor a time of day.
    NotAStamp,
    /// No date alone.
    NotADate,
    NotFinite,
    Width {
        found: usize,
        expected: usize,
    },
    OpenQuote,
}

/// Where a block went wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LineError {
    /// Counted from 0 at the block's start.
    pub line: u64,
    /// Index of the cell.
    pub cell: Option<usize>,
    pub value: String,
    pub fault: Fault,
}

/// Which line of the file each row came from: (first row, its line), one entry wherever lines were skipped.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct LineMap(Vec<(usize, u64)>);

impl LineMap {
    pub(super) fn note(&mut self, row: usize, line: u64) {
        if self.0.last().is_none_or(|(r, l)| l + (row - r) as u64 != line) {
            self.0.push((row, line));
        }
    }

    pub(super) fn append(&mut self, other: &Self, rows: usize, lines: u64) {
        for (row, line) in &other.0 {
            self.note(rows + row, lines + line);
        }
    }

    pub(super) fn line(&self, row: usize) -> u64 {
        let at = self.0.partition_point(|(r, _)| *r <= row);
        at.checked_sub(1).map_or(row as u64, |i| self.0[i].1 + (row - self.0[i].0) as u64)
    }
}

/// The requested cells of a block.
#[derive(Debug, Default)]
pub(super) struct Parsed {
    /// One per requested column; empty for texts.
    pub numbers: Vec<Vec<f64>>,
    /// One per requested column; empty for numbers.
    pub texts: Vec<TextColumn>,
    pub rows: usize,
    pub lines: u64,
    pub map: LineMap,
    /// For every row that was left out, how many were kept before it.
    pub skipped: Vec<usize>,
}

impl Fault {
    /// Whether a cell marks a missing value: empty, not finite, or signs without digits.
    fn is_missing(&self, value: &str) -> bool {
        match self {
            Self::Empty | Self::NotFinite => true,
            Self::NotANumber | Self::NotAStamp | Self::NotADate => only_signs(value),
            Self::Width { .. } | Self::OpenQuote => false,
        }
    }
}

/// Whether a cell such as `---` has signs, but no digits.
pub(super) fn only_signs(cell: &str) -> bool {
    cell.chars().all(|c| "-+ ".contains(c))
}

impl Parsed {
    /// Takes back what was read of a row.
    fn leave_out(&mut self) {
        self.take_back();
        self.skipped.push(self.rows);
    }

    /// As [`Self::leave_out`], of a line that is not a row.
    fn take_back(&mut self) {
        self.numbers.iter_mut().for_each(|n| n.truncate(self.rows));
        self.texts.iter_mut().for_each(|t| t.codes.truncate(self.rows));
    }

    /// Memory that its content takes, in values of 8 bytes: numbers, the codes of texts, every word twice with its place in a table,
    /// and the places where lines were skipped.
    pub(super) fn values(&self) -> usize {
        let numbers: usize = self.numbers.iter().map(Vec::len).sum();
        let texts = self.texts.iter().map(|t| {
            t.codes.len().div_ceil(2) + t.dictionary.iter().map(|w| 12 + w.len().div_ceil(4)).sum::<usize>()
        });
        numbers + texts.sum::<usize>() + 2 * self.map.0.len() + self.skipped.len()
    }
}

/// Parses a block of whole lines; `width` cells are expected in each. `lines_above` are lines above the rows, which may stand among them again.
pub(super) fn parse(
    block: &[u8],
    dialect: Dialect,
    wanted: &[Wanted],
    width: usize,
    lines_above: &[Vec<u8>],
) -> Result<Parsed, Box<LineError>> {
    let mut out = Parsed {
        numbers: wanted.iter().map(|_| Vec::new()).collect(),
        texts: wanted.iter().map(|_| TextColumn::default()).collect(),
        ..Parsed::default()
    };
    let quick = UsualLine::new(dialect, wanted, width);
    let first = memchr::memchr(b'\n', block).unwrap_or(block.len()) + 1;
    for (column, wanted) in out.numbers.iter_mut().zip(wanted) {
        if wanted.want != Want::Text {
            column.reserve(block.len() / first + block.len() / first / 16 + 1);
        }
    }
    let mut values = vec![0.0; wanted.len()];
    let mut rest = block;
    while !rest.is_empty() {
        if let Some(used) = quick.as_ref().and_then(|q| q.row(rest, &mut values)) {
            for (column, value) in out.numbers.iter_mut().zip(&values) {
                column.push(*value);
            }
            out.map.note(out.rows, out.lines);
            out.rows += 1;
            out.lines += 1;
            rest = &rest[used..];
            continue;
        }
        let end = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
        let line = trim_end(&rest[..end]);
        rest = rest.get(end + 1..).unwrap_or_default();
        // A blank row of a spreadsheet is a line of delimiters.
        let skip =
            is_remark(line, dialect.comment) || line.iter().all(|b| is_blank(*b) || *b == dialect.delimiter);
        if !skip {
            match row(line, dialect, wanted, width, &mut out) {
                Ok(()) => {
                    out.map.note(out.rows, out.lines);
                    out.rows += 1;
                }
                Err(_) if lines_above.iter().any(|above| above == line.trim_ascii_end()) => out.take_back(),
                Err((_, value, fault)) if dialect.skip_missing && fault.is_missing(&value) => out.leave_out(),
                Err((cell, value, fault)) => {
                    return Err(Box::new(LineError { line: out.lines, cell, value, fault }));
                }
            }
        }
        out.lines += 1;
    }
    Ok(out)
}

type CellError = (Option<usize>, String, Fault);

fn row(
    line: &[u8],
    dialect: Dialect,
    wanted: &[Wanted],
    width: usize,
    out: &mut Parsed,
) -> Result<(), CellError> {
    let mut cells = Cells::of(line, dialect);
    let mut index = 0;
    let mut next = 0;
    while let Some(target) = wanted.get(next) {
        // Cells before the requested one are passed over without looking into them.
        while index < target.index {
            cells.skip().map_err(|()| open_quote(line))?;
            index += 1;
        }
        let first_of_cell = next;
        if cells.at.is_none() {
            return Err(wrong_width(line, dialect, width));
        }
        let start = cells;
        while wanted.get(next).is_some_and(|w| w.index == index) {
            cells = start;
            match wanted[next].want {
                Want::Number { scale, offset } => match cells.number() {
                    Some(value) => out.numbers[next].push(value * scale + offset),
                    None => return Err(explain(start, width, index)),
                },
                Want::Stamp { scale, offset, order } => {
                    let cell = cells.text().map_err(|()| open_quote(line))?;
                    match time_stamp_in(&cell, order) {
                        Some(seconds) => out.numbers[next].push(seconds * scale + offset),
                        None => return Err(explain_stamp(start, width, index)),
                    }
                }
                Want::Date { order } => {
                    let cell = cells.text().map_err(|()| open_quote(line))?;
                    match date_in(&cell, order) {
                        Some(seconds) => out.numbers[next].push(seconds),
                        None => return Err(explain_date(start, width, index)),
                    }
                }
                Want::Text => {
                    let cell = cells.text().map_err(|()| open_quote(line))?;
                    out.texts[next].push(&cell);
                }
            }
            next += 1;
        }
        debug_assert!(next > first_of_cell);
        index += 1;
    }
    while cells.at.is_some() {
        cells.skip().map_err(|()| open_quote(line))?;
        index += 1;
    }
    if index == width { Ok(()) } else { Err(wrong_width(line, dialect, width)) }
}

fn open_quote(line: &[u8]) -> CellError {
    (None, lossy(line), Fault::OpenQuote)
}

fn wrong_width(line: &[u8], dialect: Dialect, expected: usize) -> CellError {
    let mut cells = Cells::of(line, dialect);
    let mut found = 0;
    while cells.at.is_some() {
        if cells.skip().is_err() {
            return open_quote(line);
        }
        found += 1;
    }
    (None, lossy(line), Fault::Width { found, expected })
}

/// Says what is wrong with a cell that did not give a number.
fn explain(mut cells: Cells<'_>, width: usize, index: usize) -> CellError {
    let (line, dialect) = (cells.line, cells.dialect);
    // A wrong number of cells shifts the columns, so it is the better explanation.
    let width_error = wrong_width(line, dialect, width);
    if !matches!(width_error.2, Fault::Width { found, .. } if found == width) {
        return width_error;
    }
    let Ok(text) = cells.text() else { return open_quote(line) };
    let bare = text.trim().trim_start_matches(['-', '+']).to_lowercase();
    let fault = match bare.as_str() {
        "" if text.trim().is_empty() => Fault::Empty,
        "nan" | "inf" | "infinity" | "na" | "n/a" | "null" | "none" | "1.#inf" | "1.#qnan" | "#n/a" => {
            Fault::NotFinite
        }
        _ if decimal::prefix(bare.as_bytes(), b'.')
            .is_some_and(|(v, n)| n == bare.len() && !v.is_finite()) =>
        {
            Fault::NotFinite
        }
        _ => Fault::NotANumber,
    };
    (Some(index), text.into_owned(), fault)
}

/// Why a cell is not a time stamp.
fn explain_stamp(cells: Cells<'_>, width: usize, index: usize) -> CellError {
    let (cell, value, fault) = explain(cells, width, index);
    let fault = if fault == Fault::NotANumber { Fault::NotAStamp } else { fault };
    (cell, value, fault)
}

/// Why a cell is not a date.
fn explain_date(cells: Cells<'_>, width: usize, index: usize) -> CellError {
    let (cell, value, fault) = explain(cells, width, index);
    let fault = if fault == Fault::NotANumber { Fault::NotADate } else { fault };
    (cell, value, fault)
}

fn lossy(line: &[u8]) -> String {
    String::from_utf8_lossy(&line[..line.len().min(200)]).into_owned()
}

#[cfg(test)]
mod tests {
    use crate::recording::{Import, Missing, Reader};

    fn rows(cells: &[&str]) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
        let rows: String = cells.iter().enumerate().map(|(i, c)| format!("{i},300,1,{c}\n")).collect();
        std::fs::write(&file, format!("time_s,pressure_kPa,displacement_mm,force_N\n{rows}")).unwrap();
        file
    }

    #[test]
    fn rows_without_a_number_are_an_error_or_left_out_by_choice() {
        let cells = ["1", "", "3", "NaN", "5", "---", "7", "inf", "9", "10", "11", "12", "13", "14"];
        let file = rows(&cells);
        let error = Reader::new().file(file.path()).unwrap_err();
        assert!(error.advice().is_some_and(|a| a.contains("--missing skip")), "{error}");
        let skipping = Reader { missing: Some(Missing::Skip), ..Reader::new() };
        let read = skipping.file(file.path()).unwrap().remove(0);
        assert_eq!(read.time, [0.0, 2.0, 4.0, 6.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0]);
        assert_eq!((read.skipped, read.require_force().unwrap()[1]), (4, 3.0));
        // A word is a mistake, and no missing value.
        let word = rows(&["1", "2", "x", "4", "5", "6", "7", "8", "9", "10", "11"]);
        assert!(skipping.file(word.path()).is_err());
    }

    #[test]
    fn equally_spaced_rows_keep_their_time_where_others_are_left_out() {
        let description =
            "missing = \"skip\"\nsample_interval_s = 0.5\n[columns.pressure]\ncolumn = \"pressure_kPa\"\n";
        let import = Import::parse(description).unwrap();
        let file = rows(&["nan", "1", "2", "", "4", "5", "6", "7", "8", "9", "10", "11"]);
        let read = Reader::new().import(Some(&import)).file(file.path()).unwrap().remove(0);
        assert_eq!(read.time[..3], [0.5, 1.0, 2.0]);
    }

    #[test]
    fn an_error_behind_rows_that_were_left_out_names_its_line() {
        let file = rows(&["1", "", "3", "x"]);
        let skipping = Reader { missing: Some(Missing::Skip), ..Reader::new() };
        assert!(skipping.file(file.path()).unwrap_err().to_string().contains(":5, column force_N"));
    }
}
