//! How the muscle is moving: direction, travel, rest. Causal, for the controller; small enough to run every tick.
//!
//! Which way friction points: while the muscle moves, the sign of its speed. While its length is held and the pressure
//! changes, filling counts as shortening and emptying as lengthening. While neither changes, the last direction stays.
//! Sensor noise and a regulator's ripple must not flip it: a reversal counts only after a travel back that noise cannot make.

use crate::scalar::Scalar;

/// The motion at one moment, SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion<T> {
    /// Time since the last moment, s.
    pub dt: T,
    /// Time since the beginning, s.
    pub time: T,
    /// `ΔL`, m.
    pub stroke: T,
    /// Rate of the stroke, m/s, positive while shortening.
    pub speed: T,
    /// Rate of the speed, m/s².
    pub acceleration: T,
    /// Rate of the gauge pressure, Pa/s, positive while filling.
    pub pressure_rate: T,
    /// +1 shortening, −1 lengthening, 0 unknown.
    pub direction: T,
    /// Travel since the last reversal, m.
    pub travel: T,
    /// Time since the last reversal, s.
    pub since_reversal: T,
    /// How long the muscle rested before its present motion, or has been resting, s.
    pub hold_time: T,
    /// 1 while the muscle rests, 0 while it moves.
    pub resting: T,
    /// Full cycles so far.
    pub cycles: T,
    /// Absolute temperature, K; 0 where unknown.
    pub temperature: T,
}

/// What counts as a reversal and how fast rates follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionSettings<T> {
    /// Travel back that counts as a reversal, m; above the stroke sensor's noise.
    pub stroke_threshold: T,
    /// Change of pressure at held length that counts as filling or emptying, Pa; above ripple.
    pub pressure_threshold: T,
    /// Time constant of the filters behind speed and pressure rate, s.
    pub rate_time: T,
    /// A muscle slower than this, m/s, counts as resting.
    pub rest_speed: T,
}

impl<T: Scalar> Default for MotionSettings<T> {
    fn default() -> Self {
        Self {
            stroke_threshold: T::from_f32(1.0e-4),
            pressure_threshold: T::from_f32(5.0e3),
            rate_time: T::from_f32(0.02),
            rest_speed: T::from_f32(1.0e-4),
        }
    }
}

/// Follows a motion from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionTracker<T> {
    settings: MotionSettings<T>,
    motion: Motion<T>,
    started: bool,
    last_stroke: T,
    last_pressure: T,
    /// The farthest point of the present stroke: a reversal is measured from here.
    extreme: T,
    pressure_extreme: T,
    reversals: T,
    /// Where the muscle has been, to within the threshold, for `quiet` seconds: noise does not end a rest.
    anchor: T,
    quiet: T,
    moving_for: T,
}

impl<T: Scalar> MotionTracker<T> {
    /// Nothing known yet.
    pub fn new(settings: MotionSettings<T>) -> Self {
        Self {
            settings,
            motion: Motion::default(),
            started: false,
            last_stroke: T::ZERO,
            last_pressure: T::ZERO,
            extreme: T::ZERO,
            pressure_extreme: T::ZERO,
            reversals: T::ZERO,
            anchor: T::ZERO,
            quiet: T::ZERO,
            moving_for: T::ZERO,
        }
    }

    /// The motion as last seen.
    pub fn motion(&self) -> &Motion<T> {
        &self.motion
    }

    /// Takes the next readings: seconds since the last ones, stroke (m), pressure (Pa).
    pub fn step(&mut self, dt: T, stroke: T, pressure: T) -> &Motion<T> {
        let m = &mut self.motion;
        m.dt = dt;
        m.stroke = stroke;
        if !self.started {
            self.started = true;
            m.dt = T::ZERO;
            self.last_stroke = stroke;
            self.last_pressure = pressure;
            self.extreme = stroke;
            self.pressure_extreme = pressure;
            self.anchor = stroke;
            return &self.motion;
        }
        if dt > T::ZERO {
            m.time += dt;
            m.since_reversal += dt;
            let share = dt / (dt + self.settings.rate_time);
            let speed = m.speed + share * ((stroke - self.last_stroke) / dt - m.speed);
            m.acceleration += share * ((speed - m.speed) / dt - m.acceleration);
            m.speed = speed;
            m.pressure_rate += share * ((pressure - self.last_pressure) / dt - m.pressure_rate);
            if (stroke - self.anchor).abs() > self.settings.stroke_threshold {
                self.anchor = stroke;
                self.quiet = T::ZERO;
            } else {
                self.quiet += dt;
            }
            if self.quiet >= self.rest_after() {
                self.motion.hold_time = self.quiet;
                self.motion.resting = T::ONE;
                self.moving_for = T::ZERO;
            } else {
                self.motion.resting = T::ZERO;
                self.moving_for += dt;
            }
        }
        self.last_stroke = stroke;
        self.last_pressure = pressure;
        self.detect_reversal(stroke, pressure);
        &self.motion
    }

