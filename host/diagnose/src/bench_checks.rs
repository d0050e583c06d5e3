//! Faults that checks of the bench measured: the recordings are corrected for them before the diagnosis.

use std::borrow::Cow;

use model_core::braid::Braid;
use model_core::effects::MEMORY;

use super::baselines::{self, Baseline, Kind};
use super::candidates::Candidate;
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::judgement::{CHECK_RESOLUTION, CHECKED_PROBABILITY, MATERIAL_FAULT};
use super::cross_validation::HeldOutRows;
use super::location::locate;
use super::rows::{self, Rows};
use super::verdict::{
    Considered, Diagnosis, Missing, Outcome, ParameterValue, PathStep, Remark, Verdict, Why, WhyNot,
};
use pam_data::error::Result;
use pam_data::recording::Campaign;
use pam_fit::bench::{BenchName, Candidate as Law};
use pam_fit::checks::{self, Checks, Loss, Measured};

/// A fault that was checked, and how large it is in these recordings.
struct Judged {
    measured: Measured,
    /// The largest force that it makes at any row, N.
    peak: f64,
    /// The same at the end of the 95 % interval that is further from none, N.
    at_most: f64,
}

/// What a closed valve says of a leak.
struct LeakCheck {
    loss: Loss,
    /// The largest force that the leak takes at any row, N: at the least, and at the most.
    at_least: f64,
    at_most: f64,
    finding: Leak,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Leak {
    /// It cannot matter.
    Absent,
    /// It may matter.
    Possible,
    /// It matters, with any line.
    Present,
}

impl LeakCheck {
    /// Enters what the closed valve showed into an answer of the recordings. A leak that matters is named also where the recordings do not
    /// determine its size: then it has no parameters, and stays out of the table.
    fn enter(&self, diagnosis: &mut Diagnosis, given: &[Law]) {
        let Some(leak) = Law::all().find(|c| c.traits().loses_air) else { return };
        let (check, value) = (Loss::CHECK.to_string(), self.loss.words());
        let info = leak.info();
        let named = diagnosis.missing.iter().any(|m| m.effect == info.name);
        match self.finding {
            Leak::Absent if !given.contains(&leak) => diagnosis.considered.push(Considered {
                effect: info.name.into(),
                gain: 0.0,
                why_not: WhyNot::Measured { check, value },
                hidden_up_to_N: Some(self.at_most),
                checked: true,
                visible: 1.0,
            }),
            Leak::Present if diagnosis.judged() && !named => {
                diagnosis.considered.retain(|c| c.effect != info.name);
                diagnosis.missing.push(Missing {
                    checked: true,
                    peak_N: self.at_least,
                    p: (self.loss.half_width / self.loss.rate).powi(2).min(1.0),
                    ..Missing::of(info, CHECKED_PROBABILITY, Why::Measured { check, value })
                });
                if diagnosis.verdict() == Verdict::Consistent {
                    diagnosis.outcome = Outcome::Judged(Verdict::Explained);
                }
            }
            _ => diagnosis.remarks.push(Remark::Measured { check, value }),
        }
    }
}

/// What checks of the bench measured.
pub(super) struct BenchChecks {
    named: Vec<Judged>,
    absent: Vec<Judged>,
    /// Faults that a check shows, and that the recordings decide on.
    likely: Vec<Measured>,
    leak: Option<LeakCheck>,
    /// The recordings as they were read, with one bladder for all pressures; only where something is named.
    before: Option<(Rows, Baseline)>,
}

impl BenchChecks {
    /// Compares what checks measured with the recordings.
    pub(super) fn of(checks: &Checks, campaign: &Campaign, braid: &Braid<f64>) -> Result<Self> {
        let mut known =
            Self { named: Vec::new(), absent: Vec::new(), likely: Vec::new(), leak: None, before: None };
        if checks.is_empty() {
            return Ok(known);
        }
        let (rows, fitted) = one_bladder(campaign, None, braid)?;
        let rows = baselines::linearised(&rows, &fitted);
        let blocked = rows.force.iter().copied().fold(0.0, f64::max);
        let material = |force: f64| force >= MATERIAL_FAULT * blocked;
        for measured in checks.measured() {
            let peak = |parameters: &[f64]| {
                let trace = Law::Bench(measured.fault).trace(rows.contexts(), parameters, &mut [0.0; MEMORY]);
                let counts = trace.iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0);
                counts.map(|(f, _)| f.abs()).fold(0.0, f64::max)
            };
            let further: Vec<f64> = measured
                .parameters
                .iter()
                .enumerate()
                .map(|(at, v)| v + measured.half_width(at).copysign(*v))
                .collect();
            let judged = Judged {
                measured: measured.clone(),
                peak: peak(&measured.parameters),
                at_most: peak(&further),
            };
            let sure = judged.measured.is_sure();
            if !material(judged.peak) || !(sure || judged.measured.is_likely()) {
                known.absent.push(judged);
            } else if sure && judged.measured.fault != BenchName::Backlash {
                known.named.push(judged);
            } else {
                // The recordings decide where chance could still be the cause, and on a play, which cannot be removed from a reading.
                known.likely.push(judged.measured);
            }
        }
        known.leak = checks.loss().map(|loss| {
            let (least, most) = loss.lost_part();
            let pull = rows
                .contexts()
                .iter()
                .map(|c| (c.pull_per_pressure() * c.pressure).abs())
                .fold(0.0, f64::max);
            let finding = if !material(most * pull) {
                Leak::Absent
            } else if material(least * pull) {
                Leak::Present
            } else {
                Leak::Possible
            };
            LeakCheck { loss: loss.clone(), at_least: least * pull, at_most: most * pull, finding }
        });
        if !known.named.is_empty() {
            known.before = Some((rows, fitted));
        }
        Ok(known)
    }

