//! Checks of a whole recording: rising time, physical limits, lengths.

use super::columns::Recording;
use crate::error::{DataCode, Error, Result};
use crate::physical_limits;

/// Metres as millimetres, rounded to a micrometre: further digits are rounding errors.
fn millimetres(metres: f64) -> f64 {
    let micrometres = (metres * 1e6).round();
    if micrometres.is_finite() { micrometres / 1e3 } else { metres * 1e3 }
}

/// Where more than one row in this many repeats the time of the row before, the clock is too coarse.
const COARSE: usize = 20;

/// The checks that a single cell does not show.
pub(super) fn check(recording: &Recording, line_of_row: &dyn Fn(usize) -> u64) -> Result<()> {
    let line = |i: usize| line_of_row(recording.rows.as_ref().map_or(i, |r| r[i] as usize));
    if let Some(i) = recording.time.windows(2).position(|w| w[1] <= w[0]) {
        let (before, after) = (recording.time[i], recording.time[i + 1]);
        let cause = if after == before { "time does not increase" } else { "time decreases" };
        let repeated = recording.time.windows(2).filter(|w| w[1] == w[0]).count();
        let twice = after == before
            && recording.pressure[i] == recording.pressure[i + 1]
            && recording.stroke[i] == recording.stroke[i + 1]
            && recording.force.as_ref().is_none_or(|f| f[i] == f[i + 1]);
        let help = if repeated * COARSE > recording.len() {
            "the resolution of the clock is coarser than the sample interval: log more digits, or give sample_interval_s in an import \
             description"
        } else if twice {
            "the row occurs twice: remove one of them"
        } else {
            "time must strictly increase within a file; if several runs are in one file, split it (split_by, or new_run = \"clock\" where \
             the clock begins again with each run), as `host import --guess` does"
        };
        return Err(Error::new(DataCode::RecordingTimeOrder, cause)
            .line(line(i + 1))
            .column("time")
            .value(format!("{after} s after {before} s"))
            .help(help));
    }
    for (i, p) in recording.pressure.iter().enumerate() {
        physical_limits::pressure(*p).map_err(|e| e.line(line(i)))?;
    }
    for (i, f) in recording.force.iter().flatten().enumerate() {
        physical_limits::force(*f).map_err(|e| e.line(line(i)))?;
    }
    if let Some(rest) = recording.rest_length
        && let Some(i) = recording.stroke.iter().position(|s| *s >= rest || *s <= -rest)
    {
        return Err(Error::new(DataCode::RecordingOutOfRange, "length outside the range of this muscle")
            .line(line(i))
            .value(format!("{} mm", millimetres(rest - recording.stroke[i])))
            .help(format!("its rest length is {} mm; check the unit and the zero", millimetres(rest))));
    }
    if let Some(i) = recording.temperature.as_ref().and_then(|t| t.iter().position(|k| *k <= 0.0)) {
        return Err(Error::new(DataCode::RecordingOutOfRange, "temperature below absolute zero")
            .line(line(i))
            .column("temperature")
            .help("check the unit in the column's name: C or K"));
    }
    Ok(())
}
