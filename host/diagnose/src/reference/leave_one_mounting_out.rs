//! A change of bench or actuator shows in every mounting: what would not stand without one of them counts only what the others say.

use nalgebra::DVector;

use super::cells::Cell;
use super::contrast::{Contrast, evidence};
use super::criteria::{GATE, GATE_MOUNTINGS, GATE_WORTH_ASKING};
use super::shapes::Change;

/// A named change with its evidence over none.
pub(super) struct WeighedChange<'a> {
    pub change: Change,
    /// Normalised to unit rms over AFTER.
    pub shape: &'a DVector<f64>,
    /// Log evidence over no change.
    pub log: f64,
    /// Whether it begins within AFTER.
    pub begins: bool,
}

/// Limits the log evidences. With fewer than three mountings there is no limit.
pub(super) fn limit(cells: &[Cell], contrast: &Contrast, changes: &mut [WeighedChange<'_>], sizes: &[f64]) {
    let mut mountings: Vec<usize> = cells.iter().filter(|c| c.after).map(|c| c.mounting).collect();
    mountings.sort_unstable();
    mountings.dedup();
    let candidates: Vec<usize> = (0..changes.len()).filter(|i| changes[*i].log > GATE_WORTH_ASKING).collect();
    if mountings.len() < GATE_MOUNTINGS || candidates.is_empty() {
        return;
    }
    let mut worst = vec![f64::INFINITY; changes.len()];
    for m in mountings {
        let dropped: Vec<usize> =
            (0..cells.len()).filter(|i| cells[*i].after && cells[*i].mounting == m).collect();
        let Some(without) = contrast.without_cells(&dropped) else { continue };
        let scale = without.scale();
        for &i in &candidates {
            let mut shape = changes[i].shape.clone();
            dropped.iter().for_each(|d| shape[*d] = 0.0);
            let (a, b) = without.products(&shape);
            let log = evidence(a, b, scale, sizes);
            worst[i] = worst[i].min(if log.is_finite() { log } else { 0.0 });
        }
    }
    let strong = GATE.ln();
    let best = candidates.iter().map(|i| worst[*i]).fold(f64::NEG_INFINITY, f64::max);
    for &i in &candidates {
        // This tests the presence of a change of this kind: it limits every name or none. Only what begins within AFTER
        // may lie at its end, where one mounting shows it.
        let limited = best < strong || (changes[i].begins && worst[i] < strong);
        if limited {
            changes[i].log = changes[i].log.min(worst[i]);
        }
    }
}
