//! Samples become rows: averages that end at every reversal, hold and ramp.

use model_core::braid::Braid;
use model_core::effects::Context;
use model_core::motion::Motion as MotionSample;
use model_core::units::Length;

use super::readings;
use super::sensor_noise::{smoothed_pressure, smoothed_stroke};
use super::sleeve::{self, Shape};
use crate::criteria::baseline::TABLE_ORDER;
use crate::criteria::rows::{TARGET_ROWS, TURN_SAMPLES, TURNED_BACK};
use crate::valve_pulses;
use pam_data::error::Result;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::motion::{Cause, Motion, MotionState};
use pam_data::recording::{Campaign, Follower, Recording};
use pam_fit::Clip;

/// The rows of a campaign before levels, blocks and weights are known.
#[derive(Default)]
pub(super) struct Gathered {
    pub contexts: Vec<Context<f64>>,
    pub shapes: Vec<Shape>,
    pub force: Vec<f64>,
    /// The weight of each row's reading where its direction is known; zero elsewhere.
    pub judged: Vec<f64>,
    /// The weight of each row's reading where friction does not matter.
    pub readable: Vec<f64>,
    pub on_ramp: Vec<bool>,
    pub recording: Vec<u32>,
    /// Half-stroke or hold of each row, counted over the campaign.
    pub piece: Vec<u32>,
    /// Cycle as the recording numbers it; zero where it does not.
    pub cycle: Vec<u32>,
    pub sign: Vec<f64>,
    pub still: Vec<f64>,
    pub largest: Vec<f64>,
    pub local_time: Vec<f64>,
    pub names: Vec<String>,
    pub has_temperature: bool,
    /// Outliers among the readings.
    pub spiked: usize,
    /// Readings set aside because a valve's pulse still rings.
    pub ringing: usize,
}

/// Averages all recordings of a campaign into rows.
///
/// # Errors
/// A recording without force.
pub(super) fn gather(
    campaign: &Campaign,
    screened: &Screened<'_>,
    motions: &[Motion],
    corrected: bool,
    braid: &Braid<f64>,
    ends: &[Clip],
) -> Result<Gathered> {
    let total = campaign.samples();
    let mut gathering = Gathering {
        rows: Gathered { has_temperature: total > 0, ..Gathered::default() },
        braid,
        ends,
        isometric: motions.iter().all(|m| m.is_isometric),
        corrected,
        per_row: total.div_ceil(TARGET_ROWS).max(1),
        follower: Follower::of(campaign),
        pieces: 0,
        largest: f64::NEG_INFINITY,
    };
    for (index, (recording, motion)) in campaign.recordings.iter().zip(motions).enumerate() {
        gathering.add(recording, motion, &screened.read(index), campaign.pause_before(index))?;
    }
    Ok(gathering.rows)
}

/// A campaign's recordings on their way into rows.
struct Gathering<'a> {
    rows: Gathered,
    braid: &'a Braid<f64>,
    ends: &'a [Clip],
    isometric: bool,
    /// Whether the stroke is corrected for a frame that gives, and the motion that of the frame.
    corrected: bool,
    /// Samples in a row at most.
    per_row: usize,
    /// The motion as predictions see it, sample by sample.
    follower: Follower,
    /// Half-strokes so far.
    pieces: u32,
    /// The largest stroke so far, m.
    largest: f64,
}

/// Means over the samples of a row.
#[derive(Clone, Copy, Default)]
struct Average {
    motion: MotionSample<f64>,
    /// Time within the recording, s.
    local: f64,
    pressure: f64,
    still: f64,
    /// Force of the good readings, N, and their number.
    force: f64,
    good: f64,
}

/// The motion of a recording, the state of each of its samples, and which ring after a pulse of a valve.
#[derive(Clone, Copy)]
struct Moved<'a> {
    samples: &'a [MotionSample<f64>],
    state: &'a MotionState,
    ringing: &'a [bool],
}

/// The readings of a recording's force, pressure and stroke without the noise of their sensors, whether each force stands out alone, and whether the
/// pressure beside it was read.
#[derive(Clone, Copy)]
struct Readings<'a> {
    pressure: &'a [f64],
    stroke: &'a [f64],
    force: &'a [f64],
    spike: &'a [bool],
    read: &'a [bool],
}

/// A frame that gives takes a reversal before the muscle does: until that has come back from where it was, its direction is in doubt.
fn doubt_until_the_muscle_turns(state: &mut MotionState, motion: &Motion, recording: &Recording) {
    let stroke = &recording.stroke;
    for reversal in motion.reversals.iter().filter(|t| t.cause == Cause::Stroke) {
        let Some(last) = reversal.index.checked_sub(1) else { continue };
        let came_back = |i: &usize| {
            (stroke[*i] - stroke[last]) * f64::from(reversal.direction)
                > TURNED_BACK * motion.stroke_threshold
        };
        let end = (reversal.index..stroke.len()).take(TURN_SAMPLES).find(came_back);
        let end = end.unwrap_or((reversal.index + TURN_SAMPLES).min(stroke.len()));
        state.sure[reversal.index..end].fill(false);
    }
}

