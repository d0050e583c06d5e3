//! Robust z scores, and the threshold beyond which a muscle counts as outlying.
//!
//! ```text
//! z = (x − median) / s,   s = 1.4826 · median |x − median|
//! ```
//! `s` estimates the standard deviation of normal values and is hardly moved by outlying ones (F. R. Hampel, J. Am. Stat. Assoc. 69, 1974,
//! 383). The threshold for the largest `|z|` of a fleet is found by simulation of normal fleets of the same size: median and `s` are
//! uncertain themselves in small fleets. For one quantity of 10 muscles it is 4.0, where the normal distribution would give 2.8.

use pam_data::statistics::{deviation_from_median, median};

/// Probability that a fleet of normally distributed values contains any muscle that counts as outlying, over all quantities.
pub const FALSE_ALARMS: f64 = 0.05;
/// Fleets below this size have no outlying muscles: half of so few values could be anywhere.
pub(crate) const SMALLEST: usize = 8;
/// Simulated fleets: enough for the quantile at `FALSE_ALARMS` divided by the number of quantities.
const SIMULATED: usize = 4000;
/// Simulated values, at most; the quantile is that of fewer fleets then.
const MOST_VALUES: usize = 8_000_000;

/// Centre and scale of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centre {
    /// The median.
    pub median: f64,
    /// The robust standard deviation.
    pub deviation: f64,
}

impl Centre {
    /// Of finite values; `None` where there are too few, or more than half are the same.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.len() < SMALLEST {
            return None;
        }
        let middle = median(&mut values.to_vec());
        let mut sizes: Vec<f64> = values.iter().map(|v| (v - middle).abs()).collect();
        let deviation = deviation_from_median(median(&mut sizes));
        (deviation > 0.0).then_some(Self { median: middle, deviation })
    }

    /// How many robust standard deviations a value is off.
    #[must_use]
    pub fn z(&self, value: f64) -> f64 {
        (value - self.median) / self.deviation
    }
}

/// Normal numbers from a seed, by the polar method on a 64-bit mixing generator (S. Vigna's `splitmix64`).
struct Normal {
    state: u64,
    spare: Option<f64>,
}

impl Normal {
    fn unit(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (u, v) = (2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0);
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                let scale = (-2.0 * s.ln() / s).sqrt();
                self.spare = Some(v * scale);
                return u * scale;
            }
        }
    }
}

/// The size of z beyond which a muscle counts as outlying in one of `quantities`, in a fleet of `muscles`.
#[must_use]
pub(crate) fn threshold(muscles: usize, quantities: usize) -> f64 {
    let muscles = muscles.max(SMALLEST);
    let fleets = (MOST_VALUES / muscles).clamp(400, SIMULATED);
    let mut normal = Normal { state: 0x70616d, spare: None };
    let mut largest: Vec<f64> = (0..fleets)
        .map(|_| {
            let values: Vec<f64> = (0..muscles).map(|_| normal.next()).collect();
            let centre = Centre::of(&values).unwrap_or(Centre { median: 0.0, deviation: 1.0 });
            values.iter().map(|v| centre.z(*v).abs()).fold(0.0, f64::max)
        })
        .collect();
    largest.sort_by(f64::total_cmp);
    let share = FALSE_ALARMS / quantities.max(1) as f64;
    let rank = ((1.0 - share) * fleets as f64).ceil() as usize;
    largest[rank.min(fleets - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fleets that the threshold was not made from.
    #[test]
    fn the_rate_of_false_alarms_is_the_stated_one() {
        for muscles in [10, 40, 200] {
            let limit = threshold(muscles, 5);
            let mut normal = Normal { state: 99, spare: None };
            let fleets = 600;
            let mut alarms = 0;
            for _ in 0..fleets {
                let mut any = false;
                for _ in 0..5 {
                    let values: Vec<f64> = (0..muscles).map(|_| 3.0 + 0.2 * normal.next()).collect();
                    let centre = Centre::of(&values).expect("enough values");
                    any |= values.iter().any(|v| centre.z(*v).abs() > limit);
                }
                alarms += u32::from(any);
            }
            let rate = f64::from(alarms) / fleets as f64;
            // 5 % ± 0.9 % of 600 fleets, and the threshold's own uncertainty.
            assert!((0.015..0.09).contains(&rate), "{muscles} muscles: {rate}, threshold {limit}");
        }
    }

    #[test]
    fn the_limit_is_above_that_of_the_normal_distribution_in_small_fleets() {
        // Normal distribution with known scale, two-sided, 5 % over 10 and over 300 muscles: 2.81 and 3.77.
        let (few, many) = (threshold(10, 1), threshold(300, 1));
        assert!((3.5..4.6).contains(&few) && (3.6..4.2).contains(&many), "{few} {many}");
        assert!(threshold(300, 8) > many);
    }

    #[test]
    fn values_that_are_mostly_equal_have_no_scale() {
        assert_eq!(Centre::of(&[1.0; 20]), None);
        assert_eq!(Centre::of(&[1.0, 2.0, 3.0]), None);
    }
}
