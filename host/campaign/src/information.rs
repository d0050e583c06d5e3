//! The information that a step is expected to give, per second: about the table, about which effect it is, and about effects that nothing has shown yet.
//!
//! ```text
//! table    Σ ½ ln((s² + δ²)/(s₁² + δ²))      s²: predicted variance of the force on unseen pressures and strokes, before and after
//! effects  H(π) − E[H(π | step)],  E[H] ≈ Σ_h π_h ln Σ_h' (π_h'/π_h) exp(−d²_hh'/8)      h: none, and each effect in turn
//! ```
//! `δ` is the target error; `d²_hh'` the squared distance, in noise variances, of the force under effect h from the nearest force that the
//! tables and effect h' can imitate, over everything recorded so far and the step. `exp(−d²/8)` is the Bhattacharyya coefficient of two
//! normal distributions (K. Chaloner and I. Verdinelli, Statist. Sci. 10 (1995) 273, doi 10.1214/ss/1177009939, for designs of this kind).

mod seen;

use model_core::effects::Context;
use model_core::muscle::Muscle;
use nalgebra::DMatrix;
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::protocol_simulation::moments;
use pam_fit::bench::{Candidate, Span};
use pam_fit::checks;

use self::seen::{Seen, View};
use crate::columns::{Library, Memories, RowsOf, Table, Where, columns_of_rows, layout};
use crate::criteria::{EFFECT_SIZE, PAST_ROWS, PRIOR_NOTHING, SAMPLE_HZ, STEP_ROWS, target_error};
use crate::hypothesis::{DECIDED, Hypothesis, entropy};
use crate::left_over::{Image, LeftOver};
use crate::places::Places;
use crate::step::Step;
use crate::step_profile::StepProfile;

/// Time between two steps that a design assumes, s.
const PAUSE_S: f64 = 10.0;

/// What is known when a step is chosen.
#[derive(Debug, Clone)]
pub(crate) struct Knowledge<'a> {
    /// The fitted model.
    pub model: &'a Muscle<f64>,
    /// Everything recorded so far.
    pub past: &'a [Recording],
    /// Pressures of the table, Pa.
    pub levels: &'a [f64],
    /// Noise of one independent reading of the force, N.
    pub sigma: f64,
    /// Time between readings that count as independent, s.
    pub independent_s: f64,
    /// Blocked force, N.
    pub blocked: f64,
    /// Sets of effects among which the diagnosis cannot decide; each holds a name that it gave, and those confusable with it.
    pub sets: &'a [Vec<Hypothesis>],
    /// Checks of the bench that were made.
    pub checked: &'a [checks::Kind],
}

/// The information that a step is expected to give, nats.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gain {
    /// About the table.
    pub table: f64,
    /// About which effect of the reported sets it is.
    pub set: f64,
    /// About effects that nothing has shown yet.
    pub unseen: f64,
    /// Predicted standard error of the table on unseen pressures and strokes after the step, N.
    pub error_after: f64,
    /// The same before it.
    pub error_before: f64,
}

impl Gain {
    /// Everything together.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.table + self.set + self.unseen
    }

    /// A share of it.
    #[must_use]
    pub fn divided(self, by: f64) -> Self {
        Self { table: self.table / by, set: self.set / by, unseen: self.unseen / by, ..self }
    }
}

/// The design that all candidates are judged on.
#[derive(Debug)]
pub(crate) struct Design<'a> {
    known: Knowledge<'a>,
    past: Vec<Recording>,
    table: Table,
    library: Library,
    /// What the past gives to every candidate; nothing without rows.
    shared: Option<Past>,
}

/// The columns of everything recorded so far, as products, and what the effects remember at its end. A candidate adds its own rows to it.
#[derive(Debug)]
struct Past {
    span: Span,
    places: Vec<Where>,
    memories: Memories,
    /// Products of weighted columns.
    gram: DMatrix<f64>,
    /// Largest value of each column.
    peak: Vec<f64>,
    /// What the table leaves of them.
    left: LeftOver,
}

