//! Log frames of the firmware as text.
//!
//! The device sends what `defmt` made of a log line: the number of its format string and the arguments' bytes. The strings
//! themselves are names of symbols in the section `.defmt` of the image, a JSON object each, at the address that is their
//! number; the firmware's own linker script keeps them out of flash. Frames are those of the encoding `raw`:
//!
//! ```text
//! number u16 ‖ time-stamp's arguments ‖ the line's arguments, all little-endian
//! ```
//! An argument `{}` or `{:?}` of a type that formats itself is a number and arguments again. Of the types that defmt knows,
//! those are read that a log line of this project can hold: numbers, truth values, characters, texts, bytes, and what
//! formats itself. (The crate `defmt-decoder` reads all, but changes how every number of a program is printed as JSON: it
//! switches on `serde_json/arbitrary_precision`.)

use std::collections::BTreeMap;
use std::path::Path;

use defmt_parser::{DisplayHint, Fragment, Parameter, ParserMode, Type};
use object::{Object, ObjectSection, ObjectSymbol};
use serde::Deserialize;

use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// The version of defmt's frames that is read here.
const VERSION: &str = "4";

/// The name of a symbol.
#[derive(Debug, Deserialize)]
struct Symbol {
    tag: String,
    data: String,
}

/// The log lines of one image.
#[derive(Debug)]
pub struct LogTable {
    entries: BTreeMap<u16, Symbol>,
    timestamp: Option<String>,
}

/// A decoded line.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Device time, s, where the image gives it.
    pub time_s: Option<f64>,
    /// `trace`, `debug`, `info`, `warn` or `error`.
    pub level: String,
    /// The text.
    pub text: String,
}

struct Bytes<'a>(&'a [u8]);

fn short() -> Error {
    Error::new(DeviceCode::DeviceForeign, "a log line does not match this image")
        .help("give --elf the image that runs on the device, built with firmware/build --log")
}

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>().ok_or_else(short)?;
        self.0 = rest;
        Ok(*first)
    }

    fn number(&mut self) -> Result<u16> {
        Ok(u16::from_le_bytes(self.take()?))
    }

    fn slice(&mut self, length: usize) -> Result<&[u8]> {
        let (first, rest) = self.0.split_at_checked(length).ok_or_else(short)?;
        self.0 = rest;
        Ok(first)
    }

    fn length(&mut self) -> Result<usize> {
        Ok(u32::from_le_bytes(self.take()?) as usize)
    }
}

