//! A plan without hardware: which steps to record next, best first, from recordings that exist.

use std::path::PathBuf;

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Recording;
use pam_fit::checks;

use super::{CLOSING, Engine};
use crate::analysis::fitted;
use crate::criteria::HANDLING_S;
use crate::information::{Gain, expected};
use crate::menu::opening;
use crate::purpose::Purpose;
use crate::rig::Rig;
use crate::step::Step;
use crate::wording;

/// One step of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// The step.
    pub step: Step,
    /// Why, in one sentence.
    pub why: String,
    /// Expected information after those before it, nats.
    pub gain: Gain,
    /// Bench time, s.
    pub seconds: f64,
}

/// A plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Steps in the order of recording: each has the most information per second after those before it.
    pub steps: Vec<PlannedStep>,
    /// Why it ends there, in one sentence.
    pub ends: String,
    /// Predicted standard error of the table before any of them, N; absent without a table.
    pub error: Option<f64>,
}

impl Engine {
    /// What recordings that exist already show: of any protocol, made by anyone.
    ///
    /// # Errors
    /// See [`Engine::new`] and [`Engine::diagnose`].
    pub fn of_recordings(
        muscle: MuscleDescription,
        mut rig: Rig,
        purpose: Purpose,
        recordings: Vec<Recording>,
        checks: Vec<(checks::Kind, PathBuf)>,
    ) -> Result<Self> {
        if muscle.max_pressure().is_none() && rig.pressure_max_kpa.is_none() {
            // What was recorded was allowed.
            let highest = recordings.iter().flat_map(|r| &r.pressure).copied().fold(0.0, f64::max);
            rig.pressure_max_kpa = (highest > 0.0).then_some(highest * 1e-3);
        }
        let mut engine = Self::new(muscle, rig, purpose, f64::INFINITY)?;
        engine.handling_s = HANDLING_S;
        for recording in &recordings {
            engine.places.learn_strokes(recording);
        }
        engine.recordings = recordings;
        for (check, file) in checks {
            engine.add_check(check, file);
        }
        if engine.recordings.is_empty() {
            return Ok(engine);
        }
        if let Some(findings) = fitted(&engine.recordings, &engine.muscle) {
            engine.places.learn_stroke_of(&findings.model);
            engine.places.learn_model(findings.model.clone());
            engine.findings = Some(findings);
        }
        if purpose != Purpose::Fit {
            engine.diagnose()?;
        }
        Ok(engine)
    }

    /// The steps that are worth recording next, at most this number and within this bench time.
    #[must_use]
    pub fn plan(&self, most: usize, budget_s: f64) -> Plan {
        let mut left = budget_s - self.seconds(&CLOSING);
        if self.findings.is_none() {
            return self.first_plan(most, left);
        }
        let mut plan = Plan { steps: Vec::new(), ends: wording::plan_is_full(most), error: None };
        let mut made: Vec<(Step, Option<Recording>)> = Vec::new();
        while plan.steps.len() < most {
            let ranking = self.rank(left, &made);
            plan.error = plan.error.or(ranking.error);
            if ranking.settled && made.is_empty() {
                plan.ends = wording::settled(self.diagnosis.as_ref(), self.purpose);
                break;
            }
            let Some(best) = ranking.steps.first() else {
                plan.ends = if left < self.shortest() {
                    wording::time_is_over(budget_s)
                } else {
                    wording::NOTHING_MORE.into()
                };
                break;
            };
            let begin = self.recordings.iter().chain(made.iter().filter_map(|m| m.1.as_ref()));
            let begin = begin.filter_map(|r| r.time.last()).copied().fold(0.0, f64::max);
            let recording = expected(&best.step.profile(&self.places), begin, &best.step.name());
            made.push((best.step, Some(recording).filter(|r| !r.is_empty())));
            left -= best.seconds;
            plan.steps.push(PlannedStep {
                step: best.step,
                why: wording::why_with_gain(&self.reason(&best.step, &best.gain), &best.gain),
                gain: best.gain,
                seconds: best.seconds,
            });
        }
        if plan.steps.last().is_some_and(|p| p.step != CLOSING) {
            plan.steps.push(PlannedStep {
                step: CLOSING,
                why: wording::CLOSING.to_owned(),
                gain: Gain::default(),
                seconds: self.seconds(&CLOSING),
            });
        }
        plan
    }

    /// Before there is a table: the first steps of every campaign, then the menu in its order.
    fn first_plan(&self, most: usize, mut left: f64) -> Plan {
        let mut steps = Vec::new();
        let first = opening(&self.rig).into_iter().map(|(step, why)| (step, why.to_owned()));
        // How long other steps take follows from the free stroke, which the first ones show.
        let further = if self.recordings.is_empty() { 0.0 } else { left };
        let rest = self.rank(further, &[]).steps.into_iter().map(|w| (w.step, wording::NO_TABLE.to_owned()));
        for (step, why) in first.chain(rest) {
            let seconds = self.seconds(&step);
            let known = steps.iter().any(|p: &PlannedStep| p.step.name() == step.name());
            if steps.len() < most && seconds <= left && !known {
                left -= seconds;
                steps.push(PlannedStep { step, why, gain: Gain::default(), seconds });
            }
        }
        Plan { steps, ends: wording::PLAN_AGAIN.to_owned(), error: None }
    }
}
