//! Parquet files: flat columns of numbers and of text.
//!
//! A column's physical type says how its values are stored, its logical type what they mean: a time of day is stored as an
//! integer, and must not be taken for seconds. A column that is not numeric is an error only where it is needed.

mod footer;

use std::fs::File;

use parquet::basic::{ConvertedType, LogicalType};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::file::metadata::FileMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::column_table::{Column, ColumnTable, damaged};
use crate::bounds::Budget;
use crate::error::Result;

/// Rows taken at a time.
const BATCH: usize = 1 << 16;

/// The columns of a file. A missing value becomes NaN, or an empty text, and is an error only where it is needed.
pub(super) fn columns(mut file: File) -> Result<ColumnTable> {
    footer::check(&mut file)?;
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    let about = reader.metadata().file_metadata();
    let durations = durations(about);
    let mut table = ColumnTable::new();
    let mut budget = Budget::default();
    for (index, column) in about.schema_descr().columns().iter().enumerate() {
        let name = column.path().string();
        let meaning = if durations.contains(&name) { Err("durations") } else { meaning(column) };
        let content = match meaning {
            Ok(scale) => values(&reader, index, column.max_def_level(), scale, &mut budget)?,
            Err(what) => Column::Other(what.to_owned()),
        };
        table.push((name, content));
    }
    Ok(table)
}

/// By what a column's stored numbers are to be multiplied, or what it is instead of a column of numbers.
fn meaning(column: &ColumnDescriptor) -> std::result::Result<f64, &'static str> {
    if column.max_rep_level() > 0 {
        return Err("lists");
    }
    let decimal = |scale: i32| 10.0_f64.powi(-scale);
    match column.logical_type_ref() {
        Some(LogicalType::Timestamp(_)) => return Err("dates"),
        Some(LogicalType::Date) => return Err("dates"),
        Some(LogicalType::Time(_)) => return Err("times of day"),
        Some(LogicalType::Decimal(d)) => return Ok(decimal(d.scale)),
        _ => {}
    }
    match column.converted_type() {
        ConvertedType::DATE | ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIMESTAMP_MICROS => {
            Err("dates")
        }
        ConvertedType::TIME_MILLIS | ConvertedType::TIME_MICROS => Err("times of day"),
        ConvertedType::INTERVAL => Err("durations"),
        ConvertedType::DECIMAL => Ok(decimal(column.type_scale())),
        _ => Ok(1.0),
    }
}

/// The columns that pandas wrote of durations: Parquet has no type for these, and stores bare integers.
fn durations(about: &FileMetaData) -> Vec<String> {
    let pandas = about.key_value_metadata().into_iter().flatten().find(|pair| pair.key == "pandas");
    let Some(text) = pandas.and_then(|pair| pair.value.as_deref()) else { return Vec::new() };
    let Ok(value) = serde_json::from_str::<serde_json::Value>(text) else { return Vec::new() };
    let of = |column: &serde_json::Value| {
        let stored = column.get("numpy_type")?.as_str()?;
        stored.starts_with("timedelta64").then(|| column.get("field_name")?.as_str().map(str::to_owned))?
    };
    value.get("columns").and_then(|c| c.as_array()).into_iter().flatten().filter_map(of).collect()
}

/// All values of one column.
fn values(
    reader: &SerializedFileReader<File>,
    index: usize,
    nullable: i16,
    scale: f64,
    budget: &mut Budget,
) -> Result<Column> {
    let (mut numbers, mut texts) = (Vec::new(), Vec::new());
    let column = reader.metadata().file_metadata().schema_descr().column(index);
    let unsigned = matches!(column.logical_type_ref(), Some(LogicalType::Integer(i)) if !i.is_signed)
        || matches!(
            column.converted_type(),
            ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64
        );
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(damaged)?;
        match group.get_column_reader(index).map_err(damaged)? {
            ColumnReader::DoubleColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| *v, |_| 0)?;
            }
            ColumnReader::FloatColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| f64::from(*v), |_| 0)?;
            }
            ColumnReader::Int32ColumnReader(mut r) => take(
                &mut r,
                nullable,
                budget,
                &mut numbers,
                f64::NAN,
                |v| scale * if unsigned { f64::from(v.cast_unsigned()) } else { f64::from(*v) },
                |_| 0,
            )?,
            ColumnReader::Int64ColumnReader(mut r) => take(
                &mut r,
                nullable,
                budget,
                &mut numbers,
                f64::NAN,
                |v| scale * if unsigned { v.cast_unsigned() as f64 } else { *v as f64 },
                |_| 0,
            )?,
            ColumnReader::BoolColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| f64::from(u8::from(*v)), |_| 0)?;
            }
            ColumnReader::ByteArrayColumnReader(mut r) if scale == 1.0 => {
                let text = |v: &ByteArray| String::from_utf8_lossy(v.data()).into_owned();
                take(&mut r, nullable, budget, &mut texts, String::new(), text, ByteArray::len)?;
            }
            _ => return Ok(Column::Other("bytes".to_owned())),
        }
    }
    Ok(if texts.is_empty() { Column::Numbers(numbers) } else { Column::Texts(texts) })
}

fn take<D: DataType, T: Clone>(
    reader: &mut ColumnReaderImpl<D>,
    nullable: i16,
    budget: &mut Budget,
    out: &mut Vec<T>,
    absent: T,
    convert: impl Fn(&D::T) -> T,
    bytes: impl Fn(&D::T) -> usize,
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
        // A text takes three words at least, and what it says comes on top: a file holds it once, however many rows it is in.
        let said: usize = values.iter().map(&bytes).sum();
        budget.take(records * size_of::<T>().div_ceil(size_of::<f64>()) + said / size_of::<f64>())?;
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use parquet::data_type::ByteArrayType;
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;

    use super::*;

    /// A file with one column of texts, each row the same: it holds the text once.
    fn repeated(text: &str, rows: usize) -> File {
        let file = tempfile::tempfile().expect("a file");
        let schema =
            Arc::new(parse_message_type("message m { required binary x (UTF8); }").expect("a schema"));
        let properties = WriterProperties::builder().set_dictionary_enabled(true);
        let properties = Arc::new(properties.set_dictionary_page_size_limit(1 << 30).build());
        let copy = file.try_clone().expect("a second handle");
        let mut writer = SerializedFileWriter::new(copy, schema, properties).expect("a writer");
        let mut group = writer.next_row_group().expect("a group");
        let mut column = group.next_column().expect("written").expect("a column");
        let values = vec![ByteArray::from(text); rows];
        column.typed::<ByteArrayType>().write_batch(&values, None, None).expect("written");
        column.close().expect("closed");
        group.close().expect("closed");
        writer.close().expect("closed");
        file
    }

    #[test]
    fn a_text_in_every_row_is_counted_in_every_row() {
        let few = columns(repeated("load", 1_000)).expect("columns");
        assert!(matches!(&few[0].1, Column::Texts(texts) if texts.len() == 1_000));
        let file = repeated(&"x".repeat(1 << 20), 1_000);
        assert!(file.metadata().expect("its size").len() < 4 << 20, "the file is small");
        let error = columns(file).expect_err("a gigabyte of text");
        assert!(error.cause().contains("million values"), "{error}");
    }
}
