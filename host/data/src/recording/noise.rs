//! How noisy a column is, robustly, beside whatever motion it shows.

use super::motion::criteria::{
    FOURTH_DIFFERENCES, NOISE_SAMPLES, QUANTISED_CHANGES, QUANTISED_LEVELS, QUANTISED_REPEATS,
    QUANTUM_SAMPLES,
};
use crate::statistics::{deviation_from_median, median, range};

/// Standard deviation of the white noise in a column: from second differences, whose variance is 6 σ² for white noise and
/// which smooth motion hardly enters; their median is insensitive to reversals and jumps. Where the motion is sampled so
/// coarsely that it bends between samples, fourth differences (70 σ²) see less of it, so the smaller of both counts. A column of which
/// many neighbours are equal is quantised; its noise is at least that of its step q, q/√12. 0 for fewer than three samples.
#[must_use]
pub fn white_noise(column: &[f64]) -> f64 {
    // A held length that was typed in.
    if column.iter().all(|value| *value == column[0]) {
        return 0.0;
    }
    let second = lagged_noise(column, 1);
    if column.len() < FOURTH_DIFFERENCES {
        return second.max(quantisation_noise(column));
    }
    let x = column;
    let fourth = |i: usize| x[i] - 4.0 * (x[i + 1] + x[i + 3]) + 6.0 * x[i + 2] + x[i + 4];
    second.min(spread_of(column.len() - 4, fourth) / 70f64.sqrt()).max(quantisation_noise(column))
}

/// The noise of a converter whose steps are so wide that many neighbours read the same; 0 for other columns, and for those that hold
/// a few values that were set.
fn quantisation_noise(column: &[f64]) -> f64 {
    resolution(column) / 12f64.sqrt()
}

/// The step of a converter so coarse that many neighbours read the same, in the unit of the column; 0 for other columns.
#[must_use]
pub fn resolution(column: &[f64]) -> f64 {
    let some = &column[..column.len().min(QUANTUM_SAMPLES)];
    let equal = some.windows(2).filter(|w| w[0] == w[1]).count();
    if equal * QUANTISED_REPEATS <= some.len() {
        return 0.0;
    }
    let step = quantum(some);
    let changes_often = (some.len() - equal) * QUANTISED_CHANGES > some.len();
    if changes_often || range(some) >= QUANTISED_LEVELS * step { step } else { 0.0 }
}

/// As [`white_noise`], from second differences over `lag` samples.
pub(super) fn lagged_noise(column: &[f64], lag: usize) -> f64 {
    if column.len() < 2 * lag + 1 {
        return 0.0;
    }
    let second = |i: usize| column[i] - 2.0 * column[i + lag] + column[i + 2 * lag];
    spread_of(column.len() - 2 * lag, second) / 6f64.sqrt()
}

/// Standard deviation of `n` normal values, by the median of their sizes.
fn spread_of(n: usize, value: impl Fn(usize) -> f64) -> f64 {
    // Runs of neighbours are taken so that a stride hits no period.
    let runs = n.div_ceil(256);
    let every = runs.div_ceil(NOISE_SAMPLES / 256).max(1);
    let mut sizes: Vec<f64> = (0..runs)
        .step_by(every)
        .flat_map(|run| run * 256..((run + 1) * 256).min(n))
        .map(|i| value(i).abs())
        .collect();
    deviation_from_median(median(&mut sizes))
}

/// The smallest step between neighbours that differ: the quantum of a converter or of printed digits, 0 if there is none.
pub(super) fn quantum(column: &[f64]) -> f64 {
    let some = &column[..column.len().min(QUANTUM_SAMPLES)];
    let smallest =
        some.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantised_column_has_the_noise_of_its_step() {
        // A slow ramp read in steps of 1: most neighbours are equal, so second differences alone give nothing.
        let column: Vec<f64> = (0..4000).map(|i| (0.01 * f64::from(i)).round()).collect();
        assert!((white_noise(&column) - 1.0 / 12f64.sqrt()).abs() < 1e-12);
        let fine: Vec<f64> = (0..4000).map(|i| 0.01 * f64::from(i)).collect();
        assert!(white_noise(&fine) < 1e-9);
        // One step back and forth at rest.
        let flicker: Vec<f64> = (0..4000).map(|i| f64::from(i * i % 7 / 4)).collect();
        assert!(white_noise(&flicker) >= 1.0 / 12f64.sqrt(), "{}", white_noise(&flicker));
    }

    #[test]
    fn set_lengths_have_no_noise() {
        let lengths: Vec<f64> = (0..36_000).map(|i| 7.5e-3 * f64::from(i / 3000 % 4)).collect();
        assert_eq!(white_noise(&lengths), 0.0);
    }
}
