//! One step of forward selection: scan of all candidates, family-wise tests by whole blocks, competitors.

use rayon::prelude::*;

use super::baselines::{self, Baseline, Kind, PriorDeviations, cosine};
use super::candidate_fit::{self, CandidateFit};
use super::candidate_scoring::Scorer;
use super::candidates::Candidate;
use super::criteria::selection::{
    COMPETITOR_COST, COMPETITOR_FLOOR, COMPETITOR_SHARPNESS, CONCEALED, LARGEST_PEAK, LEAST_SHARE,
    NEGLIGIBLE_COMPETITOR, PARALLEL, REFINED, SELECTION_FLOOR, SIGN_FLIPS, STATIC_MOVED, STATIC_PEAK,
    TWIN_OF_TABLES, WORSE,
};
use super::likelihood::Scale;
use super::linear::{Sign, add_scaled, energy};
use super::noise::{Noise, family_p};
use super::remark::Remark;
use super::renewed_laws;
use super::rows::Rows;
use model_core::effects::Imitates;

/// A selected effect, with its weight among its competitors at that step.
#[derive(Clone, Debug)]
pub(crate) struct SelectedEffect {
    /// The fit that won.
    pub fit: CandidateFit,
    /// Family-wise p.
    pub p: f64,
    /// Share of all misfit above noise.
    pub share: f64,
    /// Competitors: candidate, weight against the winner (1), cosine with it.
    pub competitors: Vec<(usize, f64, f64)>,
    /// Rms after it, N.
    pub rms: f64,
}

/// The selected effects.
#[derive(Clone, Debug)]
pub(crate) struct Selection {
    /// The rows, linearised about the last baseline.
    pub rows: Rows,
    /// The baseline without effects, in the metric of the last one.
    pub base_alone: Baseline,
    /// The baseline with the effects fitted beside it.
    pub joint: Baseline,
    /// The effects.
    pub selected: Vec<SelectedEffect>,
    /// Every candidate's best fit beside the bare baseline.
    pub first_scan: Vec<CandidateFit>,
    /// Family-wise p of each of these.
    pub first_p: Vec<f64>,
    /// The energy above noise before any effect, N².
    pub excess_energy: f64,
    /// Effect columns with amplitudes applied.
    pub traces: Vec<Vec<f64>>,
    /// The noise at the end.
    pub noise: Noise,
    /// Remarks of the selection on its data and its effects.
    pub remarks: Vec<Remark>,
}

impl Selection {
    /// Without one of the effects, by its place among those selected.
    pub(crate) fn without(mut self, place: usize, library: &[Candidate]) -> Self {
        self.selected.remove(place);
        let left: Vec<CandidateFit> = self.selected.iter().map(|t| t.fit.clone()).collect();
        let kind = left.last().map_or(self.base_alone.kind, |t| Kind::Soft(t.prior));
        let joint = refit(&self.rows, kind, left, library);
        self.base_alone = baselines::fit(&joint.rows, kind, &[]);
        for (t, l) in self.selected.iter_mut().zip(&joint.fits) {
            t.fit.amplitudes.clone_from(&l.amplitudes);
        }
        Self { rows: joint.rows, joint: joint.base, traces: joint.traces, ..self }
    }
}

/// Best fit of each candidate out of a scan.
pub(super) fn best_of_each(fits: &[CandidateFit], library: &[Candidate]) -> Vec<CandidateFit> {
    let mut best: Vec<Option<&CandidateFit>> = vec![None; library.len()];
    for t in fits {
        let b = &mut best[t.candidate];
        if b.is_none_or(|x| (t.score, t.visible) > (x.score, x.visible)) {
            *b = Some(t);
        }
    }
    best.into_iter().flatten().cloned().collect::<Vec<_>>()
}

/// Family-wise p of the best fits, over all candidates and shapes that were scanned.
fn p_values(best: &[CandidateFit], all: &[CandidateFit]) -> Vec<f64> {
    let mut views: Vec<&[f64]> = best.iter().map(|t| t.scores.as_slice()).collect();
    for t in all {
        views.extend(t.singles.iter().map(Vec::as_slice));
    }
    let mut p = family_p(&views, SIGN_FLIPS, 11);
    p.truncate(best.len());
    p
}

