//! How strongly the cells support each effect of the catalogue as the change.

use model_core::effects::Role;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::contrast::{log_mean, log_sum};
use super::super::criteria::{
    CATALOGUE_COMPETITOR, CATALOGUE_INDEPENDENT, CATALOGUE_LAW_ERROR, CATALOGUE_LAW_ERRORS,
    CATALOGUE_LEAST_PRIOR, CATALOGUE_REFINED, CATALOGUE_STEP, CATALOGUE_USUAL, MOST_CHANGES, NAMED,
    PRIOR_UNKNOWN, SIZES,
};
use super::super::shapes::{Change, Class};
use super::cells::Cells;
use super::metric::{Metric, is_same, usual, with_error};
use super::pieces::independent;
use super::taper;
use crate::candidates::{Candidate, library};

/// One effect at its best shape.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub change: Change,
    /// Log evidence over no change, by the number of independent pieces.
    pub log: f64,
    /// Its parameters of either kind: name, unit, value, standard deviation; amplitudes first.
    pub parameters: Vec<(&'static str, &'static str, f64, f64)>,
    /// Its columns, N per unit.
    columns: Vec<DVector<f64>>,
    /// What it adds to the cells, N.
    pub trace: DVector<f64>,
    /// Which of its alternative laws.
    law: Option<usize>,
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

/// The laws of an effect: each amplitude alone where they are alternatives, otherwise all together. What the tapers enclose less and what the
/// slant of their fibres costs are parts of one law.
fn laws(candidate: &Candidate) -> Vec<Option<usize>> {
    let alone = if candidate.info.alternatives { amplitudes(candidate).len() } else { 0 };
    let together = alone == 0 || taper::belongs(candidate);
    (0..alone).map(Some).chain(together.then_some(None)).collect()
}

/// Name and unit of each amplitude of an effect.
fn amplitudes(candidate: &Candidate) -> Vec<(&'static str, &'static str)> {
    let own = candidate.info.parameters.iter().filter(|p| matches!(p.role, Role::Amplitude));
    own.map(|p| (p.name, p.unit)).chain(taper::belongs(candidate).then_some(taper::PARAMETER)).collect()
}

/// The columns of an effect at one set of shapes, N per unit of each amplitude.
fn columns(cells: &Cells, candidate: &Candidate, shapes: &[f64]) -> Vec<DVector<f64>> {
    let mut columns = candidate.columns(shapes, &cells.rows);
    columns.extend(taper::belongs(candidate).then(|| taper::column(&cells.rows)));
    columns.iter().map(|c| cells.means(c)).collect()
}

/// One law of an effect at one set of shapes; `None` where the cells do not show it.
fn fit(
    cells: &Cells,
    metric: &Metric<'_>,
    candidate: &Candidate,
    (law, shapes): (Option<usize>, &[f64]),
    columns: &[DVector<f64>],
) -> Option<Fit> {
    let n = cells.cells.len() as f64;
    let rms: Vec<f64> = columns.iter().map(|c| (c.norm_squared() / n).sqrt()).collect();
    let own = |k: &usize| law.is_none_or(|l| l == *k) && rms[*k] > 0.0 && rms[*k].is_finite();
    let live: Vec<usize> = (0..columns.len()).filter(own).collect();
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
    let named = amplitudes(candidate).into_iter().enumerate();
    for (i, (name, unit)) in named.filter(|(i, _)| law.is_none_or(|l| l == *i)) {
        let (value, std) = live
            .iter()
            .position(|l| *l == i)
            .map_or((0.0, 0.0), |j| (mean[j] / rms[i], covariance[(j, j)].max(0.0).sqrt() / rms[i]));
        parameters.push((name, unit, value, std));
    }
    parameters.extend(candidate.shapes().zip(shapes).map(|(p, s)| (p.name, p.unit, *s, 0.0)));
    let change = Change::from_name(candidate.name())?;
    let columns = live.iter().map(|k| columns[*k].clone()).collect();
    Some(Fit { change, log, parameters, columns, trace, law, shapes: shapes.to_vec() })
}

/// The best law and shape of one effect, and the log share of the laws and shapes that its evidence is a mean over.
fn scan(cells: &Cells, metric: &Metric<'_>, candidate: &Candidate) -> Option<(Fit, f64)> {
    let grid = candidate.grid();
    let laws = laws(candidate);
    let at = |shapes: &Vec<f64>| -> Vec<Fit> {
        let columns = columns(cells, candidate, shapes);
        laws.iter().filter_map(|law| fit(cells, metric, candidate, (*law, shapes), &columns)).collect()
    };
    let fits: Vec<Fit> = grid.iter().flat_map(at).collect();
    let logs: Vec<f64> = fits.iter().map(|f| f.log).collect();
    let mean = log_sum(&logs) - ((grid.len() * laws.len()).max(1) as f64).ln();
    let mut best = fits.into_iter().max_by(|a, b| a.log.total_cmp(&b.log))?;
    let (coarse, mut step) = (best.log, CATALOGUE_STEP);
    for _ in 0..CATALOGUE_REFINED {
        let near = candidate.neighbours(&best.shapes, step);
        let law = |shapes: &Vec<f64>| {
            fit(cells, metric, candidate, (best.law, shapes), &columns(cells, candidate, shapes))
        };
        let better =
            near.iter().filter_map(law).max_by(|a, b| a.log.total_cmp(&b.log)).filter(|f| f.log > best.log);
        match better {
            Some(f) => best = f,
            None => step /= 2.0,
        }
    }
    // What refinement gains is gained on a part of the grid's cell.
    Some((best, mean - coarse))
}

