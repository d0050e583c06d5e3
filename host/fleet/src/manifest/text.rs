//! A manifest as text: CSV, separated by commas, semicolons or tabs.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use pam_data::error::{Error, Result};

use super::Row;
use crate::error::FleetCode;

/// A header line is not longer than this; what is longer is not a manifest.
const LONGEST_HEADER: u64 = 1 << 16;

type Rows = Box<dyn Iterator<Item = (u64, Result<Row>)> + Send>;

/// The names of the columns, and the rows with their line numbers. A row that cannot be decoded is an error of its own.
pub(super) fn open(path: &Path) -> Result<(Vec<String>, Rows)> {
    let file = File::open(path).map_err(|e| Error::unreadable(path, &e))?;
    let mut reader = BufReader::new(file);
    let mut first = Vec::new();
    Read::by_ref(&mut reader)
        .take(LONGEST_HEADER)
        .read_until(b'\n', &mut first)
        .map_err(|e| Error::unreadable(path, &e))?;
    let header = std::str::from_utf8(&first).map_err(|_| {
        Error::new(FleetCode::ManifestInvalid, "the manifest is not text in UTF-8").file(path).line(1)
    })?;
    let header = header.trim_start_matches('\u{feff}').trim_end();
    if header.is_empty() {
        return Err(Error::new(FleetCode::ManifestInvalid, "the manifest has no header line").file(path));
    }
    // Within cells `;` separates values, so that commas are the usual separator of cells; a header shows which it is.
    let delimiter = [b',', b'\t', b';']
        .into_iter()
        .max_by_key(|d| (header.bytes().filter(|b| b == d).count(), *d == b','));
    let delimiter = delimiter.unwrap_or(b',');
    let columns: Vec<String> =
        header.split(char::from(delimiter)).map(|c| c.trim().trim_matches('"').to_owned()).collect();
    let reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .from_reader(reader);
    let names = columns.clone();
    let rows = reader.into_byte_records().map(move |record| match record {
        Ok(record) => {
            // The header was read before, and lines count from 1.
            let line = record.position().map_or(0, csv::Position::line) + 1;
            (line, cells(&names, &record))
        }
        Err(e) => {
            let line = e.position().map_or(0, csv::Position::line) + 1;
            (line, Err(Error::new(FleetCode::ManifestInvalid, format!("the row cannot be read: {e}"))))
        }
    });
    Ok((columns, Box::new(rows)))
}

fn cells(names: &[String], record: &csv::ByteRecord) -> Result<Row> {
    if record.len() != names.len() {
        return Err(Error::new(
            FleetCode::ManifestInvalid,
            format!("the row has {} cells, the header {}", record.len(), names.len()),
        )
        .help("put cells that contain a separator into double quotes"));
    }
    let cell = |(name, bytes): (&String, &[u8])| {
        let text = std::str::from_utf8(bytes).map_err(|_| {
            Error::new(FleetCode::ManifestInvalid, "the row is not text in UTF-8")
                .column(name)
                .value(String::from_utf8_lossy(bytes))
                .help("save the manifest as UTF-8")
        })?;
        Ok((name.clone(), vec![text.to_owned()]))
    };
    names.iter().zip(record.iter()).map(cell).collect()
}
