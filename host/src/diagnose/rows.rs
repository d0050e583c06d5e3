//! The rows that everything else works on: block averages of the recordings that keep turns, with the motion in each.

use std::ops::Range;
use std::sync::Arc;

use model_core::braid::Braid;
use model_core::effects::Context;
use model_core::units::Length;

use super::kinematics::{Thresholds, kinematics, white_noise};
use super::linear::{median, quantile};
use crate::counted::counted;
use crate::error::Result;
use crate::fit::screen::{self, Clip};
use crate::progress::Progress;
use crate::recording::{Campaign, UNKNOWN_PAUSE};

/// Rows aimed at: enough for every reversal, few enough for seconds.
pub(crate) const TARGET_ROWS: usize = 24_000;
/// The highest elastic order that is ever offered.
pub(crate) const ORDERS: usize = 6;
/// Columns of a hyperelastic (Yeoh) wall.
pub(crate) const YEOH: usize = 3;

/// What a force of the model is made of at a row's length, and how it changes with the stroke.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shape {
    /// `g = ∂F_G/∂P`, m².
    pub area: f64,
    /// `∂g/∂(ΔL)`, m.
    pub area_slope: f64,
    /// `c_k`, m².
    pub elastic: [f64; ORDERS],
    /// `∂c_k/∂(ΔL)`, m.
    pub elastic_slope: [f64; ORDERS],
    /// The same of a Yeoh wall at its middle surface, m².
    pub yeoh: [f64; YEOH],
    /// `∂/∂(ΔL)` of these, m.
    pub yeoh_slope: [f64; YEOH],
}

/// All recordings of a campaign as one sequence of rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    /// Who watches how far the work on them has come.
    pub progress: Arc<Progress>,
    /// Motion and geometry of each row; the base model's parts are filled in by a fitted baseline.
    pub contexts: Vec<Context<f64>>,
    /// The sleeve at each row.
    pub shapes: Vec<Shape>,
    /// Measured force, N.
    pub force: Vec<f64>,
    /// Square root of each row's weight; zero where the direction is in doubt or the muscle is slack.
    pub root_weight: Vec<f64>,
    /// Whether the muscle was vented: the model's force is zero there, what is read is the bench's.
    pub vented: Vec<bool>,
    /// Which recording a row belongs to.
    pub recording: Vec<u32>,
    /// Half-stroke block of each row, counted over the campaign.
    pub block: Vec<u32>,
    /// Cycle within its pressure level (or as the recording numbers it), from 1.
    pub cycle: Vec<u32>,
    /// Pressure level of a row; an index into `levels`.
    pub level: Vec<u32>,
    /// Mean pressure of each level, Pa, increasing.
    pub levels: Vec<f64>,
    /// Whether the levels are pressures at which the muscle was worked (else they are places on the pressure's range).
    pub steady: bool,
    /// Which way the muscle moved last: the sign behind `direction`, which fades while friction settles.
    pub sign: Vec<f64>,
    /// Time since the braid last moved, s.
    pub still: Vec<f64>,
    /// How a settling of friction at rest departs from an exponential; all zeros where it does not settle.
    pub settling: Vec<f64>,
    /// At rest, the direction that the model holds less the one that friction was found to have settled to; zero elsewhere.
    pub unsettled: Vec<f64>,
    /// Number of the stretch of a hold over which friction rests somewhere in its gap, nobody knows where; zero elsewhere.
    pub rest: Vec<u32>,
    /// Whether the pressure ramps at held length, where friction turns by a share that is fitted.
    pub on_ramp: Vec<bool>,
    /// Largest contraction so far in the campaign.
    pub largest: Vec<f64>,
    /// Time within the recording, s.
    pub local_time: Vec<f64>,
    /// Number of blocks.
    pub blocks: usize,
    /// Recording names.
    pub names: Vec<String>,
    /// Raw samples behind the rows.
    pub samples: usize,
    /// Things worth saying about the data.
    pub remarks: Vec<String>,
    /// Whether temperature was measured throughout.
    pub has_temperature: bool,
    /// Whether the length never moved.
    pub isometric: bool,
}

