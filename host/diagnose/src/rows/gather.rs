//! Samples become rows: averages that end at every reversal, hold and ramp.

use model_core::braid::Braid;
use model_core::effects::Context;
use model_core::units::Length;

use super::readings;
use super::sleeve::{self, Shape};
use crate::criteria::baseline::TABLE_ORDER;
use crate::criteria::rows::TARGET_ROWS;
use crate::kinematics::{Kinematics, Recorded, Thresholds, kinematics};
use pam_data::error::Result;
use pam_data::recording::dropouts::Screened;
use pam_data::recording::{Campaign, Recording, UNKNOWN_PAUSE};
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
}

/// Averages all recordings of a campaign into rows.
///
/// # Errors
/// A recording without force.
pub(super) fn gather(
    campaign: &Campaign,
    screened: &Screened<'_>,
    braid: &Braid<f64>,
    thresholds: Thresholds,
    ends: &[Clip],
    isometric: bool,
) -> Result<Gathered> {
    let total = campaign.samples();
    let mut gathering = Gathering {
        rows: Gathered { has_temperature: total > 0, ..Gathered::default() },
        braid,
        thresholds,
        ends,
        isometric,
        per_row: total.div_ceil(TARGET_ROWS).max(1),
        clock: campaign.beginning(),
        turns: 0,
        pieces: 0,
        largest: f64::NEG_INFINITY,
    };
    for (index, recording) in campaign.recordings.iter().enumerate() {
        gathering.add(recording, &screened.read(index), campaign.pause_before(index))?;
    }
    Ok(gathering.rows)
}

/// A campaign's recordings on their way into rows.
struct Gathering<'a> {
    rows: Gathered,
    braid: &'a Braid<f64>,
    thresholds: Thresholds,
    ends: &'a [Clip],
    isometric: bool,
    /// Samples in a row at most.
    per_row: usize,
    /// The campaign's time at the beginning of the present recording, s.
    clock: f64,
    /// Turns of the recordings so far.
    turns: u32,
    /// Half-strokes so far.
    pieces: u32,
    /// The largest stroke so far, m.
    largest: f64,
}

/// Sums over the samples of a row, then their means.
#[derive(Clone, Copy, Default)]
struct Average {
    time: f64,
    pressure: f64,
    stroke: f64,
    speed: f64,
    acceleration: f64,
    pressure_rate: f64,
    travel: f64,
    since_reversal: f64,
    hold_time: f64,
    temperature: f64,
    still: f64,
    /// Force of the good readings, N, and their number.
    force: f64,
    good: f64,
}

/// The readings of a recording's force, whether each stands out alone, and whether the pressure beside it was read.
#[derive(Clone, Copy)]
struct Readings<'a> {
    force: &'a [f64],
    spike: &'a [bool],
    read: &'a [bool],
}

