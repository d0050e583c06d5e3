//! The answer as plain values.

// Field names carry their unit as the JSON does: N is not n.
#![allow(non_snake_case)]

use model_core::effects::{Info, Link, Parameter};
use serde::Serialize;

use crate::criteria::judgement::{EXPLAINED, RELEVANT_SIZE};
pub use crate::experiment::Proposal;
pub use crate::outcome::{Outcome, Pattern, Split, Verdict};
pub use crate::remark::Remark;
pub use crate::why::Why;
pub use crate::why_not::WhyNot;
use pam_fit::beginning::Beginning;

/// Where the misfit's energy above the noise is concentrated along one coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Its name, one of those in the interface.
    pub coordinate: String,
    /// From this value, in `unit`.
    pub from: f64,
    /// To this value.
    pub to: f64,
    /// Share of the misfit's energy above noise that lies there.
    pub share: f64,
    /// Share of the rows that lie there.
    pub rows: f64,
    /// How often whole blocks, shuffled, concentrate as much.
    pub p: f64,
    /// Unit of `from` and `to`.
    pub unit: String,
    /// What the recordings from `from` to `to` are called, where the coordinate is their number.
    pub recordings: Vec<String>,
}

/// One parameter of a named effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterValue {
    /// Its name.
    pub name: String,
    /// Its value, SI.
    pub value: f64,
    /// Its standard deviation, by what groups of rows make of it and how inexact laws are; absent where the data do not determine it.
    pub std: Option<f64>,
    /// Its SI unit.
    pub unit: String,
    /// Whether the value lies outside the range known from the literature.
    pub outside_known_range: bool,
}

impl ParameterValue {
    /// A parameter of the catalogue with its value and standard deviation, SI.
    pub(crate) fn of(parameter: &Parameter, value: f64, std: Option<f64>) -> Self {
        Self {
            name: parameter.name.into(),
            value,
            std,
            unit: parameter.unit.into(),
            outside_known_range: Self::is_outside(value, parameter),
        }
    }

    /// Whether a value lies outside what the literature knows; one that is not used does not.
    #[must_use]
    pub(crate) fn is_outside(value: f64, parameter: &Parameter) -> bool {
        let (low, high) = (parameter.low, parameter.high);
        let too_small = value.abs() < low.abs().min(high.abs()) && low * high > 0.0;
        value != 0.0 && (value.abs() > parameter.largest() || too_small)
    }
}

/// An effect that is missing from the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// Its name in the catalogue.
    pub effect: String,
    /// How probable this name is: its model weight, calibrated where truths are known.
    pub probability: f64,
    /// Its weight among its competitors, before calibration.
    pub model_weight: f64,
    /// Share of the misfit's energy above noise that it explains.
    pub share_explained: f64,
    /// Its parameters.
    pub parameters: Vec<ParameterValue>,
    /// Effects that these data cannot distinguish from it.
    pub confusable_with: Vec<String>,
    /// Where it acts.
    pub place: Link,
    /// Whether it is the bench's: it corrects the data and never goes to a controller.
    pub correction: bool,
    /// Whether a check of the bench measured it, apart from the recordings.
    pub checked: bool,
    /// Whether the user gave it as known: then it was fitted without a test of the evidence, and its probability is one.
    pub given: bool,
    /// Whether the recordings support it, or a check of the bench; always so where it was not given.
    pub supported: bool,
    /// What it is, for a reader who does not know it.
    pub summary: String,
    /// Its equation and where it comes from.
    pub source: String,
    /// The largest force that it makes in these recordings, N.
    pub peak_N: f64,
    /// Probability of having found as much by chance over all effects tested, by whole blocks.
    pub p: f64,
    /// Why this one.
    pub why: Why,
}

impl Missing {
    /// An effect of the catalogue, named with this probability for a reason. It explains nothing and has no parameters yet; a muscle has it,
    /// not the bench.
    pub(crate) fn of(info: &Info, probability: f64, why: Why) -> Self {
        Self {
            effect: info.name.into(),
            probability,
            model_weight: probability,
            share_explained: 0.0,
            parameters: Vec::new(),
            confusable_with: Vec::new(),
            place: info.link,
            correction: false,
            checked: false,
            given: false,
            supported: true,
            summary: info.summary.into(),
            source: info.source.into(),
            peak_N: 0.0,
            p: 1.0,
            why,
        }
    }
}

/// What no named effect explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Unexplained {
    /// Share of the misfit's energy above noise.
    pub share: f64,
    /// Its pattern.
    pub pattern: Pattern,
    /// Effects that would remove much of the whole error, the one that removes the most first; see [`Diagnosis::unconfirmed`].
    pub unconfirmed: Vec<Unconfirmed>,
}

/// An effect that would remove much of an error, but no more than chance or slow noise could.
#[derive(Clone, Debug, PartialEq)]
pub struct Unconfirmed {
    /// Its name in the catalogue.
    pub effect: String,
    /// Share of the squared error that it would remove.
    pub share: f64,
    /// The numbers with which it would, in the law's order, SI.
    pub parameters: Vec<f64>,
}

/// The improvement on held-out rows.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// How rows were held out.
    pub split: Split,
    /// Error of the model without the effects, N.
    pub rms_before_N: f64,
    /// Error with them, N.
    pub rms_after_N: f64,
    /// The noise, N.
    pub noise_N: f64,
    /// The same two with the samples about each turn left in.
    pub with_turns_before_N: f64,
    /// Error with the effects, likewise, N.
    pub with_turns_after_N: f64,
}

