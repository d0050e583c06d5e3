//! How the muscle moved in a recording, seen from both sides: turning points, holds, speed, travel.
//!
//! The sign of friction decides over the whole diagnosis: one wrong sign costs twice the friction, more than most effects.
//! Turning points are found with a threshold above the stroke's noise (never by the sign of a smoothed speed), and the
//! samples about each turn are marked as unsure.

mod onset;

use self::onset::{Leg, Motion, Onset, onset};
use super::linear::median;

/// What was found of one recording, row by row, SI units.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kinematics {
    /// +1 shortening, −1 lengthening, 0 unknown.
    pub direction: Vec<f64>,
    /// m/s; zero while held.
    pub speed: Vec<f64>,
    /// m/s².
    pub acceleration: Vec<f64>,
    /// Pa/s.
    pub pressure_rate: Vec<f64>,
    /// Travel since the last turn, m.
    pub travel: Vec<f64>,
    /// Time since the last turn, s.
    pub since_reversal: Vec<f64>,
    /// Time at rest before this motion, or so far, s.
    pub hold_time: Vec<f64>,
    /// Number of the half-stroke or hold within the recording.
    pub piece: Vec<u32>,
    /// Turns so far in this recording.
    pub turns: Vec<u32>,
    /// Whether the direction is beyond doubt.
    pub sure: Vec<bool>,
    /// Whether the length was held.
    pub held: Vec<bool>,
    /// Whether the pressure has left the place where this hold began.
    pub ramped: Vec<bool>,
    /// Whether it moves on a ramp of which friction is sure to have turned, as far as it turns at held length.
    pub on_ramp: Vec<bool>,
    /// Time since the braid last moved, by its length or by a change of pressure, s; zero while moving.
    pub still: Vec<f64>,
}

/// What counts as motion; of the whole campaign.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Thresholds {
    /// Travel that counts as a turn, m.
    pub stroke: f64,
    /// Change of pressure at held length that counts as filling or emptying, Pa.
    pub pressure: f64,
}

/// Standard deviation of white noise on a smooth series, from its second differences; a quantised series has at least a
/// third of its step.
pub(crate) fn white_noise(series: &[f64]) -> f64 {
    if series.len() < 3 {
        return 0.0;
    }
    let stride = (series.len() / 20_000).max(1);
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
    if still * 5 > series.len() && step.is_finite() { by_curvature.max(step / 3.0) } else { by_curvature }
}

