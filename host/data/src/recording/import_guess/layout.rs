//! The layout of a text file: what separates its cells, how decimals are written, where the names are and where the rows begin.

use crate::recording::cells::Dialect;
use crate::recording::line::{Cells, is_remark};
use crate::recording::thousands::{self, SEPARATORS};

use super::names::unit;

/// Lines that the layout is judged by: past every preamble that a program writes.
const JUDGED: usize = 400;
/// A column holds numbers where at least this share of its cells does; the others may be missing.
const MOSTLY: f64 = 0.5;

/// The layout of a text file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub delimiter: u8,
    pub decimal_comma: bool,
    /// Whether lines are remarks.
    pub remarks: bool,
    /// What these begin with.
    pub comment: u8,
    /// The line of the names, counted from 0; `None` where no line names the columns.
    pub names_at: Option<usize>,
    pub names: Vec<String>,
    /// The units of a row of their own below the names.
    pub units: Option<Vec<String>>,
    /// The first line of numbers, counted from 0.
    pub data_at: usize,
}

impl Layout {
    /// The layout of a text, from its first lines; `None` where they are not a table.
    pub(super) fn of(lines: &[&[u8]]) -> Option<Self> {
        let judged = &lines[..lines.len().min(JUDGED)];
        let remarks = judged.iter().any(|l| is_remark(l, Some(b'#')));
        let (dialect, width) = dialect(judged)?;
        let rows: Vec<Option<Vec<String>>> = judged.iter().map(|l| cells(l, dialect)).collect();
        let numeric = numeric_columns(&rows, width, dialect.decimal_comma);
        let is_row = |row: &Option<Vec<String>>| {
            row.as_ref().is_some_and(|row| {
                let number = |(cell, numeric): (&String, &bool)| {
                    let plain = number(cell, dialect.decimal_comma).is_some() || is_missing(cell);
                    !numeric || plain || has_thousands(cell, dialect.decimal_comma)
                };
                row.len() == width
                    && row.iter().zip(&numeric).all(number)
                    && row.iter().any(|c| number_of(c, dialect.decimal_comma))
            })
        };
        let data_at = rows.iter().position(is_row)?;
        let mut layout = Self {
            delimiter: dialect.delimiter,
            decimal_comma: dialect.decimal_comma,
            remarks,
            comment: b'#',
            names_at: None,
            names: (1..=width).map(|n| n.to_string()).collect(),
            units: None,
            data_at,
        };
        layout.find_names(&rows, dialect, judged);
        Some(layout)
    }

    /// Looks for the names, and for units below them, above the first row.
    fn find_names(&mut self, rows: &[Option<Vec<String>>], dialect: Dialect, lines: &[&[u8]]) {
        let width = self.names.len();
        let is_text = |row: &[String]| {
            row.iter().filter(|c| !c.is_empty()).all(|c| !number_of(c, dialect.decimal_comma))
        };
        let is_names_row = |row: &[String]| row.len() == width && is_text(row);
        let mut above =
            rows[..self.data_at].iter().enumerate().rev().filter_map(|(n, r)| Some((n, r.as_ref()?)));
        match above.next() {
            Some((at, row)) if is_names_row(row) => {
                (self.names_at, self.names) = (Some(at), row.clone());
                if are_units(row)
                    && let Some((at, names)) = above.next().filter(|(_, names)| is_names_row(names))
                {
                    self.units = Some(row.clone());
                    (self.names_at, self.names) = (Some(at), names.clone());
                } else if !are_units(row)
                    && let Some((_, units)) =
                        above.next().filter(|(_, units)| is_names_row(units) && are_units(units))
                {
                    self.units = Some(units.clone());
                }
            }
            // Loggers write names for a column of remarks that most rows lack, or end every row with a delimiter.
            Some((_, row)) if is_text(row) && row.len() == width + 1 => self.names = row[..width].to_vec(),
            Some((_, row)) if is_text(row) && row.len() + 1 == width && ends_empty(rows, width) => {
                self.names[..width - 1].clone_from_slice(row);
            }
            _ => {
                let remark = lines[..self.data_at].iter().rev().find(|l| is_remark(l, Some(b'#')));
                let row =
                    remark.and_then(|remark| cells(remark.trim_ascii_start()[1..].trim_ascii(), dialect));
                if let Some(row) = row.filter(|row| is_names_row(row)) {
                    self.names = row;
                }
            }
        }
        self.of_labview(rows);
    }

