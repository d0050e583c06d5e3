//! The library of effects as columns: each candidate evaluated over the rows, per amplitude, on a grid of its shapes.

use model_core::effects::{Info, Link, MEMORY, Parameter, Role};
use rayon::prelude::*;

use super::baselines::{Baseline, Give, Reach, keeps, projected};
use super::evidence::{Products, Scale, Target, Weighed, weigh, weigh_at};
use super::linear::{Sign, add_scaled, dot, energy, weighted};
use super::rows::Rows;
use crate::bench::{Candidate as Law, Span};

/// One member of the library.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Its equations.
    pub law: Law,
    /// What it is.
    pub info: &'static Info,
    /// What the recordings can show of shapes on their own axes.
    span: Span,
}

impl Candidate {
    /// Its name in the catalogue.
    pub(crate) fn name(&self) -> &'static str {
        self.info.name
    }

    /// Whether it belongs to the bench and corrects the data.
    pub(crate) fn of_the_bench(&self) -> bool {
        self.law.is_bench()
    }

    /// Its shape parameters, with ranges that the recordings reach.
    fn shapes(&self) -> impl Iterator<Item = Parameter> + '_ {
        self.info.parameters.iter().filter(|p| p.role == Role::Shape).map(|p| {
            let (low, high) = self.span.range(p);
            Parameter { low, high, ..*p }
        })
    }

    /// Which sign each amplitude may have, by its plausible range.
    pub(crate) fn signs(&self) -> Vec<Sign> {
        self.info
            .parameters
            .iter()
            .filter(|p| p.role == Role::Amplitude)
            .map(|p| {
                if p.low >= 0.0 {
                    Sign::Positive
                } else if p.high <= 0.0 {
                    Sign::Negative
                } else {
                    Sign::Free
                }
            })
            .collect()
    }

    /// Whether a vented muscle shows it by itself: a weight, or an offset.
    pub(crate) fn shown_vented(&self, rows: &Rows) -> bool {
        matches!(self.name(), "force-offset" | "gravity") && rows.vented.contains(&true)
    }

    /// How inexact its law is, as a share of its trace. A weight or an offset is what it is where a vented muscle shows it; elsewhere it
    /// is judged by how friction scales with the pull, and that law is no more exact than others.
    fn law_error(&self, rows: &Rows) -> f64 {
        if self.shown_vented(rows) { 0.0 } else { LAW_ERROR }
    }

    /// Whether the force of an amplitude is read even when the muscle is vented and slack. A guide or a rod's seal that stuck holds
    /// what it held; strands that no pressure holds together do not rub.
    fn seen_vented(&self, amplitude: usize) -> bool {
        match self.name() {
            "force-offset" | "force-drift" | "cross-talk" | "gravity" | "seal-friction" => true,
            "coulomb-friction" => amplitude == 0,
            _ => false,
        }
    }

    /// The grid of shapes that is looked at first.
    pub(crate) fn grid(&self) -> Vec<Vec<f64>> {
        let shapes: Vec<Parameter> = self.shapes().collect();
        let points = match shapes.len() {
            0 | 1 => 9,
            2 => 5,
            3 => 4,
            _ => 3,
        };
        let mut grid = vec![Vec::new()];
        for p in shapes {
            // A moment cannot be found by walking from a far one: the trace changes where it lies, not how large it is.
            let points = if p.name == "slip_time" { MOMENTS } else { points };
            let axis: Vec<f64> = (0..points).map(|i| place(&p, (i as f64 + 0.5) / points as f64)).collect();
            grid = grid
                .into_iter()
                .flat_map(|g: Vec<f64>| {
                    axis.iter().map(move |a| {
                        let mut with = g.clone();
                        with.push(*a);
                        with
                    })
                })
                .collect();
        }
        grid
    }

    /// Shapes near `center`: each parameter moved by `step` of its range (its logarithm where it spans decades).
    pub(crate) fn neighbours(&self, center: &[f64], step: f64) -> Vec<Vec<f64>> {
        let mut near = Vec::new();
        for (i, p) in self.shapes().enumerate() {
            for sign in [-1.0, 1.0] {
                let u = unplace(&p, center[i]) + sign * step;
                if (-0.02..=1.02).contains(&u) {
                    let mut moved = center.to_vec();
                    moved[i] = place(&p, u.clamp(0.0, 1.0));
                    near.push(moved);
                }
            }
        }
        near
    }

    /// Whether numbers that were fitted freely can belong to one and the same thing.
    fn holds_together(&self, amplitudes: &[f64], shapes: &[f64]) -> bool {
        match (self.name(), amplitudes, shapes) {
            // An offset e of the ends costs a = (e/L0)²/2 of the pull and rubs with b = μ e/L0: no guide is as smooth as μ = 0.1.
            ("misalignment", [loss, rub], _) => *rub >= 0.1 * (2.0 * loss.max(0.0)).sqrt(),
            // The frame that gives under load is the frame that gives at the turns.
            ("rig-compliance", [give], [at_turns]) => *give <= 2.5 * at_turns,
            // No joint is looser than free.
            ("backlash", [free], _) => *free <= 1.3,
            // No filter passes more than it is given.
            ("sensor-delay", [_, filtered, delayed], _) => filtered.max(*delayed) <= 1.3,
            _ => true,
        }
    }

    /// Its force per unit of each amplitude, N, over the rows in order.
    pub(crate) fn columns(&self, shapes: &[f64], rows: &Rows) -> Vec<Vec<f64>> {
        let mut memory = [0.0; MEMORY];
        let mut columns = self.law.columns(&rows.contexts, shapes, &mut memory);
        for (amplitude, column) in columns.iter_mut().enumerate() {
            let vented_too = self.seen_vented(amplitude);
            for (value, vented) in column.iter_mut().zip(&rows.vented) {
                if (*vented && !vented_too) || !value.is_finite() {
                    *value = 0.0;
                }
            }
        }
        columns
    }
}