impl LogTable {
    /// Reads an image's log lines.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`] for a file that is not an image, or one without logs.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = pam_data::bounds::read(path, pam_data::bounds::WHOLE)?;
        Self::parse(&bytes).map_err(|why| {
            Error::new(DataCode::FileUnreadable, why)
                .file(path)
                .help("build an image with logs: firmware/build --log BOARD")
        })
    }

    /// Of log lines that are known otherwise: number, level as `defmt_info`, and format of each.
    #[must_use]
    pub fn of_formats(formats: &[(u16, &str, &str)], timestamp: Option<&str>) -> Self {
        let entry = |(number, tag, data): &(u16, &str, &str)| {
            (*number, Symbol { tag: (*tag).to_owned(), data: (*data).to_owned() })
        };
        Self { entries: formats.iter().map(entry).collect(), timestamp: timestamp.map(str::to_owned) }
    }

    /// The log lines of an image.
    ///
    /// # Errors
    /// Why the bytes are not an image, or one without logs.
    pub fn parse(bytes: &[u8]) -> std::result::Result<Self, String> {
        let elf = object::File::parse(bytes).map_err(|e| format!("this is not an ELF image: {e}"))?;
        let section = elf.section_by_name(".defmt").ok_or("the image was built without logs")?.index();
        let (mut entries, mut timestamp) = (BTreeMap::new(), None);
        for symbol in elf.symbols() {
            let Ok(name) = symbol.name() else { continue };
            let name_of = |what: &str| name.trim_matches('"').strip_prefix(what).map(str::to_owned);
            if let Some(version) = name_of("_defmt_version_ = ").filter(|version| version != VERSION) {
                return Err(format!(
                    "the image logs in version {version} of defmt; this program reads {VERSION}"
                ));
            }
            if let Some(encoding) = name_of("_defmt_encoding_ = ").filter(|encoding| encoding != "raw") {
                return Err(format!("the image logs in the encoding {encoding}; this program reads raw"));
            }
            if symbol.section_index() != Some(section) || !name.starts_with('{') {
                continue;
            }
            let entry: Symbol = serde_json::from_str(name)
                .map_err(|e| format!("the log symbol `{name}` cannot be read: {e}"))?;
            if entry.tag == "defmt_timestamp" {
                timestamp = Some(entry.data);
            } else {
                let number = u16::try_from(symbol.address()).map_err(|_| "a log symbol lies too far out")?;
                entries.insert(number, entry);
            }
        }
        Ok(Self { entries, timestamp })
    }

    /// Decodes one frame.
    ///
    /// # Errors
    /// [`DeviceCode::DeviceForeign`] for a frame of another image.
    pub fn decode(&self, frame: &[u8]) -> Result<Line> {
        let mut bytes = Bytes(frame);
        let entry = self.entry(&mut bytes)?;
        let level = entry.tag.strip_prefix("defmt_").ok_or_else(short)?.to_owned();
        let stamp = match &self.timestamp {
            Some(format) => Some(self.format(format, &mut bytes)?),
            None => None,
        };
        let text = self.format(&entry.data, &mut bytes)?;
        if !bytes.0.is_empty() {
            return Err(short());
        }
        Ok(Line { time_s: stamp.and_then(|text| text.trim().parse().ok()), level, text })
    }

    fn entry(&self, bytes: &mut Bytes<'_>) -> Result<&Symbol> {
        self.entries.get(&bytes.number()?).ok_or_else(short)
    }

    /// Reads the arguments of a format string and puts them in their places.
    fn format(&self, format: &str, bytes: &mut Bytes<'_>) -> Result<String> {
        let fragments = defmt_parser::parse(format, ParserMode::ForwardsCompatible).map_err(|_| short())?;
        // Arguments come in the order of their numbers, each once, however often it is shown.
        let mut read: BTreeMap<usize, &Parameter> = BTreeMap::new();
        for fragment in &fragments {
            if let Fragment::Parameter(parameter) = fragment {
                read.entry(parameter.index).or_insert(parameter);
            }
        }
        let values: BTreeMap<usize, String> = read
            .into_iter()
            .map(|(index, parameter)| Ok((index, self.argument(parameter, bytes)?)))
            .collect::<Result<_>>()?;
        let mut text = String::new();
        for fragment in &fragments {
            match fragment {
                Fragment::Literal(literal) => text += literal,
                Fragment::Parameter(parameter) => {
                    text += values.get(&parameter.index).map_or("", String::as_str);
                }
            }
        }
        Ok(text)
    }

    fn argument(&self, parameter: &Parameter, bytes: &mut Bytes<'_>) -> Result<String> {
        macro_rules! plain {
            ($kind:ty) => {
                <$kind>::from_le_bytes(bytes.take()?).to_string()
            };
        }
        Ok(match &parameter.ty {
            Type::U8 => plain!(u8),
            Type::U16 => plain!(u16),
            Type::U32 | Type::Usize => in_seconds(u64::from(u32::from_le_bytes(bytes.take()?)), parameter),
            Type::U64 => in_seconds(u64::from_le_bytes(bytes.take()?), parameter),
            Type::U128 => plain!(u128),
            Type::I8 => plain!(i8),
            Type::I16 => plain!(i16),
            Type::I32 | Type::Isize => plain!(i32),
            Type::I64 => plain!(i64),
            Type::I128 => plain!(i128),
            Type::F32 => plain!(f32),
            Type::F64 => plain!(f64),
            Type::Bool => (bytes.take::<1>()?[0] != 0).to_string(),
            Type::Char => char::from_u32(u32::from_le_bytes(bytes.take()?)).ok_or_else(short)?.to_string(),
            Type::IStr => self.entry(bytes)?.data.clone(),
            Type::Str => {
                let length = bytes.length()?;
                String::from_utf8(bytes.slice(length)?.to_vec()).map_err(|_| short())?
            }
            Type::U8Slice => {
                let length = bytes.length()?;
                format!("{:?}", bytes.slice(length)?)
            }
            Type::U8Array(length) => format!("{:?}", bytes.slice(*length)?),
            Type::Format => {
                let inner = &self.entry(bytes)?.data;
                // An enum's variants are joined by bars, and one byte says which: none here has more than 255.
                let variant = if inner.contains('|') {
                    let which = usize::from(bytes.take::<1>()?[0]);
                    inner.split('|').nth(which).ok_or_else(short)?
                } else {
                    inner.as_str()
                };
                self.format(variant, bytes)?
            }
            _ => {
                return Err(Error::new(DeviceCode::DeviceForeign, "a log line contains an unsupported type")
                    .value(format!("{:?}", parameter.ty))
                    .help("log numbers, texts, and types that derive defmt::Format"));
            }
        })
    }
}

/// A number, in seconds where it is shown as a time.
fn in_seconds(value: u64, parameter: &Parameter) -> String {
    match &parameter.hint {
        Some(DisplayHint::Seconds(unit)) => {
            let per_second = match unit {
                defmt_parser::TimePrecision::Micros => 1e6,
                defmt_parser::TimePrecision::Millis => 1e3,
                defmt_parser::TimePrecision::Seconds => 1.0,
            };
            (value as f64 / per_second).to_string()
        }
        _ => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> LogTable {
        let entry = |tag: &str, data: &str| Symbol { tag: tag.into(), data: data.into() };
        let entries = BTreeMap::from([
            (1, entry("defmt_warn", "fault {0=u8} at {1=u64} us, {1=u64} again")),
            (2, entry("defmt_info", "state {}")),
            (3, entry("defmt_derived", "Armed|Running {{ mode: {=u16} }}")),
            (4, entry("defmt_info", "table {=str} {=bool}")),
        ]);
        LogTable { entries, timestamp: Some("{=u32:ts}".into()) }
    }

    #[test]
    fn log_lines_are_decoded_and_other_frames_are_refused() {
        let mut frame = vec![1, 0, 7, 0, 0, 0, 12];
        frame.extend(1_000_u64.to_le_bytes());
        let line = table().decode(&frame).unwrap();
        assert_eq!(line.text, "fault 12 at 1000 us, 1000 again");
        assert_eq!((line.time_s, line.level.as_str()), (Some(7.0), "warn"));
        assert_eq!(
            table().decode(&[2, 0, 0, 0, 0, 0, 3, 0, 1, 9, 0]).unwrap().text,
            "state Running { mode: 9 }"
        );
        let text = [4, 0, 0, 0, 0, 0, 2, 0, 0, 0, b'o', b'k', 1];
        assert_eq!(table().decode(&text).unwrap().text, "table ok true");
        for bad in [&[9, 0, 0, 0, 0, 0][..], &frame[..10], &[][..], &[4, 0, 0, 0, 0, 0, 255, 255, 255, 255]] {
            assert_eq!(table().decode(bad).unwrap_err().code(), DeviceCode::DeviceForeign);
        }
        frame.push(0);
        assert!(table().decode(&frame).is_err(), "bytes too many");
        assert!(LogTable::parse(b"no image").unwrap_err().contains("not an ELF"));
    }
}