/// One step: every candidate beside the present baseline, the best refined.
pub(crate) fn scan_step(
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
    blocked: f64,
    chosen: &[CandidateFit],
) -> (Vec<CandidateFit>, Vec<f64>) {
    let mut all = scorer.scan(library, rows);
    reject_cancelling(&mut all, blocked);
    let mut best = best_of_each(&all, library);
    let mut order: Vec<usize> = (0..best.len()).collect();
    order.sort_by(|a, b| best[*b].score.total_cmp(&best[*a].score));
    rows.progress().stage("refining the best", order.len() as u64);
    for (rank, i) in order.into_iter().enumerate() {
        rows.progress().step();
        if best[i].gain > 0.0 {
            best[i] = if rank < REFINED {
                scorer.refine(&best[i], library, rows)
            } else {
                scorer.fit(best[i].candidate, &library[best[i].candidate], &best[i].shapes, rows, true)
            };
        }
    }
    renewed_laws::renew(&mut best, chosen, library, rows, scorer);
    reject_cancelling(&mut best, blocked);
    rows.progress().stage("weighing them against chance and each other", 0);
    let p = p_values(&best, &all);
    (best, p)
}

/// Sets the gain of fits to zero whose trace is implausibly large beside the little that is seen of it.
fn reject_cancelling(fits: &mut [CandidateFit], blocked: f64) {
    for t in fits {
        if t.gain > 0.0 && t.peak > LARGEST_PEAK * blocked && t.visible < CONCEALED {
            (t.gain, t.score) = (0.0, 0.0);
        }
    }
}

/// A baseline fitted together with effects.
#[derive(Clone, Debug)]
pub(crate) struct JointFit {
    /// The rows, linearised about the model that the effects see.
    pub rows: Rows,
    /// The baseline.
    pub base: Baseline,
    /// The effects, with the amplitudes of the joint fit.
    pub fits: Vec<CandidateFit>,
    /// Their traces, N.
    pub traces: Vec<Vec<f64>>,
}

/// Refits the baseline with the effects of `fits` beside it, renewing what the effects see of the model.
///
/// A law of first order is proportional to the model's slope. Where the slope changes fast, that of the new baseline may serve it worse than the one
/// by which the effect was found; then that one stays.
pub(crate) fn refit(rows: &Rows, kind: Kind, fits: Vec<CandidateFit>, library: &[Candidate]) -> JointFit {
    let first = fitted_beside(rows, kind, fits, library);
    let renewed = baselines::linearised(rows, &first.base);
    let fits = first.fits.iter().map(|f| CandidateFit { about: None, ..f.clone() }).collect();
    let second = fitted_beside(&renewed, kind, fits, library);
    if energy(&second.base.residual) <= WORSE * energy(&first.base.residual) { second } else { first }
}

/// The baseline with effects beside it as they see the model now.
fn fitted_beside(rows: &Rows, kind: Kind, mut fits: Vec<CandidateFit>, library: &[Candidate]) -> JointFit {
    let mut columns = Vec::new();
    let mut owner = Vec::new();
    for (t, fit) in fits.iter().enumerate() {
        for (k, column) in fit.columns(library, rows).into_iter().enumerate() {
            if fit.amplitudes.get(k).is_some_and(|a| *a != 0.0) {
                columns.push(column);
                owner.push((t, k));
            }
        }
    }
    let base = baselines::fit(rows, kind, &columns);
    let mut traces = vec![vec![0.0; rows.len()]; fits.len()];
    for (j, (t, k)) in owner.iter().enumerate() {
        let sign = library[fits[*t].candidate].signs()[*k];
        let a = base.amplitudes[j];
        let allowed = match sign {
            Sign::Free => a,
            Sign::Positive => a.max(0.0),
            Sign::Negative => a.min(0.0),
        };
        fits[*t].amplitudes[*k] = allowed;
        add_scaled(&mut traces[*t], allowed, &columns[j]);
    }
    JointFit { rows: rows.clone(), base, fits, traces }
}

/// Whether an effect may be named at all: what tables imitate has to be large, or to show beyond them.
pub(super) fn is_selectable(
    t: &CandidateFit,
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
) -> bool {
    // At one held length a force over pressure is all there is: a wrong description of the muscle makes the same one.
    let imitates = library[t.candidate].traits.imitates;
    if imitates == Some(Imitates::Description) && rows.have_one_held_length() {
        return false;
    }
    let Scale { weight, blocked, .. } = scorer.scale;
    let moved = (t.gain.max(t.relief) / weight).sqrt();
    let table = t.beyond_tables < TWIN_OF_TABLES;
    t.beyond_tables >= CONCEALED
        || (!table && t.peak >= STATIC_PEAK * blocked && moved >= STATIC_MOVED * blocked)
        || is_visible_beyond_tables(t, library, rows, scorer)
}

