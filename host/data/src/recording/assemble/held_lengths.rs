//! One file of an isometric test at several lengths: where the length changes, and with it where a recording begins.

use crate::recording::columns::{HELD, held_tolerance};
use crate::recording::motion::criteria::{STAY_ROWS, STAY_SWEEP};
use crate::recording::text_column::TextColumn;
use crate::statistics::{extremes, median};

/// Stays at one length, each with the rows that it ends before; `None` where the stroke moves in between, or where there is one only.
fn stays(stroke: &[f64]) -> Option<Vec<usize>> {
    let tolerance = held_tolerance(stroke);
    let (mut sum, mut start) = (*stroke.first()?, 0);
    let mut ends = Vec::new();
    for (row, pair) in stroke.windows(2).enumerate() {
        let row = row + 1;
        let count = row - start;
        if (pair[1] - sum / count as f64).abs() <= tolerance {
            sum += pair[1];
            continue;
        }
        if (pair[1] - pair[0]).abs() <= tolerance || count < STAY_ROWS {
            return None;
        }
        ends.push(row);
        (sum, start) = (pair[1], row);
    }
    ends.push(stroke.len());
    (ends.len() > 1 && stroke.len() - start >= STAY_ROWS).then_some(ends)
}

/// The held length as `label` writes it and the number of its stay, for each row, where the whole file is an isometric test at several
/// lengths: the stroke (m) jumps from one held length to another, and the pressure moves at each. Where the stroke is stepped at held
/// pressures instead, the steps are the motion, and the file stays whole.
pub(super) fn held_lengths(
    stroke: &[f64],
    pressure: &[f64],
    label: impl Fn(f64) -> String,
) -> Option<[TextColumn; 2]> {
    let ends = stays(stroke)?;
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let ranges: Vec<_> = starts.zip(ends.iter().copied()).collect();
    let span = |(start, end): (usize, usize)| {
        pressure.get(start..end).map(extremes).map_or(0.0, |(low, high)| high - low)
    };
    let mut spans: Vec<f64> = ranges.iter().map(|range| span(*range)).collect();
    if median(&mut spans) < STAY_SWEEP * span((0, pressure.len())) {
        return None;
    }
    let (mut lengths, mut runs) = (TextColumn::default(), TextColumn::default());
    let mut seen: Vec<(f64, usize)> = Vec::new();
    for (start, end) in ranges {
        let here = stroke[start..end].iter().sum::<f64>() / (end - start) as f64;
        let known = seen.iter().position(|(length, _)| (length - here).abs() <= HELD);
        let visit = known.unwrap_or_else(|| {
            seen.push((here, 0));
            seen.len() - 1
        });
        seen[visit].1 += 1;
        lengths.push_many(&label(seen[visit].0), end - start);
        runs.push_many(&seen[visit].1.to_string(), end - start);
    }
    Some([lengths, runs])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stays of `rows` rows at these strokes, in mm; the pressure sweeps at each.
    fn sweeps(strokes_mm: &[f64], rows: usize) -> (Vec<f64>, Vec<f64>) {
        let stroke = strokes_mm.iter().flat_map(|mm| vec![mm * 1e-3; rows]).collect();
        let pressure = strokes_mm.iter().flat_map(|_| (0..rows).map(|i| 5e3 * i as f64)).collect();
        (stroke, pressure)
    }

    fn millimetres(stroke: f64) -> String {
        format!("{} mm", (1e3 * stroke).round())
    }

    fn split(stroke: &[f64], pressure: &[f64]) -> Option<[TextColumn; 2]> {
        held_lengths(stroke, pressure, millimetres)
    }

    #[test]
    fn each_stay_at_a_length_is_a_run_of_it() {
        let (stroke, pressure) = sweeps(&[0.0, 7.2, 0.0], 50);
        let [lengths, runs] = split(&stroke, &pressure).expect("three stays");
        let at = |row: usize| (lengths.get(row), runs.get(row));
        assert_eq!(
            [at(0), at(49), at(50), at(149)],
            [("0 mm", "1"), ("0 mm", "1"), ("7 mm", "1"), ("0 mm", "2")]
        );
    }

    #[test]
    fn the_noise_of_the_sensor_is_no_motion() {
        let (mut stroke, pressure) = sweeps(&[0.0, 7.2, 0.0], 500);
        for (i, x) in stroke.iter_mut().enumerate() {
            // Uniform within 50 µm on either side.
            *x += 1e-4 * ((43_758.5 * (12.9898 * i as f64).sin()).rem_euclid(1.0) - 0.5);
        }
        let [lengths, runs] = split(&stroke, &pressure).expect("three stays");
        let at = |row: usize| (lengths.get(row), runs.get(row));
        assert_eq!([at(499), at(500), at(1499)], [("0 mm", "1"), ("7 mm", "1"), ("0 mm", "2")]);
    }

    #[test]
    fn strokes_that_move_or_step_at_held_pressure_stay_whole() {
        let (stroke, pressure) = sweeps(&[0.0, 7.5, 15.0], 50);
        assert!(split(&stroke[..50], &pressure[..50]).is_none(), "one length");
        let held: Vec<f64> = (0..150).map(|i| 1e5 * f64::from(i / 50)).collect();
        assert!(split(&stroke, &held).is_none(), "the stroke steps at held pressures");
        let ramp: Vec<f64> = (0..150).map(|i| 1e-5 * f64::from(i)).collect();
        assert!(split(&ramp, &pressure).is_none(), "the stroke moves");
        let mut moved = stroke.clone();
        moved[50] = 3e-3;
        assert!(split(&moved, &pressure).is_none(), "the move is part of the recording");
    }
}