/// A law with each size of its own error: the best of these fits, and the log evidence of each over no change.
struct Inexact {
    fit: Fit,
    logs: Vec<f64>,
}

/// A law where its error is a share of its own trace. `base`: log density of no change, less what the choice of a shape costs.
fn with_own_error(
    cells: &Cells,
    usual: &[DVector<f64>],
    candidate: &Candidate,
    (found, least): (Fit, &[f64]),
    base: f64,
) -> Inexact {
    let columns = columns(cells, candidate, &found.shapes);
    let at = |share: &f64| {
        let metric = Metric::of(cells, usual, &with_error(&cells.group, &found.trace, least, *share));
        let own = fit(cells, &metric, candidate, (found.law, &found.shapes), &columns)?;
        Some(Fit { log: own.log + metric.density - base, ..own })
    };
    let fits: Vec<Fit> = CATALOGUE_LAW_ERRORS.iter().filter_map(at).filter(|f| f.log.is_finite()).collect();
    let logs = fits.iter().map(|f| f.log).collect();
    let best = fits.into_iter().max_by(|a, b| a.log.total_cmp(&b.log));
    Inexact { fit: best.unwrap_or(found), logs }
}

/// For each law, those that these cells do not distinguish from it.
fn alike(metric: &Metric<'_>, fits: &[Fit]) -> Vec<Vec<usize>> {
    let images: Vec<DVector<f64>> = fits.iter().map(|f| metric.apply(&f.trace)).collect();
    let product = |i: usize, k: usize| fits[i].trace.dot(&images[k]);
    let same = |i: usize, k: usize| i == k || is_same(product(i, i), product(k, k), product(i, k));
    (0..fits.len()).map(|i| (0..fits.len()).filter(|k| same(i, *k)).collect()).collect()
}

/// One weighing.
struct Round {
    none: f64,
    unknown: f64,
    fits: Vec<(Fit, f64)>,
    /// For each of `fits`, which of them have the same trace in these cells.
    alike: Vec<Vec<usize>>,
}

impl Round {
    /// `least`: what no law describes in each state, N.
    fn of(cells: &Cells, candidates: &[Candidate], taken: &[DVector<f64>], none: f64, least: &[f64]) -> Self {
        let columns = usual(cells, taken);
        let beyond = |deviation: f64| least.iter().map(|l| l.hypot(deviation)).collect::<Vec<f64>>();
        let still = Metric::of(cells, &columns, least);
        let size = (cells.difference.norm_squared() / cells.cells.len().max(1) as f64).sqrt();
        let metric = Metric::of(cells, &columns, &beyond(CATALOGUE_LAW_ERROR * size));
        let one = |candidate: &Candidate| {
            let (found, occam) = scan(cells, &metric, candidate)?;
            Some(with_own_error(cells, &columns, candidate, (found, least), still.density - occam))
        };
        let found: Vec<Inexact> =
            candidates.par_iter().filter_map(one).filter(|l| !l.logs.is_empty()).collect();
        // States differ from a law together, not one by one; each pressure was recorded alone.
        let best = found.iter().max_by(|a, b| log_mean(&a.logs).total_cmp(&log_mean(&b.logs)));
        let left = best.map_or_else(|| cells.difference.clone(), |b| &cells.difference - &b.fit.trace);
        let pieces = independent(cells, &metric.without_usual(&left))
            .max(cells.levels.len() as f64)
            .min(CATALOGUE_INDEPENDENT);
        let factor = (cells.groups as f64 / pieces).max(1.0);
        let tempered = |logs: &[f64]| log_mean(&logs.iter().map(|l| l / factor).collect::<Vec<f64>>());
        let mut fits: Vec<Fit> = found.into_iter().map(|l| Fit { log: tempered(&l.logs), ..l.fit }).collect();
        fits.sort_by(|a, b| b.log.total_cmp(&a.log).then(a.change.cmp(&b.change)));
        let free =
            SIZES.map(|s| Metric::of(cells, &columns, &beyond(s * cells.largest)).density - still.density);
        let unknown = tempered(&free);
        let share = (1.0 - none - PRIOR_UNKNOWN).max(CATALOGUE_LEAST_PRIOR) / fits.len().max(1) as f64;
        let logs: Vec<f64> = [none.ln(), PRIOR_UNKNOWN.ln() + unknown]
            .into_iter()
            .chain(fits.iter().map(|f| share.ln() + f.log))
            .collect();
        let total = log_sum(&logs);
        let p: Vec<f64> = logs.iter().map(|l| (l - total).exp()).collect();
        let alike = alike(&metric, &fits);
        Self {
            none: p[0],
            unknown: p[1],
            fits: fits.into_iter().zip(p[2..].iter().copied()).collect(),
            alike,
        }
    }

