//! Named columns of text, numbers, counts and flags, as Parquet and back.

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::reader::{ColumnReader, get_typed_column_reader};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use std::sync::Arc;

/// The values of one column; a missing value is `None`.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// UTF-8 text.
    Text(Vec<Option<String>>),
    /// Double precision; what is not finite is stored as missing.
    Number(Vec<Option<f64>>),
    /// Whole numbers.
    Count(Vec<Option<i64>>),
    /// True or false.
    Flag(Vec<Option<bool>>),
}

impl Values {
    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Text(v) => v.len(),
            Self::Number(v) => v.len(),
            Self::Count(v) => v.len(),
            Self::Flag(v) => v.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends the values of another column of the same type; of another type, missing values.
    pub fn append(&mut self, other: Self) {
        let rows = other.len();
        match (self, other) {
            (Self::Text(a), Self::Text(b)) => a.extend(b),
            (Self::Number(a), Self::Number(b)) => a.extend(b),
            (Self::Count(a), Self::Count(b)) => a.extend(b),
            (Self::Flag(a), Self::Flag(b)) => a.extend(b),
            (a, _) => a.pad(rows),
        }
    }

    /// Appends missing values.
    pub fn pad(&mut self, rows: usize) {
        match self {
            Self::Text(v) => v.resize(v.len() + rows, None),
            Self::Number(v) => v.resize(v.len() + rows, None),
            Self::Count(v) => v.resize(v.len() + rows, None),
            Self::Flag(v) => v.resize(v.len() + rows, None),
        }
    }

    fn schema(&self, name: &str) -> Result<Type> {
        let (physical, logical) = match self {
            Self::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Self::Number(_) => (Physical::DOUBLE, None),
            Self::Count(_) => (Physical::INT64, None),
            Self::Flag(_) => (Physical::BOOLEAN, None),
        };
        Type::primitive_type_builder(name, physical)
            .with_logical_type(logical)
            .with_repetition(Repetition::OPTIONAL)
            .build()
    }
}

/// A table: columns of equal length in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Columns(pub Vec<(String, Values)>);

impl Columns {
    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.0.first().map_or(0, |(_, v)| v.len())
    }

    /// A column by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Values> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, v)| v)
    }

    /// A text of a row; `None` where it is missing or no text.
    #[must_use]
    pub fn text(&self, name: &str, row: usize) -> Option<&str> {
        match self.get(name)? {
            Values::Text(v) => v.get(row)?.as_deref(),
            _ => None,
        }
    }

    /// A number of a row, also of a column of counts.
    #[must_use]
    pub fn number(&self, name: &str, row: usize) -> Option<f64> {
        match self.get(name)? {
            Values::Number(v) => *v.get(row)?,
            Values::Count(v) => v.get(row)?.map(|c| c as f64),
            _ => None,
        }
    }

    /// A flag of a row.
    #[must_use]
    pub fn flag(&self, name: &str, row: usize) -> Option<bool> {
        match self.get(name)? {
            Values::Flag(v) => *v.get(row)?,
            _ => None,
        }
    }

    /// Appends the rows of another table; columns that only one of them has are filled with missing values.
    pub fn append(&mut self, other: Self) {
        let (before, added) = (self.rows(), other.rows());
        for (name, values) in other.0 {
            match self.0.iter_mut().find(|(n, _)| *n == name) {
                Some((_, there)) => there.append(values),
                None => {
                    let mut fresh = match values {
                        Values::Text(_) => Values::Text(Vec::new()),
                        Values::Number(_) => Values::Number(Vec::new()),
                        Values::Count(_) => Values::Count(Vec::new()),
                        Values::Flag(_) => Values::Flag(Vec::new()),
                    };
                    fresh.pad(before);
                    fresh.append(values);
                    self.0.push((name, fresh));
                }
            }
        }
        for (_, values) in &mut self.0 {
            if values.len() < before + added {
                values.pad(before + added - values.len());
            }
        }
    }

    /// The bytes of a Parquet file; `about` goes into its footer.
    ///
    /// # Errors
    /// None in practice: all columns have the same length.
    pub(crate) fn to_parquet(&self, about: &[(&str, &str)]) -> Result<Vec<u8>> {
        let fields =
            self.0.iter().map(|(n, v)| v.schema(n).map(Arc::new)).collect::<Result<Vec<TypePtr>>>()?;
        let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
        let pairs = about.iter().map(|(k, v)| KeyValue::new((*k).to_owned(), (*v).to_owned())).collect();
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_key_value_metadata(Some(pairs))
            .build();
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
        if self.rows() > 0 {
            let mut group = writer.next_row_group()?;
            for (_, values) in &self.0 {
                match values {
                    Values::Text(v) => {
                        write::<ByteArrayType, _>(&mut group, v, |t| Some(ByteArray::from(t.as_str())))?;
                    }
                    Values::Number(v) => {
                        write::<DoubleType, _>(&mut group, v, |n| n.is_finite().then_some(*n))?
                    }
                    Values::Count(v) => write::<Int64Type, _>(&mut group, v, |n| Some(*n))?,
                    Values::Flag(v) => write::<BoolType, _>(&mut group, v, |f| Some(*f))?,
                }
            }
            group.close()?;
        }
        writer.close()?;
        Ok(bytes)
    }

    /// Reads a Parquet file with flat columns of these four types.
    ///
    /// # Errors
    /// Damaged files, other types.
    pub fn from_parquet(file: impl ChunkReader + 'static) -> Result<Self> {
        let reader = SerializedFileReader::new(file)?;
        let mut table = Self::default();
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        for (index, column) in schema.columns().iter().enumerate() {
            let mut all = match column.physical_type() {
                Physical::BYTE_ARRAY => Values::Text(Vec::new()),
                Physical::DOUBLE => Values::Number(Vec::new()),
                Physical::INT64 => Values::Count(Vec::new()),
                Physical::BOOLEAN => Values::Flag(Vec::new()),
                other => return Err(ParquetError::General(format!("a column of type {other}"))),
            };
            for group in 0..reader.num_row_groups() {
                let group = reader.get_row_group(group)?;
                let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
                let column = group.get_column_reader(index)?;
                match &mut all {
                    Values::Text(v) => read::<ByteArrayType, _>(column, rows, v, |b| {
                        String::from_utf8_lossy(b.data()).into_owned()
                    })?,
                    Values::Number(v) => read::<DoubleType, _>(column, rows, v, |n| *n)?,
                    Values::Count(v) => read::<Int64Type, _>(column, rows, v, |n| *n)?,
                    Values::Flag(v) => read::<BoolType, _>(column, rows, v, |f| *f)?,
                }
            }
            table.0.push((column.name().to_owned(), all));
        }
        let rows = table.rows();
        match table.0.iter().any(|(_, v)| v.len() != rows) {
            true => Err(ParquetError::General("columns of different length".into())),
            false => Ok(table),
        }
    }
}

