//! Which effects: forward selection with exchange, tests by whole blocks over the whole family, ties, abstention.

use rayon::prelude::*;

use super::baselines::{self, Baseline, Give, Kind, cosine};
use super::candidates::{self, Candidate, Ground, Trial};
use super::evidence::Scale;
use super::linear::{Sign, add_scaled, energy};
use super::noise::{self, Noise, family_p};
use super::rows::Rows;

/// The family-wise error that a name may have.
pub(crate) const FAMILY_ALPHA: f64 = 0.01;
/// Misfit below this share of the blocked force is the model's own: `M = 4` leaves 0.03 to 0.06 % on a hyperelastic wall, and
/// friction by its sign alone about as much again where contacts give a little before they slide.
pub(crate) const OWN_INEXACTNESS: f64 = 4e-4;
/// A trace as high as this share of the blocked force counts although few rows have it.
const NARROW_PEAK: f64 = 0.01;
/// A static effect is named from this peak on, as a share of the blocked force: below, an error of a tenth of a degree in the braid
/// angle makes the same surface.
pub(crate) const STATIC_PEAK: f64 = 0.015;
/// Below this share of its energy outside the flexible tables an effect counts as concealed by them.
pub(crate) const CONCEALED: f64 = 0.04;
/// And it must move the fit by this much, rms as a share of the blocked force.
const STATIC_MOVED: f64 = 1e-3;
/// A trace that must be larger than this share of the blocked force to explain a small misfit is no explanation where the tables would
/// have to cancel nearly all of it.
const LARGEST_PEAK: f64 = 0.25;
/// At most so many effects are named.
pub(crate) const MAX_NAMED: usize = 3;
/// A further effect must take this share of all misfit above noise …
const FURTHER_OF_ALL: f64 = 0.1;
/// … and this share of what its predecessors left.
const FURTHER_OF_REST: f64 = 0.4;
/// The first must take this share of the misfit above noise.
pub(crate) const FIRST_OF_ALL: f64 = 0.4;
/// How much the deviance must fall for an effect, beyond what its free numbers cost.
pub(crate) const LEAST_SCORE: f64 = 12.0;
/// The same where no test by whole blocks can support it: chance in four hundred looks gives 2 ln 400 = 12 at most once in e, and
/// each 2 ln 10 = 4.6 more once in ten times as many.
pub(crate) const LEAST_ALONE: f64 = 25.0;
/// A name of less than this part of what something else would score is the shadow of that.
const SHADOW: f64 = 2.0;
/// Laws that are little more than a slow course of time, which a reading that wanders imitates best.
const SLOW: [&str; 5] = ["force-drift", "thermal-softening", "cyclic-softening", "permanent-set", "end-slip"];
/// However long the noise's memory is, half-strokes over several pressures and two directions say more than one number.
const FEWEST_INDEPENDENT: f64 = 8.0;
/// Throws of the coin behind a family-wise p.
const THROWS: usize = 1999;
/// How many candidates are refined in their shapes at every step.
const REFINED: usize = 12;

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
    pub remarks: Vec<String>,
}

impl Found {
    /// Takes back the last effect.
    pub(crate) fn drop_last(&mut self, rows: &mut Rows, library: &[Candidate]) {
        self.taken.pop();
        let mut left: Vec<Trial> = self.taken.iter().map(|t| t.trial.clone()).collect();
        let kind = left.last().map_or(self.bare.kind, |t| Kind::Soft(t.give));
        (self.full, self.traces) = refit(rows, kind, &mut left, library);
        self.bare = baselines::fit(rows, kind, &[]);
        for (t, l) in self.taken.iter_mut().zip(&left) {
            t.trial.amplitudes.clone_from(&l.amplitudes);
        }
    }
}

