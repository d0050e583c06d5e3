//! Columns of the table beside the file.

use std::collections::HashMap;

use super::super::blocks::Rows;
use super::super::cells::Want;
use super::super::column_plan::{LookedUp, Role};
use super::super::import::Lookup;
use super::super::text_column::TextColumn;
use super::{Job, LookupTable, Table, number, same};
use crate::date::time_stamp_in;
use crate::error::{DataCode, Error, Result};

/// Reads them for each row.
pub(super) fn look_up(
    job: &Job<'_>,
    rows: &Rows,
    table: &mut Table,
    keys: &HashMap<usize, TextColumn>,
    lookup: &LookupTable,
) -> Result<()> {
    let Some(described) = &job.import.lookup else { return Ok(()) };
    let lines = lines_of_rows(job, described, rows, keys, lookup)?;
    for column in &job.plan.looked_up {
        let name = &lookup.header[column.index];
        let cell = |line: &[String]| line.get(column.index).cloned().unwrap_or_default();
        match &column.role {
            Role::Quantity(q) | Role::Coded(q, _) => {
                let value = |l: &&Vec<String>| {
                    value(&cell(l), column).map_err(|e| e.file(&described.file).column(name))
                };
                table.quantities.insert(*q, lines.iter().map(value).collect::<Result<_>>()?);
            }
            Role::Split(n) => lines.iter().for_each(|l| table.splits[*n].push(&cell(l))),
            Role::Filter(n) => lines.iter().for_each(|l| table.filters[*n].push(&cell(l))),
            Role::Key(_) | Role::TimePart => {}
        }
    }
    Ok(())
}

/// For each row the line of the table whose keys are the row's.
fn lines_of_rows<'a>(
    job: &Job<'_>,
    described: &Lookup,
    rows: &Rows,
    keys: &HashMap<usize, TextColumn>,
    lookup: &'a LookupTable,
) -> Result<Vec<&'a Vec<String>>> {
    let file = job.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut columns = Vec::new();
    for (n, theirs) in described.keys.keys().enumerate() {
        let index = lookup.header.iter().position(|h| h == theirs).ok_or_else(|| {
            Error::new(DataCode::ImportInvalid, format!("the lookup table has no column `{theirs}`"))
                .file(&described.file)
                .help(format!("it has {}", lookup.header.join(", ")))
        })?;
        columns.push((index, keys.get(&n)));
    }
    let find = |row: usize| {
        let wanted: Vec<&str> =
            columns.iter().map(|(_, texts)| texts.map_or(file.as_str(), |w| w.get(row))).collect();
        let fits = |line: &&Vec<String>| {
            columns
                .iter()
                .zip(&wanted)
                .all(|((i, _), want)| line.get(*i).is_some_and(|have| same(have, want)))
        };
        lookup.rows.iter().find(fits).ok_or_else(|| {
            Error::new(
                DataCode::ImportInvalid,
                format!("{} has no line for {}", described.file, wanted.join(", ")),
            )
            .line(job.first_line + rows.map.line(row))
            .help("complete the lookup table, or leave these rows out by [where]")
        })
    };
    let mut last: Option<(Vec<u32>, &Vec<String>)> = None;
    let mut lines = Vec::with_capacity(rows.rows);
    for row in 0..rows.rows {
        let code: Vec<u32> =
            columns.iter().map(|(_, w)| w.and_then(|w| w.codes.get(row).copied()).unwrap_or(0)).collect();
        let line = match &last {
            Some((previous, line)) if *previous == code => *line,
            _ => find(row)?,
        };
        last = Some((code, line));
        lines.push(line);
    }
    Ok(lines)
}

/// The number of a cell of the table, in SI.
fn value(cell: &str, column: &LookedUp) -> Result<f64> {
    let error = |cause: &str| Error::new(DataCode::RecordingNotANumber, cause.to_owned()).value(cell);
    match (column.want, &column.role) {
        (Want::Number { scale, offset }, _) => {
            let value = number(cell).filter(|v| v.is_finite()).map(|v| v * scale + offset);
            value.ok_or_else(|| error("not a number in the lookup table"))
        }
        (Want::Text, Role::Coded(_, values)) => {
            values.get(cell.trim()).copied().ok_or_else(|| error("a word without a value"))
        }
        (Want::Stamp { scale, offset, order }, _) => {
            let seconds = time_stamp_in(cell, order).map(|v| v * scale + offset);
            seconds.ok_or_else(|| error("not a time stamp in the lookup table"))
        }
        (Want::Text | Want::Date { .. }, _) => Ok(0.0),
    }
}
