//! Sensors that fail: a reading that does not change, stops at the end of its range, is dead, or drops out.
//!
//! A failing sensor is not physics of a muscle, but a model would name it as such. It is found from two properties together. The
//! reading is constant, or steps away and back within one row each. And force, pressure and stroke of these rows contradict the surface
//! of force over pressure and stroke that the other rows of the campaign have in common. A constant reading alone is not a fault: a regulated
//! pressure and a held length are constant.
//!
//! | fault | reading | contradiction | file |
//! | --- | --- | --- | --- |
//! | frozen, saturated | one exact value for many rows | the expected force, or the residual, changes meanwhile | `constant_runs` |
//! | saturated stroke | one value at an end, reached at speed | the force continues, and comes back | `clipped_stroke` |
//! | dead | one value through a recording | a force that this value excludes | `dead_channels` |
//! | drop-out | a step away, and back | no other reading steps | `jumps` |
//! | missed readings | one value in single rows | proved in many other rows | `glitches` |
//!
//! Drop-outs of the pressure are those of [`super::dropouts`].

mod clipped_stroke;
mod constant_runs;
mod dead_channels;
mod glitches;
mod jumps;
mod stroke_motion;
#[cfg(test)]
mod tests;

use std::ops::Range;

use super::dropouts::{Dropout, ExpectedForce};
use super::places::{listed, rows_and_times};
use super::spikes::{self, without_spikes};
use super::{Campaign, Recording};
use crate::pluralise::pluralise;
use crate::statistics::{median, quantile};

pub(super) use glitches::of_all_channels;

/// A column that a sensor reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Gauge pressure.
    Pressure,
    /// Contraction stroke ΔL.
    Stroke,
    /// Force of the muscle.
    Force,
}

impl Channel {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Pressure, Self::Stroke, Self::Force];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Stroke => "stroke",
            Self::Force => "force",
        }
    }

    /// Its readings in a recording, SI.
    #[must_use]
    pub fn of(self, recording: &Recording) -> &[f64] {
        match self {
            Self::Pressure => &recording.pressure,
            Self::Stroke => &recording.stroke,
            Self::Force => recording.force.as_deref().unwrap_or(&[]),
        }
    }

    fn of_mut(self, recording: &mut Recording) -> &mut [f64] {
        match self {
            Self::Pressure => &mut recording.pressure,
            Self::Stroke => &mut recording.stroke,
            Self::Force => recording.force.as_deref_mut().unwrap_or(&mut []),
        }
    }

    /// A reading with its usual unit.
    fn text(self, value: f64) -> String {
        match self {
            Self::Pressure => format!("{:.1} kPa", value / 1e3),
            Self::Stroke => format!("{:.3} mm", value * 1e3),
            Self::Force => format!("{value:.2} N"),
        }
    }
}

/// How a sensor fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It repeats one value in the middle of its range.
    Frozen,
    /// It repeats the largest or smallest value of its recording.
    Saturated,
    /// It reads one value through a whole recording.
    Dead,
    /// It steps away and back.
    DropOut,
    /// All sensors step away and back together: the logger missed a row.
    Missed,
}

/// Rows of a recording in which a sensor failed.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorFault {
    /// Index of the recording in the campaign.
    pub recording: usize,
    /// The rows in that recording, from 0.
    pub rows: Range<usize>,
    /// The sensor.
    pub channel: Channel,
    /// How it failed.
    pub kind: Kind,
    /// Its first reading there, SI.
    pub value: f64,
}

/// What the campaign's other rows have in common.
struct Usual {
    expected: ExpectedForce,
    /// Median size of the residual of a recording, N, taken at the median recording.
    residual: f64,
    /// Ranges of pressure, stroke and force without spikes and the few farthest values, SI.
    spans: [f64; 3],
    /// The largest usual pressure, Pa.
    top_pressure: f64,
}