impl Rows {
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.force.len()
    }
    /// Rows that count.
    pub(crate) fn effective(&self) -> usize {
        self.root_weight.iter().filter(|w| **w > 0.0).count()
    }
}

/// The sleeve at one stroke.
pub(crate) fn shape(braid: &Braid<f64>, stroke: f64) -> Shape {
    let h = braid.rest_length() * 1e-4;
    let at = |x: f64| {
        let p = braid.posture(Length::from_metres(x));
        (p.area, p.elastic_columns::<ORDERS>(), yeoh(braid, x))
    };
    let (area, elastic, yeoh_here) = at(stroke);
    let (a0, e0, y0) = at(stroke - h);
    let (a1, e1, y1) = at(stroke + h);
    Shape {
        area,
        area_slope: (a1 - a0) / (2.0 * h),
        elastic,
        elastic_slope: std::array::from_fn(|k| (e1[k] - e0[k]) / (2.0 * h)),
        yeoh: yeoh_here,
        yeoh_slope: std::array::from_fn(|k| (y1[k] - y0[k]) / (2.0 * h)),
    }
}

/// Force per coefficient of a Yeoh wall, `−V_B d/dL (I1 − 3)^i`, with the stretches at the middle of the wall
/// (O. H. Yeoh, Rubber Chemistry and Technology 66 (1993) 754–771).
fn yeoh(braid: &Braid<f64>, stroke: f64) -> [f64; YEOH] {
    let invariant = |x: f64| {
        let p = braid.posture(Length::from_metres(x));
        let rest = braid.posture(Length::from_metres(0.0));
        let axial = (p.length / rest.length).max(1e-3);
        let hoop = ((p.radius - p.wall / 2.0) / (rest.radius - rest.wall / 2.0)).max(1e-3);
        axial * axial + hoop * hoop + 1.0 / (axial * axial * hoop * hoop) - 3.0
    };
    let h = braid.rest_length() * 1e-4;
    let i = invariant(stroke);
    // d/dL = −d/d(ΔL).
    let slope = -(invariant(stroke + h) - invariant(stroke - h)) / (2.0 * h);
    std::array::from_fn(|k| -braid.bladder_volume() * (k as f64 + 1.0) * i.max(0.0).powi(k as i32) * slope)
}

/// Isolated spikes of a series: rows that stand out from the middle of their five neighbours by more than noise can.
fn spikes(series: &[f64]) -> Vec<bool> {
    let n = series.len();
    let noise = white_noise(series);
    let (lo, hi) = series.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let limit = (9.0 * noise).max(0.004 * (hi - lo));
    (0..n)
        .map(|i| {
            if i < 2 || i + 3 > n || !(limit > 0.0) {
                return false;
            }
            let mut five = [series[i - 2], series[i - 1], series[i], series[i + 1], series[i + 2]];
            five.sort_unstable_by(f64::total_cmp);
            (series[i] - five[2]).abs() > limit
        })
        .collect()
}

/// A reading that is repeated as an end of the sensor's range is under load beyond this share of the largest.
const END_UNDER_LOAD: f64 = 0.02;

