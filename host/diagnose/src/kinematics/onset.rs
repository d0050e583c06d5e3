//! When a stroke really began.
//!
//! A turn is found once the muscle has gone a threshold back; the motion began before that. After a dwell it begins as a straight line, and
//! the line's meeting with the extreme is the beginning. Where a sine turns, or a drive takes time to reach its speed, the path leaves the extreme as
//! a parabola, and the straight line would put the beginning a third of the way too late: friction would act the wrong way until then.

use crate::criteria::motion::{
    ONSET_CLEAR, ONSET_DOUBT_NOISE, ONSET_DOUBT_ROWS, ONSET_DOUBT_SAMPLING, ONSET_SLOPE_FROM,
};

/// A stroke on its way from a turn: from row `extreme` to before row `end`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    pub extreme: usize,
    pub end: usize,
    pub direction: f64,
}

/// How a recording's motion is read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Time between rows, s.
    pub dt: f64,
    /// Standard deviation of the stroke's readings, m.
    pub noise: f64,
    /// Travel that counts as a turn, m.
    pub threshold: f64,
}

/// The beginning of a stroke.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onset {
    /// The first row of it.
    pub row: usize,
    /// Which way it goes.
    pub direction: f64,
    /// How far from that row the beginning may have been, s.
    pub doubt: f64,
}

/// When a stroke began, from the rows until it passed the threshold.
pub(super) fn onset(time: &[f64], stroke: &[f64], leg: Leg, motion: Motion) -> Onset {
    let Leg { extreme, end, direction } = leg;
    let Motion { dt, noise, threshold } = motion;
    let gone = |j: usize| (stroke[j] - stroke[extreme]) * direction;
    let passed = (extreme..end).find(|j| gone(*j) > threshold).unwrap_or(end - 1);
    let third = (extreme..passed).rev().find(|j| gone(*j) <= threshold / ONSET_SLOPE_FROM).unwrap_or(extreme);
    let rate = (gone(passed) - gone(third)) / (time[passed] - time[third]).max(1e-12);
    let straight = if rate > 0.0 { time[passed] - gone(passed) / rate } else { time[extreme] };
    let mut began = straight;
    let mut doubt =
        if rate > 0.0 { (ONSET_DOUBT_NOISE * noise / rate).min(ONSET_DOUBT_ROWS * dt) } else { 0.0 };
    // The last row at rest, as far as its noise lets one see: the farthest of m readings stands √(2 ln m) deviations off their level.
    let farthest = (2.0 * ((passed - extreme).max(1) as f64).ln()).sqrt();
    let clear = ONSET_CLEAR.max(1.0 + farthest) * noise;
    let at_rest = (extreme..passed).rev().find(|j| gone(*j) <= clear).unwrap_or(extreme);
    if rate > 0.0 && time[at_rest] + dt < straight && gone(third) > 0.0 {
        let (near, far) = (gone(third).sqrt(), gone(passed).sqrt());
        let curved = time[passed] - (time[passed] - time[third]) * far / (far - near);
        began = curved.min(time[at_rest]);
        doubt = (noise / gone(passed)).sqrt() * (time[passed] - began);
    }
    let began = began.clamp(time[extreme], time[passed]);
    let row = (extreme..=passed).find(|j| time[*j] >= began).unwrap_or(passed);
    Onset { row, direction, doubt: ONSET_DOUBT_SAMPLING * dt + doubt }
}

/// Strokes that go on after a hold the way they went before it. The pressure may have turned the friction meanwhile.
pub(super) fn resumed(
    time: &[f64],
    stroke: &[f64],
    held: &[bool],
    starts: &[Onset],
    motion: Motion,
) -> Vec<Onset> {
    let mut found = Vec::new();
    for row in 1..held.len() {
        let next = starts.partition_point(|o| o.row <= row);
        if !held[row - 1] || held[row] || next == 0 {
            continue;
        }
        let direction = starts[next - 1].direction;
        let until = starts.get(next).map_or(held.len(), |o| o.row);
        let end = (row..until).find(|j| held[*j]).unwrap_or(until);
        if (row..end).any(|j| (stroke[j] - stroke[row]) * direction > motion.threshold) {
            found.push(onset(time, stroke, Leg { extreme: row, end, direction }, motion));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.04;
    const MOTION: Motion = Motion { dt: DT, noise: 1.5e-6, threshold: 76e-6 };

    fn begun(path: impl Fn(f64) -> f64, rows: usize) -> Onset {
        let time: Vec<f64> = (0..rows).map(|i| i as f64 * DT).collect();
        // Rounded, as an encoder reads.
        let stroke: Vec<f64> = time.iter().map(|t| (path(*t) / 2e-6).round() * 2e-6).collect();
        onset(&time, &stroke, Leg { extreme: 0, end: rows, direction: 1.0 }, MOTION)
    }

    #[test]
    fn a_sine_turns_at_its_extreme_and_a_line_after_a_dwell_where_it_bends() {
        let sine = begun(|t| 9.5e-3 * (1.0 - (0.314 * t).cos()), 100);
        assert!(sine.row <= 2 && sine.row as f64 * DT <= sine.doubt, "{sine:?}");
        let dwell = begun(|t| 2e-3 * (t - 1.0).max(0.0), 60);
        assert!((24..=26).contains(&dwell.row), "{dwell:?}");
        let slow_start = begun(|t| 1e-4 * (t - 1.0).max(0.0).powi(2), 100);
        assert!((slow_start.row as f64 * DT - 1.0).abs() <= slow_start.doubt + DT, "{slow_start:?}");
    }
}
