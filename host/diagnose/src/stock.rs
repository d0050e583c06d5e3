//! A stock of muscles together: what they have in common, what each has of its own, and which effect of the catalogue differs with length.
//!
//! The numbers are those of the joint fit ([`pam_fit::stock`]). A law between muscles is named where it predicts left-out muscles better than
//! chance differences do, and where its parameter exceeds its standard error by the quantile of Student's t. There are as many degrees of freedom
//! as muscles less two. Unit of uncertainty: muscle. Mounted lengths are named by `mounted_lengths`.

mod mounted_lengths;
#[cfg(test)]
mod tests;

use model_core::braid::Braid;
use model_core::units::Length;
use pam_data::error::Result;
use pam_fit::numerics::student::half_width_95;
use pam_fit::stock::{Law, LawError, Member, Place, Stock, Value, stock};

use crate::criteria::stock::{EXCHANGEABLE, ONSET, ONSET_STEPS, PLACES, SLOPE_RANGE};
use crate::history::answer::{Estimate, FindingKind};
use crate::history::history;
pub use mounted_lengths::{CauseError, LengthsRefusal, MountedLengths, MuscleMountings};
use pam_data::statistics::NORMAL_95;

/// An estimate with its standard error and its 95 % interval, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    fn new(of: Value, quantile: f64) -> Self {
        let half = quantile * of.std;
        Self { value: of.value, std: of.std, low: of.value - half, high: of.value + half }
    }
}

/// A mounting of a muscle.
#[derive(Debug, Clone, PartialEq)]
pub struct MountingOwn {
    /// Its label in the file; empty where there is none.
    pub label: String,
    /// The held stroke, m; `None` where the muscle moved.
    pub stroke: Option<f64>,
    /// By how much the muscle is more contracted than the file says, m: that of its rest length and that of the mounting together.
    pub length: Interval,
    /// Zero of the load cell, N.
    pub zero: Interval,
}

/// What a muscle has of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct MuscleOwn {
    /// Its name.
    pub name: String,
    /// Rest length, m.
    pub rest_length: f64,
    /// Its force over that of a muscle of the stock with its length.
    pub scale: Interval,
    /// Its blocked force by the joint fit, N.
    pub blocked: f64,
    /// The same of a muscle of this length that has nothing of its own, N.
    pub expected: f64,
    /// By mounting.
    pub mountings: Vec<MountingOwn>,
    /// How much less the first filling of a mounting pulls than the second, N; `None` where the recordings do not show it.
    pub run_in: Option<Estimate>,
}

/// The shared force at a contraction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedPlace {
    /// Contraction `ΔL/L0`, a fraction; 0 at rest length.
    pub contraction: f64,
    /// Mid-line of the force at the highest pressure, N.
    pub force: f64,
    /// Emptying less filling at that pressure, N; `None` where only one direction was recorded.
    pub gap: Option<f64>,
    /// Pressure at which the muscle begins to pull, Pa; `None` where it does not.
    pub onset: Option<f64>,
}

/// A law between muscles that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Considered {
    /// `None`: muscles differ by chance only.
    pub law: Option<Law>,
    /// Its parameter: m, or m/N for a compliance.
    pub parameter: Option<Interval>,
    /// Its standard error by the jackknife over muscles, for comparison.
    pub jackknife: Option<f64>,
    /// Error on left-out muscles, rms, as a share of the largest force of each.
    pub error: f64,
    /// Why it is not named; `None` for the law that is, and for chance differences.
    pub why_not: Option<LawRefusal>,
}

/// Why a law between muscles is not named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LawRefusal {
    /// Its parameter would be negative.
    Negative,
    /// It does not predict left-out muscles better than chance differences do.
    NoBetterThanChance,
    /// Its parameter is too few standard errors from zero.
    Uncertain {
        /// How many.
        t: f64,
        /// How many are needed.
        needed: f64,
    },
    /// Another law predicts left-out muscles better.
    OtherLaw,
}

