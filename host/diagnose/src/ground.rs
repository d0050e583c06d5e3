//! The ground on which candidates are tried: a baseline with the effects chosen so far, the best of each looked for in its shapes.

use model_core::effects::Parameter;
use rayon::prelude::*;

use super::baselines::{Baseline, Give, keeps};
use super::candidates::Candidate;
use super::criteria::candidates::{
    AMPLITUDE_BEYOND, INVISIBLE, MOST_AMPLITUDES, REFINEMENT_GAIN, REFINEMENT_HALVINGS, REFINEMENT_STEP,
    REFINEMENT_STEPS, SYSTEMATIC_ROWS,
};
use super::evidence::{Products, Scale, Target, Weighed, weigh, weigh_at};
use super::linear::{add_scaled, dot, energy, weighted};
use super::rows::Rows;
use super::trial::Trial;

/// A baseline against which candidates are weighed.
pub(crate) struct Ground<'a> {
    base: &'a Baseline,
    /// What evidence is weighed with.
    pub scale: Scale,
    target: Target<'a>,
    /// Twice the negative log-likelihood without any further effect.
    pub deviance: f64,
    /// The sizes of its soft directions without any further effect.
    pub give: Give,
    /// What is left without any further effect, N².
    pub left: f64,
    /// What is to be explained in the metric of that give, freed of the effects chosen.
    residual: Vec<f64>,
    chosen: Products,
}

/// A residual in the metric of a give: inner products with it are those in the whitened space.
fn in_metric(base: &Baseline, core: &[f64], give: Give, weight: f64) -> Vec<f64> {
    let keep = keeps(give, &base.span.of_friction, weight);
    let mut r = core.to_vec();
    for (q, keep) in base.span.soft.iter().zip(&keep) {
        let c = dot(q, core);
        add_scaled(&mut r, -(1.0 - keep * keep) * c, q);
    }
    r
}

