//! Reversals, stops, starts, and slow motion of a muscle, from the readings of its stroke around a row.

use crate::recording::white_noise;
use crate::statistics::median;

/// A motion exceeds this many standard deviations of a reading of the stroke.
const MOTION: f64 = 6.0;
/// A muscle is slow where it takes this many times as many rows to move as in the median row, of which some hundred are examined.
const SLOW: f64 = 3.0;
const SAMPLED: usize = 200;
/// A muscle that does not move in as many rows rests.
const FAR: usize = 1000;
/// The stroke turns within as many rows of the step: noise hides a turn by a row or two.
const TURN_ROWS: usize = 2;

/// The motion of a stroke sensor's readings.
pub(super) struct StrokeMotion<'a> {
    stroke: &'a [f64],
    /// The least change that is a motion, m.
    least: f64,
}

impl<'a> StrokeMotion<'a> {
    pub(super) fn of(stroke: &'a [f64]) -> Self {
        Self { stroke, least: MOTION * white_noise(stroke) }
    }

    fn has_left(&self, row: usize, other: usize) -> bool {
        (self.stroke[other] - self.stroke[row]).abs() > self.least
    }

    /// The direction of the motion to a row from as many rows before.
    fn before(&self, row: usize, rows: usize) -> Option<f64> {
        let from = (row.saturating_sub(rows)..row).rev().find(|k| self.has_left(row, *k))?;
        Some((self.stroke[row] - self.stroke[from]).signum())
    }

    /// The direction of the motion from a row in as many rows after.
    fn after(&self, row: usize, rows: usize) -> Option<f64> {
        let to = (row + 1..self.stroke.len().min(row + rows + 1)).find(|k| self.has_left(row, *k))?;
        Some((self.stroke[to] - self.stroke[row]).signum())
    }

    /// Whether the muscle turns, stops or sets off by a row, as the motion in this number of rows before and after shows.
    pub(super) fn reverses(&self, row: usize, rows: usize) -> bool {
        let rows = rows.max(TURN_ROWS);
        let near = row.saturating_sub(TURN_ROWS)..self.stroke.len().min(row + 2);
        near.into_iter().any(|k| self.before(k, rows) != self.after(k, rows))
    }

    /// Whether the muscle takes [`SLOW`] times as many rows to leave its place as it usually does.
    pub(super) fn is_slow(&self, row: usize) -> bool {
        let rows_to_leave = |row: usize, most: usize| {
            (1..=most)
                .find(|k| {
                    row.checked_sub(*k).is_some_and(|other| self.has_left(row, other))
                        || row + k < self.stroke.len() && self.has_left(row, row + k)
                })
                .unwrap_or(most)
        };
        let n = self.stroke.len();
        let sampled = (0..n).step_by((n / SAMPLED).max(1));
        let mut usual: Vec<f64> = sampled.map(|row| rows_to_leave(row, n.min(FAR)) as f64).collect();
        if usual.is_empty() {
            return false;
        }
        let slow = SLOW * median(&mut usual);
        rows_to_leave(row, slow.ceil() as usize) as f64 >= slow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_apex_of_a_parabola_is_slow_and_a_steady_motion_neither_turns_nor_is_slow() {
        let noise = |i: usize| (43_758.5 * (12.9898 * i as f64).sin()).rem_euclid(1.0) - 0.5;
        let there_and_back = |i: usize| 300.0 - (i as f64 - 300.0).abs();
        let stroke: Vec<f64> = (0..600).map(|i| there_and_back(i) + 0.1 * noise(i)).collect();
        let motion = StrokeMotion::of(&stroke);
        assert!(motion.reverses(300, 4) && motion.reverses(301, 4));
        assert!(!motion.reverses(100, 4) && !motion.is_slow(100));
        let parabola: Vec<f64> =
            (0..600).map(|i| 1e-3 * (i as f64 - 300.0).powi(2) + 0.1 * noise(i)).collect();
        let motion = StrokeMotion::of(&parabola);
        assert!(motion.is_slow(300) && !motion.is_slow(100) && !motion.is_slow(500));
        assert!(!StrokeMotion::of(&[]).is_slow(0));
    }
}