/// The recording that would separate confusable effects.
#[derive(Clone, Debug, PartialEq)]
pub struct NextExperiment {
    /// What it separates.
    pub separates: Vec<String>,
    /// A protocol file that a bench can run.
    pub protocol: String,
    /// Largest expected difference between the candidates, N.
    pub expected_difference_N: f64,
    /// What is proposed.
    pub proposal: Proposal,
}

/// An effect that was considered.
#[derive(Clone, Debug, PartialEq)]
pub struct Considered {
    /// Its name.
    pub effect: String,
    /// Share of the misfit's energy above noise that it explains alone.
    pub gain: f64,
    /// Why it is not named.
    pub why_not: WhyNot,
    /// The largest peak, N, at which it could be hidden in this recording; absent where the recording does not excite it.
    pub hidden_up_to_N: Option<f64>,
    /// Whether a check of the bench has shown it, independently of the recordings.
    pub checked: bool,
    /// Share of its trace that the flexible tables cannot imitate.
    pub visible: f64,
}

impl Considered {
    /// Whether it could be hidden in these recordings at a size that matters, by the blocked force, N.
    #[must_use]
    pub fn could_be_hidden(&self, blocked: f64) -> bool {
        is_relevant(self.hidden_up_to_N, blocked)
    }
}

/// Whether the size, N, up to which an effect could be hidden is more than [`RELEVANT_SIZE`]; one without a limit is.
pub(crate) fn is_relevant(hidden: Option<f64>, blocked: f64) -> bool {
    hidden.is_none_or(|h| h > RELEVANT_SIZE * blocked)
}

/// One step of the forward selection.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathStep {
    /// The effect taken.
    pub effect: String,
    /// Root mean square of the misfit after it, N.
    pub rms_N: f64,
    /// Error on held-out rows with the effects up to this one, N; absent of one that a check of the bench measured.
    pub held_out_rms_N: Option<f64>,
    /// Family-wise p.
    pub p: f64,
    /// The next best at this step and their misfit, N.
    pub runners_up: Vec<(String, f64)>,
}

/// The misfit along one coordinate, for a picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Profile {
    /// The coordinate.
    pub coordinate: String,
    /// Its unit.
    pub unit: String,
    /// Middles of the bins.
    pub at: Vec<f64>,
    /// Mean residual before, N.
    pub mean_before: Vec<f64>,
    /// Root mean square residual before, N.
    pub rms_before: Vec<f64>,
    /// Root mean square residual after, N.
    pub rms_after: Vec<f64>,
}

/// A residual over time, downsampled for drawing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trace {
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// Before, N.
    pub before: Vec<f64>,
    /// After, N.
    pub after: Vec<f64>,
    /// What the named effects add, N.
    pub effects: Vec<f64>,
}

/// The whole diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// The muscle's name.
    pub muscle: String,
    /// Rows in the recordings.
    pub samples: usize,
    /// The judgement. Where nothing could be judged (too few rows, a dead sensor), nothing was fitted.
    pub outcome: Outcome,
    /// Noise, N.
    pub noise_N: f64,
    /// Misfit of the model as it was, N.
    pub misfit_rms_N: f64,
    /// Where it is concentrated.
    pub r#where: Vec<Region>,
    /// What is missing.
    pub missing: Vec<Missing>,
    /// The residual.
    pub unexplained: Unexplained,
    /// The improvement on held-out rows.
    pub held_out: HeldOut,
    /// What to record next.
    pub next_experiment: Option<NextExperiment>,
    /// All effects tested.
    pub considered: Vec<Considered>,
    /// The forward selection, step by step.
    pub path: Vec<PathStep>,
    /// Force at rest length and the highest pressure: the scale of all this, N.
    pub blocked_force_N: f64,
    /// Correlation time of the noise, s.
    pub noise_memory_s: f64,
    /// What can and cannot be concluded from these recordings.
    pub remarks: Vec<Remark>,
    /// For pictures.
    pub profiles: Vec<Profile>,
    /// For pictures.
    pub trace: Trace,
    /// How the recordings begin, for effects with a memory.
    pub beginning: Beginning,
    /// What the muscle remembers over a campaign of isometric staircases; absent of other campaigns.
    pub history: Option<super::history::History>,
}

impl Diagnosis {
    /// The effects that these recordings could hide at a size that matters, and that no check of the bench has excluded.
    pub fn could_hide(&self) -> impl Iterator<Item = &Considered> {
        self.considered.iter().filter(|c| !c.checked && c.could_be_hidden(self.blocked_force_N))
    }

    /// The share of the excess error that is explained, where it is less than the verdict "explained" asks: then the rest is small.
    #[must_use]
    pub fn explained_beside_small_rest(&self) -> Option<f64> {
        let explained = 1.0 - self.unexplained.share;
        (explained < EXPLAINED).then_some(explained)
    }

    /// Effects that would remove much of the error, where nothing is named.
    #[must_use]
    pub fn unconfirmed(&self) -> &[Unconfirmed] {
        let open = self.missing.is_empty() && self.verdict() == Verdict::Unexplained;
        if open { &self.unexplained.unconfirmed } else { &[] }
    }

    /// Whether there was anything to judge.
    #[must_use]
    pub fn judged(&self) -> bool {
        matches!(self.outcome, Outcome::Judged(_))
    }

    /// The judgement; consistent where there was nothing to judge.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        match self.outcome {
            Outcome::Judged(verdict) => verdict,
            Outcome::NotJudged(_) => Verdict::Consistent,
        }
    }

    /// Takes over the blocked force of the table that was fitted to the same campaign, N, so that a user meets one figure only.
    /// Changes nothing where there was nothing to judge.
    pub fn adopt_blocked_force(&mut self, fitted: f64) {
        if self.judged() {
            self.blocked_force_N = fitted;
        }
    }
}
