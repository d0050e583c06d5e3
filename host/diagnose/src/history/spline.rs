//! The normal equations of a curve of cubic B-splines: bands of four.

use pam_fit::numerics::bspline::Local;

/// Symmetric positive definite equations whose matrix has three bands beside the diagonal.
#[derive(Clone, Debug)]
pub(super) struct Banded {
    /// `rows[i][d]` is the element `(i, i − d)`.
    rows: Vec<[f64; 4]>,
}

impl Banded {
    /// `λ ‖D² w‖² + λ_0 ‖w‖²`.
    pub(super) fn penalty(count: usize, smoothness: f64, ridge: f64) -> Self {
        let mut band = Self { rows: vec![[ridge, 0.0, 0.0, 0.0]; count] };
        for i in 0..count.saturating_sub(2) {
            let d = [1.0, -2.0, 1.0];
            for a in 0..3 {
                for b in 0..=a {
                    band.rows[i + a][a - b] += smoothness * d[a] * d[b];
                }
            }
        }
        band
    }

    /// Adds `w b bᵀ`.
    pub(super) fn add(&mut self, local: &Local, weight: f64) {
        for a in 0..4 {
            for b in 0..=a {
                self.rows[local.first + a][a - b] += weight * local.value[a] * local.value[b];
            }
        }
    }

    /// The Cholesky factor in the same bands.
    pub(super) fn factor(mut self) -> Factor {
        for i in 0..self.rows.len() {
            for d in (0..4.min(i + 1)).rev() {
                let j = i - d;
                let from = i.saturating_sub(3).max(j.saturating_sub(3));
                let known: f64 = (from..j).map(|k| self.rows[i][i - k] * self.rows[j][j - k]).sum();
                let rest = self.rows[i][d] - known;
                self.rows[i][d] =
                    if d == 0 { rest.max(f64::MIN_POSITIVE).sqrt() } else { rest / self.rows[j][0] };
            }
        }
        Factor { rows: self.rows }
    }
}

/// See [`Banded::factor`].
#[derive(Clone, Debug)]
pub(super) struct Factor {
    rows: Vec<[f64; 4]>,
}

impl Factor {
    /// Solves for one right-hand side in place.
    pub(super) fn solve(&self, x: &mut [f64]) {
        let count = self.rows.len();
        for i in 0..count {
            let known: f64 = (1..4.min(i + 1)).map(|d| self.rows[i][d] * x[i - d]).sum();
            x[i] = (x[i] - known) / self.rows[i][0];
        }
        for i in (0..count).rev() {
            let known: f64 = (1..4.min(count - i)).map(|d| self.rows[i + d][d] * x[i + d]).sum();
            x[i] = (x[i] - known) / self.rows[i][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pam_fit::numerics::bspline::CubicSplines;

    #[test]
    fn banded_equations_are_solved() {
        let s = CubicSplines::clamped(0.0, 1.0, 5);
        let mut band = Banded::penalty(s.len(), 0.3, 0.1);
        let mut dense = vec![vec![0.0; s.len()]; s.len()];
        for i in 0..50 {
            band.add(&s.at(0.1 * f64::from(i)), 1.0);
        }
        for (i, row) in band.rows.iter().enumerate() {
            for d in 0..4.min(i + 1) {
                dense[i][i - d] = row[d];
                dense[i - d][i] = row[d];
            }
        }
        let wanted: Vec<f64> = (0..s.len()).map(|i| i as f64 - 2.0).collect();
        let mut x: Vec<f64> = dense.iter().map(|r| r.iter().zip(&wanted).map(|(a, b)| a * b).sum()).collect();
        band.factor().solve(&mut x);
        assert!(x.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{x:?}");
    }
}