    /// A muscle that stays within the threshold for so long, s, is slower than the rest speed.
    fn rest_after(&self) -> T {
        self.settings.stroke_threshold / self.settings.rest_speed
    }

    fn detect_reversal(&mut self, stroke: T, pressure: T) {
        let resting = self.motion.speed.abs() < self.settings.rest_speed || self.quiet >= self.rest_after();
        let m = &mut self.motion;
        // Forward is where the present stroke goes; before the first motion both ways are open.
        let forward = if m.direction == T::ZERO { (stroke - self.extreme).sign() } else { m.direction };
        let gone = (stroke - self.extreme) * forward;
        if m.direction == T::ZERO {
            if gone > self.settings.stroke_threshold {
                self.begin(forward, stroke, pressure);
                return;
            }
        } else if gone >= T::ZERO {
            m.travel += gone;
            self.extreme = stroke;
            if gone > T::ZERO && !resting {
                self.pressure_extreme = pressure;
            }
        } else if -gone > self.settings.stroke_threshold {
            let back = -gone;
            self.begin(-forward, stroke, pressure);
            self.motion.travel = back;
            return;
        }
        if resting {
            // At held length the pressure says which way the braid creeps.
            let rise = pressure - self.pressure_extreme;
            let m = &self.motion;
            if rise * m.direction >= T::ZERO && m.direction != T::ZERO {
                self.pressure_extreme = pressure;
            } else if rise.abs() > self.settings.pressure_threshold {
                self.begin(rise.sign(), stroke, pressure);
            }
        }
    }

    fn begin(&mut self, direction: T, stroke: T, pressure: T) {
        if direction != self.motion.direction {
            self.reversals += T::ONE;
            self.motion.cycles = self.reversals * T::from_f32(0.5);
            self.motion.since_reversal = T::ZERO;
            // A reversal in the middle of a motion comes after no rest.
            if self.moving_for > self.rest_after() {
                self.motion.hold_time = T::ZERO;
            }
            self.motion.travel = T::ZERO;
        }
        self.motion.direction = direction;
        self.extreme = stroke;
        self.pressure_extreme = pressure;
    }
}

/// Which way friction points, as a number between −1 and +1 that never jumps.
///
/// After a reversal the strands of the braid stretch before they slide: friction changes from one direction to the other over some
/// distance. Three elastic sliders of Prandtl's kind, `s_i ← clamp(s_i + Δξ/d_i)`, represent the strands; their mean is within
/// 0.13 of the usual law, the exponential `−1 + 2 e^(−ξ/d)`. Unlike that exponential they respond to signed travel, and noise of the
/// readings cancels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slide<T> {
    sliders: [T; 3],
    /// The direction in which all of them are at their end, otherwise zero.
    full: T,
}

impl<T: Scalar> Slide<T> {
    /// `d/d_i`: stiffness of each slider; the mean of the distances `d_i` is nearly `d`.
    const STIFFNESS: [f32; 3] = [1.0 / 0.3, 1.0 / 0.8, 1.0 / 1.8];

