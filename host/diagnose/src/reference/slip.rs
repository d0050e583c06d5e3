//! A step of the length within AFTER, at a moment that is looked for.

use nalgebra::DVector;

use super::cells::Cell;
use super::contrast::{Contrast, evidence, log_mean};
use super::criteria::{SLIP_PART, STEP_STARTS};

/// The step that fits best.
#[derive(Debug, Clone)]
pub(super) struct Slip {
    /// ∂F/∂x from then on, not normalised.
    pub shape: DVector<f64>,
    /// Log evidence over all starts.
    pub log: f64,
}

/// Root mean square over the cells of AFTER.
pub(super) fn rms_after(cells: &[Cell], shape: &DVector<f64>) -> f64 {
    let own = || cells.iter().zip(shape.iter()).filter(|(c, _)| c.after);
    let count = own().count().max(1) as f64;
    (own().map(|(_, s)| s * s).sum::<f64>() / count).sqrt()
}

/// First and middle moments of every run of AFTER.
fn starts(cells: &[Cell]) -> Vec<f64> {
    let mut runs: std::collections::BTreeMap<usize, Vec<f64>> = std::collections::BTreeMap::new();
    for c in cells.iter().filter(|c| c.after) {
        runs.entry(c.run).or_default().push(c.means.clock);
    }
    let mut all: Vec<f64> = runs
        .values()
        .flat_map(|t| {
            let first = t.iter().copied().fold(f64::INFINITY, f64::min);
            [first, t.iter().sum::<f64>() / t.len() as f64]
        })
        .filter(|t| *t > SLIP_PART.0 && *t < SLIP_PART.1)
        .collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    if all.len() > STEP_STARTS {
        let last = (all.len() - 1) as f64;
        let pick = |i: usize| (last * i as f64 / (STEP_STARTS - 1) as f64) as usize;
        all = (0..STEP_STARTS).map(|i| all[pick(i)]).collect();
    }
    all
}

/// Weighs a step at every start; `None` where no start or no slope over the length is there.
pub(super) fn search(cells: &[Cell], contrast: &Contrast, scale: f64, sizes: &[f64]) -> Option<Slip> {
    let mut logs = Vec::new();
    let mut best: Option<(f64, DVector<f64>)> = None;
    for start in starts(cells) {
        let on = |c: &Cell| if c.after && c.means.clock >= start { c.means.step_by_stroke } else { 0.0 };
        let shape = DVector::from_iterator(cells.len(), cells.iter().map(on));
        let rms = rms_after(cells, &shape);
        if !(rms > 0.0) {
            continue;
        }
        let (a, b) = contrast.products(&(&shape / rms));
        let log = evidence(a, b, scale, sizes);
        logs.push(log);
        if best.as_ref().is_none_or(|(l, _)| log > *l) {
            best = Some((log, shape));
        }
    }
    best.map(|(_, shape)| Slip { shape, log: log_mean(&logs) })
}
