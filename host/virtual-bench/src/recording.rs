//! Recordings, and the two forms in which they are written.

use std::fmt::Write as _;

/// One row, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Row {
    /// Bench clock, s.
    pub time: f64,
    /// Commanded pressure, Pa.
    pub command: f64,
    /// Measured pressure, Pa.
    pub pressure: f64,
    /// Measured contraction stroke, m.
    pub stroke: f64,
    /// Measured force, N.
    pub force: f64,
    /// Bladder temperature, °C.
    pub temperature: f64,
    /// Loop within the file, from 1; 0 outside loops.
    pub cycle: u32,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// File name without extension.
    pub name: String,
    /// In time order.
    pub rows: Vec<Row>,
}

/// Which optional columns are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Columns {
    /// Whether the column `pressure_command_kPa` is written.
    pub command: bool,
    /// Whether the column `temperature_C` is written.
    pub temperature: bool,
    /// Whether the column `cycle` is written.
    pub cycle: bool,
}

/// Newtons of one pound-force.
const POUND_FORCE: f64 = 4.448_221_615_260_5;
/// Pounds-force of one unit of the thesis's load-cell reading.
pub(crate) const LOAD_CELL: f64 = 508.41;

impl Recording {
    /// CSV with `time_s,pressure_kPa,displacement_mm,force_N` and the optional columns requested.
    pub fn csv(&self, columns: Columns) -> String {
        let mut out = String::with_capacity(48 * (self.rows.len() + 2));
        out.push_str("time_s,pressure_kPa,displacement_mm,force_N");
        for (on, name) in [
            (columns.command, ",pressure_command_kPa"),
            (columns.temperature, ",temperature_C"),
            (columns.cycle, ",cycle"),
        ] {
            if on {
                out.push_str(name);
            }
        }
        out.push('\n');
        for r in &self.rows {
            // Writing to a string does not fail.
            let _ =
                write!(out, "{:.4},{:.4},{:.5},{:.4}", r.time, r.pressure * 1e-3, r.stroke * 1e3, r.force);
            if columns.command {
                let _ = write!(out, ",{:.3}", r.command * 1e-3);
            }
            if columns.temperature {
                let _ = write!(out, ",{:.2}", r.temperature);
            }
            if columns.cycle {
                let _ = write!(out, ",{}", r.cycle);
            }
            out.push('\n');
        }
        out
    }

    /// The thesis's raw form: five header lines, tabs; column 2 the crosshead in inches, extension positive, with an arbitrary
    /// zero; column 4 the load cell, in units of 508.41 lbf. The pressure is in the header only.
    pub fn thesis(&self, muscle: &str, pressure: f64, zero_in: f64) -> String {
        let mut out = format!(
            "Test\t{muscle}\nSpecimen pressure (psi)\t{:.1}\nFile\t{}\nTime\tDisplacement\tCommand\tLoad\nsec\tin\tin\tV\n",
            pressure / 6_894.757_293_168,
            self.name
        );
        for r in &self.rows {
            let crosshead = zero_in - r.stroke / 0.0254;
            let cell = r.force / (LOAD_CELL * POUND_FORCE);
            let _ = writeln!(out, "{:.4}\t{crosshead:.6}\t{crosshead:.3}\t{cell:.8}", r.time);
        }
        out
    }
}
