//! What follows from the reversals and holds of a recording, sample by sample.

use super::criteria::CYCLE_SHARE;
use super::{Cause, Motion, Recording, Reversal};

/// Columns that follow from a motion, one value per sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionColumns {
    /// Travel since the last reversal, m.
    pub travel: Vec<f64>,
    /// Time since the last reversal, s; since the start of the recording before the first.
    pub since_reversal: Vec<f64>,
    /// How long the muscle has been resting, or rested before its present motion, s.
    pub hold_time: Vec<f64>,
    /// Number of the cycle, from 1; the file's own numbers where it has them.
    pub cycle: Vec<u32>,
}

impl Motion {
    /// The columns that follow from the motion.
    #[must_use]
    pub fn columns(&self, recording: &Recording) -> MotionColumns {
        let (time, stroke) = (&recording.time, &recording.stroke);
        let n = time.len().min(stroke.len());
        let mut columns = MotionColumns {
            travel: Vec::with_capacity(n),
            since_reversal: Vec::with_capacity(n),
            hold_time: vec![0.0; n],
            cycle: recording.cycle.clone().unwrap_or_else(|| self.cycles(recording)),
        };
        let mut starts = self.reversals.iter().map(|t| t.index).peekable();
        // The reversal itself lies between two samples; the one before is the nearer estimate of where it was.
        let mut from = 0;
        let mut farthest = 0.0_f64;
        for i in 0..n {
            if starts.next_if_eq(&i).is_some() {
                from = i.saturating_sub(1);
                farthest = 0.0;
            }
            farthest = farthest.max((stroke[i] - stroke[from]) * f64::from(self.direction[i]));
            columns.travel.push(farthest);
            columns.since_reversal.push(time[i] - time[from]);
        }
        for (k, hold) in self.holds.iter().enumerate() {
            // The rest before a motion counts until that motion turns or rests.
            let mut reversal = self.reversals.partition_point(|t| t.index <= hold.end);
            let leaving = |t: &Reversal| {
                t.index <= hold.end + 2 || (stroke[t.index] - hold.stroke).abs() <= self.stroke_threshold
            };
            while self.reversals.get(reversal).is_some_and(leaving) {
                reversal += 1;
            }
            let until = self.reversals.get(reversal).map_or(n, |t| t.index);
            let next = self.holds.get(k + 1).map_or(n, |h| h.start);
            for i in hold.start..until.min(next).max(hold.end + 1).min(n) {
                columns.hold_time[i] = time[i.min(hold.end)] - time[hold.start];
            }
        }
        columns
    }

    /// Numbers the cycles: one ends where the muscle, or at held length the pressure, has gone back by most of what
    /// it did and starts again. Minor loops do not count.
    fn cycles(&self, recording: &Recording) -> Vec<u32> {
        let n = self.direction.len();
        let mut cycle = vec![1; n];
        let column =
            |cause: Cause| if cause == Cause::Pressure { &recording.pressure } else { &recording.stroke };
        let mut number = 1;
        let mut begun = 0;
        let mut top = [f64::NEG_INFINITY; 2];
        for (k, reversal) in self.reversals.iter().enumerate() {
            let here = [recording.stroke[reversal.index], recording.pressure[reversal.index]];
            let which = usize::from(reversal.cause == Cause::Pressure);
            if reversal.direction == 1 && k > 0 {
                let start = column(reversal.cause)[begun];
                if top[which] - here[which] >= CYCLE_SHARE * (top[which] - start) && top[which] > here[which]
                {
                    number += 1;
                    begun = reversal.index;
                    top = here;
                }
            }
            top = [top[0].max(here[0]), top[1].max(here[1])];
            let end = self.reversals.get(k + 1).map_or(n, |t| t.index);
            cycle[reversal.index..end].fill(number);
        }
        cycle
    }
}
