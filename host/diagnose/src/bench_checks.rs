//! Faults that checks of the bench measured: the recordings are corrected for them before the diagnosis.

use std::borrow::Cow;

use model_core::braid::Braid;
use model_core::effects::{Context, Info, MEMORY};

use super::as_read::AsRead;
use super::baselines::Kind;
use super::candidates::Candidate;
use super::criteria::judgement::{CHECKED_PROBABILITY, MATERIAL_FAULT};
use super::rows::Rows;
use super::verdict::{
    Considered, Diagnosis, Missing, Outcome, ParameterValue, PathStep, Remark, Verdict, Why, WhyNot,
};
use pam_data::error::Result;
use pam_data::recording::Campaign;
use pam_fit::bench::Candidate as Law;
use pam_fit::checks::{self, Checks, Measured};

mod leak;

use leak::Leak;

/// What a check says of an effect in these recordings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Finding {
    /// It cannot matter.
    Absent,
    /// It may matter: the recordings decide.
    Possible,
    /// It matters.
    Present,
}

/// A fault that was checked, and how large it is in these recordings.
struct Fault {
    measured: Measured,
    finding: Finding,
    /// The largest force that it makes at any row, N.
    peak: f64,
    /// The same at the end of the 95 % interval that is further from none, N.
    at_most: f64,
    /// Whether it is named although the recordings do not show it: a play that is measured surely and matters where the muscle slides.
    stands: bool,
}

impl Fault {
    /// Compares a measured fault with the recordings.
    fn of(measured: &Measured, rows: &Rows, material: impl Fn(f64) -> bool) -> Self {
        let peak = |contexts: &[Context<f64>], parameters: &[f64]| {
            let trace = Law::Bench(measured.fault).trace(contexts, parameters, &mut [0.0; MEMORY]);
            let counts = trace.iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0);
            counts.map(|(f, _)| f.abs()).fold(0.0, f64::max)
        };
        let further: Vec<f64> = measured
            .parameters
            .iter()
            .enumerate()
            .map(|(at, v)| v + measured.half_width(at).copysign(*v))
            .collect();
        let largest = peak(rows.contexts(), &measured.parameters);
        let delays = Law::Bench(measured.fault).traits().delays_reversals;
        // At a reversal even the least play delays the whole jump of friction; how much it may hide is counted where the muscle slides.
        let sliding = if delays {
            Cow::Owned(rows.contexts().iter().map(|c| Context { friction: 0.0, ..*c }).collect())
        } else {
            Cow::Borrowed(rows.contexts())
        };
        let at_most = peak(&sliding, &further);
        let stands = delays && measured.is_sure() && material(peak(&sliding, &measured.parameters));
        let finding = if !material(largest) || !(measured.is_sure() || measured.is_likely()) {
            Finding::Absent
        } else if measured.is_sure() && !delays {
            Finding::Present
        } else {
            // The recordings decide where chance could still be the cause, and on a play, which cannot be removed from a reading.
            Finding::Possible
        };
        Self { measured: measured.clone(), finding, peak: largest, at_most, stands }
    }

    const fn law(&self) -> Law {
        Law::Bench(self.measured.fault)
    }

    fn is(&self, candidate: &Candidate) -> bool {
        candidate.is(self.law())
    }

    /// The check, and the value with its interval.
    fn source(&self) -> (String, String) {
        (self.measured.check.to_string(), self.measured.text.clone())
    }

    fn remark(&self) -> Remark {
        let (check, value) = self.source();
        Remark::Measured { check, value }
    }

    /// The probability that the value is zero and its deviation chance, by Chebyshev's inequality, which assumes no distribution.
    fn chance(&self) -> f64 {
        let values = self.measured.parameters.iter().zip(&self.measured.deviations);
        let worst = values.filter_map(|(v, std)| std.map(|s| (s / v.abs().max(1e-300)).powi(2)));
        worst.fold(0.0, f64::max).min(1.0)
    }

    /// The fault as an effect that the table misses.
    fn missing(&self, share: f64) -> Missing {
        let info = self.measured.fault.info();
        let values = self.measured.parameters.iter().zip(&self.measured.deviations);
        let parameters = info.parameters.iter().zip(values);
        let (check, value) = self.source();
        Missing {
            share_explained: share,
            parameters: parameters.map(|(p, (value, std))| ParameterValue::of(p, *value, *std)).collect(),
            correction: true,
            checked: true,
            peak_N: self.peak,
            p: self.chance(),
            ..Missing::of(info, CHECKED_PROBABILITY, Why::Measured { check, value })
        }
    }
}

/// What checks of the bench measured.
pub(super) struct BenchChecks {
    faults: Vec<Fault>,
    leak: Option<Leak>,
    /// The recordings as they were read, with one bladder for all pressures; only where a fault is present.
    before: Option<AsRead>,
}

impl BenchChecks {
    /// Compares what checks measured with the recordings.
    pub(super) fn of(checks: &Checks, campaign: &Campaign, braid: &Braid<f64>) -> Result<Self> {
        let mut known = Self { faults: Vec::new(), leak: None, before: None };
        if checks.is_empty() {
            return Ok(known);
        }
        let read = AsRead::of(campaign, None, braid)?;
        let rows = read.linearised();
        let blocked = rows.force.iter().copied().fold(0.0, f64::max);
        let material = |force: f64| force >= MATERIAL_FAULT * blocked;
        known.faults = checks.measured().iter().map(|m| Fault::of(m, &rows, material)).collect();
        known.leak = checks.loss().map(|loss| Leak::of(loss, &rows, material));
        if known.with(Finding::Present).next().is_some() {
            known.before = Some(read);
        }
        Ok(known)
    }

