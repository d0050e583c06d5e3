//! Recordings under a constant load, such as a hanging weight.
//!
//! While the pressure is too low to lift the load, a stop or the taut braid carries a part of it: the length stays, the pressure changes, and
//! the force that is read is not the muscle's. At the other end of the stroke friction holds the muscle until the pressure has fallen enough.
//! Neither shows the force at that pressure, and both are excluded.

use std::ops::Range;

use super::places::{listed, rows_and_times};
use super::{Campaign, Recording, white_noise};
use crate::pluralise::pluralise;
use crate::statistics::{extremes, quantile};

/// Rows of a recording in which the load does not rest on the muscle alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct HeldLoad {
    /// Index of the recording in the campaign.
    pub recording: usize,
    /// The rows in that recording, from 0.
    pub rows: Range<usize>,
}

/// The load is constant where the middle nine tenths of the forces differ by this share of their median: friction of a pulley is below.
const CONSTANT: f64 = 0.15;
/// The pressure changes over the recording by this share of the campaign's largest pressure.
const PRESSURE_RANGE: f64 = 0.25;
/// ... and while the length stays by this share of it.
const PRESSURE_CHANGE: f64 = 0.05;
/// The length stays within this share of the recording's stroke, and within this many standard deviations of the sensor's noise.
const STAYS: (f64, f64) = (0.002, 6.0);

/// All such rows of a campaign, in order. Recordings that are `odd` do not count.
pub(super) fn find(campaign: &Campaign, odd: &[bool]) -> Vec<HeldLoad> {
    let highest = |r: &Recording| r.pressure.iter().copied().fold(0.0, f64::max);
    let top = campaign.recordings.iter().map(highest).fold(0.0, f64::max);
    let usable = campaign.recordings.iter().zip(odd).enumerate().filter(|(_, (_, odd))| !**odd);
    usable
        .flat_map(|(recording, (r, _))| held(r, top).map(move |rows| HeldLoad { recording, rows }))
        .collect()
}

fn held(r: &Recording, top: f64) -> impl Iterator<Item = Range<usize>> + use<> {
    let mut found = Vec::new();
    let (lowest, highest) = extremes(&r.pressure);
    // The range first: loops at one pressure need no quantiles of their forces.
    if highest - lowest >= PRESSURE_RANGE * top && has_constant_load(r) {
        let (shortest, longest) = extremes(&r.stroke);
        let stays = (STAYS.0 * (longest - shortest)).max(STAYS.1 * white_noise(&r.stroke));
        let mut start = 0;
        while start < r.len() {
            let moved = |x: &f64| !((x - r.stroke[start]).abs() <= stays);
            let end = r.stroke[start..].iter().position(moved).map_or(r.len(), |n| start + n.max(1));
            let (low, high) = extremes(&r.pressure[start..end]);
            if high - low >= PRESSURE_CHANGE * top {
                found.push(start..end);
            }
            start = end;
        }
    }
    found.into_iter()
}

fn has_constant_load(r: &Recording) -> bool {
    let Some(force) = r.force.as_deref().filter(|f| !f.is_empty()) else { return false };
    let mut forces = force.to_vec();
    let [low, middle, high] = [0.05, 0.5, 0.95].map(|share| quantile(&mut forces, share));
    middle > 0.0 && high - low <= CONSTANT * middle
}

/// A remark with the places; `None` without such rows.
pub(super) fn describe(held: &[HeldLoad], campaign: &Campaign) -> Option<String> {
    let rows: usize = held.iter().map(|h| h.rows.len()).sum();
    let place = |h: &HeldLoad| {
        let r = &campaign.recordings[h.recording];
        format!("`{}` {}", r.name, rows_and_times(r, &h.rows))
    };
    (rows > 0).then(|| {
        format!(
            "constant load: {} excluded in which the length stays while the pressure changes, because a stop, the taut braid or friction \
             carries a part of the load: {}",
            pluralise(rows, "row"),
            listed(held.iter().map(place))
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::dropouts::Screened;

    /// A weight that is lifted from a stop and lowered onto it, as the pressure rises and falls.
    fn lifted(load: f64) -> Recording {
        let rows = 800;
        let noise = |i: usize| (43_758.5 * (12.9898 * i as f64).sin()).rem_euclid(1.0) - 0.5;
        let pressure = |i: usize| 500e3 * (1.0 - (1.0 - i as f64 / 400.0).abs());
        let stroke = |i: usize| {
            let friction = if i < 400 { 0.93 } else { 1.07 };
            ((pressure(i) - 60e3) * friction * 2e-4 - load).max(0.0) * 1e-4
        };
        Recording {
            name: format!("{load} N"),
            time: (0..rows).map(|i| 0.1 * i as f64).collect(),
            pressure: (0..rows).map(|i| pressure(i) + 100.0 * noise(i)).collect(),
            stroke: (0..rows).map(|i| stroke(i) + 2e-6 * noise(i + 3)).collect(),
            force: Some((0..rows).map(|i| load + 0.05 * noise(i + 9)).collect()),
            ..Recording::default()
        }
    }

    #[test]
    fn a_weight_on_its_stop_is_no_force_of_the_muscle() {
        let campaign = Campaign::new([20.0, 35.0, 50.0].map(lifted).to_vec());
        let screened = Screened::of(&campaign);
        assert!(screened.faults.is_empty() && screened.dropouts.is_empty(), "{:?}", screened.faults);
        for (index, r) in campaign.recordings.iter().enumerate() {
            let read = screened.read(index);
            let low = |i: &usize| r.stroke[*i].abs() < 2e-6;
            let on_stop = (0..r.len()).filter(low);
            let missed = on_stop.clone().filter(|i| read[*i]).count();
            assert!(missed * 20 < on_stop.count(), "{}: {missed}", r.name);
            assert!(read.iter().filter(|r| **r).count() > 300, "{}", r.name);
        }
        assert!(
            screened.remark().is_some_and(|r| r.contains("constant load") && r.contains("`20 N` rows 1 to"))
        );
    }

    #[test]
    fn loops_and_held_lengths_have_no_constant_load() {
        let mut loops = lifted(30.0);
        std::mem::swap(&mut loops.stroke, &mut loops.pressure);
        loops.stroke.iter_mut().for_each(|x| *x *= 1e-8);
        loops.pressure.iter_mut().for_each(|p| *p = 300e3 + *p * 1e3);
        let mut held = lifted(30.0);
        held.stroke.fill(1e-3);
        held.force = Some(held.pressure.iter().map(|p| 2e-4 * p).collect());
        let mut vented = lifted(30.0);
        vented.pressure.fill(0.0);
        let campaign = Campaign::new(vec![loops, held, vented]);
        assert_eq!(find(&campaign, &[false; 3]), []);
        assert_eq!(find(&Campaign::new(vec![lifted(30.0)]), &[true]), []);
    }
}
