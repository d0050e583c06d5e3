//! MATLAB files of version 7.3, which are HDF5, and plain HDF5 files, such as h5py and pandas write.
//!
//! Vectors are columns; so are the columns of a matrix, the fields of a table (a compound type) and the blocks of a pandas
//! frame in its fixed form. Groups put their name in front, `run.time_s`, unless all columns share it.

use std::io::Read;
use std::path::Path;

use hdf5_reader::group::Group;
use hdf5_reader::{CompoundField, Dataset, Datatype, Hdf5File, OpenOptions};

use super::column_table::{Column, ColumnTable, damaged, matrix, without_common_prefix};
use crate::bounds::{Budget, WHOLE};
use crate::error::{Error, Result};

/// A recording is at most this many groups deep.
const DEEPEST: usize = 4;
/// Groups and data sets that are read. A recording has some dozens; a few links from a group to itself make millions of a small file.
const MEMBERS: usize = 10_000;

/// The columns of a file.
pub(super) fn columns(path: &Path) -> Result<ColumnTable> {
    let mut first = Vec::new();
    let start = std::fs::File::open(path).and_then(|f| f.take(10).read_to_end(&mut first));
    start.map_err(|e| Error::unreadable(path, &e))?;
    let options = OpenOptions::default().with_max_read_bytes(WHOLE as usize);
    let file = Hdf5File::open_with_options(path, options).map_err(damaged)?;
    let mut found = Found {
        table: ColumnTable::new(),
        matlab: first == *b"MATLAB 7.3",
        budget: Budget::whole(),
        left: MEMBERS,
    };
    found.group(&file.root_group().map_err(damaged)?, "", 0)?;
    Ok(without_common_prefix(found.table))
}

struct Found {
    table: ColumnTable,
    /// MATLAB stores column by column, so that its dimensions appear in reverse.
    matlab: bool,
    budget: Budget,
    /// Groups and data sets that may still be read.
    left: usize,
}

impl Found {
    fn count(&mut self) -> Result<()> {
        let more = || damaged(format!("it has more than {MEMBERS} groups and data sets"));
        self.left = self.left.checked_sub(1).ok_or_else(more)?;
        Ok(())
    }

    fn group(&mut self, group: &Group, prefix: &str, depth: usize) -> Result<()> {
        self.count()?;
        if text_of(group.attribute("pandas_type").ok()).as_deref() == Some("frame") {
            return self.frame(group, prefix);
        }
        let (groups, datasets) = group.members().map_err(damaged)?;
        for dataset in &datasets {
            self.dataset(dataset, &format!("{prefix}{}", last(dataset.name())))?;
        }
        // Groups that begin like this are MATLAB's own.
        for group in groups.iter().filter(|g| !last(g.name()).starts_with('#')) {
            if depth < DEEPEST {
                self.group(group, &format!("{prefix}{}.", last(group.name())), depth + 1)?;
            }
        }
        Ok(())
    }

    /// The bytes of a data set, where there is room for all its values.
    fn bytes(&mut self, dataset: &Dataset, values_per_element: usize) -> Result<Vec<u8>> {
        let elements = dataset.shape().iter().try_fold(1_u64, |n, side| n.checked_mul(*side));
        let elements = elements.and_then(|n| usize::try_from(n).ok());
        let values = elements.and_then(|n| n.checked_mul(values_per_element.max(1)));
        self.budget.take(values.unwrap_or(usize::MAX))?;
        dataset.read_native_bytes().map_err(damaged)
    }

    fn dataset(&mut self, dataset: &Dataset, name: &str) -> Result<()> {
        self.count()?;
        let class = text_of(dataset.attribute("MATLAB_class").ok());
        let numeric = |c: &str| {
            let kind = c.trim_start_matches('u');
            matches!(c, "double" | "single" | "logical") || kind.starts_with("int")
        };
        if let Some(class) = class.filter(|c| !numeric(c)) {
            self.other(name, format!("MATLAB's type `{class}`"));
            return Ok(());
        }
        if dataset.attribute("MATLAB_empty").is_ok() {
            return Ok(());
        }
        let shape = dataset.shape();
        let kind = dataset.dtype();
        if let Datatype::Compound { size, fields } = kind {
            let bytes = self.bytes(dataset, (*size as usize).div_ceil(size_of::<f64>()))?;
            for field in fields {
                self.field(&bytes, *size as usize, field, name);
            }
            return Ok(());
        }
        let Some(number) = Number::of(kind) else {
            self.other(name, what(kind).to_owned());
            return Ok(());
        };
        let (rows, wide) = match shape {
            [n] => (*n, 1),
            [a, b] if self.matlab => (*b, *a),
            [a, b] => (*a, *b),
            // A single number, or a block of more dimensions.
            _ => return Ok(()),
        };
        let bytes = self.bytes(dataset, 1)?;
        let values: Vec<f64> = bytes.chunks_exact(number.size()).map(|b| number.read(b)).collect();
        let (rows, wide) = (rows as usize, wide as usize);
        let values = if self.matlab { values } else { transposed(&values, rows, wide) };
        matrix(name, rows, wide, values, &mut self.table);
        Ok(())
    }

