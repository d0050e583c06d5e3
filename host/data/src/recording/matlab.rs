//! MATLAB files of version 5 to 7 (not 7.3, which is HDF5): numeric arrays, also compressed, also as fields of a struct.
//!
//! Layout after "MAT-File Format", The MathWorks: a header of 128 bytes, then elements, each a tag of type and size and its
//! data, padded to eight bytes; an array is an element of elements: flags, dimensions, name, data.

use std::io::Read;

use super::column_table::{ColumnTable, damaged, matrix, without_common_prefix};
use crate::bounds::{Budget, WHOLE};
use crate::error::Result;

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;
/// A recording is at most this many structs deep.
const DEEPEST: usize = 4;

/// The vectors of a file. A matrix gives its columns as `name(:,k)`, a struct its fields as `name.field`, or as `field` alone
/// when the file holds nothing else.
pub(super) fn columns(bytes: &[u8], mut budget: Budget) -> Result<ColumnTable> {
    let header = bytes.get(..128).ok_or_else(|| damaged("it ends within its header"))?;
    let big = match &header[126..128] {
        b"IM" => false,
        b"MI" => true,
        _ => return Err(damaged("its byte order mark is neither IM nor MI")),
    };
    let mut columns = Vec::new();
    let mut unfolded = WHOLE;
    let mut top = Elements { bytes: &bytes[128..], big };
    while let Some((kind, data)) = top.next()? {
        match kind {
            COMPRESSED => {
                let mut unpacked = Vec::new();
                flate2::read::ZlibDecoder::new(data)
                    .take(unfolded)
                    .read_to_end(&mut unpacked)
                    .map_err(|e| damaged(format!("a compressed array is damaged ({e})")))?;
                unfolded = unfolded.saturating_sub(unpacked.len() as u64);
                if unfolded == 0 {
                    return Err(damaged(format!("it unfolds to more than {} MiB", WHOLE >> 20)));
                }
                let mut inner = Elements { bytes: &unpacked, big };
                while let Some((kind, data)) = inner.next()? {
                    if kind == MATRIX {
                        array(data, big, None, 0, &mut budget, &mut columns)?;
                    }
                }
            }
            MATRIX => array(data, big, None, 0, &mut budget, &mut columns)?,
            _ => {}
        }
    }
    Ok(without_common_prefix(columns))
}

/// Elements one after the other.
struct Elements<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let word = self.bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if self.big { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    fn next(&mut self) -> Result<Option<(u32, &'a [u8])>> {
        if self.bytes.len() < 8 {
            return Ok(None);
        }
        let cut = || damaged("it ends within an array");
        let first = self.word(0).ok_or_else(cut)?;
        let (kind, start, size) = match first >> 16 {
            0 => (first, 8, self.word(4).ok_or_else(cut)? as usize),
            // The small form: size and type share a word, up to four bytes of data follow in the tag.
            size => (first & 0xffff, 4, size as usize),
        };
        let data = self.bytes.get(start..).and_then(|b| b.get(..size)).ok_or_else(cut)?;
        // Compressed elements are not padded.
        let end = match (start, kind) {
            (4, _) => 8,
            (_, COMPRESSED) => 8 + size,
            _ => 8 + size.div_ceil(8) * 8,
        };
        self.bytes = self.bytes.get(end..).unwrap_or_default();
        Ok(Some((kind, data)))
    }

    fn need(&mut self) -> Result<(u32, &'a [u8])> {
        self.next()?.ok_or_else(|| damaged("an array lacks a part"))
    }
}