impl Usual {
    fn of(campaign: &Campaign, skipped: &[bool]) -> Option<Self> {
        let whole = |(r, skip): (&Recording, &bool)| skip.then(|| 0..r.len()).into_iter().collect();
        let masks: Vec<Vec<Range<usize>>> = campaign.recordings.iter().zip(skipped).map(whole).collect();
        let expected = ExpectedForce::of(campaign, &masks)?;
        let taken = || campaign.recordings.iter().zip(skipped).filter(|(_, skip)| !**skip).map(|(r, _)| r);
        let spans = Channel::ALL.map(|c| {
            let mut some: Vec<f64> = taken().flat_map(|r| without_spikes(c.of(r), stride(r.len()))).collect();
            quantile(&mut some, 0.998) - quantile(&mut some, 0.002)
        });
        let mut tops: Vec<f64> = taken().flat_map(|r| without_spikes(&r.pressure, stride(r.len()))).collect();
        let top_pressure = quantile(&mut tops, 0.99);
        let mut residuals: Vec<f64> = taken()
            .filter(|r| r.force.is_some() && !r.is_empty())
            .map(|r| {
                let stride = stride(r.len());
                let size = |i: usize| expected.residual(r, i).abs();
                median(&mut (0..r.len()).step_by(stride).map(size).collect::<Vec<_>>())
            })
            .collect();
        let residual = median(&mut residuals);
        Some(Self { expected, residual, spans, top_pressure })
    }

    /// A change of the force, or of its residual, that the scatter of the other rows does not explain, N.
    fn noticeable(&self, share: f64) -> f64 {
        (share * self.spans[2]).max(CLEAR * self.residual)
    }

    /// The same for a constant reading of a kind that the other recordings of this bench do not show, N.
    fn noticeable_unusually(&self) -> f64 {
        (UNUSUALLY.0 * self.spans[2]).max(UNUSUALLY.1 * self.residual)
    }
}

/// Six times the usual residual: of a normal distribution next to nothing lies there, and friction (both branches, twice the residual
/// that it leaves) stays below.
const CLEAR: f64 = 6.0;
/// For a constant reading of a kind that the other recordings of this bench do not show: a share of the range of forces, and usual residuals (friction
/// alone changes the residual by two).
const UNUSUALLY: (f64, f64) = (0.05, 2.0);
/// Some thousand rows of a recording are examined.
const EXAMINED: usize = 4000;

fn stride(rows: usize) -> usize {
    (rows / EXAMINED).max(1)
}

fn downsampled(column: &[f64]) -> impl Iterator<Item = f64> + '_ {
    column.iter().step_by(stride(column.len())).copied()
}

/// The failures of sensors in a campaign, in the order of recordings and rows. Recordings that are `skipped` (another unit, sign or zero
/// than the others) are neither judged nor used as reference. `dropouts` are those that were found, and bridged, before.
pub(super) fn sensor_faults(campaign: &Campaign, skipped: &[bool], dropouts: &[Dropout]) -> Vec<SensorFault> {
    // A dead recording bends the surface; it is found first, and the rest is judged without it.
    let Some(usual) = Usual::of(campaign, skipped) else { return Vec::new() };
    let mut faults = dead_channels::find(campaign, skipped, &usual);
    let mut skipped = skipped.to_vec();
    for fault in &faults {
        skipped[fault.recording] = true;
    }
    let usual = if faults.is_empty() { Some(usual) } else { Usual::of(campaign, &skipped) };
    let Some(usual) = usual else { return faults };
    let clipped = clipped_stroke::find(campaign, &skipped, &usual);
    let repeats = constant_runs::Repeats::of(campaign);
    for (index, r) in campaign.recordings.iter().enumerate().filter(|(i, _)| !skipped[*i]) {
        if r.force.is_none() {
            continue;
        }
        let overlap = |f: &SensorFault, with: &SensorFault| {
            f.rows.start < with.rows.end && with.rows.start < f.rows.end
        };
        let mut found: Vec<SensorFault> = clipped.iter().filter(|f| f.recording == index).cloned().collect();
        let mut constant = constant_runs::find(campaign, index, &usual, &repeats);
        constant.retain(|fault| !found.iter().any(|f| f.channel == fault.channel && overlap(f, fault)));
        found.extend(constant);
        for fault in jumps::find(campaign, index, &usual) {
            if !found.iter().any(|f| overlap(f, &fault)) {
                found.push(fault);
            }
        }
        found.sort_by_key(|f| f.rows.start);
        faults.extend(found);
    }
    faults.extend(glitches::of_known_values(campaign, &skipped, &faults, dropouts));
    faults.sort_by_key(|f| (f.recording, f.rows.start));
    faults
}

