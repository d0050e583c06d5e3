//! Parquet files: flat columns of numbers and of text.
//!
//! A column's physical type says how its values are stored, its logical type what they mean: a time of day is stored as an
//! integer, and must not be taken for seconds. A column that is not numeric is an error only where it is needed.

use std::fs::File;

use parquet::basic::{ConvertedType, LogicalType};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::file::metadata::FileMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::column_table::{Column, ColumnTable, damaged};
use crate::bounds::Budget;
use crate::error::Result;

/// Rows taken at a time.
const BATCH: usize = 1 << 16;

/// The columns of a file. A missing value becomes NaN, or an empty text, and is an error only where it is needed.
pub(super) fn columns(file: File) -> Result<ColumnTable> {
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
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| *v)?;
            }
            ColumnReader::FloatColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| f64::from(*v))?;
            }
            ColumnReader::Int32ColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| {
                    scale * if unsigned { f64::from(v.cast_unsigned()) } else { f64::from(*v) }
                })?
            }
            ColumnReader::Int64ColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| {
                    scale * if unsigned { v.cast_unsigned() as f64 } else { *v as f64 }
                })?
            }
            ColumnReader::BoolColumnReader(mut r) => {
                take(&mut r, nullable, budget, &mut numbers, f64::NAN, |v| f64::from(u8::from(*v)))?;
            }
            ColumnReader::ByteArrayColumnReader(mut r) if scale == 1.0 => {
                take(&mut r, nullable, budget, &mut texts, String::new(), |v| {
                    String::from_utf8_lossy(v.data()).into_owned()
                })?;
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
        // A text takes three words at least; what it says comes on top, and is in the file.
        budget.take(records * size_of::<T>().div_ceil(size_of::<f64>()))?;
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