impl<'a> Design<'a> {
    /// Prepares what all candidates share.
    #[must_use]
    pub fn new(known: Knowledge<'a>, places: &Places) -> Self {
        let rows: usize = known.past.iter().map(Recording::len).sum();
        let stride = rows.div_ceil(PAST_ROWS).max(1);
        let past = known.past.iter().map(|r| downsampled(r, stride)).collect();
        let table = Table::new(known.model, known.levels, known.blocked, places);
        let library = Library::new(known.sets);
        let mut design = Self { known, past, table, library, shared: None };
        design.shared = design.of_past();
        design
    }

    fn of_past(&self) -> Option<Past> {
        let campaign = Campaign::new(self.past.clone());
        let contexts: Vec<Context<f64>> = moments(self.known.model, &campaign);
        let span = Span::of(&contexts)?;
        let (places, mut memories) = layout(&self.table, &self.library, &span);
        let rows = columns_of_rows(&self.table, &self.library, &contexts, &places, &mut memories);
        let gram = self.products(&rows, &campaign.recordings);
        let left = LeftOver::of(&self.table, &gram)?;
        Some(Past { span, places, memories, gram, peak: rows.peak, left })
    }

    /// Products of columns over rows of these recordings, each row with its weight.
    fn products(&self, rows: &RowsOf, recordings: &[Recording]) -> DMatrix<f64> {
        let mut matrix = rows.matrix.clone();
        let weights = weights(recordings, self.known.independent_s);
        for (mut row, w) in matrix.row_iter_mut().zip(weights) {
            row *= w.sqrt() / self.known.sigma;
        }
        matrix.tr_mul(&matrix)
    }

    /// The information that a step is expected to give.
    #[must_use]
    pub fn gain(&self, step: &Step, places: &Places) -> Gain {
        if let Step::Check { check } = step {
            return self.of_check(*check);
        }
        let begin = self.past.iter().filter_map(|r| r.time.last()).copied().fold(0.0, f64::max);
        let step = simulated(&step.profile(places), begin + PAUSE_S);
        Seen::of(self, Some(step)).map_or_else(Gain::default, |seen| self.compare(&seen))
    }

    /// What is known now: the predicted error of the table, N, and the expected entropy of the set if each effect in turn were there.
    #[must_use]
    pub fn now(&self) -> (f64, Vec<f64>) {
        let Some(seen) = Seen::of(self, None) else { return (f64::INFINITY, Vec::new()) };
        (rms(&seen.before.errors), self.doubts(&seen.before, &seen, &[]))
    }

    fn of_check(&self, check: checks::Kind) -> Gain {
        let mut gain = Gain::default();
        for set in self.known.sets {
            let apart = |i: usize, j: usize| {
                if check.settles(set[i].law) || check.settles(set[j].law) { DECIDED } else { 0.0 }
            };
            gain.set += entropy(set, |_, _| 0.0) - entropy(set, apart);
        }
        if let Some(seen) = Seen::of(self, None) {
            gain.error_before = rms(&seen.before.errors);
            gain.error_after = gain.error_before;
            let doubts = |more: &[checks::Kind]| self.doubts(&seen.before, &seen, more);
            gain.unseen = self.share() * less(&doubts(&[]), &doubts(&[check]));
        }
        gain
    }

    /// Prior probability of one effect that nothing has shown.
    fn share(&self) -> f64 {
        (1.0 - PRIOR_NOTHING) / self.library.laws.len().max(1) as f64
    }

    fn in_sets(&self, law: Candidate) -> bool {
        self.known.sets.iter().flatten().any(|h| h.law == law)
    }

