//! What each sample shows: whether the length is held, whether the direction is in doubt, whether the pressure ramps.

use std::ops::Range;

use super::criteria::{
    DOUBT_SAMPLES, ONSET_CLEAR, RAMP_MARGIN, RAMP_MARGIN_SAMPLES, RAMP_NOISE, RAMP_SETTLES, RAMP_STEADY,
};
use super::{Cause, Motion, Recording, Reversal};
use crate::statistics::median;

/// The state of the motion, one value per sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionState {
    /// Reversals so far in this recording.
    pub reversals: Vec<u32>,
    /// Number of the half-stroke or hold within the recording.
    pub piece: Vec<u32>,
    /// Whether the length is held.
    pub held: Vec<bool>,
    /// Whether the direction is known beyond doubt.
    pub sure: Vec<bool>,
    /// Time since the braid last moved, by its length or by a change of pressure, s; zero while moving.
    pub still: Vec<f64>,
    /// Whether the pressure has left the level at which this hold began.
    pub ramped: Vec<bool>,
    /// Whether the pressure ramps at held length and friction is sure to have turned, as far as it turns there.
    pub on_ramp: Vec<bool>,
}

impl Motion {
    /// The state at each sample. `pressure_rate` is that of [`Rates`](super::Rates), Pa/s.
    #[must_use]
    pub fn state(&self, recording: &Recording, pressure_rate: &[f64]) -> MotionState {
        let n = self.direction.len().min(recording.len());
        let mut state = MotionState { held: vec![false; n], sure: vec![true; n], ..MotionState::default() };
        for hold in &self.holds {
            if let Some(part) = state.held.get_mut(hold.start..=hold.end) {
                part.fill(true);
            }
        }
        self.count(&mut state);
        self.doubt(recording, &mut state);
        self.stillness(recording, &mut state);
        self.ramps(recording, &mut state);
        self.steady_ramps(recording, pressure_rate, &mut state);
        state
    }

    /// Numbers the reversals and the half-strokes and holds between them.
    fn count(&self, state: &mut MotionState) {
        let mut starts = self.reversals.iter().map(|t| t.index).peekable();
        let (mut reversals, mut piece) = (0, 0);
        for row in 0..state.held.len() {
            let reversed = starts.next_if(|t| *t <= row).is_some();
            reversals += u32::from(reversed);
            piece += u32::from(row > 0 && (reversed || state.held[row] != state.held[row - 1]));
            state.reversals.push(reversals);
            state.piece.push(piece);
        }
    }

    /// Marks the samples whose direction is not known beyond doubt.
    fn doubt(&self, recording: &Recording, state: &mut MotionState) {
        for reversal in &self.reversals {
            for row in self.doubtful(recording, reversal, &state.held) {
                state.sure[row] = false;
            }
        }
        for row in 0..state.sure.len() {
            // Friction that has faded in a hold comes back somewhere within the first sample of the motion after it.
            let resumes = row > 0 && state.held[row - 1] && !state.held[row];
            state.sure[row] &= self.direction[row] != 0 && !resumes;
        }
    }

    /// The samples about a reversal whose side noise leaves in doubt: those that lie within the noise of where the column turned, one on
    /// either side at least. After a hold the reversal is as uncertain backward as it is forward.
    fn doubtful(&self, recording: &Recording, reversal: &Reversal, held: &[bool]) -> Range<usize> {
        let (column, noise) = match reversal.cause {
            Cause::Stroke => (&recording.stroke, self.stroke_noise),
            Cause::Pressure => (&recording.pressure, self.pressure_noise),
            Cause::Stated => return reversal.index..reversal.index,
        };
        let n = held.len().min(column.len());
        let Some(level) = column.get(reversal.index).copied().filter(|_| reversal.index < n) else {
            return 0..0;
        };
        let near = |i: &usize| (column[*i] - level).abs() <= ONSET_CLEAR * noise;
        let after = (reversal.index + 1..n).take(DOUBT_SAMPLES).take_while(near).count() + 1;
        let rests = reversal.cause == Cause::Pressure || reversal.index > 0 && held[reversal.index - 1];
        let most = if rests { after } else { DOUBT_SAMPLES };
        let before = (0..reversal.index.saturating_sub(1)).rev().take_while(near).take(most - 1).count() + 1;
        reversal.index.saturating_sub(before)..(reversal.index + after).min(n)
    }

