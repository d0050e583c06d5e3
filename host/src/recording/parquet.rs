//! Parquet files: flat columns of numbers and of text.

use std::fs::File;

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::container::{Cells, Columns, damaged};
use crate::error::Result;

/// Rows taken at a time.
const BATCH: usize = 1 << 16;

/// The columns of a file. A missing value becomes NaN, or an empty text, so that it is told where it is needed.
pub(super) fn columns(file: File) -> Result<Columns> {
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut columns = Columns::new();
    for (index, column) in schema.columns().iter().enumerate() {
        // Lists and the like have no place in a table of rows.
        if column.max_rep_level() > 0 {
            continue;
        }
        let nullable = column.max_def_level();
        let mut numbers = Vec::new();
        let mut texts = Vec::new();
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group).map_err(damaged)?;
            match group.get_column_reader(index).map_err(damaged)? {
                ColumnReader::DoubleColumnReader(mut r) => {
                    take(&mut r, nullable, &mut numbers, f64::NAN, |v| *v)?
                }
                ColumnReader::FloatColumnReader(mut r) => {
                    take(&mut r, nullable, &mut numbers, f64::NAN, |v| f64::from(*v))?;
                }
                ColumnReader::Int32ColumnReader(mut r) => {
                    take(&mut r, nullable, &mut numbers, f64::NAN, |v| f64::from(*v))?;
                }
                ColumnReader::Int64ColumnReader(mut r) => {
                    take(&mut r, nullable, &mut numbers, f64::NAN, |v| *v as f64)?;
                }
                ColumnReader::BoolColumnReader(mut r) => {
                    take(&mut r, nullable, &mut numbers, f64::NAN, |v| f64::from(u8::from(*v)))?;
                }
                ColumnReader::ByteArrayColumnReader(mut r) => {
                    take(&mut r, nullable, &mut texts, String::new(), |v| {
                        String::from_utf8_lossy(v.data()).into_owned()
                    })?;
                }
                _ => {}
            }
        }
        let name = column.path().string();
        if !texts.is_empty() {
            columns.push((name, Cells::Texts(texts)));
        } else if !numbers.is_empty() {
            columns.push((name, Cells::Numbers(numbers)));
        }
    }
    Ok(columns)
}

fn take<D: DataType, T: Clone>(
    reader: &mut ColumnReaderImpl<D>,
    nullable: i16,
    out: &mut Vec<T>,
    absent: T,
    convert: impl Fn(&D::T) -> T,
) -> Result<()> {
    let (mut values, mut levels) = (Vec::with_capacity(BATCH), Vec::new());
    loop {
        values.clear();
        levels.clear();
        let (records, _, _) =
            reader.read_records(BATCH, Some(&mut levels), None, &mut values).map_err(damaged)?;
        if records == 0 {
            return Ok(());
        }
        if nullable == 0 {
            out.extend(values.iter().map(&convert));
        } else {
            // Values stand close together; the levels say where some are missing.
            let mut values = values.iter();
            let value = |level: &i16| match *level == nullable {
                true => values.next().map_or(absent.clone(), &convert),
                false => absent.clone(),
            };
            out.extend(levels.iter().map(value));
        }
    }
}
