//! Chooses the next step from what is known, and learns from what was recorded.

mod plan;
mod ranking;

use std::path::PathBuf;
use std::time::Instant;

use pam_data::error::Result;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Recording;
use pam_diagnose::Diagnosis;
use pam_fit::checks;

pub use self::plan::{Plan, PlannedStep};
pub use self::ranking::{Ranking, Weighed};
use crate::analysis::{Findings, diagnosed, fitted, names};
use crate::criteria::{DIAGNOSE_EVERY, DIAGNOSE_FROM, FIT_FROM};
use crate::information::Gain;
use crate::journal::Chosen;
use crate::menu::{menu, opening};
use crate::places::Places;
pub use crate::purpose::Purpose;
use crate::rig::Rig;
use crate::step::Step;
use crate::watch::Spoiled;
use crate::wording;

/// What to do next.
#[derive(Debug, Clone, PartialEq)]
pub enum Decision {
    /// Carry out this step.
    Step(Chosen),
    /// The campaign is complete; why, in one sentence.
    Stop(String),
}

/// The last tare of a campaign: without it a drift of the zero cannot be seen.
pub(crate) const CLOSING: Step = Step::Tare { seconds: 10.0 };

/// Everything that a decision depends on.
#[derive(Debug)]
pub struct Engine {
    muscle: MuscleDescription,
    rig: Rig,
    purpose: Purpose,
    budget_s: f64,
    places: Places,
    steps: Vec<Step>,
    left_out: Vec<Step>,
    recordings: Vec<Recording>,
    checks: Vec<(checks::Kind, PathBuf)>,
    findings: Option<Findings>,
    diagnosis: Option<Diagnosis>,
    since_diagnosis: usize,
    error: Option<f64>,
    /// Time that an operator needs for each step in addition to its own, s; none where the program carries it out.
    handling_s: f64,
}

impl Engine {
    /// Nothing recorded yet.
    ///
    /// # Errors
    /// See [`Places::new`].
    pub fn new(muscle: MuscleDescription, rig: Rig, purpose: Purpose, budget_s: f64) -> Result<Self> {
        let places = Places::new(&muscle, &rig)?;
        Ok(Self {
            muscle,
            rig,
            purpose,
            budget_s,
            places,
            steps: Vec::new(),
            left_out: Vec::new(),
            recordings: Vec::new(),
            checks: Vec::new(),
            findings: None,
            diagnosis: None,
            since_diagnosis: 0,
            error: None,
            handling_s: 0.0,
        })
    }

