//! How the muscle was moved: directions, turning points, holds, cycles.
//!
//! Which way friction points: while the muscle moves, the sign of its speed; while its length is held, the way the pressure
//! drives it (filling counts as shortening); while neither changes, the last direction stays; before anything has changed it
//! is unknown. Noise and ripple flip nothing: a turn counts only when the column goes back by more than noise can. But it
//! counts from where it began, not from where it was noticed, for a sample on the wrong side costs 2 k_F F.

mod holding;
mod rates;
mod scale;
mod turning;

pub use holding::Hold;
pub use rates::Rates;

use super::campaign::{Campaign, Clock};
use super::columns::Recording;
use holding::sampled_median;
use turning::{Leg, Track, legs};

#[cfg(test)]
mod tests;

/// What made the direction change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The muscle moved.
    Stroke,
    /// Its length was held and the pressure changed.
    Pressure,
    /// The recording itself says so.
    Told,
}

/// A change of direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// First sample of the new direction.
    pub index: usize,
    /// 1 shortening or filling, −1 lengthening or emptying.
    pub direction: i8,
    /// What made it change.
    pub cause: Cause,
}

/// How the muscle was moved during one recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Per sample: 1 shortening, −1 lengthening, 0 not known yet.
    pub direction: Vec<i8>,
    /// Changes of direction in order, the first known direction included.
    pub turns: Vec<Turn>,
    /// Where the length was held, in order.
    pub holds: Vec<Hold>,
    /// Standard deviation of the stroke's noise, m.
    pub stroke_noise: f64,
    /// A stroke back by more than this is a turn, m.
    pub stroke_threshold: f64,
    /// Standard deviation of the pressure's noise, Pa.
    pub pressure_noise: f64,
    /// A pressure back by more than this, at held length, is a turn, Pa.
    pub pressure_threshold: f64,
}

/// Columns that follow from a motion, one value per sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionColumns {
    /// Travel since the last turn, m.
    pub travel: Vec<f64>,
    /// Time since the last turn, s; since the start of the recording before the first.
    pub since_reversal: Vec<f64>,
    /// How long the muscle has been resting, or rested before its present motion, s.
    pub hold_time: Vec<f64>,
    /// Number of the cycle, from 1; the file's own numbers where it has them.
    pub cycle: Vec<u32>,
    /// Whether the sample is so close to a turn that noise leaves its direction in doubt.
    pub near_turn: Vec<bool>,
}

impl Motion {
    /// Finds out how the muscle was moved. Time and memory are linear in the samples.
    ///
    /// ```
    /// use pam_data::recording::{Recording, segment::Motion};
    /// let triangle = |i: usize| if i < 50 { i } else { 100 - i } as f64 * 1e-4;
    /// let recording = Recording {
    ///     time: (0..100).map(|i| i as f64 * 0.1).collect(),
    ///     pressure: vec![300e3; 100],
    ///     stroke: (0..100).map(triangle).collect(),
    ///     ..Recording::default()
    /// };
    /// let motion = Motion::of(&recording);
    /// assert_eq!((motion.direction[49], motion.direction[51]), (1, -1));
    /// ```
    #[must_use]
    pub fn of(recording: &Recording) -> Self {
        Self::after(recording, 0)
    }

    /// As [`Motion::of`], when the direction before the first sample is known.
    #[must_use]
    pub fn after(recording: &Recording, before: i8) -> Self {
        let (time, stroke, pressure) = (&recording.time, &recording.stroke, &recording.pressure);
        let (scale, smooth) = scale::of_stroke(time, stroke);
        let air = scale::of_pressure(pressure);
        let legs = legs(&smooth, scale.threshold);
        let holds = holding::holds(time, &smooth, &scale, &legs);
        let track =
            Track { time, raw: stroke, smooth: &smooth, noise: scale.noise, threshold: scale.threshold };
        let mut turns = stroke_turns(&track, &legs, &holds);
        drop(smooth);
        match &recording.direction {
            Some(told) => turns = told_turns(told),
            None => {
                let track = Track {
                    time,
                    raw: pressure,
                    smooth: pressure,
                    noise: air.noise,
                    threshold: air.threshold,
                };
                turns = with_pressure(turns, &holds, &track);
            }
        }
        turns.dedup_by(|later, earlier| later.direction == earlier.direction);
        let mut direction = vec![before; time.len()];
        for (n, turn) in turns.iter().enumerate() {
            let end = turns.get(n + 1).map_or(time.len(), |t| t.index);
            if let Some(part) = direction.get_mut(turn.index..end) {
                part.fill(turn.direction);
            }
        }
        if turns.first().is_some_and(|t| t.direction == before) {
            turns.remove(0);
        }
        Self {
            direction,
            turns,
            holds,
            stroke_noise: scale.noise,
            stroke_threshold: scale.threshold,
            pressure_noise: air.noise,
            pressure_threshold: air.threshold,
        }
    }

