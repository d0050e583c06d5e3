//! Named columns as they are in a container: not yet chosen, not yet in SI.

use super::blocks::Rows;
use super::cells::{Want, Wanted};
use super::import::Missing;
use super::words::Words;
use crate::date::time_stamp_in;
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

/// Takes the requested columns, as numbers in SI or as words. Where text errors name a line, these name the row, counted from 1.
pub(super) fn select(table: &ColumnTable, wanted: &[Wanted], missing: Missing) -> Result<Rows> {
    let mut rows = Rows::default();
    let keep = if missing == Missing::Skip { complete(table, wanted) } else { None };
    let kept = |row: &usize| keep.as_ref().is_none_or(|k| k.get(*row).copied().unwrap_or(true));
    let mut length: Option<(usize, &str)> = None;
    for wanted in wanted {
        let Some((name, column)) = table.get(wanted.index) else { continue };
        let count = match column {
            Column::Numbers(n) => n.len(),
            Column::Texts(t) => t.len(),
            Column::Other(what) => {
                return Err(Error::new(
                    DataCode::RecordingNotANumber,
                    format!("a column of {what} where numbers are needed"),
                )
                .column(name)
                .help("save the column as numbers, in the unit that its name says"));
            }
        };
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
        let (mut numbers, mut words) = (Vec::new(), Words::default());
        match (wanted.want, column) {
            (Want::Number { scale, offset }, Column::Numbers(values)) => {
                let bad = values.iter().enumerate().position(|(row, v)| !v.is_finite() && kept(&row));
                if let Some(row) = bad {
                    return Err(Error::new(DataCode::RecordingNotFinite, "not a finite number")
                        .line(row as u64 + 1)
                        .column(name)
                        .value(values[row].to_string())
                        .help("leave such rows out by --missing skip (missing = \"skip\" in an import description)"));
                }
                let values = values.iter().enumerate().filter(|(row, _)| kept(row));
                numbers = values.map(|(_, v)| v * scale + offset).collect();
            }
            (Want::Stamp { scale, offset, order }, Column::Texts(texts)) => {
                let texts = texts.iter().enumerate().filter(|(row, _)| kept(row));
                let stamp = |(row, text): (usize, &String)| {
                    let seconds = time_stamp_in(text, order).ok_or_else(|| {
                        Error::new(DataCode::RecordingNotANumber, "not a time stamp")
                            .line(row as u64 + 1)
                            .column(name)
                            .value(text)
                            .help("time stamps are like 2026-11-21T13:30:00.25, or 13:30:00.25")
                    })?;
                    Ok(seconds * scale + offset)
                };
                numbers = texts.map(stamp).collect::<Result<_>>()?;
            }
            (Want::Stamp { .. }, Column::Numbers(values)) => {
                return Err(Error::new(
                    DataCode::RecordingNotANumber,
                    "a column of numbers where time stamps are needed",
                )
                .column(name)
                .value(values.first().map_or(String::new(), f64::to_string))
                .help("give the unit of the numbers in the import description: s or ms"));
            }
            (Want::Number { .. }, Column::Texts(texts)) => {
                return Err(Error::new(
                    DataCode::RecordingNotANumber,
                    "a column of text where numbers are needed",
                )
                .column(name)
                .value(texts.first().map_or("", String::as_str))
                .help("save the column as numbers"));
            }
            (Want::Text, Column::Numbers(values)) => {
                let values = values.iter().enumerate().filter(|(row, _)| kept(row));
                values.for_each(|(_, v)| words.push(&v.to_string()));
            }
            (Want::Text, Column::Texts(texts)) => {
                let texts = texts.iter().enumerate().filter(|(row, _)| kept(row));
                texts.for_each(|(_, t)| words.push(t));
            }
            (_, Column::Other(_)) => {}
        }
        rows.numbers.push(numbers);
        rows.texts.push(words);
    }
    rows.rows = length.map_or(0, |(n, _)| n);
    if let Some(keep) = &keep {
        rows.leave_out(keep);
    }
    Ok(rows)
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
