//! Where the length is held.

use super::onset::Onset;
use super::signal::slopes;
use crate::criteria::motion::{
    DWELL_RATIO, HOLD_DRIFT, PACE_PARTS, PACE_ROWS, REST_SPEED, REST_SPEED_MOST, REST_SPEED_NOISE,
    SLOPE_HALF_ROWS, SLOPE_ROWS, SPEED_PRECISION,
};
use crate::linear::median;

/// Where a recording rests, and what was made on the way to it.
pub(super) struct Holds {
    /// Row by row.
    pub held: Vec<bool>,
    /// Rows each way over which speed is known to some percent of the typical one.
    pub half: usize,
    /// Slopes over so many rows, across turns and holds, m/s.
    pub raw_speed: Vec<f64>,
}

/// A motion's typical speed, m/s: that of the half-stroke in the middle by way gone, holds on its way left out. A frame that gives while the
/// force changes makes many half-strokes, none of which goes far.
fn typical_speed(time: &[f64], stroke: &[f64], starts: &[Onset]) -> f64 {
    let mut paces: Vec<(f64, f64)> = starts
        .windows(2)
        .map(|w| w[0].row..w[1].row + 1)
        .filter(|rows| time[rows.end - 1] > time[rows.start])
        .map(|rows| pace(&time[rows.clone()], &stroke[rows]))
        .collect();
    paces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * paces.iter().map(|(_, way)| way).sum::<f64>();
    let mut gone = 0.0;
    let middle = paces.iter().find(|(_, way)| {
        gone += way;
        gone >= half
    });
    middle.map_or(0.0, |(speed, _)| *speed)
}

/// The speed of one half-stroke, m/s, without the holds on its way, which is m long.
fn pace(time: &[f64], stroke: &[f64]) -> (f64, f64) {
    let last = time.len() - 1;
    let way = stroke[last] - stroke[0];
    let parts = (time.len() / PACE_ROWS).clamp(1, PACE_PARTS);
    let reached = |part: usize| {
        let level = way.abs() * part as f64 / parts as f64;
        let passed = |x: &f64| (x - stroke[0]) * way.signum() >= level;
        if part == parts { last } else { stroke.iter().position(passed).unwrap_or(last) }
    };
    let at: Vec<f64> = (0..=parts).map(|part| time[reached(part)]).collect();
    let taken: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = median(&mut taken.clone());
    let moving: f64 =
        taken.iter().map(|t| if *t > DWELL_RATIO * middle && middle > 0.0 { middle } else { *t }).sum();
    (way.abs() / moving, way.abs())
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
        (12.0 * (noise / (SPEED_PRECISION * typical * dt)).powi(2)).cbrt()
    } else {
        SLOPE_ROWS
    };
    let half =
        ((wanted / 2.0).ceil() as usize).clamp(SLOPE_HALF_ROWS.0, SLOPE_HALF_ROWS.1).min((n / 4).max(1));
    let raw_speed = slopes(time, stroke, half, |_| (0, n));
    let slope_noise = noise * 12.0_f64.sqrt() / (dt * (2.0 * half as f64 + 1.0).powf(1.5));
    let rest = (REST_SPEED * typical).max(REST_SPEED_NOISE * slope_noise).max(1e-9);
    let rest = if typical > 0.0 { rest.min(REST_SPEED_MOST * typical) } else { rest };
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
    high - low <= HOLD_DRIFT * threshold && (stroke[stroke.len() - 1] - stroke[0]).abs() <= threshold
}