fn array(
    bytes: &[u8],
    big: bool,
    name: Option<&str>,
    depth: usize,
    budget: &mut Budget,
    columns: &mut ColumnTable,
) -> Result<()> {
    if bytes.is_empty() {
        return Ok(());
    }
    let mut parts = Elements { bytes, big };
    let flags = numbers(parts.need()?, big, budget)?;
    let class = flags.first().map_or(0, |f| *f as u64 & 0xff);
    let dimensions = numbers(parts.need()?, big, budget)?;
    let own = String::from_utf8_lossy(parts.need()?.1).into_owned();
    let name = name.unwrap_or(&own);
    match class {
        6..=15 => {
            let values = numbers(parts.need()?, big, budget)?;
            let rows = dimensions.first().map_or(0, |d| *d as usize);
            let wide = dimensions.get(1).map_or(0, |d| *d as usize);
            if dimensions.len() == 2 {
                matrix(name, rows, wide, values, columns);
            }
        }
        2 if depth < DEEPEST => {
            let width = numbers(parts.need()?, big, budget)?.first().map_or(0, |w| *w as usize);
            let (_, names) = parts.need()?;
            if width == 0 || dimensions.iter().product::<f64>() != 1.0 {
                return Ok(());
            }
            for field in names.chunks(width) {
                let end = field.iter().position(|b| *b == 0).unwrap_or(field.len());
                let field = format!("{name}.{}", String::from_utf8_lossy(&field[..end]));
                let (kind, data) = parts.need()?;
                if kind == MATRIX {
                    array(data, big, Some(&field), depth + 1, budget, columns)?;
                }
            }
        }
        _ => {}
    }
    Ok(())
}

/// Numbers of any stored type as doubles.
fn numbers((kind, data): (u32, &[u8]), big: bool, budget: &mut Budget) -> Result<Vec<f64>> {
    macro_rules! read {
        ($t:ty) => {{
            const SIZE: usize = size_of::<$t>();
            let one = |b: &[u8]| {
                let mut word = [0; SIZE];
                word.copy_from_slice(b);
                (if big { <$t>::from_be_bytes(word) } else { <$t>::from_le_bytes(word) }) as f64
            };
            // A byte in the file is eight in memory.
            budget.take(data.len() / SIZE)?;
            Ok(data.chunks_exact(SIZE).map(one).collect())
        }};
    }
    match kind {
        1 => read!(i8),
        2 => read!(u8),
        3 => read!(i16),
        4 => read!(u16),
        5 => read!(i32),
        6 => read!(u32),
        7 => read!(f32),
        9 => read!(f64),
        12 => read!(i64),
        13 => read!(u64),
        other => Err(damaged(format!("an array has data of the unknown type {other}"))),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use proptest::prelude::*;

    use super::*;

    fn file(elements: &[(u32, &[u8])]) -> Vec<u8> {
        let mut out = vec![b' '; 126];
        out.extend(b"IM");
        elements.iter().for_each(|(kind, data)| element(&mut out, *kind, data));
        out
    }

    fn element(out: &mut Vec<u8>, kind: u32, data: &[u8]) {
        out.extend(kind.to_le_bytes());
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(data);
        out.resize(out.len().next_multiple_of(8), 0);
    }

    /// An array `x` of this length, one byte for each number.
    fn bytes(count: usize) -> Vec<u8> {
        let mut out = Vec::new();
        element(&mut out, 6, &[9, 0, 0, 0, 0, 0, 0, 0]);
        element(&mut out, 5, &[(count as u32).to_le_bytes(), 1_u32.to_le_bytes()].concat());
        element(&mut out, 1, b"x");
        element(&mut out, 2, &vec![7; count]);
        out
    }

    #[test]
    fn small_numbers_that_grow_in_memory_are_counted_as_they_are_there() {
        let array = bytes(1000);
        let plain = file(&[(MATRIX, &array)]);
        // Flags, dimensions and values.
        assert!(columns(&plain, Budget::new(1004)).is_ok());
        assert!(columns(&plain, Budget::new(1003)).is_err());
        let twice = file(&[(MATRIX, &array), (MATRIX, &array)]);
        assert!(columns(&twice, Budget::new(1004)).is_err());
    }

    #[test]
    fn a_compressed_array_that_unfolds_without_end_is_given_up() {
        let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        let zeros = vec![0; 1 << 20];
        for _ in 0..=WHOLE >> 20 {
            packed.write_all(&zeros).unwrap();
        }
        let packed = packed.finish().unwrap();
        assert!(packed.len() < 2 << 20);
        let error = columns(&file(&[(COMPRESSED, &packed)]), Budget::whole()).unwrap_err();
        assert!(error.cause().contains("unfolds to more than 128 MiB"), "{error}");
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes: Vec<u8>, big: bool) {
            let mut file = vec![b' '; 126];
            file.extend(if big { b"MI" } else { b"IM" });
            file.extend([14, 0, 0, 0, bytes.len() as u8, 0, 0, 0]);
            file.extend(bytes);
            let _ = super::columns(&file, super::Budget::whole());
        }
    }
}
