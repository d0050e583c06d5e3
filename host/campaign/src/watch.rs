//! Judges the readings while they come: what is dangerous ends the campaign, what is spoiled is repeated.

use pam_data::statistics::extremes;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::actuation::Reading;
use crate::criteria::{CLIPPED_ROWS, FOLLOWS, FOLLOWS_S, FREE_FORCE, NOISY, OVER_PRESSURE, SLACK_ROWS};
use crate::step::Step;

/// Limits of muscle and rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// Highest pressure of a command, Pa.
    pub pressure: f64,
    /// Largest force, N.
    pub force: f64,
    /// Largest stroke, m.
    pub stroke: f64,
}

/// Why a step is worth nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spoiled {
    /// Too few readings.
    TooShort,
    /// The pressure did not reach its command: supply or valve saturated.
    NotSettled,
    /// A sensor stayed at its end.
    Clipped,
    /// A sensor did not change although its quantity must have.
    Frozen,
    /// The muscle was slack.
    Slack,
    /// The force is much noisier than it was.
    Noisy,
    /// The force falls where it must rise.
    WrongSign,
    /// The stroke is not what was commanded: wrong unit or scale.
    WrongScale,
}

impl fmt::Display for Spoiled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooShort => "it holds too few readings",
            Self::NotSettled => "the pressure did not reach its command (supply closed, or valve saturated)",
            Self::Clipped => "a sensor stayed at the end of its range",
            Self::Frozen => "a sensor did not change although it must have",
            Self::Slack => "the muscle was slack",
            Self::Noisy => "the force is noisier than 2 % of the blocked force",
            Self::WrongSign => "the force falls as the pressure rises (sign of the load cell)",
            Self::WrongScale => {
                "the measured stroke is not the commanded one (unit or scale of the stroke sensor)"
            }
        })
    }
}

/// Why the campaign must end immediately.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Danger {
    /// Measured pressure, Pa.
    Pressure(f64),
    /// Measured force, N.
    Force(f64),
    /// Measured stroke, m.
    Stroke(f64),
    /// A reading is not a number.
    NotANumber,
}

impl fmt::Display for Danger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pressure(p) => write!(f, "the pressure of {:.0} kPa is above the limit", p * 1e-3),
            Self::Force(n) => write!(f, "the force of {n:.1} N is above the limit of the rig"),
            Self::Stroke(x) => write!(f, "the stroke of {:.2} mm is beyond the limit of the rig", x * 1e3),
            Self::NotANumber => f.write_str("a sensor's reading is not a number"),
        }
    }
}

/// The readings of one step, judged as they come.
#[derive(Debug)]
pub(crate) struct Watch {
    limits: Limits,
    top: f64,
    blocked: f64,
    rows: Vec<Reading>,
    away_since: Option<f64>,
    not_settled: bool,
}

impl Watch {
    /// Nothing read yet; `top` is the highest level (Pa), `blocked` the blocked force as far as it is known (N).
    #[must_use]
    pub fn new(limits: Limits, top: f64, blocked: f64) -> Self {
        Self { limits, top, blocked, rows: Vec::new(), away_since: None, not_settled: false }
    }

    /// Takes a reading; says what is dangerous about it.
    pub fn add(&mut self, r: &Reading) -> Option<Danger> {
        if ![r.time, r.pressure, r.stroke, r.force].iter().all(|v| v.is_finite()) {
            return Some(Danger::NotANumber);
        }
        if !(r.pressure <= OVER_PRESSURE * self.limits.pressure) {
            return Some(Danger::Pressure(r.pressure));
        }
        if !(r.force.abs() <= self.limits.force) {
            return Some(Danger::Force(r.force));
        }
        // A tenth more than the limit: the sensor's own zero and the turn of the axis.
        if !(r.stroke <= 1.1 * self.limits.stroke) {
            return Some(Danger::Stroke(r.stroke));
        }
        let away = !((r.pressure - r.command).abs() <= FOLLOWS * self.top);
        match (away, self.away_since) {
            (false, _) => self.away_since = None,
            (true, None) => self.away_since = Some(r.time),
            (true, Some(since)) => self.not_settled |= r.time - since > FOLLOWS_S,
        }
        if r.recorded {
            self.rows.push(*r);
        }
        None
    }

    /// Rows recorded so far.
    #[must_use]
    pub fn rows(&self) -> &[Reading] {
        &self.rows
    }

    /// Whether the muscle did not pull at the held length, even at the highest level.
    fn slack_at_the_top(&self) -> bool {
        let held = 0.95 * self.rows.iter().map(|r| r.stroke).fold(0.0, f64::max);
        let at_top = self.rows.iter().filter(|r| r.pressure > 0.95 * self.top && r.stroke > held);
        let top: Vec<f64> = at_top.map(|r| r.force).collect();
        let mean = top.iter().sum::<f64>() / top.len() as f64;
        self.blocked > 0.0 && mean < FREE_FORCE * self.blocked
    }

