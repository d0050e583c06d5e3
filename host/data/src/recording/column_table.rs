//! Named columns as they are in a container: not yet chosen, not yet in SI.

use super::blocks::Rows;
use super::cells::{Want, Wanted};
use super::import::Missing;
use super::text_column::TextColumn;
use crate::date::{date_in, time_stamp_in};
use crate::error::{DataCode, Error, Result};
use crate::pluralise::pluralise;

/// The columns of one file, in its order.
pub(super) type ColumnTable = Vec<(String, Column)>;

/// One column of a container, or of a table in memory.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Missing values are NaN.
    Numbers(Vec<f64>),
    /// Text, such as names of runs.
    Texts(Vec<String>),
    /// What a recording has no use for, by what it is: reported only where such a column is requested.
    Other(String),
}

/// An error inside a binary file, with the reader's message.
pub(super) fn damaged(what: impl std::fmt::Display) -> Error {
    Error::new(DataCode::RecordingContainer, what.to_string())
}

/// The columns of a matrix that is stored column after column, called `name(:,k)` as MATLAB does; a vector is one column.
pub(super) fn matrix(name: &str, rows: usize, wide: usize, values: Vec<f64>, table: &mut ColumnTable) {
    /// A wider matrix is a picture or a table of coefficients, no recording.
    const WIDEST: usize = 1000;
    if values.is_empty() || rows.checked_mul(wide) != Some(values.len()) {
        return;
    }
    if rows == 1 || wide == 1 {
        table.push((name.to_owned(), Column::Numbers(values)));
    } else if wide <= WIDEST {
        let named = |(k, c): (usize, &[f64])| (format!("{name}(:,{})", k + 1), Column::Numbers(c.to_vec()));
        table.extend(values.chunks_exact(rows).enumerate().map(named));
    }
}

/// The same columns by the rest of their names, where all names share what stands before a point: the fields of the one struct,
/// group or table that a file holds.
pub(super) fn without_common_prefix(mut table: ColumnTable) -> ColumnTable {
    loop {
        let Some(prefix) =
            table.first().and_then(|(name, _)| name.split_once('.')).map(|(p, _)| format!("{p}."))
        else {
            return table;
        };
        if !table.iter().all(|(name, _)| name.len() > prefix.len() && name.starts_with(&prefix)) {
            return table;
        }
        for (name, _) in &mut table {
            name.drain(..prefix.len());
        }
    }
}

/// Takes the requested columns, as numbers in SI or as texts. Where text errors name a line, these name the row, counted from 1.
pub(super) fn select(table: &ColumnTable, wanted: &[Wanted], missing: Missing) -> Result<Rows> {
    let mut rows = Rows::default();
    let keep = if missing == Missing::Skip { complete(table, wanted) } else { None };
    let mut length: Option<(usize, &str)> = None;
    for wanted in wanted {
        let Some((name, column)) = table.get(wanted.index) else { continue };
        let count = column.rows().map_err(|e| e.column(name))?;
        match length {
            Some((n, first)) if n != count => {
                return Err(Error::new(
                    DataCode::RecordingWrongWidth,
                    format!("`{name}` has {} and `{first}` has {n}", pluralise(count, "row")),
                )
                .help("all columns of a recording are equally long"));
            }
            _ => length = Some((count, name)),
        }
        let (mut numbers, mut texts) = (Vec::new(), TextColumn::default());
        match wanted.want {
            Want::Number { scale, offset } => {
                numbers = in_si(column, scale, offset, keep.as_deref()).map_err(|e| e.column(name))?;
            }
            Want::Stamp { scale, offset, order } => {
                let seconds = |text: &str| time_stamp_in(text, order).map(|v| v * scale + offset);
                numbers = times(column, seconds, keep.as_deref()).map_err(|e| e.column(name))?;
            }
            Want::Date { order } => {
                let seconds = |text: &str| date_in(text, order);
                numbers = times(column, seconds, keep.as_deref()).map_err(|e| e.column(name))?;
            }
            Want::Text => texts = as_texts(column, keep.as_deref()),
        }
        rows.numbers.push(numbers);
        rows.texts.push(texts);
    }
    rows.rows = length.map_or(0, |(n, _)| n);
    if let Some(keep) = &keep {
        rows.leave_out(keep);
    }
    Ok(rows)
}

