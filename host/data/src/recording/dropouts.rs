//! Drop-outs of the pressure sensor: its reading steps away within one sample and back within one sample, while the force does not
//! react. The cause is a wrong unit in part of a file, or a loose connector.
//!
//! A real step of pressure changes the force of a muscle that pulls. So a stretch counts as a drop-out only where the force agrees with
//! the campaign's other readings at the pressure before and after, and disagrees at the pressure that was read. Nothing is marked
//! where the muscle is slack, where the force sensor saturates, or where the campaign does not determine how force depends on pressure.

mod expected_force;
mod steps;

use std::borrow::Cow;
use std::cell::LazyCell;
use std::ops::Range;

use super::constant_load::{self, HeldLoad};
use super::places::{LISTED, listed, rows_and_times};
use super::sensor_faults::{self, Kind, SensorFault, of_all_channels, sensor_faults};
use super::unit_check::{InconsistentRecording, inconsistent_recordings};
use super::{Campaign, Recording};
use crate::pluralise::pluralise;
pub(super) use expected_force::ExpectedForce;
use steps::{Scale, Stretch, edges, masked, stretches};

/// A drop-out: consecutive readings that are not the muscle's pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Dropout {
    /// Index of the recording in the campaign.
    pub recording: usize,
    /// The rows in that recording, from 0.
    pub rows: Range<usize>,
    /// The last reading before it, or the first one after where it begins the recording, Pa.
    pub beside: f64,
    /// The first reading of the drop-out, Pa.
    pub read: f64,
    /// The factor by which every reading is too small, where the factors before and after agree.
    pub factor: Option<f64>,
}

/// A campaign with drop-outs interpolated and inconsistent recordings corrected: good enough to follow the motion, but no evidence for
/// a fit.
#[derive(Debug, Clone)]
pub struct Screened<'a> {
    /// The campaign with its corrections: mistakes of inconsistent recordings, and the pressure of drop-outs (the reading times the
    /// factor, or the line from the reading before to the reading after).
    pub campaign: Cow<'a, Campaign>,
    /// Whole recordings with another unit, sign or zero than the others, in order.
    inconsistent: Vec<InconsistentRecording>,
    /// The drop-outs of the pressure sensor, in order.
    pub dropouts: Vec<Dropout>,
    /// Other failures of sensors, in the order of recordings and rows.
    pub faults: Vec<SensorFault>,
    /// Rows in which a constant load does not rest on the muscle alone, in the order of recordings and rows.
    held_loads: Vec<HeldLoad>,
}

/// A reading below this share of the one before counts as zero.
const NOTHING: f64 = 0.01;

impl<'a> Screened<'a> {
    /// Screens a campaign. Recordings without a force are skipped: a drop-out and a real step look the same there.
    #[must_use]
    pub fn of(campaign: &'a Campaign) -> Self {
        // Before a correction: the value of a missed row is in no unit.
        let missed = of_all_channels(campaign);
        let mut campaign = Cow::Borrowed(campaign);
        for fault in &missed {
            fault.bridge(&mut campaign.to_mut().recordings[fault.recording]);
        }
        let inconsistent = inconsistent_recordings(&campaign);
        for a in &inconsistent {
            a.mistake.correct(&mut campaign.to_mut().recordings[a.recording]);
        }
        let dropouts = find(&campaign);
        if !dropouts.is_empty() {
            let bridged = campaign.to_mut();
            for d in &dropouts {
                let recording = &mut bridged.recordings[d.recording];
                let stretch = Stretch { rows: d.rows.clone(), factor: d.factor };
                let bridge = stretch.bridged(&recording.time, &recording.pressure);
                recording.pressure[d.rows.clone()].copy_from_slice(&bridge);
            }
        }
        let odd: Vec<bool> =
            (0..campaign.recordings.len()).map(|i| inconsistent.iter().any(|a| a.recording == i)).collect();
        let mut faults = sensor_faults(&campaign, &odd, &dropouts);
        // A copy of the campaign is as large as the campaign.
        for fault in faults.iter().filter(|f| f.has_bridge()) {
            fault.bridge(&mut campaign.to_mut().recordings[fault.recording]);
        }
        let held_loads = constant_load::find(&campaign, &odd);
        faults.extend(missed);
        faults.sort_by_key(|f| (f.recording, f.rows.start));
        Self { campaign, inconsistent, dropouts, faults, held_loads }
    }

    /// Whether a whole recording is of no use: another unit, sign or zero than the others, or a dead sensor.
    #[must_use]
    pub fn is_inconsistent(&self, index: usize) -> bool {
        let dead = |f: &SensorFault| f.recording == index && f.kind == Kind::Dead;
        self.inconsistent.iter().any(|a| a.recording == index) || self.faults.iter().any(dead)
    }

    /// The rows of one recording in which a sensor failed, or something else holds the load; in order and without overlap.
    pub fn of_recording(&self, index: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let dropped = self.dropouts.iter().filter(|d| d.recording == index).map(|d| d.rows.clone());
        let failed = self.faults.iter().filter(|f| f.recording == index).map(|f| f.rows.clone());
        let held = self.held_loads.iter().filter(|h| h.recording == index).map(|h| h.rows.clone());
        let mut all: Vec<Range<usize>> = dropped.chain(failed).chain(held).collect();
        all.sort_by_key(|rows| rows.start);
        let mut merged: Vec<Range<usize>> = Vec::with_capacity(all.len());
        for rows in all {
            match merged.last_mut() {
                Some(last) if rows.start <= last.end => last.end = last.end.max(rows.end),
                _ => merged.push(rows),
            }
        }
        merged.into_iter()
    }

