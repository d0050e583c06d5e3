//! Drop-outs: the reading steps away within one row and back within one row, and no other reading steps. A step of the pressure must change
//! the expected force, which does not follow ([`super::super::dropouts`] finds most of them from less). Spikes, which last a few rows at most, are
//! found by the same, or where no other reading steps; smaller spikes of the force are outliers of a fit.
//!
//! A muscle at rest between two strokes is no drop-out of the force: near its full length a small stroke changes the force much. Its
//! force comes and goes as fast as in the rows beside, or with a stroke or pressure that steps away and back, too. Nor is friction one that
//! turns with the stroke at both ends, or the turn of a fast stroke a drop-out of the stroke. A step over a pause of the clock is none.

use crate::statistics::extremes;
use std::cell::LazyCell;
use std::ops::Range;

use super::stroke_motion::StrokeMotion;
use super::{Campaign, Channel, Kind, Recording, SensorFault, Usual};
use crate::recording::campaign::least_pause;
use crate::recording::spikes::{self, SUDDEN, end_of_spike, usual_change};
use crate::recording::white_noise;

/// A step is at least this share of the column's range, and this many standard deviations of a reading.
const STEP: (f64, f64) = (0.06, 12.0);
/// Within a drop-out the reading changes by less than this share of the step from its first value.
const STEADY: f64 = 0.25;
/// The other columns change by less than this share of their range over the row of a step.
const OTHERS: f64 = 0.05;
/// A stroke or pressure rests between two steps where each of them is this many times its largest change over a row between.
const RESTS: f64 = 3.0;
/// What lasts longer, s, is how the bench was driven.
const LONGEST: f64 = 10.0;

/// A drop-out of the pressure changes the expected force by this share of the range of forces, and the force by this share of that at most.
const UNFELT: (f64, f64) = (0.1, 0.3);

/// A spike of the pressure while the other readings are quiet is at least this share of the reading before: a valve's kick at the gauge is
/// less, as for the drop-outs of the pressure.
const KICK: f64 = 0.5;
/// A spike of the force leaves the reading before, and the expected force, by this share of the range of forces, and six usual residuals:
/// friction that turns within a row changes it by two. What an end of the range or a bad contact makes is larger than a muscle's shock.
const SHOCK: f64 = 0.25;

/// The drop-outs in a recording, by channel.
pub(super) fn find(campaign: &Campaign, index: usize, usual: &Usual) -> Vec<SensorFault> {
    let r = &campaign.recordings[index];
    let of = |channel: Channel| drop_outs(r, index, channel, usual);
    Channel::ALL.into_iter().flat_map(of).collect()
}

fn drop_outs(r: &Recording, index: usize, channel: Channel, usual: &Usual) -> Vec<SensorFault> {
    let column = channel.of(r);
    let step = (STEP.0 * usual.spans[channel as usize]).max(STEP.1 * white_noise(column));
    if !(step > 0.0) {
        return Vec::new();
    }
    let others = Channel::ALL.into_iter().filter(|c| *c != channel);
    let others: Vec<(&[f64], f64)> = others.map(|c| (c.of(r), OTHERS * usual.spans[c as usize])).collect();
    // At constant pressure or length a column has no range, and its changes are noise.
    let quiet = |i: usize| others.iter().all(|(c, most)| *most <= 0.0 || (c[i] - c[i - 1]).abs() <= *most);
    // Over a pause the reading has time to go elsewhere.
    let pause = least_pause(&r.time).unwrap_or(f64::INFINITY);
    let edge = |i: usize| (column[i] - column[i - 1]).abs() > step && r.time[i] - r.time[i - 1] <= pause;
    let motion = LazyCell::new(|| StrokeMotion::of(&r.stroke));
    let mut found = Vec::new();
    let mut i = 1;
    while i < column.len() {
        // What lies between two spikes is no drop-out.
        if let Some(end) = end_of_spike(column, i, step) {
            let alone = || quiet(i) && quiet(end);
            let away = (column[i] - column[i - 1]).abs();
            let failed = match channel {
                Channel::Pressure => {
                    is_unfelt(r, i..end, usual) || away > KICK * column[i - 1].abs() && alone()
                }
                Channel::Stroke => is_unfelt(r, i..end, usual) || alone(),
                // Loggers write zero for a reading that they missed; other small spikes may be a shock.
                Channel::Force => {
                    let zeros = column[i..end].iter().all(|f| *f == 0.0);
                    let least = usual.noticeable(SHOCK);
                    let off = (column[i] - usual.expected.at(r, i)).abs();
                    (zeros || away.min(off) > least) && alone()
                }
            };
            if failed {
                found.push(drop_out(index, i..end, channel, column[i]));
            }
            i = end + 1;
            continue;
        }
        let end = if edge(i) && quiet(i) { end_of(r, column, i, edge) } else { None };
        match end.filter(|end| quiet(*end) && returns(r, channel, column, i..*end, usual)) {
            Some(end) if is_away(r, channel, i..end, usual, &motion) => {
                found.push(drop_out(index, i..end, channel, column[i]));
                i = end + 1;
            }
            _ => i += 1,
        }
    }
    found
}

