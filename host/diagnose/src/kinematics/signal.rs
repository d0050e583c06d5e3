//! Noise, extremes and slopes of a series of readings.

use crate::criteria::motion::{NOISE_SAMPLES, QUANTISATION, QUANTISED_REPEATS};
use crate::linear::median;

/// Standard deviation of white noise on a smooth series, from its second differences; a quantised series has at least a
/// third of its step.
pub(crate) fn white_noise(series: &[f64]) -> f64 {
    if series.len() < 3 {
        return 0.0;
    }
    let stride = (series.len() / NOISE_SAMPLES).max(1);
    let mut second: Vec<f64> =
        series.windows(3).step_by(stride).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let by_curvature = median(&mut second) / (0.6745 * 6.0_f64.sqrt());
    let step = series
        .windows(2)
        .step_by(stride)
        .map(|w| (w[1] - w[0]).abs())
        .filter(|d| *d > 0.0)
        .fold(f64::INFINITY, f64::min);
    let still = series.windows(2).step_by(stride).filter(|w| w[0] == w[1]).count() * stride;
    if still * QUANTISED_REPEATS > series.len() && step.is_finite() {
        by_curvature.max(step / QUANTISATION)
    } else {
        by_curvature
    }
}

/// Indices of the alternating extremes of a series that lie more than `threshold` apart, and the direction after each.
pub(super) fn extremes(series: &[f64], threshold: f64) -> Vec<(usize, f64)> {
    let mut found = Vec::new();
    let (mut high, mut low) = (0, 0);
    let mut direction = 0.0;
    for (i, v) in series.iter().enumerate() {
        if *v > series[high] {
            high = i;
        }
        if *v < series[low] {
            low = i;
        }
        if direction <= 0.0 && v - series[low] > threshold {
            found.push((low, 1.0));
            direction = 1.0;
            high = i;
        } else if direction >= 0.0 && series[high] - v > threshold {
            found.push((high, -1.0));
            direction = -1.0;
            low = i;
        }
        if direction > 0.0 && series[high] - v <= 0.0 {
            low = i;
        }
        if direction < 0.0 && v - series[low] <= 0.0 {
            high = i;
        }
    }
    found
}

/// Slopes by straight lines over up to `half` rows each way, not beyond the bounds that `limits` gives for a row.
pub(super) fn slopes(
    time: &[f64],
    series: &[f64],
    half: usize,
    limits: impl Fn(usize) -> (usize, usize),
) -> Vec<f64> {
    let n = series.len();
    if n == 0 {
        return Vec::new();
    }
    // Prefix sums about the middle keep the digits.
    let (t0, s0) = (time[n / 2], series[n / 2]);
    let mut sums = vec![[0.0_f64; 4]; n + 1];
    for i in 0..n {
        let (t, s) = (time[i] - t0, series[i] - s0);
        let p = sums[i];
        sums[i + 1] = [p[0] + t, p[1] + s, p[2] + t * t, p[3] + t * s];
    }
    (0..n)
        .map(|i| {
            let (from, to) = limits(i);
            let a = i.saturating_sub(half).max(from);
            let b = (i + half + 1).min(to).min(n);
            let m = (b.saturating_sub(a)) as f64;
            if m < 2.0 {
                return 0.0;
            }
            let [t, s, tt, ts] = std::array::from_fn(|k| sums[b][k] - sums[a][k]);
            let spread = tt - t * t / m;
            if spread > 0.0 { (ts - t * s / m) / spread } else { 0.0 }
        })
        .collect()
}