    /// Times how long the braid has been still.
    fn stillness(&self, recording: &Recording, state: &mut MotionState) {
        let (time, pressure) = (&recording.time, &recording.pressure);
        let mut from = 0;
        for row in 0..state.held.len() {
            let reversed = row > 0 && state.reversals[row] != state.reversals[row - 1];
            let driven = (pressure[row] - pressure[from]).abs() > self.pressure_threshold;
            if !state.held[row] || reversed || driven {
                from = row;
            }
            state.still.push(time[row] - time[from]);
        }
    }

    /// Marks where the pressure has left the level at which a hold began. A ramp begins before it has passed the threshold by which it is
    /// found: back to where the pressure left its level, even while the muscle still moved.
    fn ramps(&self, recording: &Recording, state: &mut MotionState) {
        let pressure = &recording.pressure;
        let n = state.held.len();
        state.ramped = vec![false; n];
        let margin = margin(&recording.time);
        for run in runs(&state.held) {
            let level = pressure[run.start];
            let left = |i: &usize| (pressure[*i] - level).abs() > self.pressure_threshold;
            let Some(first) = run.clone().find(left).filter(|_| state.held[run.start]) else { continue };
            let earliest = run.start.saturating_sub(2 * margin);
            let before = median(&mut pressure[earliest..=run.start.saturating_sub(margin)].to_vec());
            let begun = (earliest..first)
                .rev()
                .find(|i| (pressure[*i] - before).abs() <= RAMP_NOISE * self.pressure_noise)
                .map_or(earliest, |i| i + 1);
            state.ramped[begun..(run.end + margin).min(n)].fill(true);
        }
    }

    /// Marks the ramps on which friction has turned, as long as the pressure keeps its way.
    fn steady_ramps(&self, recording: &Recording, pressure_rate: &[f64], state: &mut MotionState) {
        let (time, pressure) = (&recording.time, &recording.pressure);
        let n = state.held.len();
        state.on_ramp = vec![false; n];
        let mut reversal = 0;
        for row in 1..n.min(pressure_rate.len()) {
            let direction = f64::from(self.direction[row]);
            let goes_on = state.ramped[row]
                && state.ramped[row - 1]
                && self.direction[row] == self.direction[row - 1]
                && state.reversals[row] == state.reversals[row - 1];
            if !goes_on {
                reversal = row;
            }
            let (passed, gone) =
                (time[row] - time[reversal], (pressure[row] - pressure[reversal]) * direction);
            let steady = pressure_rate[row] * direction > RAMP_STEADY * gone / passed.max(f64::MIN_POSITIVE);
            state.on_ramp[row] = state.ramped[row]
                && state.held[row]
                && passed > RAMP_SETTLES
                && gone > self.pressure_threshold
                && steady;
        }
    }
}

/// Stretches of equal values.
fn runs(flags: &[bool]) -> Vec<Range<usize>> {
    let mut from = 0;
    let run = |part: &[bool]| {
        let range = from..from + part.len();
        from = range.end;
        range
    };
    flags.chunk_by(|a, b| a == b).map(run).collect()
}

