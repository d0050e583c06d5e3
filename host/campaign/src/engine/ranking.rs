//! The steps of the menu by the information expected per second: one ranking for campaigns and for plans.

use std::borrow::Cow;

use pam_data::recording::Recording;
use pam_diagnose::experiment::BenchCheck;
use pam_fit::bench::Candidate;
use pam_fit::checks;
use rayon::prelude::*;

use super::Engine;
use crate::analysis::sets;
use crate::criteria::{INDEPENDENT_S, NAMED, SURE, WORTHWHILE_NATS, inexactness, target_error};
use crate::information::{Design, Gain, Knowledge};
use crate::menu::menu;
use crate::purpose::Purpose;
use crate::step::Step;
use crate::wording;

/// A step and its expected information.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighed {
    /// The step.
    pub step: Step,
    /// Expected information, nats.
    pub gain: Gain,
    /// Bench time that it takes, s.
    pub seconds: f64,
}

impl Weighed {
    /// Expected information per second of bench time, nats/s.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.gain.total() / self.seconds.max(1.0)
    }
}

/// The menu, ranked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ranking {
    /// Steps that are worth their time, best first.
    pub steps: Vec<Weighed>,
    /// Whether all targets are met.
    pub settled: bool,
    /// Predicted standard error of the table on unseen pressures and strokes, N; absent without a table.
    pub error: Option<f64>,
}

impl Engine {
    /// Ranks the steps that fit into the time left, as if `planned` had been made already: each with the recording that is expected of it.
    ///
    /// Before there is a table nothing can be ranked: then the steps that were not made come in the order of the menu.
    #[must_use]
    pub fn rank(&self, left_s: f64, planned: &[(Step, Option<Recording>)]) -> Ranking {
        // Weighing settles only what the diagnosis must have named: the recordings show every constant force at the tares.
        let settles = |law: Candidate| law.traits().check == Some(BenchCheck::Weighing);
        let open = self.diagnosis.as_ref().map(sets).unwrap_or_default();
        let constant_force = open.iter().flatten().any(|h| settles(h.law));
        let follows = |step: &Step| {
            if *step == (Step::Check { check: checks::Kind::Weighing }) && !constant_force {
                return false;
            }
            let again = match step {
                Step::Check { .. } => planned.iter().any(|p| p.0 == *step),
                Step::Tare { .. } => matches!(planned.last(), Some((Step::Tare { .. }, _))),
                _ => false,
            };
            !again && self.may_follow(step) && self.seconds(step) <= left_s
        };
        let steps: Vec<Step> = menu(&self.places, &self.rig).into_iter().filter(follows).collect();
        let Some(findings) = &self.findings else {
            let made = |s: &Step| self.steps.contains(s) || planned.iter().any(|p| p.0 == *s);
            let open = steps.into_iter().filter(|s| !made(s));
            let weighed = |step: Step| Weighed { step, gain: Gain::default(), seconds: self.seconds(&step) };
            return Ranking { steps: open.map(weighed).collect(), ..Ranking::default() };
        };
        let sets = match (&self.diagnosis, self.purpose) {
            (_, Purpose::Fit) | (None, _) => Vec::new(),
            (Some(d), _) => sets(d),
        };
        let blocked = self.places.blocked.max(1e-9);
        let (noise, memory) = self.diagnosis.as_ref().map_or((0.0, 0.0), |d| (d.noise_N, d.noise_memory_s));
        let noise = noise.max(findings.fit.summary.rms_N.min(0.01 * blocked));
        let levels = self.places.levels();
        let planned_checks = planned.iter().filter_map(|p| match p.0 {
            Step::Check { check } => Some(check),
            _ => None,
        });
        let checked: Vec<checks::Kind> = self.checks.iter().map(|c| c.0).chain(planned_checks).collect();
        let expected: Vec<Recording> = planned.iter().filter_map(|p| p.1.clone()).collect();
        let past = match expected.as_slice() {
            [] => Cow::Borrowed(self.recordings.as_slice()),
            expected => Cow::Owned([&self.recordings, expected].concat()),
        };
        let knowledge = Knowledge {
            model: &findings.model,
            past: &past,
            levels: &levels,
            sigma: noise.hypot(inexactness() * blocked),
            independent_s: INDEPENDENT_S.max(memory),
            blocked,
            sets: &sets,
            checked: &checked,
        };
        let design = Design::new(knowledge, &self.places);
        let (error, doubts) = design.now();
        let settled = self.settled(error, blocked, &doubts);
        let mut weighed: Vec<Weighed> = steps.par_iter().map(|s| self.weigh(s, planned, &design)).collect();
        weighed.retain(|w| w.gain.total() >= WORTHWHILE_NATS);
        // Stable: of equals the first of the menu, whose order is fixed.
        weighed.sort_by(|a, b| b.rate().total_cmp(&a.rate()));
        Ranking { steps: weighed, settled, error: Some(error) }
    }

    /// Bench time of a step, s; with the handling of an operator.
    pub(super) fn seconds(&self, step: &Step) -> f64 {
        step.seconds(&self.places) + self.handling_s
    }

    fn weigh(&self, step: &Step, planned: &[(Step, Option<Recording>)], design: &Design<'_>) -> Weighed {
        let mut gain = design.gain(step, &self.places);
        match self.purpose {
            Purpose::Fit => (gain.set, gain.unseen) = (0.0, 0.0),
            Purpose::Diagnosis => gain.table = 0.0,
            Purpose::Both => {}
        }
        // A repeat averages noise, and leaves the inexactness of the model as it is.
        let made = self.steps.iter().chain(planned.iter().map(|p| &p.0));
        let repeats = made.filter(|s| *s == step).count() as f64;
        if !matches!(step, Step::Tare { .. }) {
            gain = gain.divided(1.0 + repeats);
        }
        Weighed { step: *step, gain, seconds: self.seconds(step) }
    }

    /// Whether all targets are met: the table's, and one name or none.
    fn settled(&self, error: f64, blocked: f64, doubts: &[f64]) -> bool {
        let table_known = error <= target_error() * blocked;
        let all_seen = doubts.iter().all(|d| *d < NAMED);
        let one_name = self.diagnosis.as_ref().is_some_and(|d| {
            d.judged() && d.missing.iter().all(|m| m.confusable_with.is_empty() && m.probability >= SURE)
        });
        match self.purpose {
            Purpose::Fit => table_known,
            Purpose::Diagnosis => one_name && all_seen,
            Purpose::Both => table_known && one_name && all_seen,
        }
    }

    /// Why a step of the ranking is worth its time, in one sentence.
    #[must_use]
    pub fn reason(&self, step: &Step, gain: &Gain) -> String {
        if self.findings.is_none() {
            return wording::NO_TABLE.to_owned();
        }
        wording::why(gain, self.diagnosis.as_ref(), step)
    }
}
