//! A manifest as Parquet, read row group by row group.

use std::fs::File;
use std::path::Path;

use pam_data::error::{Error, Result};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row as ParquetRow};

use super::Row;
use crate::error::FleetCode;

type Rows = Box<dyn Iterator<Item = (u64, Result<Row>)> + Send>;

/// Rows taken from the file at a time.
const BATCH: usize = 1024;

/// The names of the columns, and the rows counted from 1.
pub(super) fn open(path: &Path) -> Result<(Vec<String>, Rows)> {
    let damaged = |e: parquet::errors::ParquetError| {
        Error::new(FleetCode::ManifestInvalid, format!("the Parquet file cannot be read: {e}")).file(path)
    };
    let file = File::open(path).map_err(|e| Error::unreadable(path, &e))?;
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    let root = reader.metadata().file_metadata().schema();
    let columns: Vec<String> = root.get_fields().iter().map(|f| f.name().to_owned()).collect();
    let rows = parquet::record::reader::RowIter::from_file_into(Box::new(reader)).with_batch_size(BATCH);
    let rows = rows.zip(1..).map(|(row, number): (_, u64)| {
        let row =
            row.map_err(|e| Error::new(FleetCode::ManifestInvalid, format!("the row cannot be read: {e}")));
        (number, row.and_then(|row| cells(&row)))
    });
    Ok((columns, Box::new(rows)))
}

fn cells(row: &ParquetRow) -> Result<Row> {
    row.get_column_iter().map(|(name, field)| Ok((name.clone(), texts(name, field)?))).collect()
}

/// One value, or the values of a list; a map gives `key=value` pairs.
fn texts(name: &str, field: &Field) -> Result<Vec<String>> {
    match field {
        Field::ListInternal(list) => Ok(list
            .elements()
            .iter()
            .map(|f| text(name, f))
            .collect::<Result<Vec<_>>>()?
            .into_iter()
            .flatten()
            .collect()),
        Field::MapInternal(map) => map
            .entries()
            .iter()
            .map(|(key, value)| {
                let (key, value) = (text(name, key)?, text(name, value)?);
                Ok(format!("{}={}", key.unwrap_or_default(), value.unwrap_or_default()))
            })
            .collect(),
        one => Ok(text(name, one)?.into_iter().collect()),
    }
}

fn text(name: &str, field: &Field) -> Result<Option<String>> {
    Ok(match field {
        Field::Null => None,
        Field::Str(text) => Some(text.clone()),
        Field::Bytes(bytes) => Some(
            std::str::from_utf8(bytes.data())
                .map_err(|_| {
                    Error::new(FleetCode::ManifestInvalid, "the value is not text in UTF-8").column(name)
                })?
                .to_owned(),
        ),
        Field::Group(_) | Field::ListInternal(_) | Field::MapInternal(_) => {
            return Err(
                Error::new(FleetCode::ManifestInvalid, "the value is neither text nor number").column(name)
            );
        }
        // Dates, numbers and flags in their usual form.
        other => Some(other.to_string()),
    })
}