fn drop_out(recording: usize, rows: Range<usize>, channel: Channel, value: f64) -> SensorFault {
    SensorFault { recording, rows, channel, kind: Kind::DropOut, value }
}

/// Whether the reading is wrong in these rows, and not beside them: the pressure is unfelt there, or the force is farther from what is
/// expected than the reading before.
fn is_away(
    r: &Recording,
    channel: Channel,
    rows: Range<usize>,
    usual: &Usual,
    motion: &StrokeMotion<'_>,
) -> bool {
    match channel {
        Channel::Pressure => is_unfelt(r, rows, usual),
        Channel::Stroke => {
            let (stroke, step) = (&r.stroke, (r.stroke[rows.start] - r.stroke[rows.start - 1]).abs());
            step > SUDDEN * usual_change(stroke, rows)
        }
        Channel::Force => {
            let (force, expected) = (channel.of(r), usual.expected.at(r, rows.start));
            (force[rows.start] - expected).abs() > (force[rows.start - 1] - expected).abs()
                && is_sudden(force, &rows)
                && !reverses_with_friction(force, motion, &rows, usual)
                && ![Channel::Pressure, Channel::Stroke].iter().any(|c| rests(c.of(r), &rows))
        }
    }
}

/// Whether the steps at both ends are larger than the changes over the rows beside them.
fn is_sudden(force: &[f64], rows: &Range<usize>) -> bool {
    let change = |i: usize| if 0 < i && i < force.len() { (force[i] - force[i - 1]).abs() } else { 0.0 };
    change(rows.start) > SUDDEN * change(rows.start - 1) && change(rows.end) > SUDDEN * change(rows.end + 1)
}

/// Whether friction explains that the force steps away and back: the muscle turns, stops or sets off at both ends. Where a slow turn hides in
/// the noise of the stroke, the muscle is slow there, and the force steps no farther than friction usually makes it.
fn reverses_with_friction(
    force: &[f64],
    motion: &StrokeMotion<'_>,
    rows: &Range<usize>,
    usual: &Usual,
) -> bool {
    let step = (force[rows.start] - force[rows.start - 1]).abs();
    let ends = [rows.start, rows.end];
    ends.iter().all(|end| motion.reverses(*end, rows.len()))
        || step <= usual.noticeable(0.0) && ends.iter().all(|end| motion.is_slow(*end))
}

/// Whether a column steps away before these rows, rests in them, and steps back after them.
fn rests(column: &[f64], rows: &Range<usize>) -> bool {
    let (away, back) = (column[rows.start] - column[rows.start - 1], column[rows.end] - column[rows.end - 1]);
    let between = column[rows.clone()].windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    away * back < 0.0 && away.abs().min(back.abs()) > RESTS * between
}

/// Whether the force stays while the reading of pressure or stroke is away, though the expected force does not.
fn is_unfelt(r: &Recording, rows: Range<usize>, usual: &Usual) -> bool {
    let made = (usual.expected.at(r, rows.start) - usual.expected.at(r, rows.start - 1)).abs();
    let force = r.force.as_deref().unwrap_or(&[]);
    let (low, high) = extremes(&force[rows.start - 1..=rows.end]);
    made > UNFELT.0 * usual.spans[2] && high - low <= UNFELT.1 * made
}

/// The row that steps back, if the reading keeps still until then.
fn end_of(r: &Recording, column: &[f64], start: usize, edge: impl Fn(usize) -> bool) -> Option<usize> {
    let size = column[start] - column[start - 1];
    for i in start + 1..column.len() {
        if r.time[i] - r.time[start] > LONGEST {
            return None;
        }
        if edge(i) && (column[i] - column[i - 1]) * size < 0.0 {
            return (i - start >= spikes::LONGEST).then_some(i);
        }
        if (column[i] - column[start]).abs() > STEADY * size.abs() {
            return None;
        }
    }
    None
}

/// Whether the reading after continues the one before.
fn returns(r: &Recording, channel: Channel, column: &[f64], rows: Range<usize>, usual: &Usual) -> bool {
    let (before, after) = (rows.start - 1, rows.end);
    let size = (column[rows.start] - column[before]).abs();
    let expected = match channel {
        Channel::Force => usual.expected.at(r, after) - usual.expected.at(r, before),
        _ => 0.0,
    };
    let change = column[after] - column[before];
    // A muscle moves meanwhile: by no more than it did in as many rows before and after, if that is known.
    let drift = |a: usize, b: usize| (column[b] - column[a]).abs();
    let n = rows.len() + 1;
    let around = match channel {
        Channel::Stroke => {
            let earlier = before.checked_sub(n).map_or(0.0, |a| drift(a, before));
            let later = if after + n < column.len() { drift(after, after + n) } else { 0.0 };
            1.5 * earlier.max(later)
        }
        Channel::Force => expected.abs() + 2.0 * usual.residual,
        Channel::Pressure => 0.0,
    };
    change.abs() <= spikes::BACK * size + around
}
