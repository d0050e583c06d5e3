//! How noisy a column is, robustly, beside whatever motion it shows.

use crate::statistics::{deviation_from_median, median};

/// Standard deviation of the white noise in a column: from second differences, whose variance is 6 σ² for white noise and
/// which smooth motion hardly enters; their median is insensitive to reversals and jumps. Where the motion is sampled so
/// coarsely that it bends between samples, fourth differences (70 σ²) see less of it, so the smaller of both counts. 0 for
/// fewer than three samples.
#[must_use]
pub fn white_noise(column: &[f64]) -> f64 {
    let second = lagged_noise(column, 1);
    if column.len() < 16 {
        return second;
    }
    let x = column;
    let fourth = |i: usize| x[i] - 4.0 * (x[i + 1] + x[i + 3]) + 6.0 * x[i + 2] + x[i + 4];
    second.min(spread_of(column.len() - 4, fourth) / 70f64.sqrt())
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
    // Some ten thousand values tell a median well; runs of neighbours are taken so that a stride hits no period.
    let runs = n.div_ceil(256);
    let every = runs.div_ceil(64).max(1);
    let mut sizes: Vec<f64> = (0..runs)
        .step_by(every)
        .flat_map(|run| run * 256..((run + 1) * 256).min(n))
        .map(|i| value(i).abs())
        .collect();
    deviation_from_median(median(&mut sizes))
}

/// The smallest step between neighbours that differ: the quantum of a converter or of printed digits, 0 if there is none.
pub(super) fn quantum(column: &[f64]) -> f64 {
    let some = &column[..column.len().min(65_536)];
    let smallest =
        some.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}
