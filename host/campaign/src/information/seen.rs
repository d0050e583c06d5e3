//! The columns of everything recorded and of one step, beside a free table.

use model_core::effects::Context;
use nalgebra::{Cholesky, DMatrix, DVector};
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::protocol_simulation::moments;

use super::{Design, Past};
use crate::columns::{Where, columns_of_rows};
use crate::criteria::EFFECT_SIZE;
use crate::hypothesis::Hypothesis;
use crate::left_over::LeftOver;

/// Products of what the table leaves of the effects' columns, each of which has the largest value 1, and the table's errors.
#[derive(Clone)]
pub(super) struct View {
    pub(super) errors: Vec<f64>,
    pub(super) left: DMatrix<f64>,
}

/// The columns of everything recorded and a step.
pub(super) struct Seen<'a> {
    /// Over the past.
    pub(super) before: View,
    /// Over the past and the step.
    pub(super) after: View,
    /// Where the columns of each effect are.
    pub(super) places: &'a [Where],
    /// Largest value of each column of an effect before scaling; zero for a column without any.
    pub(super) peak: Vec<f64>,
    /// For each set, the force of each hypothesis as coefficients of the effects' columns.
    pub(super) traces: Vec<Vec<DVector<f64>>>,
}

impl<'a> Seen<'a> {
    /// The past, and a step after it.
    pub(super) fn of(design: &'a Design<'_>, step: Option<Recording>) -> Option<Self> {
        let past = design.shared.as_ref()?;
        let m = design.table.len();
        let mut peak = past.peak.clone();
        let mut together = None;
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
            let added = design.products(&rows, campaign.recordings.last().map(std::slice::from_ref)?);
            together = Some(LeftOver::of(&design.table, &(added + &past.gram))?);
        }
        let peak = peak.split_off(m);
        let scale: Vec<f64> = peak.iter().map(|p| if *p > 0.0 { 1.0 / p } else { 0.0 }).collect();
        let view = |left: &LeftOver| View { errors: left.errors.clone(), left: left.scaled(&scale) };
        let before = view(&past.left);
        let after = together.as_ref().map_or_else(|| before.clone(), view);
        let mut seen = Self { before, after, places: &past.places, peak, traces: Vec::new() };
        seen.traces = design.known.sets.iter().map(|set| traces(design, &seen, set, past)).collect();
        Some(seen)
    }
}

/// The force of each hypothesis of a set: the first as fitted, each other as it imitates the first best.
fn traces(design: &Design<'_>, seen: &Seen<'_>, set: &[Hypothesis], past: &Past) -> Vec<DVector<f64>> {
    let m = design.table.len();
    let product = |i: usize, j: usize| {
        let scale = |c: usize| if seen.peak[c] > 0.0 { 1.0 / seen.peak[c] } else { 0.0 };
        past.gram[(m + i, m + j)] * scale(i) * scale(j)
    };
    let mut out: Vec<DVector<f64>> = Vec::with_capacity(set.len());
    for hypothesis in set {
        let mut trace = DVector::zeros(seen.peak.len());
        let columns = design.library.index(hypothesis.law).map(|e| &seen.places[e]);
        let Some(columns) = columns else {
            out.push(trace);
            continue;
        };
        match (&hypothesis.parameters, out.first()) {
            (Some(values), None) => {
                let amplitudes = hypothesis.law.amplitudes().len();
                let shape =
                    columns.nearest(hypothesis.law, values.get(amplitudes..).unwrap_or_default(), &past.span);
                for (c, value) in shape.iter().zip(values) {
                    trace[*c - m] = value * seen.peak[*c - m];
                }
            }
            (_, Some(first)) => {
                let keep: Vec<usize> =
                    columns.first_shape().map(|c| c - m).filter(|c| seen.peak[*c] > 0.0).collect();
                let n = keep.len();
                let mut inner = DMatrix::from_fn(n, n, |i, j| product(keep[i], keep[j]));
                for i in 0..n {
                    inner[(i, i)] += 1e-9 + 1.0 / (design.known.blocked * design.known.blocked);
                }
                let image = |c: usize| first.iter().enumerate().map(|(k, v)| product(c, k) * v).sum::<f64>();
                let cross = DVector::from_fn(n, |i, _| image(keep[i]));
                if let Some(factor) = Cholesky::new(inner) {
                    let best = factor.solve(&cross);
                    keep.iter().zip(best.iter()).for_each(|(c, v)| trace[*c] = *v);
                }
            }
            (None, None) => {
                if let Some(c) = columns.first_shape().next() {
                    trace[*c - m] = EFFECT_SIZE * design.known.blocked;
                }
            }
        }
        out.push(trace);
    }
    out
}
