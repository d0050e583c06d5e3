//! The library of effects as columns: each candidate evaluated over the rows, per amplitude, on a grid of its shapes.

use model_core::effects::{Info, Link, MEMORY, Parameter, Role};
use rayon::prelude::*;

use super::linear::{Basis, Sign, amplitudes, dot, energy, projected};
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
            let (low, high) = match p.name {
                "slip_time" => self.span.time,
                "jamming_contraction" => (self.span.contraction.0.max(0.0), self.span.contraction.1),
                _ => (p.low, p.high),
            };
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

    /// Whether its force is read even when the muscle is vented and slack.
    fn seen_vented(&self) -> bool {
        matches!(self.name(), "force-offset" | "force-drift" | "cross-talk" | "gravity")
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

    /// Its force per unit of each amplitude, N, over the rows in order.
    pub(crate) fn columns(&self, shapes: &[f64], rows: &Rows) -> Vec<Vec<f64>> {
        let mut memory = [0.0; MEMORY];
        let mut columns = self.law.columns(&rows.contexts, shapes, &mut memory);
        let vented_too = self.seen_vented();
        for column in &mut columns {
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
    let span = Span::of(&rows.contexts).unwrap_or(Span { time: (0.0, 1.0), contraction: (0.0, 1.0) });
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
    /// Energy that it takes from the weighted residual, N².
    pub gain: f64,
    /// Share of its columns' energy that the baseline cannot imitate.
    pub visible: f64,
    /// Block by block, the inner product of its fitted trace and the residual (for tests by whole blocks).
    pub scores: Vec<f64>,
    /// The same for each single amplitude's column, per unit norm.
    pub singles: Vec<Vec<f64>>,
    /// Weighted root mean square of the fitted trace before the baseline is refitted, N.
    pub size: f64,
    /// The largest force that it makes at any row, N.
    pub peak: f64,
}

/// An amplitude may exceed its known range by this factor.
const BEYOND: f64 = 10.0;
/// The least share of a column's energy outside the baseline for it to be judged at all.
pub(crate) const INVISIBLE: f64 = 1e-5;

/// Tries a candidate at given shapes.
pub(crate) fn attempt(
    index: usize,
    candidate: &Candidate,
    shapes: &[f64],
    rows: &Rows,
    basis: &Basis,
    residual: &[f64],
) -> Trial {
    let columns = candidate.columns(shapes, rows);
    let z = projected_serial(&columns, &rows.root_weight, basis);
    let signs = candidate.signs();
    let before: f64 = columns
        .iter()
        .map(|c| c.iter().zip(&rows.root_weight).map(|(v, w)| (v * w).powi(2)).sum::<f64>())
        .sum();
    let after: f64 = z.iter().map(|v| energy(v)).sum();
    let visible = if before > 0.0 { after / before } else { 0.0 };
    let mut trial = Trial {
        candidate: index,
        shapes: shapes.to_vec(),
        amplitudes: vec![0.0; columns.len()],
        gain: 0.0,
        visible,
        scores: vec![0.0; rows.blocks],
        singles: Vec::new(),
        size: 0.0,
        peak: 0.0,
    };
    if visible < INVISIBLE {
        return trial;
    }
    let gram: Vec<Vec<f64>> = z.iter().map(|a| z.iter().map(|b| dot(a, b)).collect()).collect();
    let moment: Vec<f64> = z.iter().map(|a| dot(a, residual)).collect();
    let (a, mut gain) = amplitudes(&gram, &moment, &signs, if candidate.info.alternatives { 1 } else { 6 });
    // Ten times beyond what anybody has seen is another thing under this name.
    let known = candidate.info.parameters.iter();
    if known.zip(&a).any(|(p, a)| a.abs() > BEYOND * p.low.abs().max(p.high.abs())) {
        gain = 0.0;
    }
    trial.gain = gain;
    for i in 0..rows.len() {
        let fitted: f64 = a.iter().zip(&z).map(|(a, z)| a * z[i]).sum();
        trial.scores[rows.block[i] as usize] += fitted * residual[i];
        // What has no amplitude yet keeps the proportion of peak to size of its first column.
        let raw: f64 =
            if gain > 0.0 { a.iter().zip(&columns).map(|(a, c)| a * c[i]).sum() } else { columns[0][i] };
        trial.size += (raw * rows.root_weight[i]).powi(2);
        if rows.root_weight[i] > 0.0 {
            trial.peak = trial.peak.max(raw.abs());
        }
    }
    trial.size = (trial.size / energy(&rows.root_weight).max(1e-12)).sqrt();
    for column in &z {
        let norm = energy(column).sqrt();
        let mut scores = vec![0.0; rows.blocks];
        if norm > 0.0 {
            for i in 0..rows.len() {
                scores[rows.block[i] as usize] += column[i] * residual[i] / norm;
            }
        }
        trial.singles.push(scores);
    }
    trial.amplitudes = a;
    trial
}

fn projected_serial(columns: &[Vec<f64>], root_weight: &[f64], basis: &Basis) -> Vec<Vec<f64>> {
    columns
        .iter()
        .map(|c| {
            let mut v = super::linear::weighted(c, root_weight);
            basis.project_out(&mut v);
            v
        })
        .collect()
}

/// Every candidate at every grid point, in a fixed order.
pub(crate) fn scan(library: &[Candidate], rows: &Rows, basis: &Basis, residual: &[f64]) -> Vec<Trial> {
    let work: Vec<(usize, Vec<f64>)> =
        library.iter().enumerate().flat_map(|(i, c)| c.grid().into_iter().map(move |g| (i, g))).collect();
    work.par_iter().map(|(i, shapes)| attempt(*i, &library[*i], shapes, rows, basis, residual)).collect()
}

/// Walks downhill in the shapes from a trial, halving the step, until the steps are small against the range.
pub(crate) fn refine(
    start: &Trial,
    library: &[Candidate],
    rows: &Rows,
    basis: &Basis,
    residual: &[f64],
) -> Trial {
    let candidate = &library[start.candidate];
    let mut best = start.clone();
    if best.shapes.is_empty() {
        return best;
    }
    let mut step = 0.5 / candidate.grid().len() as f64;
    step = step.max(0.05);
    for _ in 0..5 {
        for _ in 0..2 {
            let better = candidate
                .neighbours(&best.shapes, step)
                .par_iter()
                .map(|s| attempt(start.candidate, candidate, s, rows, basis, residual))
                .collect::<Vec<_>>()
                .into_iter()
                .max_by(|a, b| a.gain.total_cmp(&b.gain));
            match better {
                Some(b) if b.gain > best.gain * (1.0 + 1e-6) => best = b,
                _ => break,
            }
        }
        step *= 0.5;
    }
    best
}

/// The fitted trace of a trial over the rows, N.
pub(crate) fn trace(trial: &Trial, library: &[Candidate], rows: &Rows) -> Vec<f64> {
    let columns = library[trial.candidate].columns(&trial.shapes, rows);
    (0..rows.len()).map(|i| trial.amplitudes.iter().zip(&columns).map(|(a, c)| a * c[i]).sum()).collect()
}

/// The weighted trace of a trial (of its first column where it has no amplitude) freed of what the baseline expresses.
pub(crate) fn projected_trace(trial: &Trial, library: &[Candidate], rows: &Rows, basis: &Basis) -> Vec<f64> {
    let column = trace(trial, library, rows);
    projected(&[column], &rows.root_weight, basis).swap_remove(0)
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
