//! How the muscle was moved: direction, reversals, holds, ramps, noise, speed.
//!
//! This is the one reconstruction of the motion from whole recordings: fit, prediction, evaluation and diagnosis use it. The controller
//! cannot look ahead; `docs/src/decisions/12-motion.md` lists what its causal reconstruction
//! (`model_core::motion::MotionTracker`) does differently.
//!
//! | file | contents |
//! | --- | --- |
//! | `criteria` | every threshold with symbol, unit, meaning and source |
//! | `scale` | noise, smoothing, what counts as a motion |
//! | `legs` | reversals, and the sample at which each begins |
//! | `holding` | where the length is held |
//! | `columns` | travel and time since a reversal, time at rest, cycles |
//! | `state` | what each sample shows: held, in doubt, on a ramp |
//! | `settled` | rows at which the pressure rests, and the way from one to the next |
//! | `rates` | speed, acceleration, pressure rate |
//!
//! The direction of friction is the sign of the speed while the muscle moves. While its length is held, it is the way the pressure
//! drives it: filling counts as shortening. While neither changes, the last direction stays; before the first change it is unknown. Noise and ripple flip nothing: a reversal counts only when the column goes back by more than noise can. But it
//! counts from where it began, not from where it was noticed, for a sample on the wrong side costs 2 k_F F.

mod columns;
pub(crate) mod criteria;
mod holding;
mod legs;
mod rates;
mod reversals;
mod scale;
mod settled;
mod state;

pub use columns::MotionColumns;
pub use holding::Hold;
pub use rates::Rates;
pub use settled::{at_rest, fast_step, reversal_threshold, settled, settled_way, way};
pub use state::MotionState;

use super::campaign::{Campaign, Clock};
use super::columns::Recording;
use crate::criteria::Stage;
use crate::statistics::quantile;
use criteria::{LEVEL_SAMPLES, MOTION_STROKE_FLOOR, MOTION_STROKE_SHARE, RANGE_TRIM};
use legs::{Track, legs};
use reversals::{stated_reversals, stroke_reversals, with_pressure};

#[cfg(test)]
mod tests;

/// The thresholds of the reconstruction.
pub const CRITERIA: Stage = criteria::STAGE;

/// What made the direction change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The muscle moved.
    Stroke,
    /// Its length was held and the pressure changed.
    Pressure,
    /// The recording itself says so.
    Stated,
}

/// A change of direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reversal {
    /// First sample of the new direction.
    pub index: usize,
    /// 1 shortening or filling, −1 lengthening or emptying.
    pub direction: i8,
    /// What made it change.
    pub cause: Cause,
}

/// How the muscle was moved during one recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Per sample: 1 shortening, −1 lengthening, 0 not known yet.
    pub direction: Vec<i8>,
    /// Changes of direction in order, the first known direction included.
    pub reversals: Vec<Reversal>,
    /// Where the length was held, in order.
    pub holds: Vec<Hold>,
    /// Whether the length was never moved.
    pub is_isometric: bool,
    /// Standard deviation of the stroke's noise, m.
    pub stroke_noise: f64,
    /// A stroke back by more than this is a reversal, m.
    pub stroke_threshold: f64,
    /// Standard deviation of the pressure's noise, Pa.
    pub pressure_noise: f64,
    /// A pressure back by more than this, at held length, is a reversal, Pa.
    pub pressure_threshold: f64,
}

impl Motion {
    /// Finds out how the muscle was moved. Time and memory are linear in the samples.
    ///
    /// ```
    /// use pam_data::recording::{Recording, motion::Motion};
    /// let triangle = |i: usize| if i < 50 { i } else { 100 - i } as f64 * 1e-4;
    /// let recording = Recording {
    ///     time: (0..100).map(|i| i as f64 * 0.1).collect(),
    ///     pressure: vec![300e3; 100],
    ///     stroke: (0..100).map(triangle).collect(),
    ///     ..Recording::default()
    /// };
    /// let motion = Motion::of(&recording);
    /// assert_eq!((motion.direction[49], motion.direction[51]), (1, -1));
    /// ```
    #[must_use]
    pub fn of(recording: &Recording) -> Self {
        Self::after(recording, least_stroke([recording]), 0)
    }

