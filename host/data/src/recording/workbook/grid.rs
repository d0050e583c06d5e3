//! Cells to the lines of a CSV text.

use super::super::column_table::damaged;
use crate::bounds::WHOLE;
use crate::error::{DataCode, Error, Result};

/// Rows of a sheet, by the format of today's spreadsheets.
const ROWS: usize = 1 << 20;
/// A wider sheet is a picture or a matrix of coefficients, no recording.
const COLUMNS: usize = 1000;

/// The lines of a sheet, as its cells come: row by row.
#[derive(Debug, Default)]
pub(super) struct Grid {
    lines: Vec<(String, usize)>,
    width: usize,
    bytes: usize,
}

impl Grid {
    pub(super) fn is_empty(&self) -> bool {
        self.width == 0
    }

    /// Puts a cell into a row and a column, counted from 0.
    pub(super) fn put(&mut self, row: usize, column: usize, text: &str) -> Result<()> {
        if row >= ROWS || column >= COLUMNS {
            return Err(Error::new(
                DataCode::RecordingContainer,
                format!(
                    "a cell in row {}, column {}: a recording has at most {COLUMNS} columns",
                    row + 1,
                    column + 1
                ),
            )
            .help("copy the columns of the recording into a sheet of their own"));
        }
        if row + 1 < self.lines.len() {
            return Err(damaged("its rows are not in order"));
        }
        self.lines.resize(row + 1, (String::new(), 0));
        let Some((line, cells)) = self.lines.last_mut() else { return Ok(()) };
        if column < *cells {
            return Err(damaged("the cells of a row are not in order"));
        }
        let before = line.len();
        while *cells <= column {
            if *cells > 0 {
                line.push(',');
            }
            *cells += 1;
        }
        if text.contains([',', '"']) {
            *line += &format!("\"{}\"", text.replace('"', "\"\""));
        } else {
            *line += text;
        }
        self.bytes += line.len() - before;
        self.width = self.width.max(*cells);
        within(self.bytes)
    }

    /// A number, as short as it can be written without loss.
    pub(super) fn put_number(&mut self, row: usize, column: usize, value: f64) -> Result<()> {
        let usual = value == 0.0 || (1e-5..1e15).contains(&value.abs());
        let text = if usual { format!("{value}") } else { format!("{value:e}") };
        self.put(row, column, &text)
    }

    /// A text; line breaks and tabs become blanks.
    pub(super) fn put_text(&mut self, row: usize, column: usize, text: &str) -> Result<()> {
        if text.contains(['\n', '\r', '\t']) {
            self.put(row, column, &text.replace(['\n', '\r', '\t'], " "))
        } else {
            self.put(row, column, text)
        }
    }

    /// The text, every row with as many cells as the widest.
    pub(super) fn into_text(self) -> Result<Vec<u8>> {
        let missing: usize = self.lines.iter().map(|(_, cells)| self.width - cells + 2).sum();
        within(self.bytes + missing)?;
        let mut text = Vec::with_capacity(self.bytes + missing);
        for (line, cells) in self.lines {
            text.extend_from_slice(line.as_bytes());
            let delimiters = if cells == 0 { 0 } else { self.width - cells };
            text.extend(std::iter::repeat_n(b',', delimiters));
            text.push(b'\n');
        }
        Ok(text)
    }
}

fn within(bytes: usize) -> Result<()> {
    if bytes as u64 > WHOLE {
        return Err(too_large());
    }
    Ok(())
}

/// What is packed into a workbook is more than is taken into memory.
pub(super) fn too_large() -> Error {
    Error::new(DataCode::RecordingContainer, format!("the workbook unpacks to more than {} MiB", WHOLE >> 20))
        .help("save the sheet as CSV: text is read without this bound")
}
