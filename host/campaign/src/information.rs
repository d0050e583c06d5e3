//! What a step is expected to tell, per second: about the table, about which effect it is, and about effects that nothing has shown yet.
//!
//! ```text
//! table    Σ ½ ln((s² + δ²)/(s₁² + δ²))      s²: predicted variance of the force on unseen pressures and strokes, before and after
//! effects  H(π) − E[H(π | step)],  E[H] ≈ Σ_h π_h ln Σ_h' (π_h'/π_h) exp(−d²_hh'/8)      h: none, and each effect in turn
//! ```
//! `δ` is the target error; `d²_hh'` the squared distance, in noise variances, of the force under effect h from the nearest force that the
//! tables and effect h' can imitate, over everything recorded so far and the step. `exp(−d²/8)` is the Bhattacharyya coefficient of two
//! normal distributions (K. Chaloner and I. Verdinelli, Statist. Sci. 10 (1995) 273, doi 10.1214/ss/1177009939, for designs of this kind).

use model_core::effects::Context;
use model_core::muscle::Muscle;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::protocol_simulation::moments;
use pam_fit::bench::{Candidate, Span};

use crate::columns::{Library, Memories, RowsOf, Table, Where, columns_of_rows, layout};
use crate::course::Course;
use crate::criteria::{EFFECT_SIZE, PAST_ROWS, PRIOR_NOTHING, SAMPLE_HZ, STEP_ROWS, WANTED_ERROR};
use crate::hypothesis::{DECIDED, Hypothesis, entropy};
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
}