impl SensorFault {
    /// Whether its readings are replaced. A force stays as it was read, as no motion is derived from it, unless it is that of a spike: its
    /// range is.
    pub(super) fn has_bridge(&self) -> bool {
        match self.kind {
            Kind::Dead => false,
            Kind::Missed => true,
            Kind::DropOut if self.rows.len() < spikes::LONGEST => true,
            Kind::Frozen | Kind::Saturated | Kind::DropOut => self.channel != Channel::Force,
        }
    }

    /// Replaces the failed readings by the line between those beside, good enough to follow the motion.
    pub(super) fn bridge(&self, recording: &mut Recording) {
        let column = self.channel.of_mut(recording);
        let Range { start, end } = self.rows;
        let before = start.checked_sub(1).and_then(|i| column.get(i)).copied();
        let after = column.get(end).copied();
        let (Some(from), Some(to)) = (before.or(after), after.or(before)) else { return };
        let steps = (end - start + 1) as f64;
        for (k, v) in column[start..end].iter_mut().enumerate() {
            *v = from + (to - from) * (k + 1) as f64 / steps;
        }
    }

    fn place(&self, campaign: &Campaign) -> String {
        let r = &campaign.recordings[self.recording];
        let value = self.channel.text(self.value);
        if self.kind == Kind::Dead {
            return format!("`{}`, all {}, at {value}", r.name, pluralise(r.len(), "row"));
        }
        format!("`{}` {} at {value}", r.name, rows_and_times(r, &self.rows))
    }
}

/// One sentence for each sensor and kind of failure: places, rows and the remedy.
pub(super) fn describe(faults: &[SensorFault], campaign: &Campaign) -> Vec<String> {
    let missed: Vec<&SensorFault> =
        faults.iter().filter(|f| f.kind == Kind::Missed && f.channel == Channel::Pressure).collect();
    let rows: usize = missed.iter().map(|f| f.rows.len()).sum();
    let missed = (!missed.is_empty()).then(|| {
        format!(
            "failed logger: pressure, stroke and force step away and back together within one row each; {} excluded: {}; check the logger",
            pluralise(rows, "row"),
            listed(missed.iter().map(|f| f.place(campaign)))
        )
    });
    let kinds = [Kind::Dead, Kind::Frozen, Kind::Saturated, Kind::DropOut];
    let pairs = Channel::ALL.into_iter().flat_map(|c| kinds.into_iter().map(move |k| (c, k)));
    let sentence = |(channel, kind): (Channel, Kind)| {
        let of: Vec<&SensorFault> =
            faults.iter().filter(|f| f.channel == channel && f.kind == kind).collect();
        if of.is_empty() {
            return None;
        }
        let (what, remedy) = match kind {
            Kind::Dead => {
                ("reads one value, which its other readings exclude", "check connector, supply and range")
            }
            Kind::Frozen => {
                ("repeats one value while the other readings move", "check the logger and the sensor")
            }
            Kind::Saturated => {
                ("stops at the end of its range", "use a sensor or an amplifier of a larger range")
            }
            Kind::DropOut | Kind::Missed => {
                ("steps away and back within one row each", "check connector and cable")
            }
        };
        let name = channel.name();
        let rows: usize = of.iter().map(|f| f.rows.len()).sum();
        Some(format!(
            "failed sensor: the {name} {what}; {} excluded: {}; {remedy} of the {name}",
            pluralise(rows, "row"),
            listed(of.iter().map(|f| f.place(campaign)))
        ))
    };
    missed.into_iter().chain(pairs.filter_map(sentence)).collect()
}
