//! How much of the difference is gone on recordings that the sizes were not fitted to.

use nalgebra::{DMatrix, DVector};

use super::cells::Cell;
use super::contrast::Contrast;

/// What AFTER differs by from what was to be expected without a change, N: one value for each cell of AFTER, in order.
pub(super) fn difference(cells: &[Cell], contrast: &Contrast) -> DVector<f64> {
    let after: Vec<usize> = (0..cells.len()).filter(|i| cells[*i].after).collect();
    let mut inner = contrast.projector.select_columns(&after).select_rows(&after);
    let floor = 1e-9 * inner.diagonal().max().max(f64::MIN_POSITIVE);
    for i in 0..after.len() {
        inner[(i, i)] += floor;
    }
    let projected = contrast.projected.select_rows(&after);
    inner.cholesky().map_or_else(|| DVector::zeros(after.len()), |f| f.solve(&projected))
}

/// Root mean squares before and after, N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Unseen {
    pub before: f64,
    pub after: f64,
    /// Whether the recordings were held out at all: with one recording they cannot be.
    pub held: bool,
}

impl Unseen {
    /// Share of the difference's energy that is gone.
    pub fn share(&self) -> f64 {
        if self.before > 0.0 { (1.0 - (self.after / self.before).powi(2)).clamp(-1.0, 1.0) } else { 0.0 }
    }
}

/// Sizes by generalised least squares of the shapes' columns.
fn sizes(contrast: &Contrast, shapes: &DMatrix<f64>) -> Option<DVector<f64>> {
    let inner = shapes.tr_mul(&(&contrast.projector * shapes));
    Some(inner.cholesky()?.solve(&shapes.tr_mul(&contrast.projected)))
}

/// Fits the shapes to every other run of AFTER and judges them on the rest, both ways.
pub(super) fn unseen(cells: &[Cell], contrast: &Contrast, shapes: &[DVector<f64>]) -> Unseen {
    let difference = difference(cells, contrast);
    let after: Vec<usize> = (0..cells.len()).filter(|i| cells[*i].after).collect();
    let rms = |v: &DVector<f64>| (v.norm_squared() / v.len().max(1) as f64).sqrt();
    let before = rms(&difference);
    if shapes.is_empty() {
        return Unseen { before, after: before, held: false };
    }
    let columns: Vec<DVector<f64>> = shapes.iter().map(|s| s / s.amax().max(f64::MIN_POSITIVE)).collect();
    let shapes = DMatrix::from_columns(&columns);
    let mut runs: Vec<usize> = after.iter().map(|i| cells[*i].run).collect();
    runs.dedup();
    let fold = |i: usize| runs.iter().position(|r| *r == cells[i].run).unwrap_or(0) % 2;
    let held = runs.len() > 1;
    let mut left = difference.clone();
    for side in 0..if held { 2 } else { 1 } {
        let dropped: Vec<usize> =
            if held { after.iter().copied().filter(|i| fold(*i) == side).collect() } else { Vec::new() };
        let Some(found) = contrast.without_cells(&dropped).and_then(|c| sizes(&c, &shapes)) else { continue };
        for (k, i) in after.iter().enumerate().filter(|(_, i)| !held || fold(**i) == side) {
            left[k] -= (0..shapes.ncols()).map(|c| shapes[(*i, c)] * found[c]).sum::<f64>();
        }
    }
    Unseen { before, after: rms(&left), held }
}
