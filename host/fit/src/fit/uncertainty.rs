//! How uncertain the parameters are: a jackknife over blocks of the motion.
//!
//! Residuals are correlated in time (noise that is coloured, misfit that lasts), so single rows are no independent witnesses.
//! Blocks are stretches of a half-stroke several autocorrelation times long. Each is left out in turn; around the
//! solution that is a subtraction from the normal equations:
//!
//! ```text
//! θ₍₋b₎ − θ = −(N + S − N_b)⁻¹ s_b          C = (n_b − 1)/n_b Σ_b (θ₍₋b₎ − θ)(θ₍₋b₎ − θ)ᵀ
//! ```
//! with `N_b = Σ w J Jᵀ` and `s_b = Σ w J r` of the block, `S` the penalty. Leaving out, instead of only weighing, accounts for
//! blocks that the fit follows closely because little else determines the same parameters (B. Efron and C. Stein,
//! Ann. Statist. 9 (1981) 586, doi 10.1214/aos/1176345462).

use std::ops::Range;

use nalgebra::DMatrix;

use super::design::{Design, Layout};
use super::linear::{Symmetric, dot};
use super::prepared::Prepared;

/// A square root of a covariance, `C = S Sᵀ`, row after row.
///
/// ```
/// use pam_fit::fit::uncertainty::Root;
///
/// // Two numbers that share one source of error and have one each of their own.
/// let root = Root { rows: 2, columns: 3, s: vec![3.0, 4.0, 0.0, 3.0, 0.0, 4.0] };
/// assert_eq!((root.std(0), root.std(1)), (5.0, 5.0));
/// assert_eq!(root.correlation(0, 1), Some(9.0 / 25.0));
/// // var(a − b) = 25 + 25 − 2 · 9: what they share cancels.
/// assert_eq!(root.variance(&[1.0, -1.0]), 32.0);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Root {
    /// Rows: one per number.
    pub rows: usize,
    /// Columns: one per block.
    pub columns: usize,
    /// `S`.
    pub s: Vec<f64>,
}

impl Root {
    /// The variance of `gᵀ θ`.
    #[must_use]
    pub fn variance(&self, g: &[f64]) -> f64 {
        let mut sum = vec![0.0; self.columns];
        for (i, gi) in g.iter().enumerate().filter(|(_, g)| **g != 0.0) {
            for (to, s) in sum.iter_mut().zip(&self.s[i * self.columns..(i + 1) * self.columns]) {
                *to += gi * s;
            }
        }
        dot(&sum, &sum)
    }

    /// The standard deviation of number `i`.
    #[must_use]
    pub fn std(&self, i: usize) -> f64 {
        let row = &self.s[i * self.columns..(i + 1) * self.columns];
        dot(row, row).sqrt()
    }

