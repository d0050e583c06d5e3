//! Where the length is held.

use super::onset::Onset;
use super::series::slopes;
use crate::diagnose::linear::median;

/// Where a recording rests, and what was made on the way to it.
pub(super) struct Holds {
    /// Row by row.
    pub held: Vec<bool>,
    /// Rows each way over which speed is known to some percent of the typical one.
    pub half: usize,
    /// Slopes over so many rows, across turns and holds, m/s.
    pub raw_speed: Vec<f64>,
}

/// A motion's typical speed, m/s: the middle one of its half-strokes.
fn typical_speed(time: &[f64], stroke: &[f64], starts: &[Onset]) -> f64 {
    let mut moving: Vec<f64> = starts
        .windows(2)
        .map(|w| (w[0].row, w[1].row))
        .filter(|(a, b)| time[*b] > time[*a])
        .map(|(a, b)| (stroke[b] - stroke[a]).abs() / (time[b] - time[a]))
        .collect();
    median(&mut moving)
}

/// Finds where travel over a short window stays within what noise and drift can make. `dt`, s, is the usual time between rows, `noise`, m,
/// the stroke's, `threshold`, m, the travel that counts as a turn.
pub(super) fn holds(
    time: &[f64],
    stroke: &[f64],
    starts: &[Onset],
    dt: f64,
    noise: f64,
    threshold: f64,
) -> Holds {
    let n = time.len();
    let typical = typical_speed(time, stroke, starts);
    let wanted = if typical > 0.0 && noise > 0.0 {
        (12.0 * (noise / (0.03 * typical * dt)).powi(2)).cbrt()
    } else {
        5.0
    };
    let half = ((wanted / 2.0).ceil() as usize).clamp(2, 60).min((n / 4).max(1));
    let raw_speed = slopes(time, stroke, half, |_| (0, n));
    let slope_noise = noise * 12.0_f64.sqrt() / (dt * (2.0 * half as f64 + 1.0).powf(1.5));
    let rest = (0.05 * typical).max(5.0 * slope_noise).max(1e-9);
    let rest = if typical > 0.0 { rest.min(0.3 * typical) } else { rest };
    let quiet: Vec<bool> = raw_speed.iter().map(|v| v.abs() < rest).collect();
    let mut held = vec![starts.is_empty(); n];
    let mut i = 0;
    for run in quiet.chunk_by(|a, b| a == b) {
        let j = i + run.len();
        // A turn of a triangle is quiet for one window; a hold lasts longer and stays within the threshold.
        if run[0] && run.len() > 2 * half + 2 && stays(&stroke[i..j], threshold) {
            held[i.saturating_sub(half / 2)..(j + half / 2).min(n)].fill(true);
        }
        i = j;
    }
    Holds { held, half, raw_speed }
}

/// Whether a stretch of stroke ends where it began, and stays near.
fn stays(stroke: &[f64], threshold: f64) -> bool {
    let [low, high] = [
        stroke.iter().copied().fold(f64::INFINITY, f64::min),
        stroke.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ];
    high - low <= 3.0 * threshold && (stroke[stroke.len() - 1] - stroke[0]).abs() <= threshold
}
