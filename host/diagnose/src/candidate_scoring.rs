//! Scoring of candidates beside a baseline with the effects selected so far: scan of all shapes, refinement of the best.

use model_core::effects::Parameter;
use rayon::prelude::*;

use super::baselines::{Baseline, PriorDeviations, keeps, shrink};
use super::candidate_fit::CandidateFit;
use super::candidates::Candidate;
use super::criteria::candidates::{
    AMPLITUDE_BEYOND, INVISIBLE, MOST_AMPLITUDES, REFINEMENT_GAIN, REFINEMENT_HALVINGS, REFINEMENT_STEP,
    REFINEMENT_STEPS, SYSTEMATIC_ROWS,
};
use super::likelihood::{Hypothesis, Products, Scale, Target, likelihood, likelihood_at};
use super::linear::{Sign, add_scaled, dot, energy, weighted};
use super::rows::Rows;

/// A baseline beside which candidates are scored.
pub(crate) struct Scorer<'a> {
    base: &'a Baseline,
    /// What the likelihood is scaled with.
    pub scale: Scale,
    target: Target<'a>,
    /// Twice the negative log-likelihood without any further effect.
    pub deviance: f64,
    /// The sizes of its soft directions without any further effect.
    pub prior: PriorDeviations,
    /// Residual sum of squares without any further effect, N².
    pub left: f64,
    /// What is to be explained in the metric of that prior, freed of the effects chosen.
    residual: Vec<f64>,
    chosen: Products,
}

/// A residual in the metric of a prior: inner products with it are those in the whitened space.
fn in_metric(base: &Baseline, core: &[f64], prior: PriorDeviations, weight: f64) -> Vec<f64> {
    let keep = keeps(prior, &base.span.of_friction, weight);
    let mut r = core.to_vec();
    shrink(&mut r, &base.span.soft, |at, along| (keep[at] * keep[at] - 1.0) * along);
    r
}

impl<'a> Scorer<'a> {
    /// Of a soft baseline, with the effects fitted beside it.
    pub(crate) fn new(base: &'a Baseline, scale: Scale) -> Self {
        let target = Target {
            energy: energy(&base.core),
            components: base.span.components(&base.core),
            of_friction: &base.span.of_friction,
        };
        let columns = &base.span.chosen_core;
        let chosen = Products {
            gram: columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect(),
            moment: columns.iter().map(|a| dot(a, &base.core)).collect(),
            components: columns.iter().map(|a| base.span.components(a)).collect(),
            given: columns.len(),
        };
        let null = likelihood(&scale, &target, &chosen, &[], 0);
        let mut freed = base.core.clone();
        for (a, c) in null.given.iter().zip(columns) {
            add_scaled(&mut freed, -a, c);
        }
        let residual = in_metric(base, &freed, null.prior, scale.weight);
        Self {
            base,
            scale,
            target,
            deviance: null.deviance,
            prior: null.prior,
            left: null.before,
            residual,
            chosen,
        }
    }

    /// A candidate's columns, their inner products with all other columns, and the columns with the hard ones projected out.
    fn products(
        &self,
        candidate: &Candidate,
        shapes: &[f64],
        rows: &Rows,
    ) -> (Vec<Vec<f64>>, Products, Vec<Vec<f64>>) {
        let columns = candidate.columns(shapes, rows);
        let (products, z) = self.products_of(&columns, rows);
        (columns, products, z)
    }

    /// Inner products of columns with all other columns, and the columns with the hard ones projected out.
    fn products_of(&self, columns: &[Vec<f64>], rows: &Rows) -> (Products, Vec<Vec<f64>>) {
        let span = &self.base.span;
        let z: Vec<Vec<f64>> = columns
            .iter()
            .map(|c| {
                let mut v = weighted(c, rows.root_weight());
                span.hard.project_out(&mut v);
                v
            })
            .collect();
        let mut products = self.chosen.clone();
        for v in &z {
            let cross: Vec<f64> = span.chosen_core.iter().map(|c| dot(c, v)).collect();
            for (row, x) in products.gram.iter_mut().zip(&cross) {
                row.push(*x);
            }
            products.gram.push(cross);
            products.moment.push(dot(v, &self.base.core));
            products.components.push(span.components(v));
        }
        for i in 0..z.len() {
            for other in &z {
                products.gram[self.chosen.given + i].push(dot(&z[i], other));
            }
        }
        (products, z)
    }

    /// What a column of any amplitude leaves, N², where the bladder differs between pressures as much as a hypothesis has it.
    pub(crate) fn left_with(&self, column: &[f64], rows: &Rows, prior: PriorDeviations) -> f64 {
        let (products, _) = self.products_of(&[column.to_vec()], rows);
        let w = likelihood_at(&self.scale, &self.target, &products, &[Sign::Free], 1, prior);
        (w.before - w.gain).max(0.0)
    }