    /// The motions of a campaign's recordings. With a shared clock a recording that begins where the one before ended takes
    /// over its direction; otherwise it begins unknown.
    #[must_use]
    pub fn of_campaign(campaign: &Campaign) -> Vec<Self> {
        let mut motions: Vec<Self> = Vec::with_capacity(campaign.recordings.len());
        for (i, recording) in campaign.recordings.iter().enumerate() {
            let before = i.checked_sub(1).map(|j| (&campaign.recordings[j], &motions[j]));
            let carried = match before {
                Some((last, motion)) if campaign.clock == Clock::Shared => motion.carried(last, recording),
                _ => 0,
            };
            motions.push(Self::after(recording, carried));
        }
        motions
    }

    /// The direction that outlives the end of `last` until `next` begins: its own if nothing moved in between.
    fn carried(&self, last: &Recording, next: &Recording) -> i8 {
        let jump = |a: &[f64], b: &[f64]| match (a.last(), b.first()) {
            (Some(a), Some(b)) => (a - b).abs(),
            _ => f64::INFINITY,
        };
        let still = jump(&last.stroke, &next.stroke) <= self.stroke_threshold
            && jump(&last.pressure, &next.pressure) <= self.pressure_threshold;
        if still { self.direction.last().copied().unwrap_or(0) } else { 0 }
    }

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
            near_turn: vec![false; n],
        };
        let mut starts = self.turns.iter().map(|t| t.index).peekable();
        // The turn itself lies between two samples; the one before is the nearer estimate of where it was.
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
            // The rest before a motion is told until that motion turns or rests.
            let mut turn = self.turns.partition_point(|t| t.index <= hold.end);
            let leaving = |t: &Turn| {
                t.index <= hold.end + 2 || (stroke[t.index] - hold.stroke).abs() <= self.stroke_threshold
            };
            while self.turns.get(turn).is_some_and(leaving) {
                turn += 1;
            }
            let until = self.turns.get(turn).map_or(n, |t| t.index);
            let next = self.holds.get(k + 1).map_or(n, |h| h.start);
            for i in hold.start..until.min(next).max(hold.end + 1).min(n) {
                columns.hold_time[i] = time[i.min(hold.end)] - time[hold.start];
            }
        }
        for turn in &self.turns {
            self.mark_near(recording, turn, &mut columns.near_turn);
        }
        columns
    }

    /// Marks the samples about a turn whose side noise leaves in doubt: those within three standard deviations of where the
    /// stroke turned, or the one on either side at least.
    fn mark_near(&self, recording: &Recording, turn: &Turn, near: &mut [bool]) {
        let (column, noise) = match turn.cause {
            Cause::Stroke => (&recording.stroke, self.stroke_noise),
            Cause::Pressure => (&recording.pressure, self.pressure_noise),
            Cause::Told => return,
        };
        let Some(level) = column.get(turn.index).copied() else { return };
        for i in (turn.index..near.len())
            .take_while(|i| *i <= turn.index || (column[*i] - level).abs() <= 3.0 * noise)
        {
            near[i] = true;
            if i > turn.index + 200 {
                break;
            }
        }
        let back = (turn.index.saturating_sub(200)..turn.index).rev();
        for i in back.take_while(|i| *i + 1 >= turn.index || (column[*i] - level).abs() <= 3.0 * noise) {
            near[i] = true;
        }
    }

    /// Numbers the cycles: one ends where the muscle, or at held length the pressure, has gone back by at least 70 % of what
    /// it did and starts again. Minor loops do not count.
    fn cycles(&self, recording: &Recording) -> Vec<u32> {
        let n = self.direction.len();
        let mut cycle = vec![1; n];
        let column =
            |cause: Cause| if cause == Cause::Pressure { &recording.pressure } else { &recording.stroke };
        let mut number = 1;
        let mut begun = 0;
        let mut top = [f64::NEG_INFINITY; 2];
        for (k, turn) in self.turns.iter().enumerate() {
            let here = [recording.stroke[turn.index], recording.pressure[turn.index]];
            let which = usize::from(turn.cause == Cause::Pressure);
            if turn.direction == 1 && k > 0 {
                let start = column(turn.cause)[begun];
                if top[which] - here[which] >= 0.7 * (top[which] - start) && top[which] > here[which] {
                    number += 1;
                    begun = turn.index;
                    top = here;
                }
            }
            top = [top[0].max(here[0]), top[1].max(here[1])];
            let end = self.turns.get(k + 1).map_or(n, |t| t.index);
            cycle[turn.index..end].fill(number);
        }
        cycle
    }
}

