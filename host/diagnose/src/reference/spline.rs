//! The force of one mounting over pressure and direction as a penalised spline.

use nalgebra::{DMatrix, DVector};
use pam_fit::numerics::bspline::CubicSplines;

use super::criteria::{GAP_PENALTY, GAP_RIDGE, GCV_PRICE, RUN_RIDGE, SPLINE_COEFFICIENTS, SPLINE_INTERVALS};

/// A mean over settled rows of a run in one direction and pressure bin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub direction: f64,
    pub pressure: f64,
    pub force: f64,
    pub run: usize,
}

/// `F = A(P) + d H(P)`, effects of single runs taken out.
#[derive(Debug, Clone)]
pub(super) struct Spline {
    basis: CubicSplines,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// The splines over the range of pressure. Their knots continue beyond it, so that the penalty is the same everywhere.
fn basis(low: f64, high: f64) -> CubicSplines {
    CubicSplines::unclamped(low, (high - low) / SPLINE_INTERVALS as f64, SPLINE_INTERVALS)
}

/// The design: both curves and, where there are several runs, four effects of each.
fn design(points: &[Point], runs: usize, low: f64, high: f64) -> DMatrix<f64> {
    let effects = if runs < 2 { 0 } else { 4 * runs };
    let mut x = DMatrix::zeros(points.len(), 2 * SPLINE_COEFFICIENTS + effects);
    let basis = basis(low, high);
    for (row, p) in points.iter().enumerate() {
        let local = basis.at(p.pressure);
        for (k, value) in local.value.iter().enumerate() {
            x[(row, local.first + k)] = *value;
            x[(row, SPLINE_COEFFICIENTS + local.first + k)] = p.direction * value;
        }
        if effects > 0 {
            let z = 2.0 * (p.pressure - low) / (high - low) - 1.0;
            for (k, value) in [1.0, z, p.direction, p.direction * z].into_iter().enumerate() {
                x[(row, 2 * SPLINE_COEFFICIENTS + 4 * p.run + k)] = value;
            }
        }
    }
    x
}

/// Second differences, squared, for the curve and the gap; and what does not depend on λ.
fn penalties(size: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let (mut smooth, mut fixed) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
    for (block, weight) in [(0, 1.0), (SPLINE_COEFFICIENTS, GAP_PENALTY)] {
        for i in 0..SPLINE_COEFFICIENTS - 2 {
            for (a, da) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                for (b, db) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                    smooth[(block + i + a, block + i + b)] += weight * da * db;
                }
            }
        }
    }
    for i in 0..size {
        fixed[(i, i)] = 1e-8
            + match i {
                i if i >= 2 * SPLINE_COEFFICIENTS => RUN_RIDGE,
                i if i >= SPLINE_COEFFICIENTS => GAP_RIDGE,
                _ => 0.0,
            };
    }
    (smooth, fixed)
}

impl Spline {
    /// Fits the points; the smoothness is chosen by generalised cross-validation. `None` where nothing can be solved.
    pub fn fit(points: &[Point], low: f64, high: f64) -> Option<Self> {
        let mut runs: Vec<usize> = points.iter().map(|p| p.run).collect();
        runs.sort_unstable();
        runs.dedup();
        let points: Vec<Point> =
            points.iter().map(|p| Point { run: runs.binary_search(&p.run).unwrap_or(0), ..*p }).collect();
        let n = points.len() as f64;
        let x = design(&points, runs.len(), low, high);
        let f = DVector::from_iterator(points.len(), points.iter().map(|p| p.force));
        let (gram, moment) = (x.tr_mul(&x), x.tr_mul(&f));
        let (smooth, fixed) = penalties(gram.nrows());
        let mut best: Option<(f64, Self)> = None;
        for step in 0..12 {
            let lambda = 10f64.powf(-3.0 + 0.5 * f64::from(step));
            let normal = &gram + &smooth * lambda + &fixed;
            let Some(factor) = normal.clone().cholesky() else { continue };
            let c = factor.solve(&moment);
            let freedom = factor.solve(&gram).trace();
            let rss = (&f - &x * &c).norm_squared();
            let score = n * rss / (n - GCV_PRICE * freedom).max(1.0).powi(2);
            if best.as_ref().is_none_or(|(s, _)| score < *s) {
                let inner =
                    normal.view((0, 0), (2 * SPLINE_COEFFICIENTS, 2 * SPLINE_COEFFICIENTS)).into_owned();
                let Some(inverse) = inner.cholesky() else { continue };
                let covariance = inverse.inverse() * (rss / (n - freedom).max(1.0));
                let coefficients = c.rows(0, 2 * SPLINE_COEFFICIENTS).into_owned();
                best = Some((score, Self { basis: basis(low, high), coefficients, covariance }));
            }
        }
        best.map(|(_, s)| s)
    }

    /// The curve whose coefficients begin at `offset`.
    fn curve(&self, offset: usize) -> &[f64] {
        &self.coefficients.as_slice()[offset..offset + SPLINE_COEFFICIENTS]
    }

    /// Mean of both directions, N.
    pub fn mean(&self, pressure: f64) -> f64 {
        self.basis.at(pressure).value(self.curve(0))
    }

    /// Slope of the mean over pressure.
    pub fn slope(&self, pressure: f64) -> f64 {
        self.basis.at(pressure).slope(self.curve(0))
    }

    /// Half the gap, filling minus mean, N.
    pub fn gap(&self, pressure: f64) -> f64 {
        self.basis.at(pressure).value(self.curve(SPLINE_COEFFICIENTS))
    }

    /// Variance of the surface, N².
    pub fn variance(&self, pressure: f64, direction: f64) -> f64 {
        let local = self.basis.at(pressure);
        let (i, b) = (local.first, local.value);
        let mut index = [(0, 0.0); 8];
        for k in 0..4 {
            index[k] = (i + k, b[k]);
            index[4 + k] = (SPLINE_COEFFICIENTS + i + k, direction * b[k]);
        }
        let inner =
            |(r, x): (usize, f64)| index.iter().map(|(c, y)| x * y * self.covariance[(r, *c)]).sum::<f64>();
        index.into_iter().map(inner).sum::<f64>().max(0.0)
    }
}
