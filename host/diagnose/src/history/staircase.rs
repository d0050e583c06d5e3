//! Isometric staircases: pulses of a valve, the settled point after each, and the direction of the drive.

use super::criteria::{
    LEAST_PERIODICITY, SETTLED_INTERVAL, STAIRCASE_BINS, STAIRCASE_FINEST, STAIRCASE_LONGEST,
    STAIRCASE_PERIODS, STAIRCASE_TURN, STAIRCASE_WITHOUT_PULSES, WINDOW_FROM, WINDOW_TO,
};
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
    let mut steps: Vec<f64> = recording.time.windows(2).map(|w| w[1] - w[0]).collect();
    let interval = crate::linear::median(&mut steps);
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
    let (period, phase, window) = match pulses(recording, interval) {
        Some((period, phase)) => (period, phase, (WINDOW_FROM, WINDOW_TO)),
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

/// Period and phase (after the first row) of a valve's pulses, s, from the autocorrelation of |dP/dt|.
fn pulses(recording: &Recording, interval: f64) -> Option<(f64, f64)> {
    let step = interval.max(STAIRCASE_FINEST);
    let first = *recording.time.first()?;
    let count = ((recording.duration() / step) as usize).min(STAIRCASE_LONGEST);
    let mut at = 0;
    let even: Vec<f64> = (0..count)
        .map(|k| {
            let time = first + k as f64 * step;
            while at + 2 < recording.len() && recording.time[at + 1] < time {
                at += 1;
            }
            let (t, p) = (&recording.time[at..], &recording.pressure[at..]);
            let share = ((time - t[0]) / (t.get(1)? - t[0])).clamp(0.0, 1.0);
            Some(p[0] + share * (p.get(1)? - p[0]))
        })
        .collect::<Option<_>>()?;
    let mut rate: Vec<f64> = even.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let mean = rate.iter().sum::<f64>() / rate.len().max(1) as f64;
    rate.iter_mut().for_each(|r| *r -= mean);
    let power: f64 = rate.iter().map(|r| r * r).sum();
    let lags = ((STAIRCASE_PERIODS.0 / step).ceil() as usize).max(2)..(STAIRCASE_PERIODS.1 / step) as usize;
    let correlation = |lag: usize| {
        let product: f64 = rate.iter().zip(rate.get(lag..).unwrap_or(&[])).map(|(a, b)| a * b).sum();
        product / power.max(f64::MIN_POSITIVE)
    };
    let found: Vec<(usize, f64)> = lags.map(|lag| (lag, correlation(lag))).collect();
    let best = found.iter().map(|f| f.1).fold(0.0, f64::max);
    if !(best >= LEAST_PERIODICITY) {
        return None;
    }
    // Multiples of a period correlate almost as well as the period itself.
    let peak = |w: &[(usize, f64)]| w[1].1 >= 0.8 * best && w[1].1 >= w[0].1 && w[1].1 >= w[2].1;
    let lag = found.windows(3).find(|w| peak(w))?[1].0;
    let near = |k: i32| (lag as f64 + 0.02 * f64::from(k)) * step;
    let folds = (-50..=50).map(|k| (near(k), fold(&rate, step, near(k))));
    let (period, (_, phase)) = folds.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    Some((period, phase))
}

/// Folds |dP/dt| over a period: how unevenly it lies, and where it begins to rise.
fn fold(rate: &[f64], step: f64, period: f64) -> (f64, f64) {
    let bins = ((period / step) as usize).clamp(2, STAIRCASE_BINS);
    let mut sums = vec![(0.0, 0.0); bins];
    for (k, r) in rate.iter().enumerate() {
        let turns = (k as f64 + 0.5) * step / period;
        let bin = (((turns - turns.floor()) * bins as f64) as usize).min(bins - 1);
        sums[bin] = (sums[bin].0 + r, sums[bin].1 + 1.0);
    }
    let means: Vec<f64> = sums.iter().map(|s| s.0 / f64::max(s.1, 1.0)).collect();
    let uneven = means.iter().map(|m| m * m).sum();
    let top = (0..bins).max_by(|a, b| means[*a].total_cmp(&means[*b])).unwrap_or(0);
    // The pulse may begin a bin before the steepest one.
    let before = (top + bins - 1) % bins;
    let start = if means[before] > 0.3 * means[top] { before } else { top };
    (uneven, start as f64 / bins as f64 * period)
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