/// Prepares a campaign. The result depends on the data alone.
///
/// # Errors
/// A recording without force.
pub(crate) fn prepare(campaign: &Campaign, braid: &Braid<f64>) -> Result<Rows> {
    let range = |column: &dyn Fn(&crate::recording::Recording) -> Vec<f64>| {
        let mut all: Vec<f64> = campaign.recordings.iter().flat_map(column).collect();
        (quantile(&mut all, 0.002), quantile(&mut all, 0.998))
    };
    let strokes = range(&|r| r.stroke.clone());
    let pressures = range(&|r| r.pressure.clone());
    let stroke_noise = campaign.recordings.iter().map(|r| white_noise(&r.stroke)).fold(0.0, f64::max);
    let pressure_noise = campaign.recordings.iter().map(|r| white_noise(&r.pressure)).fold(0.0, f64::max);
    let thresholds = Thresholds {
        stroke: (8.0 * stroke_noise)
            .max(0.004 * (strokes.1 - strokes.0))
            .max(1e-3 * braid.rest_length() * 0.05),
        pressure: (8.0 * pressure_noise).max(0.02 * (pressures.1 - pressures.0)).max(2e3),
    };
    let total = campaign.samples();
    let per_row = total.div_ceil(TARGET_ROWS).max(1);
    let mut rows = Rows { samples: total, has_temperature: total > 0, ..Rows::default() };
    // Mounted at several lengths, but never moved while recording, is held all the same.
    rows.isometric = campaign.recordings.iter().all(|r| {
        let (low, high) =
            r.stroke.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(*s), h.max(*s)));
        !(high - low > 3.0 * thresholds.stroke.max(stroke_noise))
    });
    let mut readable: Vec<f64> = Vec::new();
    let mut clock = 0.0;
    let mut turns_before = 0_u32;
    let mut piece_number = 0_u32;
    let mut largest = f64::NEG_INFINITY;
    let mut spiked = 0;
    // A vented muscle may well read exactly nothing: only an end under load is one of the sensor's.
    let (low, high) = screen::clip(campaign);
    let strongest = campaign
        .recordings
        .iter()
        .filter_map(|r| r.force.as_deref())
        .flatten()
        .fold(0.0, |s: f64, f| s.max(f.abs()));
    let ends: Vec<Clip> =
        [low, high].into_iter().flatten().filter(|c| c.force.abs() > END_UNDER_LOAD * strongest).collect();
    for end in &ends {
        rows.remarks.push(format!(
            "left out: {} of exactly {:.2} N, where the force sensor stands at the end of its range",
            counted(end.rows, "reading"),
            end.force
        ));
    }
    for (index, recording) in campaign.recordings.iter().enumerate() {
        rows.names.push(recording.name.clone());
        let force = recording.require_force()?;
        if recording.is_empty() {
            continue;
        }
        rows.has_temperature &= recording.temperature.is_some();
        let before = campaign.pause_before(index).unwrap_or(UNKNOWN_PAUSE);
        let k = kinematics(
            &recording.time,
            &recording.stroke,
            &recording.pressure,
            recording.direction.as_deref(),
            before,
            thresholds,
        );
        let spike = spikes(force);
        let pause = if index == 0 { 0.0 } else { before };
        clock += pause;
        let start = recording.time[0];
        let mut previous_time: Option<f64> = None;
        let n = recording.len();
        let mut i = 0;
        let mut last_piece = None;
        while i < n {
            let mut j = i;
            let (mut sums, mut count, mut good) = ([0.0_f64; 11], 0.0, 0.0);
            let mut force_sum = 0.0;
            while j < n
                && j - i < per_row
                && k.piece[j] == k.piece[i]
                && k.sure[j] == k.sure[i]
                && k.ramped[j] == k.ramped[i]
                && k.on_ramp[j] == k.on_ramp[i]
                && k.turns[j] == k.turns[i]
            {
                let add = [
                    recording.time[j],
                    recording.pressure[j],
                    recording.stroke[j],
                    k.speed[j],
                    k.acceleration[j],
                    k.pressure_rate[j],
                    k.travel[j],
                    k.since_reversal[j],
                    k.hold_time[j],
                    recording.temperature.as_ref().map_or(0.0, |t| t[j]),
                    k.still[j],
                ];
                for (s, a) in sums.iter_mut().zip(add) {
                    *s += a;
                }
                count += 1.0;
                if spike[j] {
                    spiked += 1;
                } else if ends.iter().all(|end| force[j] != end.force) {
                    force_sum += force[j];
                    good += 1.0;
                }
                j += 1;
            }
            let mean = sums.map(|s| s / count);
            let [
                time,
                pressure,
                stroke,
                speed,
                acceleration,
                pressure_rate,
                travel,
                since,
                hold,
                temperature,
                still,
            ] = mean;
            let local = time - start;
            let dt = match previous_time {
                Some(p) => time - p,
                None => pause,
            };
            previous_time = Some(time);
            if last_piece != Some(k.piece[i]) {
                last_piece = Some(k.piece[i]);
                piece_number += 1;
            }
            let posture = braid.posture(Length::from_metres(stroke));
            largest = stroke.max(largest);
            rows.contexts.push(Context {
                dt: if rows.contexts.is_empty() { 0.0 } else { dt },
                time: clock + local,
                pressure,
                pressure_rate,
                stroke,
                contraction: stroke / braid.rest_length(),
                speed,
                acceleration,
                direction: k.direction[i],
                travel,
                since_reversal: since,
                hold_time: hold,
                resting: if k.held[i] || i == 0 { 1.0 } else { 0.0 },
                cycles: f64::from(turns_before + k.turns[i]) * 0.5,
                temperature,
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
                order: 4.0,
                ..Context::default()
            });
            rows.shapes.push(shape(braid, stroke));
            rows.force.push(if good > 0.0 { force_sum / good } else { 0.0 });
            // Just after a turn of the pressure at held length the model only guesses how far friction has turned; where the muscle
            // also moves, its strokes and what ramps are steady are what is judged.
            let on_ramp = k.on_ramp[i] && !rows.isometric;
            let judged = k.sure[i] && (rows.isometric || !k.ramped[i] || on_ramp);
            rows.on_ramp.push(on_ramp);
            let read = (good / per_row as f64).sqrt();
            readable.push(if k.held[i] { read } else { 0.0 });
            rows.root_weight.push(if judged { read } else { 0.0 });
            rows.recording.push(index as u32);
            rows.block.push(piece_number);
            rows.cycle.push(recording.cycle.as_ref().map_or(0, |c| c[i]));
            rows.sign.push(k.direction[i]);
            rows.still.push(still);
            rows.settling.push(0.0);
            rows.unsettled.push(0.0);
            rows.rest.push(0);
            rows.largest.push(largest / braid.rest_length());
            rows.local_time.push(local);
            i = j;
        }
        turns_before += k.turns.last().copied().unwrap_or(0) + 1;
        clock += recording.duration();
    }
    if spiked * 200 > total {
        rows.remarks.push(format!(
            "{spiked} of {total} force readings stand out alone and were left out as outliers"
        ));
    }
    levels(&mut rows, pressures);
    mark_vented(&mut rows, &readable);
    merge_blocks(&mut rows);
    number_cycles(&mut rows);
    blur(&mut rows);
    Ok(rows)
}

