//! What a step is expected to tell, per second: about the table, about which effect it is, and about effects that nothing has shown yet.
//!
//! ```text
//! table    Σ ½ ln((s² + δ²)/(s₁² + δ²))      s²: predicted variance of the force on unseen pressures and strokes, before and after
//! effects  H(π) − E[H(π | step)],  E[H] ≈ Σ_h π_h ln Σ_h' (π_h'/π_h) exp(−d²_hh'/8)      h: none, and each effect in turn
//! ```
//! `δ` is the target error; `d²_hh'` the squared distance, in noise variances, of the force under effect h from the nearest force that the
//! tables and effect h' can imitate, over everything recorded so far and the step. `exp(−d²/8)` is the Bhattacharyya coefficient of two
//! normal distributions (K. Chaloner and I. Verdinelli, Statist. Sci. 10 (1995) 273, doi 10.1214/ss/1177009939, for designs of this kind).

mod past;
mod seen;

use model_core::muscle::Muscle;
use nalgebra::DMatrix;
use pam_data::recording::Recording;
use pam_fit::bench::Candidate;

use self::past::Past;
use self::seen::{Seen, View};
use crate::columns::{Library, Table};
use crate::course::Course;
use crate::criteria::{EFFECT_SIZE, PAST_ROWS, PRIOR_NOTHING, SAMPLE_HZ, WANTED_ERROR};
use crate::hypothesis::{DECIDED, Hypothesis, entropy};
use crate::left_over::Image;
use crate::places::Places;
use crate::step::{CheckKind, Step};

/// Time between two steps that a design assumes, s.
const PAUSE_S: f64 = 10.0;

/// What is known when a step is chosen.
#[derive(Debug, Clone)]
pub struct Knowledge<'a> {
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
    pub checked: &'a [CheckKind],
}

/// What a step is expected to tell, nats.
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
pub struct Design<'a> {
    known: Knowledge<'a>,
    table: Table,
    library: Library,
    /// What the past gives to every candidate; nothing without rows.
    shared: Option<Past>,
}

impl<'a> Design<'a> {
    /// Prepares what all candidates share.
    #[must_use]
    pub fn new(known: Knowledge<'a>, places: &Places) -> Self {
        Self::with_rows(known, places, PAST_ROWS)
    }

    fn with_rows(known: Knowledge<'a>, places: &Places, most: usize) -> Self {
        let table = Table::new(known.model, known.levels, known.blocked, places);
        let library = Library::new(known.sets);
        let shared = Past::of(&known, &table, &library, most);
        Self { known, table, library, shared }
    }

    /// What a step is expected to tell.
    #[must_use]
    pub fn gain(&self, step: &Step, places: &Places) -> Gain {
        if let Step::Check { check } = step {
            return self.of_check(*check);
        }
        let begin = self.shared.as_ref().map_or(0.0, |past| past.end);
        let step = expected(&step.course(places), begin, "step");
        Seen::of(self, Some(step)).map_or_else(Gain::default, |seen| self.compare(&seen))
    }

    /// What is known now: the predicted error of the table, N, and the expected entropy of the set if each effect in turn were there.
    #[must_use]
    pub fn now(&self) -> (f64, Vec<f64>) {
        let Some(seen) = Seen::of(self, None) else { return (f64::INFINITY, Vec::new()) };
        (rms(&seen.before.errors), self.doubts(&seen.before, &seen, &[]))
    }

    fn of_check(&self, check: CheckKind) -> Gain {
        let settles = |law: Candidate| law.traits().check.and_then(CheckKind::of) == Some(check);
        let mut gain = Gain::default();
        for set in self.known.sets {
            let apart = |i: usize, j: usize| {
                if settles(set[i].law) || settles(set[j].law) { DECIDED } else { 0.0 }
            };
            gain.set += entropy(set, |_, _| 0.0) - entropy(set, apart);
        }
        if let Some(seen) = Seen::of(self, None) {
            gain.error_before = rms(&seen.before.errors);
            gain.error_after = gain.error_before;
            let doubts = |more: &[CheckKind]| self.doubts(&seen.before, &seen, more);
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
        let wanted = (WANTED_ERROR * self.known.blocked).powi(2);
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
    fn doubts(&self, view: &View, seen: &Seen<'_>, more: &[CheckKind]) -> Vec<f64> {
        let (m, left) = (self.table.len(), &view.left);
        let size = (EFFECT_SIZE * self.known.blocked).powi(2);
        let settled = |law: Candidate| {
            let check = law.traits().check.and_then(CheckKind::of);
            self.in_sets(law) || check.is_some_and(|c| self.known.checked.contains(&c) || more.contains(&c))
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
        let checked = |h: &Hypothesis| {
            h.law.traits().check.and_then(CheckKind::of).is_some_and(|c| self.known.checked.contains(&c))
        };
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

/// The recording that is expected of a course after a time, s: where the muscle follows.
pub(crate) fn expected(course: &Course, after: f64, name: &str) -> Recording {
    let (time, pressure, stroke) = course.samples(after + PAUSE_S, SAMPLE_HZ);
    Recording { name: name.to_owned(), time, pressure, stroke, ..Recording::default() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

    use virtual_bench::{bench::BenchSpec, presets};

    use super::*;
    use crate::bench::VirtualBench;
    use crate::campaign::simulate;
    use crate::columns::work;
    use crate::criteria::STEP_ROWS;
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
    #[test]
    fn fast_strokes_of_the_past_keep_their_speed_however_few_rows_count() {
        let spec = BenchSpec::laboratory(presets::miniature(), 1);
        let muscle = pam_data::muscle_description::MuscleDescription::parse(&spec.muscle.description());
        let mut engine = Engine::new(muscle.unwrap(), Rig::commanded(), Purpose::Fit, 120.0).unwrap();
        simulate(&mut engine, &mut VirtualBench::new(&spec), None).unwrap();
        let (places, levels) = (engine.places(), engine.places().levels());
        let strokes = Step::Loops { level: levels[3], times: 16.0, count: 20 }.course(places);
        let viscous = |past: &[Recording], most: usize| {
            let known = Knowledge {
                model: &engine.findings().unwrap().model,
                past,
                levels: &levels,
                sigma: 0.1,
                independent_s: 10.0,
                blocked: places.blocked,
                sets: &[],
                checked: &[],
            };
            let design = Design::with_rows(known, places, most);
            let at = design.library.index(Candidate::from_name("viscous-damping").unwrap()).unwrap();
            let past = design.shared.as_ref().unwrap();
            let column = past.places[at].shapes[0][0];
            past.gram[(column, column)]
        };
        let full = expected(&strokes, 0.0, "fast");
        let all = viscous(std::slice::from_ref(&full), usize::MAX);
        let few = viscous(std::slice::from_ref(&full), full.len() / 17);
        assert!((few / all - 1.0).abs() < 0.2, "{few} {all}");
        // Rows that are left out before the motion is followed take the strokes with them.
        let pick = |v: &[f64]| v.iter().copied().step_by(17).collect::<Vec<f64>>();
        let (time, pressure, stroke) = (pick(&full.time), pick(&full.pressure), pick(&full.stroke));
        let thinned = Recording { time, pressure, stroke, ..Recording::default() };
        assert!((viscous(&[thinned], usize::MAX) / all - 1.0).abs() > 0.4);
    }
}
