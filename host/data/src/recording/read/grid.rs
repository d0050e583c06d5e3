//! Static maps: a grid with a row for each pressure and a column of force for each length, as tables in papers and data sheets are printed.
//!
//! The grid is read column by column as a long table, one recording for each column, and then like any other file.

use std::borrow::Cow;
use std::io::{Cursor, Read};
use std::path::Path;

use super::super::columns::Recording;
use super::super::header::Header;
use super::super::import::{Decimal, Grid, Import, Missing, pattern};
use super::super::line::Cells;
use super::super::source;
use super::Reader;
use crate::error::{DataCode, Error, Result};

/// Rows of a map, at least.
const MIN_ROWS: usize = 3;
/// The largest grid, bytes: a printed table has a few thousand cells.
const LARGEST: u64 = 1 << 24;
/// A map has no times: time between two of its points, s.
const INTERVAL: f64 = 1.0;

impl Reader<'_> {
    /// Reads a grid.
    pub(super) fn grid(
        &self,
        path: &Path,
        mut source: source::Source,
        description: &Import,
        grid: &Grid,
    ) -> Result<Vec<Recording>> {
        let mut bytes = Vec::new();
        let read = source.reader.by_ref().take(LARGEST + 1).read_to_end(&mut bytes);
        read.map_err(|e| Error::unreadable(path, &e))?;
        if bytes.len() as u64 > LARGEST {
            return Err(Error::new(DataCode::ImportInvalid, "the file is too long for a grid")
                .help("leave [grid] out of the import description, or give the map as a table with one row for each point"));
        }
        let start = source::check_text(&bytes)?;
        let (text, names) = long_table(&bytes[start..], description, grid)?;
        let split_by = description.split_by.iter().cloned().chain(names).collect();
        let timed = description.sample_interval_s.is_some() || description.columns.contains_key("time");
        let import = Import {
            grid: None,
            delimiter: Some("comma".into()),
            decimal: Decimal::Point,
            skip_lines: 0,
            header: None,
            comment: None,
            preamble: None,
            split_by,
            sample_interval_s: if timed { description.sample_interval_s } else { Some(INTERVAL) },
            ..description.clone()
        };
        source.size = Some(text.len() as u64);
        source.reader = Box::new(Cursor::new(text.into_bytes()));
        Reader { min_rows: MIN_ROWS.min(self.min_rows), ..self.clone() }.text(
            path,
            source,
            Cow::Owned(import),
        )
    }
}

