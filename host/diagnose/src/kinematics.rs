//! How the muscle moved in a recording, seen from both sides: turning points, holds, speed, travel.
//!
//! The sign of friction decides over the whole diagnosis: one wrong sign costs twice the friction, more than most effects.
//! Turning points are found with a threshold above the stroke's noise (never by the sign of a smoothed speed), and the
//! samples about each turn are marked as unsure.

mod holds;
mod onset;
mod ramps;
mod signal;
mod stroke_path;

use self::holds::{Holds, holds};
use self::onset::{Leg, Motion, Onset, onset};
pub(crate) use self::signal::white_noise;
use self::signal::{extremes, slopes};
use self::stroke_path::StrokePath;
use super::criteria::motion::RAMP_NOISE;
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

/// The columns of a recording that say how it moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Recorded<'a> {
    /// s.
    pub time: &'a [f64],
    /// m.
    pub stroke: &'a [f64],
    /// Pa.
    pub pressure: &'a [f64],
    /// The bench's own word on the direction, used where the length is held.
    pub given: Option<&'a [i8]>,
}

/// Follows one recording. `rested` is how long the muscle stood before it, s.
pub(crate) fn kinematics(recorded: Recorded<'_>, rested: f64, thresholds: Thresholds) -> Kinematics {
    let Recorded { time, stroke, pressure, .. } = recorded;
    let n = time.len();
    if n == 0 {
        return Kinematics::default();
    }
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let dt = median(&mut steps).max(1e-9);
    let noise = white_noise(stroke);
    let motion = Motion { dt, noise, threshold: thresholds.stroke };
    let turning = extremes(stroke, thresholds.stroke);
    let starts: Vec<Onset> = turning
        .iter()
        .enumerate()
        .map(|(k, (extreme, direction))| {
            let end = turning.get(k + 1).map_or(n, |t| t.0 + 1);
            let leg = Leg { extreme: *extreme, end, direction: *direction };
            onset(time, stroke, leg, motion)
        })
        .collect();
    let Holds { held, half, raw_speed } = holds(time, stroke, &starts, dt, noise, thresholds.stroke);
    let resumed = onset::resumed(time, stroke, &held, &starts, motion);
    let mut all = [&starts[..], &resumed[..]].concat();
    all.sort_by_key(|o| o.row);
    let mut k = Kinematics::of_rows(held);
    let mut course = StrokePath::begin(&recorded, thresholds, &all, rested);
    for row in 0..n {
        course.go(row, &mut k);
    }
    ramps::mark_ramps_from_their_start(&mut k, pressure, RAMP_NOISE * white_noise(pressure), half + 2);
    k.pressure_rate = slopes(time, pressure, half, |_| (0, n));
    ramps::mark_steady_ramps(&mut k, time, pressure, thresholds.pressure);
    let turned = |o: &&Onset| o.row > 0 && k.turns[o.row] != k.turns[o.row - 1];
    let doubtful: Vec<Onset> = starts.iter().chain(resumed.iter().filter(turned)).copied().collect();
    k.doubt(time, &doubtful);
    k.speed = k.speeds(time, stroke, half);
    k.acceleration = slopes(time, &raw_speed, half, |_| (0, n));
    k
}

impl Kinematics {
    /// Rows of which nothing is known but whether the length is held.
    fn of_rows(held: Vec<bool>) -> Self {
        let n = held.len();
        Self {
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
            ..Self::default()
        }
    }

    /// Marks the rows of which the direction is not beyond doubt.
    fn doubt(&mut self, time: &[f64], starts: &[Onset]) {
        let n = time.len();
        for Onset { row, doubt, .. } in starts {
            let at = time[*row];
            let mut j = *row;
            while j > 0 && at - time[j - 1] <= *doubt {
                j -= 1;
            }
            while j < n && time[j] - at <= *doubt {
                self.sure[j] = false;
                j += 1;
            }
        }
        for (sure, direction) in self.sure.iter_mut().zip(&self.direction) {
            *sure &= *direction != 0.0;
        }
        // Friction that has faded in a hold comes back somewhere within the first row of the motion after it.
        for row in 1..n {
            self.sure[row] &= !self.held[row - 1] || self.held[row];
        }
    }