/// Force and stroke are read together to this part of a row's time at best.
const TOGETHER: f64 = 0.25;
/// A stroke's steepest part changes the force from row to row by so many times what its middle does.
const STEEP: f64 = 3.0;
/// A misfit of this share of the largest force is no matter.
const NO_MATTER: f64 = 1e-3;

/// Where the force runs from one branch to the other within a few rows, each of them says as little as the moment of its reading is
/// known.
fn blur(rows: &mut Rows) {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let step = |i: usize| (rows.force[i + 1] - rows.force[i]).abs();
    let n = rows.len();
    let mut weights = rows.root_weight.clone();
    let mut from = 0;
    for i in 1..=n {
        if i < n && rows.block[i] == rows.block[from] && rows.recording[i] == rows.recording[from] {
            continue;
        }
        let mut steps: Vec<f64> = (from..i - 1).map(step).collect();
        let usual = if steps.is_empty() { 0.0 } else { median(&mut steps) };
        for j in from + 1..i.saturating_sub(1) {
            let excess = (step(j - 1).min(step(j)) - STEEP * usual).max(0.0);
            weights[j] /= (1.0 + (TOGETHER * excess / (NO_MATTER * strongest)).powi(2)).sqrt();
        }
        from = i;
    }
    rows.root_weight = weights;
}

