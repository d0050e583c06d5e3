//! How strongly the cells support each effect of the catalogue as the change.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::super::contrast::{log_mean, log_sum};
use super::super::criteria::{
    CATALOGUE_INDEPENDENT, CATALOGUE_LAW_ERROR, CATALOGUE_REFINED, CATALOGUE_USUAL, MOST_CHANGES, NAMED,
    PRIOR_UNKNOWN, SIZES,
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

/// The metric of the cells: the inverse of `D + s²GG' + ZZ'`, freed of what was named before. `D` is the cells' own variance; `G` gives
/// each state a difference of its own, of deviation `s`, which no law describes; `Z` is what campaigns usually differ by.
struct Metric<'a> {
    cells: &'a Cells,
    inverse: DVector<f64>,
    /// By group, 1/(1/s² + Σ 1/d).
    shrunk: Vec<f64>,
    z: DMatrix<f64>,
    images: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
    /// Log density of the difference without an effect, up to a constant.
    density: f64,
    projected: DVector<f64>,
}

impl<'a> Metric<'a> {
    fn of(cells: &'a Cells, usual: &[DVector<f64>], deviation: f64) -> Self {
        let n = cells.cells.len();
        let inverse = cells.variance.map(|v| 1.0 / v);
        let mut sums = vec![0.0; cells.groups];
        for (i, w) in inverse.iter().enumerate() {
            sums[cells.group[i]] += w;
        }
        let s2 = deviation * deviation;
        let shrunk = sums.iter().map(|w| 1.0 / (1.0 / s2 + w)).collect();
        let z = if usual.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(usual) };
        let spread: f64 = cells.variance.iter().map(|v| v.ln()).sum::<f64>()
            + sums.iter().map(|w| (s2 * w).ln_1p()).sum::<f64>();
        let mut metric = Self {
            cells,
            inverse,
            shrunk,
            images: z.clone(),
            z,
            factor: None,
            density: 0.0,
            projected: DVector::zeros(n),
        };
        for k in 0..metric.z.ncols() {
            let image = metric.own(&metric.z.column(k).into_owned());
            metric.images.set_column(k, &image);
        }
        let inner = DMatrix::identity(metric.z.ncols(), metric.z.ncols()) + metric.z.tr_mul(&metric.images);
        metric.factor = inner.cholesky();
        let of_z: f64 =
            metric.factor.as_ref().map_or(0.0, |f| f.l_dirty().diagonal().iter().map(|v| 2.0 * v.ln()).sum());
        metric.projected = metric.apply(&cells.difference);
        metric.density = -0.5 * (spread + of_z + cells.difference.dot(&metric.projected));
        metric
    }

    /// Without `Z`.
    fn own(&self, v: &DVector<f64>) -> DVector<f64> {
        let mut weighted = v.component_mul(&self.inverse);
        let mut sums = vec![0.0; self.shrunk.len()];
        for (i, w) in weighted.iter().enumerate() {
            sums[self.cells.group[i]] += w;
        }
        for i in 0..weighted.len() {
            let g = self.cells.group[i];
            weighted[i] -= self.inverse[i] * self.shrunk[g] * sums[g];
        }
        weighted
    }

    fn apply(&self, v: &DVector<f64>) -> DVector<f64> {
        let own = self.own(v);
        let Some(factor) = &self.factor else { return own };
        let back = factor.solve(&self.images.tr_mul(v));
        own - &self.images * back
    }
}

/// What campaigns usually differ by without a change, as columns of one standard deviation; and what was named before, at any size.
fn usual(cells: &Cells, taken: &[DVector<f64>]) -> Vec<DVector<f64>> {
    let n = cells.cells.len();
    let unit = CATALOGUE_USUAL * cells.largest;
    let recordings = cells.cells.iter().map(|c| c.recording + 1).max().unwrap_or(0);
    let zero = |recording: usize| {
        DVector::from_fn(n, |i, _| if cells.cells[i].recording == recording { unit } else { 0.0 })
    };
    let mut columns: Vec<DVector<f64>> = (0..recordings).map(zero).collect();
    let contexts = cells.rows.contexts();
    let of_rows = |value: &dyn Fn(usize) -> f64| {
        let column: Vec<f64> = (0..contexts.len()).map(value).collect();
        cells.means(&column)
    };
    // The whole campaign: gain, zero of the gauge, stroke, friction.
    let whole = [
        of_rows(&|i| contexts[i].quasi),
        of_rows(&|i| contexts[i].pull_per_pressure()),
        of_rows(&|i| contexts[i].stiffness),
        of_rows(&|i| contexts[i].quasi * contexts[i].direction),
    ];
    let scaled = |column: &DVector<f64>, size: f64| {
        let peak = column.amax();
        (peak > 0.0 && peak.is_finite()).then(|| column * (size / peak))
    };
    columns.extend(whole.iter().filter_map(|c| scaled(c, unit)));
    columns.extend(taken.iter().filter_map(|c| scaled(c, 30.0 * cells.largest)));
    columns
}