    /// Whether the step must be repeated, and why.
    #[must_use]
    pub fn judge(&self, step: &Step) -> Option<Spoiled> {
        let rows = &self.rows;
        if rows.len() < 20 {
            return Some(Spoiled::TooShort);
        }
        if self.not_settled {
            return Some(Spoiled::NotSettled);
        }
        let force: Vec<f64> = rows.iter().map(|r| r.force).collect();
        let stroke: Vec<f64> = rows.iter().map(|r| r.stroke).collect();
        if step.is_held_shortened() && self.slack_at_the_top() {
            return Some(Spoiled::Slack);
        }
        if clipped(&force, self.blocked) {
            return Some(Spoiled::Clipped);
        }
        let (low, high) = extremes(&force);
        if low == high || rows.windows(2).all(|w| w[0].pressure == w[1].pressure) {
            return Some(Spoiled::Frozen);
        }
        if self.blocked > 0.0 && pam_data::recording::white_noise(&force) > NOISY * self.blocked {
            return Some(Spoiled::Noisy);
        }
        match step {
            Step::BlockedRamp | Step::Staircase { .. } => {
                falls_with_pressure(rows).then_some(Spoiled::WrongSign)
            }
            Step::Loops { .. }
            | Step::Survey { .. }
            | Step::Speeds { .. }
            | Step::Nested { .. }
            | Step::Rest { .. } => {
                let (from, to) = extremes(&stroke);
                if !(to - from > 0.0) {
                    return Some(Spoiled::Frozen);
                }
                if to > 3.0 * self.limits.stroke || to < 1e-3 * self.limits.stroke {
                    return Some(Spoiled::WrongScale);
                }
                let slack = force.iter().filter(|f| **f < 0.002 * self.blocked).count();
                (slack as f64 > SLACK_ROWS * force.len() as f64).then_some(Spoiled::Slack)
            }
            _ => None,
        }
    }
}

/// Whether equal readings at the upper end follow each other, where the force has a range worth the name.
fn clipped(force: &[f64], blocked: f64) -> bool {
    let (low, high) = extremes(force);
    if !(high - low > 0.05 * blocked.max(1e-9)) {
        return false;
    }
    let mut run = 0;
    force.iter().any(|f| {
        run = if *f == high { run + 1 } else { 0 };
        run >= CLIPPED_ROWS
    })
}

/// Whether force and pressure at held length go against each other.
fn falls_with_pressure(rows: &[Reading]) -> bool {
    let n = rows.len() as f64;
    let mean = |of: fn(&Reading) -> f64| rows.iter().map(of).sum::<f64>() / n;
    let (p, f) = (mean(|r| r.pressure), mean(|r| r.force));
    let cross: f64 = rows.iter().map(|r| (r.pressure - p) * (r.force - f)).sum();
    let sizes: f64 = rows.iter().map(|r| (r.pressure - p).powi(2)).sum::<f64>().sqrt()
        * rows.iter().map(|r| (r.force - f).powi(2)).sum::<f64>().sqrt();
    // Half of a perfect correlation: a muscle at held length shows nearly one, of one sign.
    cross < -0.5 * sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { pressure: 6e5, force: 300.0, stroke: 0.01 };

    fn ramp(force: impl Fn(f64) -> f64) -> Watch {
        let mut watch = Watch::new(LIMITS, 6e5, 100.0);
        for i in 0..200 {
            let p = 3e3 * f64::from(i);
            let r = Reading {
                time: 0.1 * f64::from(i),
                pressure: p,
                command: p,
                stroke: 0.0,
                force: force(p),
                recorded: true,
            };
            assert_eq!(watch.add(&r), None);
        }
        watch
    }

    #[test]
    fn a_good_ramp_passes_and_spoiled_ones_are_named() {
        let judge = |force: &dyn Fn(f64) -> f64| ramp(force).judge(&Step::BlockedRamp);
        assert_eq!(judge(&|p| 1.6e-4 * p), None);
        assert_eq!(judge(&|p| -1.6e-4 * p), Some(Spoiled::WrongSign));
        assert_eq!(judge(&|p| (1.6e-4 * p).min(60.0)), Some(Spoiled::Clipped));
        assert_eq!(judge(&|_| 0.0), Some(Spoiled::Frozen));
        assert_eq!(judge(&|p| 1.6e-4 * p + 8.0 * (p * 7.7).sin()), Some(Spoiled::Noisy));
    }

    #[test]
    fn danger_is_reported_immediately() {
        let mut watch = Watch::new(LIMITS, 6e5, 100.0);
        let well = Reading { pressure: 1e5, command: 1e5, ..Reading::default() };
        assert_eq!(watch.add(&well), None);
        assert_eq!(watch.add(&Reading { pressure: 7e5, ..well }), Some(Danger::Pressure(7e5)));
        assert_eq!(watch.add(&Reading { force: f64::NAN, ..well }), Some(Danger::NotANumber));
        assert_eq!(watch.add(&Reading { force: -400.0, ..well }), Some(Danger::Force(-400.0)));
        assert_eq!(watch.add(&Reading { stroke: 0.02, ..well }), Some(Danger::Stroke(0.02)));
    }

    #[test]
    fn a_pressure_that_stays_away_spoils_the_step() {
        let mut watch = Watch::new(LIMITS, 6e5, 100.0);
        for i in 0..60 {
            let time = 0.1 * f64::from(i);
            let r = Reading {
                time,
                pressure: 2e5 + time,
                command: 4e5,
                force: time,
                recorded: true,
                ..Reading::default()
            };
            watch.add(&r);
        }
        assert_eq!(watch.judge(&Step::Tare { seconds: 10.0 }), Some(Spoiled::NotSettled));
    }
}
