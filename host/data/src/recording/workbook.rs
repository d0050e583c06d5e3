//! Sheets of Excel and OpenDocument workbooks as the text of a CSV file, so that everything that holds for text holds for them.
//!
//! Memory is bounded regardless of what a file says of itself: packed and unpacked sizes, columns, rows and cells are counted as they
//! come, and a sheet that would take more than the bound ends in an error.

mod archive;
mod grid;
mod ods;
mod xls;
mod xlsx;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::column_table::damaged;
use super::source::Source;
use crate::bounds;
use crate::error::{DataCode, Error, Result};
use grid::Grid;

/// Whether a file is a workbook by its first bytes: a ZIP archive, or the container of older Office programs.
pub(super) fn is_one(magic: &[u8]) -> bool {
    magic.starts_with(b"PK\x03\x04") || magic.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")
}

/// A sheet as text.
#[derive(Debug)]
pub(super) struct Sheet {
    pub name: String,
    pub text: Vec<u8>,
}

/// The requested sheet of a workbook, or the only one that is not empty.
pub(super) fn sheet(path: &Path, source: &mut Source, wanted: Option<&str>) -> Result<Sheet> {
    let bytes = bounds::whole(path, &mut source.reader, bounds::WHOLE)?;
    // A damaged file must end in an error, also where the reader of another library would rather panic.
    catch_unwind(AssertUnwindSafe(|| of_bytes(&bytes, wanted)))
        .unwrap_or_else(|_| Err(damaged("the workbook is damaged beyond what its reader expects")))
        .map_err(|e| {
            if e.code() == DataCode::RecordingContainer && !e.advised() {
                Error::new(DataCode::RecordingContainer, format!("no usable workbook: {}", e.cause()))
                    .help("save it again as .xlsx, or save the sheet as CSV")
            } else {
                e
            }
        })
}

fn of_bytes(bytes: &[u8], wanted: Option<&str>) -> Result<Sheet> {
    let sheets = if bytes.starts_with(b"PK") {
        match archive::kind(bytes)? {
            archive::Kind::Excel => xlsx::sheets(bytes, wanted)?,
            archive::Kind::OpenDocument => ods::sheets(bytes, wanted)?,
        }
    } else {
        xls::sheets(bytes, wanted)?
    };
    choose(sheets, wanted)
}

/// The sheets of a workbook: their names, and the cells of those that were read.
#[derive(Debug, Default)]
struct Sheets {
    names: Vec<String>,
    read: Vec<(String, Grid)>,
}

fn choose(sheets: Sheets, wanted: Option<&str>) -> Result<Sheet> {
    let Sheets { names, read } = sheets;
    if let Some(wanted) = wanted
        && !names.iter().any(|n| n == wanted)
    {
        return Err(Error::new(DataCode::CallInvalid, "the workbook has no such sheet")
            .value(wanted)
            .help(format!("its sheets are {}", names.join(", "))));
    }
    let mut full: Vec<(String, Grid)> = read.into_iter().filter(|(_, grid)| !grid.is_empty()).collect();
    if full.len() > 1 {
        let names: Vec<&str> = full.iter().map(|(name, _)| name.as_str()).collect();
        return Err(Error::new(
            DataCode::CallInvalid,
            format!("the workbook has {} sheets with contents: {}", full.len(), names.join(", ")),
        )
        .help(format!("choose one by --sheet \"{}\", or by sheet = in an import description", names[0])));
    }
    match full.pop() {
        Some((name, grid)) => Ok(Sheet { name, text: grid.into_text()? }),
        None => Err(Error::new(DataCode::RecordingEmpty, "the sheet is empty")
            .help(format!("choose another by --sheet; the workbook has {}", names.join(", ")))),
    }
}

#[cfg(test)]
mod tests;