    /// The muscle's range as it is known now.
    #[must_use]
    pub fn places(&self) -> &Places {
        &self.places
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The muscle's description.
    #[must_use]
    pub fn muscle(&self) -> &MuscleDescription {
        &self.muscle
    }

    /// Everything recorded so far.
    #[must_use]
    pub fn recordings(&self) -> &[Recording] {
        &self.recordings
    }

    /// The steps that were made, in order.
    #[must_use]
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The fit of it, as soon as there is one.
    #[must_use]
    pub fn findings(&self) -> Option<&Findings> {
        self.findings.as_ref()
    }

    /// The last diagnosis.
    #[must_use]
    pub fn diagnosis(&self) -> Option<&Diagnosis> {
        self.diagnosis.as_ref()
    }

    /// Predicted standard error of the table on unseen pressures and strokes, N, as of the last choice.
    #[must_use]
    pub fn predicted_error(&self) -> Option<f64> {
        self.error
    }

    /// Budget of bench time, s.
    #[must_use]
    pub fn budget(&self) -> f64 {
        self.budget_s
    }

    /// What to do next, after so much bench time.
    ///
    /// # Errors
    /// What a diagnosis fails with.
    pub fn next(&mut self, spent_s: f64) -> Result<Decision> {
        let begun = Instant::now();
        let closing = CLOSING.seconds(&self.places);
        let left = self.budget_s - spent_s - closing;
        let number = self.steps.len() as u32 + self.left_out.len() as u32 + 1;
        let chosen = |step: Step, why: String, gain: Gain, expected_s: f64| {
            Decision::Step(Chosen {
                number,
                step,
                why,
                table_nats: gain.table,
                effect_nats: gain.set,
                unseen_nats: gain.unseen,
                predicted_error: gain.error_before,
                expected_s,
                choosing_s: begun.elapsed().as_secs_f64(),
            })
        };
        for (step, why) in opening(&self.rig) {
            let kind = |s: &Step| s.name();
            let done = self.steps.iter().chain(&self.left_out).any(|s| kind(s) == kind(&step));
            // How long it takes is known only when the free stroke is; without these steps nothing else can be chosen.
            if !done && left > 0.0 {
                let seconds = step.seconds(&self.places);
                return Ok(chosen(step, why.to_owned(), Gain::default(), seconds));
            }
        }
        let Ranking { steps, settled, error } = self.rank(left, &[]);
        self.error = error.or(self.error);
        let best = steps.into_iter().next();
        let closed = matches!(self.steps.last(), Some(Step::Tare { .. }));
        let close = |reason: String| {
            if closed || left < 0.0 {
                Decision::Stop(reason)
            } else {
                chosen(CLOSING, wording::CLOSING.to_owned(), Gain::default(), closing)
            }
        };
        if settled {
            return Ok(close(wording::settled(self.diagnosis.as_ref(), self.purpose)));
        }
        Ok(match best {
            Some(Weighed { step, gain, seconds }) => chosen(step, self.reason(&step, &gain), gain, seconds),
            None if left < self.shortest() => close(wording::time_is_over(self.budget_s)),
            None => close(wording::NOTHING_MORE.to_owned()),
        })
    }

    /// The shortest step of the menu, s.
    fn shortest(&self) -> f64 {
        let steps = menu(&self.places, &self.rig).into_iter().map(|s| s.seconds(&self.places));
        steps.fold(f64::INFINITY, f64::min)
    }

    fn may_follow(&self, step: &Step) -> bool {
        if self.left_out.contains(step) {
            return false;
        }
        match step {
            Step::Check { check } => !self.checks.iter().any(|c| c.0 == *check),
            Step::Tare { .. } => !matches!(self.steps.last(), Some(Step::Tare { .. })),
            _ => true,
        }
    }

    /// Takes what a step recorded.
    pub fn add(&mut self, step: Step, recording: Option<Recording>) {
        self.steps.push(step);
        self.since_diagnosis += 1;
        let Some(recording) = recording else { return };
        match step {
            Step::BlockedRamp | Step::Staircase { part: 0.0, .. } => self.places.learn_ramp(&recording),
            Step::Survey { .. } => self.places.learn_survey(&recording),
            Step::Loops { .. } => self.places.learn_strokes(&recording),
            _ => {}
        }
        if self.places.by_hand && step.is_held_shortened() {
            self.places.learn_held(&recording);
        }
        self.recordings.push(recording);
    }

    /// Takes rows of an interrupted step: they are recordings like others, and the step is still to do.
    pub(crate) fn add_rows(&mut self, recording: Recording) {
        self.recordings.push(recording);
    }

    /// Takes that a recording was spoiled, which was made up to this stroke, m.
    pub fn spoiled(&mut self, step: &Step, reason: Spoiled, stroke: f64) {
        if reason == Spoiled::Slack && step.is_held_shortened() {
            self.places.learn_slack(stroke);
        }
    }

    /// Takes a check of the bench.
    pub(crate) fn add_check(&mut self, check: checks::Kind, file: PathBuf) {
        self.steps.push(Step::Check { check });
        self.checks.push((check, file));
        // It may settle everything.
        self.since_diagnosis = DIAGNOSE_EVERY;
    }

    /// Leaves a step out permanently.
    pub fn leave_out(&mut self, step: Step) {
        self.left_out.push(step);
    }

    /// Fits and, from time to time, diagnoses; states as text what the last step contributed.
    ///
    /// # Errors
    /// What a diagnosis fails with.
    pub fn learn(&mut self, spent_s: f64) -> Result<String> {
        let before = self.findings.as_ref().map(|f| f.fit.summary.deadband_kPa);
        self.fit();
        let mut finding = wording::table(before, self.findings.as_ref());
        let due = self.since_diagnosis >= DIAGNOSE_EVERY && spent_s >= DIAGNOSE_FROM;
        if due && self.purpose != Purpose::Fit && self.findings.is_some() {
            let earlier = self.diagnosis.as_ref().map(names);
            self.diagnose()?;
            if let Some(d) = &self.diagnosis {
                finding += &wording::diagnosis(earlier.as_deref(), d);
            }
        }
        Ok(finding)
    }

    /// Fits the table to everything recorded.
    pub fn fit(&mut self) {
        if self.recordings.len() < FIT_FROM {
            return;
        }
        if let Some(findings) = fitted(&self.recordings, &self.muscle) {
            self.places.learn_model(findings.model.clone());
            self.findings = Some(findings);
            self.agree();
        }
    }

    /// One blocked force for one campaign: that of the table.
    fn agree(&mut self) {
        if let (Some(diagnosis), Some(findings)) = (&mut self.diagnosis, &self.findings) {
            diagnosis.adopt_blocked_force(findings.fit.summary.blocked_force_N);
        }
    }

    /// Diagnoses everything recorded.
    ///
    /// # Errors
    /// Checks that cannot be read; recordings without rows.
    pub fn diagnose(&mut self) -> Result<()> {
        let files: Vec<PathBuf> = self.checks.iter().map(|c| c.1.clone()).collect();
        self.diagnosis = Some(diagnosed(&self.recordings, &self.muscle, &files)?);
        self.agree();
        self.since_diagnosis = 0;
        Ok(())
    }
}