impl<'a> Design<'a> {
    /// Prepares what all candidates share.
    #[must_use]
    pub fn new(known: Knowledge<'a>, places: &Places) -> Self {
        let rows: usize = known.past.iter().map(Recording::len).sum();
        let stride = rows.div_ceil(PAST_ROWS).max(1);
        let past = known.past.iter().map(|r| thinned(r, stride)).collect();
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
        Some(Past { span, places, memories, gram, peak: rows.peak })
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

    /// What a step is expected to tell.
    #[must_use]
    pub fn gain(&self, step: &Step, places: &Places) -> Gain {
        if let Step::Check { check } = step {
            return self.of_check(*check);
        }
        let begin = self.past.iter().filter_map(|r| r.time.last()).copied().fold(0.0, f64::max);
        let step = simulated(&step.course(places), begin + PAUSE_S);
        let Some(seen) = Seen::of(self, Some(step)) else { return Gain::default() };
        self.compare(&seen.before, &seen.after, &seen)
    }

    /// What is known now: the predicted error of the table, N, and the expected entropy of the set if each effect in turn were there.
    #[must_use]
    pub fn now(&self) -> (f64, Vec<f64>) {
        let Some(seen) = Seen::of(self, None) else { return (f64::INFINITY, Vec::new()) };
        let Some(precision) = self.table.precision(&seen.before) else { return (f64::INFINITY, Vec::new()) };
        (rms(&self.table.errors(&precision)), self.doubts(&seen.before, &precision, &seen, &[]))
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
        if let Some(seen) = Seen::of(self, None)
            && let Some(precision) = self.table.precision(&seen.before)
        {
            gain.error_before = rms(&self.table.errors(&precision));
            gain.error_after = gain.error_before;
            let doubts = |more: &[CheckKind]| self.doubts(&seen.before, &precision, &seen, more);
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

    fn compare(&self, before: &DMatrix<f64>, after: &DMatrix<f64>, seen: &Seen<'_>) -> Gain {
        let (Some(first), Some(second)) = (self.table.precision(before), self.table.precision(after)) else {
            return Gain::default();
        };
        let (old, new) = (self.table.errors(&first), self.table.errors(&second));
        let wanted = (WANTED_ERROR * self.known.blocked).powi(2);
        let nats = |(a, b): (&f64, &f64)| 0.5 * ((a + wanted) / (b + wanted)).ln();
        let mean = old.iter().zip(&new).map(nats).sum::<f64>() / old.len().max(1) as f64;
        let mut gain = Gain {
            // Each level of the table counts once.
            table: (self.known.levels.len() as f64 * mean).max(0.0),
            error_before: rms(&old),
            error_after: rms(&new),
            ..Gain::default()
        };
        for (s, set) in self.known.sets.iter().enumerate() {
            let old = entropy(set, |i, j| self.between(before, seen, s, i, j));
            let new = entropy(set, |i, j| self.between(after, seen, s, i, j));
            gain.set += (old - new).max(0.0);
        }
        let (old, new) = (self.doubts(before, &first, seen, &[]), self.doubts(after, &second, seen, &[]));
        gain.unseen = self.share() * less(&old, &new);
        gain
    }

    /// For each effect, the expected entropy of the set if it were present at the target size: among nothing and all others, whose sizes and
    /// shapes are free beside the table. Effects that a check of the bench settles are not competing candidates, and have none.
    fn doubts(
        &self,
        gram: &DMatrix<f64>,
        precision: &Cholesky<f64, Dyn>,
        seen: &Seen<'_>,
        more: &[CheckKind],
    ) -> Vec<f64> {
        let m = self.table.len();
        let n = gram.nrows() - m;
        let cross = gram.view((0, m), (m, n)).into_owned();
        // What the table cannot imitate of the columns.
        let left = gram.view((m, m), (n, n)) - cross.tr_mul(&precision.solve(&cross));
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

    /// Squared distance of one effect of a set from another, whose size and shape are free.
    fn between(&self, gram: &DMatrix<f64>, seen: &Seen<'_>, set: usize, of: usize, from: usize) -> f64 {
        let (a, b) = (&self.known.sets[set][of], &self.known.sets[set][from]);
        let checked = |h: &Hypothesis| {
            h.law.traits().check.and_then(CheckKind::of).is_some_and(|c| self.known.checked.contains(&c))
        };
        if checked(a) || checked(b) {
            return DECIDED;
        }
        let Some(trace) = seen.traces.get(set).and_then(|t| t.get(of)) else { return 0.0 };
        let Some(competitor) = self.library.index(b.law).map(|e| &seen.places[e]) else { return 0.0 };
        let m = self.table.len();
        let mut least = f64::INFINITY;
        for shape in &competitor.shapes {
            let keep: Vec<usize> =
                (0..m).chain(shape.iter().copied().filter(|c| seen.peak[*c] > 0.0)).collect();
            let n = keep.len();
            let mut inner = DMatrix::from_fn(n, n, |i, j| gram[(keep[i], keep[j])]);
            self.table.add_prior(&mut inner);
            for i in m..n {
                inner[(i, i)] += 1.0 / (self.known.blocked * self.known.blocked);
            }
            let image = gram * trace;
            let cross = DVector::from_fn(n, |i, _| image[keep[i]]);
            let Some(factor) = Cholesky::new(inner) else { continue };
            least = least.min((trace.dot(&image) - cross.dot(&factor.solve(&cross))).max(0.0));
        }
        if least.is_finite() { least } else { 0.0 }
    }
}

/// The columns of everything recorded and a step, in products of columns that have the largest value 1.
struct Seen<'a> {
    /// Products over the past.
    before: DMatrix<f64>,
    /// Products over the past and the step.
    after: DMatrix<f64>,
    /// Where the columns of each effect are.
    places: &'a [Where],
    /// Largest value of each column before scaling; zero for a column without any.
    peak: Vec<f64>,
    /// For each set, the force of each hypothesis as coefficients of the columns.
    traces: Vec<Vec<DVector<f64>>>,
}

impl<'a> Seen<'a> {
    /// The past, and a step after it.
    fn of(design: &'a Design<'_>, step: Option<Recording>) -> Option<Self> {
        let past = design.shared.as_ref()?;
        let mut peak = past.peak.clone();
        let mut added = None;
        if let Some(step) = step.filter(|s| !s.is_empty()) {
            let rows_before: usize = design.past.iter().map(Recording::len).sum();
            let mut recordings = design.past.clone();
            recordings.push(step);
            let campaign = Campaign::new(recordings);
            let contexts: Vec<Context<f64>> = moments(design.known.model, &campaign);
            let mut memories = past.memories.clone();
            let rows = columns_of_rows(
                &design.table,
                &design.library,
                contexts.get(rows_before..)?,
                &past.places,
                &mut memories,
            );
            for (p, of_step) in peak.iter_mut().zip(&rows.peak) {
                *p = p.max(*of_step);
            }
            added = Some(design.products(&rows, campaign.recordings.last().map(std::slice::from_ref)?));
        }
        let scale: Vec<f64> = peak.iter().map(|p| if *p > 0.0 { 1.0 / p } else { 0.0 }).collect();
        let scaled = |gram: &DMatrix<f64>| {
            DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] * scale[i] * scale[j])
        };
        let before = scaled(&past.gram);
        let after = added.map_or_else(|| before.clone(), |added| &before + scaled(&added));
        let mut seen = Self { before, after, places: &past.places, peak, traces: Vec::new() };
        seen.traces = design.known.sets.iter().map(|set| traces(design, &seen, set, &past.span)).collect();
        Some(seen)
    }
}

/// The force of each hypothesis of a set: the first as fitted, each other as it imitates the first best.
fn traces(design: &Design<'_>, seen: &Seen<'_>, set: &[Hypothesis], span: &Span) -> Vec<DVector<f64>> {
    let total = seen.peak.len();
    let m = design.table.len();
    let mut out: Vec<DVector<f64>> = Vec::with_capacity(set.len());
    for hypothesis in set {
        let mut trace = DVector::zeros(total);
        let columns = design.library.index(hypothesis.law).map(|e| &seen.places[e]);
        let Some(columns) = columns else {
            out.push(trace);
            continue;
        };
        match (&hypothesis.parameters, out.first()) {
            (Some(values), None) => {
                let amplitudes = hypothesis.law.amplitudes().len();
                let shape =
                    columns.nearest(hypothesis.law, values.get(amplitudes..).unwrap_or_default(), span);
                for (c, value) in shape.iter().zip(values) {
                    trace[*c] = value * seen.peak[*c];
                }
            }
            (_, Some(first)) => {
                let image = &seen.before * first;
                let keep: Vec<usize> =
                    columns.first_shape().copied().filter(|c| seen.peak[*c] > 0.0).collect();
                let n = keep.len();
                let mut inner = DMatrix::from_fn(n, n, |i, j| seen.before[(keep[i], keep[j])]);
                for i in 0..n {
                    inner[(i, i)] += 1e-9 + 1.0 / (design.known.blocked * design.known.blocked);
                }
                let cross = DVector::from_fn(n, |i, _| image[keep[i]]);
                if let Some(factor) = Cholesky::new(inner) {
                    let best = factor.solve(&cross);
                    keep.iter().zip(best.iter()).for_each(|(c, v)| trace[*c] = *v);
                }
            }
            (None, None) => {
                if let Some(c) = columns.first_shape().next() {
                    trace[*c] = EFFECT_SIZE * design.known.blocked;
                }
            }
        }
        debug_assert!(trace.rows(0, m).iter().all(|v| *v == 0.0));
        out.push(trace);
    }
    out
}

fn rms(variances: &[f64]) -> f64 {
    (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt()
}

/// How much less doubt there is, over all effects; those that a check settles are no longer among them.
fn less(before: &[f64], after: &[f64]) -> f64 {
    (before.iter().sum::<f64>() - after.iter().sum::<f64>()).max(0.0)
}

/// Every nth row of a recording, without its force.
fn thinned(recording: &Recording, stride: usize) -> Recording {
    let pick = |v: &[f64]| v.iter().copied().step_by(stride).collect::<Vec<f64>>();
    Recording {
        name: recording.name.clone(),
        time: pick(&recording.time),
        pressure: pick(&recording.pressure),
        stroke: pick(&recording.stroke),
        ..Recording::default()
    }
}

/// The recording that a course makes where the muscle follows.
fn simulated(course: &Course, begin: f64) -> Recording {
    let (time, pressure, stroke) = course.samples(begin, SAMPLE_HZ);
    let stride = time.len().div_ceil(STEP_ROWS).max(1);
    thinned(&Recording { name: "step".into(), time, pressure, stroke, ..Recording::default() }, stride)
}

/// The recording that is expected of a course after a time, s.
pub(crate) fn expected(course: &Course, after: f64, name: &str) -> Recording {
    Recording { name: name.to_owned(), ..simulated(course, after + PAUSE_S) }
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
