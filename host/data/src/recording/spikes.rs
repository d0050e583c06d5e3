//! Spikes: a reading that steps away and back within a few rows.

use std::ops::Range;

/// What lasts as many rows is no spike.
pub(super) const LONGEST: usize = 4;
/// The row after differs from the row before by less than this share of the step, beyond what was to be expected.
pub(super) const BACK: f64 = 0.25;

/// The row that ends a spike which begins at `start`; `step` is the least change from row to row.
pub(super) fn end_of_spike(column: &[f64], start: usize, step: f64) -> Option<usize> {
    let change = |i: usize| column[i] - column[i - 1];
    if start == 0 || start >= column.len() || !(change(start).abs() > step) {
        return None;
    }
    let (before, size) = (column[start - 1], change(start));
    let last = (start + LONGEST).min(column.len());
    (start + 1..last).find(|i| {
        change(*i).abs() > step && change(*i) * size < 0.0 && (column[*i] - before).abs() <= BACK * size.abs()
    })
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
}