    /// Fits a candidate at given shapes; with its scores block by block where `whole`.
    pub(crate) fn fit(
        &self,
        index: usize,
        candidate: &Candidate,
        shapes: &[f64],
        rows: &Rows,
        whole: bool,
    ) -> CandidateFit {
        let given = self.chosen.given;
        let (columns, products, z) = self.products(candidate, shapes, rows);
        let weight = rows.root_weight();
        let before: f64 =
            columns.iter().map(|c| c.iter().zip(weight).map(|(v, w)| (v * w).powi(2)).sum::<f64>()).sum();
        let after: f64 = z.iter().map(|v| energy(v)).sum();
        let within: f64 = products.components[given..].iter().map(|c| energy(c)).sum();
        // The residual of the columns where the bladder may differ as much as it does without them.
        let share = |e: f64| if before > 0.0 { (e / before).max(0.0) } else { 0.0 };
        let mut fit = CandidateFit {
            candidate: index,
            shapes: shapes.to_vec(),
            amplitudes: vec![0.0; columns.len()],
            score: 0.0,
            prior: self.prior,
            gain: 0.0,
            before: self.left,
            relief: 0.0,
            unrelieved: self.target.energy,
            visible: share(self.seen(&products.components[given..], after)),
            beyond_tables: share(after - within),
            scores: vec![0.0; rows.blocks],
            singles: Vec::new(),
            size: 0.0,
            peak: 0.0,
            about: None,
        };
        if fit.visible < INVISIBLE {
            self.measure(&mut fit, &columns, rows);
            return fit;
        }
        let signs = candidate.signs();
        let most = if candidate.info.alternatives { 1 } else { MOST_AMPLITUDES };
        let w = likelihood(&self.scale, &self.target, &products, &signs, most);
        // Far beyond the known range another cause has this name.
        let known = candidate.info.parameters.iter();
        let within = |(p, a): (&Parameter, &f64)| a.abs() <= AMPLITUDE_BEYOND * p.largest();
        let plausible =
            known.zip(&w.amplitudes).all(within) && candidate.is_consistent(&w.amplitudes, shapes);
        if plausible && w.gain > 0.0 {
            let free = w.amplitudes.iter().filter(|a| **a != 0.0).count() + shapes.len();
            fit.gain = w.gain;
            fit.before = w.before;
            fit.prior = w.prior;
            fit.score = self.deviance - w.deviance - free as f64 * self.scale.independent.max(2.0).ln();
            fit.amplitudes.clone_from(&w.amplitudes);
            (fit.relief, fit.unrelieved) = self.relief(&products, &w);
        }
        self.measure(&mut fit, &columns, rows);
        fit.score -= self.inexactness(&fit, candidate.law_error(rows));
        if whole && fit.gain > 0.0 {
            self.score_blocks(&mut fit, &z, &w.given, rows);
        }
        fit.singles = z.iter().map(|v| self.score_alone(v, rows)).collect();
        fit
    }

    /// What columns with their amplitudes take where one bladder serves all pressures, and what there was.
    fn relief(&self, products: &Products, w: &Hypothesis) -> (f64, f64) {
        let given = products.given;
        let mut before = self.target.energy;
        for (i, g) in w.given.iter().enumerate() {
            before -= 2.0 * g * products.moment[i];
            before += w.given.iter().enumerate().map(|(j, h)| g * h * products.gram[i][j]).sum::<f64>();
        }
        let mut taken = 0.0;
        for (i, a) in w.amplitudes.iter().enumerate() {
            let row = &products.gram[given + i];
            let beside: f64 = w.given.iter().zip(row).map(|(g, x)| g * x).sum();
            let among: f64 = w.amplitudes.iter().zip(&row[given..]).map(|(b, x)| b * x).sum();
            taken += a * (2.0 * (products.moment[given + i] - beside) - among);
        }
        (taken, before.max(0.0))
    }

    /// How large the trace of a fit is.
    fn measure(&self, fit: &mut CandidateFit, columns: &[Vec<f64>], rows: &Rows) {
        for i in 0..rows.len() {
            // What has no amplitude yet keeps the proportion of peak to size of its first column.
            let raw: f64 = if fit.gain > 0.0 {
                fit.amplitudes.iter().zip(columns).map(|(a, c)| a * c[i]).sum()
            } else {
                columns[0][i]
            };
            fit.size += (raw * rows.root_weight()[i]).powi(2);
            if rows.root_weight()[i] > 0.0 {
                fit.peak = fit.peak.max(raw.abs());
            }
        }
        fit.size = (fit.size / self.scale.weight.max(1e-12)).sqrt();
    }

