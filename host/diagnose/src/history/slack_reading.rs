//! What the load cell reads while the muscle hangs slack: the cell's zero, what hangs on it or pushes against it, and what it reads of the
//! pressure.
//!
//! A slack muscle pulls nothing. At lower pressures a tube that lies slack pushes or hangs, and lifts as it is filled, so that for the zero
//! only points count at which the muscle almost pulls. A cell that reads the pressure does that equally at every length, while a tube lifts
//! differently: far below the pull, the least of the slopes over the mountings is what the cell may read of the pressure.
//! Unit of uncertainty: mounting.

use pam_data::statistics;
use pam_data::statistics::median;
use pam_fit::bench::{BenchName, Candidate};

use super::answer::{Estimate, Finding, FindingDetail};
use super::campaign::Points;
use super::criteria::{
    PULLS, RAMP, SLACK_FLAT, SLACK_FOLLOWS, SLACK_KNEE, SLACK_PART, SLACK_POINTS, SLACK_RANGE, SLACK_SAME,
    SLACK_STRAIGHT, THRESHOLD_FROM, THRESHOLD_TO,
};
use super::findings::Contrast;
use super::shift_fit;
use crate::rows::vented_below;

/// Readings of a slack muscle.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SlackReading {
    /// Mean over mountings, N: the zero; where the reading follows the pressure, what it reads at the highest pressure.
    pub mean: Contrast,
    /// The error of the load cell that makes it.
    pub effect: BenchName,
    /// Others that may make it.
    pub confusable: Vec<BenchName>,
    /// Its amplitude, SI.
    pub amplitude: f64,
    /// The largest force that it makes, N.
    pub force: f64,
    /// Whether all mountings agree in sign, and it is larger than what load cells are off by between sessions.
    pub found: bool,
    /// Up to which force, N, errors of the bench may be there that a slack muscle would show.
    pub limits: Vec<(BenchName, f64)>,
}

/// Whether the muscle almost pulls at a point.
pub(super) fn almost_pulls(points: &Points, thresholds: &[f64], i: usize) -> bool {
    (RAMP..2.0 * RAMP).contains(&(thresholds[points.mounting[i]] - points.pressure[i]))
}

/// The readings; `None` with fewer than two mountings that are slack at some pressure.
pub(super) fn of(points: &Points, thresholds: &[f64]) -> Option<SlackReading> {
    let by_mounting = |of: &dyn Fn(usize) -> Option<f64>| -> Vec<f64> {
        (0..points.mountings.len()).filter_map(of).collect()
    };
    let almost = |m: usize| -> Vec<usize> {
        (0..points.len())
            .filter(|i| points.mounting[*i] == m && almost_pulls(points, thresholds, *i))
            .collect()
    };
    let read = by_mounting(&|m| reading(points, almost(m)));
    let rises = by_mounting(&|m| {
        let own = almost(m);
        (own.len() >= SLACK_POINTS).then(|| RAMP * slope(points, &own))
    });
    let zero = Contrast::of(&read).filter(|c| c.units > 1)?;
    let rise = Contrast::of(&rises).map_or(0.0, |c| c.mean);
    // A pull that begins softly is not a reading of a slack muscle.
    let sharp = begins_sharply(points, thresholds);
    let far: Vec<FarBelow> =
        (0..points.mountings.len()).filter_map(|m| FarBelow::of(points, thresholds, m)).collect();
    let at_highest: Vec<f64> = far.iter().map(|f| f.slope * points.highest()).collect();
    let straight = FarBelow::are_straight(&far) && sharp;
    let material = PULLS * points.largest_force();
    let follows = Contrast::of(&at_highest).filter(|c| c.units > 1);
    let least = follows.map_or(0.0, |_| least_alike(&at_highest));
    let limits = limits(&zero, follows.as_ref(), material);
    if let Some(mean) = follows.filter(|_| straight && least.abs() > SLACK_FOLLOWS * material) {
        return Some(SlackReading {
            mean,
            effect: BenchName::CrossTalk,
            confusable: Vec::new(),
            amplitude: 1e-3 * least / points.highest(),
            force: least,
            found: true,
            limits,
        });
    }
    let flat = rise.abs() < SLACK_FLAT * zero.mean.abs();
    let constant = turns(points, &almost).abs() < SLACK_SAME * zero.mean.abs()
        && read_of_vented(points)
            .iter()
            .all(|v| (v - zero.mean).abs() < (1.0 - SLACK_SAME) * zero.mean.abs());
    let found = least_alike(&read) != 0.0 && zero.mean.abs() > material && flat && sharp && constant;
    // A mounting at full length is never slack: when the zero went off is not known.
    let mut confusable = vec![BenchName::ForceDrift, BenchName::Gravity];
    confusable.extend((least.abs() > material).then_some(BenchName::CrossTalk));
    Some(SlackReading {
        mean: zero,
        effect: BenchName::ForceOffset,
        confusable,
        amplitude: zero.mean,
        force: zero.mean,
        found,
        limits,
    })
}