/// The turns that the stroke makes.
fn stroke_turns(track: &Track<'_>, legs: &[Leg], holds: &[Hold]) -> Vec<Turn> {
    let mut turns = Vec::with_capacity(legs.len());
    for (n, leg) in legs.iter().enumerate() {
        let before = n.checked_sub(1).map(|b| &legs[b]);
        // A rest where the leg starts: at its level, and not left before it.
        let from = before.map_or(0, |b| track.nears(b, track.threshold));
        let to = track.leaves(leg, track.threshold);
        let first = holds.partition_point(|h| h.end < from);
        let rest = holds[first..]
            .iter()
            .take_while(|h| h.start <= to)
            .filter(|h| (h.stroke - leg.from).abs() <= track.threshold && h.end < leg.end)
            .last();
        let index = match (rest, before) {
            (Some(hold), _) => {
                let tolerance = (3.0 * track.noise).min(track.threshold / 2.0);
                let level = sampled_median(&track.raw[hold.start..=hold.end]);
                track.departure(leg, hold.start, level, tolerance)
            }
            (None, Some(before)) => track.turn(before, leg),
            // The recording starts with this leg: at rest or in motion.
            (None, None) => {
                let tolerance = (3.0 * track.noise).min(track.threshold / 2.0);
                if leg.start == 0 { 0 } else { track.departure(leg, 0, leg.from, tolerance) }
            }
        };
        turns.push(Turn { index, direction: if leg.sign() > 0.0 { 1 } else { -1 }, cause: Cause::Stroke });
    }
    turns
}

/// Adds the turns that the pressure makes at held length; the stroke's own stay.
fn with_pressure(stroke: Vec<Turn>, holds: &[Hold], air: &Track<'_>) -> Vec<Turn> {
    let mut turns = stroke;
    let mut added = Vec::new();
    for hold in holds {
        let part = &air.raw[hold.start..=hold.end];
        let legs = legs(part, air.threshold);
        let mut told = false;
        for leg in &legs {
            let leg = Leg { start: leg.start + hold.start, end: leg.end + hold.start, ..*leg };
            let tolerance = (3.0 * air.noise).max(0.25 * air.threshold);
            let index = match air.departure(&leg, leg.start, leg.from, tolerance) {
                // A recording that begins in the middle of filling has no rest to tell apart.
                1 if leg.start == 0 => 0,
                index => index,
            };
            added.push(Turn {
                index,
                direction: if leg.sign() > 0.0 { 1 } else { -1 },
                cause: Cause::Pressure,
            });
            told = true;
        }
        // What drives the muscle after the hold is its motion again, even the same way as before the hold.
        if told {
            let resumes = |t: &&Turn| t.index <= hold.end + 1;
            let last = turns.iter().rev().find(resumes).copied();
            let at_end = turns.iter().any(|t| t.index > hold.start && t.index <= hold.end + 2);
            if let Some(last) = last
                && !at_end
                && hold.end + 1 < air.time.len()
            {
                added.push(Turn { index: hold.end + 1, ..last });
            }
        }
    }
    turns.extend(added);
    // A stable sort: where both fall on one sample the stroke, which stands first, is overruled by nothing.
    turns.sort_by_key(|t| (t.index, t.cause == Cause::Stroke));
    turns.dedup_by(|later, earlier| {
        let same = later.index == earlier.index;
        if same {
            *earlier = *later;
        }
        same
    });
    turns
}

fn told_turns(told: &[i8]) -> Vec<Turn> {
    let mut last = 0;
    let mut turns = Vec::new();
    for (index, way) in told.iter().copied().enumerate().filter(|(_, d)| *d != 0) {
        if way != last {
            turns.push(Turn { index, direction: way.signum(), cause: Cause::Told });
            last = way;
        }
    }
    turns
}
