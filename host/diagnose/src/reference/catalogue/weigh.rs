//! How strongly the cells support each effect of the catalogue as the change.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::super::contrast::{log_mean, log_sum};
use super::super::criteria::{
    CATALOGUE_LAW_ERROR, CATALOGUE_REFINED, CATALOGUE_USUAL, MOST_CHANGES, NAMED, PRIOR_UNKNOWN, SIZES,
};
use super::super::shapes::{Change, Class};
use super::cells::Cells;
use crate::candidates::{Candidate, library};

/// One effect at its best shape.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub change: Change,
    /// Log evidence over no change.
    pub log: f64,
    /// Its parameters of either kind: name, unit, value, standard deviation; amplitudes first.
    pub parameters: Vec<(&'static str, &'static str, f64, f64)>,
    /// Its columns, N per unit.
    columns: Vec<DVector<f64>>,
    /// What it adds to the cells, N.
    pub trace: DVector<f64>,
    shapes: Vec<f64>,
}

/// A change that is named.
#[derive(Debug, Clone)]
pub(super) struct Accepted {
    pub fit: Fit,
    pub probability: f64,
    pub class_probability: f64,
    /// Other names that are possible.
    pub competitors: Vec<Change>,
}

/// What was found.
pub(super) struct Weighed {
    /// Of the first round: `none`, `unknown` and every effect.
    pub probabilities: Vec<(String, f64)>,
    pub none: f64,
    /// Probability of no further change after the last name.
    pub last_none: f64,
    pub accepted: Vec<Accepted>,
    /// Every effect as the only change.
    pub alone: Vec<Fit>,
}

/// The metric of the cells: `Π = D⁻¹ − D⁻¹Z(I + Z'D⁻¹Z)⁻¹Z'D⁻¹`, D the cells' own variance, Z what may differ without a change.
struct Metric {
    inverse: DVector<f64>,
    z: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl Metric {
    fn of(cells: &Cells, taken: &[DVector<f64>]) -> Self {
        let n = cells.cells.len();
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let unit = CATALOGUE_USUAL * cells.largest;
        let recordings = cells.cells.iter().map(|c| c.recording + 1).max().unwrap_or(0);
        for recording in 0..recordings {
            let own =
                |i: usize, _| if cells.cells[i].recording == recording { unit } else { 0.0 };
            columns.push(DVector::from_fn(n, own));
        }
        // The whole campaign: gain, zero of the gauge, stroke, friction; each by the usual difference.
        let contexts = cells.rows.contexts();
        let of_rows = |value: &dyn Fn(usize) -> f64| {
            let column: Vec<f64> = (0..contexts.len()).map(value).collect();
            cells.means(&column)
        };
        let usual = [
            of_rows(&|i| contexts[i].quasi),
            of_rows(&|i| contexts[i].pull_per_pressure()),
            of_rows(&|i| contexts[i].stiffness),
            of_rows(&|i| contexts[i].quasi * contexts[i].direction),
        ];
        for column in usual {
            let peak = column.amax();
            if peak > 0.0 && peak.is_finite() {
                columns.push(column * (unit / peak));
            }
        }
        for column in taken {
            let size = column.amax();
            if size > 0.0 {
                columns.push(column * (1e3 * cells.largest / size));
            }
        }
        let z = if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) };
        let inverse = cells.variance.map(|v| 1.0 / v);
        let mut weighted = z.clone();
        for (i, w) in inverse.iter().enumerate() {
            weighted.row_mut(i).scale_mut(*w);
        }
        let inner = DMatrix::identity(z.ncols(), z.ncols()) + z.tr_mul(&weighted);
        Self { inverse, z, factor: inner.cholesky() }
    }

    fn apply(&self, v: &DVector<f64>) -> DVector<f64> {
        let weighted = v.component_mul(&self.inverse);
        let Some(factor) = &self.factor else { return weighted };
        let back = &self.z * factor.solve(&self.z.tr_mul(&weighted));
        weighted - back.component_mul(&self.inverse)
    }
}

