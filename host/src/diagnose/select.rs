//! Which effects: forward selection with exchange, tests by whole blocks over the whole family, ties, abstention.

use rayon::prelude::*;

use super::baselines::{self, Baseline, Kind, cosine};
use super::candidates::{self, Candidate, Trial, attempt, refine, scan};
use super::linear::{add_scaled, dot, energy};
use super::noise::{self, Noise, family_p};
use super::rows::Rows;

/// The family-wise error that a name may have.
pub(crate) const FAMILY_ALPHA: f64 = 0.01;
/// Misfit below this share of the blocked force is the model's own: `M = 4` leaves 0.03 to 0.06 % on a hyperelastic wall, and
/// friction by its sign alone about as much again where contacts give a little before they slide.
pub(crate) const OWN_INEXACTNESS: f64 = 1e-3;
/// What the stiff baseline is allowed to miss of a real bladder as a smooth surface before that is called a misfit, rms as a
/// share of the blocked force.
pub(crate) const STATIC_INEXACTNESS: f64 = 4e-3;
/// A static effect is named from this peak on, as a share of the blocked force: below, an error of a tenth of a degree in the braid
/// angle makes the same surface.
pub(crate) const STATIC_PEAK: f64 = 0.025;
/// Below this share of its energy outside the flexible tables an effect counts as concealed by them.
const CONCEALED: f64 = 0.04;
/// And it must move the fit by this much, rms as a share of the blocked force.
const STATIC_MOVED: f64 = 3.5e-3;
/// A trace that must be larger than this share of the blocked force to explain a small misfit is no explanation: nearly all of it
/// would have to be cancelled by the tables.
const LARGEST_PEAK: f64 = 0.25;
/// At most so many effects are named.
pub(crate) const MAX_NAMED: usize = 3;
/// A further effect must take this share of all misfit above noise …
const FURTHER_OF_ALL: f64 = 0.06;
/// … and this share of what its predecessors left.
const FURTHER_OF_REST: f64 = 0.4;
/// The first must take this share of the misfit above noise.
const FIRST_OF_ALL: f64 = 0.4;
/// Throws of the coin behind a family-wise p.
const THROWS: usize = 1999;
/// How many candidates are refined in their shapes at every step.
const REFINED: usize = 12;
/// Rows that count at most when evidence between candidates is weighed: model error, not noise, limits it beyond.
const EVIDENCE_ROWS: f64 = 60.0;

/// An effect taken, with its standing among its rivals at that step.
#[derive(Clone, Debug)]
pub(crate) struct Taken {
    /// The trial that won.
    pub trial: Trial,
    /// Family-wise p.
    pub p: f64,
    /// Share of all misfit above noise.
    pub share: f64,
    /// Rivals with their relative weight (winner = 1).
    pub rivals: Vec<(usize, f64, f64)>, // candidate, weight, cosine
    /// Rms after it, N.
    pub rms: f64,
}

/// What the search found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// The baseline without effects, on which the search ran.
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

/// Best trial of each candidate out of a scan.
fn best_of_each(trials: &[Trial], library: &[Candidate]) -> Vec<Trial> {
    let mut best: Vec<Option<&Trial>> = vec![None; library.len()];
    for t in trials {
        let b = &mut best[t.candidate];
        if b.is_none_or(|x| t.gain > x.gain) {
            *b = Some(t);
        }
    }
    best.into_iter().flatten().cloned().collect::<Vec<_>>()
}

