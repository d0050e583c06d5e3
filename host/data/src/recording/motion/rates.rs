//! Speed, acceleration and pressure rate by local polynomials.

use rayon::prelude::*;

use super::criteria::{
    ACCELERATION_PRECISION, PRESSURE_RANGE_NOISE, PRESSURE_TIME, RATE_HALF_SAMPLES, RATE_SAMPLES,
    SPEED_PRECISION,
};
use super::scale::moving_mean;
use super::{Motion, Recording};
use crate::statistics::range;

/// Smoothed rates of a recording, one value per sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rates {
    /// v = d(ΔL)/dt, m/s, positive when shortening.
    pub speed: Vec<f64>,
    /// dv/dt, m/s².
    pub acceleration: Vec<f64>,
    /// dP/dt, Pa/s.
    pub pressure_rate: Vec<f64>,
}

impl Rates {
    /// Rates from parabolas through a window about each sample, by least squares. The window is as wide as noise requires and
    /// never reaches across a reversal or into or out of a hold, where speed jumps. A held length has no speed: what its slope
    /// shows is noise, or a frame that yields.
    #[must_use]
    pub fn of(recording: &Recording, motion: &Motion) -> Self {
        let n = recording.len();
        let mut edges: Vec<usize> = motion.reversals.iter().map(|t| t.index).collect();
        edges.extend(motion.holds.iter().flat_map(|h| [h.start, h.end + 1]));
        edges.retain(|e| *e > 0 && *e < n);
        edges.sort_unstable();
        edges.dedup();
        let duration = recording.duration().max(f64::MIN_POSITIVE);
        let travelled: f64 = motion
            .reversals
            .windows(2)
            .map(|w| (recording.stroke[w[1].index] - recording.stroke[w[0].index]).abs())
            .sum::<f64>()
            + range(&recording.stroke);
        let typical = travelled / duration;
        let (mut speed, _) =
            derivatives(&recording.time, &recording.stroke, motion.stroke_noise, typical, &edges);
        // A second derivative is noisier by far: its window is that of a speed known better.
        let (_, mut acceleration) = derivatives(
            &recording.time,
            &recording.stroke,
            motion.stroke_noise,
            typical / ACCELERATION_PRECISION,
            &edges,
        );
        for hold in &motion.holds {
            for column in [&mut speed, &mut acceleration] {
                if let Some(part) = column.get_mut(hold.start..=hold.end) {
                    part.fill(0.0);
                }
            }
        }
        // Pressure has no reversals of its own here; its window follows from its whole range over some seconds.
        let typical = range(&recording.pressure).max(PRESSURE_RANGE_NOISE * motion.pressure_noise)
            / duration.min(PRESSURE_TIME);
        let (pressure_rate, _) =
            derivatives(&recording.time, &recording.pressure, motion.pressure_noise, typical, &[]);
        Self { speed, acceleration, pressure_rate }
    }
}

/// First and second derivative of a column.
fn derivatives(
    time: &[f64],
    column: &[f64],
    noise: f64,
    typical: f64,
    edges: &[usize],
) -> (Vec<f64>, Vec<f64>) {
    let n = time.len().min(column.len());
    let Some((first, last)) = time.first().zip(time.last()).filter(|_| n > 1) else {
        return (vec![0.0; n], vec![0.0; n]);
    };
    let dt = (last - first) / (n - 1) as f64;
    // A line's slope over m samples has the standard deviation σ √12 / (dt m^1.5); a parabola at the end of its window needs
    // about twice the width for the same.
    let wanted =
        (12f64.sqrt() * noise / (dt * SPEED_PRECISION * typical).max(f64::MIN_POSITIVE)).powf(2.0 / 3.0);
    let (least, most) = RATE_HALF_SAMPLES;
    let half = if wanted < most as f64 { (wanted as usize).max(least) } else { most };
    let stride = half.div_ceil(RATE_SAMPLES);
    let half_window = half / stride;
    let averaged;
    let column = if stride > 1 {
        averaged = moving_mean(column, stride | 1);
        &averaged[..]
    } else {
        column
    };
    let mut slopes = vec![0.0; n];
    let mut curvatures = vec![0.0; n];
    const PART: usize = 1 << 14;
    slopes.par_chunks_mut(PART).zip(curvatures.par_chunks_mut(PART)).enumerate().for_each(
        |(part, (slopes, curves))| {
            let begin = part * PART;
            let mut edge = edges.partition_point(|e| *e <= begin);
            for (k, (slope, curve)) in slopes.iter_mut().zip(curves).enumerate() {
                let i = begin + k;
                while edges.get(edge).is_some_and(|e| *e <= i) {
                    edge += 1;
                }
                let low = edge.checked_sub(1).map_or(0, |e| edges[e]);
                let high = edges.get(edge).map_or(n, |e| *e) - 1;
                (*slope, *curve) = parabola(time, column, i, low, high, stride, half_window);
            }
        },
    );
    (slopes, curvatures)
}

/// Slope and curvature at sample `i` of the parabola through its neighbours within `low..=high`.
fn parabola(
    time: &[f64],
    column: &[f64],
    i: usize,
    low: usize,
    high: usize,
    stride: usize,
    half_window: usize,
) -> (f64, f64) {
    let before = ((i - low) / stride).min(half_window);
    let after = ((high - i) / stride).min(half_window);
    // Near an edge the window extends to the other side, so that it keeps its width.
    let before = before.max((2 * half_window - after).min((i - low) / stride));
    let after = after.max((2 * half_window - before).min((high - i) / stride));
    let from = i - before * stride;
    let (mut s1, mut s2, mut s3, mut s4) = (0.0, 0.0, 0.0, 0.0);
    let (mut y0, mut y1, mut y2) = (0.0, 0.0, 0.0);
    let count = before + after + 1;
    for j in 0..count {
        let at = from + j * stride;
        let (t, y) = (time[at] - time[i], column[at] - column[i]);
        let tt = t * t;
        s1 += t;
        s2 += tt;
        s3 += tt * t;
        s4 += tt * tt;
        y0 += y;
        y1 += y * t;
        y2 += y * tt;
    }
    let m = count as f64;
    if count >= 4 {
        // Normal equations of y = a + b t + c t², solved by Cramer's rule; t is scaled by the window itself.
        let det = m * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s3 * s2) + s2 * (s1 * s3 - s2 * s2);
        let b = m * (y1 * s4 - s3 * y2) - y0 * (s1 * s4 - s3 * s2) + s2 * (s1 * y2 - y1 * s2);
        let c = m * (s2 * y2 - y1 * s3) - s1 * (s1 * y2 - y1 * s2) + y0 * (s1 * s3 - s2 * s2);
        if det > 1e-12 * m * s2 * s4 {
            return (b / det, 2.0 * c / det);
        }
    }
    let spread = m * s2 - s1 * s1;
    if spread > 0.0 { ((m * y1 - s1 * y0) / spread, 0.0) } else { (0.0, 0.0) }
}