    /// One field of all records of a table.
    fn field(&mut self, bytes: &[u8], record: usize, field: &CompoundField, table: &str) {
        let name = format!("{table}.{}", field.name);
        let (kind, wide) = match &field.datatype {
            Datatype::Array { base, dims } => {
                (&**base, dims.iter().fold(1_u64, |n, side| n.saturating_mul(*side)) as usize)
            }
            kind => (kind, 1),
        };
        let Some(number) = Number::of(kind) else { return self.other(&name, what(kind).to_owned()) };
        let from = field.byte_offset as usize;
        let size = number.size();
        // What the type says of itself may be more than a record has room for.
        let wide = wide.min(record / size);
        let mut values = Vec::new();
        for k in 0..wide {
            let at = from + k * size;
            values.extend(
                bytes
                    .chunks_exact(record.max(1))
                    .filter_map(|r| r.get(at..at + size))
                    .map(|b| number.read(b)),
            );
        }
        let rows = values.len() / wide.max(1);
        matrix(&name, rows, wide, values, &mut self.table);
    }

    /// A pandas frame in its fixed form: blocks of columns of one type, their names beside each.
    fn frame(&mut self, group: &Group, prefix: &str) -> Result<()> {
        for block in 0.. {
            let Ok(items) = group.dataset(&format!("block{block}_items")) else { break };
            let names = items.read_strings().map_err(damaged)?;
            let values = group.dataset(&format!("block{block}_values")).map_err(damaged)?;
            let Some(number) = Number::of(values.dtype()) else {
                for name in names {
                    self.other(&format!("{prefix}{name}"), what(values.dtype()).to_owned());
                }
                continue;
            };
            let bytes = self.bytes(&values, 1)?;
            let rows: Vec<f64> = bytes.chunks_exact(number.size()).map(|b| number.read(b)).collect();
            for (k, name) in names.iter().enumerate() {
                let column = rows.chunks_exact(names.len()).map(|row| row[k]).collect();
                self.table.push((format!("{prefix}{name}"), Column::Numbers(column)));
            }
        }
        Ok(())
    }

    fn other(&mut self, name: &str, what: String) {
        self.table.push((name.to_owned(), Column::Other(what)));
    }
}

/// Row after row to column after column.
fn transposed(values: &[f64], rows: usize, wide: usize) -> Vec<f64> {
    if rows.checked_mul(wide) != Some(values.len()) || wide <= 1 {
        return values.to_vec();
    }
    (0..wide).flat_map(|k| values.iter().skip(k).step_by(wide).copied()).collect()
}

/// A number as it is stored, in this machine's order of bytes.
#[derive(Clone, Copy)]
enum Number {
    Integer { size: usize, signed: bool },
    Single,
    Double,
}

impl Number {
    fn of(kind: &Datatype) -> Option<Self> {
        match kind {
            Datatype::FloatingPoint { size: 8, .. } => Some(Self::Double),
            Datatype::FloatingPoint { size: 4, .. } => Some(Self::Single),
            Datatype::FixedPoint { size: size @ (1 | 2 | 4 | 8), signed, .. } => {
                Some(Self::Integer { size: usize::from(*size), signed: *signed })
            }
            // Truth values are an enumeration of two integers.
            Datatype::Enum { base, .. } => Self::of(base),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::Integer { size, .. } => size,
            Self::Single => 4,
            Self::Double => 8,
        }
    }

    /// Of as many bytes as [`Number::size`].
    fn read(self, bytes: &[u8]) -> f64 {
        let mut word = [0; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        let [a, b, c, d, ..] = word;
        match self {
            Self::Double => f64::from_ne_bytes(word),
            Self::Single => f64::from(f32::from_ne_bytes([a, b, c, d])),
            Self::Integer { size: 1, signed: true } => f64::from(i8::from_ne_bytes([a])),
            Self::Integer { size: 1, signed: false } => f64::from(a),
            Self::Integer { size: 2, signed: true } => f64::from(i16::from_ne_bytes([a, b])),
            Self::Integer { size: 2, signed: false } => f64::from(u16::from_ne_bytes([a, b])),
            Self::Integer { size: 4, signed: true } => f64::from(i32::from_ne_bytes([a, b, c, d])),
            Self::Integer { size: 4, signed: false } => f64::from(u32::from_ne_bytes([a, b, c, d])),
            Self::Integer { signed: true, .. } => i64::from_ne_bytes(word) as f64,
            Self::Integer { signed: false, .. } => u64::from_ne_bytes(word) as f64,
        }
    }
}

fn what(kind: &Datatype) -> &'static str {
    match kind {
        Datatype::String { .. } | Datatype::VarLen { .. } => "text",
        Datatype::Compound { .. } | Datatype::Array { .. } => "nested tables",
        Datatype::FloatingPoint { .. } => "numbers of an unusual size",
        _ => "no numbers",
    }
}

fn text_of(attribute: Option<hdf5_reader::Attribute>) -> Option<String> {
    attribute?.read_string().ok()
}

/// The last part of a path in the file.
fn last(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_lead_back_make_no_endless_file() {
        // 40 links from the root to itself, made by h5py: `file[f"a{k}"] = file["/"]`.
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/linked_to_itself.h5");
        let error = columns(&path).expect_err("three million data sets");
        assert!(error.cause().contains("more than 10000 groups"), "{error}");
    }

    #[test]
    fn an_array_wider_than_its_record_is_read_as_far_as_it_goes() {
        let mut found =
            Found { table: ColumnTable::new(), matlab: false, budget: Budget::whole(), left: MEMBERS };
        let double = || {
            Box::new(Datatype::FloatingPoint { size: 8, byte_order: hdf5_reader::ByteOrder::LittleEndian })
        };
        for dims in [vec![2], vec![u64::MAX], vec![1 << 40, 1 << 40]] {
            let datatype = Datatype::Array { base: double(), dims };
            let field = CompoundField { name: "x".into(), byte_offset: 0, datatype };
            found.field(&[0; 64], 16, &field, "t");
        }
        assert_eq!(found.table.len(), 6, "two columns of each");
    }
}
