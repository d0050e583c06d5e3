//! Two recordings side by side: by how much each quantity differs at the same time after the start.

use crate::error::{DataCode, Error, Result};
use crate::pluralise::pluralise;
use crate::recording::Recording;

/// One quantity of both recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: &'static str,
    /// The unit of the numbers below.
    pub unit: &'static str,
    /// Root mean square of B − A.
    pub rms: f64,
    /// Mean of B − A.
    pub mean: f64,
    /// Largest size of B − A.
    pub largest: f64,
    /// When that was, s after the start; 0 where nothing differs.
    pub largest_at: f64,
    /// B − A at every row that was compared.
    pub difference: Vec<f64>,
}

/// What a comparison gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Seconds that both cover.
    pub overlap: f64,
    /// Rows of A that were compared.
    pub rows: usize,
    /// Time of each of them after the start, s.
    pub time: Vec<f64>,
    /// The quantities that both have.
    pub columns: Vec<Column>,
}

/// Compares B with A: B is joined by straight lines and read at A's times, both counted from their starts.
///
/// # Errors
/// [`DataCode::RecordingTooShort`] where they have no second in common.
pub fn compare(a: &Recording, b: &Recording) -> Result<Comparison> {
    let start = |r: &Recording| r.time.first().copied().unwrap_or(0.0);
    let overlap = a.duration().min(b.duration());
    let rows = a.time.iter().take_while(|t| **t - start(a) <= overlap).count();
    if rows < 2 || b.len() < 2 {
        return Err(Error::new(
            DataCode::RecordingTooShort,
            "the recordings have no stretch of time in common",
        ));
    }
    let force = a.force.as_ref().zip(b.force.as_ref());
    let pairs = [
        ("force", "N", 1.0, force),
        ("pressure", "kPa", 1e-3, Some((&a.pressure, &b.pressure))),
        ("displacement", "mm", 1e3, Some((&a.stroke, &b.stroke))),
    ];
    let mut columns = Vec::new();
    for (name, unit, scale, values) in pairs {
        let Some((x, y)) = values else { continue };
        let mut column =
            Column { name, unit, rms: 0.0, mean: 0.0, largest: 0.0, largest_at: 0.0, difference: Vec::new() };
        let mut at = 1;
        for i in 0..rows {
            let since = a.time[i] - start(a);
            let t = start(b) + since;
            while at + 1 < b.len() && b.time[at] < t {
                at += 1;
            }
            let share = ((t - b.time[at - 1]) / (b.time[at] - b.time[at - 1])).clamp(0.0, 1.0);
            let read = y[at - 1] + share * (y[at] - y[at - 1]);
            // Joining by lines rounds: what differs by the last digits only does not differ.
            let same = (read - x[i]).abs() <= 1e-12 * (y[at - 1].abs() + y[at].abs() + x[i].abs());
            let difference = if same { 0.0 } else { scale * (read - x[i]) };
            column.rms += difference * difference;
            column.mean += difference;
            column.difference.push(difference);
            if difference.abs() > column.largest {
                (column.largest, column.largest_at) = (difference.abs(), since);
            }
        }
        column.rms = (column.rms / rows as f64).sqrt();
        column.mean /= rows as f64;
        columns.push(column);
    }
    let time = a.time[..rows].iter().map(|t| t - start(a)).collect();
    Ok(Comparison { overlap, rows, time, columns })
}

impl Comparison {
    /// Lines for a terminal.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{} over {:.3} s, B − A\n", pluralise(self.rows, "row"), self.overlap);
        text += &format!("{:<18}{:>12}{:>12}{:>12}{:>10}\n", "", "rms", "mean", "largest", "at s");
        for c in &self.columns {
            let name = format!("{}, {}", c.name, c.unit);
            if c.largest == 0.0 {
                text += &format!("{name:<18}{:>12}\n", "the same");
                continue;
            }
            text += &format!(
                "{name:<18}{:>12.4}{:>12.4}{:>12.4}{:>10.3}\n",
                c.rms, c.mean, c.largest, c.largest_at
            );
        }
        text.trim_end().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_difference_is_found_whatever_the_rates_and_starts() {
        let ramp = |from: f64, rate: f64, count: u32, offset: f64| {
            let time: Vec<f64> = (0..count).map(|i| from + f64::from(i) / rate).collect();
            let force = time.iter().map(|t| 10.0 * (t - from) + offset).collect();
            let zero = vec![0.0; count as usize];
            Recording {
                time,
                force: Some(force),
                pressure: zero.clone(),
                stroke: zero,
                ..Recording::default()
            }
        };
        let found = compare(&ramp(0.0, 100.0, 301, 0.0), &ramp(50.0, 33.0, 67, 2.0)).unwrap();
        assert!((found.overlap - 2.0).abs() < 1e-9 && found.rows == 201, "{found:?}");
        let force = &found.columns[0];
        assert!((force.rms - 2.0).abs() < 1e-9 && (force.mean - 2.0).abs() < 1e-9, "{force:?}");
        assert_eq!(found.columns[1].rms, 0.0);
        assert!(compare(&ramp(0.0, 1.0, 1, 0.0), &ramp(0.0, 1.0, 9, 0.0)).is_err());
    }
}
