//! The jackknife: how much estimates vary when one block of the data is left out in turn.
//!
//! ```text
//! var θ = (n − 1)/n Σ_b (θ₍₋b₎ − θ̄)²
//! ```
//! Samples of a time series are correlated; a block is a stretch long enough to be independent of the others (B. Efron and
//! C. Stein, Ann. Statist. 9 (1981) 586, doi 10.1214/aos/1176345462).

use super::covariance_root::CovarianceRoot;

/// Variances of several estimates. `without` holds one set of estimates per block that was left out; no blocks give no variances.
///
/// ```
/// use pam_fit::numerics::jackknife::variances;
///
/// // The mean of 1, 2, 3, with each value left out in turn: the variance of a mean is s²/n = 1/3.
/// let found = variances(&[vec![2.5], vec![2.0], vec![1.5]]);
/// assert!((found[0] - 1.0 / 3.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn variances<V: AsRef<[f64]>>(without: &[V]) -> Vec<f64> {
    let n = without.len() as f64;
    let estimates = without.first().map_or(0, |w| w.as_ref().len());
    (0..estimates)
        .map(|i| {
            let of = || without.iter().map(|w| w.as_ref()[i]);
            let mean = of().sum::<f64>() / n;
            (n - 1.0) / n * of().map(|w| (w - mean).powi(2)).sum::<f64>()
        })
        .collect()
}

/// The standard deviation of one estimate; 0 of less than two blocks.
///
/// ```
/// use pam_fit::numerics::jackknife::deviation;
/// assert!((deviation(&[2.5, 2.0, 1.5]).powi(2) - 1.0 / 3.0).abs() < 1e-12);
/// assert_eq!(deviation(&[]), 0.0);
/// ```
#[must_use]
pub fn deviation(without: &[f64]) -> f64 {
    let sets: Vec<[f64; 1]> = without.iter().map(|w| [*w]).collect();
    variances(&sets).first().map_or(0.0, |v| v.sqrt())
}

/// The root of the covariance of `numbers` parameters from their changes `θ₍₋b₎ − θ`, one set per block that was left out.
#[must_use]
pub fn covariance_root(changes: &[Vec<f64>], numbers: usize) -> CovarianceRoot {
    let count = changes.len() as f64;
    let scale = ((count - 1.0).max(1.0) / count.max(1.0)).sqrt();
    let mut s = vec![0.0; numbers * changes.len()];
    for (b, change) in changes.iter().enumerate() {
        for (i, v) in change.iter().enumerate() {
            s[i * changes.len() + b] = v * scale;
        }
    }
    CovarianceRoot { rows: numbers, columns: changes.len(), s }
}
