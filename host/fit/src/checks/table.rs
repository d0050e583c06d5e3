//! The table of a check: columns by name, in SI units.

use pam_data::statistics::extremes;
use std::path::{Path, PathBuf};

use pam_data::error::{DataCode, Error, Result};
use pam_data::file_kind::FileKind;
use pam_data::pluralise::pluralise;
use pam_data::recording::{HeaderName, Quantity, parse_header};

/// The prefix of the column that holds the reference.
const REFERENCE: &str = "reference_";
/// The column of a check by weighing: 1 where muscle and fittings hang on the cell, 0 where nothing does.
const ATTACHED: &str = "attached";
/// The column of a check by a closed valve: 1 where the valve between supply and muscle is closed, 0 where it is open.
const VALVE_CLOSED: &str = "valve_closed";
/// The smallest number of rows of a check.
const FEWEST: usize = 20;

/// The columns of a check.
pub(super) struct Table {
    file: PathBuf,
    /// Quantity, whether it is the reference, values in SI.
    columns: Vec<(Quantity, bool, Vec<f64>)>,
    /// Columns of 1 and 0, by name.
    states: Vec<(&'static str, Vec<f64>)>,
}

impl Table {
    /// Reads a comma- or tab-separated table with one header line.
    pub(super) fn read(file: &Path) -> Result<Self> {
        let text = FileKind::Check.read_text(file)?;
        let tabs = text.lines().next().is_some_and(|header| header.contains('\t'));
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(if tabs { b'\t' } else { b',' })
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let damaged = |e: &csv::Error| {
            let line = e.position().map_or(1, csv::Position::line);
            Error::new(DataCode::CheckInvalid, format!("line {line}: {e}")).file(file)
        };
        let header = reader.headers().map_err(|e| damaged(&e))?.clone();
        let mut columns = Vec::new();
        let mut wanted = Vec::new();
        let of_state = |state: &'static str| Some((header.iter().position(|name| name == state)?, state));
        let states_at: Vec<(usize, &'static str)> =
            [ATTACHED, VALVE_CLOSED].into_iter().filter_map(of_state).collect();
        let mut states: Vec<(&'static str, Vec<f64>)> = states_at.iter().map(|s| (s.1, Vec::new())).collect();
        for (at, name) in header.iter().enumerate() {
            let (reference, name) = name.strip_prefix(REFERENCE).map_or((false, name), |n| (true, n));
            match parse_header(name) {
                HeaderName::Known(quantity, unit) => {
                    wanted.push((at, unit));
                    columns.push((quantity, reference, Vec::new()));
                }
                HeaderName::UnknownUnit(quantity) => {
                    return Err(Error::new(
                        DataCode::CheckInvalid,
                        format!("unknown unit of the column `{}`", &header[at]),
                    )
                    .file(file)
                    .help(format!("{} is in {}", quantity.name(), quantity.unit_list())));
                }
                HeaderName::Other => {}
            }
        }
        for row in reader.records() {
            let row = row.map_err(|e| damaged(&e))?;
            let line = row.position().map_or(0, csv::Position::line);
            for ((at, name), (_, state)) in states_at.iter().zip(&mut states) {
                state.push(match &row[*at] {
                    "0" => 0.0,
                    "1" => 1.0,
                    other => {
                        let cause = format!("line {line}: `{other}` is neither 1 nor 0 for `{name}`");
                        return Err(Error::new(DataCode::CheckInvalid, cause).file(file));
                    }
                });
            }
            for ((at, unit), column) in wanted.iter().zip(&mut columns) {
                let value: Option<f64> = row[*at].parse().ok().filter(|v: &f64| v.is_finite());
                let Some(value) = value else {
                    return Err(Error::new(
                        DataCode::CheckInvalid,
                        format!("line {line}: `{}` is not a number for `{}`", &row[*at], &header[*at]),
                    )
                    .file(file));
                };
                column.2.push(value * unit.scale + unit.offset);
            }
        }
        let table = Self { file: file.to_owned(), columns, states };
        let rows = table.columns.first().map_or(0, |c| c.2.len());
        if rows < FEWEST {
            return Err(table.poor(format!("{}; a check needs at least {FEWEST}", pluralise(rows, "row"))));
        }
        Ok(table)
    }

    /// A column, if there is one.
    pub(super) fn find(&self, quantity: Quantity) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.0 == quantity && !c.1).map(|c| c.2.as_slice())
    }

    /// The time of each row, s, where it rises throughout.
    pub(super) fn rising_time(&self) -> Option<&[f64]> {
        self.find(Quantity::Time).filter(|t| t.is_sorted())
    }

    /// A column that the check cannot do without.
    pub(super) fn need(&self, quantity: Quantity) -> Result<&[f64]> {
        self.find(quantity).ok_or_else(|| self.missing("", quantity))
    }

    /// The column of the reference.
    pub(super) fn reference(&self, quantity: Quantity) -> Result<&[f64]> {
        let found = self.columns.iter().find(|c| c.0 == quantity && c.1);
        found.map(|c| c.2.as_slice()).ok_or_else(|| self.missing(REFERENCE, quantity))
    }

    /// Whether muscle and fittings hang on the cell, 1 or 0 by row.
    pub(super) fn attached(&self) -> Result<&[f64]> {
        self.state(ATTACHED)
    }

    /// Whether the valve between supply and muscle is closed, 1 or 0 by row.
    pub(super) fn valve_closed(&self) -> Result<&[f64]> {
        self.state(VALVE_CLOSED)
    }

    fn state(&self, name: &str) -> Result<&[f64]> {
        let found = self.states.iter().find(|s| s.0 == name);
        found.map(|s| s.1.as_slice()).ok_or_else(|| self.without_reference())
    }

    /// Whether the known quantity is this one.
    pub(super) fn has_reference(&self, quantity: Quantity) -> bool {
        self.reference(quantity).is_ok()
    }

    fn missing(&self, prefix: &str, quantity: Quantity) -> Error {
        let name = quantity.name();
        Error::new(DataCode::RecordingMissingColumn, format!("this check has no column `{prefix}{name}_`"))
            .file(&self.file)
            .help(format!("name it with its unit: {}", quantity.unit_list()))
    }

    /// The error of a file without a reference column.
    pub(super) fn without_reference(&self) -> Error {
        Error::new(DataCode::CheckInvalid, "there is no column of the reference")
            .file(&self.file)
            .help("a check has `reference_force_N`, `reference_displacement_mm`, `reference_pressure_kPa`, `attached` or `valve_closed` beside the reading")
    }

    /// The error of a check that determines nothing.
    pub(super) fn poor(&self, why: impl Into<String>) -> Error {
        Error::new(DataCode::CheckInvalid, why.into()).file(&self.file)
    }
}

/// Numbers the stretches of rows over which all of these quantities stay within a hundredth of their range.
pub(super) fn stays(of: &[&[f64]]) -> Vec<usize> {
    let n = of.first().map_or(0, |c| c.len());
    let near: Vec<f64> = of
        .iter()
        .map(|c| {
            let (low, high) = extremes(c.iter());
            0.01 * (high - low)
        })
        .collect();
    let mut stay = 0;
    let mut first = 0;
    (0..n)
        .map(|i| {
            if of.iter().zip(&near).any(|(c, near)| (c[i] - c[first]).abs() > *near) {
                (stay, first) = (stay + 1, i);
            }
            stay
        })
        .collect()
}
