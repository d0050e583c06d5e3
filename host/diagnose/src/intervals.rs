//! Confidence intervals of the parameters of the selected effects.
//!
//! Noise is the smaller part of it. Model error repeats itself from stroke to stroke and looks like certainty: it shows where parts of the
//! campaign that ideally agree do not, and laws themselves are not exact. So the variance of a parameter is
//!
//! ```text
//! s² = max(half-strokes, pressures, recordings, quarters of the time) + (0.07 θ)²
//! ```
//! where the first is the scatter of whole half-strokes' scores and the next three are jackknives over groups left out. The last is what a
//! law is off by where another law of the same thing made the recordings: of 57 effects given by name (two development sets of trials) 35
//! intervals of 95 % held the truth by half-strokes alone, 45 with the groups, 53 with both. A change point has an interval [of its own](super::change_point).

use pam_fit::numerics::jackknife::variances;
use rayon::prelude::*;

use super::baselines;
use super::candidate_fit::{self, CandidateFit};
use super::candidates::Candidate;
use super::change_point;
use super::criteria::rows::MOST_LEVELS;
use super::criteria::uncertainty::{FEWEST_GROUPS, FOLDS, IDENTIFIABLE, LAW_DEVIATION, TANGENT_STEP};
use super::cross_validation::downsample;
use super::linear::{Basis, dot, energy, solve_symmetric};
use super::rows::Rows;
use super::selection_step::Selection;

/// One free number of the named effects, with what the force changes by per unit of it.
struct Tangent {
    effect: usize,
    parameter: usize,
    column: Vec<f64>,
}

fn tangents(selection: &Selection, library: &[Candidate], rows: &Rows) -> Vec<Tangent> {
    let mut tangents = Vec::new();
    for (effect, selected) in selection.selected.iter().enumerate() {
        let fit = &selected.fit;
        let candidate = &library[fit.candidate];
        let sized = fit.amplitudes.iter().map(|a| *a != 0.0).collect::<Vec<_>>();
        if !sized.contains(&true) {
            continue;
        }
        for (parameter, column) in candidate.columns(&fit.shapes, rows).into_iter().enumerate() {
            if sized[parameter] {
                tangents.push(Tangent { effect, parameter, column });
            }
        }
        let value = |shapes: &[f64]| {
            candidate_fit::trace(&CandidateFit { shapes: shapes.to_vec(), ..fit.clone() }, library, rows)
        };
        let moment = change_point::place(candidate, fit);
        for (j, s) in fit.shapes.iter().enumerate().filter(|(j, _)| moment != Some(*j)) {
            let h = TANGENT_STEP * s.abs().max(1e-9);
            let (mut up, mut down) = (fit.shapes.clone(), fit.shapes.clone());
            up[j] += h;
            down[j] -= h;
            let (up, down) = (value(&up), value(&down));
            let column: Vec<f64> = up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * h)).collect();
            // Of laws to choose from, the others' shapes move nothing.
            if column.iter().all(|c| *c == 0.0) {
                continue;
            }
            tangents.push(Tangent { effect, parameter: fit.amplitudes.len() + j, column });
        }
    }
    tangents
}

/// Standard deviations of all parameters of the chosen effects; none where the recordings do not determine it.
pub(crate) fn deviations(selection: &Selection, library: &[Candidate], rows: &Rows) -> Vec<Vec<Option<f64>>> {
    let tangents = tangents(selection, library, rows);
    let mut result: Vec<Vec<Option<f64>>> =
        selection.selected.iter().map(|t| vec![None; t.fit.amplitudes.len() + t.fit.shapes.len()]).collect();
    if tangents.is_empty() {
        return result;
    }
    let by_strokes = by_strokes(selection, &tangents, rows);
    let by_groups = by_groups(selection, &tangents, rows);
    for (i, t) in tangents.iter().enumerate() {
        let Some(strokes) = by_strokes[i] else { continue };
        let fit = &selection.selected[t.effect].fit;
        let value = fit.amplitudes.iter().chain(&fit.shapes).nth(t.parameter).copied().unwrap_or(0.0);
        let variance = strokes.max(by_groups[i]) + (LAW_DEVIATION * value).powi(2);
        if variance.is_finite() {
            result[t.effect][t.parameter] = Some(variance.sqrt());
        }
    }
    for (deviations, selected) in result.iter_mut().zip(&selection.selected) {
        let fit = &selected.fit;
        if let Some(shape) = change_point::place(&library[fit.candidate], fit) {
            deviations[fit.amplitudes.len() + shape] =
                change_point::deviation(selection, selected, shape, library, rows);
        }
    }
    result
}

