//! Isometric staircases: pulses of a valve, the settled point after each, and the direction of the drive.

use super::criteria::{
    FILTER_TIMES, FOLLOWED_OVER, SETTLED_INTERVAL, STAIRCASE_TURN, STAIRCASE_WITHOUT_PULSES,
};
use crate::criteria::valve_pulses::{WINDOW_FROM, WINDOW_TO};
use crate::rest_friction::followed;
use crate::valve_pulses::{self, ValvePulses};
use pam_data::recording::{Recording, motion};
use pam_data::statistics::{range, slope};

/// The mean of the last part of a pulse period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// s, on the recording's clock.
    pub time: f64,
    /// Mean gauge pressure, Pa.
    pub pressure: f64,
    /// Mean force, N.
    pub force: f64,
    /// 1 filling, −1 emptying.
    pub direction: i8,
    /// The direction of friction that follows the pressure as it was read, over each of [`FOLLOWED_OVER`]: the overshoot of a pulse
    /// reverses it.
    pub followed: [f64; FOLLOWED_OVER.len()],
    /// The pressure behind a filter of first order with each of [`FILTER_TIMES`], less the pressure, Pa.
    pub filtered: [f64; FILTER_TIMES.len()],
    /// Mean rate of the pressure over the point, Pa/s; zero where a row is a point.
    pub rate: f64,
}

/// The settled points of a recording, and whether rows were averaged into them.
pub(super) fn settled(recording: &Recording, force: &[f64]) -> (Vec<Point>, bool) {
    let stated = recording.direction.as_deref().filter(|d| d.iter().any(|d| *d != 0));
    let directions = stated.map_or_else(|| vec![0; recording.len()], held_directions);
    let (mut points, averaged) = averages(recording, force, &directions);
    if stated.is_none() {
        set_directions(&mut points);
    }
    (points, averaged)
}

fn averages(recording: &Recording, force: &[f64], directions: &[i8]) -> (Vec<Point>, bool) {
    let interval = valve_pulses::interval(recording);
    let history = PressureHistory::of(recording, directions);
    if !(interval < SETTLED_INTERVAL) {
        let points = (0..recording.len())
            .map(|i| Point {
                time: recording.time[i],
                pressure: recording.pressure[i],
                force: force[i],
                direction: directions[i],
                followed: history.followed[i],
                filtered: [0.0; FILTER_TIMES.len()],
                rate: 0.0,
            })
            .collect();
        return (points, false);
    }
    let first = recording.time.first().copied().unwrap_or(0.0);
    let (period, phase, window) = match ValvePulses::find(recording) {
        Some(pulses) => (pulses.period, pulses.phase, (WINDOW_FROM, WINDOW_TO)),
        None => (STAIRCASE_WITHOUT_PULSES, 0.0, (0.0, 1.0)),
    };
    let mut points = Vec::new();
    let mut open: Option<i64> = None;
    let mut own: Vec<usize> = Vec::new();
    for i in 0..recording.len() {
        let periods = (recording.time[i] - first - phase) / period;
        if !(window.0..window.1).contains(&(periods - periods.floor())) {
            continue;
        }
        let pulse = periods.floor() as i64;
        if open.is_some_and(|p| p != pulse) {
            points.extend(mean(recording, force, directions, &history, &own));
            own.clear();
        }
        open = Some(pulse);
        own.push(i);
    }
    points.extend(mean(recording, force, directions, &history, &own));
    (points, true)
}

/// The mean over rows of one pulse; `None` of none.
fn mean(
    recording: &Recording,
    force: &[f64],
    directions: &[i8],
    history: &PressureHistory,
    rows: &[usize],
) -> Option<Point> {
    let first = *rows.first()?;
    let mean = |of: &dyn Fn(usize) -> f64| rows.iter().map(|i| of(*i)).sum::<f64>() / rows.len() as f64;
    let readings: Vec<(f64, f64)> =
        rows.iter().map(|i| (recording.time[*i], recording.pressure[*i])).collect();
    Some(Point {
        time: mean(&|i| recording.time[i]),
        pressure: mean(&|i| recording.pressure[i]),
        force: mean(&|i| force[i]),
        direction: directions[first],
        followed: std::array::from_fn(|over| mean(&|i| history.followed[i][over])),
        filtered: std::array::from_fn(|f| mean(&|i| history.filtered[i][f])),
        rate: slope(&readings),
    })
}