    /// For each row of a recording, whether it counts: the recording is consistent, no sensor failed, and nothing else holds the load.
    #[must_use]
    pub fn read(&self, index: usize) -> Vec<bool> {
        let right = !self.is_inconsistent(index);
        let mut read = vec![right; self.campaign.recordings.get(index).map_or(0, Recording::len)];
        for rows in self.of_recording(index) {
            read[rows].fill(false);
        }
        read
    }

    /// The number of rows in drop-outs of the pressure sensor.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.dropouts.iter().map(|d| d.rows.len()).sum()
    }

    /// A warning with places, readings, the likely cause and the remedy; `None` without drop-outs and inconsistent recordings.
    #[must_use]
    pub fn remark(&self) -> Option<String> {
        let inconsistent = self.inconsistent.iter().take(LISTED).map(|a| self.describe_inconsistent(a));
        let more = self
            .inconsistent
            .len()
            .checked_sub(LISTED + 1)
            .map(|n| format!("{} more recordings are inconsistent", n + 1));
        let faults = sensor_faults::describe(&self.faults, &self.campaign);
        let held = constant_load::describe(&self.held_loads, &self.campaign);
        let parts: Vec<String> =
            inconsistent.chain(more).chain(self.remark_on_dropouts()).chain(faults).chain(held).collect();
        (!parts.is_empty()).then(|| parts.join(". "))
    }

    fn describe_inconsistent(&self, a: &InconsistentRecording) -> String {
        let r = &self.campaign.recordings[a.recording];
        format!(
            "`{}` is inconsistent with the other recordings, and its {} excluded: {}",
            r.name,
            if r.len() == 1 { "row is".to_owned() } else { format!("{} are", pluralise(r.len(), "row")) },
            a.describe()
        )
    }

    fn remark_on_dropouts(&self) -> Option<String> {
        let first = self.dropouts.first()?;
        let units: Vec<_> = self.dropouts.iter().map(|d| d.factor.and_then(unit)).collect();
        let ratio = units[0].filter(|first| units.iter().all(|u| *u == Some(*first)));
        let cause = match ratio {
            Some(unit) => format!("the ratio is that of {unit}: correct the unit in the logging program"),
            None if first.read.abs() <= NOTHING * first.beside.abs() => {
                "check connector and cable of the pressure sensor".to_owned()
            }
            None => "check the pressure sensor, its connector and cable".to_owned(),
        };
        Some(format!(
            "drop-out of the pressure sensor (a step away and back, each within one reading, without a reaction of the force); {} \
             excluded: {}; {cause}",
            pluralise(self.rows(), "row"),
            listed(self.dropouts.iter().map(|d| self.place(d)))
        ))
    }

    fn place(&self, d: &Dropout) -> String {
        let r = &self.campaign.recordings[d.recording];
        let kpa = |p: f64| format!("{:.1}", p / 1e3);
        let share = d.factor.map_or(String::new(), |f| {
            if f > 1.0 { format!(" (1/{f:.2} of it)") } else { format!(" ({:.2} times it)", 1.0 / f) }
        });
        let place = rows_and_times(r, &d.rows);
        format!("{} {place} from {} to {} kPa{share}", r.name, kpa(d.beside), kpa(d.read))
    }
}

/// Ratios of pairs of pressure units.
const RATIOS: [(f64, &str); 8] = [
    (6.894_757, "psi to kPa"),
    (7.500_617, "kPa to mmHg"),
    (10.0, "MPa to bar, or kPa to mbar"),
    (14.503_77, "bar to psi"),
    (98.0665, "kgf/cm² to kPa"),
    (100.0, "bar to kPa"),
    (101.325, "atm to kPa"),
    (1000.0, "MPa to kPa"),
];
/// Largest relative difference from the ratio of two units: below the difference of atm and bar, 1.3 %.
const SAME_RATIO: f64 = 0.01;

/// The pair of units with this ratio, or its inverse.
fn unit(factor: f64) -> Option<&'static str> {
    let off = |ratio: f64| (factor.ln().abs() - ratio.ln()).abs();
    let nearest = RATIOS.iter().min_by(|a, b| off(a.0).total_cmp(&off(b.0)))?;
    (off(nearest.0) < SAME_RATIO).then_some(nearest.1)
}

/// All dropouts of a campaign, in order.
fn find(campaign: &Campaign) -> Vec<Dropout> {
    let Some(scale) = Scale::of(campaign) else { return Vec::new() };
    let edges = edges(campaign, &scale);
    let mask = masked(campaign, &edges);
    let Some(expected) = mask.and_then(|mask| ExpectedForce::of(campaign, &mask)) else { return Vec::new() };
    let mut found = Vec::new();
    for (recording, edges) in edges.iter().enumerate() {
        let r = &campaign.recordings[recording];
        let Some(force) = r.force.as_deref() else { continue };
        let noticeable = LazyCell::new(|| expected.noticeable(force));
        let mut free = 0;
        for stretch in stretches(edges, &r.time, &r.pressure) {
            // The return edge of one drop-out is not the first edge of the next.
            if stretch.rows.start < free {
                continue;
            }
            if expected.continues(&stretch, r, force, *noticeable) {
                free = stretch.rows.end + 1;
                found.push(Dropout {
                    recording,
                    beside: stretch.beside(&r.pressure),
                    read: r.pressure[stretch.rows.start],
                    factor: stretch.factor,
                    rows: stretch.rows,
                });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests;