    /// The recordings, corrected for the faults that were measured.
    pub(super) fn free<'a>(&self, campaign: &'a Campaign) -> Cow<'a, Campaign> {
        if self.named.is_empty() {
            return Cow::Borrowed(campaign);
        }
        let faults: Vec<Measured> = self.named.iter().map(|j| j.measured.clone()).collect();
        Cow::Owned(checks::freed(campaign, &faults))
    }

    /// Whether the corrected stroke follows the force, as the muscle does in a frame that gives.
    pub(super) fn corrects_the_stroke(&self) -> bool {
        self.named.iter().any(|j| j.measured.fault == BenchName::RigCompliance)
    }

    /// Whether a check of the bench settles an effect, so that the recordings need not.
    ///
    /// An effect that the user gives as known is fitted even where a check found it immaterial.
    pub(super) fn settles(&self, candidate: &Candidate, given: &[Law]) -> bool {
        let is = |j: &Judged| candidate.is(Law::Bench(j.measured.fault));
        let tight =
            candidate.traits.loses_air && self.leak.as_ref().is_some_and(|l| l.finding == Leak::Absent);
        let excluded = tight || self.absent.iter().any(is);
        self.named.iter().any(is) || (!given.iter().any(|g| candidate.is(*g)) && excluded)
    }

    /// Whether a check shows an effect, whose size follows from the recordings.
    pub(super) fn shows(&self, candidate: &Candidate) -> bool {
        let leak =
            candidate.traits.loses_air && self.leak.as_ref().is_some_and(|l| l.finding == Leak::Present);
        leak || self.likely.iter().any(|m| candidate.is(Law::Bench(m.fault)))
    }

    /// Enters the measured faults into the answer that was found without them, with the kind of its last baseline.
    pub(super) fn enter(
        self,
        (mut diagnosis, kind): (Diagnosis, Kind),
        given: &[Law],
        (freed, as_read): (&Campaign, Option<&Campaign>),
        braid: &Braid<f64>,
    ) -> Result<Diagnosis> {
        for j in self.absent.iter().filter(|j| !given.contains(&Law::Bench(j.measured.fault))) {
            diagnosis.considered.push(Considered {
                effect: j.measured.fault.info().name.into(),
                gain: 0.0,
                why_not: WhyNot::Measured {
                    check: j.measured.check.to_string(),
                    value: j.measured.words.to_string(),
                },
                hidden_up_to_N: Some(j.at_most),
                checked: true,
                visible: 1.0,
            });
        }
        diagnosis.remarks.extend(
            self.likely
                .iter()
                .map(|m| Remark::Measured { check: m.check.to_string(), value: m.words.to_string() }),
        );
        if let Some(l) = &self.leak {
            l.enter(&mut diagnosis, given);
        }
        if !diagnosis.judged() {
            // The fault is known all the same; its share of these recordings is not.
            let words = self.named.iter().map(|j| Remark::Measured {
                check: j.measured.check.to_string(),
                value: j.measured.words.to_string(),
            });
            diagnosis.remarks.extend(words);
            return Ok(diagnosis);
        }
        let Some((rows, before)) = self.before else { return Ok(diagnosis) };
        let (freed_rows, after) = one_bladder(freed, as_read, braid)?;
        let (was, is) = (before.per_row(&rows), after.per_row(&freed_rows));
        let noise = diagnosis.noise_N.powi(2);
        let share =
            ((was - is) / (was - noise).max(CHECK_RESOLUTION * was).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        for m in &mut diagnosis.missing {
            m.share_explained *= 1.0 - share;
        }
        diagnosis.unexplained.share *= 1.0 - share;
        let all: f64 = self.named.iter().map(|j| j.peak * j.peak).sum();
        let entries = self.named.iter().map(|j| Missing {
            given: given.contains(&Law::Bench(j.measured.fault)),
            ..missing(j, share * j.peak * j.peak / all.max(1e-300))
        });
        for entry in entries {
            // Sorted by peak force, whether a check or the recordings found it.
            let at = diagnosis.missing.iter().position(|m| m.peak_N < entry.peak_N);
            diagnosis.missing.insert(at.unwrap_or(diagnosis.missing.len()), entry);
        }
        let step = |j: &Judged| PathStep {
            effect: j.measured.fault.info().name.into(),
            rms_N: is.sqrt(),
            held_out_rms_N: None,
            p: chance(&j.measured),
            runners_up: Vec::new(),
        };
        diagnosis.path.splice(0..0, self.named.iter().map(step));
        diagnosis.misfit_rms_N = baselines::fit(&rows, Kind::Flexible(TABLE_ORDER), &[]).rms(&rows);
        let unseen = HeldOutRows::new(&rows, kind, &[]).held_out(&[], diagnosis.noise_N);
        // Selected effects may need another split, whose errors are not comparable with this one's.
        if unseen.split == diagnosis.held_out.split {
            diagnosis.held_out.rms_before_N = unseen.rms_before_N;
            diagnosis.held_out.with_turns_before_N = unseen.with_turns_before_N;
        }
        if diagnosis.verdict() == Verdict::Consistent {
            diagnosis.outcome = Outcome::Judged(Verdict::Explained);
            if rows.len() == freed_rows.len() {
                (diagnosis.r#where, diagnosis.profiles) =
                    locate(&rows, &before.residual, &after.residual, diagnosis.noise_N, 7);
            }
        }
        Ok(diagnosis)
    }
}

/// Recordings with one bladder for all pressures; of corrected ones, with the readings as they were.
fn one_bladder(
    campaign: &Campaign,
    as_read: Option<&Campaign>,
    braid: &Braid<f64>,
) -> Result<(Rows, Baseline)> {
    let (rows, _) = rows::prepare_corrected(campaign, as_read, braid)?;
    let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
    let (rows, _) = baselines::without_slack(&rows, &fitted);
    let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
    Ok((rows, fitted))
}

/// The probability that a value is zero and its deviation chance, by Chebyshev's inequality, which assumes no distribution.
fn chance(measured: &Measured) -> f64 {
    let worst = measured
        .parameters
        .iter()
        .zip(&measured.deviations)
        .filter_map(|(v, std)| std.map(|s| (s / v.abs().max(1e-300)).powi(2)));
    worst.fold(0.0, f64::max).min(1.0)
}

fn missing(judged: &Judged, share: f64) -> Missing {
    let Judged { measured, peak, .. } = judged;
    let info = measured.fault.info();
    let values = measured.parameters.iter().zip(&measured.deviations);
    let parameters = info.parameters.iter().zip(values);
    let why = Why::Measured { check: measured.check.to_string(), value: measured.words.to_string() };
    Missing {
        share_explained: share,
        parameters: parameters.map(|(p, (value, std))| ParameterValue::of(p, *value, *std)).collect(),
        correction: true,
        checked: true,
        peak_N: *peak,
        p: chance(measured),
        ..Missing::of(info, CHECKED_PROBABILITY, why)
    }
}
