//! The bytes of a table: what goes over the link and into a controller's flash.
//!
//! ```text
//! "PAMT"  version u16 LE  length u16 LE  body (postcard)  CRC-32 u32 LE over all before it
//! ```
//! The layout of the first eight bytes never changes. A reader refuses another [`VERSION`] and says both.

use crate::check::crc32;
use crate::fields;
use crate::table::{MuscleTable, TableError};
use serde::{Deserialize, Serialize};

/// First four bytes.
pub const MAGIC: [u8; 4] = *b"PAMT";
/// The version that is written, and the only one read.
pub const VERSION: u16 = 1;
/// No image is longer.
pub const MAX_LEN: usize = 1024;
const HEADER: usize = 8;
const CHECKSUM: usize = 4;

/// Why bytes are not a usable table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ImageError {
    /// They end before the image does.
    Truncated,
    /// They do not begin as a table does.
    NotATable,
    /// Written by another version of the format.
    Version {
        /// The version found.
        found: u16,
        /// The version this program reads.
        expected: u16,
    },
    /// The checksum does not fit: the bytes were damaged.
    Checksum,
    /// The body does not decode although its checksum fits.
    Body,
    /// The table decodes, but a number in it cannot be used.
    Table(TableError),
    /// The table does not fit [`MAX_LEN`] bytes.
    TooLong,
}

impl core::fmt::Display for ImageError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Truncated => f.write_str("the table's bytes end too early"),
            Self::NotATable => f.write_str("these bytes are not a muscle table"),
            Self::Version { found, expected } => {
                write!(f, "the table has format version {found}, this program reads version {expected}")
            }
            Self::Checksum => f.write_str("the table's checksum does not fit: the bytes were damaged"),
            Self::Body => f.write_str("the table's body cannot be decoded"),
            Self::Table(e) => write!(f, "a number in the table cannot be used: {e}"),
            Self::TooLong => write!(f, "the table is longer than {MAX_LEN} bytes"),
        }
    }
}

impl core::error::Error for ImageError {}

/// Writes a table's image into `buffer`; returns the bytes used.
///
/// # Errors
/// A number that cannot be used, or a table that does not fit.
pub fn write<'a>(table: &MuscleTable, buffer: &'a mut [u8]) -> Result<&'a [u8], ImageError> {
    table.check().map_err(ImageError::Table)?;
    let room = buffer.len().min(MAX_LEN);
    if room < HEADER + CHECKSUM {
        return Err(ImageError::TooLong);
    }
    let body = postcard::to_slice(table, &mut buffer[HEADER..room - CHECKSUM])
        .map_err(|_| ImageError::TooLong)?
        .len();
    buffer[..4].copy_from_slice(&MAGIC);
    buffer[4..6].copy_from_slice(&VERSION.to_le_bytes());
    // MAX_LEN fits a u16.
    buffer[6..8].copy_from_slice(&(body as u16).to_le_bytes());
    let end = HEADER + body;
    let crc = crc32(&buffer[..end]);
    buffer[end..end + CHECKSUM].copy_from_slice(&crc.to_le_bytes());
    Ok(&buffer[..end + CHECKSUM])
}

/// The length that an image announces in its first eight bytes.
///
/// # Errors
/// Too few bytes, or not a table.
pub fn announced_len(bytes: &[u8]) -> Result<usize, ImageError> {
    let header = bytes.get(..HEADER).ok_or(ImageError::Truncated)?;
    if header[..4] != MAGIC {
        return Err(ImageError::NotATable);
    }
    Ok(HEADER + usize::from(u16::from_le_bytes([header[6], header[7]])) + CHECKSUM)
}

/// Reads a table from its image; bytes after it are ignored.
///
/// # Errors
/// What is wrong with the bytes, or with a number in the table.
pub fn read(bytes: &[u8]) -> Result<MuscleTable, ImageError> {
    let mut table = MuscleTable::empty();
    read_into(bytes, &mut table)?;
    Ok(table)
}

/// As [`read`], into a place that is there already: a table is a kilobyte, and is not moved about.
///
/// # Errors
/// As [`read`]; what was in the place is lost then.
#[inline]
pub fn read_into(bytes: &[u8], table: &mut MuscleTable) -> Result<(), ImageError> {
    if !fields::read(body(bytes)?, table) {
        return Err(ImageError::Body);
    }
    table.check().map_err(ImageError::Table)
}

/// The postcard body of a whole image.
#[inline]
fn body(bytes: &[u8]) -> Result<&[u8], ImageError> {
    let len = announced_len(bytes)?;
    let found = u16::from_le_bytes([bytes[4], bytes[5]]);
    if found != VERSION {
        return Err(ImageError::Version { found, expected: VERSION });
    }
    let whole = bytes.get(..len).ok_or(ImageError::Truncated)?;
    let (content, crc) = whole.split_at(len - CHECKSUM);
    if crc32(content).to_le_bytes() != crc {
        return Err(ImageError::Checksum);
    }
    Ok(&content[HEADER..])
}

/// The checksum that is at an image's end, as a short name for a table.
pub fn checksum(image: &[u8]) -> Option<u32> {
    let tail = image.get(image.len().checked_sub(CHECKSUM)?..)?;
    Some(u32::from_le_bytes(tail.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::example;
    use proptest::prelude::*;

    #[test]
    fn a_written_image_is_read_back_and_fits_a_kibibyte() {
        let mut buffer = [0; MAX_LEN];
        let image = write(&example(), &mut buffer).expect("it fits");
        assert_eq!(read(image), Ok(example()));
        assert!(image.len() < 400, "{} bytes for six pressures", image.len());
    }

    #[test]
    fn every_flipped_bit_is_noticed() {
        let mut buffer = [0; MAX_LEN];
        let len = write(&example(), &mut buffer).expect("it fits").len();
        for bit in 0..len * 8 {
            let mut damaged = buffer;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(read(&damaged[..len]).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn another_version_is_refused_by_naming_both() {
        let mut buffer = [0; MAX_LEN];
        write(&example(), &mut buffer).expect("it fits");
        buffer[4] = 9;
        assert_eq!(read(&buffer), Err(ImageError::Version { found: 9, expected: VERSION }));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200), headed in any::<bool>()) {
            let mut bytes = bytes;
            if headed && bytes.len() >= 8 {
                bytes[..4].copy_from_slice(&MAGIC);
                bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
            }
            prop_assert!(read(&bytes).is_err());
        }
    }
}
