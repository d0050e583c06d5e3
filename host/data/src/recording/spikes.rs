//! Spikes: a reading that steps away and back within a few rows, farther than it changes over the rows beside.

use std::ops::Range;

use super::white_noise;
use crate::statistics::median;

/// What lasts as many rows is not a spike.
pub(super) const LONGEST: usize = 4;
/// The row after differs from the row before by less than this share of the step, beyond what was to be expected.
pub(super) const BACK: f64 = 0.25;
/// A step is this many times as large as the changes beside it.
pub(super) const SUDDEN: f64 = 2.0;
/// This many changes on either side of a spike count. Where a fast stroke turns, it steps no farther than in the rows beside.
const BESIDE: usize = 4;
/// The least number of them that shows how far the readings usually change.
const FEWEST: usize = 3;

/// The row that ends a spike which begins at `start`; `step` is the least change from row to row.
pub(super) fn end_of_spike(column: &[f64], start: usize, step: f64) -> Option<usize> {
    let change = |i: usize| column[i] - column[i - 1];
    if start == 0 || start >= column.len() || !(change(start).abs() > step) {
        return None;
    }
    let (before, size) = (column[start - 1], change(start));
    let last = (start + LONGEST).min(column.len());
    let end = (start + 1..last).find(|i| {
        change(*i).abs() > step && change(*i) * size < 0.0 && (column[*i] - before).abs() <= BACK * size.abs()
    })?;
    // The apex of a fast stroke that sets off from rest is reached and left as fast.
    let onward = |i: usize, way: f64| match column.get(i) {
        Some(_) if i > 0 && change(i) * way > 0.0 => change(i).abs(),
        _ => 0.0,
    };
    let beside = change_beside(column, start..end).max(onward(start - 1, size).min(onward(end + 1, -size)));
    (size.abs() > SUDDEN * beside).then_some(end)
}

/// The rows at which the column changes beside some rows.
fn beside(column: &[f64], rows: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
    let earlier = rows.start.saturating_sub(BESIDE).max(1)..rows.start;
    let later = rows.end + 1..(rows.end + 1 + BESIDE).min(column.len());
    earlier.chain(later)
}

/// The median change from row to row beside some rows of a column, in its unit; zero where there are no others.
#[must_use]
pub fn usual_change(column: &[f64], rows: Range<usize>) -> f64 {
    let mut changes: Vec<f64> = beside(column, &rows).map(|i| (column[i] - column[i - 1]).abs()).collect();
    if changes.is_empty() { 0.0 } else { median(&mut changes) }
}

/// The same without the changes to and from readings of exactly the value of these rows: those are further spikes of a logger that writes
/// one value for each reading that it missed. At least [`FEWEST`] changes must be left: readings that come and go every other row are none.
pub(super) fn change_beside(column: &[f64], rows: Range<usize>) -> f64 {
    let value = column[rows.start];
    let other = |i: &usize| column[*i] != value && column[*i - 1] != value;
    let mut changes: Vec<f64> =
        beside(column, &rows).filter(other).map(|i| (column[i] - column[i - 1]).abs()).collect();
    if changes.len() < FEWEST { usual_change(column, rows) } else { median(&mut changes) }
}

/// A spike leaves the readings beside it by this many standard deviations of a reading: of a normal distribution next to nothing does.
pub(super) const ABOVE_NOISE: f64 = 12.0;

/// The reading of a column in every `stride`th row, unless it belongs to a spike of any size: the readings that show the usual range. A
/// quantile of all readings is that of the spikes where their share exceeds its rank.
pub(super) fn without_spikes(column: &[f64], stride: usize) -> impl Iterator<Item = f64> + '_ {
    let mut spikes = spikes(column, ABOVE_NOISE * white_noise(column)).into_iter().peekable();
    let reading = move |i: usize| {
        while spikes.next_if(|s| s.end <= i).is_some() {}
        spikes.peek().is_none_or(|s| i < s.start).then(|| column[i])
    };
    (0..column.len()).step_by(stride.max(1)).filter_map(reading)
}

/// All spikes of a column, in order.
pub(super) fn spikes(column: &[f64], step: f64) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut i = 1;
    while i < column.len() {
        match end_of_spike(column, i, step) {
            Some(end) => {
                found.push(i..end);
                i = end + 1;
            }
            None => i += 1,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_to_three_rows_away_are_a_spike_and_four_are_none() {
        let column = [1.0, 9.0, 1.0, 1.0, 9.0, 9.0, 9.0, 1.1, 1.0, 9.0, 9.0, 9.0, 9.0, 1.0, 1.0];
        assert_eq!(spikes(&column, 2.0), [1..2, 4..7]);
        assert_eq!(spikes(&[], 1.0), []);
    }

    #[test]
    fn the_turn_of_a_fast_stroke_is_no_spike() {
        let triangle: Vec<f64> = (0..60).map(|i| f64::from((i % 20 - 10_i32).abs())).collect();
        assert_eq!(spikes(&triangle, 0.5), []);
        let few_readings: Vec<f64> = (0..60).map(|i| (f64::from(i) * 0.8).sin()).collect();
        assert_eq!(spikes(&few_readings, 0.1), []);
        let from_rest = [0.0, 0.0, 0.0, 0.0, 6.1, 12.1, 6.9, 2.8, 0.4, 0.0, 0.0, 0.0];
        assert_eq!(spikes(&from_rest, 1.0), []);
    }
}
