//! Cubic B-splines on even knots: at each place four of them are not zero, and the four sum to one.
//!
//! The recursion of Cox and de Boor gives their values from the knots `t` (C. de Boor, A Practical Guide to Splines, 1978, chapter X):
//!
//! ```text
//! B_i,1(u) = 1 where t_i <= u < t_i+1, else 0
//! B_i,k(u) = (u − t_i)/(t_i+k−1 − t_i) B_i,k−1(u) + (t_i+k − u)/(t_i+k − t_i+1) B_i+1,k−1(u)
//! ```
//!
//! Clamped knots repeat the ends, so that the first and the last coefficient are the values there. Unclamped knots continue beyond the
//! ends at the same distance, so that equal second differences of the coefficients are equal curvatures everywhere. Both span the same
//! curves; a penalty on differences of coefficients differs near the ends.

/// A family of cubic B-splines.
///
/// ```
/// use pam_fit::numerics::bspline::CubicSplines;
///
/// let clamped = CubicSplines::clamped(0.0, 1.0, 5);
/// assert_eq!(clamped.len(), 8);
/// assert_eq!(clamped.at(0.0).value, [1.0, 0.0, 0.0, 0.0]);
/// let even = CubicSplines::unclamped(0.0, 1.0, 5);
/// assert_eq!(even.at(2.0).value, [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0, 0.0]);
/// ```
#[derive(Clone, Debug)]
pub struct CubicSplines {
    knots: Vec<f64>,
    low: f64,
    step: f64,
    cells: usize,
}

/// The four splines that are not zero at a place: the first one's number, their values and their slopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// The number of the first.
    pub first: usize,
    /// Their values.
    pub value: [f64; 4],
    /// Their derivatives.
    pub slope: [f64; 4],
}

impl Local {
    /// The value of the curve with these coefficients.
    #[must_use]
    pub fn value(&self, coefficients: &[f64]) -> f64 {
        (0..4).map(|k| self.value[k] * coefficients[self.first + k]).sum()
    }

    /// The slope of the curve with these coefficients.
    #[must_use]
    pub fn slope(&self, coefficients: &[f64]) -> f64 {
        (0..4).map(|k| self.slope[k] * coefficients[self.first + k]).sum()
    }
}

impl CubicSplines {
    /// Knots from `low` every `step`, `cells` intervals; the ends are repeated.
    #[must_use]
    pub fn clamped(low: f64, step: f64, cells: usize) -> Self {
        Self::on(low, step, cells, |i| i.clamp(0, cells as isize))
    }

    /// Knots from `low` every `step`, `cells` intervals; they continue beyond the ends.
    #[must_use]
    pub fn unclamped(low: f64, step: f64, cells: usize) -> Self {
        Self::on(low, step, cells, |i| i)
    }

    /// A step that is not positive, of a range without extent, is taken as 1.
    fn on(low: f64, step: f64, cells: usize, place: impl Fn(isize) -> isize) -> Self {
        let step = if step > 0.0 { step } else { 1.0 };
        let knots = (-3..=cells as isize + 3).map(|i| low + step * place(i) as f64).collect();
        Self { knots, low, step, cells }
    }

    /// Number of splines.
    #[must_use]
    #[allow(clippy::len_without_is_empty, reason = "a family is never empty")]
    pub fn len(&self) -> usize {
        self.cells + 3
    }

    /// The splines at a place; beyond the ends, at the end.
    #[must_use]
    pub fn at(&self, place: f64) -> Local {
        let end = self.low + self.step * self.cells as f64;
        let u = if place > self.low { place.min(end) } else { self.low };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_sum_to_one_and_slopes_are_those_of_the_values() {
        for s in [CubicSplines::clamped(-50.0, 50.0, 18), CubicSplines::unclamped(-50.0, 50.0, 18)] {
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
    }

    /// The closed form of the splines on even knots.
    #[test]
    fn unclamped_splines_have_their_closed_form() {
        let s = CubicSplines::unclamped(2.0, 0.5, 14);
        for p in [2.0, 2.2, 4.9, 8.99, 9.0] {
            let z = ((p - 2.0) / 0.5_f64).min(14.0);
            let cell = (z as usize).min(13);
            let v = z - cell as f64;
            let w = 1.0 - v;
            let expected = [
                w * w * w / 6.0,
                (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0,
                (-3.0 * v * v * v + 3.0 * v * v + 3.0 * v + 1.0) / 6.0,
                v * v * v / 6.0,
            ];
            let l = s.at(p);
            assert_eq!(l.first, cell);
            assert!(l.value.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{p}: {l:?}");
        }
    }

    #[test]
    fn places_beyond_the_ends_and_ranges_without_extent_give_numbers() {
        let s = CubicSplines::clamped(0.0, 1.0, 3);
        assert_eq!(s.at(-9.0), s.at(0.0));
        assert_eq!(s.at(9.0), s.at(3.0));
        assert_eq!(s.at(f64::NAN), s.at(0.0));
        let flat = CubicSplines::unclamped(5.0, 0.0, 14);
        assert!(flat.at(5.0).value.iter().chain(&flat.at(7.0).slope).all(|v| v.is_finite()));
    }
}
