//! The beginning of a text file: what separates its cells, what its columns are called, where its rows begin.

use super::cells::{Cells, Dialect};
use super::import::{Decimal, Import};
use crate::error::{Code, Error, Result};

/// The beginning of a text file: how it is cut, and what its columns are called.
pub(super) struct Head {
    pub dialect: Dialect,
    pub names: Vec<String>,
    /// Bytes above the header or the first row.
    pub preamble: usize,
    /// Bytes and lines that the head takes.
    pub bytes: usize,
    pub lines: u64,
}

impl Head {
    pub fn read(text: &[u8], import: &Import) -> Result<Self> {
        let comment = import.comment.and_then(|c| u8::try_from(c).ok());
        let mut bytes = 0;
        let mut lines = 0;
        let mut skipped = 0;
        loop {
            let rest = &text[bytes..];
            if rest.is_empty() {
                let cause = format!("the file ends within its first {lines} lines");
                return Err(Error::new(Code::RecordingTooShort, cause)
                    .help("see skip_lines in the import description"));
            }
            let end = memchr::memchr(b'\n', rest).map_or(rest.len(), |e| e + 1);
            let line = rest[..end].trim_ascii_end();
            let idle = line.is_empty() || line.first() == comment.as_ref();
            if skipped < import.skip_lines || idle {
                skipped += 1;
                bytes += end;
                lines += 1;
                continue;
            }
            let dialect = Dialect {
                delimiter: import.delimiter()?.unwrap_or_else(|| guess_delimiter(line, import)),
                comment,
                decimal_comma: import.decimal == Decimal::Comma,
            };
            let line = if line.contains(&b'\r') { Err(mac_lines()) } else { Ok(line) }?;
            let cells = Cells::split(line, dialect).map_err(|()| {
                Error::new(Code::RecordingWrongWidth, "a quotation mark is not closed").line(lines + 1)
            })?;
            if import.header == Some(false) {
                let names = (1..=cells.len()).map(|n| n.to_string()).collect();
                return Ok(Self { dialect, names, preamble: bytes, bytes, lines });
            }
            let numbers = cells.iter().filter(|c| c.parse::<f64>().is_ok()).count();
            if numbers > 0 && numbers == cells.len() {
                return Err(Error::new(Code::RecordingMissingColumn, "the file has no header line")
                    .line(lines + 1)
                    .value(String::from_utf8_lossy(&line[..line.len().min(100)]))
                    .help(
                        "put names with units above the numbers, such as `time_s,pressure_kPa,displacement_mm,force_N`, \
                         or describe the columns by number in an import description (--import)",
                    ));
            }
            return Ok(Self { dialect, names: cells, preamble: bytes, bytes: bytes + end, lines: lines + 1 });
        }
    }

    /// For streams of unknown size: none; the estimate is only for reserving memory.
    pub fn average_line(&self, rest: &[u8]) -> Option<u64> {
        (rest.len() < 65_536).then_some(rest.len() as u64)
    }
}

fn mac_lines() -> Error {
    Error::new(Code::RecordingNotText, "lines end in carriage returns only")
        .help("save the file with usual line ends")
}

/// A tab in the header decides, then a comma; with decimal commas, the semicolon that goes with them.
fn guess_delimiter(line: &[u8], import: &Import) -> u8 {
    if line.contains(&b'\t') {
        b'\t'
    } else if import.decimal == Decimal::Comma {
        b';'
    } else {
        b','
    }
}
