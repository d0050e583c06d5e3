//! Laws that replace a part of the base model, seen from a base that was fitted beside them.
//!
//! A play, a late reading, or a friction that builds up over a distance, is a law in the base's own slope and friction. A base that was fitted without it
//! has taken up a part of it: the friction of a loose joint's muscle then reads far too large, and the law, made from that friction, fits
//! badly and has a wrong width. Therefore each width is tried about a base that was fitted beside it, and once more about the base beside the best.

use rayon::prelude::*;

use super::baselines::{self, Kind};
use super::candidate_fit::CandidateFit;
use super::candidate_scoring::Scorer;
use super::candidates::Candidate;
use super::criteria::selection::{LEAST_SCORE, RENEWALS};
use super::rows::Rows;

/// Replaces the fits of such laws, where there is something that they explain, by better ones about bases beside them and `chosen`.
pub(super) fn renew(
    best: &mut [CandidateFit],
    chosen: &[CandidateFit],
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
) {
    let taken = |fit: &CandidateFit| chosen.iter().any(|c| c.candidate == fit.candidate);
    for fit in best.iter_mut() {
        let candidate = &library[fit.candidate];
        if candidate.traits.made_from_base && fit.score >= LEAST_SCORE && !taken(fit) {
            let renewed = renewed(fit, chosen, library, rows, scorer);
            if renewed.score > fit.score {
                *fit = renewed;
            }
        }
    }
}

/// The best fit of a candidate about bases that were fitted beside it.
fn renewed(
    first: &CandidateFit,
    chosen: &[CandidateFit],
    library: &[Candidate],
    rows: &Rows,
    scorer: &Scorer<'_>,
) -> CandidateFit {
    let candidate = &library[first.candidate];
    let others: Vec<Vec<f64>> =
        chosen.iter().flat_map(|c| sized(c, c.columns(library, rows)).collect::<Vec<_>>()).collect();
    let about = |fit: &CandidateFit| {
        let mut columns = others.clone();
        columns.extend(sized(fit, fit.columns(library, rows)));
        baselines::linearised(rows, &baselines::fit(rows, Kind::Stiff, &columns))
    };
    let mut shapes = candidate.grid();
    shapes.push(first.shapes.clone());
    let tried: Vec<CandidateFit> = shapes
        .into_par_iter()
        .map(|shapes| {
            let seen = about(&CandidateFit { shapes: shapes.clone(), about: None, ..first.clone() });
            scorer.fit(first.candidate, candidate, &shapes, &seen, false).seen_from(seen)
        })
        .collect();
    let Some(mut best) = tried.into_iter().max_by(|a, b| a.score.total_cmp(&b.score)) else {
        return first.clone();
    };
    for _ in 0..RENEWALS {
        let seen = about(&best);
        let again = scorer.refine(&best, library, &seen).seen_from(seen);
        if !(again.score > best.score) {
            break;
        }
        best = again;
    }
    // With its scores block by block.
    match &best.about {
        Some(seen) => scorer.fit(best.candidate, candidate, &best.shapes, seen, true).seen_from(seen.clone()),
        None => best,
    }
}

/// The columns of a fit that have an amplitude.
fn sized(fit: &CandidateFit, columns: Vec<Vec<f64>>) -> impl Iterator<Item = Vec<f64>> + '_ {
    let used = |k: &usize| fit.amplitudes.get(*k).is_some_and(|a| *a != 0.0);
    columns.into_iter().enumerate().filter(move |(k, _)| used(k)).map(|(_, c)| c)
}