/// The value at a share of a parameter's range; by its logarithm where it spans decades.
fn place(p: &Parameter, u: f64) -> f64 {
    if p.low > 0.0 && p.high > 4.0 * p.low {
        (p.low.ln() + u * (p.high / p.low).ln()).exp()
    } else {
        p.low + u * (p.high - p.low)
    }
}

fn unplace(p: &Parameter, value: f64) -> f64 {
    if p.low > 0.0 && p.high > 4.0 * p.low {
        (value / p.low).ln() / (p.high / p.low).ln()
    } else {
        (value - p.low) / (p.high - p.low).max(1e-300)
    }
}

/// All effects that are looked at, in the order of the library. What cannot be told from a part of the base model in any
/// recording stays out: the gauge's offset is the deadband, and a higher elastic order is offered by the baselines.
pub(crate) fn library(rows: &Rows) -> Vec<Candidate> {
    let span = Span::of(&rows.contexts).unwrap_or(Span {
        time: (0.0, 1.0),
        contraction: (0.0, 1.0),
        stroke: (0.0, 1.0),
    });
    Law::all()
        .filter(|law| !matches!(law.name(), "gauge-offset" | "higher-order-elasticity"))
        .map(|law| Candidate { law, info: law.info(), span })
        .collect()
}

/// A candidate tried beside a baseline at one set of shapes.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    /// Index into the library.
    pub candidate: usize,
    /// Its shapes.
    pub shapes: Vec<f64>,
    /// Its amplitudes, signs kept.
    pub amplitudes: Vec<f64>,
    /// How much less the deviance is with it than without, less what its free numbers cost.
    pub score: f64,
    /// How much bladder and friction differ between pressures beside it.
    pub give: Give,
    /// Energy that it takes from the weighted residual, N².
    pub gain: f64,
    /// The energy that is there without it, N².
    pub before: f64,
    /// Energy that it takes where one bladder has to serve all pressures, N²; and what there was.
    pub relief: f64,
    /// See `relief`.
    pub unrelieved: f64,
    /// Share of its columns' energy that the baseline cannot imitate: not at all, and within its prior.
    pub visible: f64,
    /// Share that is left by the freest tables.
    pub beyond_tables: f64,
    /// Block by block, the inner product of its fitted trace and the residual (for tests by whole blocks).
    pub scores: Vec<f64>,
    /// The same for each single amplitude's column, per unit norm.
    pub singles: Vec<Vec<f64>>,
    /// Weighted root mean square of the fitted trace before the baseline is refitted, N.
    pub size: f64,
    /// The largest force that it makes at any row, N.
    pub peak: f64,
}