    /// As [`Motion::of`], where less than `least`, m, is not motion, and the direction before the first sample is known.
    fn after(recording: &Recording, least: f64, before: i8) -> Self {
        let (time, stroke, pressure) = (&recording.time, &recording.stroke, &recording.pressure);
        let (scale, smooth) = scale::of_stroke(stroke, least);
        let air = scale::of_pressure(pressure);
        let is_isometric = holding::is_held(&smooth, &scale);
        let legs = if is_isometric { Vec::new() } else { legs(&smooth, scale.threshold) };
        let holds = holding::holds(time, &smooth, &scale, &legs);
        let track =
            Track { time, raw: stroke, smooth: &smooth, noise: scale.noise, threshold: scale.threshold };
        let mut reversals = stroke_reversals(&track, &legs, &holds);
        drop(smooth);
        match &recording.direction {
            Some(directions) => reversals = stated_reversals(directions),
            None => {
                let track = Track {
                    time,
                    raw: pressure,
                    smooth: pressure,
                    noise: air.noise,
                    threshold: air.threshold,
                };
                reversals = with_pressure(reversals, &holds, &track);
            }
        }
        reversals.dedup_by(|later, earlier| later.direction == earlier.direction);
        let mut direction = vec![before; time.len()];
        for (n, reversal) in reversals.iter().enumerate() {
            let end = reversals.get(n + 1).map_or(time.len(), |t| t.index);
            if let Some(part) = direction.get_mut(reversal.index..end) {
                part.fill(reversal.direction);
            }
        }
        if reversals.first().is_some_and(|t| t.direction == before) {
            reversals.remove(0);
        }
        Self {
            direction,
            reversals,
            holds,
            is_isometric,
            stroke_noise: scale.noise,
            stroke_threshold: scale.threshold,
            pressure_noise: air.noise,
            pressure_threshold: air.threshold,
        }
    }

    /// The motions of a campaign's recordings. What counts as a motion is a share of the range of all of them. With a shared clock a recording that begins where the one before ended takes
    /// over its direction; otherwise it begins unknown.
    #[must_use]
    pub fn of_campaign(campaign: &Campaign) -> Vec<Self> {
        let mut motions: Vec<Self> = Vec::with_capacity(campaign.recordings.len());
        let least = least_stroke(&campaign.recordings);
        for (i, recording) in campaign.recordings.iter().enumerate() {
            let before = i.checked_sub(1).map(|j| (&campaign.recordings[j], &motions[j]));
            let carried = match before {
                Some((last, motion)) if campaign.clock == Clock::Shared => motion.carried(last, recording),
                _ => 0,
            };
            motions.push(Self::after(recording, least, carried));
        }
        motions
    }

    /// The direction that outlives the end of `last` until `next` begins: its own if nothing moved in between.
    fn carried(&self, last: &Recording, next: &Recording) -> i8 {
        let jump = |a: &[f64], b: &[f64]| match (a.last(), b.first()) {
            (Some(a), Some(b)) => (a - b).abs(),
            _ => f64::INFINITY,
        };
        let still = jump(&last.stroke, &next.stroke) <= self.stroke_threshold
            && jump(&last.pressure, &next.pressure) <= self.pressure_threshold;
        if still { self.direction.last().copied().unwrap_or(0) } else { 0 }
    }
}

/// Less than this is not motion, m: a share of the range that the strokes have, without their few farthest readings.
fn least_stroke<'a>(recordings: impl IntoIterator<Item = &'a Recording> + Clone) -> f64 {
    let samples: usize = recordings.clone().into_iter().map(|r| r.stroke.len()).sum();
    let stride = samples / (16 * LEVEL_SAMPLES) + 1;
    let mut some: Vec<f64> =
        recordings.into_iter().flat_map(|r| r.stroke.iter().step_by(stride).copied()).collect();
    let range = quantile(&mut some, 1.0 - RANGE_TRIM) - quantile(&mut some, RANGE_TRIM);
    (MOTION_STROKE_SHARE * range).max(MOTION_STROKE_FLOOR)
}