/// Pressure levels: blocks of nearly constant pressure, clustered; without them up to eight quantiles of the pressure.
fn levels(rows: &mut Rows, range: (f64, f64)) {
    let span = (range.1 - range.0).max(1.0);
    let mut means: Vec<(f64, f64)> = Vec::new(); // pressure, rows
    let mut steady = 0;
    let mut from = 0;
    let n = rows.len();
    for i in 1..=n {
        if i == n || rows.block[i] != rows.block[from] {
            let block = &rows.contexts[from..i];
            let mean = block.iter().map(|c| c.pressure).sum::<f64>() / block.len() as f64;
            let spread =
                (block.iter().map(|c| (c.pressure - mean).powi(2)).sum::<f64>() / block.len() as f64).sqrt();
            if spread < 0.02 * span.max(0.05 * mean.abs()) {
                means.push((mean, (i - from) as f64));
                steady += i - from;
            }
            from = i;
        }
    }
    means.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<(f64, f64)> = Vec::new();
    for (p, w) in means {
        match found.last_mut() {
            Some(last) if p - last.0 < (0.035 * span).max(3e3) => {
                last.0 = (last.0 * last.1 + p * w) / (last.1 + w);
                last.1 += w;
            }
            _ => found.push((p, w)),
        }
    }
    found.retain(|(_, w)| *w * 200.0 > n as f64);
    if steady * 10 >= n * 6 && (1..=12).contains(&found.len()) {
        rows.levels = found.iter().map(|f| f.0).collect();
        rows.steady = true;
    } else {
        let mut all: Vec<f64> = rows.contexts.iter().map(|c| c.pressure).collect();
        let mut levels: Vec<f64> = (0..7).map(|k| quantile(&mut all, f64::from(k) / 6.0)).collect();
        // Spread evenly rather than by how long the pressure dwelt: curves need nodes where the range is.
        let (lo, hi) = (levels[0], levels[6]);
        for (k, level) in levels.iter_mut().enumerate() {
            *level = 0.5 * *level + 0.5 * (lo + (hi - lo) * k as f64 / 6.0);
        }
        levels.dedup_by(|a, b| (*a - *b).abs() < 0.02 * span);
        rows.levels = levels;
    }
    let nearest = |p: f64| {
        rows.levels
            .iter()
            .enumerate()
            .min_by(|a, b| (a.1 - p).abs().total_cmp(&(b.1 - p).abs()))
            .map_or(0, |(i, _)| i as u32)
    };
    rows.level = rows.contexts.iter().map(|c| nearest(c.pressure)).collect();
}

/// The stretches of rows in which a muscle stays vented.
fn tares(rows: &Rows) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut from = 0;
    let together = |i: usize| (rows.vented[i], rows.recording[i]);
    (1..=rows.len()).filter_map(move |i| {
        if i < rows.len() && together(i) == together(from) {
            return None;
        }
        let stretch = from..i;
        from = i;
        rows.vented[stretch.start].then_some(stretch)
    })
}

/// Zeros differ by this part of themselves at most.
const SAME_ZERO: f64 = 0.15;

/// Whether all tares read the same, within each and from one to the next. What does not is partly the muscle's: a bladder that still
/// remembers, a length that is not what it was, a guide that stuck.
fn zeros_agree<'a>(tares: impl Iterator<Item = &'a [f64]>) -> bool {
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let (mut least, mut most, mut doubt) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    for force in tares.filter(|f| f.len() >= 6) {
        let third = force.len() / 3;
        let ends = [mean(&force[..third]), mean(&force[force.len() - third..])];
        let steps: f64 = force.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        doubt = doubt.max((steps / (2 * (force.len() - 1) * third) as f64).sqrt());
        least = ends.iter().fold(least, |l, e| l.min(*e));
        most = ends.iter().fold(most, |m, e| m.max(*e));
    }
    most - least <= SAME_ZERO * most.abs().max(least.abs()) + 6.0 * doubt
}

/// A muscle is at its rest length to this part of it.
const SLACK: f64 = 2e-3;