    fn compare(&self, seen: &Seen<'_>) -> Gain {
        let (old, new) = (&seen.before.errors, &seen.after.errors);
        let wanted = (target_error() * self.known.blocked).powi(2);
        let nats = |(a, b): (&f64, &f64)| 0.5 * ((a + wanted) / (b + wanted)).ln();
        let mean = old.iter().zip(new).map(nats).sum::<f64>() / old.len().max(1) as f64;
        let mut gain = Gain {
            // Each level of the table counts once.
            table: (self.known.levels.len() as f64 * mean).max(0.0),
            error_before: rms(old),
            error_after: rms(new),
            ..Gain::default()
        };
        for (s, set) in self.known.sets.iter().enumerate() {
            let old = self.distances(&seen.before, seen, s);
            let new = self.distances(&seen.after, seen, s);
            let (old, new) = (entropy(set, |i, j| old[(i, j)]), entropy(set, |i, j| new[(i, j)]));
            gain.set += (old - new).max(0.0);
        }
        let (old, new) = (self.doubts(&seen.before, seen, &[]), self.doubts(&seen.after, seen, &[]));
        gain.unseen = self.share() * less(&old, &new);
        gain
    }

    /// For each effect, the expected entropy of the set if it were present at the target size: among nothing and all others, whose sizes and
    /// shapes are free beside the table. Effects that a check of the bench settles are not competing candidates, and have none.
    fn doubts(&self, view: &View, seen: &Seen<'_>, more: &[checks::Kind]) -> Vec<f64> {
        let (m, left) = (self.table.len(), &view.left);
        let size = (EFFECT_SIZE * self.known.blocked).powi(2);
        let settled = |law: Candidate| {
            self.in_sets(law) || self.known.checked.iter().chain(more).any(|c| c.settles(law))
        };
        let open: Vec<usize> =
            (0..self.library.laws.len()).filter(|e| !settled(self.library.laws[*e].law)).collect();
        let place = |e: usize| seen.places[e].shapes.iter().map(|s| s.iter().map(|c| c - m));
        open.iter()
            .map(|&e| {
                let shapes =
                    place(e).filter_map(|s| s.max_by(|a, b| left[(*a, *a)].total_cmp(&left[(*b, *b)])));
                let mut sum = (0.0, 0);
                for i in shapes {
                    let own = left[(i, i)].max(0.0);
                    let mut odds = 1.0 + (-own * size / 8.0).exp();
                    for &other in open.iter().filter(|o| **o != e) {
                        let imitated = place(other)
                            .flatten()
                            .map(|j| left[(i, j)].powi(2) / left[(j, j)].max(1e-30))
                            .fold(0.0, f64::max);
                        odds += (-(own - imitated).max(0.0) * size / 8.0).exp();
                    }
                    sum = (sum.0 + odds.ln(), sum.1 + 1);
                }
                sum.0 / f64::from(sum.1.max(1))
            })
            .collect()
    }

    /// Squared distances of each effect of a set from each other one, whose size and shape are free.
    fn distances(&self, view: &View, seen: &Seen<'_>, set: usize) -> DMatrix<f64> {
        let effects = &self.known.sets[set];
        let checked = |h: &Hypothesis| self.known.checked.iter().any(|c| c.settles(h.law));
        let m = self.table.len();
        let ridge = 1.0 / (self.known.blocked * self.known.blocked);
        let shapes: Vec<Vec<Vec<usize>>> = effects
            .iter()
            .map(|h| {
                let place = self.library.index(h.law).map(|e| &seen.places[e]);
                let shown = |shape: &Vec<usize>| {
                    shape.iter().map(|c| c - m).filter(|c| seen.peak[*c] > 0.0).collect()
                };
                place.iter().flat_map(|p| &p.shapes).map(shown).collect()
            })
            .collect();
        let images = seen.traces[set].iter().map(|trace| Image::of(&view.left, trace));
        let images: Vec<Image> = images.collect();
        DMatrix::from_fn(effects.len(), effects.len(), |i, j| {
            if i == j {
                return 0.0;
            }
            if checked(&effects[i]) || checked(&effects[j]) {
                return DECIDED;
            }
            let nearest = shapes[j].iter().filter_map(|shape| images[i].distance(&view.left, shape, ridge));
            let least = nearest.fold(f64::INFINITY, f64::min);
            if least.is_finite() { least } else { 0.0 }
        })
    }
}

