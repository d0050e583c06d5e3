//! Excel workbooks since 2007.

use std::io::Cursor;

use calamine::{DataRef, Reader, Xlsx};

use super::super::column_table::damaged;
use super::Sheets;
use super::grid::Grid;
use crate::error::Result;

/// The names of all sheets, and the cells of the requested one, or of all.
pub(super) fn sheets(bytes: &[u8], wanted: Option<&str>) -> Result<Sheets> {
    let mut book: Xlsx<_> = Xlsx::new(Cursor::new(bytes)).map_err(damaged)?;
    let names = book.sheet_names();
    let mut read: Vec<(String, Grid)> = Vec::new();
    for name in names.iter().filter(|n| wanted.is_none_or(|w| w == *n)) {
        let mut grid = Grid::default();
        // A sheet of charts has no cells.
        let Ok(mut cells) = book.worksheet_cells_reader(name) else { continue };
        // Of a second sheet with contents only its name is needed.
        let one = read.iter().any(|(_, g)| !g.is_empty());
        while let Some(cell) = cells.next_cell().map_err(damaged)? {
            let (row, column) = cell.get_position();
            put(&mut grid, row as usize, column as usize, cell.get_value())?;
            if one && !grid.is_empty() {
                break;
            }
        }
        read.push((name.clone(), grid));
    }
    Ok(Sheets { names, read })
}

fn put(grid: &mut Grid, row: usize, column: usize, value: &DataRef<'_>) -> Result<()> {
    match value {
        DataRef::Empty => Ok(()),
        DataRef::Int(v) => grid.put(row, column, &v.to_string()),
        DataRef::Float(v) => grid.put_number(row, column, *v),
        DataRef::Bool(v) => grid.put(row, column, if *v { "1" } else { "0" }),
        DataRef::String(text) => grid.put_text(row, column, text),
        DataRef::SharedString(text) => grid.put_text(row, column, text),
        DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => grid.put_text(row, column, text),
        DataRef::DateTime(when) => {
            let (year, month, day, hour, minute, second, milli) = when.to_ymd_hms_milli();
            // Written as a date, so that the reader's own message says what to do about it.
            grid.put(
                row,
                column,
                &format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}.{milli:03}"),
            )
        }
        DataRef::Error(error) => grid.put_text(row, column, &error.to_string()),
    }
}
