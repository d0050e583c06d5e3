//! How noisy a column is, robustly, beside whatever motion it shows.

/// Standard deviation of the white noise in a column: from second differences, whose variance is 6 σ² for white noise and
/// which smooth motion hardly enters; their median is deaf to turning points and jumps. 0 for fewer than three samples.
///
/// A recording that is quantised more coarsely than it is noisy has mostly equal neighbours; there the noise of the
/// quantisation itself, step/√12, is the lower bound.
#[must_use]
pub fn white_noise(column: &[f64]) -> f64 {
    lagged_noise(column, 1)
}

/// As [`white_noise`], from differences over `lag` samples.
pub(super) fn lagged_noise(column: &[f64], lag: usize) -> f64 {
    if column.len() < 2 * lag + 1 {
        return 0.0;
    }
    // Some ten thousand differences tell a median well; runs of neighbours are taken so that a stride hits no period.
    let span = column.len() - 2 * lag;
    let runs = span.div_ceil(256);
    let every = runs.div_ceil(64).max(1);
    let mut differences: Vec<f64> = (0..runs)
        .step_by(every)
        .flat_map(|run| run * 256..((run + 1) * 256).min(span))
        .map(|i| (column[i] - 2.0 * column[i + lag] + column[i + 2 * lag]).abs())
        .collect();
    let middle = differences.len() / 2;
    let (_, median, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of |x| of a normal variable is 0.6745 σ.
    *median / 0.674_489_75 / 6f64.sqrt()
}

/// The smallest step between neighbours that differ: the quantum of a converter or of printed digits, 0 if there is none.
pub(super) fn quantum(column: &[f64]) -> f64 {
    let some = &column[..column.len().min(65_536)];
    let smallest =
        some.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}