    fn with(&self, finding: Finding) -> impl Iterator<Item = &Fault> {
        self.faults.iter().filter(move |f| f.finding == finding)
    }

    /// The recordings, corrected for the faults that were measured.
    pub(super) fn free<'a>(&self, campaign: &'a Campaign) -> Cow<'a, Campaign> {
        let faults: Vec<Measured> = self.with(Finding::Present).map(|f| f.measured.clone()).collect();
        if faults.is_empty() { Cow::Borrowed(campaign) } else { Cow::Owned(checks::freed(campaign, &faults)) }
    }

    /// Whether the corrected stroke follows the force, as the muscle does in a frame that gives.
    pub(super) fn corrects_the_stroke(&self) -> bool {
        self.with(Finding::Present).any(|f| f.law().traits().stroke_follows_force)
    }

    /// Whether a check of the bench settles an effect, so that the recordings need not.
    ///
    /// An effect that the user gives as known is fitted even where a check found it immaterial.
    pub(super) fn settles(&self, candidate: &Candidate, given: &[Law]) -> bool {
        let tight = self.leak.as_ref().is_some_and(|l| l.finding == Finding::Absent);
        let absent =
            (tight && candidate.traits.loses_air) || self.with(Finding::Absent).any(|f| f.is(candidate));
        let is_given = given.iter().any(|g| candidate.is(*g));
        (absent && !is_given) || self.with(Finding::Present).any(|f| f.is(candidate))
    }

    /// Whether a check shows an effect, whose size follows from the recordings.
    pub(super) fn shows(&self, candidate: &Candidate) -> bool {
        let leaks = self.leak.as_ref().is_some_and(|l| l.finding == Finding::Present);
        (leaks && candidate.traits.loses_air) || self.with(Finding::Possible).any(|f| f.is(candidate))
    }

    /// Enters the measured faults into the answer that was found without them, with the kind of its last baseline.
    pub(super) fn enter(
        self,
        (mut diagnosis, kind): (Diagnosis, Kind),
        given: &[Law],
        (freed, as_read): (&Campaign, Option<&Campaign>),
        braid: &Braid<f64>,
    ) -> Result<Diagnosis> {
        for f in self.with(Finding::Absent).filter(|f| !given.contains(&f.law())) {
            diagnosis.considered.push(excluded(f.measured.fault.info(), f.source(), f.at_most));
        }
        for f in self.with(Finding::Possible) {
            let named = diagnosis.missing.iter().any(|m| m.effect == f.measured.fault.info().name);
            if f.stands && diagnosis.judged() && !named {
                name_without_evidence(&mut diagnosis, f.missing(0.0));
            } else {
                diagnosis.remarks.push(f.remark());
            }
        }
        if let Some(leak) = &self.leak {
            leak.enter(&mut diagnosis, given);
        }
        if !diagnosis.judged() {
            // The fault is known all the same; its share of these recordings is not.
            diagnosis.remarks.extend(self.with(Finding::Present).map(Fault::remark));
            return Ok(diagnosis);
        }
        let Some(before) = &self.before else { return Ok(diagnosis) };
        let after = AsRead::of(freed, as_read, braid)?;
        let removed = before.enter(&mut diagnosis, kind, &after);
        let present: Vec<&Fault> = self.with(Finding::Present).collect();
        let all: f64 = present.iter().map(|f| f.peak * f.peak).sum();
        let entries = present.iter().map(|f| Missing {
            given: given.contains(&f.law()),
            ..f.missing(removed.share * f.peak * f.peak / all.max(1e-300))
        });
        for entry in entries {
            // Sorted by peak force, whether a check or the recordings found it.
            let at = diagnosis.missing.iter().position(|m| m.peak_N < entry.peak_N);
            diagnosis.missing.insert(at.unwrap_or(diagnosis.missing.len()), entry);
        }
        let step = |f: &&Fault| PathStep {
            effect: f.measured.fault.info().name.into(),
            rms_N: removed.left,
            held_out_rms_N: None,
            p: f.chance(),
            runners_up: Vec::new(),
        };
        diagnosis.path.splice(0..0, present.iter().map(step));
        Ok(diagnosis)
    }
}

/// Names an effect that a check shows and the recordings do not: it is there, and how much of the error it explains is not known.
fn name_without_evidence(diagnosis: &mut Diagnosis, missing: Missing) {
    diagnosis.considered.retain(|c| c.effect != missing.effect);
    diagnosis.missing.push(missing);
    if diagnosis.verdict() == Verdict::Consistent {
        diagnosis.outcome = Outcome::Judged(Verdict::Explained);
    }
}

/// An effect that a check excludes, with the largest force that it may still make, N.
fn excluded(info: &Info, (check, value): (String, String), at_most: f64) -> Considered {
    Considered {
        effect: info.name.into(),
        gain: 0.0,
        why_not: WhyNot::Measured { check, value },
        hidden_up_to_N: Some(at_most),
        checked: true,
        visible: 1.0,
    }
}
