//! Recognises the kind of a file by its content, so that an error about a wrong file can name its kind.

use std::io::Read;
use std::path::Path;

use crate::bounds;
use crate::error::{DataCode, Error, Result};

/// Bytes of a file that are examined: names of columns and keys are near its beginning.
const LOOKED_AT: u64 = 65_536;

/// A kind of file that commands take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A muscle's description, TOML.
    Muscle,
    /// An import description, TOML.
    Import,
    /// A protocol of the bench, TOML.
    Protocol,
    /// A fitted table, `.pam`.
    Table,
    /// A recording: text with a header, MCAP, MATLAB, Parquet.
    Recording,
    /// A check of the bench: a table with a column of what is known.
    Check,
    /// JSON that this program wrote.
    Json,
    /// A report that this program wrote.
    Report,
}

impl FileKind {
    /// What a file is by its first bytes; `None` where they are those of no kind of ours.
    #[must_use]
    pub(crate) fn of_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"PAMF") {
            return Some(Self::Table);
        }
        let containers: [&[u8]; 5] = [b"\x89MCAP0", b"\x89HDF\r\n", b"MATLAB 5.0", b"MATLAB 7.3", b"PAR1"];
        if containers.iter().any(|c| bytes.starts_with(c)) {
            return Some(Self::Recording);
        }
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(bytes, |end| &bytes[..end]);
        let text = std::str::from_utf8(whole).ok()?.trim_start_matches('\u{feff}').trim_start();
        if text.starts_with("<!DOCTYPE html>") {
            return Some(Self::Report);
        }
        if text.starts_with('{') && text.contains("\"schema\"") && text.contains("\"pam-") {
            return Some(Self::Json);
        }
        let header = text.lines().next()?;
        if header.split([',', '\t']).any(|name| name.trim().starts_with("reference_")) {
            return Some(Self::Check);
        }
        if header.contains([',', ';', '\t']) && header.contains("time_") && !header.contains('=') {
            return Some(Self::Recording);
        }
        let key = |name: &str| {
            text.lines()
                .any(|l| l.trim_start().strip_prefix(name).is_some_and(|r| r.trim_start().starts_with('=')))
        };
        let section = |name: &str| text.lines().any(|l| l.trim_start().starts_with(name));
        if key("rest_length_mm") && key("braid_angle_deg") {
            Some(Self::Muscle)
        } else if key("sample_Hz") || section("[[step]]") {
            Some(Self::Protocol)
        } else if section("[columns") || section("[lookup]") || key("split_by") {
            Some(Self::Import)
        } else {
            None
        }
    }

    /// What a file is; `None` where it cannot be read or is none of ours.
    #[must_use]
    pub fn of_file(path: &Path) -> Option<Self> {
        // A pipe was read already, and a second read would block.
        std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
        let mut bytes = Vec::new();
        std::fs::File::open(path).ok()?.take(LOOKED_AT).read_to_end(&mut bytes).ok()?;
        Self::of_bytes(&bytes)
    }

    /// Its common name.
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::Muscle => "a muscle's description",
            Self::Import => "an import description",
            Self::Protocol => "a protocol",
            Self::Table => "a table",
            Self::Recording => "a recording",
            Self::Check => "a check of the bench",
            Self::Json => "the JSON of a result",
            Self::Report => "a report",
        }
    }

    /// The failure of a file that is expected to be of this kind and is not.
    fn code(self) -> DataCode {
        match self {
            Self::Muscle => DataCode::MuscleInvalid,
            Self::Import => DataCode::ImportInvalid,
            Self::Protocol => DataCode::ProtocolInvalid,
            Self::Table => DataCode::TableInvalid,
            Self::Check => DataCode::CheckInvalid,
            Self::Recording | Self::Json | Self::Report => DataCode::RecordingNotText,
        }
    }

    /// An error about a file that is expected to be of this kind. Where it is recognised as another the cause states it, and the advice is
    /// that for all failures of the kind: an error in line 1 of the wrong file is of no use.
    #[must_use]
    pub fn wanted(self, path: &Path, error: Error) -> Error {
        match Self::of_file(path) {
            Some(found) if found != self => {
                let cause = format!("this is {}, not {}", found.description(), self.description());
                let swapped = Error::new(self.code(), cause).file(path);
                if error.code() == self.code() && error.advised() && error.place().line.is_none() {
                    let advice = error.advice().unwrap_or_default().to_owned();
                    swapped.help(advice)
                } else {
                    swapped
                }
            }
            _ => error.file(path),
        }
    }

    /// The text of a file of this kind.
    ///
    /// # Errors
    /// [`DataCode::FileUnreadable`]; the kind's own failure for a file that is not text.
    pub fn read_text(self, path: &Path) -> Result<String> {
        bounds::read_text(path, bounds::WRITTEN)?
            .map_err(|()| self.wanted(path, Error::new(self.code(), "the file is binary, not text")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_what_is_in_them() {
        let muscle = "name = \"m\"\nkind = \"push\"\nrest_length_mm = 3\nbraid_angle_deg= 77\n";
        let cases: [(&[u8], Option<FileKind>); 10] = [
            (muscle.as_bytes(), Some(FileKind::Muscle)),
            (b"name = \"p\"\nsample_Hz = 30.0\n\n[[step]]\ndo = \"rest\"\n", Some(FileKind::Protocol)),
            (b"# bench\n[columns.force]\ncolumn = 3\n", Some(FileKind::Import)),
            (b"time_s,pressure_kPa,displacement_mm,force_N\n1,2,3,4\n", Some(FileKind::Recording)),
            (b"time_s,force_N,reference_force_N\n1,2,2\n", Some(FileKind::Check)),
            (b"\x89MCAP0\r\n\x01", Some(FileKind::Recording)),
            (b"PAMF\x01\x00", Some(FileKind::Table)),
            (b"{\n  \"schema\": \"pam-fit/1\",\n", Some(FileKind::Json)),
            (b"hello\n", None),
            // A character that is cut in two at the end of what was read is not a reason to call it binary.
            (b"time_s;force_N\n1;2\n\xc3", Some(FileKind::Recording)),
        ];
        for (bytes, kind) in cases {
            assert_eq!(FileKind::of_bytes(bytes), kind, "{:?}", String::from_utf8_lossy(bytes));
        }
    }
}