/// A stock of muscles, diagnosed.
#[derive(Debug, Clone)]
pub struct StockDiagnosis {
    /// By muscle.
    pub muscles: Vec<MuscleOwn>,
    /// The highest pressure that all muscles were recorded at, Pa.
    pub pressure: f64,
    /// The shared force at a few contractions.
    pub shared: Vec<SharedPlace>,
    /// Slope of the blocked force over pressure, m²: the area on which the pressure pulls, of a muscle so long that its ends do not count.
    pub area: f64,
    /// The same by the described braid (mean), m².
    pub described_area: f64,
    /// The law that is named, with its parameter and its t.
    pub named: Option<(Law, Interval, f64)>,
    /// Effects that these recordings do not distinguish from it.
    pub confusable_with: Vec<String>,
    /// All laws that were tried.
    pub considered: Vec<Considered>,
    /// The held mountings, each predicted from all others; `None` where none can be.
    pub mounted_lengths: Option<MountedLengths>,
    /// First-run deficit pooled over the mountings of all muscles, N, with the number of muscles; `None` where none shows it.
    pub run_in: Option<(Interval, usize)>,
    /// The joint fit.
    pub fitted: Stock,
}

/// Diagnoses a stock.
///
/// # Errors
/// As [`stock`].
pub fn diagnose_stock(members: &[Member<'_>]) -> Result<StockDiagnosis> {
    let fitted = stock(members)?;
    let freedom = members.len().saturating_sub(2);
    let highest =
        |m: usize| fitted.cells.list.iter().filter(|c| c.member == m).map(|c| c.pressure).fold(0.0, f64::max);
    let pressure = (0..members.len()).map(highest).fold(f64::INFINITY, f64::min);
    let considered = considered(&fitted, freedom);
    let named = named(&fitted, freedom);
    let confusable_with = named.as_ref().map_or_else(Vec::new, |n| confusable(&fitted, n.0));
    let muscles: Vec<MuscleOwn> =
        members.iter().enumerate().map(|(m, member)| own(&fitted, m, member, pressure)).collect();
    let run_in = pooled(&muscles);
    let areas = members.iter().filter_map(|m| Some(described_area(&m.muscle.geometry().build().ok()?)));
    let areas: Vec<f64> = areas.collect();
    Ok(StockDiagnosis {
        shared: shared(&fitted, pressure),
        area: area(&fitted, pressure),
        described_area: areas.iter().sum::<f64>() / areas.len().max(1) as f64,
        muscles,
        pressure,
        named,
        confusable_with,
        considered,
        mounted_lengths: mounted_lengths::mounted_lengths(&fitted),
        run_in,
        fitted,
    })
}

fn described_area(braid: &Braid<f64>) -> f64 {
    braid.posture(Length::from_metres(0.0)).area
}

/// The law that was taken, where its parameter is found.
fn named(fitted: &Stock, freedom: usize) -> Option<(Law, Interval, f64)> {
    let [law] = fitted.laws.as_slice() else { return None };
    let tried = fitted.tried.iter().find(|t| t.laws == fitted.laws)?;
    let value = *tried.values.first()?;
    let t = value.value / value.std;
    (t > half_width_95(freedom)).then(|| (*law, Interval::new(value, half_width_95(freedom)), t))
}

fn confusable(fitted: &Stock, law: Law) -> Vec<String> {
    let Some(best) = fitted.tried.iter().find(|t| t.laws == [law]) else { return Vec::new() };
    let others = fitted.tried.iter().filter(|t| {
        t.plausible()
            && t.error <= EXCHANGEABLE * best.error
            && t.laws.first().is_some_and(|l| l.effect() != law.effect())
    });
    others.filter_map(|t| t.laws.first().map(|l| l.effect().to_owned())).collect()
}

fn considered(fitted: &Stock, freedom: usize) -> Vec<Considered> {
    let none = fitted.tried.first().map_or(f64::NAN, |t| t.error);
    let name = named(fitted, freedom).map(|n| n.0);
    let needed = half_width_95(freedom);
    let why = |tried: &LawError, law: Option<Law>| {
        law.filter(|law| name != Some(*law))?;
        let value = tried.values.first().copied().unwrap_or_default();
        let t = value.value / value.std;
        Some(if !tried.plausible() {
            LawRefusal::Negative
        } else if !(tried.error < none) {
            LawRefusal::NoBetterThanChance
        } else if !(t > needed) {
            LawRefusal::Uncertain { t, needed }
        } else {
            LawRefusal::OtherLaw
        })
    };
    fitted
        .tried
        .iter()
        .map(|t| {
            let law = t.laws.first().copied();
            Considered {
                law,
                parameter: t.values.first().map(|v| Interval::new(*v, needed)),
                jackknife: t.jackknife.first().copied(),
                error: t.error,
                why_not: why(t, law),
            }
        })
        .collect()
}

/// Mid-line at rest length, N.
fn blocked(fitted: &Stock, pressure: f64, rest_length: f64, member: Option<usize>) -> f64 {
    fitted.fit.force(&Place { pressure, stroke: 0.0, rest_length, direction: 0.0, member, mounting: None })
}

fn own(fitted: &Stock, m: usize, member: &Member<'_>, pressure: f64) -> MuscleOwn {
    let own = &fitted.fit.own[m];
    let rest_length = member.muscle.rest_length();
    let mountings =
        fitted.cells.mountings[m].iter().zip(own.mounted.iter().zip(&own.zero)).map(|(mounting, (d, b))| {
            let length = Value { value: own.length.value + d.value, std: own.length.std.hypot(d.std) };
            MountingOwn {
                label: mounting.label.clone(),
                stroke: mounting.stroke,
                length: Interval::new(length, NORMAL_95),
                zero: Interval::new(*b, NORMAL_95),
            }
        });
    let scale = own.scale.value.exp();
    let log = Interval::new(own.scale, NORMAL_95);
    let history = history(member.campaign, &member.muscle.geometry());
    let run_in = history.and_then(|h| {
        h.findings.into_iter().find(|f| f.kind() == FindingKind::FirstRunDeficit).map(|f| f.size)
    });
    MuscleOwn {
        name: member.muscle.name.clone(),
        rest_length,
        scale: Interval {
            value: scale,
            std: scale * own.scale.std,
            low: log.low.exp(),
            high: log.high.exp(),
        },
        blocked: blocked(fitted, pressure, rest_length, Some(m)),
        expected: blocked(fitted, pressure, rest_length, None),
        mountings: mountings.collect(),
        run_in,
    }
}

fn shared(fitted: &Stock, pressure: f64) -> Vec<SharedPlace> {
    let cells = &fitted.cells;
    let deepest = cells.list.iter().map(|c| cells.contraction(c)).fold(0.0, f64::max);
    let lowest = cells.list.iter().map(|c| c.pressure).fold(f64::INFINITY, f64::min);
    let both = [1.0, -1.0].iter().all(|d| cells.list.iter().any(|c| c.direction == *d));
    let onset = |contraction: f64| {
        (0..=ONSET_STEPS)
            .map(|k| lowest + (pressure - lowest) * f64::from(k) / f64::from(ONSET_STEPS))
            .find(|p| fitted.fit.shared_force(*p, contraction, 0.0) > ONSET * cells.largest)
    };
    (0..PLACES)
        .map(|k| {
            let contraction = deepest * k as f64 / (PLACES - 1) as f64;
            let at = |direction| fitted.fit.shared_force(pressure, contraction, direction);
            SharedPlace {
                contraction,
                force: at(0.0),
                gap: both.then(|| at(-1.0) - at(1.0)),
                onset: onset(contraction),
            }
        })
        .collect()
}

/// Slope of the blocked force over pressure of a muscle so long that its ends do not count, m².
fn area(fitted: &Stock, pressure: f64) -> f64 {
    let lowest = fitted.cells.list.iter().map(|c| c.pressure).fold(f64::INFINITY, f64::min);
    let step = SLOPE_RANGE * (pressure - lowest).max(1.0);
    let at = |p: f64| fitted.fit.shared_force(p, 0.0, 0.0);
    let [ends, ..] = fitted.fit.shared;
    (at(pressure) - at(pressure - step)) / step * (1.0 + ends.value * fitted.fit.mean_inverse_length())
}

/// Mean of the first-run deficits, weighted by their precision; the standard error is that of the scatter between muscles.
fn pooled(muscles: &[MuscleOwn]) -> Option<(Interval, usize)> {
    let values: Vec<f64> = muscles.iter().filter_map(|m| m.run_in.as_ref()).map(|e| e.value).collect();
    let n = values.len();
    if n < 2 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n as f64;
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let std = (square / (n - 1) as f64 / n as f64).sqrt();
    Some((Interval::new(Value { value: mean, std }, half_width_95(n - 1)), n))
}