/// Best trial of each candidate out of a scan.
fn best_of_each(trials: &[Trial], library: &[Candidate]) -> Vec<Trial> {
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
    let mut p = family_p(&views, THROWS, 11);
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
    rows.progress.stage("refining the best", order.len() as u64);
    for (rank, i) in order.into_iter().enumerate() {
        rows.progress.step();
        if best[i].gain > 0.0 {
            best[i] = if rank < REFINED {
                ground.refine(&best[i], library, rows)
            } else {
                ground.attempt(best[i].candidate, &library[best[i].candidate], &best[i].shapes, rows, true)
            };
        }
    }
    forbid_cancelling(&mut best, blocked);
    rows.progress.stage("weighing them against chance and each other", 0);
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

/// Refits the baseline with the effects of `trials` beside it, renewing what the effects see of the model.
pub(crate) fn refit(
    rows: &mut Rows,
    kind: Kind,
    trials: &mut [Trial],
    library: &[Candidate],
) -> (Baseline, Vec<Vec<f64>>) {
    let mut fitted = None;
    let mut traces = Vec::new();
    for _ in 0..2 {
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
        let with = baselines::fit(rows, kind, &columns);
        traces = vec![vec![0.0; rows.len()]; trials.len()];
        for (j, (t, k)) in owner.iter().enumerate() {
            let sign = library[trials[*t].candidate].signs()[*k];
            let a = with.amplitudes[j];
            let allowed = match sign {
                Sign::Free => a,
                Sign::Positive => a.max(0.0),
                Sign::Negative => a.min(0.0),
            };
            trials[*t].amplitudes[*k] = allowed;
            add_scaled(&mut traces[*t], allowed, &columns[j]);
        }
        baselines::into_contexts(rows, &with);
        fitted = Some(with);
    }
    (fitted.unwrap_or_else(|| unreachable!("two rounds run")), traces)
}

/// Whether an effect may be named at all: what tables imitate has to be large, or to show beyond them.
fn worth_naming(t: &Trial, library: &[Candidate], rows: &Rows, ground: &Ground<'_>) -> bool {
    let Scale { weight, blocked, .. } = ground.scale;
    let moved = (t.gain.max(t.relief) / weight).sqrt();
    t.beyond_tables >= CONCEALED
        || (t.peak >= STATIC_PEAK * blocked && moved >= STATIC_MOVED * blocked)
        || seen_past_tables(t, library, rows, ground)
}

/// Whether what the freest tables leave of the recordings is of an effect's making, however little of its trace that is.
fn seen_past_tables(trial: &Trial, library: &[Candidate], rows: &Rows, ground: &Ground<'_>) -> bool {
    let Scale { sigma, weight, blocked, .. } = ground.scale;
    let (left, before) = ground.left_under(trial, library, rows, Give::free(blocked));
    let above = before - sigma * sigma * weight;
    let taken = before - left;
    taken >= FIRST_OF_ALL * above && taken >= weight * (OWN_INEXACTNESS * blocked).powi(2)
}

/// A rival of at least this weight against the winner is confusable with it.
pub(crate) const CONFUSABLE: f64 = 0.1;
/// A rival whose trace is as parallel as this to the winner's, once the base is refitted, is confusable whatever its weight.
const PARALLEL: f64 = 0.95;
/// So many candidates may fail when everything is fitted together before the search ends.
const MOST_BARRED: usize = 4;
/// With more rivals than this a name says nothing.
const MOST_RIVALS: usize = 10;
/// How inexact a right law is, as a share of the misfit that it explains …
const INEXACT: f64 = 0.05;
/// … and how fast belief falls with the logarithm of what a law leaves beyond that.
const SHARPNESS: f64 = 7.0;
/// What each further free number costs in the logarithm of belief.
const PER_NUMBER: f64 = 0.3;

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
    let mine = candidates::projected_trace(winner, library, rows, span);
    let numbers = |t: &Trial| (t.amplitudes.iter().filter(|a| **a != 0.0).count() + t.shapes.len()) as f64;
    let scale = &ground.scale;
    let noise_energy = scale.sigma * scale.sigma * scale.weight;
    let excess = |e: f64| (e - noise_energy).max(0.0);
    let (own_left, before) = ground.left_under(winner, library, rows, winner.give);
    let floor = INEXACT * excess(before) + noise_energy * (2.0 / scale.independent.max(2.0)).sqrt();
    let mut rivals: Vec<(usize, f64, f64)> = best
        .par_iter()
        .filter(|t| t.candidate != winner.candidate && t.gain > 0.0)
        .map(|t| {
            let (left, _) = ground.left_under(t, library, rows, winner.give);
            let worse = ((excess(left) + floor) / (excess(own_left) + floor)).ln();
            let weight = (-SHARPNESS * worse - PER_NUMBER * (numbers(t) - numbers(winner))).min(0.0).exp();
            let c = cosine(&mine, &candidates::projected_trace(t, library, rows, span));
            (t.candidate, weight, c)
        })
        .collect();
    rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
    rivals.retain(|r| r.1 > 0.01 || r.2.abs() > PARALLEL);
    rivals
}

