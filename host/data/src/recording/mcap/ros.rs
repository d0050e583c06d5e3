//! Messages of ROS 1 and ROS 2, by their definition.
//!
//! ROS 1 puts its values next to each other, little-endian. ROS 2 writes CDR: four bytes that say the byte order, then each value at a
//! multiple of its size, counted from behind them (OMG DDSI-RTPS 2.5, chapter 10; formal/2022-04-01).

use super::ros_definition::{Count, Definition, Kind, Part, Version};
use super::values::{LONGEST_ARRAY, Values};

/// Messages within messages.
const DEEPEST: usize = 32;
/// Fields of a message that take no bytes, such as empty messages in arrays, may be as many as its bytes and these.
const FIELDS: usize = 10_000;

/// A message as far as it was read.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
    /// The largest multiple that values begin at; 1 in ROS 1.
    align: usize,
    /// Fields that may still be visited.
    fields: usize,
}

/// Reads one message; `None` where its bytes do not fit its definition.
pub(super) fn read(definition: &Definition, message: &[u8], values: &mut Values) -> Option<()> {
    let fields = message.len().saturating_add(FIELDS);
    let mut reader = match definition.version {
        Version::Ros1 => Reader { bytes: message, at: 0, big: false, align: 1, fields },
        Version::Ros2 => {
            let (header, bytes) = message.split_first_chunk::<4>()?;
            let (big, align) = match header[..2] {
                [0, 0] => (true, 8),
                [0, 1] => (false, 8),
                [0, 6] => (true, 4),
                [0, 7] => (false, 4),
                _ => return None,
            };
            Reader { bytes, at: 0, big, align, fields }
        }
    };
    let mut path = String::new();
    reader.message(definition, 0, Some(&mut path), values, 0)
}

impl<'a> Reader<'a> {
    fn take(&mut self, size: usize) -> Option<&'a [u8]> {
        let from = self.at.checked_next_multiple_of(size.clamp(1, 8).min(self.align))?;
        let to = from.checked_add(size)?;
        let taken = self.bytes.get(from..to)?;
        self.at = to;
        Some(taken)
    }

    /// Bytes without alignment.
    fn pass(&mut self, size: usize) -> Option<()> {
        self.at = self.at.checked_add(size).filter(|end| *end <= self.bytes.len())?;
        Some(())
    }

    /// A whole number of 1, 2, 4 or 8 bytes.
    fn word(&mut self, size: usize) -> Option<u64> {
        let big = self.big;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        let bytes = self.take(size)?;
        Some(if big { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) })
    }

    /// Reads the fields of a message; without a path, they are passed over.
    fn message(
        &mut self,
        definition: &Definition,
        number: usize,
        mut path: Option<&mut String>,
        values: &mut Values,
        depth: usize,
    ) -> Option<()> {
        let parts = definition.messages.get(number).filter(|_| depth < DEEPEST)?;
        if parts.is_empty() && definition.version == Version::Ros2 {
            // A structure without members has one byte.
            return self.pass(1);
        }
        for part in parts {
            let length = path.as_ref().map_or(0, |p| p.len());
            if let Some(path) = path.as_deref_mut() {
                if length > 0 {
                    path.push('.');
                }
                path.push_str(&part.name);
            }
            self.part(definition, part, path.as_deref_mut(), values, depth)?;
            if let Some(path) = path.as_deref_mut() {
                path.truncate(length);
            }
        }
        Some(())
    }

    fn part(
        &mut self,
        definition: &Definition,
        part: &Part,
        mut path: Option<&mut String>,
        values: &mut Values,
        depth: usize,
    ) -> Option<()> {
        let count = match part.count {
            Count::One => return self.one(definition, part.kind, path, values, depth),
            Count::Fixed(count) => count,
            Count::LengthPrefixed => self.word(4)? as usize,
        };
        if count > LONGEST_ARRAY {
            path = None;
        }
        if let (None, Kind::Signed(size) | Kind::Unsigned(size) | Kind::Float(size)) = (&path, part.kind) {
            if count > 0 {
                self.take(size)?;
                return self.pass((count - 1).checked_mul(size)?);
            }
            return Some(());
        }
        for i in 0..count {
            let before = self.at;
            let length = path.as_ref().map_or(0, |p| p.len());
            if let Some(path) = path.as_deref_mut() {
                path.push_str(&format!(".{i}"));
            }
            self.one(definition, part.kind, path.as_deref_mut(), values, depth)?;
            if let Some(path) = path.as_deref_mut() {
                path.truncate(length);
            }
            if self.at == before {
                // Elements without contents: as many as are announced.
                break;
            }
        }
        Some(())
    }

    fn one(
        &mut self,
        definition: &Definition,
        kind: Kind,
        path: Option<&mut String>,
        values: &mut Values,
        depth: usize,
    ) -> Option<()> {
        self.fields = self.fields.checked_sub(1)?;
        let (value, exact) = match kind {
            Kind::Bool => (f64::from(u8::from(self.word(1)? != 0)), true),
            Kind::Unsigned(size) => (self.word(size)? as f64, true),
            Kind::Signed(size) => {
                let shift = 64 - 8 * size as u32;
                ((((self.word(size)? << shift) as i64) >> shift) as f64, true)
            }
            Kind::Float(4) => (f64::from(f32::from_bits(self.word(4)? as u32)), false),
            Kind::Float(_) => (f64::from_bits(self.word(8)?), false),
            Kind::Text => {
                let length = self.word(4)? as usize;
                return self.pass(length);
            }
            Kind::Time { signed } => {
                let (seconds, nanoseconds) = (self.word(4)? as u32, self.word(4)? as u32);
                if let Some(path) = path {
                    let both = if signed {
                        [f64::from(seconds as i32), f64::from(nanoseconds as i32)]
                    } else {
                        [f64::from(seconds), f64::from(nanoseconds)]
                    };
                    for (name, value) in [".secs", ".nsecs"].into_iter().zip(both) {
                        path.push_str(name);
                        values.put(path, value, true);
                        path.truncate(path.len() - name.len());
                    }
                }
                return Some(());
            }
            Kind::Message(number) => return self.message(definition, number, path, values, depth + 1),
        };
        if let Some(path) = path {
            values.put(path, value, exact);
        }
        Some(())
    }
}
