//! The shared force: a tensor product of cubic B-splines on even knots, over pressure and contraction.

/// Cubic B-splines on even knots.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    low: f64,
    step: f64,
    intervals: usize,
}

impl Axis {
    fn new(low: f64, high: f64, intervals: usize) -> Self {
        let span = (high - low).max(f64::MIN_POSITIVE);
        Self { low, step: span / intervals as f64, intervals }
    }

    fn len(&self) -> usize {
        self.intervals + 3
    }

    /// Number of the first spline that is not zero at a point, the values of four, and their slopes. Beyond the ends the curve continues
    /// as a straight line.
    fn at(&self, point: f64) -> (usize, [f64; 4], [f64; 4]) {
        let u = (point - self.low) / self.step;
        let inside = u.clamp(0.0, self.intervals as f64);
        let first = (inside as usize).min(self.intervals - 1);
        let t = inside - first as f64;
        let r = 1.0 - t;
        let mut value = [
            r * r * r / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * r * r * r - 6.0 * r * r + 4.0) / 6.0,
            t * t * t / 6.0,
        ];
        let slope = [-0.5 * r * r, 1.5 * t * t - 2.0 * t, -1.5 * r * r + 2.0 * r, 0.5 * t * t];
        for (v, s) in value.iter_mut().zip(&slope) {
            *v += s * (u - inside);
        }
        (first, value, slope.map(|s| s / self.step))
    }
}

/// A tensor product of splines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Surface {
    pressure: Axis,
    contraction: Axis,
}

/// Numbers of coefficients with what they are multiplied by.
pub(super) type Sparse = [(usize, f64); 16];

impl Surface {
    pub(super) fn new(pressure: (f64, f64), contraction: (f64, f64), intervals: usize) -> Self {
        Self {
            pressure: Axis::new(pressure.0, pressure.1, intervals),
            contraction: Axis::new(contraction.0, contraction.1, intervals),
        }
    }

    /// Number of coefficients.
    pub(super) fn len(&self) -> usize {
        self.pressure.len() * self.contraction.len()
    }

    /// The splines at a place, and their slopes by contraction.
    pub(super) fn at(&self, pressure: f64, contraction: f64) -> (Sparse, Sparse) {
        let (p, pv, _) = self.pressure.at(pressure);
        let (c, cv, cs) = self.contraction.at(contraction);
        let width = self.contraction.len();
        let mut values = [(0, 0.0); 16];
        let mut slopes = values;
        for i in 0..4 {
            for j in 0..4 {
                let index = (p + i) * width + c + j;
                values[4 * i + j] = (index, pv[i] * cv[j]);
                slopes[4 * i + j] = (index, pv[i] * cs[j]);
            }
        }
        (values, slopes)
    }

    /// Rows of the penalty on bending: second differences over pressure (true) and over contraction (false).
    pub(super) fn bending(&self) -> Vec<(bool, [(usize, f64); 3])> {
        let (rows, width) = (self.pressure.len(), self.contraction.len());
        let mut all = Vec::new();
        for i in 0..rows {
            for j in 0..width {
                let at = |i: usize, j: usize| i * width + j;
                if i + 2 < rows {
                    all.push((true, [(at(i, j), 1.0), (at(i + 1, j), -2.0), (at(i + 2, j), 1.0)]));
                }
                if j + 2 < width {
                    all.push((false, [(at(i, j), 1.0), (at(i, j + 1), -2.0), (at(i, j + 2), 1.0)]));
                }
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_sum_to_one_and_slopes_are_those_of_the_values() {
        let s = Surface::new((1e5, 6e5), (-0.01, 0.17), 8);
        for (p, c) in [(1.1e5, 0.0), (3.3e5, 0.121), (6.4e5, 0.2), (0.0, -0.05)] {
            let (values, slopes) = s.at(p, c);
            assert!((values.iter().map(|v| v.1).sum::<f64>() - 1.0).abs() < 1e-12);
            let sum = |at: &Sparse| at.iter().map(|(k, v)| v * (1.3 * *k as f64).sin()).sum::<f64>();
            let numeric = (sum(&s.at(p, c + 1e-6).0) - sum(&s.at(p, c - 1e-6).0)) / 2e-6;
            assert!((sum(&slopes) - numeric).abs() < 1e-5 * numeric.abs().max(1.0), "{p} {c}");
        }
    }
}
