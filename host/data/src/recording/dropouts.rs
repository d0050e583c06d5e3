//! Stretches in which the gauge alone falls out: its reading steps away between two readings and back between two readings, while
//! the force goes on as if nothing had happened. Somebody's psi among kilopascals, or a loose plug.
//!
//! A real step of pressure moves the force of a muscle that pulls. So a stretch counts as fallen out only where the force is what the
//! campaign's other readings make at the pressure of before and after, and far from what they make at the pressure that was read.
//! Where the muscle is slack, the force stands at the end of its cell's range, or the campaign says too little of what pressure
//! makes, nothing is marked.

mod expected_force;
mod steps;

use std::borrow::Cow;
use std::ops::Range;

use super::unit_check::{InconsistentRecording, inconsistent_recordings};
use super::{Campaign, Recording};
use crate::pluralise::pluralise;
use expected_force::ExpectedForce;
use steps::{Scale, Stretch, edges, masked, stretches};

/// A stretch of readings of the pressure that are not the muscle's.
#[derive(Debug, Clone, PartialEq)]
pub struct Dropout {
    /// The recording, counted as in the campaign.
    pub recording: usize,
    /// Its rows there, from 0.
    pub rows: Range<usize>,
    /// The last reading before, or the first one behind where it begins the recording, Pa.
    pub beside: f64,
    /// The first reading of the stretch, Pa.
    pub read: f64,
    /// By what every reading of the stretch is too small, where it is one factor: that of before and of after agree.
    pub factor: Option<f64>,
}

/// A campaign with what was read wrongly made good as well as can be: good enough to follow the motion; no evidence.
#[derive(Debug, Clone)]
pub struct Screened<'a> {
    /// As it was read, but for the mistake in recordings that stand inconsistent, and for the pressure of the dropouts: the reading times
    /// their factor, or the line from the reading before to the reading after.
    pub campaign: Cow<'a, Campaign>,
    /// Whole recordings in another unit than the rest, in order.
    pub inconsistent: Vec<InconsistentRecording>,
    /// In order.
    pub dropouts: Vec<Dropout>,
}

/// At most this many stretches are told one by one.
const TOLD: usize = 4;
/// A reading of this share of the one before is zero.
const NOTHING: f64 = 0.01;

impl<'a> Screened<'a> {
    /// Looks a campaign over. Recordings without a force are passed over: nothing tells a dropout from a real step there.
    #[must_use]
    pub fn of(campaign: &'a Campaign) -> Self {
        let inconsistent = inconsistent_recordings(campaign);
        let mut campaign = Cow::Borrowed(campaign);
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
        Self { campaign, inconsistent, dropouts }
    }

    /// Whether a whole recording is in another unit than the rest.
    #[must_use]
    pub fn is_inconsistent(&self, index: usize) -> bool {
        self.inconsistent.iter().any(|a| a.recording == index)
    }

    /// The stretches of one recording in which the gauge fell out, in order.
    pub fn of_recording(&self, index: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        self.dropouts.iter().filter(move |d| d.recording == index).map(|d| d.rows.clone())
    }

    /// Row by row of a recording, whether it was read rightly.
    #[must_use]
    pub fn read(&self, index: usize) -> Vec<bool> {
        let right = !self.is_inconsistent(index);
        let mut read = vec![right; self.campaign.recordings.get(index).map_or(0, Recording::len)];
        for rows in self.of_recording(index) {
            read[rows].fill(false);
        }
        read
    }

    /// Rows in which the gauge fell out.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.dropouts.iter().map(|d| d.rows.len()).sum()
    }

    /// What there is to say: where, from what to what, the likely cause, and what to do; `None` where all was read rightly.
    #[must_use]
    pub fn remark(&self) -> Option<String> {
        let inconsistent = self.inconsistent.iter().take(TOLD).map(|a| self.told_apart(a));
        let more = self.inconsistent.len().checked_sub(TOLD + 1).map(|n| format!("so do {} more", n + 1));
        let parts: Vec<String> = inconsistent.chain(more).chain(self.remark_on_dropouts()).collect();
        (!parts.is_empty()).then(|| parts.join(". "))
    }

    fn told_apart(&self, a: &InconsistentRecording) -> String {
        let r = &self.campaign.recordings[a.recording];
        format!(
            "`{}` stands inconsistent from the other recordings, and its {} left out: {}",
            r.name,
            if r.len() == 1 { "row is".to_owned() } else { format!("{} are", pluralise(r.len(), "row")) },
            a.describe()
        )
    }

    fn remark_on_dropouts(&self) -> Option<String> {
        let first = self.dropouts.first()?;
        let mut places: Vec<String> = self.dropouts.iter().take(TOLD).map(|d| self.place(d)).collect();
        if self.dropouts.len() > TOLD {
            places.push(format!("and so on, {} times in all", self.dropouts.len()));
        }
        let units: Vec<_> = self.dropouts.iter().map(|d| d.factor.and_then(unit)).collect();
        let ratio = units[0].filter(|first| units.iter().all(|u| *u == Some(*first)));
        let cause = match ratio {
            Some(unit) => format!("the ratio is that of {unit}: mend the unit where the readings are logged"),
            None if first.read.abs() <= NOTHING * first.beside.abs() => {
                "look at the gauge's plug and cable".to_owned()
            }
            None => "look at the gauge, its plug and its cable".to_owned(),
        };
        Some(format!(
            "the pressure alone steps away and back, each within one reading, while the force goes on; {} left out: {}; {cause}",
            pluralise(self.rows(), "row"),
            places.join("; ")
        ))
    }

    fn place(&self, d: &Dropout) -> String {
        let r = &self.campaign.recordings[d.recording];
        let row = |i: usize| 1 + r.rows.as_ref().map_or(i, |rows| rows[i] as usize);
        let (first, last) = (d.rows.start, d.rows.end - 1);
        let kpa = |p: f64| format!("{:.1}", p / 1e3);
        let share = d.factor.map_or(String::new(), |f| {
            if f > 1.0 { format!(" (1/{f:.2} of it)") } else { format!(" ({:.2} times it)", 1.0 / f) }
        });
        let place = if first == last {
            format!("row {} ({:.2} s)", row(first), r.time[first])
        } else {
            format!("rows {} to {} ({:.2} to {:.2} s)", row(first), row(last), r.time[first], r.time[last])
        };
        format!("{} {place} from {} to {} kPa{share}", r.name, kpa(d.beside), kpa(d.read))
    }
}

/// Pairs of units whose ratio a wrong unit shows, the larger one first.
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
/// How near a ratio must come to that of two units: nearer than atm is to bar.
const SAME_RATIO: f64 = 0.01;

/// The units whose ratio a factor is, either way round.
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
        let mut free = 0;
        for stretch in stretches(edges, &r.time, &r.pressure) {
            // The way back of one is not the way out of the next.
            if stretch.rows.start < free {
                continue;
            }
            if expected.goes_on(&stretch, r, force) {
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
