//! Values that a logger writes for a reading that it missed, such as 0 or 32767: one exact value in single rows all over a campaign.
//!
//! A zero of pressure, stroke and force in one row is the reading of a vented muscle at rest, which no surface of the force contradicts. But a
//! muscle does not vent and fill between two rows, and noise does not let three sensors repeat their values exactly. Where the other
//! readings prove a channel's value to be missed readings in a dozen places, it is one in every other row that stands out from both
//! neighbours with it, too: near a turn, or where the muscle is slack and no force contradicts it.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use super::{Campaign, Channel, Kind, Recording, SensorFault};
use crate::recording::dropouts::Dropout;
use crate::recording::spikes::{self, ABOVE_NOISE, SUDDEN, change_beside, end_of_spike, spikes};
use crate::recording::white_noise;

/// This number of proved single rows of one value makes it known as that of missed readings. A muscle that turns at one value of a quantised
/// column meets it once in a stroke: campaigns have about a dozen strokes, few of which are mistaken for faults.
pub(super) const KNOWN: usize = 12;
/// Three sensors that read one triple of values in as many single rows do not measure: noise lets two readings of one sensor be equal, not
/// three of all three. All zeros are known from one row.
const RECURS: usize = 3;
/// Where more of the rows step away and back, steps are how the bench was driven, as for the drop-outs of the pressure.
const RARE: f64 = 0.2;

/// What all channels read in a row, as bits.
type Triple = [u64; 3];

fn triple(r: &Recording, row: usize) -> Triple {
    // Zero has two signs.
    Channel::ALL.map(|c| c.of(r).get(row).map_or(0, |v| (v + 0.0).to_bits()))
}

/// The rows in which all channels step away together and back: their faults, one for each channel.
pub(in crate::recording) fn of_all_channels(campaign: &Campaign) -> Vec<SensorFault> {
    let mut seen: HashMap<Triple, usize> = HashMap::new();
    for r in campaign.recordings.iter().filter(|r| r.force.is_some()) {
        for rows in together(r) {
            *seen.entry(triple(r, rows.start)).or_default() += rows.len();
        }
    }
    let zeros = [0.0_f64.to_bits(); 3];
    let known: HashSet<Triple> =
        seen.into_iter().filter(|(t, rows)| *t == zeros || *rows >= RECURS).map(|(t, _)| t).collect();
    if known.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (recording, r) in campaign.recordings.iter().enumerate().filter(|(_, r)| r.force.is_some()) {
        let noise = Channel::ALL.map(|c| white_noise(c.of(r)));
        for rows in
            short_runs(r.len(), |i| known.contains(&triple(r, i)), |i, k| triple(r, i) == triple(r, k))
        {
            let out = Channel::ALL.iter().zip(noise).any(|(c, noise)| stands_out(c.of(r), &rows, noise));
            if out {
                found.extend(Channel::ALL.map(|channel| SensorFault {
                    recording,
                    rows: rows.clone(),
                    channel,
                    kind: Kind::Missed,
                    value: channel.of(r)[rows.start],
                }));
            }
        }
    }
    let rows: usize = found.iter().map(|f| f.rows.len()).sum::<usize>() / Channel::ALL.len();
    if rows as f64 > RARE * campaign.samples() as f64 { Vec::new() } else { found }
}

/// Rows that are a spike of all channels.
fn together(r: &Recording) -> Vec<Range<usize>> {
    let least = Channel::ALL.map(|c| ABOVE_NOISE * white_noise(c.of(r)));
    let all = |rows: &Range<usize>| {
        Channel::ALL.iter().zip(least).all(|(c, least)| {
            let column = c.of(r);
            end_of_spike(column, rows.start, least) == Some(rows.end)
                && column[rows.clone()].iter().all(|v| *v == column[rows.start])
        })
    };
    spikes(&r.pressure, least[0]).into_iter().filter(all).collect()
}

/// Runs of rows that are one by one of a kind and equal, as short as a spike.
fn short_runs(
    rows: usize,
    of_kind: impl Fn(usize) -> bool,
    equal: impl Fn(usize, usize) -> bool,
) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    while start < rows {
        let mut end = start + 1;
        if of_kind(start) {
            while end < rows && equal(start, end) {
                end += 1;
            }
            if end - start < spikes::LONGEST {
                runs.push(start..end);
            }
        }
        start = end;
    }
    runs
}

/// Whether rows of one value step away from both neighbours in one direction, farther than noise and motion do; at an end of the recording
/// from the one that they have.
fn stands_out(column: &[f64], rows: &Range<usize>, noise: f64) -> bool {
    let value = column[rows.start];
    let before = rows.start.checked_sub(1).map(|i| column[i] - value);
    let after = column.get(rows.end).map(|v| v - value);
    let (Some(one), Some(other)) = (before.or(after), after.or(before)) else { return false };
    let least = (ABOVE_NOISE * noise).max(SUDDEN * change_beside(column, rows.clone()));
    one * other > 0.0 && one.abs().min(other.abs()) > least
}

/// The values of a channel that are proved to be those of missed readings.
fn known(channel: Channel, found: &[SensorFault], dropouts: &[Dropout]) -> HashSet<u64> {
    let mut rows: HashMap<u64, usize> = HashMap::new();
    let short = |rows: &Range<usize>| rows.len() < spikes::LONGEST;
    let single = |f: &&SensorFault| f.channel == channel && f.kind == Kind::DropOut && short(&f.rows);
    for fault in found.iter().filter(single) {
        *rows.entry((fault.value + 0.0).to_bits()).or_default() += 1;
    }
    if channel == Channel::Pressure {
        for dropout in dropouts.iter().filter(|d| short(&d.rows)) {
            *rows.entry((dropout.read + 0.0).to_bits()).or_default() += 1;
        }
    }
    rows.into_iter().filter(|(_, n)| *n >= KNOWN).map(|(value, _)| value).collect()
}

/// Further rows of values that are known from the faults that were found.
pub(super) fn of_known_values(
    campaign: &Campaign,
    skipped: &[bool],
    found: &[SensorFault],
    dropouts: &[Dropout],
) -> Vec<SensorFault> {
    let mut more = Vec::new();
    for channel in Channel::ALL {
        let known = known(channel, found, dropouts);
        if known.is_empty() {
            continue;
        }
        for (recording, r) in campaign.recordings.iter().enumerate().filter(|(i, _)| !skipped[*i]) {
            let column = channel.of(r);
            let noise = white_noise(column);
            let mut marked = vec![false; column.len()];
            for fault in found.iter().filter(|f| f.recording == recording && f.channel == channel) {
                marked[fault.rows.clone()].fill(true);
            }
            let of_kind = |i: usize| known.contains(&(column[i] + 0.0).to_bits());
            for rows in short_runs(column.len(), of_kind, |i, k| column[i] == column[k]) {
                if !marked[rows.clone()].contains(&true) && stands_out(column, &rows, noise) {
                    let value = column[rows.start];
                    more.push(SensorFault { recording, rows, channel, kind: Kind::DropOut, value });
                }
            }
        }
    }
    more
}
