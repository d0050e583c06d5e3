//! The beginning of a text file: what separates its cells, what its columns are called, where its rows begin.

use super::cells::Dialect;
use super::import::{Decimal, Import, Missing};
use super::line::{Cells, is_remark};
use super::quantity::{HeaderName, parse_header};
use crate::error::{DataCode, Error, Result};
use crate::pluralise::pluralise;

/// The beginning of a text file: how it is cut, and what its columns are called.
pub(super) struct Header {
    pub dialect: Dialect,
    pub names: Vec<String>,
    /// The lines above the rows that are neither blank nor remarks: names, units, and what a program writes above them.
    pub lines_above: Vec<Vec<u8>>,
    /// Bytes above the header or the first row.
    pub preamble: usize,
    /// Bytes and lines that the header takes.
    pub bytes: usize,
    pub lines: u64,
}

impl Header {
    pub(super) fn read(text: &[u8], import: &Import) -> Result<Self> {
        let mut header = Self::find(text, import)?;
        let above = text[..header.bytes].split(|b| *b == b'\n').map(<[u8]>::trim_ascii_end);
        let has_content = |line: &&[u8]| !line.is_empty() && !is_remark(line, header.dialect.comment);
        header.lines_above = above.filter(has_content).map(<[u8]>::to_vec).collect();
        Ok(header)
    }

    fn find(text: &[u8], import: &Import) -> Result<Self> {
        let first = FirstLine::find(text, import)?;
        let below = &text[first.end..];
        let dialect = first.dialect(import, below)?;
        let cells = first.split(first.line, dialect)?;
        let (start, end) = ((first.start, first.number - 1), (first.end, first.number));
        let header = |dialect, names, (bytes, lines)| Self {
            dialect,
            names,
            lines_above: Vec::new(),
            preamble: first.start,
            bytes,
            lines,
        };
        if import.header == Some(false) {
            let names = (1..=cells.len()).map(|n| n.to_string()).collect();
            return Ok(header(dialect, names, start));
        }
        if !cells.is_empty() && cells.iter().all(|c| c.parse::<f64>().is_ok()) {
            return Ok(header(dialect, first.names_in_remark(cells.len(), dialect)?, start));
        }
        let units = &below[..line_end(below)];
        if let Some(names) = with_units(&cells, &first.split(units.trim_ascii_end(), dialect)?) {
            let end = (first.end + units.len(), first.number + 1);
            return Ok(header(first.dialect(import, &below[units.len()..])?, names, end));
        }
        Ok(header(dialect, cells, end))
    }

    /// For streams of unknown size: none; the estimate is only for reserving memory.
    pub(super) fn average_line(&self, rest: &[u8]) -> Option<u64> {
        (rest.len() < 65_536).then_some(rest.len() as u64)
    }
}

/// The first line of a file that is not skipped, and what the lines above it say.
struct FirstLine<'a> {
    /// Its text, without its end.
    line: &'a [u8],
    /// Its place in the file, and that of the line below, in bytes.
    start: usize,
    end: usize,
    /// Its number, counted from 1.
    number: u64,
    /// The delimiter that a line `sep=;` of a spreadsheet names.
    stated_delimiter: Option<u8>,
    /// The last remark above it.
    remark: &'a [u8],
}

impl<'a> FirstLine<'a> {
    fn find(text: &'a [u8], import: &Import) -> Result<Self> {
        let comment = import.comment_byte();
        let (mut start, mut number) = (0, 1);
        let (mut stated_delimiter, mut remark): (_, &[u8]) = (None, &[]);
        loop {
            let rest = &text[start..];
            if rest.is_empty() {
                let cause = format!("the file ends within its first {}", pluralise(number - 1, "line"));
                return Err(Error::new(DataCode::RecordingTooShort, cause)
                    .help("see skip_lines in the import description"));
            }
            let end = start + line_end(rest);
            let line = text[start..end].trim_ascii_end();
            let is_remark = is_remark(line, comment);
            let separator = line.strip_prefix(b"sep=").filter(|d| d.len() == 1 && number == 1);
            if is_remark {
                remark = &line.trim_ascii_start()[1..];
            }
            if let Some([delimiter]) = separator {
                stated_delimiter = Some(*delimiter);
            }
            if number > import.skip_lines as u64 && !line.is_empty() && !is_remark && separator.is_none() {
                if line.contains(&b'\r') {
                    return Err(mac_lines());
                }
                return Ok(Self { line, start, end, number, stated_delimiter, remark });
            }
            (start, number) = (end, number + 1);
        }
    }