/// Indices of the alternating extremes of a series that lie more than `threshold` apart, and the direction after each.
fn extremes(series: &[f64], threshold: f64) -> Vec<(usize, f64)> {
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
fn slopes(time: &[f64], series: &[f64], half: usize, limits: impl Fn(usize) -> (usize, usize)) -> Vec<f64> {
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

/// Follows one recording. `given` is the bench's own word on the direction, used where the length is held; `rested` is how long the
/// muscle stood before it, s.
pub(crate) fn kinematics(
    time: &[f64],
    stroke: &[f64],
    pressure: &[f64],
    given: Option<&[i8]>,
    rested: f64,
    thresholds: Thresholds,
) -> Kinematics {
    let n = time.len();
    if n == 0 {
        return Kinematics::default();
    }
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let dt = median(&mut steps).max(1e-9);
    let noise = white_noise(stroke);
    let turning = extremes(stroke, thresholds.stroke);

    let starts: Vec<Onset> = turning
        .iter()
        .enumerate()
        .map(|(k, (extreme, direction))| {
            let end = turning.get(k + 1).map_or(n, |t| t.0 + 1);
            let leg = Leg { extreme: *extreme, end, direction: *direction };
            onset(time, stroke, leg, Motion { dt, noise, threshold: thresholds.stroke })
        })
        .collect();

    // Rest: travel over a short window stays within what noise and drift can make.
    let mut fastest = f64::INFINITY;
    let mut moving: Vec<f64> = Vec::new();
    for w in starts.windows(2) {
        let (a, b) = (w[0].row, w[1].row);
        if time[b] > time[a] {
            moving.push((stroke[b] - stroke[a]).abs() / (time[b] - time[a]));
            fastest = fastest.min(time[b] - time[a]);
        }
    }
    let typical = median(&mut moving);
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
    let mut held = vec![false; n];
    let mut i = 0;
    while i < n {
        let mut j = i;
        while j < n && quiet[j] == quiet[i] {
            j += 1;
        }
        // A turn of a triangle is quiet for one window; a hold lasts longer and stays within the threshold.
        if quiet[i] && j - i > 2 * half + 2 {
            let (lo, hi) = stroke[i..j]
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(*s), h.max(*s)));
            let slow = (stroke[j - 1] - stroke[i]).abs() <= thresholds.stroke;
            if hi - lo <= 3.0 * thresholds.stroke && slow {
                let (from, to) = (i.saturating_sub(half / 2), (j + half / 2).min(n));
                held[from..to].fill(true);
            }
        }
        i = j;
    }
    if starts.is_empty() {
        held.fill(true);
    }

    let mut k = Kinematics {
        direction: vec![0.0; n],
        travel: vec![0.0; n],
        since_reversal: vec![0.0; n],
        hold_time: vec![0.0; n],
        piece: vec![0; n],
        turns: vec![0; n],
        sure: vec![true; n],
        held,
        still: vec![0.0; n],
        ramped: vec![false; n],
        on_ramp: vec![false; n],
        ..Kinematics::default()
    };
    let mut next = 0;
    let mut direction = 0.0;
    let mut turn_row = 0;
    let mut turns = 0_u32;
    let mut piece = 0_u32;
    let mut rested = rested;
    // A stand at the beginning goes on from the one before the recording.
    let mut stood = rested;
    let mut hold_start: Option<usize> = None;
    let mut pressure_extreme = pressure[0];
    let mut still_from = 0;
    let mut hold_pressure = pressure[0];
    let mut ramped = false;
    let mut still_pressure = pressure[0];
    for row in 0..n {
        let mut turned = false;
        let direction_before = direction;
        if next < starts.len() && row >= starts[next].row {
            if starts[next].direction != direction {
                turned = true;
                direction = starts[next].direction;
            }
            next += 1;
        }
        if k.held[row] && !turned {
            if hold_start.is_none() {
                hold_start = Some(row);
                hold_pressure = pressure[row];
                ramped = false;
                pressure_extreme = pressure[row];
            }
            let said = given.and_then(|g| g.get(row)).map_or(0.0, |g| f64::from(*g));
            if said != 0.0 {
                if said != direction {
                    direction = said;
                    turned = true;
                }
            } else {
                let rise = pressure[row] - pressure_extreme;
                if direction != 0.0 && rise * direction >= 0.0 {
                    pressure_extreme = pressure[row];
                } else if rise.abs() > thresholds.pressure {
                    direction = rise.signum();
                    pressure_extreme = pressure[row];
                    turned = true;
                }
            }
        }
        if !k.held[row] || turned || (pressure[row] - still_pressure).abs() > thresholds.pressure {
            still_from = row;
            still_pressure = pressure[row];
        }
        ramped = k.held[row] && (ramped || (pressure[row] - hold_pressure).abs() > thresholds.pressure);
        k.ramped[row] = ramped;
        k.still[row] = time[row] - time[still_from];
        if turned {
            turns += 1;
            turn_row = row;
        }
        if k.held[row] {
            let start = *hold_start.get_or_insert(row);
            rested = stood + time[row] - time[start];
        } else {
            // The rest before a motion stays on record until it turns, or until the next hold.
            if hold_start.take().is_none() && turned && direction_before != 0.0 {
                rested = 0.0;
            }
            stood = 0.0;
        }
        if row > 0 && (turned || k.held[row] != k.held[row - 1]) {
            piece += 1;
        }
        k.direction[row] = direction;
        k.turns[row] = turns;
        k.piece[row] = piece;
        k.hold_time[row] = rested;
        k.since_reversal[row] = time[row] - time[turn_row];
        k.travel[row] = (stroke[row] - stroke[turn_row]).abs();
    }
    mark_ramps_from_their_start(&mut k, pressure, 4.0 * white_noise(pressure), half + 2);
    k.pressure_rate = slopes(time, pressure, half, |_| (0, n));
    mark_steady_ramps(&mut k, time, pressure, thresholds.pressure);
    for Onset { row, doubt, .. } in &starts {
        let at = time[*row];
        let mut j = *row;
        while j > 0 && at - time[j - 1] <= *doubt {
            j -= 1;
        }
        while j < n && time[j] - at <= *doubt {
            k.sure[j] = false;
            j += 1;
        }
    }
    for (sure, direction) in k.sure.iter_mut().zip(&k.direction) {
        *sure &= *direction != 0.0;
    }
    // Friction that has faded in a hold comes back somewhere within the first row of the motion after it.
    for row in 1..n {
        k.sure[row] &= !k.held[row - 1] || k.held[row];
    }
    // The speed: lines that do not run across a turn or into a hold.
    let mut bounds = vec![(0, n); n];
    let mut from = 0;
    for row in 1..=n {
        if row == n || k.piece[row] != k.piece[from] {
            bounds[from..row].fill((from, row));
            from = row;
        }
    }
    k.speed = slopes(time, stroke, half, |i| bounds[i]);
    for (v, held) in k.speed.iter_mut().zip(&k.held) {
        if *held {
            *v = 0.0;
        }
    }
    k.acceleration = slopes(time, &raw_speed, half, |_| (0, n));
    k
}

