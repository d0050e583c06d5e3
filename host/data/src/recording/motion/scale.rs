//! What in a column is noise and what is change: thresholds, and how much smoothing the motion allows.

use super::super::noise::{lagged_noise, quantum, white_noise};
use super::criteria::{
    HOLD_TOLERANCE, MOTION_NOISE, MOTION_PRESSURE_FLOOR, MOTION_PRESSURE_MOST, MOTION_PRESSURE_SHARE,
    NOISE_LAG, NOISE_LAG_PART, NOISE_RISE, ONSET_CLEAR, PRESSURE_NOISE_MOST, QUANTUM_SHARE, RIPPLE_LARGEST,
    RIPPLE_RAISE, RIPPLE_RAISES, RIPPLE_SMALL, RIPPLE_STROKES, SMOOTHING_MOST, SMOOTHING_PART,
};
use super::legs::{Leg, legs};
use crate::statistics::{median, range};

/// The scale of a column's noise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    /// Standard deviation of single samples.
    pub noise: f64,
    /// Standard deviation after smoothing.
    pub smoothed_noise: f64,
    /// Change that noise cannot make.
    pub threshold: f64,
}

impl Scale {
    /// How far smoothed samples at rest stray from their level.
    pub(super) fn rest_tolerance(&self) -> f64 {
        (ONSET_CLEAR * self.smoothed_noise).max(HOLD_TOLERANCE * self.threshold)
    }
}

/// Standard deviation of noise of any short correlation: second differences at growing lags stay level for white noise, rise
/// slowly for coloured noise, and rise fourfold per doubling where the motion's own curvature shows. They are followed as
/// long as they rise like noise.
fn coloured_noise(column: &[f64]) -> f64 {
    let mut noise = white_noise(column);
    let mut last = noise;
    let mut lag = 2;
    while lag <= (column.len() / NOISE_LAG_PART).min(NOISE_LAG) {
        let here = lagged_noise(column, lag);
        if here > NOISE_RISE * last {
            break;
        }
        noise = noise.max(here);
        last = here;
        lag *= 2;
    }
    // A converter's steps are noise too, even where neighbours are mostly equal.
    noise.max(quantum(column).min(QUANTUM_SHARE * range(column)) / 12f64.sqrt())
}

/// How many standard deviations `n` samples of noise spread over, with a margin: twice the expected largest of n, plus one.
fn spread(n: usize) -> f64 {
    MOTION_NOISE * (2.0 * (n.max(2) as f64).ln()).sqrt() + 1.0
}

/// The scale of a stroke, and the stroke smoothed as far as its reversals allow. Less than `least`, m, is not motion.
pub(super) fn of_stroke(stroke: &[f64], least: f64) -> (Scale, Vec<f64>) {
    let noise = coloured_noise(stroke);
    let raw = raise(stroke, (spread(stroke.len()) * noise).max(least));
    let window = window(stroke, &legs(stroke, raw), noise);
    if window < 3 {
        return (Scale { noise, smoothed_noise: noise, threshold: raw }, stroke.to_vec());
    }
    let smooth = moving_mean(stroke, window);
    let correlated = lagged_noise(&smooth, window.min(smooth.len() / 3)).max(noise / (window as f64).sqrt());
    let threshold = (spread(stroke.len() / window) * correlated).max(least);
    let threshold = raise(&smooth, threshold.min(raw));
    (Scale { noise, smoothed_noise: correlated, threshold }, smooth)
}

/// The scale of a pressure. Regulators ripple by parts of a per cent of their range, and no isometric test turns back by less
/// than two per cent of its pressure on purpose.
pub(super) fn of_pressure(pressure: &[f64]) -> Scale {
    let top = pressure.iter().fold(0.0, |m: f64, p| m.max(p.abs())).max(MOTION_PRESSURE_FLOOR);
    // Settled readings of a staircase differ by whole steps; that is not noise, and no pressure sensor is that bad.
    let noise = coloured_noise(pressure).min(PRESSURE_NOISE_MOST * top);
    let threshold =
        (spread(pressure.len()) * noise).clamp(MOTION_PRESSURE_SHARE * top, MOTION_PRESSURE_MOST * top);
    Scale { noise, smoothed_noise: noise, threshold: raise(pressure, threshold) }
}

/// Raises a threshold while most legs are hardly larger than it and the largest much larger: that is how ripple and hum look
/// that the noise estimate missed. Motion has legs of its own size.
fn raise(column: &[f64], mut threshold: f64) -> f64 {
    for _ in 0..RIPPLE_RAISES {
        let legs = legs(column, threshold);
        let largest = legs.iter().map(|l| l.amplitude()).fold(0.0, f64::max);
        let small = legs.iter().filter(|l| l.amplitude() < RIPPLE_SMALL * threshold).count();
        if legs.len() < RIPPLE_STROKES || 2 * small < legs.len() || largest < RIPPLE_LARGEST * threshold {
            break;
        }
        threshold *= RIPPLE_RAISE;
    }
    threshold
}

/// Samples to average over: noise falls with the root of the window, a corner is rounded in proportion to it; equal at
/// (4 σ / u)^(2/3), where u is the travel per sample.
fn window(column: &[f64], legs: &[Leg], noise: f64) -> usize {
    let mut speeds: Vec<f64> = legs.iter().map(|l| l.amplitude() / (l.end - l.start).max(1) as f64).collect();
    if speeds.is_empty() {
        return 1;
    }
    let typical = median(&mut speeds);
    let shortest = legs.iter().map(|l| l.end - l.start).min().unwrap_or(1);
    let wanted = (4.0 * noise / typical.max(f64::MIN_POSITIVE)).powf(2.0 / 3.0);
    let most = (shortest / SMOOTHING_PART).min(column.len() / SMOOTHING_PART).min(SMOOTHING_MOST);
    let window = if wanted < most as f64 { wanted as usize } else { most };
    window.max(1) | 1
}

/// Centred moving mean over an odd number of samples, fewer at the ends.
pub(super) fn moving_mean(column: &[f64], window: usize) -> Vec<f64> {
    let half = window / 2;
    let n = column.len();
    let mut sums = Vec::with_capacity(n);
    let mut sum = 0.0;
    // Sums restart now and then, so that rounding does not accumulate over millions of samples.
    for i in 0..n {
        let (from, to) = (i.saturating_sub(half), (i + half).min(n - 1));
        if i % 4096 == 0 {
            sum = column[from..=to].iter().sum();
        } else {
            if i + half < n {
                sum += column[i + half];
            }
            if i > half {
                sum -= column[i - half - 1];
            }
        }
        sums.push(sum / (to - from + 1) as f64);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_mean_is_the_mean_of_its_window() {
        let column: Vec<f64> = (0..10_000).map(|i| f64::from(i * i % 97)).collect();
        let smooth = moving_mean(&column, 7);
        for i in [0, 2, 3, 50, 4095, 4096, 4097, 9_997, 9_999] {
            let window = &column[i - i.min(3)..(i + 4).min(10_000)];
            let mean = window.iter().sum::<f64>() / window.len() as f64;
            assert!((smooth[i] - mean).abs() < 1e-9, "{i}");
        }
    }
}