impl Gathering<'_> {
    /// Appends a recording, `pause` seconds after the one before where that is known. Samples whose pressure was not `read` do not count.
    ///
    /// # Errors
    /// A recording without force.
    fn add(&mut self, recording: &Recording, read: &[bool], pause: Option<f64>) -> Result<()> {
        let first = self.rows.names.is_empty();
        self.rows.names.push(recording.title());
        let force = recording.require_force()?;
        if recording.is_empty() {
            return Ok(());
        }
        self.rows.has_temperature &= recording.temperature.is_some();
        let before = pause.unwrap_or(UNKNOWN_PAUSE);
        let recorded = Recorded {
            time: &recording.time,
            stroke: &recording.stroke,
            pressure: &recording.pressure,
            given: recording.direction.as_deref(),
        };
        let k = kinematics(recorded, before, self.thresholds);
        let spike = readings::spikes(force);
        let readings = Readings { force, spike: &spike, read };
        let pause = if first { 0.0 } else { before };
        self.clock += pause;
        let start = recording.time[0];
        let mut previous: Option<f64> = None;
        let mut piece = None;
        let mut i = 0;
        while i < recording.len() {
            let j = self.row_end(&k, i);
            if piece != Some(k.piece[i]) {
                piece = Some(k.piece[i]);
                self.pieces += 1;
            }
            let mean = self.average(recording, &readings, &k, i..j);
            let dt = previous.map_or(pause, |p| mean.time - p);
            previous = Some(mean.time);
            self.push(&mean, &k, i, mean.time - start, dt);
            self.rows.cycle.push(recording.cycle.as_ref().map_or(0, |c| c[i]));
            i = j;
        }
        self.turns += k.turns.last().copied().unwrap_or(0) + 1;
        self.clock += recording.duration();
        Ok(())
    }

    /// Where the row that begins at a sample ends: before the next turn, hold or ramp, or when it is full.
    fn row_end(&self, k: &Kinematics, i: usize) -> usize {
        let alike = |j: usize| {
            k.piece[j] == k.piece[i]
                && k.sure[j] == k.sure[i]
                && k.ramped[j] == k.ramped[i]
                && k.on_ramp[j] == k.on_ramp[i]
                && k.turns[j] == k.turns[i]
        };
        let full = (i + self.per_row).min(k.piece.len());
        (i + 1..full).find(|j| !alike(*j)).unwrap_or(full)
    }

    fn average(
        &mut self,
        recording: &Recording,
        readings: &Readings<'_>,
        k: &Kinematics,
        samples: std::ops::Range<usize>,
    ) -> Average {
        let count = samples.len() as f64;
        let mean = |column: &[f64]| column[samples.clone()].iter().sum::<f64>() / count;
        let mut average = Average {
            time: mean(&recording.time),
            pressure: mean(&recording.pressure),
            stroke: mean(&recording.stroke),
            speed: mean(&k.speed),
            acceleration: mean(&k.acceleration),
            pressure_rate: mean(&k.pressure_rate),
            travel: mean(&k.travel),
            since_reversal: mean(&k.since_reversal),
            hold_time: mean(&k.hold_time),
            temperature: recording.temperature.as_deref().map_or(0.0, mean),
            still: mean(&k.still),
            ..Average::default()
        };
        let Readings { force, spike, read } = *readings;
        for j in samples.clone() {
            if !read[j] {
                continue;
            }
            if spike[j] {
                self.rows.spiked += 1;
            } else if self.ends.iter().all(|end| force[j] != end.force) {
                average.force += force[j];
                average.good += 1.0;
            }
        }
        if average.good > 0.0 {
            average.force /= average.good;
        } else if !read[samples.start] {
            // It has no weight, but effects that follow the force must not see a jump.
            average.force = mean(force);
        }
        average
    }

    /// Appends a row that begins at sample `i` of its recording, at `local` seconds of it.
    fn push(&mut self, mean: &Average, k: &Kinematics, i: usize, local: f64, dt: f64) {
        let Self { rows, braid, .. } = self;
        let posture = braid.posture(Length::from_metres(mean.stroke));
        self.largest = mean.stroke.max(self.largest);
        rows.contexts.push(Context {
            dt: if rows.contexts.is_empty() { 0.0 } else { dt },
            time: self.clock + local,
            pressure: mean.pressure,
            pressure_rate: mean.pressure_rate,
            stroke: mean.stroke,
            contraction: mean.stroke / braid.rest_length(),
            speed: mean.speed,
            acceleration: mean.acceleration,
            direction: k.direction[i],
            travel: mean.travel,
            since_reversal: mean.since_reversal,
            hold_time: mean.hold_time,
            resting: if k.held[i] || i == 0 { 1.0 } else { 0.0 },
            cycles: f64::from(self.turns + k.turns[i]) * 0.5,
            temperature: mean.temperature,
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
        rows.shapes.push(sleeve::shape(braid, mean.stroke));
        rows.force.push(mean.force);
        // Just after a reversal of the pressure at held length the model only estimates how far friction has reversed; where the muscle
        // also moves, its strokes and what ramps are steady are what is judged.
        let on_ramp = k.on_ramp[i] && !self.isometric;
        let judged = k.sure[i] && (self.isometric || !k.ramped[i] || on_ramp);
        rows.on_ramp.push(on_ramp);
        let read = (mean.good / self.per_row as f64).sqrt();
        rows.readable.push(if k.held[i] { read } else { 0.0 });
        rows.judged.push(if judged { read } else { 0.0 });
        rows.recording.push(rows.names.len() as u32 - 1);
        rows.piece.push(self.pieces);
        rows.sign.push(k.direction[i]);
        rows.still.push(mean.still);
        rows.largest.push(self.largest / braid.rest_length());
        rows.local_time.push(local);
    }
}
