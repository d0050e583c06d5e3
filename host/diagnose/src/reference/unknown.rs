//! A smooth change of the force in AFTER that no name describes, and what one mounting does alone.

use nalgebra::{DMatrix, DVector};

use super::cells::Cell;
use super::contrast::{Contrast, log_mean};
use super::criteria::{GATE_MOUNTINGS, SIZES, UNKNOWN_LEAST, UNKNOWN_SMOOTH};

/// What a free surface takes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unknown {
    /// Log evidence that holds without any one mounting.
    pub log: f64,
    /// The mounting with the most evidence alone, with the log evidence that is lost without it.
    pub local: Option<(usize, f64)>,
}

/// The free surfaces of one mounting as columns.
fn columns(cells: &[Cell], mounting: usize, range: f64) -> Option<DMatrix<f64>> {
    let own: Vec<usize> =
        (0..cells.len()).filter(|i| cells[*i].after && cells[*i].mounting == mounting).collect();
    let covariance = |i: usize, j: usize| {
        let (a, b) = (&cells[own[i]], &cells[own[j]]);
        let apart = (a.means.pressure - b.means.pressure) / range / UNKNOWN_SMOOTH.0;
        (-0.5 * apart * apart).exp() * if a.direction * b.direction > 0.0 { 1.0 } else { UNKNOWN_SMOOTH.1 }
    };
    let eigen = DMatrix::from_fn(own.len(), own.len(), covariance).try_symmetric_eigen(1e-12, 10_000)?;
    let top = eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..own.len()).filter(|i| eigen.eigenvalues[*i] > UNKNOWN_LEAST * top).collect();
    let mut all = DMatrix::zeros(cells.len(), kept.len());
    for (column, k) in kept.iter().enumerate() {
        for (row, cell) in own.iter().enumerate() {
            all[(*cell, column)] = eigen.eigenvectors[(row, *k)] * eigen.eigenvalues[*k].sqrt();
        }
    }
    Some(all)
}

fn weigh(
    inner: &DMatrix<f64>,
    moment: &DVector<f64>,
    keep: &[usize],
    scale: f64,
    largest: f64,
) -> Option<f64> {
    let m = inner.select_rows(keep).select_columns(keep);
    let eigen = m.try_symmetric_eigen(1e-12, 10_000)?;
    let b = eigen.eigenvectors.tr_mul(&moment.select_rows(keep));
    let each: Vec<f64> = SIZES[..3]
        .iter()
        .map(|size| {
            let t = (size * largest).powi(2) / scale;
            let one = |(mu, b): (&f64, &f64)| {
                let grown = 1.0 + t * mu.max(0.0);
                -0.5 * grown.ln() + 0.5 * t * b * b / grown / scale
            };
            eigen.eigenvalues.iter().zip(b.iter()).map(one).sum()
        })
        .collect();
    Some(log_mean(&each))
}

/// Weighs the unknown change.
pub(super) fn weighed(cells: &[Cell], contrast: &Contrast, range: f64, largest: f64) -> Option<Unknown> {
    let scale = contrast.scale();
    let mut mountings: Vec<usize> = cells.iter().filter(|c| c.after).map(|c| c.mounting).collect();
    mountings.sort_unstable();
    mountings.dedup();
    let mut blocks = Vec::new();
    let mut owner = Vec::new();
    for m in &mountings {
        let block = columns(cells, *m, range)?;
        owner.extend(std::iter::repeat_n(*m, block.ncols()));
        blocks.extend(block.column_iter().map(|c| c.into_owned()));
    }
    if blocks.is_empty() {
        return None;
    }
    let v = DMatrix::from_columns(&blocks);
    let inner = v.tr_mul(&(&contrast.projector * &v));
    let moment = v.tr_mul(&contrast.projected);
    let every: Vec<usize> = (0..owner.len()).collect();
    let full = weigh(&inner, &moment, &every, scale, largest)?;
    if mountings.len() < GATE_MOUNTINGS {
        return Some(Unknown { log: full, local: None });
    }
    let mut least: Option<(usize, f64)> = None;
    for m in mountings {
        let keep: Vec<usize> = every.iter().copied().filter(|i| owner[*i] != m).collect();
        let without = weigh(&inner, &moment, &keep, scale, largest)?;
        if least.is_none_or(|(_, l)| without < l) {
            least = Some((m, without));
        }
    }
    let (m, without) = least?;
    Some(Unknown { log: full.min(without), local: Some((m, full - without)) })
}
