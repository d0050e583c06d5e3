//! The rows about a reversal of the motion.

use std::ops::Range;

use super::law::{Law, Place};
use crate::baselines::Baseline;
use crate::criteria::filtered_channels::{FILTER_ROWS, FILTER_WINDOW};
use crate::rows::Rows;
use pam_fit::numerics::least_squares::least_squares;

/// A reversal between two strokes.
pub(super) struct Turn {
    /// Its first row.
    pub from: usize,
    /// The first row with the direction behind it.
    pub at: usize,
    /// The row behind its last.
    pub to: usize,
    /// When the stroke is farthest, s.
    pub farthest: f64,
    /// When the lines through the strokes on either side meet, s.
    pub meets: f64,
    /// Speeds of the strokes on either side, m/s.
    speeds: [f64; 2],
    /// The farthest stroke, m.
    stroke: f64,
}

/// The reversals that have strokes of enough rows on both sides.
pub(super) fn turns(rows: &Rows) -> Vec<Turn> {
    let moves = |i: usize| rows.contexts()[i].speed != 0.0 && !rows.vented[i];
    let same = |a: &usize, b: &usize| {
        rows.recording[*a] == rows.recording[*b] && rows.sign[*a] == rows.sign[*b] && moves(*a) == moves(*b)
    };
    let indices: Vec<usize> = (0..rows.len()).collect();
    let strokes: Vec<Range<usize>> =
        indices.chunk_by(same).filter_map(|s| Some(*s.first()?..s.last()? + 1)).collect();
    let turns = strokes.windows(2).filter(|pair| {
        let (before, after) = (pair[0].start, pair[1].start);
        moves(before)
            && moves(after)
            && rows.recording[before] == rows.recording[after]
            && rows.sign[before] * rows.sign[after] < 0.0
            && pair.iter().all(|stroke| stroke.len() >= FILTER_ROWS)
    });
    turns.map(|pair| Turn::new(rows, &pair[0], &pair[1])).collect()
}

impl Turn {
    fn new(rows: &Rows, before: &Range<usize>, after: &Range<usize>) -> Self {
        let at = after.start;
        let reach = (before.len().min(after.len()) / 2).min(FILTER_WINDOW);
        let (from, to) = (at - reach, at + reach);
        let (farthest, stroke) = farthest(rows, at);
        let [one, other] = [from..at - reach / 2, at + reach / 2..to].map(|part| line(rows, part));
        let meets = (one[0] - other[0]) / (other[1] - one[1]);
        let meets = if meets.is_finite() { meets } else { farthest };
        Self { from, at, to, farthest, meets, speeds: [one[1], other[1]], stroke }
    }

    /// Direction of friction at a row by a law, where the reversal is recorded at a time.
    pub(super) fn friction(&self, rows: &Rows, i: usize, time: f64, law: Law) -> f64 {
        let stroke = |i: usize| rows.contexts()[i].stroke;
        let direction = rows.sign[self.at];
        let next = if let Law::AsSpeed(ahead) = law { i + ahead } else { i };
        let speed = (stroke(next) - stroke(i - 1)) / (rows.local_time[next] - rows.local_time[i - 1]);
        let change = (speed - self.speeds[0]) / (self.speeds[1] - self.speeds[0]);
        let place = Place {
            time: rows.local_time[i] - time,
            travel: ((stroke(i) - self.stroke) * direction).max(0.0),
            speed: change.clamp(0.0, 1.0),
        };
        direction * (2.0 * law.turned(place) - 1.0)
    }

    /// What a law leaves of the rows, N²: beside it the table's error there, a parabola over the stroke, and the size of friction are
    /// fitted.
    pub(super) fn energy(&self, rows: &Rows, fitted: &Baseline, time: f64, law: Law) -> f64 {
        let row = |i: usize| {
            let gap = fitted.quasi[i] * fitted.friction[i];
            let travel = rows.contexts()[i].stroke - self.stroke;
            let columns = [1.0, travel, travel * travel, gap * self.friction(rows, i, time, law)];
            let weight = rows.root_weight()[i];
            (columns.map(|c| c * weight), (fitted.raw_residual[i] - gap * rows.sign[i]) * weight)
        };
        let counts = |i: &usize| rows.root_weight()[*i] > 0.0;
        let all: Vec<([f64; 4], f64)> = (self.from..self.to).filter(counts).map(row).collect();
        let found = least_squares(&all, 4);
        let left = |(columns, force): &([f64; 4], f64)| {
            force - columns.iter().zip(&found).map(|(c, x)| c * x).sum::<f64>()
        };
        all.iter().map(|row| left(row).powi(2)).sum()
    }
}

/// The line through the strokes of a stretch of rows: its value at time zero and its slope.
fn line(rows: &Rows, part: Range<usize>) -> [f64; 2] {
    let of = |i: usize| ([1.0, rows.local_time[i]], rows.contexts()[i].stroke);
    let found = least_squares(&part.map(of).collect::<Vec<_>>(), 2);
    [found[0], found[1]]
}

/// When, s, and where, m, the stroke turned that has the new direction from row `at` on: at the vertex of the parabola through the farthest
/// row and its neighbours.
fn farthest(rows: &Rows, at: usize) -> (f64, f64) {
    let (time, stroke) = (|i: usize| rows.local_time[i], |i: usize| rows.contexts()[i].stroke);
    let nearer = |a: &usize, b: &usize| (stroke(*b) * rows.sign[at]).total_cmp(&(stroke(*a) * rows.sign[at]));
    let row = (at - 2..=at + 1).max_by(nearer).unwrap_or(at);
    let slope = |i: usize| ((stroke(i) - stroke(row)) / (time(i) - time(row)), time(i) - time(row));
    let ((left, before), (right, after)) = (slope(row - 1), slope(row + 1));
    let curvature = (right - left) / (after - before);
    let at_row = left - curvature * before;
    let shift = (-at_row / (2.0 * curvature)).clamp(before.min(after), after.max(before));
    if !shift.is_finite() {
        return (time(row), stroke(row));
    }
    (time(row) + shift, stroke(row) + (at_row + curvature * shift) * shift)
}
