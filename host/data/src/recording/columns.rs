//! One recording as columns in SI units.

use std::path::PathBuf;

use super::mountings::SAME_LENGTH;
use super::noise::white_noise;
use crate::error::{DataCode, Error, Result};
use crate::pluralise::pluralise;

/// A stroke that stays within this, m, is held: a tape measure's tenth of a millimetre.
pub const HELD: f64 = 1e-4;

/// How far readings of a held length stray from it, m: [`HELD`], and the noise of the sensor, of which six standard deviations are
/// exceeded once in five hundred million readings. At most half of a millimetre, which is another length.
pub(super) fn held_tolerance(stroke: &[f64]) -> f64 {
    (HELD + 6.0 * white_noise(stroke)).min(SAME_LENGTH)
}

/// One file, or one group of a file's rows, in time order. All columns are equally long and hold finite numbers only.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// What the recording is called in reports: the file's name, with the group's labels when a file was split.
    pub name: String,
    /// The file it came from.
    pub source: PathBuf,
    /// The values that set this group apart when a file was split: column name and text, in the order of `split_by`.
    pub labels: Vec<(String, String)>,
    /// The rows of the file that are here, counted from 0 below the header; `None` when all of them are, in order.
    pub rows: Option<Vec<u32>>,
    /// Rows of the file that were left out, since they lack a number; of a file that was split, the first recording counts them all.
    pub skipped: usize,
    /// L0 in metres that the stroke counts from, where it was needed or is known.
    pub rest_length: Option<f64>,
    /// Time in seconds, strictly increasing.
    pub time: Vec<f64>,
    /// Whether the time is one of day without a date: such times do not show the order of recordings.
    pub time_of_day: bool,
    /// Gauge pressure as measured, Pa.
    pub pressure: Vec<f64>,
    /// ΔL: contraction stroke in metres, positive when the muscle shortens (a push-PAM's rod extends).
    pub stroke: Vec<f64>,
    /// Force in newtons, positive as the muscle pulls (a push-PAM pushes).
    pub force: Option<Vec<f64>>,
    /// Temperature in kelvin.
    pub temperature: Option<Vec<f64>>,
    /// Commanded gauge pressure, Pa.
    pub pressure_command: Option<Vec<f64>>,
    /// Number of the cycle, as the file counts them.
    pub cycle: Option<Vec<u32>>,
    /// The direction of the bench, where the file has that column: 1 shortening or filling, −1 lengthening or emptying,
    /// 0 unknown.
    pub direction: Option<Vec<i8>>,
}

impl Recording {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Values in all its columns.
    pub(super) fn values(&self) -> usize {
        let optional = [&self.force, &self.temperature, &self.pressure_command];
        let columns = 3 + optional.iter().filter(|c| c.is_some()).count();
        // Those of cycles, directions and rows take less than one column together.
        (columns + 1) * self.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Whether two recordings were measured as one: the same numbers in every row, whatever they are called.
    #[must_use]
    pub fn same_rows(&self, other: &Self) -> bool {
        !self.is_empty()
            && self.time == other.time
            && self.stroke == other.stroke
            && self.pressure == other.pressure
            && self.force == other.force
    }

    /// Seconds from the first row to the last.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// The force column, for work that cannot do without.
    ///
    /// # Errors
    /// [`DataCode::RecordingMissingColumn`].
    pub fn require_force(&self) -> Result<&[f64]> {
        self.force.as_deref().ok_or_else(|| {
            Error::new(
                DataCode::RecordingMissingColumn,
                format!("the recording `{}` has no force", self.name),
            )
            .file(&self.source)
            .help("fitting and diagnosing need a column `force_N`, `force_kN` or `force_lbf`")
        })
    }

    /// The stroke in metres when it was held from the first row to the last, as in isometric tests: readings within [`HELD`] of the
    /// first one, or of their mean where the sensor is noisy.
    #[must_use]
    pub fn held_stroke(&self) -> Option<f64> {
        let first = *self.stroke.first()?;
        if self.stroke.iter().all(|s| (s - first).abs() <= HELD) {
            return Some(first);
        }
        let near = |value: f64, within: f64| self.stroke.iter().all(|s| (s - value).abs() <= within);
        if !near(first, 2.0 * SAME_LENGTH) {
            return None;
        }
        let mean = self.stroke.iter().sum::<f64>() / self.len() as f64;
        near(mean, held_tolerance(&self.stroke)).then_some(mean)
    }

    /// What the file calls the mounting of this recording: its labels without the number of a run or a cycle. Empty where there is none.
    #[must_use]
    pub fn mounting(&self) -> String {
        let repeats = |name: &str| {
            let name = name.to_ascii_lowercase();
            ["run", "cycle", "repeat", "trial"].iter().any(|word| name.starts_with(word))
        };
        let values: Vec<&str> =
            self.labels.iter().filter(|(name, _)| !repeats(name)).map(|(_, value)| value.as_str()).collect();
        values.join(" ")
    }

    /// The recording for a reader: its mounting and run where the file has labels, else its name.
    #[must_use]
    pub fn title(&self) -> String {
        if self.labels.is_empty() {
            return self.name.clone();
        }
        let part = |(name, value): &(String, String)| {
            // A number needs its column's name, a word does not.
            if value.parse::<f64>().is_ok() { format!("{name} {value}") } else { value.clone() }
        };
        self.labels.iter().map(part).collect::<Vec<_>>().join(", ")
    }

    /// The first row that breaks a promise of this type, for those who build recordings themselves.
    ///
    /// # Errors
    /// Names the column and the row; see the field docs for what holds.
    pub fn check(&self) -> Result<()> {
        let n = self.time.len();
        let optional = [&self.force, &self.temperature, &self.pressure_command];
        let names = ["force", "temperature", "pressure command"];
        let mut columns = vec![("time", &self.time), ("pressure", &self.pressure), ("stroke", &self.stroke)];
        columns.extend(names.iter().zip(optional).filter_map(|(n, c)| Some((*n, c.as_ref()?))));
        for (name, column) in columns {
            if column.len() != n {
                let cause = format!("{} of {name} beside {n} of time", pluralise(column.len(), "row"));
                return Err(Error::new(DataCode::RecordingWrongWidth, cause).file(&self.source));
            }
            if let Some(row) = column.iter().position(|v| !v.is_finite()) {
                return Err(Error::new(
                    DataCode::RecordingNotFinite,
                    format!("{name} is not finite at row {}", row + 1),
                )
                .file(&self.source));
            }
        }
        if let Some(row) = self.time.windows(2).position(|w| w[1] <= w[0]) {
            let cause = format!("time does not increase from row {} to row {}", row + 1, row + 2);
            return Err(Error::new(DataCode::RecordingTimeOrder, cause).file(&self.source));
        }
        let lengths = [self.cycle.as_ref().map(Vec::len), self.direction.as_ref().map(Vec::len)];
        if lengths.iter().flatten().any(|l| *l != n) {
            return Err(
                Error::new(DataCode::RecordingWrongWidth, "columns of unequal length").file(&self.source)
            );
        }
        Ok(())
    }
}
