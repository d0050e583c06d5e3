//! Which effects: one look at all of them, tests by whole blocks over the whole family, what cannot be told apart.

use rayon::prelude::*;

use super::baselines::{self, Baseline, Give, Kind, cosine};
use super::candidates::Candidate;
use super::criteria::selection::{
    CONCEALED, LARGEST_PEAK, LEAST_SHARE, NEGLIGIBLE_RIVAL, PARALLEL, REFINED, RIVAL_COST, RIVAL_FLOOR,
    RIVAL_SHARPNESS, SELECTION_FLOOR, SIGN_FLIPS, STATIC_MOVED, STATIC_PEAK, TWIN_OF_TABLES, WORSE,
};
use super::evidence::Scale;
use super::ground::Ground;
use super::linear::{Sign, add_scaled, energy};
use super::noise::{Noise, family_p};
use super::remark::Remark;
use super::rows::Rows;
use super::trial::{self, Trial};

/// An effect taken, with its standing among its rivals at that step.
#[derive(Clone, Debug)]
pub(crate) struct Taken {
    /// The trial that won.
    pub trial: Trial,
    /// Family-wise p.
    pub p: f64,
    /// Share of all misfit above noise.
    pub share: f64,
    /// Rivals: candidate, weight against the winner (1), cosine with it.
    pub rivals: Vec<(usize, f64, f64)>,
    /// Rms after it, N.
    pub rms: f64,
}

/// What the search found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// The rows, linearised about the last baseline.
    pub rows: Rows,
    /// The baseline without effects, in the metric of the last one.
    pub bare: Baseline,
    /// The baseline with the effects fitted beside it.
    pub full: Baseline,
    /// The effects.
    pub taken: Vec<Taken>,
    /// Every candidate's best trial on the bare baseline.
    pub first_look: Vec<Trial>,
    /// Family-wise p of each of these.
    pub first_p: Vec<f64>,
    /// The energy above noise before anything was taken, N².
    pub above: f64,
    /// Effect columns with amplitudes applied.
    pub traces: Vec<Vec<f64>>,
    /// The noise at the end.
    pub noise: Noise,
    /// Remarks.
    pub remarks: Vec<Remark>,
}

impl Found {
    /// Without the effect that was taken last.
    pub(crate) fn without_last(mut self, library: &[Candidate]) -> Self {
        self.taken.pop();
        let left: Vec<Trial> = self.taken.iter().map(|t| t.trial.clone()).collect();
        let kind = left.last().map_or(self.bare.kind, |t| Kind::Soft(t.give));
        let joint = refit(&self.rows, kind, left, library);
        self.bare = baselines::fit(&joint.rows, kind, &[]);
        for (t, l) in self.taken.iter_mut().zip(&joint.trials) {
            t.trial.amplitudes.clone_from(&l.amplitudes);
        }
        Self { rows: joint.rows, full: joint.base, traces: joint.traces, ..self }
    }
}

/// Best trial of each candidate out of a scan.
pub(super) fn best_of_each(trials: &[Trial], library: &[Candidate]) -> Vec<Trial> {
    let mut best: Vec<Option<&Trial>> = vec![None; library.len()];
    for t in trials {
        let b = &mut best[t.candidate];
        if b.is_none_or(|x| (t.score, t.visible) > (x.score, x.visible)) {
            *b = Some(t);
        }
    }
    best.into_iter().flatten().cloned().collect::<Vec<_>>()
}

/// Family-wise p of the best trials, given everything that was looked at.
fn p_values(best: &[Trial], all: &[Trial]) -> Vec<f64> {
    let mut views: Vec<&[f64]> = best.iter().map(|t| t.scores.as_slice()).collect();
    for t in all {
        views.extend(t.singles.iter().map(Vec::as_slice));
    }
    let mut p = family_p(&views, SIGN_FLIPS, 11);
    p.truncate(best.len());
    p
}

/// One step: every candidate beside the present baseline, the best refined.
pub(crate) fn look(
    library: &[Candidate],
    rows: &Rows,
    ground: &Ground<'_>,
    blocked: f64,
) -> (Vec<Trial>, Vec<f64>) {
    let mut all = ground.scan(library, rows);
    forbid_cancelling(&mut all, blocked);
    let mut best = best_of_each(&all, library);
    let mut order: Vec<usize> = (0..best.len()).collect();
    order.sort_by(|a, b| best[*b].score.total_cmp(&best[*a].score));
    rows.progress().stage("refining the best", order.len() as u64);
    for (rank, i) in order.into_iter().enumerate() {
        rows.progress().step();
        if best[i].gain > 0.0 {
            best[i] = if rank < REFINED {
                ground.refine(&best[i], library, rows)
            } else {
                ground.attempt(best[i].candidate, &library[best[i].candidate], &best[i].shapes, rows, true)
            };
        }
    }
    forbid_cancelling(&mut best, blocked);
    rows.progress().stage("weighing them against chance and each other", 0);
    let p = p_values(&best, &all);
    (best, p)
}

/// Takes away the gain of trials whose trace is implausibly large beside the little that is seen of it.
fn forbid_cancelling(trials: &mut [Trial], blocked: f64) {
    for t in trials {
        if t.gain > 0.0 && t.peak > LARGEST_PEAK * blocked && t.visible < CONCEALED {
            (t.gain, t.score) = (0.0, 0.0);
        }
    }
}