impl<'a> Ground<'a> {
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
        let null = weigh(&scale, &target, &chosen, &[], 0);
        let mut freed = base.core.clone();
        for (a, c) in null.given.iter().zip(columns) {
            add_scaled(&mut freed, -a, c);
        }
        let residual = in_metric(base, &freed, null.give, scale.weight);
        Self {
            base,
            scale,
            target,
            deviance: null.deviance,
            give: null.give,
            left: null.before,
            residual,
            chosen,
        }
    }

    /// A candidate's columns, their products with everything else, and the columns freed of the hard ones.
    fn products(
        &self,
        candidate: &Candidate,
        shapes: &[f64],
        rows: &Rows,
    ) -> (Vec<Vec<f64>>, Products, Vec<Vec<f64>>) {
        let span = &self.base.span;
        let columns = candidate.columns(shapes, rows);
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
        (columns, products, z)
    }

    /// Tries a candidate at given shapes; with its scores block by block where `whole`.
    pub(crate) fn attempt(
        &self,
        index: usize,
        candidate: &Candidate,
        shapes: &[f64],
        rows: &Rows,
        whole: bool,
    ) -> Trial {
        let given = self.chosen.given;
        let (columns, products, z) = self.products(candidate, shapes, rows);
        let weight = rows.root_weight();
        let before: f64 =
            columns.iter().map(|c| c.iter().zip(weight).map(|(v, w)| (v * w).powi(2)).sum::<f64>()).sum();
        let after: f64 = z.iter().map(|v| energy(v)).sum();
        let within: f64 = products.components[given..].iter().map(|c| energy(c)).sum();
        // What is left of the columns where the bladder may differ as much as it does without them.
        let share = |e: f64| if before > 0.0 { (e / before).max(0.0) } else { 0.0 };
        let mut trial = Trial {
            candidate: index,
            shapes: shapes.to_vec(),
            amplitudes: vec![0.0; columns.len()],
            score: 0.0,
            give: self.give,
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
        };
        if trial.visible < INVISIBLE {
            self.measure(&mut trial, &columns, rows);
            return trial;
        }
        let signs = candidate.signs();
        let most = if candidate.info.alternatives { 1 } else { MOST_AMPLITUDES };
        let w = weigh(&self.scale, &self.target, &products, &signs, most);
        // Ten times beyond what anybody has seen is another thing under this name.
        let known = candidate.info.parameters.iter();
        let within = |(p, a): (&Parameter, &f64)| a.abs() <= AMPLITUDE_BEYOND * p.low.abs().max(p.high.abs());
        let plausible =
            known.zip(&w.amplitudes).all(within) && candidate.holds_together(&w.amplitudes, shapes);
        if plausible && w.gain > 0.0 {
            let free = w.amplitudes.iter().filter(|a| **a != 0.0).count() + shapes.len();
            trial.gain = w.gain;
            trial.before = w.before;
            trial.give = w.give;
            trial.score = self.deviance - w.deviance - free as f64 * self.scale.independent.max(2.0).ln();
            trial.amplitudes.clone_from(&w.amplitudes);
            (trial.relief, trial.unrelieved) = self.relief(&products, &w);
        }
        self.measure(&mut trial, &columns, rows);
        trial.score -= self.inexactness(&trial, candidate.law_error(rows));
        if whole && trial.gain > 0.0 {
            self.score_blocks(&mut trial, &z, &w.given, rows);
        }
        trial.singles = z.iter().map(|v| self.single(v, rows)).collect();
        trial
    }

    /// What columns with their amplitudes take where one bladder serves all pressures, and what there was.
    fn relief(&self, products: &Products, w: &Weighed) -> (f64, f64) {
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

    /// How large a trial's trace is.
    fn measure(&self, trial: &mut Trial, columns: &[Vec<f64>], rows: &Rows) {
        for i in 0..rows.len() {
            // What has no amplitude yet keeps the proportion of peak to size of its first column.
            let raw: f64 = if trial.gain > 0.0 {
                trial.amplitudes.iter().zip(columns).map(|(a, c)| a * c[i]).sum()
            } else {
                columns[0][i]
            };
            trial.size += (raw * rows.root_weight()[i]).powi(2);
            if rows.root_weight()[i] > 0.0 {
                trial.peak = trial.peak.max(raw.abs());
            }
        }
        trial.size = (trial.size / self.scale.weight.max(1e-12)).sqrt();
    }

    /// What it costs that no law is exact: where nearly all of a trace has to be cancelled by the base, the little that is left of
    /// it is no larger than the law's own error.
    fn inexactness(&self, trial: &Trial, law_error: f64) -> f64 {
        if trial.gain <= 0.0 {
            return 0.0;
        }
        let floor = self.scale.sigma * self.scale.sigma * self.scale.weight;
        let left = (trial.before - trial.gain).max(floor).max(1e-300);
        let own = (law_error * trial.size).powi(2) * self.scale.weight;
        self.scale.independent.min(SYSTEMATIC_ROWS) * (own / left).ln_1p()
    }

    /// Energy of columns in the ground's own metric.
    fn seen(&self, components: &[Vec<f64>], energy: f64) -> f64 {
        let keep = keeps(self.give, &self.base.span.of_friction, self.scale.weight);
        let lost = |c: &Vec<f64>| c.iter().zip(&keep).map(|(c, k)| c * c * (1.0 - k * k)).sum::<f64>();
        energy - components.iter().map(lost).sum::<f64>()
    }

    /// What a trial leaves, N², where the bladder differs as much as another hypothesis has it; and what there was.
    pub(crate) fn left_under(
        &self,
        trial: &Trial,
        library: &[Candidate],
        rows: &Rows,
        give: Give,
    ) -> (f64, f64) {
        let candidate = &library[trial.candidate];
        let (_, products, _) = self.products(candidate, &trial.shapes, rows);
        let most = if candidate.info.alternatives { 1 } else { MOST_AMPLITUDES };
        let w = weigh_at(&self.scale, &self.target, &products, &candidate.signs(), most, give);
        ((w.before - w.gain).max(0.0), w.before)
    }

    /// Block by block, a column against the residual in the ground's own metric, per unit norm.
    fn single(&self, v: &[f64], rows: &Rows) -> Vec<f64> {
        let mut scores = vec![0.0; rows.blocks];
        let norm = energy(v).sqrt();
        if norm > 0.0 {
            for i in 0..v.len() {
                scores[rows.block[i] as usize] += v[i] * self.residual[i] / norm;
            }
        }
        scores
    }

    /// Block by block, the fitted trace against the residual, both in the metric of the trial's own give.
    fn score_blocks(&self, trial: &mut Trial, z: &[Vec<f64>], given: &[f64], rows: &Rows) {
        let mut fitted = vec![0.0; rows.len()];
        for (a, v) in trial.amplitudes.iter().zip(z) {
            add_scaled(&mut fitted, *a, v);
        }
        let mut core = self.base.core.clone();
        for (a, c) in given.iter().zip(&self.base.span.chosen_core) {
            add_scaled(&mut core, -a, c);
        }
        let residual = in_metric(self.base, &core, trial.give, self.scale.weight);
        for i in 0..rows.len() {
            trial.scores[rows.block[i] as usize] += fitted[i] * residual[i];
        }
    }

    /// Every candidate at every grid point, in a fixed order.
    pub(crate) fn scan(&self, library: &[Candidate], rows: &Rows) -> Vec<Trial> {
        let work: Vec<(usize, Vec<f64>)> =
            library.iter().enumerate().flat_map(|(i, c)| c.grid().into_iter().map(move |g| (i, g))).collect();
        rows.progress().stage("trying every effect", work.len() as u64);
        let attempt = |(i, shapes): &(usize, Vec<f64>)| {
            let trial = self.attempt(*i, &library[*i], shapes, rows, false);
            rows.progress().step();
            trial
        };
        work.par_iter().map(attempt).collect()
    }

    /// Walks uphill in the shapes from a trial, halving the step, until the steps are small against the range; with scores
    /// by blocks.
    pub(crate) fn refine(&self, start: &Trial, library: &[Candidate], rows: &Rows) -> Trial {
        let candidate = &library[start.candidate];
        let mut best = start.clone();
        let mut step = (0.5 / candidate.grid().len() as f64).max(REFINEMENT_STEP);
        for _ in 0..if best.shapes.is_empty() { 0 } else { REFINEMENT_HALVINGS } {
            for _ in 0..REFINEMENT_STEPS {
                let better = candidate
                    .neighbours(&best.shapes, step)
                    .par_iter()
                    .map(|s| self.attempt(start.candidate, candidate, s, rows, false))
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
        self.attempt(start.candidate, candidate, &best.shapes, rows, true)
    }
}
