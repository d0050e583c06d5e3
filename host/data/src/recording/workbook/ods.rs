//! OpenDocument spreadsheets, as LibreOffice writes them.

use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use super::super::column_table::damaged;
use super::grid::Grid;
use super::{Sheets, archive};
use crate::error::Result;

/// A row that is repeated more often is the empty rest of a sheet.
const REPEATED: usize = 10_000;

/// The names of all sheets, and the cells of the requested one, or of all.
pub(super) fn sheets(bytes: &[u8], wanted: Option<&str>) -> Result<Sheets> {
    let text = archive::text(bytes, "content.xml")?;
    let mut xml = Reader::from_str(&text);
    let mut sheets = Sheets::default();
    let mut table: Option<Table> = None;
    loop {
        match xml.read_event().map_err(damaged)? {
            Event::Start(e) => match (e.local_name().as_ref(), &mut table) {
                ("table", None) => {
                    let name = attribute(&e, "name").unwrap_or_default();
                    table = Some(Table::new(&name, wanted.is_none_or(|w| w == name)));
                    sheets.names.push(name);
                }
                ("table-row", Some(table)) => table.begin_row(&e),
                ("table-cell" | "covered-table-cell", Some(table)) => table.begin_cell(&e),
                ("annotation", Some(table)) => table.notes += 1,
                ("p", Some(table)) if table.text.is_some() => table.paragraph(),
                _ => {}
            },
            Event::Empty(e) => match (e.local_name().as_ref(), &mut table) {
                ("table-row", Some(table)) => {
                    table.begin_row(&e);
                    table.end_row()?;
                }
                ("table-cell" | "covered-table-cell", Some(table)) => {
                    table.begin_cell(&e);
                    table.end_cell();
                }
                ("s" | "tab" | "line-break", Some(table)) => table.push(" "),
                _ => {}
            },
            Event::Text(t) => {
                if let Some(table) = &mut table {
                    table.push(&t.xml10_content());
                }
            }
            Event::GeneralRef(e) => {
                if let Some(table) = &mut table {
                    let character = e.resolve_char_ref().map_err(damaged)?;
                    match character {
                        Some(c) => table.push(c.encode_utf8(&mut [0; 4])),
                        None => table.push(resolve_predefined_entity(&e).unwrap_or_default()),
                    }
                }
            }
            Event::End(e) => match (e.local_name().as_ref(), &mut table) {
                ("table", Some(_)) => {
                    if let Some(done) = table.take().filter(|t| t.wanted) {
                        sheets.read.push((done.name, done.grid));
                    }
                }
                ("table-row", Some(table)) => table.end_row()?,
                ("table-cell" | "covered-table-cell", Some(table)) => table.end_cell(),
                ("annotation", Some(table)) => table.notes = table.notes.saturating_sub(1),
                _ => {}
            },
            Event::Eof => return Ok(sheets),
            _ => {}
        }
    }
}

/// The value of an attribute, by its name without the prefix.
fn attribute(e: &BytesStart<'_>, name: &str) -> Option<String> {
    let mut found = e.attributes().flatten().filter(|a| a.key.local_name().as_ref() == name);
    found
        .next()
        .and_then(|a| a.normalized_value(XmlVersion::Implicit1_0).ok().map(std::borrow::Cow::into_owned))
}

fn repeated(e: &BytesStart<'_>, name: &str) -> usize {
    attribute(e, name).and_then(|n| n.parse().ok()).unwrap_or(1)
}

/// A sheet while it is read.
#[derive(Debug)]
struct Table {
    name: String,
    wanted: bool,
    grid: Grid,
    row: usize,
    column: usize,
    /// How often the row and the cell are repeated.
    rows: usize,
    cells: usize,
    /// The cells of the row: first column, how many, text.
    line: Vec<(usize, usize, String)>,
    value: Option<String>,
    text: Option<String>,
    /// Comments of a user that are open: they are no contents of a cell.
    notes: usize,
}

impl Table {
    fn new(name: &str, wanted: bool) -> Self {
        Self {
            name: name.to_owned(),
            wanted,
            grid: Grid::default(),
            row: 0,
            column: 0,
            rows: 1,
            cells: 1,
            line: Vec::new(),
            value: None,
            text: None,
            notes: 0,
        }
    }

    fn begin_row(&mut self, e: &BytesStart<'_>) {
        self.rows = repeated(e, "number-rows-repeated");
        self.column = 0;
        self.line.clear();
    }

    fn end_row(&mut self) -> Result<()> {
        let line = std::mem::take(&mut self.line);
        if self.wanted && !line.is_empty() {
            if self.rows > REPEATED {
                return Err(damaged(format!("a row is repeated {} times", self.rows)));
            }
            for row in self.row..self.row.saturating_add(self.rows) {
                for (column, cells, text) in &line {
                    for column in *column..column.saturating_add(*cells) {
                        self.grid.put_text(row, column, text)?;
                    }
                }
            }
        }
        self.row = self.row.saturating_add(self.rows);
        Ok(())
    }

    fn begin_cell(&mut self, e: &BytesStart<'_>) {
        self.cells = repeated(e, "number-columns-repeated");
        let plain = ["value", "date-value", "time-value", "boolean-value", "string-value"];
        let kind = e.attributes().flatten().find(|a| a.key.as_ref() == "office:value-type");
        let kind = kind.map(|a| a.value.into_owned()).unwrap_or_default();
        self.value = match kind.as_str() {
            "float" | "percentage" | "currency" => attribute(e, "value"),
            "boolean" => {
                attribute(e, "boolean-value").map(|v| if v == "true" { "1" } else { "0" }.to_owned())
            }
            "string" | "" => attribute(e, "string-value"),
            _ => plain.iter().find_map(|name| attribute(e, name)),
        };
        self.text = (kind == "string" && self.value.is_none()).then(String::new);
        self.notes = 0;
    }

    fn end_cell(&mut self) {
        let contents = self.value.take().or_else(|| self.text.take()).filter(|t| !t.trim().is_empty());
        if let Some(contents) = contents {
            self.line.push((self.column, self.cells, contents));
        }
        self.column = self.column.saturating_add(self.cells);
        self.text = None;
    }

    fn paragraph(&mut self) {
        if self.text.as_ref().is_some_and(|t| !t.is_empty()) {
            self.push(" ");
        }
    }

    fn push(&mut self, text: &str) {
        if let Some(own) = self.text.as_mut().filter(|_| self.notes == 0) {
            own.push_str(text);
        }
    }
}