/// An effect at one set of shapes; `None` where the cells do not show it.
fn fit(
    cells: &Cells,
    metric: &Metric,
    projected: &DVector<f64>,
    candidate: &Candidate,
    shapes: &[f64],
) -> Option<Fit> {
    let columns: Vec<DVector<f64>> =
        candidate.columns(shapes, &cells.rows).iter().map(|c| cells.means(c)).collect();
    let n = cells.cells.len() as f64;
    let rms: Vec<f64> = columns.iter().map(|c| (c.norm_squared() / n).sqrt()).collect();
    let live: Vec<usize> = (0..columns.len()).filter(|k| rms[*k] > 0.0 && rms[*k].is_finite()).collect();
    if live.is_empty() {
        return None;
    }
    let unit: Vec<DVector<f64>> = live.iter().map(|k| &columns[*k] / rms[*k]).collect();
    let u = DMatrix::from_columns(&unit);
    let images: Vec<DVector<f64>> = unit.iter().map(|c| metric.apply(c)).collect();
    let g = u.tr_mul(&DMatrix::from_columns(&images));
    let b = u.tr_mul(projected);
    let k = live.len();
    let prior = |size: f64| (size * cells.largest).powi(2) / k as f64;
    let mut each = Vec::new();
    let mut best: Option<(f64, DVector<f64>, DMatrix<f64>)> = None;
    for size in SIZES {
        let t = prior(size);
        let inner = (&g + DMatrix::identity(k, k) / t).cholesky()?;
        let mean = inner.solve(&b);
        let spread: f64 = inner.l_dirty().diagonal().iter().map(|v| 2.0 * v.ln()).sum();
        let log = -0.5 * (spread + k as f64 * t.ln()) + 0.5 * b.dot(&mean);
        if log.is_finite() && best.as_ref().is_none_or(|o| log > o.0) {
            best = Some((log, mean, inner.inverse()));
        }
        each.push(log);
    }
    let (_, mean, covariance) = best?;
    let log = log_mean(&each);
    if !log.is_finite() {
        return None;
    }
    let trace = &u * &mean;
    let mut parameters: Vec<_> = Vec::new();
    let amplitudes = candidate.info.parameters.iter().filter(|p| {
        matches!(p.role, model_core::effects::Role::Amplitude)
    });
    for (i, p) in amplitudes.enumerate() {
        let (value, std) = live.iter().position(|l| *l == i).map_or((0.0, 0.0), |j| {
            (mean[j] / rms[i], covariance[(j, j)].max(0.0).sqrt() / rms[i])
        });
        parameters.push((p.name, p.unit, value, std));
    }
    parameters.extend(candidate.shapes().zip(shapes).map(|(p, s)| (p.name, p.unit, *s, 0.0)));
    let change = Change::from_name(candidate.name())?;
    let columns = live.iter().map(|k| columns[*k].clone()).collect();
    Some(Fit { change, log, parameters, columns, trace, shapes: shapes.to_vec() })
}

/// The best shape of one effect, and its evidence as a mean over the grid.
fn scan(
    cells: &Cells,
    metric: &Metric,
    projected: &DVector<f64>,
    candidate: &Candidate,
) -> Option<Fit> {
    let grid = candidate.grid();
    let fits: Vec<Fit> =
        grid.iter().filter_map(|shapes| fit(cells, metric, projected, candidate, shapes)).collect();
    let logs: Vec<f64> = fits.iter().map(|f| f.log).collect();
    let mean = log_sum(&logs) - (grid.len().max(1) as f64).ln();
    let mut best = fits.into_iter().max_by(|a, b| a.log.total_cmp(&b.log))?;
    let (coarse, mut step) = (best.log, 0.06);
    for _ in 0..CATALOGUE_REFINED {
        let near = candidate.neighbours(&best.shapes, step);
        let better = near
            .iter()
            .filter_map(|shapes| fit(cells, metric, projected, candidate, shapes))
            .max_by(|a, b| a.log.total_cmp(&b.log))
            .filter(|f| f.log > best.log);
        match better {
            Some(f) => best = f,
            None => step /= 2.0,
        }
    }
    // What refinement gains is gained on a part of the grid's cell.
    best.log = mean + (best.log - coarse);
    Some(best)
}

/// A change of each state by itself, which no law ties together.
fn unknown(cells: &Cells, difference: &DVector<f64>) -> f64 {
    let mut groups: BTreeMap<_, (f64, f64)> = BTreeMap::new();
    for (i, cell) in cells.cells.iter().enumerate() {
        let (level, sign, bin, _) = cell.key;
        let g = groups.entry((level, sign, bin)).or_insert((0.0, 0.0));
        *g = (g.0 + 1.0 / cells.variance[i], g.1 + difference[i] / cells.variance[i]);
    }
    let own = (CATALOGUE_USUAL * cells.largest).powi(2);
    let each: Vec<f64> = SIZES[..3]
        .iter()
        .map(|size| {
            let t = (size * cells.largest).powi(2);
            let one = |(w, s): &(f64, f64)| {
                let (v, d) = (1.0 / w + own, s / w);
                -0.5 * (t / v).ln_1p() + 0.5 * d * d * t / (v * (v + t))
            };
            groups.values().map(one).sum()
        })
        .collect();
    log_mean(&each)
}