fn rms(variances: &[f64]) -> f64 {
    (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt()
}

/// How much less doubt there is, over all effects; those that a check settles are no longer among them.
fn less(before: &[f64], after: &[f64]) -> f64 {
    (before.iter().sum::<f64>() - after.iter().sum::<f64>()).max(0.0)
}

/// Every nth row of a recording, without its force.
fn downsampled(recording: &Recording, stride: usize) -> Recording {
    let pick = |v: &[f64]| v.iter().copied().step_by(stride).collect::<Vec<f64>>();
    Recording {
        name: recording.name.clone(),
        time: pick(&recording.time),
        pressure: pick(&recording.pressure),
        stroke: pick(&recording.stroke),
        ..Recording::default()
    }
}

/// The recording that a profile makes where the muscle follows.
fn simulated(profile: &StepProfile, begin: f64) -> Recording {
    let (time, pressure, stroke) = profile.samples(begin, SAMPLE_HZ);
    let stride = time.len().div_ceil(STEP_ROWS).max(1);
    downsampled(&Recording { name: "step".into(), time, pressure, stroke, ..Recording::default() }, stride)
}

/// The recording that is expected of a profile after a time, s.
pub(crate) fn expected(profile: &StepProfile, after: f64, name: &str) -> Recording {
    Recording { name: name.to_owned(), ..simulated(profile, after + PAUSE_S) }
}

/// What each row counts: its share of the time between independent readings.
fn weights(recordings: &[Recording], independent_s: f64) -> Vec<f64> {
    recordings
        .iter()
        .flat_map(|r| {
            let step = r.duration() / r.len().saturating_sub(1).max(1) as f64;
            std::iter::repeat_n((step / independent_s.max(1e-3)).min(1.0), r.len())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

    use virtual_bench::{bench::BenchSpec, presets};

    use super::*;
    use crate::bench::VirtualBench;
    use crate::campaign::simulate;
    use crate::columns::work;
    use crate::engine::{Engine, Purpose};
    use crate::hypothesis::candidates;
    use crate::rig::Rig;

    /// Table factorizations and rows of columns that it costs to weigh one step beside a set of this number of names.
    fn cost_of_a_step(names: usize) -> (usize, usize) {
        let spec = BenchSpec::laboratory(presets::miniature(), 1);
        let muscle = pam_data::muscle_description::MuscleDescription::parse(&spec.muscle.description());
        let mut engine = Engine::new(muscle.unwrap(), Rig::commanded(), Purpose::Fit, 180.0).unwrap();
        simulate(&mut engine, &mut VirtualBench::new(&spec), None).unwrap();
        let of = |law: Candidate| Hypothesis { law, weight: 1.0 / names as f64, parameters: None };
        let set: Vec<Hypothesis> = candidates().into_iter().take(names).map(of).collect();
        let (levels, sets) = (engine.places().levels(), [set]);
        let known = Knowledge {
            model: &engine.findings().unwrap().model,
            past: engine.recordings(),
            levels: &levels,
            sigma: 0.1,
            independent_s: 10.0,
            blocked: engine.places().blocked,
            sets: &sets,
            checked: &[],
        };
        let design = Design::new(known, engine.places());
        let before = (work::FACTORIZED.get(), work::ROWS.get());
        let gain = design.gain(&Step::Speeds { level: levels[3] }, engine.places());
        assert!(gain.total() > 0.0 && (names < 2 || gain.set > 0.0), "{gain:?}");
        (work::FACTORIZED.get() - before.0, work::ROWS.get() - before.1)
    }

    #[test]
    fn weighing_a_step_costs_the_same_however_many_names_are_possible() {
        let (one, many) = (cost_of_a_step(1), cost_of_a_step(20));
        assert_eq!((one.0, many.0), (1, 1));
        assert!(one.1 > 0 && one.1 <= STEP_ROWS && many.1 == one.1, "{one:?} {many:?}");
    }
}