    /// How the file is written, by this line and the rows below it.
    fn dialect(&self, import: &Import, below: &[u8]) -> Result<Dialect> {
        let stated = import.delimiter()?.or(self.stated_delimiter);
        let delimiter = stated.unwrap_or_else(|| guess_delimiter(self.line, import));
        let thousands = import.thousands()?;
        let row = below.split(|b| *b == b'\n').find(|l| !l.trim_ascii().is_empty()).unwrap_or_default();
        let commas = delimiter != b',' && thousands != Some(b',') && has_decimal_commas(row, delimiter);
        Ok(Dialect {
            delimiter,
            comment: import.comment_byte(),
            decimal_comma: import.decimal == Decimal::Comma || commas,
            thousands,
            skip_missing: import.missing == Missing::Skip,
        })
    }

    fn split(&self, line: &[u8], dialect: Dialect) -> Result<Vec<String>> {
        Cells::split(line, dialect).map_err(|()| {
            Error::new(DataCode::RecordingWrongWidth, "a quotation mark is not closed").line(self.number)
        })
    }

    /// The names that some programs write as a remark above the numbers, where there is one for each column.
    fn names_in_remark(&self, columns: usize, dialect: Dialect) -> Result<Vec<String>> {
        let names = self.split(self.remark.trim_ascii(), dialect)?;
        if names.len() == columns && names.iter().any(|n| parse_header(n) != HeaderName::Other) {
            return Ok(names);
        }
        Err(Error::new(DataCode::RecordingMissingColumn, "the file has no header line")
            .line(self.number)
            .value(String::from_utf8_lossy(&self.line[..self.line.len().min(100)]))
            .help(
                "put names with units above the numbers, such as `time_s,pressure_kPa,displacement_mm,force_N`, \
                 or describe the columns by number in an import description (--import)",
            ))
    }
}

/// Bytes of the first line with its end.
fn line_end(text: &[u8]) -> usize {
    memchr::memchr(b'\n', text).map_or(text.len(), |e| e + 1)
}

/// The names with the units that test machines write into a row of their own below the header, in brackets or without; `None` where
/// the row below is none of units.
fn with_units(names: &[String], below: &[String]) -> Option<Vec<String>> {
    let bare = |unit: &str| unit.trim_matches(['(', ')', '[', ']', ' ']).to_owned();
    let joined: Vec<String> = names
        .iter()
        .zip(below)
        .map(|(name, unit)| {
            let with = format!("{name} [{}]", bare(unit));
            let gained = !matches!(parse_header(name), HeaderName::Known(..))
                && matches!(parse_header(&with), HeaderName::Known(..));
            if gained { with } else { name.clone() }
        })
        .collect();
    let gained = joined.iter().zip(names).filter(|(j, n)| j != n).count();
    let numbers = below.iter().any(|cell| cell.parse::<f64>().is_ok());
    (names.len() == below.len() && gained >= 2 && !numbers).then_some(joined)
}

/// The error of a file with the line ends of old Macintosh computers.
pub(super) fn mac_lines() -> Error {
    Error::new(DataCode::RecordingNotText, "lines end in carriage returns only")
        .help("save the file with usual line ends")
}

/// A tab in the header decides, then a comma, a semicolon, a blank; with decimal commas, the semicolon that goes with them.
fn guess_delimiter(line: &[u8], import: &Import) -> u8 {
    if line.contains(&b'\t') {
        b'\t'
    } else if import.decimal == Decimal::Comma {
        b';'
    } else {
        b",; ".iter().copied().find(|d| line.contains(d)).unwrap_or(b',')
    }
}

