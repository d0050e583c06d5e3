//! What the load cell reads while the muscle hangs slack: the cell's zero, what hangs on it or pushes against it, and what it reads of the
//! pressure.
//!
//! A slack muscle pulls nothing. At lower pressures a tube that lies slack pushes or hangs, and lifts as it is filled, so that for the zero
//! only points count at which the muscle almost pulls. A cell that reads the pressure does that equally at every length, while a tube lifts
//! differently: far below the pull, the least of the slopes over the mountings is what the cell may read of the pressure.
//! Unit of uncertainty: mounting.

use pam_fit::bench::BenchName;
use pam_fit::numerics::median;

use super::answer::{Estimate, Finding, FindingKind};
use super::campaign::Points;
use super::criteria::{PULLS, RAMP, SLACK_FOLLOWS, SLACK_PART, SLACK_POINTS, SLACK_RANGE};
use super::findings::Contrast;
use super::judge::plus_minus;

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
    /// Whether all mountings agree in sign, and it is larger than what load cells are off by between sessions.
    pub found: bool,
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
    let read = by_mounting(&|m| {
        let own =
            (0..points.len()).filter(|i| points.mounting[*i] == m && almost_pulls(points, thresholds, *i));
        let mut read: Vec<f64> = own.map(|i| points.force[i]).collect();
        (read.len() >= SLACK_POINTS).then(|| median(&mut read))
    });
    let at_highest = by_mounting(&|m| slope(points, thresholds, m).map(|slope| slope * points.highest()));
    let material = PULLS * points.largest_force();
    let zero = Contrast::of(&read).filter(|c| c.units > 1)?;
    let follows = Contrast::of(&at_highest).filter(|c| c.units > 1);
    let least = follows.map_or(0.0, |_| least_alike(&at_highest));
    if let Some(mean) = follows.filter(|_| least.abs() > SLACK_FOLLOWS * material) {
        let amplitude = 1e-3 * least / points.highest();
        let effect = BenchName::CrossTalk;
        return Some(SlackReading { mean, effect, confusable: Vec::new(), amplitude, found: true });
    }
    let found = least_alike(&read) != 0.0 && zero.mean.abs() > material;
    // A mounting at full length is never slack: when the zero went off is not known.
    let mut confusable = vec![BenchName::ForceDrift, BenchName::Gravity];
    confusable.extend((least.abs() > material).then_some(BenchName::CrossTalk));
    Some(SlackReading { mean: zero, effect: BenchName::ForceOffset, confusable, amplitude: zero.mean, found })
}

/// The value of the least size where all have one sign; else zero.
fn least_alike(values: &[f64]) -> f64 {
    let least = values.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    if values.iter().all(|v| v * least > 0.0) { least } else { 0.0 }
}

/// How much the reading of a mounting grows with the pressure far below the pull, N/kPa; `None` over too small a range.
fn slope(points: &Points, thresholds: &[f64], mounting: usize) -> Option<f64> {
    let slack = |i: &usize| {
        points.mounting[*i] == mounting && points.pressure[*i] < SLACK_PART * thresholds[mounting]
    };
    let own: Vec<usize> = (0..points.len()).filter(slack).collect();
    let count = own.len() as f64;
    let mean = |of: &[f64]| own.iter().map(|i| of[*i]).sum::<f64>() / count;
    let (pressure, force) = (mean(&points.pressure), mean(&points.force));
    let (mut along, mut spread) = (0.0, 0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in &own {
        let p = points.pressure[*i] - pressure;
        (low, high) = (low.min(p), high.max(p));
        along += p * (points.force[*i] - force);
        spread += p * p;
    }
    (own.len() >= SLACK_POINTS && high - low >= SLACK_RANGE).then(|| along / spread)
}

impl SlackReading {
    /// The zero of the cell, N; 0 where the reading follows the pressure.
    pub(super) fn zero(&self) -> f64 {
        if self.found && self.effect == BenchName::ForceOffset { self.mean.mean } else { 0.0 }
    }

    /// The cell's reading per pressure, N/Pa; 0 where it does not follow the pressure.
    pub(super) fn per_pressure(&self) -> f64 {
        if self.found && self.effect == BenchName::CrossTalk { self.amplitude } else { 0.0 }
    }

    /// As a finding.
    pub(super) fn finding(&self) -> Finding {
        let cause = match (self.effect, self.mean.mean > 0.0) {
            (BenchName::CrossTalk, _) => {
                " at the highest pressure, by the slope over lower ones: it reads the pressure"
            }
            (_, true) => ": the zero of the cell is off, or a weight hangs on it",
            (_, false) => ": the zero of the cell is off, or the slack tube pushes",
        };
        Finding {
            kind: FindingKind::SlackReading,
            found: self.found,
            size: Estimate::new(self.mean.mean, self.mean.half, "N", "mounting"),
            units: self.mean.units,
            squares: self.mean.squares,
            cause: self.found.then(|| self.effect.info().name.to_owned()),
            alternatives: Vec::new(),
            mounting: None,
            run: None,
            words: format!(
                "the load cell reads {} of a slack muscle ({} mountings){}",
                plus_minus(&self.mean),
                self.mean.units,
                if self.found { cause } else { "" }
            ),
        }
    }
}
