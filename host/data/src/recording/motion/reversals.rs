//! The changes of direction: by the stroke, by the pressure at held length, or as the recording says.

use super::criteria::{HOLD_DRIFT, ONSET_CLEAR, PRESSURE_ONSET};
use super::holding::{Hold, sampled_median};
use super::legs::{Leg, Track, legs};
use super::{Cause, Reversal};

/// The reversals that the stroke makes.
pub(super) fn stroke_reversals(track: &Track<'_>, legs: &[Leg], holds: &[Hold]) -> Vec<Reversal> {
    let mut reversals = Vec::with_capacity(legs.len());
    for (n, leg) in legs.iter().enumerate() {
        let before = n.checked_sub(1).map(|b| &legs[b]);
        // A rest where the leg starts: at its level, and not left before it.
        let from = before.map_or(0, |b| track.nears(b, track.threshold));
        let to = track.leaves(leg, track.threshold);
        let first = holds.partition_point(|h| h.end < from);
        let rest = holds[first..]
            .iter()
            .take_while(|h| h.start <= to)
            .filter(|h| (h.stroke - leg.from).abs() <= HOLD_DRIFT * track.threshold && h.end < leg.end)
            .last();
        let index = match (rest, before) {
            (Some(hold), _) => {
                // A hold may creep: it is left from the level of its last quarter.
                let late = hold.end - (hold.end - hold.start) / 4;
                let level = sampled_median(&track.raw[late..=hold.end]);
                track.departure(leg, hold.start, level, track.tolerance())
            }
            (None, Some(before)) => track.reversal(before, leg),
            // The recording starts with this leg: at rest or in motion.
            (None, None) => {
                if leg.start == 0 {
                    0
                } else {
                    track.departure(leg, 0, leg.from, track.tolerance())
                }
            }
        };
        reversals.push(Reversal {
            index,
            direction: if leg.sign() > 0.0 { 1 } else { -1 },
            cause: Cause::Stroke,
        });
    }
    reversals
}

/// Adds the reversals that the pressure makes at held length; the stroke's own stay.
pub(super) fn with_pressure(stroke: Vec<Reversal>, holds: &[Hold], air: &Track<'_>) -> Vec<Reversal> {
    let mut reversals = stroke;
    let mut added = Vec::new();
    for hold in holds {
        let part = &air.raw[hold.start..=hold.end];
        let legs = legs(part, air.threshold);
        let mut has_reversed = false;
        for leg in &legs {
            let leg = Leg { start: leg.start + hold.start, end: leg.end + hold.start, ..*leg };
            let tolerance = (ONSET_CLEAR * air.noise).max(PRESSURE_ONSET * air.threshold);
            let index = match air.departure(&leg, leg.start, leg.from, tolerance) {
                // A recording that begins in the middle of filling has no rest to distinguish.
                1 if leg.start == 0 => 0,
                index => index,
            };
            added.push(Reversal {
                index,
                direction: if leg.sign() > 0.0 { 1 } else { -1 },
                cause: Cause::Pressure,
            });
            has_reversed = true;
        }
        // What drives the muscle after the hold is its motion again, even the same way as before the hold.
        if has_reversed {
            let resumes = |t: &&Reversal| t.index <= hold.end + 1;
            let last = reversals.iter().rev().find(resumes).copied();
            let at_end = reversals.iter().any(|t| t.index > hold.start && t.index <= hold.end + 2);
            if let Some(last) = last
                && !at_end
                && hold.end + 1 < air.time.len()
            {
                added.push(Reversal { index: hold.end + 1, ..last });
            }
        }
    }
    reversals.extend(added);
    // A stable sort: where both fall on one sample the stroke, which stands first, is overruled by nothing.
    reversals.sort_by_key(|t| (t.index, t.cause == Cause::Stroke));
    reversals.dedup_by(|later, earlier| {
        let same = later.index == earlier.index;
        if same {
            *earlier = *later;
        }
        same
    });
    reversals
}

pub(super) fn stated_reversals(directions: &[i8]) -> Vec<Reversal> {
    let mut last = 0;
    let mut reversals = Vec::new();
    for (index, way) in directions.iter().copied().enumerate().filter(|(_, d)| *d != 0) {
        if way != last {
            reversals.push(Reversal { index, direction: way.signum(), cause: Cause::Stated });
            last = way;
        }
    }
    reversals
}
