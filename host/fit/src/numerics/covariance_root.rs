//! Covariances as `C = S Sᵀ`: variances of sums need no more than `S`, and cannot come out negative.

use nalgebra::DMatrix;

use super::symmetric::dot;

/// A square root of a covariance, `C = S Sᵀ`, row after row.
///
/// ```
/// use pam_fit::numerics::covariance_root::CovarianceRoot;
///
/// // Two numbers that share one source of error and have one each of their own.
/// let root = CovarianceRoot { rows: 2, columns: 3, s: vec![3.0, 4.0, 0.0, 3.0, 0.0, 4.0] };
/// assert_eq!((root.std(0), root.std(1)), (5.0, 5.0));
/// assert_eq!(root.correlation(0, 1), Some(9.0 / 25.0));
/// // var(a − b) = 25 + 25 − 2 · 9: what they share cancels.
/// assert_eq!(root.variance(&[1.0, -1.0]), 32.0);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CovarianceRoot {
    /// Rows: one per number.
    pub rows: usize,
    /// Columns: one per block.
    pub columns: usize,
    /// The entries of `S`, row after row.
    pub s: Vec<f64>,
}

impl CovarianceRoot {
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

    /// Multiplies all standard deviations.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.s.iter_mut().for_each(|s| *s *= factor);
    }

    /// Adds one more column: an independent source of uncertainty.
    pub(crate) fn append(&mut self, column: &[f64]) {
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
    pub(crate) fn transformed(&self, a: &[Vec<f64>]) -> Self {
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