    /// The penalty for an inexact law: where the base cancels nearly all of a trace, the residual is no larger than the law's own error.
    fn inexactness(&self, fit: &CandidateFit, law_error: f64) -> f64 {
        if fit.gain <= 0.0 {
            return 0.0;
        }
        let floor = self.scale.sigma * self.scale.sigma * self.scale.weight;
        let left = (fit.before - fit.gain).max(floor).max(1e-300);
        let own = (law_error * fit.size).powi(2) * self.scale.weight;
        self.scale.independent.min(SYSTEMATIC_ROWS) * (own / left).ln_1p()
    }

    /// Energy of columns in the scorer's metric.
    fn seen(&self, components: &[Vec<f64>], energy: f64) -> f64 {
        let keep = keeps(self.prior, &self.base.span.of_friction, self.scale.weight);
        let lost = |c: &Vec<f64>| c.iter().zip(&keep).map(|(c, k)| c * c * (1.0 - k * k)).sum::<f64>();
        energy - components.iter().map(lost).sum::<f64>()
    }

    /// What a fit leaves, N², where the bladder differs as much as another hypothesis has it; and what there was.
    pub(crate) fn left_under(
        &self,
        fit: &CandidateFit,
        library: &[Candidate],
        rows: &Rows,
        prior: PriorDeviations,
    ) -> (f64, f64) {
        let candidate = &library[fit.candidate];
        let (_, products, _) = self.products(candidate, &fit.shapes, fit.source(rows));
        let most = if candidate.info.alternatives { 1 } else { MOST_AMPLITUDES };
        let w = likelihood_at(&self.scale, &self.target, &products, &candidate.signs(), most, prior);
        ((w.before - w.gain).max(0.0), w.before)
    }

    /// Block by block, a column against the residual in the scorer's metric, per unit norm.
    fn score_alone(&self, v: &[f64], rows: &Rows) -> Vec<f64> {
        let mut scores = vec![0.0; rows.blocks];
        let norm = energy(v).sqrt();
        if norm > 0.0 {
            for i in 0..v.len() {
                scores[rows.block[i] as usize] += v[i] * self.residual[i] / norm;
            }
        }
        scores
    }

    /// Block by block, the fitted trace against the residual, both in the metric of the fit's own prior.
    fn score_blocks(&self, fit: &mut CandidateFit, z: &[Vec<f64>], given: &[f64], rows: &Rows) {
        let mut fitted = vec![0.0; rows.len()];
        for (a, v) in fit.amplitudes.iter().zip(z) {
            add_scaled(&mut fitted, *a, v);
        }
        let mut core = self.base.core.clone();
        for (a, c) in given.iter().zip(&self.base.span.chosen_core) {
            add_scaled(&mut core, -a, c);
        }
        let residual = in_metric(self.base, &core, fit.prior, self.scale.weight);
        for i in 0..rows.len() {
            fit.scores[rows.block[i] as usize] += fitted[i] * residual[i];
        }
    }

    /// Every candidate at every grid point, in a fixed order.
    pub(crate) fn scan(&self, library: &[Candidate], rows: &Rows) -> Vec<CandidateFit> {
        let work: Vec<(usize, Vec<f64>)> =
            library.iter().enumerate().flat_map(|(i, c)| c.grid().into_iter().map(move |g| (i, g))).collect();
        rows.progress().stage("trying every effect", work.len() as u64);
        let fit = |(i, shapes): &(usize, Vec<f64>)| {
            let fit = self.fit(*i, &library[*i], shapes, rows, false);
            rows.progress().step();
            fit
        };
        work.par_iter().map(fit).collect()
    }

    /// Coordinate search in the shapes from a fit, with a step that halves, at a change point down to a row; with scores by blocks.
    pub(crate) fn refine(&self, start: &CandidateFit, library: &[Candidate], rows: &Rows) -> CandidateFit {
        let candidate = &library[start.candidate];
        let mut best = start.clone();
        let mut step = (0.5 / candidate.grid().len() as f64).max(REFINEMENT_STEP);
        let finest = candidate.finest_step(rows).min(step * 0.5_f64.powi(REFINEMENT_HALVINGS as i32 - 1));
        while !best.shapes.is_empty() && step >= finest {
            for _ in 0..REFINEMENT_STEPS {
                let better = candidate
                    .neighbours(&best.shapes, step)
                    .par_iter()
                    .map(|s| self.fit(start.candidate, candidate, s, rows, false))
                    .collect::<Vec<_>>()
                    .into_iter()
                    .max_by(|a, b| a.score.total_cmp(&b.score));
                match better {
                    Some(b) if b.score > best.score + REFINEMENT_GAIN => best = b,
                    _ => break,
                }
            }
            step *= 0.5;
        }
        self.fit(start.candidate, candidate, &best.shapes, rows, true)
    }
}