    /// The correlation of numbers `i` and `j`; none where one of them is not uncertain.
    #[must_use]
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let row = |i: usize| &self.s[i * self.columns..(i + 1) * self.columns];
        let size = self.std(i) * self.std(j);
        (size > 0.0).then(|| if i == j { 1.0 } else { dot(row(i), row(j)) / size })
    }

    /// Adds one more column: an independent source of uncertainty.
    fn append(&mut self, column: &[f64]) {
        let mut s = Vec::with_capacity(self.rows * (self.columns + 1));
        for (i, x) in column.iter().enumerate().take(self.rows) {
            s.extend_from_slice(&self.s[i * self.columns..(i + 1) * self.columns]);
            s.push(*x);
        }
        self.columns += 1;
        self.s = s;
    }

    /// The same covariance with at most as many columns as rows, from the eigenvectors of `C` with rows scaled to unit size.
    #[must_use]
    pub fn compact(&self) -> Self {
        if self.columns <= self.rows {
            return self.clone();
        }
        let scale: Vec<f64> =
            (0..self.rows).map(|i| Some(self.std(i)).filter(|s| *s > 0.0).unwrap_or(1.0)).collect();
        let row = |i: usize| &self.s[i * self.columns..(i + 1) * self.columns];
        let c = DMatrix::from_fn(self.rows, self.rows, |i, j| dot(row(i), row(j)) / (scale[i] * scale[j]));
        let eigen = c.symmetric_eigen();
        let mut s = Vec::with_capacity(self.rows * self.rows);
        for (i, scale) in scale.iter().enumerate() {
            for k in 0..self.rows {
                s.push(scale * eigen.eigenvectors[(i, k)] * eigen.eigenvalues[k].max(0.0).sqrt());
            }
        }
        Self { rows: self.rows, columns: self.rows, s }
    }

    /// The root of `A C Aᵀ`, `A` given row after row.
    #[must_use]
    pub fn transformed(&self, a: &[Vec<f64>]) -> Self {
        let mut s = Vec::with_capacity(a.len() * self.columns);
        for row in a {
            let mut to = vec![0.0; self.columns];
            for (x, from) in
                row.iter().zip(self.s.chunks_exact(self.columns.max(1))).filter(|(x, _)| **x != 0.0)
            {
                for (t, f) in to.iter_mut().zip(from) {
                    *t += x * f;
                }
            }
            s.extend(to);
        }
        Self { rows: a.len(), columns: self.columns, s }
    }
}

/// What the jackknife used and found.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// Root of the covariance of the parameters in the order of [`Layout`].
    pub root: Root,
    /// Blocks left out in turn.
    pub blocks: usize,
    /// Integrated autocorrelation time of the residuals, in points.
    pub correlation: f64,
}

/// At most this many blocks: more cost time and add nothing.
const MOST_BLOCKS: usize = 240;

/// Runs the jackknife.
#[must_use]
pub fn jackknife(prepared: &Prepared, penalty: &Symmetric) -> Uncertain {
    let correlation = correlation_time(prepared);
    let blocks = blocks(prepared, correlation);
    let mut root = leave_out(&prepared.design, &prepared.parameters, &prepared.weights, penalty, &blocks);
    if let Some(std) = prepared.deadband_std {
        root.append(&follow_deadband(prepared, penalty, std));
    }
    Uncertain { root, blocks: blocks.len(), correlation }
}

/// How all parameters follow when a held `P0` moves by `std`, Pa.
fn follow_deadband(prepared: &Prepared, penalty: &Symmetric, std: f64) -> Vec<f64> {
    let design = &prepared.design;
    let mut matrix = design.normal(&prepared.parameters, &prepared.weights).matrix;
    matrix.add_scaled(penalty, 1.0);
    let mut right = vec![0.0; matrix.n];
    right[Layout::DEADBAND] = design.hold_deadband * std;
    matrix.factor().solve(&right)
}

fn leave_out(
    design: &Design,
    parameters: &[f64],
    weights: &[f64],
    penalty: &Symmetric,
    blocks: &[Range<usize>],
) -> Root {
    let n = design.layout().len();
    let curves = design.curves(parameters);
    let mut whole = design.normal(parameters, weights).matrix;
    whole.add_scaled(penalty, 1.0);
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(blocks.len());
    for block in blocks {
        let part = design.normal_of(block.clone(), parameters, &curves, weights);
        if part.weight <= 0.0 {
            continue;
        }
        let mut without = whole.clone();
        without.add_scaled(&part.matrix, -1.0);
        columns.push(without.factor().solve(&part.right));
    }
    let count = columns.len() as f64;
    let scale = ((count - 1.0).max(1.0) / count.max(1.0)).sqrt();
    let mut s = vec![0.0; n * columns.len()];
    for (b, column) in columns.iter().enumerate() {
        for (i, v) in column.iter().enumerate() {
            s[i * columns.len() + b] = v * scale;
        }
    }
    Root { rows: n, columns: columns.len(), s }
}

