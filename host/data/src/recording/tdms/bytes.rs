//! Values one after the other, in the byte order of a segment.

use crate::error::Result;
use crate::recording::column_table::damaged;

/// Bytes that are read from the front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub rest: &'a [u8],
    pub big: bool,
}

impl<'a> Bytes<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or_else(|| damaged("a length in it leads out of the file"))?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        if self.big {
            array.reverse();
        }
        Ok(array)
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn text(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }
}

/// How values are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
    Text,
    Time,
    /// Of a known size, but no number that a recording has a use for.
    Sized(usize, &'static str),
}

impl Kind {
    /// By its number in the format.
    pub(super) fn of(number: u32) -> Option<Self> {
        Some(match number {
            0 => Self::Sized(0, "nothing"),
            1 => Self::Signed(1),
            2 => Self::Signed(2),
            3 => Self::Signed(4),
            4 => Self::Signed(8),
            5 | 0x21 => Self::Unsigned(1),
            6 => Self::Unsigned(2),
            7 => Self::Unsigned(4),
            8 => Self::Unsigned(8),
            9 | 0x19 => Self::Float(4),
            10 | 0x1A => Self::Float(8),
            11 | 0x1B => Self::Sized(16, "numbers of extended precision"),
            0x20 => Self::Text,
            0x44 => Self::Time,
            0x0008_000C => Self::Sized(8, "complex numbers"),
            0x0010_000D => Self::Sized(16, "complex numbers"),
            _ => return None,
        })
    }

    /// Bytes of a value; of a text, those of its end in the table before the texts.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) | Self::Float(size) | Self::Sized(size, _) => size,
            Self::Text => 4,
            Self::Time => 16,
        }
    }

    /// Whether it is an integer, which moves in steps.
    pub(super) fn is_integer(self) -> bool {
        matches!(self, Self::Signed(_) | Self::Unsigned(_))
    }

    /// One value as a number: of a time, seconds since 1970.
    pub(super) fn number(self, raw: &[u8], big: bool) -> f64 {
        let word = |bytes: &[u8]| {
            let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
            if big { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
        };
        match self {
            Self::Unsigned(_) => word(raw) as f64,
            Self::Signed(size) => {
                let shift = 64 - 8 * size as u32;
                (((word(raw) << shift) as i64) >> shift) as f64
            }
            Self::Float(4) => f64::from(f32::from_bits(word(raw) as u32)),
            Self::Float(_) => f64::from_bits(word(raw)),
            Self::Time => {
                let (first, second) = raw.split_at(8);
                let (seconds, fraction) = if big { (first, second) } else { (second, first) };
                /// Seconds from 1904, LabVIEW's beginning, to 1970.
                const FROM_1904: i64 = 2_082_844_800;
                let whole = (word(seconds) as i64).saturating_sub(FROM_1904);
                whole as f64 + word(fraction) as f64 / 2_f64.powi(64)
            }
            Self::Text | Self::Sized(..) => f64::NAN,
        }
    }
}
