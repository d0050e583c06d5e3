//! What a baseline can express, and the residual of a column once it has been fitted.

use rayon::prelude::*;

use crate::criteria::baseline::{FREE_DEVIATION, FREE_ROW};
use crate::linear::{Basis, Stretch, add_all, dot, energy, products, weighted};

/// How much one bladder may differ between pressures, and how unsure a row is: what a soft baseline takes for granted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PriorDeviations {
    /// Rms that the elastic surface may differ by from one pressure to the next, N.
    pub elastic: f64,
    /// The same of the friction, N.
    pub friction: f64,
    /// Standard deviation of a row for sums over rows, N: noise times the root of the rows per independent row.
    pub row: f64,
}

impl PriorDeviations {
    /// Tables that are free at every pressure.
    pub(crate) fn free(blocked: f64) -> Self {
        Self {
            elastic: FREE_DEVIATION * blocked,
            friction: FREE_DEVIATION * blocked,
            row: FREE_ROW * blocked,
        }
    }
}

/// What a baseline can express: fully (hard), within a prior (soft), and by effects fitted beside it.
///
/// In the soft directions a misfit is partly the bladder's own: the whitened space shrinks them by `keep`, so that inner products
/// exist are those of generalised least squares with the prior integrated out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Absorbable {
    /// Columns with free coefficients, weighted.
    pub hard: Basis,
    /// Unit directions of the flexible tables beyond, orthogonal to the hard ones.
    pub soft: Vec<Vec<f64>>,
    /// Whether a soft direction is friction's.
    pub of_friction: Vec<bool>,
    /// The residual of each soft direction.
    pub keep: Vec<f64>,
    /// The effects beside it, whitened.
    pub chosen: Basis,
    /// The effects beside it, freed of the hard columns only.
    pub chosen_core: Vec<Vec<f64>>,
}

impl Absorbable {
    /// Takes out of a weighted column what the baseline can express.
    pub(crate) fn project_out(&self, v: &mut [f64]) {
        self.whiten(v);
        self.chosen.project_out(v);
    }

    /// The same without the effects.
    pub(super) fn whiten(&self, v: &mut [f64]) {
        self.hard.project_out(v);
        if !self.keep.is_empty() {
            shrink(v, &self.soft, |at, along| (self.keep[at] - 1.0) * along);
        }
    }

    /// A column's components along the soft directions.
    pub(crate) fn components(&self, v: &[f64]) -> Vec<f64> {
        products(&stretches(&self.soft), v)
    }
}

fn stretches(columns: &[Vec<f64>]) -> Vec<Stretch<'_>> {
    columns.iter().map(|c| Stretch::whole(c)).collect()
}

/// Adds to `v` a share of what it has along each of some orthonormal columns: `by` gives how much, of the column's number and
/// the product.
pub(crate) fn shrink(v: &mut [f64], orthonormal: &[Vec<f64>], by: impl Fn(usize, f64) -> f64) {
    let columns = stretches(orthonormal);
    let factors: Vec<f64> =
        products(&columns, v).into_iter().enumerate().map(|(at, along)| by(at, along)).collect();
    add_all(v, &factors, &columns);
}

/// Every column weighted and freed of what a baseline expresses.
pub(crate) fn projected(columns: &[Vec<f64>], root_weight: &[f64], span: &Absorbable) -> Vec<Vec<f64>> {
    columns
        .par_iter()
        .map(|c| {
            let mut v = weighted(c, root_weight);
            span.project_out(&mut v);
            v
        })
        .collect()
}

/// The residual of each soft direction under a prior.
pub(crate) fn keeps(prior: PriorDeviations, of_friction: &[bool], weight: f64) -> Vec<f64> {
    let friction = of_friction.iter().filter(|f| **f).count().max(1) as f64;
    let elastic = of_friction.iter().filter(|f| !**f).count().max(1) as f64;
    let noise = prior.row * prior.row;
    of_friction
        .iter()
        .map(|f| {
            let own =
                weight * if *f { prior.friction.powi(2) / friction } else { prior.elastic.powi(2) / elastic };
            (noise / (noise + own).max(1e-300)).sqrt()
        })
        .collect()
}

/// Cosine of two columns after weighting and projection.
pub(crate) fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let size = (energy(a) * energy(b)).sqrt();
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}
