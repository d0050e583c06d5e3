//! What a recording of a controller holds, column by column: one list for CSV, for MCAP and for its schema.

use std::fmt::Write;

use model_core::link::messages::{Mode, SideSample, State, Telemetry};

use crate::messages;

/// One value of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell {
    /// A time in µs, written in seconds.
    Time(u64),
    /// A measured or computed number.
    Number(f32),
    /// A count.
    Count(u64),
    /// A word.
    Word(&'static str),
}

/// One column: its name with the unit behind the last underscore, what it is, and where it comes from.
pub(super) struct Column {
    pub name: &'static str,
    pub about: &'static str,
    pub cell: fn(&Telemetry) -> Cell,
}

impl Column {
    /// A cell of this column, for its type.
    pub fn sample_cell(&self) -> Cell {
        (self.cell)(&blank())
    }

    /// The type in JSON's words.
    pub fn kind(&self) -> &'static str {
        match self.sample_cell() {
            Cell::Time(_) | Cell::Number(_) => "number",
            Cell::Count(_) => "integer",
            Cell::Word(_) => "string",
        }
    }
}

fn blank() -> Telemetry {
    Telemetry {
        time_us: 0,
        tick: 0,
        state: State::Disarmed,
        mode: Mode::Vent,
        setpoint: 0.0,
        setpoint_second: 0.0,
        sides: heapless::Vec::new(),
    }
}

/// A recording without a single sample still has a header: that of a board with one muscle.
pub(super) fn plain_header() -> String {
    header(&blank())
}

/// The header of a board with two muscles.
pub(super) fn second_header() -> String {
    let sides = [SideSample::default(), SideSample::default()].into_iter().collect();
    header(&Telemetry { sides, ..blank() })
}

fn side(sample: &Telemetry, number: usize, pick: fn(&SideSample) -> f32) -> Cell {
    Cell::Number(sample.sides.get(number).map_or(f32::NAN, pick))
}

macro_rules! column {
    ($name:literal, $about:literal, $cell:expr) => {
        Column { name: $name, about: $about, cell: $cell }
    };
}

/// Columns of every recording. The measured ones are those that `host fit` reads; the rest is the state of the controller.
pub(super) const COLUMNS: &[Column] = &[
    column!("time_s", "time of the device, s", |s| Cell::Time(s.time_us)),
    column!("pressure_Pa", "measured gauge pressure, Pa", |s| side(s, 0, |x| x.pressure_pa)),
    column!("displacement_m", "measured stroke, m", |s| side(s, 0, |x| x.stroke_m)),
    column!("force_N", "measured force, N", |s| side(s, 0, |x| x.force_n)),
    column!("pressure_command_Pa", "command to the regulator, Pa", |s| side(s, 0, |x| x.command_pa)),
    column!("pressure_demand_Pa", "demanded pressure: feed-forward and trim, Pa", |s| side(s, 0, |x| x
        .pressure_demand_pa)),
    column!("table_N", "force by the table at the measured pressure and stroke, N", |s| side(s, 0, |x| x
        .model_n)),
    column!("setpoint", "setpoint, in the SI unit of the mode", |s| Cell::Number(s.setpoint)),
    column!("state", "disarmed, armed, running or fault", |s| Cell::Word(messages::state(s.state))),
    column!("mode", "what is controlled", |s| Cell::Word(messages::mode(s.mode))),
    column!("tick", "number of the control loop's tick", |s| Cell::Count(s.tick)),
];

/// Further columns where a board drives two muscles.
pub(super) const SECOND: &[Column] = &[
    column!("second_pressure_Pa", "second muscle: measured gauge pressure, Pa", |s| side(s, 1, |x| x
        .pressure_pa)),
    column!("second_displacement_m", "second muscle: measured stroke, m", |s| side(s, 1, |x| x.stroke_m)),
    column!("second_force_N", "second muscle: measured force, N", |s| side(s, 1, |x| x.force_n)),
    column!("second_command_Pa", "second muscle: command to the regulator, Pa", |s| side(s, 1, |x| x
        .command_pa)),
    column!("second_asked", "second setpoint of a pair", |s| Cell::Number(s.setpoint_second)),
];

/// The columns of a sample.
pub(super) fn columns(sample: &Telemetry) -> impl Iterator<Item = &'static Column> + use<> {
    let second = if sample.sides.len() > 1 { SECOND } else { &[] };
    COLUMNS.iter().chain(second)
}

/// The header line of a CSV with this sample's columns.
pub(super) fn header(sample: &Telemetry) -> String {
    columns(sample).map(|c| c.name).collect::<Vec<_>>().join(",") + "\n"
}

/// Adds a cell to a line. Numbers are written in the fewest digits that read back as the same bits.
fn write_cell(out: &mut String, cell: Cell, json: bool) {
    // Writing to a string cannot fail.
    let _ = match cell {
        Cell::Time(us) => write!(out, "{}.{:06}", us / 1_000_000, us % 1_000_000),
        Cell::Number(v) if json && !v.is_finite() => write!(out, "null"),
        Cell::Number(v) => write!(out, "{v}"),
        Cell::Count(v) => write!(out, "{v}"),
        Cell::Word(w) if json => write!(out, "\"{w}\""),
        Cell::Word(w) => write!(out, "{w}"),
    };
}

/// Adds a sample as a line of CSV.
pub(super) fn write_csv(out: &mut String, sample: &Telemetry) {
    for (number, column) in columns(sample).enumerate() {
        if number > 0 {
            out.push(',');
        }
        write_cell(out, (column.cell)(sample), false);
    }
    out.push('\n');
}

/// A sample as the text of a JSON object.
pub(super) fn json(sample: &Telemetry) -> String {
    let mut out = String::with_capacity(320);
    for (number, column) in columns(sample).enumerate() {
        out += if number > 0 { ",\"" } else { "{\"" };
        out += column.name;
        out += "\":";
        write_cell(&mut out, (column.cell)(sample), true);
    }
    out.push('}');
    out
}