    /// Takes a travel, in distances `d`, positive while shortening; gives the direction.
    #[inline(always)]
    pub fn step(&mut self, travel: T) -> T {
        // Nearly always the muscle continues in its direction, long after the last slider has come to its end.
        if self.full * travel > T::ZERO {
            return self.full;
        }
        let mut sum = T::ZERO;
        for (s, stiffness) in self.sliders.iter_mut().zip(Self::STIFFNESS) {
            *s = (*s + travel * T::from_f32(stiffness)).at_least(-T::ONE).at_most(T::ONE);
            sum += *s;
        }
        let direction = sum * T::from_f32(1.0 / 3.0);
        self.full = if direction.abs() >= T::ONE { direction } else { T::ZERO };
        direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(readings: impl IntoIterator<Item = (f64, f64)>) -> (Motion<f64>, usize) {
        let mut tracker = MotionTracker::new(MotionSettings::default());
        let mut flips = 0;
        let mut last = 0.0;
        for (stroke, pressure) in readings {
            let m = tracker.step(1e-3, stroke, pressure);
            if m.direction != last {
                flips += 1;
                last = m.direction;
            }
        }
        (*tracker.motion(), flips)
    }

    #[test]
    fn before_anything_moved_the_direction_is_unknown() {
        let (m, flips) = run((0..1000).map(|i| (1e-5 * f64::from(i % 3), 300e3)));
        assert_eq!((m.direction, flips), (0.0, 0));
    }

    #[test]
    fn noise_and_ripple_do_not_flip_it() {
        let noisy = (0..4000_i32).map(|i| {
            let noise = 3e-5 * f64::from((i * 7919) % 13 - 6) / 6.0;
            (5e-6 * f64::from(i.min(2000)) + noise, 300e3 + 0.7e3 * f64::from((i * 31) % 7 - 3))
        });
        let (m, flips) = run(noisy);
        assert_eq!((m.direction, flips), (1.0, 1));
    }

    #[test]
    fn a_turn_is_seen_within_the_threshold_and_travel_counts_from_it() {
        let up_and_down = (0..3000_i32).map(|i| (1e-5 * f64::from(1500 - (i - 1500).abs()), 300e3));
        let (m, flips) = run(up_and_down);
        assert_eq!((m.direction, flips), (-1.0, 2));
        assert!((m.travel - 0.015).abs() < 2e-4, "{}", m.travel);
        assert_eq!(m.cycles, 1.0);
    }

    #[test]
    fn a_rest_is_timed_through_noise_and_remembered_by_the_motion_after_it() {
        let noise = |i: i32| 2e-5 * f64::from((i * 7919) % 13 - 6) / 6.0;
        let go = (0..2000_i32).map(|i| 5e-6 * f64::from(i));
        let rest = (0..5000_i32).map(|_| 10e-3);
        let back = (0..1500_i32).map(|i| 10e-3 - 5e-6 * f64::from(i));
        let on = (0..1500_i32).map(|i| 2.5e-3 + 5e-6 * f64::from(i));
        let with_noise = |strokes: Vec<f64>| {
            run(strokes.into_iter().zip(0_i32..).map(|(x, i)| (x + noise(i), 300e3))).0.hold_time
        };
        let after: Vec<f64> = go.clone().chain(rest.clone()).chain(back.clone()).collect();
        let timed = with_noise(after);
        assert!((timed - 5.0).abs() < 0.1, "{timed} s");
        // A reversal without a rest, more than a second later, forgets it.
        assert_eq!(with_noise(go.chain(rest).chain(back).chain(on).collect()), 0.0);
    }

    #[test]
    fn a_slide_follows_the_exponential_and_noise_hardly_disturbs_it() {
        let mut slide = Slide::<f64>::default();
        assert_eq!(slide.step(0.0), 0.0, "unknown at first");
        for _ in 0..100 {
            slide.step(0.1);
        }
        // All sliders at their end: more of the same changes nothing, not even by rounding.
        let at_end = slide;
        let direction = slide.step(0.0);
        assert_eq!((slide.step(0.1), slide), (direction, at_end));
        for n in 0..1000 {
            assert!(slide.step(if n % 2 == 0 { -0.05 } else { 0.05 }) > 0.9);
        }
        for n in 1..100 {
            let travelled = 0.05 * f64::from(n);
            let exponential = 2.0 * (-travelled).exp() - 1.0;
            assert!((slide.step(-0.05) - exponential).abs() < 0.14, "after {travelled}");
        }
    }

    #[test]
    fn at_held_length_filling_counts_as_shortening() {
        let fill = (0..2000).map(|i| (0.01, 100e3 + 100.0 * f64::from(i)));
        let (m, flips) = run(fill);
        assert_eq!((m.direction, flips), (1.0, 1));
        let empty = (0..2000).map(|i| (0.01, 300e3 - 100.0 * f64::from(i)));
        assert_eq!(run(empty).0.direction, -1.0);
    }
}
