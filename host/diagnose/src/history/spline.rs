//! Cubic B-splines on even knots with clamped ends, and the normal equations that they give: bands of four.

/// A family of cubic B-splines.
#[derive(Clone, Debug)]
pub(super) struct Spline {
    knots: Vec<f64>,
    low: f64,
    step: f64,
    cells: usize,
}

/// The four splines that are not zero at a point: the first one's number, their values and their slopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Local {
    pub first: usize,
    pub value: [f64; 4],
    pub slope: [f64; 4],
}

impl Local {
    pub(super) fn value(&self, weights: &[f64]) -> f64 {
        (0..4).map(|k| self.value[k] * weights[self.first + k]).sum()
    }

    pub(super) fn slope(&self, weights: &[f64]) -> f64 {
        (0..4).map(|k| self.slope[k] * weights[self.first + k]).sum()
    }
}

impl Spline {
    /// Knots from `low` every `step`, `cells` intervals.
    pub(super) fn new(low: f64, step: f64, cells: usize) -> Self {
        let inner = (0..=cells).map(|i| low + step * i as f64);
        let end = low + step * cells as f64;
        let knots = [low; 3].into_iter().chain(inner).chain([end; 3]).collect();
        Self { knots, low, step, cells }
    }

    /// Number of splines.
    pub(super) fn len(&self) -> usize {
        self.cells + 3
    }

    /// The splines at a point; beyond the ends, at the end.
    pub(super) fn at(&self, point: f64) -> Local {
        let end = self.low + self.step * self.cells as f64;
        let u = if point > self.low { point.min(end - 1e-6) } else { self.low + 1e-6 };
        let cell = (((u - self.low) / self.step) as usize).min(self.cells - 1);
        let (span, t) = (cell + 3, &self.knots);
        let mut n = [1.0, 0.0, 0.0, 0.0];
        let mut quadratic = [0.0; 3];
        for degree in 1..=3 {
            if degree == 3 {
                quadratic = [n[0], n[1], n[2]];
            }
            let mut saved = 0.0;
            for r in 0..degree {
                let (right, left) = (t[span + r + 1] - u, u - t[span + 1 + r - degree]);
                let part = n[r] / (right + left);
                n[r] = saved + right * part;
                saved = left * part;
            }
            n[degree] = saved;
        }
        let first = span - 3;
        let mut slope = [0.0; 4];
        for (k, s) in slope.iter_mut().enumerate() {
            let c = first + k;
            if k > 0 {
                *s += 3.0 * quadratic[k - 1] / (t[c + 3] - t[c]);
            }
            if k < 3 {
                *s -= 3.0 * quadratic[k] / (t[c + 4] - t[c + 1]);
            }
        }
        Local { first, value: n, slope }
    }
}

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

    #[test]
    fn splines_sum_to_one_and_slopes_are_those_of_the_values() {
        let s = Spline::new(-50.0, 50.0, 18);
        assert_eq!(s.len(), 21);
        for p in [-49.0, -20.0, 3.0, 120.0, 333.3, 799.0, 849.0] {
            let l = s.at(p);
            assert!((l.value.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(l.slope.iter().sum::<f64>().abs() < 1e-12);
            let weights: Vec<f64> = (0..s.len()).map(|i| (i as f64 * 1.7).sin()).collect();
            let numeric = (s.at(p + 1e-4).value(&weights) - s.at(p - 1e-4).value(&weights)) / 2e-4;
            assert!((l.slope(&weights) - numeric).abs() < 1e-6, "{p}");
        }
    }

    #[test]
    fn banded_equations_are_solved() {
        let s = Spline::new(0.0, 1.0, 5);
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