impl Gathering<'_> {
    /// Appends a recording, `pause` seconds after the one before where that is known. Samples whose pressure was not `read` do not count.
    ///
    /// # Errors
    /// A recording without force.
    fn add(
        &mut self,
        recording: &Recording,
        motion: &Motion,
        read: &[bool],
        pause: Option<f64>,
    ) -> Result<()> {
        self.rows.names.push(recording.title());
        let force = recording.require_force()?;
        if recording.is_empty() {
            return Ok(());
        }
        self.rows.has_temperature &= recording.temperature.is_some();
        let samples = self.follower.follow(recording, motion, pause);
        let pressure_rate: Vec<f64> = samples.iter().map(|s| s.pressure_rate).collect();
        let mut state = motion.state(recording, &pressure_rate);
        if self.corrected {
            doubt_until_the_muscle_turns(&mut state, motion, recording);
        }
        // Where the muscle moves, its own motion changes the pressure as periodically as a valve.
        let ringing =
            if self.isometric { valve_pulses::ringing(recording) } else { vec![false; recording.len()] };
        self.rows.ringing += ringing.iter().filter(|r| **r).count();
        let moved = Moved { samples: &samples, state: &state, ringing: &ringing };
        let spike = readings::spikes(force);
        let pressure = smoothed_pressure(&recording.pressure, force, self.pull(&recording.stroke));
        let turns = motion.reversals.iter().filter(|t| t.cause == Cause::Stroke);
        let stroke = smoothed_stroke(&recording.stroke, &turns.map(|t| t.index).collect::<Vec<_>>());
        let readings = Readings { pressure: &pressure, stroke: &stroke, force, spike: &spike, read };
        let mut previous: Option<f64> = None;
        let mut piece = None;
        let mut i = 0;
        while i < recording.len() {
            let j = self.row_end(moved, i);
            if piece != Some(state.piece[i]) {
                piece = Some(state.piece[i]);
                self.pieces += 1;
            }
            let mut mean = self.average(recording, &readings, moved, i..j);
            // The pause before the recording counts for its first row.
            mean.motion.dt = previous.map_or(samples[i].dt, |p| mean.motion.time - p);
            previous = Some(mean.motion.time);
            self.push(&mean, moved, i);
            self.rows.cycle.push(recording.cycle.as_ref().map_or(0, |c| c[i]));
            i = j;
        }
        Ok(())
    }

    /// Force per pressure at the middle of these strokes, m².
    fn pull(&self, stroke: &[f64]) -> f64 {
        let middle = stroke.iter().sum::<f64>() / stroke.len() as f64;
        self.braid.posture(Length::from_metres(middle)).area
    }

    /// Where the row that begins at a sample ends: before the next reversal, hold or ramp, where a ring begins or ends, or when it is full.
    fn row_end(&self, moved: Moved<'_>, i: usize) -> usize {
        let Moved { state, ringing, .. } = moved;
        let alike = |j: usize| {
            state.piece[j] == state.piece[i]
                && state.sure[j] == state.sure[i]
                && state.ramped[j] == state.ramped[i]
                && state.on_ramp[j] == state.on_ramp[i]
                && state.reversals[j] == state.reversals[i]
                && ringing[j] == ringing[i]
        };
        // One row is enough for what is set aside; memory effects see its mean.
        let full = if ringing[i] { state.piece.len() } else { (i + self.per_row).min(state.piece.len()) };
        (i + 1..full).find(|j| !alike(*j)).unwrap_or(full)
    }

    fn average(
        &mut self,
        recording: &Recording,
        readings: &Readings<'_>,
        moved: Moved<'_>,
        samples: std::ops::Range<usize>,
    ) -> Average {
        let Readings { pressure, stroke, force, spike, read } = *readings;
        let good = |j: &usize| read[*j] && !spike[*j] && self.ends.iter().all(|end| force[*j] != end.force);
        let spiked = samples.clone().filter(|j| read[*j] && spike[*j] && !moved.ringing[*j]).count();
        let mut taken: Vec<usize> = samples.clone().filter(good).collect();
        let count = taken.len() as f64;
        // Pressure, stroke and force are those of the same samples: in fast motion a sample more on one side is an error of force.
        if taken.is_empty() {
            taken.extend(samples.clone());
        }
        self.rows.spiked += spiked;
        let mean = |column: &[f64]| taken.iter().map(|j| column[*j]).sum::<f64>() / taken.len() as f64;
        let of = |value: fn(&MotionSample<f64>) -> f64| {
            taken.iter().map(|j| value(&moved.samples[*j])).sum::<f64>() / taken.len() as f64
        };
        let first = moved.samples[samples.start];
        let force = if count > 0.0 || !read[samples.start] {
            // Without a good reading it has no weight, but effects that follow the force must not see a jump.
            mean(force)
        } else {
            0.0
        };
        Average {
            motion: MotionSample {
                time: of(|m| m.time),
                stroke: mean(stroke),
                speed: of(|m| m.speed),
                acceleration: of(|m| m.acceleration),
                pressure_rate: of(|m| m.pressure_rate),
                travel: of(|m| m.travel),
                since_reversal: of(|m| m.since_reversal),
                hold_time: of(|m| m.hold_time),
                temperature: of(|m| m.temperature),
                ..first
            },
            local: mean(&recording.time) - recording.time[0],
            pressure: mean(pressure),
            still: mean(&moved.state.still),
            force,
            good: count,
        }
    }

    /// Appends a row that begins at sample `i` of its recording.
    fn push(&mut self, mean: &Average, moved: Moved<'_>, i: usize) {
        let Self { rows, braid, .. } = self;
        let Moved { state, ringing, .. } = moved;
        let motion = &mean.motion;
        let posture = braid.posture(Length::from_metres(motion.stroke));
        self.largest = motion.stroke.max(self.largest);
        rows.contexts.push(Context {
            dt: if rows.contexts.is_empty() { 0.0 } else { motion.dt },
            time: motion.time,
            pressure: mean.pressure,
            pressure_rate: motion.pressure_rate,
            stroke: motion.stroke,
            contraction: motion.stroke / braid.rest_length(),
            speed: motion.speed,
            acceleration: motion.acceleration,
            direction: motion.direction,
            travel: motion.travel,
            since_reversal: motion.since_reversal,
            hold_time: motion.hold_time,
            resting: motion.resting,
            cycles: motion.cycles,
            temperature: motion.temperature,
            rest_length: braid.rest_length(),
            radius: posture.radius,
            rest_radius: braid.rest_radius(),
            radial_strain: posture.radial_strain,
            axial_strain: posture.axial_strain,
            axial_area: posture.axial_area,
            hoop_area: posture.hoop_area,
            area: posture.area,
            length: posture.length,
            fibre_length: braid.fibre_length(),
            turns: braid.turns(),
            order: TABLE_ORDER as f64,
            ..Context::default()
        });
        rows.shapes.push(sleeve::shape(braid, motion.stroke));
        rows.force.push(mean.force);
        // Just after a reversal of the pressure at held length the model only estimates how far friction has reversed; where the muscle
        // also moves, its strokes and what ramps are steady are what is judged.
        let on_ramp = state.on_ramp[i] && !self.isometric;
        let judged = state.sure[i] && !ringing[i] && (self.isometric || !state.ramped[i] || on_ramp);
        rows.on_ramp.push(on_ramp);
        let read = (mean.good / self.per_row as f64).sqrt();
        rows.readable.push(if state.held[i] && !ringing[i] { read } else { 0.0 });
        rows.judged.push(if judged { read } else { 0.0 });
        rows.recording.push(rows.names.len() as u32 - 1);
        rows.piece.push(self.pieces);
        rows.sign.push(motion.direction);
        rows.still.push(mean.still);
        rows.largest.push(self.largest / braid.rest_length());
        rows.local_time.push(mean.local);
    }
}