/// Standard deviation of the size of each chosen effect, as a share of it: of its whole trace, its shape as fitted, beside all others. Single
/// parameters may trade against each other where the size of the trace is sure. None where the other effects make the same trace.
pub(crate) fn size_deviations(selection: &Selection, rows: &Rows) -> Vec<Option<f64>> {
    let tangents: Vec<Tangent> = selection
        .traces
        .iter()
        .enumerate()
        .map(|(effect, trace)| Tangent { effect, parameter: 0, column: trace.clone() })
        .collect();
    if tangents.is_empty() {
        return Vec::new();
    }
    // Half-strokes are independent units of a muscle that moves. Those of one held length share the static error of the model there.
    let strokes = by_strokes(selection, &tangents, rows);
    let groups =
        if rows.isometric { by_groups(selection, &tangents, rows) } else { vec![0.0; tangents.len()] };
    strokes.iter().zip(groups).map(|(s, groups)| s.map(|s| s.max(groups).sqrt())).collect()
}

/// Variances by the scatter of whole half-strokes: amplitudes exactly, shapes by their linearised traces.
fn by_strokes(selection: &Selection, tangents: &[Tangent], rows: &Rows) -> Vec<Option<f64>> {
    // The bare baseline's span, not the full one's, which holds the amplitudes themselves.
    let base = baselines::fit(rows, selection.joint.kind, &[]);
    let columns: Vec<Vec<f64>> = tangents.iter().map(|t| t.column.clone()).collect();
    let z: Vec<Vec<f64>> = baselines::projected(&columns, rows.root_weight(), &base.span);
    let n = z.len();
    let mut apart = Basis::default();
    let identifiable: Vec<bool> = z.iter().map(|z| apart.push_beyond(z.clone(), IDENTIFIABLE)).collect();
    let gram: Vec<Vec<f64>> = z.iter().map(|a| z.iter().map(|b| dot(a, b)).collect()).collect();
    let kept: Vec<usize> = (0..n).filter(|i| identifiable[*i]).collect();
    (0..n)
        .map(|i| {
            if !identifiable[i] {
                return None;
            }
            // Its row of the inverse of the gram matrix, then the scatter of the blocks' scores along it.
            let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
            let row = solve_symmetric(&gram, &unit, &kept)?;
            let mut per_block = vec![0.0; rows.blocks];
            for k in 0..rows.len() {
                let influence: f64 = row.iter().zip(&kept).map(|(r, j)| r * z[*j][k]).sum();
                per_block[rows.block[k] as usize] += influence * selection.joint.residual[k];
            }
            let m = rows.blocks.max(2) as f64;
            let variance = energy(&per_block) * m / (m - 1.0).max(1.0);
            variance.is_finite().then_some(variance)
        })
        .collect()
}

/// Variances with a pressure, a recording or a quarter of the time left out: the largest of the three jackknives.
fn by_groups(selection: &Selection, tangents: &[Tangent], rows: &Rows) -> Vec<f64> {
    let mut columns: Vec<Vec<f64>> = tangents.iter().map(|t| t.column.clone()).collect();
    columns.extend(selection.traces.iter().cloned());
    let (downsampled, mut columns) = downsample(rows, &columns);
    // The remaining distance to the tangents is the error of the estimate.
    let mut force = downsampled.force.clone();
    for trace in columns.split_off(tangents.len()) {
        force.iter_mut().zip(&trace).for_each(|(f, t)| *f -= t);
    }
    let downsampled = downsampled.with_force(force);
    let moved = |rows: &Rows| baselines::fit(rows, selection.joint.kind, &columns).amplitudes;
    let quarter = downsampled.blocks.div_ceil(FOLDS as usize).max(1) as u32;
    let quarters: Vec<u32> = downsampled.block.iter().map(|b| b / quarter).collect();
    let mut largest = vec![0.0_f64; tangents.len()];
    for grouping in [&downsampled.level, &downsampled.recording, &quarters] {
        let variances = by_group(&downsampled, grouping, &moved);
        largest.iter_mut().zip(variances).for_each(|(l, v)| *l = l.max(v));
    }
    largest
}

/// Jackknife variances of estimates, one group left out at a time; empty where there are too few groups, or too many.
fn by_group(rows: &Rows, group: &[u32], estimate: &(dyn Fn(&Rows) -> Vec<f64> + Sync)) -> Vec<f64> {
    let seen = group.iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0);
    let mut groups: Vec<u32> = seen.map(|(g, _)| *g).collect();
    groups.sort_unstable();
    groups.dedup();
    if !(FEWEST_GROUPS..=MOST_LEVELS).contains(&groups.len()) {
        return Vec::new();
    }
    let without: Vec<Vec<f64>> =
        groups.par_iter().map(|g| estimate(&rows.without(|i| group[i] == *g))).collect();
    variances(&without)
}