    fn class(&self, class: Class) -> f64 {
        self.fits
            .iter()
            .filter(|(f, _)| f.change.about().changed.class_in_strokes == class)
            .map(|(_, p)| p)
            .sum()
    }

    /// The best name of the class that is more probable than not; or of the names with one trace that together are, where the recordings do
    /// not say which it is.
    fn leader(&self) -> Option<Accepted> {
        let class = |i: &usize| self.class(self.fits[*i].0.change.about().changed.class_in_strokes);
        let together = |i: &usize| self.alike[*i].iter().map(|k| self.fits[*k].1).sum::<f64>();
        let best = |support: &dyn Fn(&usize) -> f64| {
            let of = (0..self.fits.len()).filter(|i| support(i) >= NAMED);
            of.max_by(|a, b| self.fits[*a].1.total_cmp(&self.fits[*b].1))
        };
        let chosen = best(&class).or_else(|| best(&together))?;
        let (fit, probability) = &self.fits[chosen];
        let mut order: Vec<&(Fit, f64)> = self.fits.iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let others = order.into_iter().filter(|(f, p)| f.change != fit.change && *p >= CATALOGUE_COMPETITOR);
        Some(Accepted {
            fit: fit.clone(),
            probability: *probability,
            class_probability: class(&chosen),
            competitors: others.map(|(f, _)| f.change).collect(),
        })
    }
}

/// Weighs every effect of the catalogue; `none`: prior probability that nothing changed.
pub(super) fn weigh(cells: &Cells, none: f64) -> Weighed {
    let candidates: Vec<Candidate> = library(&cells.rows, &[]);
    let mut accepted: Vec<Accepted> = Vec::new();
    let mut taken: Vec<DVector<f64>> = Vec::new();
    let mut least = vec![CATALOGUE_USUAL * cells.largest; cells.groups];
    let first = Round::of(cells, &candidates, &taken, none, &least);
    let mut probabilities: Vec<(String, f64)> =
        first.fits.iter().map(|(f, p)| (f.change.name().to_owned(), *p)).collect();
    probabilities.push(("none".into(), first.none));
    probabilities.push(("unknown".into(), first.unknown));
    probabilities.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let first_none = first.none;
    let alone = first.fits.iter().map(|(f, _)| f.clone()).collect();
    let mut round = first;
    while accepted.len() < MOST_CHANGES {
        let Some(next) = round.leader().filter(|_| round.none < NAMED) else { break };
        let class = next.fit.change.about().changed.class_in_strokes;
        if accepted.iter().any(|a| a.fit.change.about().changed.class_in_strokes == class) {
            break;
        }
        taken.extend(next.fit.columns.iter().cloned());
        // What a law leaves of what it explains, no law describes.
        least = with_error(&cells.group, &next.fit.trace, &least, CATALOGUE_LAW_ERROR);
        accepted.push(next);
        round = Round::of(cells, &candidates, &taken, none, &least);
    }
    Weighed { probabilities, none: first_none, last_none: round.none, accepted, alone }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(name: &str) -> Change {
        Change::from_name(name).expect("listed")
    }

    fn round(of: &[(Change, f64)], alike: &[usize]) -> Round {
        let fit = |(change, p): &(Change, f64)| {
            let fit = Fit {
                change: *change,
                log: 0.0,
                parameters: Vec::new(),
                columns: Vec::new(),
                trace: DVector::zeros(1),
                law: None,
                shapes: Vec::new(),
            };
            (fit, *p)
        };
        let own = |i: usize| if alike.contains(&i) { alike.to_vec() } else { vec![i] };
        Round {
            none: 0.0,
            unknown: 0.0,
            fits: of.iter().map(fit).collect(),
            alike: (0..of.len()).map(own).collect(),
        }
    }

    #[test]
    fn names_with_one_trace_lead_together() {
        let [moved, slipped, permanent] = ["displacement-offset", "end-slip", "permanent-set"].map(change);
        let shifts = [(moved, 0.39), (slipped, 0.35), (permanent, 0.26)];
        let named = round(&shifts, &[0, 1, 2]).leader().expect("a name");
        assert_eq!(named.fit.change, moved);
        assert_eq!(named.competitors, [slipped, permanent]);
        // Each with a trace of its own: none of them is more probable than not.
        assert!(round(&shifts, &[]).leader().is_none());
        // A class that leads goes before names of one trace.
        let classes = [(change("coulomb-friction"), 0.3), (change("pressure-friction"), 0.3), (slipped, 0.4)];
        let named = round(&classes, &[0, 2]).leader().expect("a name");
        assert_eq!(named.fit.change.about().changed.class_in_strokes, Class::Friction);
    }
}