#[cfg(test)]
mod tests {
    use pam_data::recording::{Campaign, Recording};

    /// N per m.
    fn slope() -> f64 {
        48e3
    }

    /// Strokes of 17 readings each way, 26 mm, in a campaign so long that a row holds two readings; every 97th force is an outlier.
    fn fast_strokes() -> Campaign {
        let n = 30_000;
        let stroke: Vec<f64> =
            (0..n).map(|i: i32| f64::from(17 - (i % 34 - 17).abs()) * 26e-3 / 17.0).collect();
        let ripple = |i: usize| ((i * 7 % 13) as f64 - 6.0) / 6.0;
        let force = |(i, x): (usize, &f64)| {
            let outlier = if i % 97 == 50 { 400.0 } else { 0.0 };
            1300.0 - slope() * x + 0.5 * ripple(i) + outlier
        };
        Campaign::new(vec![Recording {
            time: (0..n).map(|i| 0.1 * f64::from(i)).collect(),
            pressure: (0..stroke.len()).map(|i| 490e3 + 50.0 * ripple(5 * i)).collect(),
            force: Some(stroke.iter().enumerate().map(force).collect()),
            stroke,
            ..Recording::default()
        }])
    }

    #[test]
    fn force_and_stroke_of_a_row_are_of_the_same_readings() {
        let braid = crate::tests::geometry().build().expect("a braid");
        let (rows, _) = crate::rows::prepare(&fast_strokes(), &braid).expect("rows");
        let mut judged = 0;
        for (i, context) in rows.contexts().iter().enumerate().filter(|(i, _)| rows.root_weight()[*i] > 0.0) {
            let error = rows.force[i] - (1300.0 - slope() * context.stroke);
            assert!(error.abs() < 3.0, "row {i} at {:.1} mm: {error:.1} N", context.stroke * 1e3);
            judged += 1;
        }
        assert!(judged > 10_000, "{judged}");
    }
}