/// Searches for what is missing. Candidates in `refused` are looked at and may be rivals, but are not taken.
pub(crate) fn search(
    rows: &mut Rows,
    library: &[Candidate],
    blocked: f64,
    step: f64,
    refused: &[usize],
) -> Found {
    let mut remarks = Vec::new();
    let order = if rows.isometric { 4 } else { 6 };
    let flexible = baselines::fit(rows, Kind::Flexible(order), &[]);
    let weight = energy(&rows.root_weight).max(1e-12);
    let mut noise = noise::estimate(rows, &flexible.residual, step);
    let scale = Scale {
        weight,
        independent: noise.independent.max(rows.blocks as f64),
        sigma: noise.sigma.max(1e-6 * blocked),
        blocked,
    };
    let row = scale.sigma * (weight / scale.independent).sqrt();
    let first = Give { elastic: 1e-3 * blocked, friction: 5e-4 * blocked, row };
    let begun = baselines::fit(rows, Kind::Soft(first), &[]);
    baselines::into_contexts(rows, &begun);
    let give = Ground::new(&begun, scale).give;
    let mut kind = Kind::Soft(give);
    let mut full = baselines::fit(rows, kind, &[]);
    baselines::into_contexts(rows, &full);
    let mut bare = full.clone();
    let noise_energy = noise.sigma * noise.sigma * weight;
    let above_noise = |e: f64| (e - noise_energy).max(0.02 * e).max(1e-12);
    let mut above = above_noise(energy(&bare.residual));
    let mut chosen: Vec<Trial> = Vec::new();
    let mut taken: Vec<Taken> = Vec::new();
    let mut traces: Vec<Vec<f64>> = Vec::new();
    let mut first_look: Option<(Vec<Trial>, Vec<f64>)> = None;
    let mut barred: Vec<usize> = refused.to_vec();
    while chosen.len() < MAX_NAMED && barred.len() < refused.len() + MOST_BARRED {
        let ground = Ground::new(&full, scale);
        let (best, p) = look(library, rows, &ground, blocked);
        if first_look.is_none() {
            first_look = Some((best.clone(), p.clone()));
        }
        let Some((at, winner)) = best
            .iter()
            .enumerate()
            .filter(|(_, t)| {
                !chosen.iter().any(|c| c.candidate == t.candidate)
                    && !barred.contains(&t.candidate)
                    && t.gain > 0.0
                    && !taken.iter().any(|k| k.rivals.iter().any(|r| r.0 == t.candidate && r.1 > CONFUSABLE))
                    && worth_naming(t, library, rows, &ground)
            })
            .max_by(|a, b| a.1.score.total_cmp(&b.1.score))
        else {
            break;
        };
        // Where something that tables imitate explains far more, naming the next best would be naming a shadow of it.
        let best_of_all = best.iter().map(|t| t.score).fold(0.0, f64::max);
        if chosen.is_empty() && best_of_all > (winner.score + LEAST_ALONE).max(SHADOW * winner.score) {
            break;
        }
        if chosen.is_empty() {
            above = above_noise(winner.before);
        }
        let share = winner.gain / above;
        // Of what the bladder's own differences leave; or, for an effect that spares the bladder these differences, of what one
        // bladder leaves.
        let spared = winner.relief / above_noise(winner.unrelieved);
        let of_rest = (winner.gain / above_noise(winner.before)).max(spared);
        let moved = (winner.gain.max(winner.relief) / weight).sqrt();
        // What lives in a few strokes can never give a large sum over blocks in units of its scatter: six strokes that all agree
        // happen by chance once in 64. There the likelihood counts, whose independent rows are those that the residual's own
        // correlation leaves.
        let significant = winner.score >= if p[at] <= FAMILY_ALPHA { LEAST_SCORE } else { LEAST_ALONE };
        let worth = if chosen.is_empty() {
            of_rest >= FIRST_OF_ALL
        } else {
            share >= FURTHER_OF_ALL && of_rest >= FURTHER_OF_REST
        };
        // A wall at the end of the stroke is high and narrow.
        let narrow = winner.peak >= NARROW_PEAK * blocked && winner.score >= 2.0 * LEAST_ALONE;
        let enough = moved >= if narrow { 0.4 } else { 1.0 } * OWN_INEXACTNESS * blocked;
        if !(significant && worth && enough) {
            break;
        }
        let beside = Kind::Soft(winner.give);
        let metric = baselines::fit(rows, beside, &[]);
        let rivals = rivals(winner, &best, library, rows, &ground, &metric.span);
        let open = rivals.iter().filter(|r| r.1 > CONFUSABLE).count();
        if open > MOST_RIVALS {
            let named: Vec<&str> = rivals.iter().take(open).map(|r| library[r.0].name()).collect();
            remarks.push(format!(
                "{} would explain {:.0} % of the misfit, but so would, nearly as well, {}: these recordings cannot say which, so none \
                 is named",
                library[winner.candidate].name(),
                100.0 * of_rest,
                named.join(", ")
            ));
            break;
        }
        let winner = winner.clone();
        let p = p[at];
        chosen.push(winner.clone());
        let seen = rows.contexts.clone();
        let (with, added) = refit(rows, beside, &mut chosen, library);
        // One step of a linear problem promised this; the whole refit has to keep a good part of it.
        let kept = energy(&with.residual) <= winner.before - 0.6 * winner.gain;
        // What the effect leaves tells anew how many rows are independent: a wandering zero that flexible tables had followed from
        // pressure to pressure shows itself only now.
        let again = noise::estimate(rows, &with.residual, step).independent.max(FEWEST_INDEPENDENT);
        let score = winner.score * (again / scale.independent).min(1.0);
        let least = if SLOW.contains(&library[winner.candidate].name()) { LEAST_ALONE } else { LEAST_SCORE };
        if !kept || score < least {
            chosen.pop();
            rows.contexts = seen;
            barred.push(winner.candidate);
            remarks.push(format!(
                "{} would take much of the misfit, but {}: not named",
                library[winner.candidate].name(),
                if kept {
                    "so would a reading that wanders by itself as slowly as what it leaves"
                } else {
                    "keeps little of it when everything is fitted together"
                }
            ));
            continue;
        }
        kind = beside;
        bare = metric;
        (full, traces) = (with, added);
        noise = Noise { sigma: noise.sigma, ..noise::estimate(rows, &full.residual, step) };
        taken.push(Taken { trial: winner, p, share, rivals, rms: full.rms(rows) });
        if chosen.len() > 1 {
            let mut fitted = (full, traces);
            exchange(&mut chosen, &mut taken, rows, library, kind, scale, &mut fitted);
            (full, traces) = fitted;
        }
    }
    // What the joint fit brought to nothing was not there.
    let alive: Vec<bool> = chosen.iter().map(|c| c.amplitudes.iter().any(|a| *a != 0.0)).collect();
    if alive.iter().any(|a| !a) {
        let mut keep = alive.iter();
        chosen.retain(|_| *keep.next().unwrap_or(&true));
        let mut keep = alive.iter();
        taken.retain(|_| *keep.next().unwrap_or(&true));
        (full, traces) = refit(rows, kind, &mut chosen, library);
    }
    for (t, c) in taken.iter_mut().zip(&chosen) {
        t.trial.amplitudes.clone_from(&c.amplitudes);
        t.trial.shapes.clone_from(&c.shapes);
    }
    let (first_look, first_p) = first_look.unwrap_or_default();
    Found { bare, full, taken, first_look, first_p, above, traces, noise, remarks }
}

