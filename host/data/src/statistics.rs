//! Order statistics: extremes, the median and other quantiles, by partial sorting in linear time; and the normal distribution's constants.
//!
//! Values that are not numbers sort to the ends ([`f64::total_cmp`]), so a few of them do not move a median.

use std::borrow::Borrow;

/// The value of a given rank, 0 for the smallest; the largest where the rank lies beyond the end, and 0 of no values.
/// Reorders the values.
///
/// ```
/// use pam_data::statistics::ranked;
/// assert_eq!(ranked(&mut [3.0, 1.0, 2.0], 1), 2.0);
/// assert_eq!(ranked(&mut [3.0, 1.0, 2.0], 9), 3.0);
/// assert_eq!(ranked(&mut [], 0), 0.0);
/// ```
#[must_use]
pub fn ranked(values: &mut [f64], rank: usize) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = rank.min(values.len() - 1);
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Least-squares slope of a line through points; 0 where they do not differ in their first value.
///
/// ```
/// use pam_data::statistics::slope;
/// assert_eq!(slope(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]), 2.0);
/// assert_eq!(slope(&[(1.0, 3.0), (1.0, 5.0)]), 0.0);
/// ```
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    if xx > 0.0 { xy / xx } else { 0.0 }
}

/// The smallest and the largest value; `(inf, -inf)` of no values.
///
/// ```
/// use pam_data::statistics::extremes;
/// assert_eq!(extremes([3.0, 1.0, 2.0]), (1.0, 3.0));
/// assert_eq!(extremes(&[] as &[f64]), (f64::INFINITY, f64::NEG_INFINITY));
/// ```
#[must_use]
pub fn extremes(values: impl IntoIterator<Item: Borrow<f64>>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        let value = *value.borrow();
        (low.min(value), high.max(value))
    })
}

/// The largest value minus the smallest; 0 of no values.
///
/// ```
/// use pam_data::statistics::range;
/// assert_eq!(range([3.0, 1.0, 2.0]), 2.0);
/// assert_eq!(range(&[] as &[f64]), 0.0);
/// ```
#[must_use]
pub fn range(values: impl IntoIterator<Item: Borrow<f64>>) -> f64 {
    let (low, high) = extremes(values);
    (high - low).max(0.0)
}

/// The median; of an even number of values the upper of the two in the middle, and 0 of no values. Reorders the values.
///
/// ```
/// use pam_data::statistics::median;
/// assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
/// assert_eq!(median(&mut [4.0, 3.0, 1.0, 2.0]), 3.0);
/// ```
#[must_use]
pub fn median(values: &mut [f64]) -> f64 {
    ranked(values, values.len() / 2)
}

/// The median of integers, such as times in nanoseconds: of an even number of values the upper of the two in the middle, and 0 of no
/// values. Reorders the values.
///
/// ```
/// use pam_data::statistics::integer_median;
/// assert_eq!(integer_median(&mut [4, 3, 1, 2]), 3);
/// assert_eq!(integer_median(&mut []), 0);
/// ```
#[must_use]
pub fn integer_median(values: &mut [u64]) -> u64 {
    if values.is_empty() {
        return 0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable(middle).1
}

/// The median; of an even number of values the mean of the two in the middle, which does not lean to larger values where there are few.
/// 0 of no values. Reorders the values.
///
/// ```
/// use pam_data::statistics::midpoint_median;
/// assert_eq!(midpoint_median(&mut [3.0, 1.0, 2.0]), 2.0);
/// assert_eq!(midpoint_median(&mut [4.0, 3.0, 1.0, 2.0]), 2.5);
/// assert_eq!(midpoint_median(&mut []), 0.0);
/// ```
#[must_use]
pub fn midpoint_median(values: &mut [f64]) -> f64 {
    let n = values.len();
    0.5 * (ranked(values, n.saturating_sub(1) / 2) + ranked(values, n / 2))
}

/// The value that is nearest in rank to a quantile, `share` from 0 (smallest) to 1 (largest); 0 of no values. Reorders the
/// values.
///
/// ```
/// use pam_data::statistics::quantile;
/// let mut values: Vec<f64> = (0..=100).map(f64::from).collect();
/// assert_eq!(quantile(&mut values, 0.95), 95.0);
/// ```
#[must_use]
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    ranked(values, (values.len().saturating_sub(1) as f64 * share).round() as usize)
}

/// The 97.5 % quantile of the normal distribution, Φ⁻¹(0.975) = 1.959 964, rounded as usual: half the width of an interval of 95 % in
/// standard deviations.
pub const NORMAL_95: f64 = 1.96;

/// Standard deviation of a normal distribution whose absolute values have this median.
///
/// The median of `|x|` is `Φ⁻¹(3/4) σ = 0.674 489 75 σ` (the median absolute deviation; P. J. Rousseeuw and C. Croux,
/// J. Am. Stat. Assoc. 88 (1993) 1273, doi 10.1080/01621459.1993.10476408).
///
/// ```
/// assert!((pam_data::statistics::deviation_from_median(0.674_489_75) - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn deviation_from_median(median_of_sizes: f64) -> f64 {
    median_of_sizes / 0.674_489_75
}