impl Column {
    fn rows(&self) -> Result<usize> {
        match self {
            Self::Numbers(n) => Ok(n.len()),
            Self::Texts(t) => Ok(t.len()),
            Self::Other(what) => Err(Error::new(
                DataCode::RecordingNotANumber,
                format!("a column of {what} where numbers are needed"),
            )
            .help("save the column as numbers, in the unit that its name says")),
        }
    }
}

/// The values of the rows that are kept, with their places.
fn kept<'a, T>(values: &'a [T], keep: Option<&'a [bool]>) -> impl Iterator<Item = (usize, &'a T)> {
    let is_kept = move |row: usize| keep.is_none_or(|k| k.get(row).copied().unwrap_or(true));
    values.iter().enumerate().filter(move |(row, _)| is_kept(*row))
}

/// Numbers, scaled.
fn in_si(column: &Column, scale: f64, offset: f64, keep: Option<&[bool]>) -> Result<Vec<f64>> {
    match column {
        Column::Numbers(values) => match kept(values, keep).find(|(_, v)| !v.is_finite()) {
            None => Ok(kept(values, keep).map(|(_, v)| v * scale + offset).collect()),
            Some((row, value)) => Err(Error::new(DataCode::RecordingNotFinite, "not a finite number")
                .line(row as u64 + 1)
                .value(value.to_string())
                .help("leave such rows out by --missing skip (missing = \"skip\" in an import description)")),
        },
        Column::Texts(texts) => {
            Err(Error::new(DataCode::RecordingNotANumber, "a column of text where numbers are needed")
                .value(texts.first().map_or("", String::as_str))
                .help("save the column as numbers"))
        }
        Column::Other(_) => Ok(Vec::new()),
    }
}

/// Times of time stamps.
fn times(column: &Column, seconds: impl Fn(&str) -> Option<f64>, keep: Option<&[bool]>) -> Result<Vec<f64>> {
    match column {
        Column::Texts(cells) => kept(cells, keep)
            .map(|(row, text)| {
                seconds(text).ok_or_else(|| {
                    Error::new(DataCode::RecordingNotANumber, "not a time stamp")
                        .line(row as u64 + 1)
                        .value(text)
                        .help("time stamps are like 2026-11-21T13:30:00.25, or 13:30:00.25")
                })
            })
            .collect(),
        Column::Numbers(values) => {
            Err(Error::new(DataCode::RecordingNotANumber, "a column of numbers where time stamps are needed")
                .value(values.first().map_or(String::new(), f64::to_string))
                .help("give the unit of the numbers in the import description: s or ms"))
        }
        Column::Other(_) => Ok(Vec::new()),
    }
}

/// The cells as texts.
fn as_texts(column: &Column, keep: Option<&[bool]>) -> TextColumn {
    let mut texts = TextColumn::default();
    match column {
        Column::Numbers(values) => kept(values, keep).for_each(|(_, v)| texts.push(&v.to_string())),
        Column::Texts(cells) => kept(cells, keep).for_each(|(_, t)| texts.push(t)),
        Column::Other(_) => {}
    }
    texts
}

/// Which rows have a finite number in every requested column of numbers; `None` where all have.
fn complete(table: &ColumnTable, wanted: &[Wanted]) -> Option<Vec<bool>> {
    let mut keep: Option<Vec<bool>> = None;
    for wanted in wanted.iter().filter(|w| w.want != Want::Text) {
        let Some((_, Column::Numbers(values))) = table.get(wanted.index) else { continue };
        for row in values.iter().enumerate().filter(|(_, v)| !v.is_finite()).map(|(row, _)| row) {
            let keep = keep.get_or_insert_with(|| vec![true; values.len()]);
            if let Some(kept) = keep.get_mut(row) {
                *kept = false;
            }
        }
    }
    keep
}