    /// In a measurement file of LabVIEW the first column is the time in seconds, and the units of the others are in a line above.
    fn of_labview(&mut self, rows: &[Option<Vec<String>>]) {
        let of_line = |name: &str| {
            let first = |row: &&Vec<String>| row.first().is_some_and(|cell| cell == name);
            rows[..self.data_at].iter().flatten().rev().find(first)
        };
        if self.names[0] != "X_Value"
            || of_line("X_Dimension").is_none_or(|row| row.get(1).is_none_or(|x| x != "Time"))
        {
            return;
        }
        let labels = of_line("Y_Unit_Label").map(|row| &row[1..]).unwrap_or_default();
        let unit = |n: usize| labels.get(n).cloned().unwrap_or_default();
        self.units =
            Some(std::iter::once("s".to_owned()).chain((0..self.names.len() - 1).map(unit)).collect());
        "Time".clone_into(&mut self.names[0]);
        self.names_at = None;
    }

    /// How its lines are cut.
    pub(super) fn dialect(&self) -> Dialect {
        Dialect {
            delimiter: self.delimiter,
            comment: Some(self.comment),
            decimal_comma: self.decimal_comma,
            thousands: None,
            skip_missing: false,
        }
    }

    /// Whether the reader finds the names without help: in the line right above the rows.
    pub(super) fn has_header(&self, lines: &[&[u8]]) -> bool {
        let blank = |l: &&[u8]| l.trim_ascii().is_empty() || is_remark(l, Some(self.comment));
        self.units.is_none() && self.names_at.is_some_and(|at| lines[at + 1..self.data_at].iter().all(blank))
    }

    /// What separates the cells, as text.
    pub(super) fn delimiter_name(&self) -> &'static str {
        match self.delimiter {
            b'\t' => "tab",
            b';' => "semicolon",
            b' ' => "space",
            b'|' => "|",
            _ => "comma",
        }
    }
}

/// The cells of a line; `None` for a blank line, a remark, and a quotation mark that is not closed.
pub(super) fn cells(line: &[u8], dialect: Dialect) -> Option<Vec<String>> {
    let line = line.trim_ascii_end();
    if line.is_empty() || is_remark(line, dialect.comment) {
        return None;
    }
    let line = if dialect.delimiter == b' ' { line.trim_ascii_start() } else { line };
    Cells::split(line, dialect).ok()
}

