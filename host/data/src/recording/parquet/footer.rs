//! The nesting of a schema, by looking at the footer before it is read: the library that reads it descends by recursion, and a file of 2 MB
//! can nest deeper than any stack.
//!
//! The footer is a structure in Thrift's compact protocol. Its second field is the list of the schema's elements in the order of their
//! depth, and the fifth field of an element is the number of its children.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use super::super::column_table::damaged;
use crate::bounds::WRITTEN;
use crate::error::{Error, Result};

/// Groups within groups of a recording's schema: it has flat columns.
const DEPTH: usize = 64;
const MAGIC: &[u8] = b"PAR1";

/// Refuses a file whose schema nests too deep.
pub(super) fn check(file: &mut File) -> Result<()> {
    let unreadable = |e: std::io::Error| damaged(e);
    let length = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
    let mut end = [0; 8];
    if length >= 12 {
        file.seek(SeekFrom::End(-8)).map_err(unreadable)?;
        file.read_exact(&mut end).map_err(unreadable)?;
    }
    // A file that is not Parquet is reported by its reader.
    if &end[4..] == MAGIC {
        let size = u64::from(u32::from_le_bytes([end[0], end[1], end[2], end[3]]));
        if size > WRITTEN || size > length - 12 {
            return Err(damaged("its footer does not fit the file"));
        }
        let mut footer = vec![0; size as usize];
        file.seek(SeekFrom::End(-8 - size as i64)).map_err(unreadable)?;
        file.read_exact(&mut footer).map_err(unreadable)?;
        let depth = Footer { rest: &footer }.depth();
        if depth.is_none_or(|depth| depth > DEPTH) {
            return Err(too_deep());
        }
    }
    file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    Ok(())
}

fn too_deep() -> Error {
    damaged(format!("its columns are in more than {DEPTH} groups within groups, or its footer is damaged"))
}

/// Types of the compact protocol.
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const I16: u8 = 4;
const I32: u8 = 5;
const I64: u8 = 6;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
const STRUCT: u8 = 12;

struct Footer<'a> {
    rest: &'a [u8],
}

impl Footer<'_> {
    /// The greatest number of groups around one element; none for a footer that breaks off.
    fn depth(mut self) -> Option<usize> {
        let mut field = 0;
        let mut deepest = 0;
        while let Some(kind) = self.field(&mut field)? {
            if (field, kind) == (2, LIST) {
                deepest = deepest.max(self.schema()?);
            } else {
                self.skip(kind, 0)?;
            }
        }
        Some(deepest)
    }

    /// The elements of the schema.
    fn schema(&mut self) -> Option<usize> {
        let (count, kind) = self.list()?;
        if kind != STRUCT {
            return None;
        }
        // Children that are still to come, of each group around the next element.
        let mut around: Vec<u64> = Vec::new();
        let mut deepest = 0;
        for _ in 0..count {
            while around.last() == Some(&0) {
                around.pop();
            }
            if let Some(left) = around.last_mut() {
                *left -= 1;
            }
            deepest = deepest.max(around.len());
            if deepest > DEPTH {
                return Some(deepest);
            }
            let (mut field, mut children) = (0, 0);
            while let Some(kind) = self.field(&mut field)? {
                if (field, kind) == (5, I32) {
                    // Zigzag: an even number is twice the value, an odd one is negative.
                    let value = self.varint()?;
                    children = if value % 2 == 0 { value / 2 } else { 0 };
                } else {
                    self.skip(kind, 0)?;
                }
            }
            if children > 0 {
                around.push(children);
            }
        }
        Some(deepest)
    }

    /// The type of the next field of a structure, and its number; none at the structure's end.
    #[expect(clippy::option_option, reason = "the outer one is a footer that breaks off")]
    fn field(&mut self, number: &mut i64) -> Option<Option<u8>> {
        let header = self.byte()?;
        if header == 0 {
            return Some(None);
        }
        *number = match header >> 4 {
            0 => self.varint()? as i64 / 2,
            step => number.wrapping_add(i64::from(step)),
        };
        Some(Some(header & 15))
    }

    fn list(&mut self) -> Option<(u64, u8)> {
        let header = self.byte()?;
        let count = if header >> 4 == 15 { self.varint()? } else { u64::from(header >> 4) };
        Some((count, header & 15))
    }

    fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        if depth > DEPTH {
            return None;
        }
        match kind {
            TRUE | FALSE => {}
            BYTE => drop(self.take(1)?),
            I16 | I32 | I64 => drop(self.varint()?),
            DOUBLE => drop(self.take(8)?),
            BINARY => {
                let length = self.varint()?;
                self.take(usize::try_from(length).ok()?)?;
            }
            LIST | SET => {
                let (count, kind) = self.list()?;
                for _ in 0..count {
                    // Truth values have a byte of their own here.
                    self.skip(if matches!(kind, TRUE | FALSE) { BYTE } else { kind }, depth + 1)?;
                }
            }
            MAP => {
                let count = self.varint()?;
                let kinds = if count > 0 { self.byte()? } else { 0 };
                for _ in 0..count {
                    self.skip(kinds >> 4, depth + 1)?;
                    self.skip(kinds & 15, depth + 1)?;
                }
            }
            STRUCT => {
                let mut field = 0;
                while let Some(kind) = self.field(&mut field)? {
                    self.skip(kind, depth + 1)?;
                }
            }
            _ => return None,
        }
        Some(())
    }

    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    fn take(&mut self, count: usize) -> Option<&[u8]> {
        let (first, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(first)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// A file without rows, whose one column is in groups within groups.
    fn nested(depth: u32) -> File {
        let mut meta = vec![0x15, 2, 0x19, 0xfc];
        let mut count = depth + 2;
        while count >= 0x80 {
            meta.push(count as u8 | 0x80);
            count >>= 7;
        }
        meta.push(count as u8);
        meta.extend([0x48, 1, b'r', 0x15, 2, 0]);
        for _ in 0..depth {
            meta.extend([0x35, 0, 0x18, 1, b'g', 0x15, 2, 0]);
        }
        meta.extend([0x15, 0x0a, 0x25, 0, 0x18, 1, b'x', 0, 0x16, 0, 0x19, 0x0c, 0]);
        let mut file = tempfile::tempfile().expect("a file");
        let length = (meta.len() as u32).to_le_bytes();
        file.write_all(&[MAGIC, &meta, &length, MAGIC].concat()).expect("written");
        file
    }

    #[test]
    fn a_schema_may_nest_as_deep_as_the_bound() {
        for depth in [0, 1, 20, DEPTH as u32 - 1] {
            let mut file = nested(depth);
            check(&mut file).expect("a schema");
            assert_eq!(super::super::columns(file).expect("columns").len(), 1, "{depth}");
        }
        // The library would overflow its stack at the last of these.
        for depth in [DEPTH as u32, 1_000, 200_000] {
            assert!(super::super::columns(nested(depth)).is_err(), "{depth}");
        }
    }

    #[test]
    fn a_footer_that_breaks_off_is_refused() {
        for cut in 13..40 {
            let mut file = nested(2);
            let mut bytes = Vec::new();
            file.seek(SeekFrom::Start(0)).and_then(|_| file.read_to_end(&mut bytes)).expect("readable");
            let end = [&((cut - 12) as u32).to_le_bytes()[..], MAGIC].concat();
            let mut short = tempfile::tempfile().expect("a file");
            short.write_all(&[&bytes[..cut - 8], &end].concat()).expect("written");
            assert!(check(&mut short).is_err() || cut >= bytes.len(), "{cut} bytes");
        }
    }
}
