//! Which way friction points in every row of a campaign.

use model_core::motion::{Motion, MotionSettings, MotionTracker};

use crate::recording::{Campaign, Recording};

/// +1 shortening or filling, −1 lengthening or emptying, 0 unknown; per recording, per row.
#[must_use]
pub fn directions(campaign: &Campaign) -> Vec<Vec<i8>> {
    campaign.recordings.iter().map(one).collect()
}

fn one(recording: &Recording) -> Vec<i8> {
    if let Some(given) = &recording.direction {
        return given.clone();
    }
    let held = recording.held_stroke().is_some();
    zigzag(if held { &recording.pressure } else { &recording.stroke })
}

/// Turning points seen from both sides: a turn counts after a way back that noise cannot make.
fn zigzag(values: &[f64]) -> Vec<i8> {
    let range = super::points::Range::of(values.iter().copied());
    let mut steps: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let noise = super::points::median(&mut steps) / 1.65;
    let threshold = (0.01 * range.span()).max(8.0 * noise);
    let mut directions = vec![0_i8; values.len()];
    let (mut way, mut extreme, mut from) = (0_i8, 0, 0);
    let (mut low, mut high) = (0, 0);
    for i in 0..values.len() {
        if way == 0 {
            low = if values[i] < values[low] { i } else { low };
            high = if values[i] > values[high] { i } else { high };
            if values[high] - values[low] > threshold {
                way = if high > low { 1 } else { -1 };
                from = low.min(high);
                extreme = i;
            }
        } else if f64::from(way) * (values[i] - values[extreme]) >= 0.0 {
            extreme = i;
        } else if f64::from(way) * (values[extreme] - values[i]) > threshold {
            directions[from..=extreme].fill(way);
            way = -way;
            from = extreme + 1;
            extreme = i;
        }
    }
    if way != 0 {
        directions[from..].fill(way);
    }
    directions
}

/// The motion in every row, for effects that depend on it: as a controller would follow it, but with the direction seen from
/// both sides. `pause` is the time since the recording before, s.
#[must_use]
pub fn motions(recording: &Recording, directions: &[i8], pause: f64) -> Vec<Motion<f64>> {
    let mut tracker = MotionTracker::new(MotionSettings::default());
    (0..recording.len())
        .map(|i| {
            let dt = if i == 0 { 0.0 } else { recording.time[i] - recording.time[i - 1] };
            let mut motion = *tracker.step(dt, recording.stroke[i], recording.pressure[i]);
            motion.direction = f64::from(directions[i]);
            if i == 0 {
                motion.dt = pause;
            }
            motion.time = recording.time[i];
            motion.temperature = recording.temperature.as_ref().map_or(0.0, |t| t[i]);
            motion
        })
        .collect()
}
