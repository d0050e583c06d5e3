//! Settled rows of a run, and which way pressure or stroke moves from one of them to the next.
//!
//! Valve pulses ring, and single rows would turn with each ring: at held lengths the direction is that of the settled rows.

use crate::statistics::range;
use std::collections::VecDeque;

use super::criteria::{FAST_SHARE, FAST_WITHIN, FEWEST_SETTLED, SETTLE, TURN, TURN_HOLD};

/// The least fast move of a pressure with this range.
#[must_use]
pub fn fast_step(range: f64) -> f64 {
    FAST_SHARE * range
}

/// By how much a column with this range must come back before it has turned.
#[must_use]
pub fn reversal_threshold(range: f64) -> f64 {
    TURN * range
}

/// Rows long enough after the last fast move of the pressure; all rows where too few are.
#[must_use]
pub fn settled(time: &[f64], pressure: &[f64]) -> Vec<bool> {
    let settled = at_rest(time, pressure, SETTLE);
    let count = settled.iter().filter(|s| **s).count();
    if (count as f64) < FEWEST_SETTLED * time.len() as f64 { vec![true; time.len()] } else { settled }
}

/// Rows at least `since` s after the last fast move of the pressure.
#[must_use]
pub fn at_rest(time: &[f64], pressure: &[f64], since: f64) -> Vec<bool> {
    let n = time.len();
    let limit = fast_step(range(pressure));
    let mut settled = vec![true; n];
    let (mut high, mut low): (VecDeque<usize>, VecDeque<usize>) = (VecDeque::new(), VecDeque::new());
    let mut last = f64::NEG_INFINITY;
    for i in 0..n {
        while high.back().is_some_and(|j| pressure[*j] <= pressure[i]) {
            high.pop_back();
        }
        high.push_back(i);
        while low.back().is_some_and(|j| pressure[*j] >= pressure[i]) {
            low.pop_back();
        }
        low.push_back(i);
        // The row before counts however long ago it was.
        let old = |j: usize| time[i] - time[j] > FAST_WITHIN && j + 1 < i;
        while high.front().is_some_and(|j| old(*j)) {
            high.pop_front();
        }
        while low.front().is_some_and(|j| old(*j)) {
            low.pop_front();
        }
        let before = if i > 0 { (pressure[i] - pressure[i - 1]).abs() } else { 0.0 };
        let (top, bottom) =
            (high.front().map_or(0.0, |j| pressure[*j]), low.front().map_or(0.0, |j| pressure[*j]));
        if (top - bottom).max(before) > limit {
            last = time[i];
        }
        settled[i] = time[i] - last >= since && i > 0;
    }
    settled
}

/// The sign of a signal's motion between its reversals: 1 or −1 for every value.
#[must_use]
pub fn way(values: &[f64], threshold: f64, hold: f64) -> Vec<f64> {
    let mut direction = vec![1.0; values.len()];
    let Some(first) = values.first() else { return direction };
    let (mut sign, mut start, mut high, mut low) = (0.0, 0, *first, *first);
    for (i, &v) in values.iter().enumerate() {
        high = f64::max(high, v);
        low = f64::min(low, v);
        if sign >= 0.0 && high - v > threshold {
            let mut end = i.saturating_sub(1);
            while end > start && values[end] < high - hold {
                end -= 1;
            }
            direction[start..=end].fill(1.0);
            (start, sign, low, high) = (end + 1, -1.0, v, v);
        } else if sign <= 0.0 && v - low > threshold {
            let mut end = i.saturating_sub(1);
            while end > start && values[end] > low + hold {
                end -= 1;
            }
            direction[start..=end].fill(if sign < 0.0 { -1.0 } else { 1.0 });
            (start, sign, low, high) = (end + 1, 1.0, v, v);
        }
    }
    direction[start..].fill(if sign == 0.0 { 1.0 } else { sign });
    direction
}

/// Direction of every row by the settled ones; a row in motion takes that of the next settled row, where the pulse leads.
#[must_use]
pub fn settled_way(pressure: &[f64], settled: &[bool]) -> Vec<f64> {
    let rows: Vec<usize> = (0..pressure.len()).filter(|i| settled[*i]).collect();
    let values: Vec<f64> = rows.iter().map(|i| pressure[*i]).collect();
    let span = range(&values);
    let known = way(&values, reversal_threshold(span), TURN_HOLD * span);
    let mut all = vec![1.0; pressure.len()];
    let mut next = 0;
    for (i, d) in all.iter_mut().enumerate() {
        while next + 1 < rows.len() && rows[next] < i {
            next += 1;
        }
        *d = known.get(next).copied().unwrap_or(1.0);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hold_keeps_its_direction_and_ripple_does_not_turn() {
        let values = [0.0, 50.0, 100.0, 99.5, 100.0, 99.2, 60.0, 20.0, 0.0, 0.4, 40.0, 90.0];
        let d = way(&values, 5.0, 1.0);
        assert_eq!(d, [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0]);
    }

    #[test]
    fn rows_ringing_after_a_pulse_are_not_settled() {
        let time: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
        let pressure: Vec<f64> = time.iter().map(|t| if *t < 1.0 { 100.0 } else { 200.0 }).collect();
        let settled = settled(&time, &pressure);
        assert!(settled[50] && settled[99]);
        assert!(!settled[100] && !settled[120]);
        assert!(settled[140]);
    }
}