/// What follows the pressure as it was read, row by row; see [`Point`].
struct PressureHistory {
    followed: Vec<[f64; FOLLOWED_OVER.len()]>,
    filtered: Vec<[f64; FILTER_TIMES.len()]>,
}

impl PressureHistory {
    /// A recording begins with the direction that it continues in, and at rest.
    fn of(recording: &Recording, directions: &[i8]) -> Self {
        let first = directions.first().map_or(1.0, |d| if *d < 0 { -1.0 } else { 1.0 });
        let mut last = (recording.time.first().copied(), recording.pressure.first().copied());
        let mut direction = [first; FOLLOWED_OVER.len()];
        let mut behind = [0.0; FILTER_TIMES.len()];
        let (followed, filtered) = recording
            .time
            .iter()
            .zip(&recording.pressure)
            .map(|(time, pressure)| {
                let dt = last.0.map_or(0.0, |t| (time - t).max(0.0));
                let change = last.1.map_or(0.0, |p| pressure - p);
                last = (Some(*time), Some(*pressure));
                direction.iter_mut().zip(FOLLOWED_OVER).for_each(|(s, over)| *s = followed(*s, change, over));
                // The pressure is taken to ramp between samples.
                behind.iter_mut().zip(FILTER_TIMES).for_each(|(b, tau)| {
                    let kept = (-dt / tau).exp();
                    let ramped = if dt > 0.0 { change * tau / dt * (1.0 - kept) } else { 0.0 };
                    *b = *b * kept - ramped;
                });
                (direction, behind)
            })
            .unzip();
        Self { followed, filtered }
    }
}

/// What the bench says of each row; where it says nothing, what it said last.
fn held_directions(stated: &[i8]) -> Vec<i8> {
    let mut last = stated.iter().copied().find(|d| *d != 0).unwrap_or(1);
    stated
        .iter()
        .map(|d| {
            if *d != 0 {
                last = *d;
            }
            last
        })
        .collect()
}

/// Direction of the drive at settled points, by the reversals of their pressure: single rows would turn with each ring.
fn set_directions(points: &mut [Point]) {
    let pressure: Vec<f64> = points.iter().map(|p| p.pressure).collect();
    let way = motion::way(&pressure, STAIRCASE_TURN * range(&pressure), 0.0);
    points.iter_mut().zip(way).for_each(|(p, way)| p.direction = if way < 0.0 { -1 } else { 1 });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn staircase(rate: f64, period: f64) -> Recording {
        let n = (30.0 * rate) as usize;
        let time: Vec<f64> = (0..n).map(|i| i as f64 / rate).collect();
        let pressure = time
            .iter()
            .map(|t| {
                let pulse = (t / period).floor();
                let since = t - pulse * period;
                let level = if *t < 15.0 { pulse } else { 2.0 * (15.0 / period).floor() - pulse };
                let ring = (-since / 0.05).exp() * (125.0 * since).cos();
                1e4 * (level + ring)
            })
            .collect::<Vec<f64>>();
        let force = Some(pressure.iter().map(|p| p * 1e-3).collect());
        Recording { time, stroke: vec![0.0; n], pressure, force, ..Recording::default() }
    }

    #[test]
    fn pulses_are_found_and_the_ring_is_left_out() {
        for (rate, period) in [(100.0, 0.5), (106.0, 0.8)] {
            let r = staircase(rate, period);
            let (points, averaged) = settled(&r, r.force.as_deref().expect("force"));
            assert!(averaged && (points.len() as f64 - 30.0 / period).abs() <= 2.0, "{}", points.len());
            let off = points.iter().map(|p| (p.pressure / 1e4 - (p.pressure / 1e4).round()).abs());
            let worst = off.fold(0.0, f64::max);
            assert!(worst < 0.05, "{rate} Hz, {period} s: {worst}");
        }
    }

    #[test]
    fn direction_reverses_once_despite_ripple() {
        let r = staircase(100.0, 0.5);
        let (points, _) = settled(&r, r.force.as_deref().expect("force"));
        assert_eq!(points.windows(2).filter(|w| w[0].direction != w[1].direction).count(), 1);
        assert_eq!((points[0].direction, points[points.len() - 1].direction), (1, -1));
    }
}