/// A baseline fitted together with effects.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    /// The rows, linearised about the model that the effects see.
    pub rows: Rows,
    /// The baseline.
    pub base: Baseline,
    /// The effects, with the amplitudes of the joint fit.
    pub trials: Vec<Trial>,
    /// Their traces, N.
    pub traces: Vec<Vec<f64>>,
}

/// Refits the baseline with the effects of `trials` beside it, renewing what the effects see of the model.
///
/// A law of first order goes by the model's slope. Where the slope changes fast, that of the new baseline may serve it worse than the one
/// by which the effect was found; then that one stays.
pub(crate) fn refit(rows: &Rows, kind: Kind, trials: Vec<Trial>, library: &[Candidate]) -> Joint {
    let first = fitted_beside(rows, kind, trials, library);
    let renewed = baselines::linearised(rows, &first.base);
    let second = fitted_beside(&renewed, kind, first.trials.clone(), library);
    if energy(&second.base.residual) <= WORSE * energy(&first.base.residual) {
        let rows = baselines::linearised(&second.rows, &second.base);
        return Joint { rows, ..second };
    }
    first
}

/// The baseline with effects beside it as they see the model now.
fn fitted_beside(rows: &Rows, kind: Kind, mut trials: Vec<Trial>, library: &[Candidate]) -> Joint {
    let mut columns = Vec::new();
    let mut owner = Vec::new();
    for (t, trial) in trials.iter().enumerate() {
        for (k, column) in library[trial.candidate].columns(&trial.shapes, rows).into_iter().enumerate() {
            if trial.amplitudes.get(k).is_some_and(|a| *a != 0.0) {
                columns.push(column);
                owner.push((t, k));
            }
        }
    }
    let base = baselines::fit(rows, kind, &columns);
    let mut traces = vec![vec![0.0; rows.len()]; trials.len()];
    for (j, (t, k)) in owner.iter().enumerate() {
        let sign = library[trials[*t].candidate].signs()[*k];
        let a = base.amplitudes[j];
        let allowed = match sign {
            Sign::Free => a,
            Sign::Positive => a.max(0.0),
            Sign::Negative => a.min(0.0),
        };
        trials[*t].amplitudes[*k] = allowed;
        add_scaled(&mut traces[*t], allowed, &columns[j]);
    }
    Joint { rows: rows.clone(), base, trials, traces }
}

/// Whether an effect may be named at all: what tables imitate has to be large, or to show beyond them.
pub(super) fn worth_naming(t: &Trial, library: &[Candidate], rows: &Rows, ground: &Ground<'_>) -> bool {
    let Scale { weight, blocked, .. } = ground.scale;
    let moved = (t.gain.max(t.relief) / weight).sqrt();
    let table = t.beyond_tables < TWIN_OF_TABLES;
    t.beyond_tables >= CONCEALED
        || (!table && t.peak >= STATIC_PEAK * blocked && moved >= STATIC_MOVED * blocked)
        || seen_past_tables(t, library, rows, ground)
}

/// Whether what the freest tables leave of the recordings is of an effect's making, however little of its trace that is.
fn seen_past_tables(trial: &Trial, library: &[Candidate], rows: &Rows, ground: &Ground<'_>) -> bool {
    let Scale { sigma, weight, blocked, .. } = ground.scale;
    let (left, before) = ground.left_under(trial, library, rows, Give::free(blocked));
    let above = before - sigma * sigma * weight;
    let taken = before - left;
    taken >= LEAST_SHARE * above && taken >= weight * (SELECTION_FLOOR * blocked).powi(2)
}

/// The weight of each rival against the winner, from what each leaves of the misfit above noise where the bladder differs between
/// pressures as much as it does beside the winner.
pub(crate) fn rivals(
    winner: &Trial,
    best: &[Trial],
    library: &[Candidate],
    rows: &Rows,
    ground: &Ground<'_>,
    span: &baselines::Reach,
) -> Vec<(usize, f64, f64)> {
    let mine = trial::projected_trace(winner, library, rows, span);
    let numbers = |t: &Trial| (t.amplitudes.iter().filter(|a| **a != 0.0).count() + t.shapes.len()) as f64;
    let scale = &ground.scale;
    let noise_energy = scale.sigma * scale.sigma * scale.weight;
    let excess = |e: f64| (e - noise_energy).max(0.0);
    let (own_left, before) = ground.left_under(winner, library, rows, winner.give);
    let floor = RIVAL_FLOOR * excess(before) + noise_energy * (2.0 / scale.independent.max(2.0)).sqrt();
    let mut rivals: Vec<(usize, f64, f64)> = best
        .par_iter()
        .filter(|t| t.candidate != winner.candidate && t.gain > 0.0)
        .map(|t| {
            let (left, _) = ground.left_under(t, library, rows, winner.give);
            let worse = ((excess(left) + floor) / (excess(own_left) + floor)).ln();
            let weight =
                (-RIVAL_SHARPNESS * worse - RIVAL_COST * (numbers(t) - numbers(winner))).min(0.0).exp();
            let c = cosine(&mine, &trial::projected_trace(t, library, rows, span));
            (t.candidate, weight, c)
        })
        .collect();
    rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
    rivals.retain(|r| r.1 > NEGLIGIBLE_RIVAL || r.2.abs() > PARALLEL);
    rivals
}
