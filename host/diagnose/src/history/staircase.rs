//! Isometric staircases: pulses of a valve, the settled point after each, and the direction of the drive.

use super::criteria::{SETTLED_INTERVAL, STAIRCASE_TURN, STAIRCASE_WITHOUT_PULSES};
use crate::criteria::valve_pulses::{WINDOW_FROM, WINDOW_TO};
use crate::valve_pulses::{self, ValvePulses};
use pam_data::recording::Recording;

/// The mean of the last part of a pulse period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// s, on the recording's clock.
    pub time: f64,
    /// Pa.
    pub pressure: f64,
    /// N.
    pub force: f64,
    /// 1 filling, −1 emptying.
    pub direction: i8,
}

/// The settled points of a recording, and whether rows were averaged into them.
pub(super) fn settled(recording: &Recording, force: &[f64]) -> (Vec<Point>, bool) {
    let told = recording.direction.as_deref().filter(|d| d.iter().any(|d| *d != 0));
    let directions = told.map_or_else(|| vec![0; recording.len()], held_directions);
    let (mut points, averaged) = averages(recording, force, &directions);
    if told.is_none() {
        turns(&mut points);
    }
    (points, averaged)
}

fn averages(recording: &Recording, force: &[f64], directions: &[i8]) -> (Vec<Point>, bool) {
    let interval = valve_pulses::interval(recording);
    if !(interval < SETTLED_INTERVAL) {
        let points = (0..recording.len())
            .map(|i| Point {
                time: recording.time[i],
                pressure: recording.pressure[i],
                force: force[i],
                direction: directions[i],
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
    let mut open: Option<(i64, Point, f64)> = None;
    for i in 0..recording.len() {
        let turns = (recording.time[i] - first - phase) / period;
        if !(window.0..window.1).contains(&(turns - turns.floor())) {
            continue;
        }
        let pulse = turns.floor() as i64;
        match &mut open {
            Some((p, sum, n)) if *p == pulse => {
                sum.time += recording.time[i];
                sum.pressure += recording.pressure[i];
                sum.force += force[i];
                *n += 1.0;
            }
            _ => {
                points.extend(open.take().map(mean));
                let [time, pressure] = [recording.time[i], recording.pressure[i]];
                open =
                    Some((pulse, Point { time, pressure, force: force[i], direction: directions[i] }, 1.0));
            }
        }
    }
    points.extend(open.map(mean));
    (points, true)
}

fn mean((_, sum, n): (i64, Point, f64)) -> Point {
    Point { time: sum.time / n, pressure: sum.pressure / n, force: sum.force / n, ..sum }
}

/// What the bench says of each row; where it says nothing, what it said last.
fn held_directions(told: &[i8]) -> Vec<i8> {
    let mut last = told.iter().copied().find(|d| *d != 0).unwrap_or(1);
    told.iter()
        .map(|d| {
            if *d != 0 {
                last = *d;
            }
            last
        })
        .collect()
}

/// Direction of the drive at settled points, by the turns of their pressure: single rows would turn with each ring.
fn turns(points: &mut [Point]) {
    let range = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.pressure), h.max(p.pressure)));
    let turn = STAIRCASE_TURN * (range.1 - range.0);
    let (mut extreme, mut now) = (0, 0_i8);
    for i in 0..points.len() {
        let moved = points[i].pressure - points[extreme].pressure;
        let onward = moved * f64::from(now) >= 0.0 && now != 0;
        if onward {
            extreme = i;
        } else if moved.abs() > turn {
            let from = if now == 0 { 0 } else { extreme + 1 };
            now = if moved > 0.0 { 1 } else { -1 };
            points[from..i].iter_mut().for_each(|p| p.direction = now);
            extreme = i;
        }
        points[i].direction = now;
    }
    // Nothing turned: it fills, or stays.
    points.iter_mut().filter(|p| p.direction == 0).for_each(|p| p.direction = 1);
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
    fn direction_turns_once_whatever_the_ripple() {
        let r = staircase(100.0, 0.5);
        let (points, _) = settled(&r, r.force.as_deref().expect("force"));
        assert_eq!(points.windows(2).filter(|w| w[0].direction != w[1].direction).count(), 1);
        assert_eq!((points[0].direction, points[points.len() - 1].direction), (1, -1));
    }
}