    /// The speed, m/s: of lines that do not run across a turn or into a hold.
    fn speeds(&self, time: &[f64], stroke: &[f64], half: usize) -> Vec<f64> {
        let mut bounds = Vec::with_capacity(time.len());
        for piece in self.piece.chunk_by(|a, b| a == b) {
            let from = bounds.len();
            bounds.resize(from + piece.len(), (from, from + piece.len()));
        }
        let mut speeds = slopes(time, stroke, half, |i| bounds[i]);
        for (speed, held) in speeds.iter_mut().zip(&self.held) {
            if *held {
                *speed = 0.0;
            }
        }
        speeds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded<'a>(time: &'a [f64], stroke: &'a [f64], pressure: &'a [f64]) -> Recorded<'a> {
        Recorded { time, stroke, pressure, given: None }
    }

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
        let k =
            kinematics(recorded(&time, &stroke, &pressure), 0.0, Thresholds { stroke: 1e-4, pressure: 5e3 });
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
        let k = kinematics(recorded(&time, &stroke, &[3e5; 800]), 7.0, thresholds);
        assert!(k.hold_time[..190].iter().all(|h| *h == 7.0));
        assert!(k.hold_time[220..].iter().all(|h| *h == 0.0));
        // Where it still stands at first, that time comes on top.
        let mut later = vec![0.0; 100];
        later.extend(&stroke[..700]);
        let k = kinematics(recorded(&time, &later, &[3e5; 800]), 7.0, thresholds);
        assert!((k.hold_time[250] - 17.0).abs() < 1.0, "{}", k.hold_time[250]);
    }

    #[test]
    fn at_held_length_the_pressure_decides_and_before_it_moves_nothing_is_known() {
        let time: Vec<f64> = (0..900).map(|i| f64::from(i) * 0.1).collect();
        let stroke = vec![0.01; 900];
        let pressure: Vec<f64> = (0..900)
            .map(|i| if i < 100 { 1e5 } else { 1e5 + 1e3 * (400.0 - (f64::from(i) - 500.0).abs()) })
            .collect();
        let k =
            kinematics(recorded(&time, &stroke, &pressure), 0.0, Thresholds { stroke: 1e-4, pressure: 5e3 });
        assert_eq!((k.direction[50], k.direction[300], k.direction[700]), (0.0, 1.0, -1.0));
        assert!(k.held.iter().all(|h| *h));
    }

    /// 10 Hz: up 4 mm at 2 mm/s, held while the pressure falls by 400 kPa within 80 s and, if it `returns`, rises again; then 3.6 mm on or
    /// back. Readings of the stroke have 2 µm of noise.
    fn after_ramps(seed: usize, returns: bool, on: f64) -> (Kinematics, std::ops::Range<usize>) {
        let n = 1900;
        let time: Vec<f64> = (0..n).map(|i| i as f64 * 0.1).collect();
        let last = 1871..n;
        let path = |t: f64| 2e-3 * (t.min(2.0) + on * (t - 187.0).max(0.0));
        let ramps = |t: f64| if returns { (t - 85.0).abs().min(80.0) } else { (t - 5.0).clamp(0.0, 80.0) };
        let empty = |t: f64| if returns { 80.0 - ramps(t) } else { ramps(t) };
        let stroke: Vec<f64> =
            time.iter().enumerate().map(|(i, t)| path(*t) + 2e-6 * noisy(i + n * seed)).collect();
        let pressure: Vec<f64> = time.iter().map(|t| 500e3 - 5e3 * empty(*t)).collect();
        let thresholds = Thresholds { stroke: 5e-5, pressure: 1e4 };
        (kinematics(recorded(&time, &stroke, &pressure), 0.0, thresholds), last)
    }

    #[test]
    fn the_stroke_after_ramps_of_pressure_goes_its_own_way() {
        for seed in 0..20 {
            for (returns, on) in [(true, -1.0), (false, 1.0), (false, -1.0), (true, 1.0)] {
                let (k, last) = after_ramps(seed, returns, on);
                let ramped = if returns { 1.0 } else { -1.0 };
                assert_eq!(k.direction[1600], ramped, "seed {seed}: by the pressure, at held length");
                let wrong = last.clone().filter(|i| k.sure[*i] && k.direction[*i] != on).count();
                assert_eq!(wrong, 0, "seed {seed}, on {on} after {ramped}: rows with a wrong sign");
                assert!(last.clone().filter(|i| k.sure[*i]).count() > 20);
            }
        }
    }

    #[test]
    fn a_length_that_creeps_under_a_ramp_is_held() {
        // 10 Hz: up 2 mm and, after 160 s, 2 mm more, each within a second; meanwhile the pressure falls for 80 s and rises again, and the
        // frame, which is known, gives 70 µm with the force. Then all the way back, and once more.
        let period = 500.0;
        let time: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 0.1).collect();
        let ramped = |t: f64| (1.0 - (t - 85.0).abs() / 80.0).max(0.0);
        let path = |t: f64| 2e-3 * (t.min(1.0) + (t - 180.0).clamp(0.0, 1.0) - (t - 200.0).clamp(0.0, 2.0));
        let at = |t: f64| path(t % period) - 7e-5 * ramped(t % period);
        let stroke: Vec<f64> = time.iter().enumerate().map(|(i, t)| at(*t) + 1e-6 * noisy(i)).collect();
        let pressure: Vec<f64> = time.iter().map(|t| 500e3 - 400e3 * ramped(t % period)).collect();
        let thresholds = Thresholds { stroke: 6e-5, pressure: 1e4 };
        let k = kinematics(recorded(&time, &stroke, &pressure), 0.0, thresholds);
        for cycle in [0, 5000] {
            assert!(k.held[cycle + 50..cycle + 1750].iter().all(|h| *h));
            assert!(k.direction[cycle + 100..cycle + 800].iter().all(|d| *d == -1.0), "while it falls");
            assert!(k.direction[cycle + 900..cycle + 1600].iter().all(|d| *d == 1.0), "while it rises");
        }
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
        let k =
            kinematics(recorded(&time, &stroke, &pressure), 0.0, Thresholds { stroke: 1e-4, pressure: 5e3 });
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