/// Tries to replace each effect taken by another beside the rest; a better one takes its place.
fn exchange(
    chosen: &mut [Trial],
    taken: &mut [Taken],
    rows: &mut Rows,
    library: &[Candidate],
    kind: Kind,
    scale: Scale,
    fitted: &mut (Baseline, Vec<Vec<f64>>),
) {
    for position in 0..chosen.len().saturating_sub(1) {
        let mut others: Vec<Trial> = chosen.to_vec();
        others.remove(position);
        let (without, _) = refit(rows, kind, &mut others, library);
        let ground = Ground::new(&without, scale);
        let best = best_of_each(&ground.scan(library, rows), library);
        let own = best.iter().find(|t| t.candidate == chosen[position].candidate).map_or(0.0, |t| t.score);
        let challenger = best
            .iter()
            .filter(|t| !chosen.iter().any(|c| c.candidate == t.candidate))
            .max_by(|a, b| a.score.total_cmp(&b.score));
        if let Some(c) = challenger {
            let refined = ground.refine(c, library, rows);
            let (mine, _) = ground.left_under(&chosen[position], library, rows, refined.give);
            // It must leave clearly less than the present one does.
            if refined.score > own + LEAST_SCORE && refined.before - refined.gain < 0.8 * mine {
                taken[position].rivals.retain(|r| r.0 != refined.candidate);
                taken[position].rivals.insert(0, (chosen[position].candidate, 0.1, 0.0));
                taken[position].trial = refined.clone();
                chosen[position] = refined;
            }
        }
        *fitted = refit(rows, kind, chosen, library);
    }
    for t in taken.iter_mut() {
        t.rms = fitted.0.rms(rows);
    }
}
