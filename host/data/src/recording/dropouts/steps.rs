//! Where the pressure steps away and back, each within one reading.

use std::ops::Range;

use super::unit;
use crate::recording::spikes::without_spikes;
use crate::recording::{Campaign, Recording, white_noise};
use crate::statistics::ranked;

/// The longest stretch that is examined, s: what lasts longer is how the bench was driven.
const LONGEST: f64 = 10.0;
/// About this many readings determine the highest pressure.
const ROWS: usize = 100_000;
/// A step is at least this share of the campaign's highest pressure.
const LEAST_STEP: f64 = 0.1;
/// And of the reading before: a valve's kick at the gauge is less, and is over before a muscle behind a hose feels it.
const LEAST_PART: f64 = 0.5;
/// And at least this many standard deviations of a reading.
const ABOVE_NOISE: f64 = 12.0;
/// Within a stretch the pressure moves from reading to reading by no more than this share of the step.
const STEADY: f64 = 0.1;
/// The reading after differs from the reading before by no more than this share of the step.
const BACK: f64 = 0.25;
/// Two ratios are one up to this part.
const SAME_FACTOR: f64 = 0.03;
/// A stretch at an end of the recording, which steps only once, lasts at least this long, s: a muscle behind a hose follows later than
/// its gauge, and a recording may end before it does.
const SHORTEST_AT_END: f64 = 1.0;
/// Where more of the rows than this lie between steps, steps are how the bench was driven.
const RARE: f64 = 0.2;

/// What counts as a step, Pa.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    step: f64,
}

impl Scale {
    /// `None` where there is no pressure worth a test.
    pub(super) fn of(campaign: &Campaign) -> Option<Self> {
        let with_force = || campaign.recordings.iter().filter(|r| r.force.is_some());
        let stride = (campaign.samples() / ROWS).max(1);
        let some = with_force().flat_map(|r| without_spikes(&r.pressure, stride));
        let mut sizes: Vec<f64> = some.map(|p| p.abs()).collect();
        if sizes.is_empty() {
            return None;
        }
        // Readings at full scale must not set it.
        let rank = (0.99 * sizes.len() as f64) as usize;
        let highest = ranked(&mut sizes, rank);
        let noise = with_force().map(|r| white_noise(&r.pressure)).fold(0.0, f64::max);
        let step = (LEAST_STEP * highest).max(ABOVE_NOISE * noise);
        (step > 0.0).then_some(Self { step })
    }
}

/// Rows at which the pressure has stepped since the row before, per recording.
pub(super) fn edges(campaign: &Campaign, scale: &Scale) -> Vec<Vec<usize>> {
    let of = |r: &Recording| {
        let stepped = |i: &usize| (r.pressure[*i] - r.pressure[*i - 1]).abs() > scale.step;
        (1..r.len()).filter(stepped).collect()
    };
    campaign.recordings.iter().map(|r| if r.force.is_some() { of(r) } else { Vec::new() }).collect()
}

/// Per recording the stretches that may be dropouts; `None` where there are none, or where they are frequent enough to be normal for this bench.
pub(super) fn masked(campaign: &Campaign, edges: &[Vec<usize>]) -> Option<Vec<Vec<Range<usize>>>> {
    let of = |(r, edges): (&Recording, &Vec<usize>)| -> Vec<Range<usize>> {
        stretches(edges, &r.time, &r.pressure).map(|s| s.rows).collect()
    };
    let masks: Vec<_> = campaign.recordings.iter().zip(edges).map(of).collect();
    let rows: usize = masks.iter().flatten().map(Range::len).sum();
    (rows > 0 && rows as f64 <= RARE * campaign.samples() as f64).then_some(masks)
}