/// Whether a row's cells are numbers with decimal commas. `207,000` may be either; `0,207`, `1207,5` and `20,7` may not.
pub fn has_decimal_commas(row: &[u8], delimiter: u8) -> bool {
    let decimal = |cell: &[u8]| {
        let cell: Vec<u8> = cell.iter().copied().filter(|b| !b" \"+-".contains(b)).collect();
        let mut parts = cell.split(|b| *b == b',');
        let (Some(whole), Some(rest), None) = (parts.next(), parts.next(), parts.next()) else {
            return false;
        };
        let thousands = rest.len() == 3 && whole.len() <= 3 && whole != b"0";
        !rest.is_empty() && !thousands && whole.iter().chain(rest).all(u8::is_ascii_digit)
    };
    !row.contains(&b'.') && row.trim_ascii_end().split(|b| *b == delimiter).any(decimal)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use crate::recording::Reader;

    /// The same readings as other programs write them: what is certain needs no import description.
    #[test]
    fn files_of_spreadsheets_and_laboratory_programs_are_read() {
        let rows = |delimiter: &str, comma: bool, end: &str| {
            (0..20).fold(String::new(), |mut text, i| {
                let cells = [0.01 * f64::from(i), 300.125, 0.5 + 0.125 * f64::from(i), 40.5].map(|v| {
                    let cell = format!("{v:.3}");
                    if comma { cell.replace('.', ",") } else { cell }
                });
                write!(text, "{}{end}", cells.join(delimiter)).expect("text grows");
                text
            })
        };
        let names =
            |delimiter: &str| ["time_s", "pressure_kPa", "displacement_mm", "force_N"].join(delimiter);
        let forms = [
            format!("{}\n{}", names(","), rows(",", false, "\n")),
            format!("\u{feff}{}\r\n{}", names(","), rows(",", false, "\r\n")),
            format!("{}\r\n{}", names(";"), rows(";", true, "\r\n")),
            format!("{}\n{}", names(";"), rows(";", false, "\n")),
            format!("sep=;\r\n{}\r\n{}", names(";"), rows(";", true, "\r\n")),
            format!("{}\n{}", names("\t"), rows("\t", true, "\n")),
            format!("# bench 2\n{}\n{}", names(","), rows(",", false, "\n")),
            format!("# {}\n{}", names(" "), rows(" ", false, "\n")),
            format!("Time [s],Pressure (kPa),Displacement [mm], Force_N\n{}", rows(",", false, "\n")),
            format!(
                "Time\tPressure\tDisplacement\tForce\r\n(s)\t(kPa)\t(mm)\t(N)\r\n{}",
                rows("\t", false, "\r\n")
            ),
            format!("time;pressure;displacement;force\ns;kPa;mm;N\n{}", rows(";", true, "\n")),
            format!("{}\n{},,,\n , ,,\n", names(","), rows(",", false, "\n")),
            format!("{},Temperature [\u{b0}C]\n{}", names(","), rows(",", false, ",21.5\n")),
        ];
        let folder = tempfile::tempdir().expect("a folder");
        let read = |n: usize, text: &str| {
            let path = folder.path().join(format!("{n}.csv"));
            std::fs::write(&path, text).expect("a file");
            Reader::new().file(&path).unwrap_or_else(|e| panic!("{text}: {e}")).remove(0)
        };
        let spreadsheet = format!("\u{feff}{}\r\n{}", names("\t"), rows("\t", true, "\r\n"));
        let utf16 =
            |bytes: fn(u16) -> [u8; 2]| spreadsheet.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
        for (n, bytes) in [utf16(u16::to_le_bytes), utf16(u16::to_be_bytes)].iter().enumerate() {
            let path = folder.path().join(format!("unicode{n}.txt"));
            std::fs::write(&path, bytes).expect("a file");
            let recording = Reader::new().file(&path).unwrap_or_else(|e| panic!("{e}")).remove(0);
            assert!((recording.stroke[19] - 2.875e-3).abs() < 1e-12 && recording.len() == 20);
        }
        for (n, form) in forms.iter().enumerate() {
            let recording = read(n, form);
            assert_eq!(recording.len(), 20, "{form}");
            assert!((recording.pressure[7] - 300_125.0).abs() < 1e-6, "{form}");
            assert!((recording.stroke[19] - 2.875e-3).abs() < 1e-12, "{form}");
        }
    }

    #[test]
    fn a_comma_between_thousands_is_no_decimal_comma() {
        assert!(!super::has_decimal_commas(b"1;207,000;3;40", b';'));
        assert!(super::has_decimal_commas(b"0,010;207,000;3;40", b';'));
        assert!(!super::has_decimal_commas(b"0.5;a,b;3", b';'));
    }
}
