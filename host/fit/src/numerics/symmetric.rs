//! Small dense symmetric systems: the normal equations of a fit.
//!
//! Columns are orthonormalised before they come here (see `fit::basis`), so squaring the condition number costs no
//! digits that matter.

/// A symmetric matrix, stored whole, row after row.
#[derive(Debug, Clone, PartialEq)]
pub struct Symmetric {
    /// Rows and columns.
    pub n: usize,
    /// `n × n` entries.
    pub a: Vec<f64>,
}

impl Symmetric {
    /// All zeros.
    #[must_use]
    pub fn zeros(n: usize) -> Self {
        Self { n, a: vec![0.0; n * n] }
    }

    /// Entry `(i, j)`.
    #[inline]
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.a[i * self.n + j]
    }

    /// Adds `value` to entry `(i, j)` and its mirror image (once on the diagonal).
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.a[i * self.n + j] += value;
        if i != j {
            self.a[j * self.n + i] += value;
        }
    }

    /// Adds `weight · r rᵀ` for a sparse row `r`.
    pub fn add_row(&mut self, row: &[(usize, f64)], weight: f64) {
        for &(i, x) in row {
            for &(j, y) in row {
                self.a[i * self.n + j] += weight * x * y;
            }
        }
    }

    /// Copies the lower half to the upper one.
    pub(crate) fn mirror(&mut self) {
        for i in 1..self.n {
            for j in 0..i {
                self.a[j * self.n + i] = self.a[i * self.n + j];
            }
        }
    }

    /// `self + factor · other`.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (x, y) in self.a.iter_mut().zip(&other.a) {
            *x += factor * y;
        }
    }

    /// `self · x`.
    #[must_use]
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        self.a.chunks_exact(self.n).map(|row| dot(row, x)).collect()
    }

    /// `xᵀ · self · x`.
    #[must_use]
    pub fn quadratic(&self, x: &[f64]) -> f64 {
        dot(&self.times(x), x)
    }

    /// How far rounding may move [`Symmetric::quadratic`]: much where large terms cancel.
    #[must_use]
    pub(crate) fn quadratic_rounding(&self, x: &[f64]) -> f64 {
        let size = |row: &[f64]| row.iter().zip(x).map(|(a, x)| (a * x).abs()).sum::<f64>();
        f64::EPSILON * self.a.chunks_exact(self.n).zip(x).map(|(row, x)| size(row) * x.abs()).sum::<f64>()
    }

    /// The Cholesky factor; a pivot that rounding has made useless is replaced so that its unknown stays at zero.
    #[must_use]
    pub fn factor(mut self) -> Cholesky {
        let n = self.n;
        let largest = (0..n).map(|i| self.at(i, i)).fold(0.0_f64, f64::max);
        let mut dropped = 0;
        for j in 0..n {
            let original = self.at(j, j);
            let (above, below) = self.a.split_at_mut((j + 1) * n);
            let row_j = &mut above[j * n..];
            let pivot = row_j[j] - dot(&row_j[..j], &row_j[..j]);
            // `!(…)` also catches a pivot that is not a number.
            let root = if !(pivot > 1e-14 * original.max(1e-16 * largest)) {
                dropped += 1;
                f64::INFINITY
            } else {
                pivot.sqrt()
            };
            row_j[j] = root;
            let row_j = &above[j * n..j * n + j];
            for row_i in below.chunks_exact_mut(n) {
                row_i[j] = (row_i[j] - dot(&row_i[..j], row_j)) / root;
            }
        }
        Cholesky { n, l: self.a, dropped }
    }
}

/// A Cholesky factor `L` with `L Lᵀ` the matrix.
#[derive(Debug, Clone)]
pub struct Cholesky {
    n: usize,
    l: Vec<f64>,
    /// Unknowns that the equations do not determine at all; their solution is zero.
    pub dropped: usize,
}

impl Cholesky {
    /// Solves for one right-hand side.
    #[must_use]
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.n;
        let mut x = b.to_vec();
        for i in 0..n {
            let row = &self.l[i * n..i * n + n];
            x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
        }
        for i in (0..n).rev() {
            x[i] /= self.l[i * n + i];
            let xi = x[i];
            for j in 0..i {
                x[j] -= self.l[i * n + j] * xi;
            }
        }
        x
    }
}

/// Scalar product; of the shorter length where lengths differ.
#[inline]
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut lanes = [0.0; 4];
    let mut i = 0;
    while i + 4 <= n {
        for (lane, k) in lanes.iter_mut().zip(i..i + 4) {
            *lane += a[k] * b[k];
        }
        i += 4;
    }
    let rest: f64 = (i..n).map(|k| a[k] * b[k]).sum();
    lanes[0] + lanes[1] + lanes[2] + lanes[3] + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_solution_solves(values in proptest::collection::vec(-2.0_f64..2.0, 49), x in proptest::collection::vec(-3.0_f64..3.0, 7)) {
            let mut a = Symmetric::zeros(7);
            for row in values.chunks(7) {
                let row: Vec<_> = row.iter().copied().enumerate().collect();
                a.add_row(&row, 1.0);
            }
            for i in 0..7 {
                a.add(i, i, 0.1);
            }
            let b = a.times(&x);
            let found = a.factor().solve(&b);
            for (f, x) in found.iter().zip(&x) {
                prop_assert!((f - x).abs() < 1e-9, "{f} {x}");
            }
        }
    }

    #[test]
    fn an_undetermined_unknown_stays_zero() {
        let mut a = Symmetric::zeros(3);
        a.add_row(&[(0, 1.0), (1, 1.0)], 2.0);
        a.add_row(&[(2, 1.0)], 1.0);
        let factor = a.factor();
        assert_eq!(factor.dropped, 1);
        let x = factor.solve(&[4.0, 4.0, 3.0]);
        assert!((x[0] - 2.0).abs() < 1e-12 && x[1] == 0.0 && (x[2] - 3.0).abs() < 1e-12, "{x:?}");
    }
}