/// Moments at which something may have happened that are looked at first.
const MOMENTS: usize = 40;
/// An amplitude may exceed its known range by this factor.
const BEYOND: f64 = 10.0;
/// How inexact a law is, as a share of its trace: first order in sensitivities, shapes from another muscle.
const LAW_ERROR: f64 = 0.03;
/// An error of a law repeats itself: it counts as no more independent rows than this.
const SYSTEMATIC_ROWS: f64 = 100.0;
/// The least share of a column's energy outside the baseline for it to be judged at all.
pub(crate) const INVISIBLE: f64 = 1e-5;

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
                let mut v = weighted(c, &rows.root_weight);
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
        let weight = &rows.root_weight;
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
        let most = if candidate.info.alternatives { 1 } else { 6 };
        let w = weigh(&self.scale, &self.target, &products, &signs, most);
        // Ten times beyond what anybody has seen is another thing under this name.
        let known = candidate.info.parameters.iter();
        let within = |(p, a): (&Parameter, &f64)| a.abs() <= BEYOND * p.low.abs().max(p.high.abs());
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
            trial.size += (raw * rows.root_weight[i]).powi(2);
            if rows.root_weight[i] > 0.0 {
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
        let most = if candidate.info.alternatives { 1 } else { 6 };
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
        rows.progress.stage("trying every effect", work.len() as u64);
        let attempt = |(i, shapes): &(usize, Vec<f64>)| {
            let trial = self.attempt(*i, &library[*i], shapes, rows, false);
            rows.progress.step();
            trial
        };
        work.par_iter().map(attempt).collect()
    }

    /// Walks uphill in the shapes from a trial, halving the step, until the steps are small against the range; with scores
    /// by blocks.
    pub(crate) fn refine(&self, start: &Trial, library: &[Candidate], rows: &Rows) -> Trial {
        let candidate = &library[start.candidate];
        let mut best = start.clone();
        let mut step = (0.5 / candidate.grid().len() as f64).max(0.05);
        for _ in 0..if best.shapes.is_empty() { 0 } else { 5 } {
            for _ in 0..2 {
                let better = candidate
                    .neighbours(&best.shapes, step)
                    .par_iter()
                    .map(|s| self.attempt(start.candidate, candidate, s, rows, false))
                    .collect::<Vec<_>>()
                    .into_iter()
                    .max_by(|a, b| a.score.total_cmp(&b.score));
                match better {
                    Some(b) if b.score > best.score + 1e-3 => best = b,
                    _ => break,
                }
            }
            step *= 0.5;
        }
        self.attempt(start.candidate, candidate, &best.shapes, rows, true)
    }
}

/// The fitted trace of a trial over the rows, N.
pub(crate) fn trace(trial: &Trial, library: &[Candidate], rows: &Rows) -> Vec<f64> {
    let columns = library[trial.candidate].columns(&trial.shapes, rows);
    (0..rows.len()).map(|i| trial.amplitudes.iter().zip(&columns).map(|(a, c)| a * c[i]).sum()).collect()
}

/// The weighted trace of a trial (of its first column where it has no amplitude) freed of what the baseline expresses.
pub(crate) fn projected_trace(trial: &Trial, library: &[Candidate], rows: &Rows, span: &Reach) -> Vec<f64> {
    let column = trace(trial, library, rows);
    projected(&[column], &rows.root_weight, span).swap_remove(0)
}

/// Where an effect acts, in words.
pub(crate) fn place_in_words(link: Link) -> &'static str {
    match link {
        Link::Air => "the air: the pressure at the muscle",
        Link::Braid => "the braid and the muscle's shape",
        Link::Bladder => "the bladder's elasticity",
        Link::Memory => "the bladder's memory",
        Link::Friction => "friction",
        Link::LoadPath => "the load path between muscle and load cell",
        Link::Reading => "the sensors' readings",
    }
}