/// Median of the force at some points, N; `None` of too few.
fn reading(points: &Points, at: impl IntoIterator<Item = usize>) -> Option<f64> {
    let mut read: Vec<f64> = at.into_iter().map(|i| points.force[i]).collect();
    (read.len() >= SLACK_POINTS).then(|| median(&mut read))
}

/// How much more the cell reads while the muscle is filled than while it is emptied, N: a memory of the bladder and friction differ by
/// direction, a zero does not.
fn turns(points: &Points, almost: &dyn Fn(usize) -> Vec<usize>) -> f64 {
    let difference = |m: usize| {
        let [filling, emptying] = [1, -1].map(|direction| {
            reading(points, almost(m).into_iter().filter(|i| points.direction[*i] == direction))
        });
        Some(filling? - emptying?)
    };
    let all: Vec<f64> = (0..points.mountings.len()).filter_map(difference).collect();
    Contrast::of(&all).map_or(0.0, |c| c.mean)
}

/// What the cell reads of the vented muscle in each mounting, N. At full length a muscle is never slack under pressure; vented, it shows
/// whether the zero is the same there, too: what a guide holds back after the length was changed is not.
fn read_of_vented(points: &Points) -> Vec<f64> {
    let limit = 1e-3 * vented_below(1e3 * points.highest());
    let vented = |m: usize, i: &usize| points.mounting[*i] == m && points.pressure[*i] < limit;
    let read = |m: usize| reading(points, (0..points.len()).filter(|i| vented(m, i)));
    (0..points.mountings.len()).filter_map(read).collect()
}

/// What the intervals include, and what a tube makes that pushes, hangs or lifts.
fn limits(zero: &Contrast, follows: Option<&Contrast>, material: f64) -> Vec<(BenchName, f64)> {
    let of = |reading: &Contrast, tube: f64| reading.half.map(|half| reading.mean.abs() + half + tube);
    let at_rest = [BenchName::ForceOffset, BenchName::Gravity].map(|b| (b, of(zero, material)));
    let cross_talk = follows.and_then(|f| of(f, SLACK_FOLLOWS * material));
    let all = at_rest.into_iter().chain([(BenchName::CrossTalk, cross_talk)]);
    all.filter_map(|(effect, limit)| Some((effect, limit?))).collect()
}