/// Rows without pressure worth the name: the muscle cannot pull, so what is read comes from the bench.
/// Which way friction would act does not matter there: `readable` weights count while the length is held.
fn mark_vented(rows: &mut Rows, readable: &[f64]) {
    let highest = rows.contexts.iter().map(|c| c.pressure).fold(0.0, f64::max);
    let limit = (0.02 * highest).min(8e3);
    rows.vented = rows.contexts.iter().map(|c| c.pressure < limit).collect();
    if rows.vented.iter().all(|v| *v) {
        rows.vented.fill(false);
    }
    if zeros_agree(tares(rows).map(|tare| &rows.force[tare])) {
        for i in (0..rows.len()).filter(|i| rows.vented[*i]) {
            // Stretched beyond its rest length even a vented muscle pulls.
            if rows.contexts[i].contraction >= -SLACK {
                rows.root_weight[i] = rows.root_weight[i].max(readable[i]);
            }
        }
    }
    rows.levels.retain(|l| *l >= limit || highest <= limit);
    if rows.levels.is_empty() {
        rows.levels.push(highest);
    }
    let last = rows.levels.len() as u32 - 1;
    if rows.steady {
        // Ramps below the lowest pressure worked at lead where no table reaches.
        for i in 0..rows.len() {
            if rows.contexts[i].pressure < 0.8 * rows.levels[0] && !rows.vented[i] {
                rows.root_weight[i] = 0.0;
            }
        }
    }
    let levels = rows.levels.clone();
    for (level, context) in rows.level.iter_mut().zip(&rows.contexts) {
        let p = context.pressure;
        *level = levels
            .iter()
            .enumerate()
            .min_by(|a, b| (a.1 - p).abs().total_cmp(&(b.1 - p).abs()))
            .map_or(0, |(i, _)| i as u32)
            .min(last);
    }
}

/// Half-strokes become blocks; those that are very short join the one before, those very long are cut, so that blocks
/// outlast the noise's memory and are still many.
fn merge_blocks(rows: &mut Rows) {
    let n = rows.len();
    let mut spans: Vec<f64> = Vec::new();
    let mut from = 0;
    for i in 1..=n {
        if i == n || rows.block[i] != rows.block[from] {
            spans.push(rows.local_time[i - 1] - rows.local_time[from]);
            from = i;
        }
    }
    let mut sorted: Vec<f64> = spans.iter().copied().filter(|s| *s > 0.0).collect();
    let typical = quantile(&mut sorted, 0.7).max(1e-9);
    let (shortest, longest) = (0.35 * typical, 3.0 * typical);
    let mut number = 0_u32;
    let mut start = 0;
    let mut fresh = vec![0_u32; n];
    for i in 0..n {
        if i > 0 {
            let age = rows.local_time[i - 1] - rows.local_time[start];
            let other_recording = rows.recording[i] != rows.recording[i - 1];
            let other_piece = rows.block[i] != rows.block[i - 1];
            let vent = rows.vented[i] != rows.vented[i - 1];
            if other_recording || vent || (other_piece && age >= shortest) || age >= longest {
                number += 1;
                start = i;
            }
        }
        fresh[i] = number;
    }
    rows.block = fresh;
    rows.blocks = if n == 0 { 0 } else { number as usize + 1 };
}

/// Cycles within a stay at one pressure level, from 1, where the recording does not number them itself.
fn number_cycles(rows: &mut Rows) {
    if rows.cycle.iter().any(|c| *c > 0) {
        return;
    }
    let (mut base, mut level, mut recording) = (0.0, u32::MAX, u32::MAX);
    for i in 0..rows.len() {
        if rows.level[i] != level || rows.recording[i] != recording {
            level = rows.level[i];
            recording = rows.recording[i];
            base = rows.contexts[i].cycles;
        }
        rows.cycle[i] = (rows.contexts[i].cycles - base).max(0.0).floor() as u32 + 1;
    }
}

/// The middle distance in time between rows, s.
pub(crate) fn typical_step(rows: &Rows) -> f64 {
    let mut steps: Vec<f64> = rows
        .local_time
        .windows(2)
        .zip(rows.recording.windows(2))
        .filter(|(_, r)| r[0] == r[1])
        .map(|(t, _)| t[1] - t[0])
        .collect();
    median(&mut steps).max(1e-9)
}
