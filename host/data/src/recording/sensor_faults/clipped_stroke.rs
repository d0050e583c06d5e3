//! A displacement sensor, or its amplifier, whose range ends within the stroke: the reading stays at one value while the muscle continues.
//!
//! The same happens where a muscle rests at a stop or an axis holds the end of a stroke. Then the force keeps still, or creeps back. Beyond
//! the end of a sensor's range the force continues as the motion does: on the way out, by as much as the speed before makes it, and back
//! before the reading moves again. No hold anticipates its end.

use std::collections::HashMap;
use std::ops::Range;

use super::{Campaign, Channel, Kind, Recording, SensorFault, Usual};
use crate::recording::noise::resolution;
use crate::recording::white_noise;
use crate::statistics::{extremes, quantile, slope};

/// Shorter stays say nothing, as for other constant readings.
const SHORTEST: usize = 10;
/// As many stays at one value show it: one of them may be a disturbance of the force while the length was held.
const STAYS: usize = 2;
/// The muscle continues by this share of the range of strokes, as for a saturated force; and by this many steps of the converter: within a
/// step any reading stays.
const BEYOND: (f64, f64) = (0.03, 4.0);
/// How far it continues as a share of what the speed before allows until the middle of the stay: all of it where the stroke is a triangle
/// over time, half where it is a sine. Creep of a held muscle makes less.
const CONTINUES: (f64, f64) = (0.2, 2.0);
/// The reading comes to its end at this share of its speed before at least: two thirds for a sine. An axis that stops there slows down.
const AT_SPEED: f64 = 0.5;
/// Meanwhile the pressure changes by less than this share of its range, as the other readings beside a drop-out.
const QUIET: f64 = 0.05;
/// Changes that noise does not make are this many standard deviations of a reading.
const CLEAR: f64 = 6.0;

/// The rows at the end of a displacement sensor's range, in all recordings that stay there.
pub(super) fn find(campaign: &Campaign, skipped: &[bool], usual: &Usual) -> Vec<SensorFault> {
    let judged = || {
        campaign
            .recordings
            .iter()
            .enumerate()
            .filter(|(i, r)| !skipped[*i] && r.force.is_some() && !r.is_empty())
    };
    let ends = |r: &Recording| {
        let (low, high) = extremes(&r.stroke);
        [(low, -1.0), (high, 1.0)]
    };
    let mut stays: HashMap<(u64, bool), usize> = HashMap::new();
    for (_, r) in judged() {
        for (value, side) in ends(r) {
            let count = runs(&r.stroke, value)
                .into_iter()
                .filter(|rows| rows.len() >= SHORTEST && continues(r, rows, side, usual))
                .count();
            *stays.entry((value.to_bits(), side > 0.0)).or_default() += count;
        }
    }
    let mut found = Vec::new();
    for (recording, r) in judged() {
        for (value, side) in ends(r) {
            if stays.get(&(value.to_bits(), side > 0.0)).is_some_and(|count| *count >= STAYS) {
                found.extend(runs(&r.stroke, value).into_iter().map(|rows| SensorFault {
                    recording,
                    rows,
                    channel: Channel::Stroke,
                    kind: Kind::Saturated,
                    value,
                }));
            }
        }
    }
    found
}

/// The stays of a column at a value.
fn runs(column: &[f64], value: f64) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for i in (0..column.len()).filter(|i| column[*i] == value) {
        match runs.last_mut() {
            Some(last) if last.end == i => last.end = i + 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}

/// Whether the force shows that the muscle continues beyond the end of the readings, and comes back.
fn continues(r: &Recording, rows: &Range<usize>, side: f64, usual: &Usual) -> bool {
    let Some(force) = r.force.as_deref() else { return false };
    let (x, n) = (&r.stroke, (rows.len() / 2).max(SHORTEST / 2));
    if rows.start < n || rows.end + n > x.len() {
        return false;
    }
    let (before, after) = (rows.start - n..rows.start, rows.end..rows.end + n);
    let mut pressures = r.pressure[before.start..after.end].to_vec();
    let pressure = quantile(&mut pressures, 0.95) - quantile(&mut pressures, 0.05);
    if pressure > (QUIET * usual.spans[0]).max(CLEAR * white_noise(&r.pressure)) {
        return false;
    }
    // The last row before the stay may be anywhere within a row's way of the end.
    let near = (n / 4).max(3).min(n - 1);
    let speed = side * (x[rows.start - 1] - x[before.start]) / (n - 1) as f64;
    let last = side * (x[rows.start - 1] - x[rows.start - 1 - near]) / near as f64;
    let motion = CLEAR * white_noise(x);
    if !(speed * (n - 1) as f64 > motion && last >= AT_SPEED * speed) {
        return false;
    }
    let per_metre = |rows: Range<usize>| slope(&rows.map(|i| (x[i], force[i])).collect::<Vec<_>>());
    let (there, back) = (per_metre(before), per_metre(after));
    if !(there * back > 0.0) {
        return false;
    }
    let some = (rows.len() / 10).max(3);
    let level =
        |from: usize| (from..from + some).map(|i| usual.expected.residual(r, i)).sum::<f64>() / some as f64;
    let (entry, exit) = (level(rows.start), level(rows.end - some));
    let middle = level((rows.start + rows.end - some) / 2);
    let scatter = CLEAR * white_noise(force) / (some as f64).sqrt();
    let least = (BEYOND.0 * usual.spans[1]).max(BEYOND.1 * resolution(x));
    let reach = last * (rows.len() / 2) as f64;
    [entry, exit].into_iter().all(|end| {
        let beyond = side * (middle - end) / (0.5 * (there + back));
        (middle - end).abs() > scatter && beyond > least
    }) && {
        let beyond = side * (middle - entry) / there;
        (CONTINUES.0 * reach..=CONTINUES.1 * reach).contains(&beyond)
    }
}