/// Whether what the freest tables leave of the recordings is of an effect's making, however little of its trace that is.
fn is_visible_beyond_tables(
    fit: &CandidateFit,
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
) -> bool {
    let Scale { sigma, weight, blocked, .. } = scorer.scale;
    let (left, before) = scorer.left_under(fit, library, rows, PriorDeviations::free(blocked));
    let excess_energy = before - sigma * sigma * weight;
    let selected = before - left;
    selected >= LEAST_SHARE * excess_energy && selected >= weight * (SELECTION_FLOOR * blocked).powi(2)
}

/// The weight of an effect among its competitors, whose weights are against its own.
pub(crate) fn model_weight(competitors: &[(usize, f64, f64)]) -> f64 {
    1.0 / (1.0 + competitors.iter().map(|r| r.1).sum::<f64>())
}

/// The number of free parameters of a fit.
fn numbers(fit: &CandidateFit) -> f64 {
    (fit.amplitudes.iter().filter(|a| **a != 0.0).count() + fit.shapes.len()) as f64
}

/// The explanation with which another one is compared.
struct Standing {
    /// What noise leaves, N².
    noise: f64,
    /// What the winner leaves above it, and what the inexactness of a law leaves, N².
    own: f64,
    floor: f64,
    /// The number of the winner's free parameters.
    numbers: f64,
}

impl Standing {
    fn of(winner: &CandidateFit, library: &[Candidate], rows: &Rows, scorer: &Scorer<'_>) -> Self {
        let scale = &scorer.scale;
        let noise = scale.sigma * scale.sigma * scale.weight;
        let (left, before) = scorer.left_under(winner, library, rows, winner.prior);
        let excess = |e: f64| (e - noise).max(0.0);
        let floor = COMPETITOR_FLOOR * excess(before) + noise * (2.0 / scale.independent.max(2.0)).sqrt();
        Self { noise, own: excess(left), floor, numbers: numbers(winner) }
    }

    /// The weight against the winner (1) of an explanation that leaves this, N², with this number of free parameters.
    fn weight_of(&self, left: f64, numbers: f64) -> f64 {
        let excess = (left - self.noise).max(0.0);
        let worse = ((excess + self.floor) / (self.own + self.floor)).ln();
        (-COMPETITOR_SHARPNESS * worse - COMPETITOR_COST * (numbers - self.numbers)).min(0.0).exp()
    }
}

/// The weight against an effect (1) of a bladder whose stiffness grows or falls in proportion to the pressure.
pub(crate) fn weight_of_stiffening(
    winner: &CandidateFit,
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
) -> f64 {
    let stiffening: Vec<f64> = rows.contexts().iter().map(|c| c.elastic * c.pressure).collect();
    let left = scorer.left_with(&stiffening, rows, winner.prior);
    Standing::of(winner, library, rows, scorer).weight_of(left, 1.0)
}

/// The weight of each competitor against the winner, from what each leaves of the misfit above noise where the bladder differs between
/// pressures as much as it does beside the winner.
pub(crate) fn competitors(
    winner: &CandidateFit,
    best: &[CandidateFit],
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
    span: &baselines::Absorbable,
) -> Vec<(usize, f64, f64)> {
    let mine = candidate_fit::projected_trace(winner, library, rows, span);
    let standing = Standing::of(winner, library, rows, scorer);
    let mut competitors: Vec<(usize, f64, f64)> = best
        .par_iter()
        .filter(|t| t.candidate != winner.candidate && t.gain > 0.0)
        .map(|t| {
            let (left, _) = scorer.left_under(t, library, rows, winner.prior);
            let weight = standing.weight_of(left, numbers(t));
            let c = cosine(&mine, &candidate_fit::projected_trace(t, library, rows, span));
            (t.candidate, weight, c)
        })
        .collect();
    competitors.sort_by(|a, b| b.1.total_cmp(&a.1));
    competitors.retain(|r| r.1 > NEGLIGIBLE_COMPETITOR || r.2.abs() > PARALLEL);
    competitors
}