/// Whether the pull begins sharply: soon after the pressure at which it seems to begin its slope is nearly the final one.
fn begins_sharply(points: &Points, thresholds: &[f64]) -> bool {
    let highest = points.highest();
    let spline = shift_fit::static_spline(highest);
    let share = |m: usize| {
        let own = (0..points.len()).filter(|i| points.mounting[*i] == m);
        let curve = shift_fit::static_curve(points, &spline, own)?;
        let slope = |pressure: f64| spline.at(pressure).slope(&curve);
        Some(slope(thresholds[m] + RAMP) / slope(THRESHOLD_TO * highest))
    };
    let seen = |m: &usize| (2.0 * RAMP..THRESHOLD_FROM * highest - RAMP).contains(&thresholds[*m]);
    let mut all: Vec<f64> = (0..points.mountings.len()).filter(seen).filter_map(share).collect();
    all.retain(|share| share.is_finite());
    !all.is_empty() && median(&mut all) > SLACK_KNEE
}

/// The value of the least size where all have one sign; else zero.
fn least_alike(values: &[f64]) -> f64 {
    let least = values.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    if values.iter().all(|v| v * least > 0.0) { least } else { 0.0 }
}

/// How much the reading of a mounting grows with the pressure far below the pull, N/kPa.
struct FarBelow {
    slope: f64,
    /// The same over the lower and the upper half of the pressures.
    halves: [f64; 2],
}

impl FarBelow {
    /// `None` over too small a range.
    fn of(points: &Points, thresholds: &[f64], mounting: usize) -> Option<Self> {
        let below = |i: &usize| {
            points.mounting[*i] == mounting && points.pressure[*i] < SLACK_PART * thresholds[mounting]
        };
        let own: Vec<usize> = (0..points.len()).filter(below).collect();
        let pressures = || own.iter().map(|i| points.pressure[*i]);
        let (low, high) =
            (pressures().fold(f64::INFINITY, f64::min), pressures().fold(f64::NEG_INFINITY, f64::max));
        let (lower, upper): (Vec<usize>, Vec<usize>) =
            own.iter().partition(|i| points.pressure[**i] < 0.5 * (low + high));
        let enough = lower.len().min(upper.len()) >= SLACK_POINTS && high - low >= SLACK_RANGE;
        enough.then(|| Self {
            slope: slope(points, &own),
            halves: [slope(points, &lower), slope(points, &upper)],
        })
    }

    /// Whether the slope does not grow with the pressure as that of a pull does which begins softly.
    fn are_straight(of: &[Self]) -> bool {
        let sum = |half: usize| of.iter().map(|f| f.halves[half]).sum::<f64>();
        sum(1) / sum(0) > 0.0 && (sum(1) / sum(0)) < SLACK_STRAIGHT
    }
}

/// Slope of the force over the pressure at some points, N/kPa.
fn slope(points: &Points, at: &[usize]) -> f64 {
    statistics::slope(&at.iter().map(|i| (points.pressure[*i], points.force[*i])).collect::<Vec<_>>())
}

impl SlackReading {
    /// The zero of the cell as it was read, N, whether it matters or not; 0 where the reading follows the pressure.
    pub(super) fn zero_read(&self) -> f64 {
        if self.effect == BenchName::ForceOffset { self.mean.mean } else { 0.0 }
    }

    /// The zero of the cell, N; 0 where the reading follows the pressure.
    pub(super) fn zero(&self) -> f64 {
        if self.found { self.zero_read() } else { 0.0 }
    }

    /// The cell's reading per pressure, N/Pa; 0 where it does not follow the pressure.
    pub(super) fn per_pressure(&self) -> f64 {
        if self.found && self.effect == BenchName::CrossTalk { self.amplitude } else { 0.0 }
    }

    /// As a finding.
    pub(super) fn finding(&self) -> Finding {
        Finding {
            found: self.found,
            size: Estimate::new(self.mean.mean, self.mean.half, "N", "mounting"),
            units: self.mean.units,
            squares: self.mean.squares,
            cause: self.found.then_some(Candidate::Bench(self.effect)),
            alternatives: Vec::new(),
            mounting: None,
            run: None,
            detail: FindingDetail::SlackReading {
                grows: (self.effect == BenchName::CrossTalk).then_some(self.force),
            },
        }
    }
}