/// One weighing.
struct Round {
    none: f64,
    unknown: f64,
    fits: Vec<(Fit, f64)>,
    /// Log evidence of the best, before tempering.
    best: f64,
}

impl Round {
    fn of(cells: &Cells, candidates: &[Candidate], taken: &[DVector<f64>], none: f64, first: f64) -> Self {
        let metric = Metric::of(cells, taken);
        let projected = metric.apply(&cells.difference);
        let mut fits: Vec<Fit> =
            candidates.par_iter().filter_map(|c| scan(cells, &metric, &projected, c)).collect();
        fits.sort_by(|a, b| b.log.total_cmp(&a.log).then(a.change.cmp(&b.change)));
        let best = fits.first().map_or(0.0, |f| f.log);
        // A law that is wrong by a share of its size leaves that share of what it explains: evidence counts as with a variance larger
        // by so much.
        let factor = 1.0 + 2.0 * CATALOGUE_LAW_ERROR * CATALOGUE_LAW_ERROR * best.max(first).max(0.0);
        let unknown_log = if taken.is_empty() { unknown(cells, &cells.difference) } else { f64::NEG_INFINITY };
        let top = best.max(unknown_log).max(0.0);
        let tempered = |log: f64| top - (top - log) / factor;
        let share = (1.0 - none - PRIOR_UNKNOWN).max(1e-3) / fits.len().max(1) as f64;
        let logs: Vec<f64> = [none.ln() + tempered(0.0), PRIOR_UNKNOWN.ln() + tempered(unknown_log)]
            .into_iter()
            .chain(fits.iter().map(|f| share.ln() + tempered(f.log)))
            .collect();
        let total = log_sum(&logs);
        let p: Vec<f64> = logs.iter().map(|l| (l - total).exp()).collect();
        Self {
            none: p[0],
            unknown: p[1],
            fits: fits.into_iter().zip(p[2..].iter().copied()).collect(),
            best,
        }
    }

    fn class(&self, class: Class) -> f64 {
        self.fits.iter().filter(|(f, _)| f.change.stroke_class() == class).map(|(_, p)| p).sum()
    }

    /// The best name of the class that is more probable than not.
    fn leader(&self) -> Option<Accepted> {
        let (fit, probability) = self.fits.iter().max_by(|a, b| {
            let weight = |(f, p): &(Fit, f64)| {
                (self.class(f.change.stroke_class()) >= NAMED, *p)
            };
            let (a, b) = (weight(a), weight(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })?;
        let class_probability = self.class(fit.change.stroke_class());
        if !(class_probability >= NAMED) {
            return None;
        }
        let mut order: Vec<&(Fit, f64)> = self.fits.iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let others = order.into_iter().filter(|(f, p)| f.change != fit.change && *p >= 0.02);
        Some(Accepted {
            fit: fit.clone(),
            probability: *probability,
            class_probability,
            competitors: others.map(|(f, _)| f.change).collect(),
        })
    }
}

/// Weighs every effect of the catalogue; `none`: prior probability that nothing changed.
pub(super) fn weigh(cells: &Cells, none: f64) -> Weighed {
    let candidates: Vec<Candidate> = library(&cells.rows, &[]);
    let mut accepted: Vec<Accepted> = Vec::new();
    let mut taken: Vec<DVector<f64>> = Vec::new();
    let first = Round::of(cells, &candidates, &taken, none, 0.0);
    let mut probabilities: Vec<(String, f64)> =
        first.fits.iter().map(|(f, p)| (f.change.name().to_owned(), *p)).collect();
    probabilities.push(("none".into(), first.none));
    probabilities.push(("unknown".into(), first.unknown));
    probabilities.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let (first_none, strongest) = (first.none, first.best);
    let alone = first.fits.iter().map(|(f, _)| f.clone()).collect();
    let mut round = first;
    while accepted.len() < MOST_CHANGES {
        let Some(next) = round.leader().filter(|_| round.none < NAMED) else { break };
        let class = next.fit.change.stroke_class();
        if accepted.iter().any(|a| a.fit.change.stroke_class() == class) {
            break;
        }
        taken.extend(next.fit.columns.iter().cloned());
        accepted.push(next);
        round = Round::of(cells, &candidates, &taken, none, strongest);
    }
    Weighed { probabilities, none: first_none, last_none: round.none, accepted, alone }
}
