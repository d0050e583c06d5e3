//! The path of the stroke, row by row: direction, time since the last reversal, time at rest.

use std::iter::Peekable;
use std::slice;

use super::onset::Onset;
use super::{Kinematics, Recorded, Thresholds};

/// The state of the motion at a row.
pub(super) struct StrokePath<'a> {
    recorded: &'a Recorded<'a>,
    thresholds: Thresholds,
    /// Beginnings of strokes that are still to come.
    ahead: Peekable<slice::Iter<'a, Onset>>,
    direction: f64,
    turn_row: usize,
    turns: u32,
    piece: u32,
    /// Time at rest before this motion, or so far, s.
    rested: f64,
    /// A stand at the beginning goes on from the one before the recording, s.
    stood: f64,
    /// Where the length began to be held, while it is.
    hold: Option<usize>,
    /// The pressure that the hold began with, Pa. One that begins with a turn goes on from the hold before: what the air did since then
    /// has moved the friction as a ramp does.
    hold_pressure: f64,
    /// The farthest that the pressure went in this direction, at held length, Pa.
    pressure_extreme: f64,
    /// Whether the pressure has left the place where the hold began.
    ramped: bool,
    /// Since when, and at what pressure, the braid has been still.
    still_from: usize,
    still_pressure: f64,
}

impl<'a> StrokePath<'a> {
    /// Before the first row; the muscle stood for `rested` seconds.
    pub(super) fn begin(
        recorded: &'a Recorded<'a>,
        thresholds: Thresholds,
        starts: &'a [Onset],
        rested: f64,
    ) -> Self {
        let pressure = recorded.pressure[0];
        Self {
            recorded,
            thresholds,
            ahead: starts.iter().peekable(),
            direction: 0.0,
            turn_row: 0,
            turns: 0,
            piece: 0,
            rested,
            stood: rested,
            hold: None,
            hold_pressure: pressure,
            pressure_extreme: pressure,
            ramped: false,
            still_from: 0,
            still_pressure: pressure,
        }
    }

    /// Advances to a row, of which `k` knows whether the length is held, and enters its motion into `k`.
    pub(super) fn go(&mut self, row: usize, k: &mut Kinematics) {
        let Recorded { time, stroke, pressure, .. } = *self.recorded;
        let held = k.held[row];
        let before = self.direction;
        let mut turned = self.turns_by_stroke(row);
        if held && !turned {
            if self.hold.is_none() {
                self.hold = Some(row);
                self.hold_pressure = pressure[row];
                self.pressure_extreme = pressure[row];
                self.ramped = false;
            }
            turned = self.turns_at_held_length(row);
        }
        if !held || turned || (pressure[row] - self.still_pressure).abs() > self.thresholds.pressure {
            self.still_from = row;
            self.still_pressure = pressure[row];
        }
        if turned {
            self.turns += 1;
            self.turn_row = row;
        }
        let left = (pressure[row] - self.hold_pressure).abs() > self.thresholds.pressure;
        self.ramped = held && (self.ramped || left);
        k.ramped[row] = self.ramped;
        if held {
            self.rested = self.stood + time[row] - time[*self.hold.get_or_insert(row)];
        } else {
            // The rest before a motion stays on record until it turns, or until the next hold.
            if self.hold.take().is_none() && turned && before != 0.0 {
                self.rested = 0.0;
            }
            self.stood = 0.0;
        }
        if row > 0 && (turned || held != k.held[row - 1]) {
            self.piece += 1;
        }
        k.still[row] = time[row] - time[self.still_from];
        k.direction[row] = self.direction;
        k.turns[row] = self.turns;
        k.piece[row] = self.piece;
        k.hold_time[row] = self.rested;
        k.since_reversal[row] = time[row] - time[self.turn_row];
        k.travel[row] = (stroke[row] - stroke[self.turn_row]).abs();
    }

    /// Whether the stroke turns at this row.
    fn turns_by_stroke(&mut self, row: usize) -> bool {
        let Some(onset) = self.ahead.next_if(|onset| row >= onset.row) else { return false };
        let turns = onset.direction != self.direction;
        self.direction = onset.direction;
        turns
    }

    /// Whether, at held length, the bench says that the direction turns, or the pressure does.
    fn turns_at_held_length(&mut self, row: usize) -> bool {
        let Recorded { pressure, given, .. } = *self.recorded;
        let said = given.and_then(|g| g.get(row)).map_or(0.0, |g| f64::from(*g));
        if said != 0.0 {
            let turns = said != self.direction;
            self.direction = said;
            return turns;
        }
        let rise = pressure[row] - self.pressure_extreme;
        if self.direction != 0.0 && rise * self.direction >= 0.0 {
            self.pressure_extreme = pressure[row];
        } else if rise.abs() > self.thresholds.pressure {
            self.direction = rise.signum();
            self.pressure_extreme = pressure[row];
            return true;
        }
        false
    }
}