/// Penalised evidence of a trial: how much the logarithm of the misfit falls, in units of independent rows, less what its
/// free numbers cost.
fn evidence(trial: &Trial, candidate: &Candidate, left: f64, independent: f64) -> f64 {
    let free = trial.amplitudes.iter().filter(|a| **a != 0.0).count() + trial.shapes.len();
    let ratio = ((left - trial.gain) / left).clamp(1e-9, 1.0);
    let _ = candidate;
    -independent * ratio.ln() - free as f64 * independent.max(2.0).ln()
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
fn look(library: &[Candidate], rows: &Rows, base: &Baseline, blocked: f64) -> (Vec<Trial>, Vec<f64>) {
    let mut all = scan(library, rows, &base.basis, &base.residual);
    forbid_cancelling(&mut all, blocked);
    let mut best = best_of_each(&all, library);
    let mut order: Vec<usize> = (0..best.len()).collect();
    order.sort_by(|a, b| best[*b].gain.total_cmp(&best[*a].gain));
    for i in order.into_iter().take(REFINED) {
        if best[i].gain > 0.0 {
            best[i] = refine(&best[i], library, rows, &base.basis, &base.residual);
        }
    }
    forbid_cancelling(&mut best, blocked);
    let p = p_values(&best, &all);
    (best, p)
}

/// Takes away the gain of trials whose trace is implausibly large.
fn forbid_cancelling(trials: &mut [Trial], blocked: f64) {
    for t in trials {
        if t.gain > 0.0 && t.peak > LARGEST_PEAK * blocked {
            t.gain = 0.0;
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
    let mut fitted = baselines::fit(rows, kind, &[]);
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
        fitted = baselines::fit(rows, kind, &columns);
        traces = vec![vec![0.0; rows.len()]; trials.len()];
        for (j, (t, k)) in owner.iter().enumerate() {
            // An amplitude that changed its sign beside the others keeps a whisper, so that it stays in the table.
            let sign = library[trials[*t].candidate].signs()[*k];
            let a = fitted.amplitudes[j];
            let allowed = match sign {
                super::linear::Sign::Free => a,
                super::linear::Sign::Positive => a.max(0.0),
                super::linear::Sign::Negative => a.min(0.0),
            };
            trials[*t].amplitudes[*k] = allowed;
            add_scaled(&mut traces[*t], allowed, &columns[j]);
        }
        baselines::into_contexts(rows, &fitted);
    }
    (fitted, traces)
}

/// A rival of at least this weight against the winner is confusable with it.
pub(crate) const CONFUSABLE: f64 = 0.1;
/// With more rivals than this a name says nothing.
const MOST_RIVALS: usize = 8;
/// How much of the misfit two laws may differ by and still be equally believed, where the better one explains all …
const TIE: f64 = 0.015;
/// … and how that widens with what the better one leaves: a law that misses a third of the misfit is itself not exact, and small
/// differences between inexact laws tell little.
const TIE_WIDENS: f64 = 0.25;

/// The weight of each rival against the winner, from the share of the misfit above noise that each leaves.
fn rivals(
    winner: &Trial,
    best: &[Trial],
    library: &[Candidate],
    rows: &Rows,
    base: &Baseline,
    rest: f64,
) -> Vec<(usize, f64, f64)> {
    let share = |t: &Trial| (t.gain / rest).clamp(0.0, 1.0);
    let top = share(winner);
    let scale = TIE + TIE_WIDENS * (1.0 - top);
    let mine = candidates::projected_trace(winner, library, rows, &base.basis);
    let mut rivals: Vec<(usize, f64, f64)> = best
        .par_iter()
        .filter(|t| t.candidate != winner.candidate && t.gain > 0.0)
        .map(|t| {
            let weight = ((share(t) - top) / scale).min(0.0).exp();
            let c = if weight > 1e-3 {
                cosine(&mine, &candidates::projected_trace(t, library, rows, &base.basis))
            } else {
                0.0
            };
            (t.candidate, weight, c)
        })
        .collect();
    rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
    rivals.retain(|r| r.1 > 0.02);
    rivals
}

/// Searches for what is missing.
pub(crate) fn search(rows: &mut Rows, library: &[Candidate], blocked: f64, step: f64) -> Found {
    let mut remarks = Vec::new();
    let stiff = baselines::fit(rows, Kind::Stiff, &[]);
    let order = if rows.isometric { 4 } else { 6 };
    let flexible = baselines::fit(rows, Kind::Flexible(order), &[]);
    let weight = energy(&rows.root_weight).max(1e-12);
    let deficit = (energy(&stiff.residual) - energy(&flexible.residual)).max(0.0);
    let surface = (deficit / weight).sqrt();
    // The stiff baseline serves where it misses no more of the static surface than it is allowed to.
    let mut kind = if surface <= STATIC_INEXACTNESS * blocked { Kind::Stiff } else { Kind::Flexible(order) };
    let mut chosen: Vec<Trial> = Vec::new();
    let mut taken: Vec<Taken> = Vec::new();

    if kind != Kind::Stiff && rows.levels.len() >= 3 && !rows.isometric {
        baselines::into_contexts(rows, &stiff);
        if let Some(t) = repair(rows, library, &stiff, &flexible, deficit, blocked) {
            kind = Kind::Stiff;
            chosen.push(t.trial.clone());
            taken.push(t);
        } else {
            remarks.push(format!(
                "one bladder for all pressures leaves {:.2} N ({:.2} % of blocked force) that the flexible tables absorb; no \
                 single effect accounts for it, so static effects are not judged",
                surface,
                100.0 * surface / blocked
            ));
        }
    }
    let bare = baselines::fit(rows, kind, &[]);
    baselines::into_contexts(rows, &bare);
    let mut noise = noise::estimate(rows, &flexible.residual, step);
    let total_weight = weight;
    let noise_energy = noise.sigma * noise.sigma * total_weight;
    let above = (energy(&bare.residual) - noise_energy).max(0.02 * energy(&bare.residual)).max(1e-12);
    let (first_look, first_p) = look(library, rows, &bare, blocked);

    // What the flexible tables imitate almost wholly is judged against the stiff baseline's own errors.
    let concealed: Vec<bool> = first_look
        .par_iter()
        .map(|t| {
            let c = &library[t.candidate];
            attempt(t.candidate, c, &t.shapes, rows, &flexible.basis, &flexible.residual).visible < CONCEALED
        })
        .collect();
    let worth_naming = |t: &Trial| {
        let moved = (t.gain / total_weight).sqrt();
        !concealed[t.candidate] || (t.peak >= STATIC_PEAK * blocked && moved >= STATIC_MOVED * blocked)
    };
    let (mut full, mut traces) =
        if chosen.is_empty() { (bare.clone(), Vec::new()) } else { refit(rows, kind, &mut chosen, library) };
    while chosen.len() < MAX_NAMED {
        let (best, p) = if chosen.is_empty() {
            (first_look.clone(), first_p.clone())
        } else {
            look(library, rows, &full, blocked)
        };
        let left = energy(&full.residual);
        let rest = (left - noise_energy).max(0.02 * left);
        let independent = noise.independent.max(rows.blocks as f64);
        let Some((at, winner)) = best
            .iter()
            .enumerate()
            .filter(|(_, t)| {
                !chosen.iter().any(|c| c.candidate == t.candidate)
                    && t.gain > 0.0
                    && worth_naming(t)
                    && !taken.iter().any(|k| k.rivals.iter().any(|r| r.0 == t.candidate))
            })
            .max_by(|a, b| {
                let score = |t: &Trial| evidence(t, &library[t.candidate], left, independent);
                score(a.1).total_cmp(&score(b.1))
            })
        else {
            break;
        };
        let share = winner.gain / above;
        let of_rest = winner.gain / rest;
        let moved = (winner.gain / total_weight).sqrt();
        let big = evidence(winner, &library[winner.candidate], left, independent.min(EVIDENCE_ROWS));
        // What lives in a few strokes can never give a large sum over blocks in units of its scatter: six strokes that all agree
        // happen by chance once in 64. There a gain that nothing else comes near counts instead.
        let next = best
            .iter()
            .filter(|t| t.candidate != winner.candidate && worth_naming(t))
            .map(|t| t.gain)
            .fold(0.0, f64::max);
        let alone = of_rest > 0.55 && big > 30.0 && next < 0.75 * winner.gain;
        let significant = p[at] <= FAMILY_ALPHA || (alone && p[at] <= 0.5);
        let worth = if chosen.is_empty() {
            share >= FIRST_OF_ALL
        } else {
            share >= FURTHER_OF_ALL && of_rest >= FURTHER_OF_REST
        };
        if !(significant && worth && moved >= OWN_INEXACTNESS * blocked) {
            break;
        }
        let rivals = rivals(winner, &best, library, rows, &full, rest);
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
        (full, traces) = refit(rows, kind, &mut chosen, library);
        noise = Noise { sigma: noise.sigma, ..noise::estimate(rows, &full.residual, step) };
        taken.push(Taken { trial: winner, p, share, rivals, rms: full.rms(rows) });
        if chosen.len() > 1 {
            exchange(&mut chosen, &mut taken, rows, library, kind, &mut full, &mut traces);
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
    Found { bare, full, taken, first_look, first_p, above, traces, noise, remarks }
}

/// A static effect that lets one bladder serve all pressures: it must close most of the gap between the stiff and the
/// flexible baseline, and be larger than what the stiff one may miss anyway.
fn repair(
    rows: &Rows,
    library: &[Candidate],
    stiff: &Baseline,
    flexible: &Baseline,
    deficit: f64,
    blocked: f64,
) -> Option<Taken> {
    let weight = energy(&rows.root_weight).max(1e-12);
    let mut all = scan(library, rows, &stiff.basis, &stiff.residual);
    forbid_cancelling(&mut all, blocked);
    let on_stiff = best_of_each(&all, library);
    let mut tried: Vec<(Trial, f64)> = on_stiff
        .par_iter()
        .filter(|t| t.gain > 0.3 * deficit)
        .map(|t| {
            let t = refine(t, library, rows, &stiff.basis, &stiff.residual);
            let same = attempt(
                t.candidate,
                &library[t.candidate],
                &t.shapes,
                rows,
                &flexible.basis,
                &flexible.residual,
            );
            let gap = deficit - t.gain + same.gain;
            (t, gap)
        })
        .collect();
    tried.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (winner, gap) = tried.first()?.clone();
    let left = (gap.max(0.0) / weight).sqrt();
    if gap > 0.1 * deficit || left > STATIC_INEXACTNESS * blocked || winner.peak < STATIC_PEAK * blocked {
        return None;
    }
    let floor = (0.5 * STATIC_INEXACTNESS * blocked).powi(2) * weight;
    let rivals = tried[1..]
        .iter()
        .map(|(t, g)| {
            let ratio = (gap.max(0.0) + floor) / (g.max(0.0) + floor);
            (t.candidate, ratio.powf(4.0), 0.0)
        })
        .filter(|r| r.1 > 0.02)
        .collect();
    let share = winner.gain / energy(&stiff.residual);
    Some(Taken { p: FAMILY_ALPHA, share, rivals, rms: left, trial: winner })
}

/// Tries to replace each effect taken by another beside the rest; a better one takes its place.
fn exchange(
    chosen: &mut [Trial],
    taken: &mut [Taken],
    rows: &mut Rows,
    library: &[Candidate],
    kind: Kind,
    full: &mut Baseline,
    traces: &mut Vec<Vec<f64>>,
) {
    for position in 0..chosen.len().saturating_sub(1) {
        let mut others: Vec<Trial> = chosen.to_vec();
        others.remove(position);
        let (without, _) = refit(rows, kind, &mut others, library);
        let best = best_of_each(&scan(library, rows, &without.basis, &without.residual), library);
        let own = best.iter().find(|t| t.candidate == chosen[position].candidate).map_or(0.0, |t| t.gain);
        let left = energy(&without.residual);
        let challenger = best
            .iter()
            .filter(|t| !chosen.iter().any(|c| c.candidate == t.candidate))
            .max_by(|a, b| a.gain.total_cmp(&b.gain));
        if let Some(c) = challenger {
            let refined = refine(c, library, rows, &without.basis, &without.residual);
            // It must leave clearly less than the present one does.
            if left - refined.gain < 0.8 * (left - own) {
                taken[position].rivals.retain(|r| r.0 != refined.candidate);
                taken[position].rivals.insert(0, (chosen[position].candidate, 0.1, 0.0));
                taken[position].trial = refined.clone();
                chosen[position] = refined;
            }
        }
        (*full, *traces) = refit(rows, kind, chosen, library);
    }
    for t in taken.iter_mut() {
        t.rms = full.rms(rows);
    }
}

/// Standard deviations of all parameters of the chosen effects by whole blocks: amplitudes exactly, shapes by their
/// linearised traces.
pub(crate) fn deviations(found: &Found, library: &[Candidate], rows: &Rows) -> Vec<Vec<Option<f64>>> {
    // Tangents: one column per free number.
    let mut tangents: Vec<Vec<f64>> = Vec::new();
    let mut place: Vec<(usize, usize)> = Vec::new();
    for (t, taken) in found.taken.iter().enumerate() {
        let trial = &taken.trial;
        let candidate = &library[trial.candidate];
        for (k, column) in candidate.columns(&trial.shapes, rows).into_iter().enumerate() {
            if trial.amplitudes[k] != 0.0 {
                tangents.push(column);
                place.push((t, k));
            }
        }
        let value = |shapes: &[f64]| {
            candidates::trace(&Trial { shapes: shapes.to_vec(), ..trial.clone() }, library, rows)
        };
        for (j, s) in trial.shapes.iter().enumerate() {
            let h = 0.02 * s.abs().max(1e-9);
            let (mut up, mut down) = (trial.shapes.clone(), trial.shapes.clone());
            up[j] += h;
            down[j] -= h;
            let (up, down) = (value(&up), value(&down));
            tangents.push(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * h)).collect());
            place.push((t, trial.amplitudes.len() + j));
        }
    }
    let mut result: Vec<Vec<Option<f64>>> =
        found.taken.iter().map(|t| vec![None; t.trial.amplitudes.len() + t.trial.shapes.len()]).collect();
    // The bare baseline's span, not the full one's, which holds the amplitudes themselves.
    let base = baselines::fit(rows, found.full.kind, &[]);
    let z: Vec<Vec<f64>> = super::linear::projected(&tangents, &rows.root_weight, &base.basis);
    let n = z.len();
    let gram: Vec<Vec<f64>> = z.iter().map(|a| z.iter().map(|b| dot(a, b)).collect()).collect();
    let all: Vec<usize> = (0..n).collect();
    for i in 0..n {
        // Row i of the inverse of the gram matrix, then the scatter of the blocks' scores along it.
        let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
        let Some(row) = super::linear::solve_symmetric(&gram, &unit, &all) else { continue };
        let mut per_block = vec![0.0; rows.blocks];
        for k in 0..rows.len() {
            let influence: f64 = row.iter().zip(&z).map(|(r, z)| r * z[k]).sum();
            per_block[rows.block[k] as usize] += influence * found.full.residual[k];
        }
        let m = rows.blocks.max(2) as f64;
        let variance = energy(&per_block) * m / (m - 1.0).max(1.0);
        let (t, k) = place[i];
        if variance.is_finite() {
            result[t][k] = Some(variance.sqrt());
        }
    }
    result
}