/// An effect at one set of shapes; `None` where the cells do not show it.
fn fit(cells: &Cells, metric: &Metric<'_>, candidate: &Candidate, shapes: &[f64]) -> Option<Fit> {
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
    let b = u.tr_mul(&metric.projected);
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
    let amplitudes =
        candidate.info.parameters.iter().filter(|p| matches!(p.role, model_core::effects::Role::Amplitude));
    for (i, p) in amplitudes.enumerate() {
        let (value, std) = live
            .iter()
            .position(|l| *l == i)
            .map_or((0.0, 0.0), |j| (mean[j] / rms[i], covariance[(j, j)].max(0.0).sqrt() / rms[i]));
        parameters.push((p.name, p.unit, value, std));
    }
    parameters.extend(candidate.shapes().zip(shapes).map(|(p, s)| (p.name, p.unit, *s, 0.0)));
    let change = Change::from_name(candidate.name())?;
    let columns = live.iter().map(|k| columns[*k].clone()).collect();
    Some(Fit { change, log, parameters, columns, trace, shapes: shapes.to_vec() })
}

/// The best shape of one effect, and its evidence as a mean over the grid.
fn scan(cells: &Cells, metric: &Metric<'_>, candidate: &Candidate) -> Option<Fit> {
    let grid = candidate.grid();
    let fits: Vec<Fit> = grid.iter().filter_map(|shapes| fit(cells, metric, candidate, shapes)).collect();
    let logs: Vec<f64> = fits.iter().map(|f| f.log).collect();
    let mean = log_sum(&logs) - (grid.len().max(1) as f64).ln();
    let mut best = fits.into_iter().max_by(|a, b| a.log.total_cmp(&b.log))?;
    let (coarse, mut step) = (best.log, 0.06);
    for _ in 0..CATALOGUE_REFINED {
        let near = candidate.neighbours(&best.shapes, step);
        let better = near
            .iter()
            .filter_map(|shapes| fit(cells, metric, candidate, shapes))
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

/// One weighing.
struct Round {
    none: f64,
    unknown: f64,
    fits: Vec<(Fit, f64)>,
}

impl Round {
    /// `first`: rms of what was named before, N.
    fn of(cells: &Cells, candidates: &[Candidate], taken: &[DVector<f64>], none: f64, first: f64) -> Self {
        let columns = usual(cells, taken);
        // What a law leaves of what it explains, no law describes.
        let least = (CATALOGUE_USUAL * cells.largest).hypot(CATALOGUE_LAW_ERROR * first);
        let still = Metric::of(cells, &columns, least);
        let size = (cells.difference.norm_squared() / cells.cells.len().max(1) as f64).sqrt();
        let metric = Metric::of(cells, &columns, least.hypot(CATALOGUE_LAW_ERROR * size));
        let mut fits: Vec<Fit> = candidates.par_iter().filter_map(|c| scan(cells, &metric, c)).collect();
        fits.iter_mut().for_each(|f| f.log += metric.density - still.density);
        fits.sort_by(|a, b| b.log.total_cmp(&a.log).then(a.change.cmp(&b.change)));
        let free = SIZES.map(|s| Metric::of(cells, &columns, s * cells.largest).density - still.density);
        let unknown = log_mean(&free);
        // States differ from a law together, not one by one.
        let factor = (cells.groups as f64 / CATALOGUE_INDEPENDENT).max(1.0);
        let share = (1.0 - none - PRIOR_UNKNOWN).max(1e-3) / fits.len().max(1) as f64;
        let logs: Vec<f64> = [none.ln(), PRIOR_UNKNOWN.ln() + unknown / factor]
            .into_iter()
            .chain(fits.iter().map(|f| share.ln() + f.log / factor))
            .collect();
        let total = log_sum(&logs);
        let p: Vec<f64> = logs.iter().map(|l| (l - total).exp()).collect();
        Self { none: p[0], unknown: p[1], fits: fits.into_iter().zip(p[2..].iter().copied()).collect() }
    }

    fn class(&self, class: Class) -> f64 {
        self.fits.iter().filter(|(f, _)| f.change.stroke_class() == class).map(|(_, p)| p).sum()
    }

    /// The best name of the class that is more probable than not.
    fn leader(&self) -> Option<Accepted> {
        let (fit, probability) = self.fits.iter().max_by(|a, b| {
            let weight = |(f, p): &(Fit, f64)| (self.class(f.change.stroke_class()) >= NAMED, *p);
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
    let first_none = first.none;
    let mut explained = 0.0_f64;
    let alone = first.fits.iter().map(|(f, _)| f.clone()).collect();
    let mut round = first;
    while accepted.len() < MOST_CHANGES {
        let Some(next) = round.leader().filter(|_| round.none < NAMED) else { break };
        let class = next.fit.change.stroke_class();
        if accepted.iter().any(|a| a.fit.change.stroke_class() == class) {
            break;
        }
        taken.extend(next.fit.columns.iter().cloned());
        explained = explained.hypot((next.fit.trace.norm_squared() / cells.cells.len() as f64).sqrt());
        accepted.push(next);
        round = Round::of(cells, &candidates, &taken, none, explained);
    }
    Weighed { probabilities, none: first_none, last_none: round.none, accepted, alone }
}
