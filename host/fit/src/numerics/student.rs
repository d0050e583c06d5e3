//! Student's t: how far an estimate strays in units of a standard error that few values determine.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// The half-width of a two-sided interval, in standard errors, that misses the truth with the probability `miss`.
///
/// Infinite where there are no degrees of freedom, or the arguments are not numbers.
///
/// ```
/// use pam_fit::numerics::student::half_width;
/// assert!((half_width(0.05, 1.0) - 12.706).abs() < 1e-3);
/// assert!((half_width(0.05, 10.0) - 2.228).abs() < 1e-3);
/// assert!((half_width(0.05, 1e6) - 1.960).abs() < 1e-3);
/// assert_eq!(half_width(0.05, 0.0), f64::INFINITY);
/// ```
#[must_use]
pub fn half_width(miss: f64, freedom: f64) -> f64 {
    if !(miss > 0.0 && miss < 1.0 && freedom > 0.0) {
        return f64::INFINITY;
    }
    // By bisection of the probability: statrs's own inverse does not end for infinitely many degrees of freedom.
    let (mut low, mut high) = (0.0, 1.0);
    while chance_beyond(high, freedom) > miss && high < 1e12 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..52 {
        let middle = 0.5 * (low + high);
        if chance_beyond(middle, freedom) > miss {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The half-width of a 95 % interval, in standard errors.
///
/// ```
/// use pam_fit::numerics::student::half_width_95;
/// assert!((half_width_95(5) - 2.571).abs() < 1e-3);
/// ```
#[must_use]
pub fn half_width_95(freedom: usize) -> f64 {
    half_width(0.05, freedom as f64)
}

/// The probability that chance alone leads further than `t` standard errors, in either direction.
///
/// ```
/// use pam_fit::numerics::student::chance_beyond;
/// assert!((chance_beyond(2.228, 10.0) - 0.05).abs() < 1e-4);
/// ```
#[must_use]
pub fn chance_beyond(t: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |d| 2.0 * d.sf(t.abs())).clamp(0.0, 1.0)
}

/// Degrees of freedom of the sum of independent variances, each with its own: the formula of Welch and Satterthwaite
/// (JCGM 100:2008, G.4.1). A variance that is known has infinitely many.
///
/// ```
/// use pam_fit::numerics::student::effective_freedom;
/// assert_eq!(effective_freedom(&[(4.0, 9.0)]), 9.0);
/// // Equal variances of nine degrees of freedom and of infinitely many: four times nine.
/// assert_eq!(effective_freedom(&[(4.0, 9.0), (4.0, f64::INFINITY)]), 36.0);
/// ```
#[must_use]
pub fn effective_freedom(variances: &[(f64, f64)]) -> f64 {
    let sum: f64 = variances.iter().map(|v| v.0).sum();
    let spread: f64 = variances.iter().map(|(v, freedom)| v * v / freedom).sum();
    if spread > 0.0 { sum * sum / spread } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_freedom_gives_no_false_precision() {
        for freedom in [f64::NAN, -1.0, 0.0] {
            assert_eq!(half_width(0.05, freedom), f64::INFINITY);
            assert_eq!(chance_beyond(100.0, freedom), 1.0);
        }
        assert_eq!(half_width(f64::NAN, 3.0), f64::INFINITY);
    }

    #[test]
    fn quantile_and_probability_agree() {
        for freedom in [1.0, 2.5, 7.0, 40.0] {
            for miss in [0.3, 0.05, 1e-4] {
                let t = half_width(miss, freedom);
                assert!((chance_beyond(t, freedom) / miss - 1.0).abs() < 1e-6, "{freedom} {miss}");
            }
        }
    }

    #[test]
    fn infinitely_many_degrees_of_freedom_are_the_normal_distribution() {
        assert!((half_width(0.05, f64::INFINITY) - 1.959_964).abs() < 1e-5);
        assert!((chance_beyond(4.0, f64::INFINITY) / 6.334e-5 - 1.0).abs() < 1e-3);
    }
}