/// The long table, and the names of the columns that the headings give.
fn long_table(text: &[u8], description: &Import, grid: &Grid) -> Result<(String, Vec<String>)> {
    let header = Header::read(text, description)?;
    let invalid =
        |cause: &str| Error::new(DataCode::ImportInvalid, cause).column("grid.columns").value(&grid.columns);
    let pattern =
        pattern("grid.columns", Some(&grid.columns))?.ok_or_else(|| invalid("grid.columns is missing"))?;
    let groups: Vec<String> = pattern.capture_names().flatten().map(str::to_owned).collect();
    if groups.is_empty() {
        return Err(invalid("grid.columns catches nothing")
            .help("name what a heading tells, such as 'F_(?<length_mm>[0-9.]+)mm'"));
    }
    // Index of each column of the grid, and what its heading gives.
    let mut columns: Vec<(usize, Vec<String>)> = Vec::new();
    for (index, name) in header.names.iter().enumerate() {
        if let Some(caught) = pattern.captures(name) {
            let names = groups.iter().map(|g| caught.name(g).map_or("", |m| m.as_str()).to_owned());
            columns.push((index, names.collect()));
        }
    }
    if columns.is_empty() {
        return Err(invalid("no column matches grid.columns")
            .help(format!("the columns are {}", header.names.join(", "))));
    }
    let others: Vec<usize> =
        (0..header.names.len()).filter(|i| !columns.iter().any(|(c, _)| c == i)).collect();
    let mut rows: Vec<(u64, Vec<String>)> = Vec::new();
    for (number, line) in text[header.bytes..].split(|b| *b == b'\n').enumerate() {
        let number = header.lines + 1 + number as u64;
        let line = line.trim_ascii();
        if line.is_empty() || line.first().is_some_and(|b| Some(*b) == header.dialect.comment) {
            continue;
        }
        let cells = Cells::split(line, header.dialect).map_err(|()| {
            Error::new(DataCode::RecordingWrongWidth, "a quotation mark is not closed").line(number)
        })?;
        if cells.len() != header.names.len() {
            let cause = format!("{} cells below {} headings", cells.len(), header.names.len());
            return Err(Error::new(DataCode::RecordingWrongWidth, cause).line(number));
        }
        let plain = |c: &str| {
            let c = c.trim();
            if header.dialect.decimal_comma { c.replace(',', ".") } else { c.replace(',', " ") }
        };
        rows.push((number, cells.iter().map(|c| plain(c)).collect()));
    }
    let mut names: Vec<&str> = others.iter().map(|i| header.names[*i].as_str()).collect();
    names.extend(groups.iter().map(String::as_str));
    names.push(&grid.values);
    let mut long = names.join(",") + "\n";
    for (column, names) in &columns {
        for (number, cells) in &rows {
            let cell = &cells[*column];
            if !cell.parse::<f64>().is_ok_and(f64::is_finite) {
                if description.missing == Missing::Skip {
                    continue;
                }
                return Err(Error::new(
                    DataCode::RecordingNotANumber,
                    "this cell of the grid is not a number",
                )
                .line(*number)
                .column(&header.names[*column])
                .value(cell)
                .help("leave such cells out with missing = \"skip\""));
            }
            let mut line: Vec<&str> = others.iter().map(|i| cells[*i].as_str()).collect();
            line.extend(names.iter().map(String::as_str));
            line.push(cell);
            long += &line.join(",");
            long.push('\n');
        }
    }
    Ok((long, groups))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Import;

    const MAP: &str = "p_kPa;F at 250 mm;F at 234 mm\n100;50,5;0\n200;150;20\n300;260;80\n400;370;150\n";
    const DESCRIPTION: &str = "[grid]\ncolumns = 'F at (?<length_mm>[0-9]+) mm'\nvalues = \"force_N\"\n\
         [columns.pressure]\ncolumn = \"p_kPa\"\nunit = \"kPa\"\n";

    fn read(map: &str, description: &str) -> Result<Vec<Recording>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), map).unwrap();
        let import = Import::parse(description)?;
        Reader::with_rest_length(0.25).import(Some(&import)).file(file.path())
    }

    #[test]
    fn each_column_of_a_map_is_a_recording_at_its_length() {
        let read = read(MAP, DESCRIPTION).unwrap();
        assert_eq!(read.len(), 2);
        assert!((read[1].stroke[0] - 0.016).abs() < 1e-9, "{:?}", read[1].stroke);
        assert_eq!(read[0].require_force().unwrap()[0], 50.5);
        assert_eq!(read[1].pressure, [100e3, 200e3, 300e3, 400e3]);
        assert!(read[1].held_stroke().is_some() && read[0].time.windows(2).all(|t| t[1] > t[0]));
    }

    #[test]
    fn a_map_that_is_wrong_is_refused_with_its_place() {
        let error = read(&MAP.replace("150;20", "150;x"), DESCRIPTION).unwrap_err();
        assert_eq!(error.code(), DataCode::RecordingNotANumber);
        assert!(
            error.to_string().contains("line 3") || format!("{error:?}").contains("line: Some(3)"),
            "{error:?}"
        );
        let none = read(MAP, &DESCRIPTION.replace("F at", "G at")).unwrap_err();
        assert!(none.cause().contains("no column matches"), "{none}");
        assert!(read(MAP, &DESCRIPTION.replace("(?<length_mm>[0-9]+)", "[0-9]+")).is_err());
        assert!(read("p_kPa;F at 250 mm\n1;2;3\n", DESCRIPTION).is_err());
    }
}
