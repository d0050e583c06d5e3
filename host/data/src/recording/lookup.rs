//! The lookup table of an import description.

use std::path::Path;

use super::assemble::LookupTable;
use super::cells::Dialect;
use super::line::Cells;
use super::source;
use crate::bounds;
use crate::error::{DataCode, Error, Result};

/// Reads a table from the folder of a recording.
pub(super) fn read_lookup(recording: &Path, file: &str) -> Result<LookupTable> {
    let path = recording.parent().unwrap_or(Path::new("")).join(file);
    let text = bounds::read(&path, bounds::WRITTEN).map_err(|e| {
        e.help("the lookup table of an import description belongs in the folder of the recording")
    })?;
    let text = &text[source::check_text(&text).map_err(|e| e.file(&path))?..];
    let mut lines = text.split(|b| *b == b'\n').enumerate().filter(|(_, l)| !l.trim_ascii().is_empty());
    let mut table = LookupTable::default();
    let Some((_, header)) = lines.next() else {
        return Err(Error::new(DataCode::RecordingEmpty, "the lookup table is empty").file(&path));
    };
    let delimiter = if header.contains(&b'\t') { b'\t' } else { b',' };
    let dialect =
        Dialect { delimiter, comment: None, decimal_comma: false, thousands: None, skip_missing: false };
    let open = |line: usize| {
        Error::new(DataCode::RecordingWrongWidth, "a quotation mark is not closed")
            .file(&path)
            .line(line as u64 + 1)
    };
    table.header = Cells::split(header, dialect).map_err(|()| open(0))?;
    for (n, line) in lines {
        table.rows.push(Cells::split(line, dialect).map_err(|()| open(n))?);
    }
    Ok(table)
}
