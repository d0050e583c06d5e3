//! How far the cells of untouched recordings differ: a Gaussian covariance.

use nalgebra::DMatrix;

use super::cells::Cell;
use super::criteria::{CELL_ROWS, CELL_SLACK, REMOUNT, REPEATABILITY_PULLS, REPEATS};

/// What repeats: standard deviations in per cent of the largest force, learned by restricted maximum likelihood on untouched runs of the
/// development half and rounded; floors as stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Repeats {
    /// Slope per unit ln(time since mounting), own to a mounting.
    pub creep: f64,
    /// The same, common to all mountings.
    pub creep_common: f64,
    /// Slope per unit ln(time in the run), own: also how fast the branch is filled.
    pub within: f64,
    /// The same, common.
    pub within_common: f64,
    /// A run differs from the others.
    pub run: f64,
    /// A run number differs in all mountings.
    pub run_common: f64,
    /// All later runs differ from all earlier ones, per mounting.
    pub group: f64,
    /// The same, common.
    pub group_common: f64,
    /// The load cell's zero per run (floor; the estimate was 0.015).
    pub offset: f64,
    /// Residual of one cell (floor; the estimate was 0.042).
    pub cell: f64,
    /// Correlation length in pressure, share of the range.
    pub length: f64,
    /// Correlation between the directions.
    pub directions: f64,
}

fn centred(values: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    values.map(|v| v - mean).collect()
}

/// The elastic part of every cell, scaled to unit rms where the actuator pulls; zero elsewhere.
fn elastic(cells: &[Cell]) -> Vec<f64> {
    let pulls = |c: &&Cell| c.means.active > REPEATABILITY_PULLS;
    let count = cells.iter().filter(pulls).count();
    let square: f64 = cells.iter().filter(pulls).map(|c| c.means.elastic * c.means.elastic).sum();
    let rms = if count > 0 { (square / count as f64).sqrt().max(1e-9) } else { 1.0 };
    cells
        .iter()
        .map(|c| if c.means.active > REPEATABILITY_PULLS { c.means.elastic / rms } else { 0.0 })
        .collect()
}

/// What the covariance depends on beside the cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setting {
    /// Range of the pressure, Pa.
    pub range: f64,
    /// Largest force, N.
    pub largest: f64,
    /// Whether AFTER was remounted.
    pub remounted: bool,
    /// Whether the lengths are parts of one motion: then one mounting shifts them all.
    pub moving: bool,
}

/// Covariance of the cells if nothing was changed, N².
pub(super) fn covariance(cells: &[Cell], setting: &Setting) -> DMatrix<f64> {
    let Setting { range, largest, remounted, moving } = *setting;
    let r: &Repeats = &REPEATS;
    let unit = largest / 100.0;
    let mounted = centred(cells.iter().map(|c| c.means.mounted));
    let begun = centred(cells.iter().map(|c| c.means.begun));
    let elastic = elastic(cells);
    let square = |v: f64| v * v;
    let mut k = DMatrix::zeros(cells.len(), cells.len());
    for (i, a) in cells.iter().enumerate() {
        for (j, b) in cells.iter().enumerate().take(i + 1) {
            let one = |same: bool| f64::from(u8::from(same));
            let (mounting, run) = (one(a.mounting == b.mounting), one(a.run == b.run));
            let (number, side) = (one(a.number == b.number), one(a.after == b.after));
            let apart = (a.means.pressure - b.means.pressure) / range / r.length;
            let way = if a.direction * b.direction > 0.0 { 1.0 } else { r.directions };
            let base = a.means.active * b.means.active * (-0.5 * apart * apart).exp() * way;
            let (clocks, within) = (mounted[i] * mounted[j], begun[i] * begun[j]);
            let mut v = base
                * (clocks * (square(r.creep) * mounting + square(r.creep_common))
                    + within * (square(r.within) * mounting + square(r.within_common))
                    + square(r.run) * run
                    + square(r.run_common) * number
                    + square(r.group) * mounting * side
                    + square(r.group_common) * side);
            // The elastic part is what creeps: it does so as a whole, too.
            v += elastic[i]
                * elastic[j]
                * (clocks * square(r.creep_common) + square(r.run_common) * number + square(r.group) * side);
            if remounted {
                let clamped = if moving { 1.0 } else { mounting };
                v += square(REMOUNT / unit) * clamped * side * a.means.by_stroke * b.means.by_stroke;
            }
            v += square(r.offset) * run;
            if a.interpolated && b.interpolated && a.mounting == b.mounting && i != j {
                // An interpolation is wrong smoothly over the pressure.
                let both = (a.means.variance * b.means.variance).max(0.0).sqrt();
                v += both / square(unit) * (-0.5 * apart * apart).exp() * way;
            }
            if i == j {
                v += square(r.cell) * (CELL_SLACK + a.means.active) * (1.0 + CELL_ROWS / a.rows)
                    + a.means.variance / square(unit);
            }
            k[(i, j)] = v * square(unit);
            k[(j, i)] = k[(i, j)];
        }
    }
    k
}

/// What repeats at a typical pulling cell of one run against the mean of others, N: run, zero and cell together.
pub(super) fn spread(largest: f64, scale: f64) -> f64 {
    let r: &Repeats = &REPEATS;
    let sum =
        [r.run, r.run_common, r.group, r.group_common, r.offset, r.cell].map(|v| v * v).iter().sum::<f64>();
    largest / 100.0 * (scale * sum).sqrt()
}