/// A cell as a number.
pub(super) fn number(cell: &str, decimal_comma: bool) -> Option<f64> {
    let cell = cell.trim();
    let begins =
        cell.trim_start_matches(['-', '+']).starts_with(|c: char| c.is_ascii_digit() || c == '.' || c == ',');
    if !begins || decimal_comma && cell.contains('.') {
        return None;
    }
    let cell = if decimal_comma { cell.replace(',', ".") } else { cell.to_owned() };
    cell.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// Whether a cell is a number with separators of thousands.
fn has_thousands(cell: &str, decimal_comma: bool) -> bool {
    let decimal = if decimal_comma { b',' } else { b'.' };
    SEPARATORS.into_iter().filter(|s| *s != decimal && thousands::has(cell, *s)).any(|s| {
        thousands::without(cell.trim(), s, decimal_comma).is_some_and(|c| number_of(&c, decimal_comma))
    })
}

fn number_of(cell: &str, decimal_comma: bool) -> bool {
    number(cell, decimal_comma).is_some()
}

/// Whether a cell marks a missing value.
pub(super) fn is_missing(cell: &str) -> bool {
    let bare = cell.trim().trim_start_matches(['-', '+']).to_lowercase();
    ["", "nan", "inf", "infinity", "na", "n/a", "null", "none", "#n/a", "1.#qnan", "1.#inf"]
        .contains(&bare.as_str())
}

/// The delimiter and the decimal sign under which the second half of the lines has equally many cells, and most of them numbers.
fn dialect(lines: &[&[u8]]) -> Option<(Dialect, usize)> {
    let full: Vec<&[u8]> =
        lines.iter().copied().filter(|l| !l.trim_ascii().is_empty() && !is_remark(l, Some(b'#'))).collect();
    let body = &full[full.len() / 2..];
    let mut best: Option<(f64, Dialect, usize)> = None;
    for delimiter in *b"\t;,| " {
        for decimal_comma in [false, true] {
            // Between commas, decimal commas are possible in quotation marks only.
            if delimiter == b',' && decimal_comma && !body.iter().any(|l| l.contains(&b'"')) {
                continue;
            }
            let comment = Some(b'#');
            let dialect = Dialect { delimiter, comment, decimal_comma, thousands: None, skip_missing: false };
            let rows: Vec<Vec<String>> = body.iter().filter_map(|l| cells(l, dialect)).collect();
            let Some(width) = usual_width(&rows) else { continue };
            let like = rows.iter().filter(|r| r.len() == width);
            let (mut numbers, mut present, mut alike) = (0, 0, 0);
            for row in like {
                alike += 1;
                present += row.iter().filter(|c| !is_missing(c)).count();
                numbers += row.iter().filter(|c| number_of(c, decimal_comma)).count();
            }
            if width < 2 || numbers == 0 || present == 0 {
                continue;
            }
            let score = f64::from(alike) / body.len() as f64 * (numbers as f64 / present as f64);
            if best.is_none_or(|(b, ..)| score > b) {
                best = Some((score, dialect, width));
            }
        }
    }
    let (_, dialect, width) = best?;
    let other = Dialect { decimal_comma: !dialect.decimal_comma, ..dialect };
    // `7,133.3` proves the decimal sign of a file whose other cells, such as `205,320`, may have either.
    let proved = is_possible(body, other, true) && !is_possible(body, dialect, false);
    Some((if proved { other } else { dialect }, width))
}

/// Whether all cells of digits are numbers with this decimal sign, with separators of thousands or without; `proved`: and one of them can only
/// be one with both.
fn is_possible(lines: &[&[u8]], dialect: Dialect, proved: bool) -> bool {
    let comma = dialect.decimal_comma;
    let of_digits = |c: &&String| {
        let bare = c.trim().trim_start_matches(['-', '+']);
        bare.starts_with(|c: char| c.is_ascii_digit())
            && bare.chars().all(|c| c.is_ascii_digit() || ",.".contains(c))
    };
    let rows: Vec<Vec<String>> = lines.iter().filter_map(|l| cells(l, dialect)).collect();
    let mut all = rows.iter().flatten().filter(of_digits).peekable();
    let separator = if comma { b'.' } else { b',' };
    let certain = |c: &String| has_thousands(c, comma) && thousands::is_certain(c, separator, comma);
    let one = !proved || rows.iter().flatten().filter(of_digits).any(certain);
    one && all.peek().is_some() && all.all(|c| number_of(c, comma) || has_thousands(c, comma))
}

fn usual_width(rows: &[Vec<String>]) -> Option<usize> {
    let mut widths: Vec<usize> = rows.iter().map(Vec::len).collect();
    widths.sort_unstable();
    widths.chunk_by(|a, b| a == b).max_by_key(|c| c.len()).and_then(|c| c.first().copied())
}

/// Which columns hold numbers, by the second half of the lines.
fn numeric_columns(rows: &[Option<Vec<String>>], width: usize, decimal_comma: bool) -> Vec<bool> {
    let rows: Vec<&Vec<String>> = rows.iter().flatten().filter(|r| r.len() == width).collect();
    let body = &rows[rows.len() / 2..];
    let share = |column: usize| {
        let present = body.iter().filter(|r| !is_missing(&r[column])).count();
        let numbers = body.iter().filter(|r| number_of(&r[column], decimal_comma)).count();
        present > 0 && numbers as f64 >= MOSTLY * present as f64
    };
    (0..width).map(share).collect()
}

/// Whether the last cell of every row is empty, since it ends with a delimiter.
fn ends_empty(rows: &[Option<Vec<String>>], width: usize) -> bool {
    rows.iter().flatten().filter(|row| row.len() == width).all(|row| row[width - 1].is_empty())
}

/// Whether a row consists of units: at least two, and at least half of its cells.
fn are_units(row: &[String]) -> bool {
    let units = row.iter().filter(|c| unit(c.trim_matches(['[', ']', '(', ')', ' '])).is_some()).count();
    units >= 2 && 2 * units >= row.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Layout {
        let lines: Vec<&[u8]> = text.split('\n').map(str::as_bytes).collect();
        Layout::of(&lines).unwrap_or_else(|| panic!("no table: {text}"))
    }

    #[test]
    fn layouts_of_spreadsheets_and_test_machines_are_found() {
        let rows = |row: &str| format!("{row}\n").repeat(12);
        let german = of(&format!("Zeit [s];Druck [bar];Kraft [N]\n{}", rows("0,01;3,25;40,5")));
        assert_eq!((german.delimiter, german.decimal_comma, german.data_at), (b';', true, 1));
        assert_eq!(german.names, ["Zeit [s]", "Druck [bar]", "Kraft [N]"]);

        let machine = of(&format!("Test\t7\nFile\tx\n\nTime\tLoad\nsec\tN\n{}", rows("0.5\t7")));
        assert_eq!((machine.names_at, machine.data_at, machine.delimiter), (Some(3), 5, b'\t'));
        assert_eq!(machine.units.as_deref(), Some(&["sec".to_owned(), "N".to_owned()][..]));

        let bare = of(&rows("  0.5   7.25  -1e-3"));
        assert_eq!((bare.names_at, bare.data_at, bare.delimiter), (None, 0, b' '));
        assert_eq!(bare.names, ["1", "2", "3"]);

        let words = of(&format!("run,phase,t_s\n{}", rows("1,up,0.25")));
        assert_eq!((words.names_at, words.delimiter), (Some(0), b','));

        let remark = of(&format!("# time force\n{}", rows("1.5 2.5")));
        assert!(remark.remarks && remark.names == ["time", "force"]);
    }

    #[test]
    fn names_of_rows_with_another_width_are_found() {
        let rows = |row: &str| format!("{row}\n").repeat(12);
        let closed = of(&format!("time_s,force_N\n{}", rows("0.5,7,")));
        assert_eq!(
            (closed.names, closed.names_at, closed.data_at),
            (vec!["time_s".into(), "force_N".into(), "3".into()], None, 1)
        );
        let remarks = of(&format!("time_s,force_N,remark\n{}", rows("0.5,7")));
        assert_eq!((remarks.names, remarks.names_at), (vec!["time_s".to_owned(), "force_N".into()], None));
        let header = "LabVIEW Measurement\t\nY_Unit_Label\tkPa\tN\t\nX_Dimension\tTime\tTime\t\n***End_of_Header***\t\t\t\n";
        let labview = of(&format!("{header}X_Value\tP1\tLoad\tComment\n{}", rows("0.5\t7\t3")));
        assert_eq!(
            (labview.names, labview.names_at),
            (vec!["Time".to_owned(), "P1".into(), "Load".into()], None)
        );
        assert_eq!(labview.units, Some(vec!["s".to_owned(), "kPa".into(), "N".into()]));
    }

    #[test]
    fn prose_and_nothing_are_no_tables() {
        for text in ["", "\n\n", "hello\nworld\n", "one\n2\n3\n4\n"] {
            let lines: Vec<&[u8]> = text.split('\n').map(str::as_bytes).collect();
            assert_eq!(Layout::of(&lines), None, "{text}");
        }
    }
}