/// A ramp begins before it has passed the threshold by which it is found: back to where the pressure left what it had been about the
/// hold's beginning, be it that the muscle still moved. And a hold begins and ends within `margin` rows of where the motion's slope says.
fn mark_ramps_from_their_start(k: &mut Kinematics, pressure: &[f64], noise: f64, margin: usize) {
    let n = pressure.len();
    let mut from = 0;
    while from < n {
        let mut to = from;
        while to < n && k.held[to] == k.held[from] {
            to += 1;
        }
        if k.held[from]
            && let Some(first) = (from..to).find(|i| k.ramped[*i])
        {
            let earliest = from.saturating_sub(2 * margin);
            let before = median(&mut pressure[earliest..=from.saturating_sub(margin)].to_vec());
            let begun = (earliest..first)
                .rev()
                .find(|i| (pressure[*i] - before).abs() <= noise)
                .map_or(earliest, |i| i + 1);
            k.ramped[begun..(to + margin).min(n)].fill(true);
        }
        from = to;
    }
}

/// A ramp is judged from so long after its turn, s: what a regulator does in a step is another matter.
const RAMP_SETTLES: f64 = 3.0;

/// Marks the rows of slow ramps, from `turning` Pa after a turn on, as long as the pressure goes on the same way.
fn mark_steady_ramps(k: &mut Kinematics, time: &[f64], pressure: &[f64], turning: f64) {
    let mut turn = 0;
    for row in 1..pressure.len() {
        if !k.ramped[row] || !k.ramped[row - 1] || k.direction[row] != k.direction[row - 1] {
            turn = row;
        }
        let (passed, gone) = (time[row] - time[turn], (pressure[row] - pressure[turn]) * k.direction[row]);
        let goes_on = k.pressure_rate[row] * k.direction[row] > 0.3 * gone / passed.max(1e-9);
        k.on_ramp[row] = k.ramped[row] && k.held[row] && passed > RAMP_SETTLES && gone > turning && goes_on;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noisy(i: usize) -> f64 {
        let mut r = super::super::linear::Random(i as u64 * 77 + 5);
        r.normal()
    }

    #[test]
    fn a_noisy_triangle_with_dwells_turns_where_it_turns() {
        // 10 Hz, 1 mm/s, 20 mm up, 10 s rest, 20 mm down, three times; 10 µm noise.
        let (mut time, mut stroke, mut truth) = (vec![], vec![], vec![]);
        let mut x = 0.0;
        for k in 0..1800 {
            let phase = k % 600;
            let (v, s) = match phase {
                0..200 => (1e-3, 1.0),
                200..300 => (0.0, 1.0),
                300..500 => (-1e-3, -1.0),
                _ => (0.0, -1.0),
            };
            time.push(k as f64 * 0.1);
            stroke.push(x + 1e-5 * noisy(k));
            truth.push(s);
            x += v * 0.1;
        }
        let pressure = vec![300e3; time.len()];
        let k = kinematics(&time, &stroke, &pressure, None, 0.0, Thresholds { stroke: 1e-4, pressure: 5e3 });
        let wrong = k.direction.iter().zip(&truth).zip(&k.sure).filter(|((d, t), s)| **s && d != t).count();
        assert_eq!(wrong, 0, "rows with a wrong sign that count as sure");
        let unsure = k.sure.iter().filter(|s| !**s).count();
        assert!(unsure < 60, "{unsure} rows of 1800 are unsure");
        assert!(k.held[250] && k.held[550] && !k.held[100] && !k.held[400]);
        assert!((k.speed[100] - 1e-3).abs() < 3e-5, "{}", k.speed[100]);
        assert!((k.hold_time[400] - 10.0).abs() < 1.0, "{}", k.hold_time[400]);
    }

    #[test]
    fn the_first_motion_of_a_recording_comes_after_the_rest_before_it() {
        // 1 mm/s up and down, twice; it stood for 7 s before.
        let time: Vec<f64> = (0..800).map(|i| f64::from(i) * 0.1).collect();
        let stroke: Vec<f64> =
            (0..800).map(|i| 1e-4 * (200.0 - (f64::from(i % 400) - 200.0).abs())).collect();
        let thresholds = Thresholds { stroke: 2e-4, pressure: 5e3 };
        let k = kinematics(&time, &stroke, &[3e5; 800], None, 7.0, thresholds);
        assert!(k.hold_time[..190].iter().all(|h| *h == 7.0));
        assert!(k.hold_time[220..].iter().all(|h| *h == 0.0));
        // Where it still stands at first, that time comes on top.
        let mut later = vec![0.0; 100];
        later.extend(&stroke[..700]);
        let k = kinematics(&time, &later, &[3e5; 800], None, 7.0, thresholds);
        assert!((k.hold_time[250] - 17.0).abs() < 1.0, "{}", k.hold_time[250]);
    }

    #[test]
    fn at_held_length_the_pressure_decides_and_before_it_moves_nothing_is_known() {
        let time: Vec<f64> = (0..900).map(|i| f64::from(i) * 0.1).collect();
        let stroke = vec![0.01; 900];
        let pressure: Vec<f64> = (0..900)
            .map(|i| if i < 100 { 1e5 } else { 1e5 + 1e3 * (400.0 - (f64::from(i) - 500.0).abs()) })
            .collect();
        let k = kinematics(&time, &stroke, &pressure, None, 0.0, Thresholds { stroke: 1e-4, pressure: 5e3 });
        assert_eq!((k.direction[50], k.direction[300], k.direction[700]), (0.0, 1.0, -1.0));
        assert!(k.held.iter().all(|h| *h));
    }

    #[test]
    fn a_ramp_is_marked_from_where_the_pressure_left_and_judged_once_friction_has_turned() {
        // 10 Hz: 10 s of stroke at 400 kPa; the pressure falls by 10 kPa/s for 20 s, begun half a second before the muscle stood.
        let n = 500;
        let time: Vec<f64> = (0..n).map(|i| i as f64 * 0.1).collect();
        let stroke: Vec<f64> =
            time.iter().enumerate().map(|(i, t)| 1e-3 * t.min(10.0) + 1e-6 * noisy(i)).collect();
        let pressure: Vec<f64> = time
            .iter()
            .enumerate()
            .map(|(i, t)| 400e3 - 10e3 * (t - 9.5).clamp(0.0, 20.0) + 20.0 * noisy(i + n))
            .collect();
        let k = kinematics(&time, &stroke, &pressure, None, 0.0, Thresholds { stroke: 1e-4, pressure: 5e3 });
        assert!(
            k.ramped[97..].iter().all(|r| *r),
            "the ramp is left out from its start, while the muscle moved"
        );
        assert!(k.ramped[..80].iter().all(|r| !*r));
        let judged: Vec<usize> = (0..n).filter(|i| k.on_ramp[*i]).collect();
        assert!((128..150).contains(&judged[0]), "from row {}", judged[0]);
        let last = judged[judged.len() - 1];
        assert!(
            (285..300).contains(&last),
            "to row {last}: where the pressure stands again nothing is known"
        );
        assert!(judged.iter().all(|i| k.direction[*i] == -1.0));
    }
}