/// What may be dropouts of one recording, in order: before its first step, from a step to the one that undoes it, behind its last.
pub(super) fn stretches(edges: &[usize], time: &[f64], pressure: &[f64]) -> impl Iterator<Item = Stretch> {
    let first = edges.first().and_then(|e| Stretch::until(*e, time, pressure));
    let between = edges.iter().filter_map(|e| Stretch::from(*e, time, pressure));
    let last = edges.last().and_then(|e| Stretch::since(*e, time, pressure));
    first.into_iter().chain(between).chain(last)
}

/// Rows between two steps that undo each other, or between a step and an end of the recording.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    pub(super) rows: Range<usize>,
    /// By what its readings are too small, where both steps say the same.
    pub(super) factor: Option<f64>,
}

impl Stretch {
    /// The stretch that begins at a step, if the pressure then keeps still until it steps back within some seconds.
    pub(super) fn from(start: usize, time: &[f64], pressure: &[f64]) -> Option<Self> {
        let (before, read) = (pressure[start - 1], pressure[start]);
        let step = read - before;
        if step.abs() < LEAST_PART * before.abs() {
            return None;
        }
        let moves = |i: &usize| (pressure[*i] - pressure[*i - 1]).abs() > STEADY * step.abs();
        let in_time = (start + 1..time.len()).take_while(|i| time[*i - 1] - time[start] <= LONGEST);
        let end = in_time.into_iter().find(moves)?;
        let (last, after) = (pressure[end - 1], pressure[end]);
        if (after - last) * step >= 0.0 {
            return None;
        }
        let ratios = (before / read, after / last);
        let one = ratios.0 > 0.0 && ratios.1 > 0.0 && (ratios.0 / ratios.1).ln().abs() < SAME_FACTOR;
        let factor = one.then(|| (ratios.0 * ratios.1).sqrt());
        let back = (after - before).abs() <= BACK * step.abs();
        (back || one).then_some(Self { rows: start..end, factor })
    }

    /// The rows from the first one on to a step.
    fn until(end: usize, time: &[f64], pressure: &[f64]) -> Option<Self> {
        Self::at_end(0..end, pressure[end], pressure[end - 1], time, pressure)
    }

    /// The rows from a step to the last one.
    fn since(start: usize, time: &[f64], pressure: &[f64]) -> Option<Self> {
        Self::at_end(start..pressure.len(), pressure[start - 1], pressure[start], time, pressure)
    }

    /// Rows at an end of the recording, if they keep still for a while; `beside` is the reading across their step from `read`, Pa.
    fn at_end(rows: Range<usize>, beside: f64, read: f64, time: &[f64], pressure: &[f64]) -> Option<Self> {
        let step = (read - beside).abs();
        let seconds = time[rows.end - 1] - time[rows.start];
        let moves = |w: &[f64]| (w[1] - w[0]).abs() > STEADY * step;
        let possible = step >= LEAST_PART * beside.abs()
            && (SHORTEST_AT_END..=LONGEST).contains(&seconds)
            && !pressure[rows.clone()].windows(2).any(moves);
        let ratio = beside / read;
        let factor = (ratio > 0.0 && unit(ratio).is_some()).then_some(ratio);
        possible.then_some(Self { rows, factor })
    }

    /// The reading before the stretch, or behind it where it begins the recording, Pa.
    pub(super) fn beside(&self, pressure: &[f64]) -> f64 {
        let before = self.rows.start.checked_sub(1);
        before.or((self.rows.end < pressure.len()).then_some(self.rows.end)).map_or(0.0, |i| pressure[i])
    }

    /// The pressure as it may have been in these rows, Pa.
    pub(super) fn bridged(&self, time: &[f64], pressure: &[f64]) -> Vec<f64> {
        let Range { start, end } = self.rows;
        let line = |i: usize| {
            if start == 0 || end == pressure.len() {
                return self.beside(pressure);
            }
            let (before, after) = (pressure[start - 1], pressure[end]);
            let (from, span) = (time[start - 1], time[end] - time[start - 1]);
            before + (after - before) * (time[i] - from) / span
        };
        self.rows.clone().map(|i| self.factor.map_or_else(|| line(i), |f| pressure[i] * f)).collect()
    }
}