/// `1 + 2 Σ ρ_l` of the weighted residuals within half-strokes, summed until `ρ` falls below a twentieth.
fn correlation_time(prepared: &Prepared) -> f64 {
    let residuals = prepared.design.residuals(&prepared.parameters);
    let scatter = prepared.scatter(&residuals);
    let list = &prepared.points.list;
    let standard: Vec<f64> = (0..list.len())
        .map(|i| {
            let group = prepared.design.bins[prepared.design.rows[i].bin as usize].group as usize;
            if prepared.weights[i] > 0.0 {
                (residuals[i] / scatter[group]).clamp(-4.0, 4.0)
            } else {
                f64::NAN
            }
        })
        .collect();
    let product = |lag: usize| {
        let (mut sum, mut n) = (0.0, 0.0);
        for i in 0..list.len().saturating_sub(lag) {
            let p = standard[i] * standard[i + lag];
            if list[i].block == list[i + lag].block && p.is_finite() {
                sum += p;
                n += 1.0;
            }
        }
        if n > 0.0 { sum / n } else { 0.0 }
    };
    let variance = product(0);
    let mut time = 1.0;
    if variance > 0.0 {
        for lag in 1..400 {
            let rho = product(lag) / variance;
            if rho < 0.05 {
                break;
            }
            time += 2.0 * rho;
        }
    }
    time
}

/// Stretches of half-strokes, at least four correlation times long where the half-stroke is.
fn blocks(prepared: &Prepared, correlation: f64) -> Vec<Range<usize>> {
    let list = &prepared.points.list;
    let used = prepared.weights.iter().filter(|w| **w > 0.0).count();
    let length = (4.0 * correlation).max(used as f64 / MOST_BLOCKS as f64).max(1.0);
    let mut blocks = Vec::new();
    let mut start = 0;
    while start < list.len() {
        let end = start + list[start..].iter().take_while(|p| p.block == list[start].block).count();
        let fitted: Vec<usize> = (start..end).filter(|i| prepared.weights[*i] > 0.0).collect();
        if !fitted.is_empty() {
            let pieces = ((fitted.len() as f64 / length) as usize).max(1);
            for k in 0..pieces {
                let from = fitted[k * fitted.len() / pieces];
                let to = if k + 1 < pieces { fitted[(k + 1) * fitted.len() / pieces] } else { end };
                blocks.push(from..to);
            }
        }
        start = end;
    }
    // Half-strokes shorter than that are joined with their neighbours, so that the number of blocks stays bounded.
    while blocks.len() > 2 * MOST_BLOCKS {
        blocks = blocks.chunks(2).map(|c| c[0].start..c[c.len() - 1].end).collect();
    }
    blocks
}

/// The root for the numbers of a table: `P0`, `E_k` at every given pressure (Pa), `k_F` at every one.
#[must_use]
pub fn of_table(prepared: &Prepared, root: &Root, pressures: &[f64]) -> Root {
    let design = &prepared.design;
    let layout = design.layout();
    let mut rows = Vec::with_capacity(1 + (layout.order + 1) * pressures.len());
    let mut unit = vec![0.0; layout.len()];
    unit[Layout::DEADBAND] = 1.0;
    rows.push(unit);
    let phis: Vec<Vec<f64>> = pressures.iter().map(|p| design.basis.at(*p)).collect();
    for i in 0..layout.order {
        for phi in &phis {
            let mut row = vec![0.0; layout.len()];
            for k in i..layout.order {
                let t = design.orthonormal.t[i * layout.order + k];
                for (j, v) in phi.iter().enumerate() {
                    row[layout.elastic(k, j)] = t * v;
                }
            }
            rows.push(row);
        }
    }
    for phi in &phis {
        let mut row = vec![0.0; layout.len()];
        for (j, v) in phi.iter().enumerate() {
            row[layout.friction(j)] = *v;
        }
        rows.push(row);
    }
    root.transformed(&rows)
}