/// By how many samples a ramp may begin before, and end after, its hold.
fn margin(time: &[f64]) -> usize {
    let (least, most) = RAMP_MARGIN_SAMPLES;
    match (time.first(), time.last()) {
        (Some(first), Some(last)) if last > first => {
            let samples = RAMP_MARGIN * time.len() as f64 / (last - first);
            (samples.min(most as f64) as usize).max(least)
        }
        _ => least,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Rates, tests::Noise};
    use super::*;

    /// A recording at 10 Hz.
    fn recording(stroke: Vec<f64>, pressure: Vec<f64>) -> Recording {
        let time = (0..stroke.len()).map(|i| i as f64 * 0.1).collect();
        Recording { time, stroke, pressure, ..Recording::default() }
    }

    fn state_of(recording: &Recording) -> (Motion, MotionState) {
        let motion = Motion::of(recording);
        let state = motion.state(recording, &Rates::of(recording, &motion).pressure_rate);
        (motion, state)
    }

    #[test]
    fn a_noisy_triangle_with_dwells_turns_where_it_turns() {
        // 1 mm/s, 20 mm up, 10 s rest, 20 mm down, 10 s rest, three times; 10 µm noise.
        let mut noise = Noise(5);
        let (mut stroke, mut truth) = (vec![], vec![]);
        let mut x = 0.0;
        for k in 0..1800 {
            let (v, s) = match k % 600 {
                0..200 => (1e-3, 1),
                200..300 => (0.0, 1),
                300..500 => (-1e-3, -1),
                _ => (0.0, -1),
            };
            stroke.push(x + 1e-5 * noise.normal());
            truth.push(s);
            x += v * 0.1;
        }
        let recording = recording(stroke, vec![300e3; 1800]);
        let (motion, state) = state_of(&recording);
        let wrong = |i: &usize| state.sure[*i] && motion.direction[*i] != truth[*i];
        assert_eq!((0..1800).filter(wrong).count(), 0, "a wrong direction that counts as known");
        let unsure = state.sure.iter().filter(|s| !**s).count();
        assert!(unsure < 40, "{unsure} samples of 1800 are in doubt");
        assert!(state.held[250] && state.held[550] && !state.held[100] && !state.held[400]);
        let rates = Rates::of(&recording, &motion);
        assert!((rates.speed[100] - 1e-3).abs() < 3e-5 && rates.speed[250] == 0.0);
        assert!((motion.columns(&recording).hold_time[400] - 10.0).abs() < 1.0);
    }

    #[test]
    fn before_the_pressure_moves_at_held_length_nothing_is_known() {
        let pressure =
            (0..900).map(|i| if i < 100 { 1e5 } else { 1e5 + 1e3 * (400.0 - (f64::from(i) - 500.0).abs()) });
        let (motion, state) = state_of(&recording(vec![0.01; 900], pressure.collect()));
        assert_eq!((motion.direction[50], motion.direction[300], motion.direction[700]), (0, 1, -1));
        assert!(motion.is_isometric && state.held.iter().all(|h| *h));
        assert!(state.sure[..100].iter().all(|s| !s), "an unknown direction is in doubt");
    }

    /// Up 4 mm at 2 mm/s, held while the pressure falls by 400 kPa within 80 s and, if it `returns`, rises again; then 3.6 mm on or
    /// back. Readings of the stroke have 2 µm of noise.
    fn after_ramps(seed: u64, returns: bool, on: f64) -> Recording {
        let mut noise = Noise(seed);
        let path = |t: f64| 2e-3 * (t.min(2.0) + on * (t - 187.0).max(0.0));
        let ramps = |t: f64| if returns { (t - 85.0).abs().min(80.0) } else { (t - 5.0).clamp(0.0, 80.0) };
        let empty = |t: f64| if returns { 80.0 - ramps(t) } else { ramps(t) };
        let times = || (0..1900).map(|i| f64::from(i) * 0.1);
        let stroke = times().map(|t| path(t) + 2e-6 * noise.normal()).collect();
        recording(stroke, times().map(|t| 500e3 - 5e3 * empty(t)).collect())
    }

    #[test]
    fn the_stroke_after_ramps_of_pressure_has_its_own_direction() {
        for seed in 0..20 {
            for (returns, on) in [(true, -1), (false, 1), (false, -1), (true, 1)] {
                let (motion, state) = state_of(&after_ramps(seed, returns, f64::from(on)));
                let ramped = if returns { 1 } else { -1 };
                assert_eq!(motion.direction[1600], ramped, "seed {seed}: by the pressure, at held length");
                let wrong = (1871..1900).filter(|i| state.sure[*i] && motion.direction[*i] != on).count();
                assert_eq!(wrong, 0, "seed {seed}, on {on} after {ramped}: a wrong direction");
                assert!((1871..1900).filter(|i| state.sure[*i]).count() > 20);
            }
        }
    }

    #[test]
    fn a_length_that_creeps_under_a_ramp_is_held() {
        // Up 2 mm and, after 160 s, 2 mm more, each within a second. Meanwhile the pressure falls for 80 s and rises again. The frame
        // yields by 70 µm with the force, or by a quarter of it. Then all the way back, and once more.
        for creep in [7e-5, 1.8e-5] {
            let mut noise = Noise(3);
            let period = 500.0;
            let ramped = |t: f64| (1.0 - (t - 85.0).abs() / 80.0).max(0.0);
            let path =
                |t: f64| 2e-3 * (t.min(1.0) + (t - 180.0).clamp(0.0, 1.0) - (t - 200.0).clamp(0.0, 2.0));
            let at = |t: f64| path(t % period) - creep * ramped(t % period);
            let times = || (0..10_000).map(|i| f64::from(i) * 0.1);
            let stroke = times().map(|t| at(t) + 5e-6 * noise.normal()).collect();
            let pressure = times().map(|t| 500e3 - 400e3 * ramped(t % period)).collect();
            let (motion, state) = state_of(&recording(stroke, pressure));
            for cycle in [0, 5000] {
                let held = state.held[cycle + 50..cycle + 1750].iter().filter(|h| **h).count();
                assert!(held > 1650, "creep {creep}: {held} of 1700 samples are held");
                assert!(
                    motion.direction[cycle + 100..cycle + 800].iter().all(|d| *d == -1),
                    "while it falls"
                );
                assert!(
                    motion.direction[cycle + 900..cycle + 1600].iter().all(|d| *d == 1),
                    "while it rises"
                );
            }
        }
    }

    #[test]
    fn a_ramp_is_marked_from_where_the_pressure_left_and_judged_once_friction_has_turned() {
        // 10 s of stroke at 400 kPa; the pressure falls by 10 kPa/s for 20 s, begun half a second before the muscle stood.
        let mut noise = Noise(11);
        let times = || (0..500).map(|i| f64::from(i) * 0.1);
        let stroke = times().map(|t| 1e-3 * t.min(10.0) + 1e-6 * noise.normal()).collect();
        let mut noise = Noise(12);
        let pressure =
            times().map(|t| 400e3 - 10e3 * (t - 9.5).clamp(0.0, 20.0) + 20.0 * noise.normal()).collect();
        let (motion, state) = state_of(&recording(stroke, pressure));
        assert!(
            state.ramped[97..].iter().all(|r| *r),
            "from where the pressure left, while the muscle moved"
        );
        assert!(state.ramped[..80].iter().all(|r| !*r));
        let judged: Vec<usize> = (0..500).filter(|i| state.on_ramp[*i]).collect();
        assert!((120..150).contains(&judged[0]), "from sample {}", judged[0]);
        let last = judged[judged.len() - 1];
        assert!((285..300).contains(&last), "to {last}: where the pressure stands again nothing is known");
        assert!(judged.iter().all(|i| motion.direction[*i] == -1));
    }

    #[test]
    fn a_rest_keeps_its_direction_up_to_its_end() {
        // 10 s of rest between strokes of 1 mm/s: only the samples beside the two reversals are in doubt, not the rest.
        let stroke = (0..600).map(|i| match i % 300 {
            0..100 => 1e-4 * f64::from(i % 300),
            100..200 => 1e-2,
            _ => 1e-2 - 1e-4 * f64::from(i % 300 - 200),
        });
        let (_, state) = state_of(&recording(stroke.collect(), vec![3e5; 600]));
        assert!(state.sure[105..195].iter().all(|s| *s), "a rest of known direction");
    }
}