/// A value of the footer of a Parquet file.
pub(crate) fn footer(file: impl ChunkReader + 'static, key: &str) -> Option<String> {
    let reader = SerializedFileReader::new(file).ok()?;
    let pairs = reader.metadata().file_metadata().key_value_metadata()?;
    pairs.iter().find(|p| p.key == key)?.value.clone()
}

/// The number of rows of a Parquet file; 0 where it cannot be read.
pub(crate) fn rows(file: impl ChunkReader + 'static) -> i64 {
    SerializedFileReader::new(file).map_or(0, |r| r.metadata().file_metadata().num_rows())
}

fn write<T: DataType, V>(
    group: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>,
    values: &[Option<V>],
    convert: impl Fn(&V) -> Option<T::T>,
) -> Result<()> {
    let converted: Vec<Option<T::T>> = values.iter().map(|v| v.as_ref().and_then(&convert)).collect();
    let levels: Vec<i16> = converted.iter().map(|v| i16::from(v.is_some())).collect();
    let present: Vec<T::T> = converted.into_iter().flatten().collect();
    let mut column =
        group.next_column()?.ok_or_else(|| ParquetError::General("more columns than types".into()))?;
    column.typed::<T>().write_batch(&present, Some(&levels), None)?;
    column.close()
}

fn read<T: DataType, V>(
    column: ColumnReader,
    rows: usize,
    out: &mut Vec<Option<V>>,
    convert: impl Fn(&T::T) -> V,
) -> Result<()> {
    let mut reader = get_typed_column_reader::<T>(column);
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let mut taken = 0;
    while taken < rows {
        values.clear();
        levels.clear();
        let (records, _, _) = reader.read_records(rows - taken, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::EOF("a column ends early".into()));
        }
        taken += records;
        if levels.is_empty() {
            out.extend(values.iter().map(|v| Some(convert(v))));
        } else {
            let mut present = values.iter();
            out.extend(levels.iter().map(|l| if *l > 0 { present.next().map(&convert) } else { None }));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Columns {
        Columns(vec![
            ("name".into(), Values::Text(vec![Some("a".into()), None])),
            ("x".into(), Values::Number(vec![Some(1.5), Some(f64::NAN)])),
            ("n".into(), Values::Count(vec![None, Some(-3)])),
            ("ok".into(), Values::Flag(vec![Some(true), Some(false)])),
        ])
    }

    #[test]
    fn written_columns_are_read_back_and_nan_is_missing() {
        let bytes = example().to_parquet(&[("key", "7")]).expect("written");
        let again = Columns::from_parquet(bytes::Bytes::from(bytes.clone())).expect("read");
        let mut expected = example();
        expected.0[1].1 = Values::Number(vec![Some(1.5), None]);
        assert_eq!(again, expected);
        assert_eq!(
            bytes,
            example().to_parquet(&[("key", "7")]).expect("written"),
            "the same bytes each time"
        );
    }

    #[test]
    fn a_table_without_rows_keeps_its_columns() {
        let empty = Columns(vec![("x".into(), Values::Number(Vec::new()))]);
        let bytes = empty.to_parquet(&[]).expect("written");
        assert_eq!(Columns::from_parquet(bytes::Bytes::from(bytes)).expect("read"), empty);
    }

    #[test]
    fn columns_of_one_side_only_are_missing_on_the_other() {
        let mut all = example();
        all.append(Columns(vec![
            ("y".into(), Values::Count(vec![Some(1)])),
            ("x".into(), Values::Number(vec![None])),
        ]));
        assert_eq!(all.rows(), 3);
        assert!(all.0.iter().all(|(_, v)| v.len() == 3));
        assert_eq!((all.number("y", 0), all.number("y", 2), all.text("name", 2)), (None, Some(1.0), None));
    }

    #[test]
    fn damaged_files_are_refused() {
        let bytes = example().to_parquet(&[]).expect("written");
        for cut in [0, 3, bytes.len() / 2, bytes.len() - 1] {
            assert!(Columns::from_parquet(bytes::Bytes::from(bytes[..cut].to_vec())).is_err(), "{cut}");
        }
    }
}
