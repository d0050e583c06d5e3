//! Both campaigns as cells: what AFTER differs by from BEFORE at the same level, place, direction and speed.

use pam_data::statistics::{deviation_from_median, median};
use std::collections::BTreeMap;

use model_core::braid::Braid;
use nalgebra::DVector;

use super::super::criteria::{
    CATALOGUE_BINS, CATALOGUE_CLIP, CATALOGUE_FEWEST_CELLS, CATALOGUE_FLOOR, CATALOGUE_PRIOR, CATALOGUE_REST,
    CATALOGUE_SLOWEST, CATALOGUE_SPEED_STEP,
};
use super::rests;
use crate::baselines::{self, Kind};
use crate::linear::energy;
use crate::rows::{self, ORDERS, Rows};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::{Campaign, Clock};

/// Level, direction, place, and kind of motion.
type Key = (u32, bool, usize, i32);

/// Kinds of motion beside speeds: rests by decades from here on, and the vented muscle.
pub(super) const REST: i32 = 100;
pub(super) const VENTED: i32 = 2000;

/// Rows of one half-stroke in one state.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    pub key: Key,
    /// Recording of AFTER, counted from 0.
    pub recording: usize,
    /// Rows of `Cells::rows`.
    pub rows: Vec<usize>,
    /// Number of the rest it belongs to; zero where the muscle moves.
    pub rest: usize,
    /// s since AFTER began.
    pub time: f64,
    pub force: f64,
    pub stroke: f64,
    pub direction: f64,
}

/// The cells of AFTER with what they differ by.
pub(super) struct Cells {
    pub cells: Vec<Cell>,
    /// Which state each cell is of, counted from 0.
    pub group: Vec<usize>,
    /// Number of states.
    pub groups: usize,
    /// Residual of each cell less the mean of BEFORE in the same state, N; positive where AFTER pulls more.
    pub difference: DVector<f64>,
    /// Variance of each difference, N².
    pub variance: DVector<f64>,
    /// Rows of AFTER with their own memory, linearised about the model of BEFORE.
    pub rows: Rows,
    /// Largest force before, N.
    pub largest: f64,
    /// Spread of a cell in BEFORE, N.
    pub spread: f64,
    /// Pressures of the levels, Pa.
    pub levels: Vec<f64>,
    /// Cells of AFTER that BEFORE has nothing of.
    pub unmatched: usize,
    /// Rests in which friction slipped in one of the campaigns.
    pub slipped: usize,
    /// Share of rows on ramps of pressure at a held length, which are not compared.
    pub ramps: f64,
    pub names: Vec<String>,
    /// From the first row of AFTER to the last, s.
    pub duration: f64,
}

/// A state of the muscle as far as the model's own error depends on it.
struct States {
    /// Ends of the contraction at each level.
    ends: Vec<(f64, f64)>,
    /// The usual speed, m/s.
    speed: f64,
}

impl States {
    fn of(rows: &Rows, first_after: usize) -> Self {
        let mut ends = vec![(f64::INFINITY, f64::NEG_INFINITY); rows.levels.len()];
        let mut speeds: Vec<f64> = Vec::new();
        for i in (0..first_after).filter(|i| !rows.vented[*i]) {
            let context = &rows.contexts()[i];
            if let Some(end) = ends.get_mut(rows.level[i] as usize) {
                *end = (end.0.min(context.contraction), end.1.max(context.contraction));
            }
            if rows.still[i] <= 0.0 && context.speed != 0.0 {
                speeds.push(context.speed.abs());
            }
        }
        let speed = if speeds.is_empty() { 1.0 } else { median(&mut speeds) };
        Self { ends, speed }
    }

    fn key(&self, rows: &Rows, i: usize) -> Key {
        let context = &rows.contexts()[i];
        if rows.vented[i] {
            return (u32::MAX, true, 0, VENTED);
        }
        let level = rows.level[i];
        let (low, high) = self.ends.get(level as usize).copied().unwrap_or((0.0, 1.0));
        let share = if high > low { (context.contraction - low) / (high - low) } else { 0.0 };
        let bin = ((share * CATALOGUE_BINS as f64).max(0.0) as usize).min(CATALOGUE_BINS - 1);
        let kind = if rows.still[i] > 0.0 {
            // Rests by decade of their duration.
            REST + (rows.still[i] / CATALOGUE_REST).max(1.0).log10().floor() as i32
        } else {
            let ratio = (context.speed.abs() / self.speed).max(CATALOGUE_SLOWEST);
            (ratio.ln() / CATALOGUE_SPEED_STEP.ln()).round() as i32
        };
        (level, rows.sign[i] > 0.0, bin, kind)
    }
}

/// Rows of each cell by recording, half-stroke and state.
fn gathered(rows: &Rows, states: &States, range: std::ops::Range<usize>) -> BTreeMap<(u32, Key), Vec<usize>> {
    let mut all: BTreeMap<(u32, Key), Vec<usize>> = BTreeMap::new();
    for i in range {
        if rows.root_weight()[i] > 0.0 {
            all.entry((rows.block[i], states.key(rows, i))).or_default().push(i);
        }
    }
    all
}

fn mean(values: &[f64], rows: &[usize]) -> f64 {
    rows.iter().map(|i| values[*i]).sum::<f64>() / rows.len().max(1) as f64
}

/// What BEFORE says of its residual.
struct Level {
    /// By state: the mean and the number of cells.
    means: BTreeMap<Key, (f64, f64)>,
    /// Variance of a cell about the mean of its state, by class of motion; and of all.
    variances: BTreeMap<i32, f64>,
    variance: f64,
}

/// A variance in which single cells, as after a restart, do not count with all they have.
fn robust(deviations: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = deviations.iter().map(|d| d.abs()).collect();
    let usual = deviation_from_median(median(&mut sizes));
    let square: f64 =
        deviations.iter().map(|d| d.clamp(-CATALOGUE_CLIP * usual, CATALOGUE_CLIP * usual).powi(2)).sum();
    square / deviations.len().max(1) as f64
}

impl Level {
    fn of(cells: &BTreeMap<(u32, Key), Vec<usize>>, residual: &[f64]) -> Self {
        let mut by_key: BTreeMap<Key, Vec<f64>> = BTreeMap::new();
        for ((_, key), rows) in cells {
            by_key.entry(*key).or_default().push(mean(residual, rows));
        }
        let mut by_class: BTreeMap<i32, Vec<f64>> = BTreeMap::new();
        let mut means = BTreeMap::new();
        for (key, values) in &by_key {
            let n = values.len() as f64;
            let m = values.iter().sum::<f64>() / n;
            let own = by_class.entry(key.3).or_default();
            if values.len() > 1 {
                own.extend(values.iter().map(|v| (v - m) * (n / (n - 1.0)).sqrt()));
            }
            means.insert(*key, (m, n));
        }
        let all: Vec<f64> = by_class.values().flatten().copied().collect();
        let variance = robust(&all);
        // A class of motion with few repeats counts as all do; one that has none, as the worst.
        let shrunk = |own: &Vec<f64>| {
            let n = own.len() as f64;
            (n * robust(own) + CATALOGUE_PRIOR * variance) / (n + CATALOGUE_PRIOR)
        };
        let known = by_class.iter().filter(|(_, own)| !own.is_empty());
        let mut variances: BTreeMap<i32, f64> = known.map(|(class, own)| (*class, shrunk(own))).collect();
        let worst = variances.values().copied().fold(variance, f64::max);
        by_class.keys().for_each(|class| {
            variances.entry(*class).or_insert(worst);
        });
        Self { means, variances, variance }
    }
}

/// The row of `own` that each joint row of AFTER is nearest to in time, recording by recording.
fn matched(joint: &Rows, own: &Rows, first_after: usize, first_recording: u32) -> Vec<usize> {
    let mut at = 0;
    (first_after..joint.len())
        .map(|j| {
            let recording = joint.recording[j] - first_recording;
            let time = joint.local_time[j];
            while at + 1 < own.len()
                && (own.recording[at + 1] < recording
                    || (own.recording[at + 1] == recording
                        && (own.recording[at] < recording
                            || (own.local_time[at + 1] - time).abs() <= (own.local_time[at] - time).abs())))
            {
                at += 1;
            }
            at
        })
        .collect()
}

/// The rows of AFTER with the forces and slopes of the joint model.
fn linearised(joint: &Rows, own: &Rows, first_after: usize, place: &[usize]) -> Rows {
    let mut contexts = own.contexts().to_vec();
    let mut from: Vec<Option<usize>> = vec![None; own.len()];
    for (k, i) in place.iter().enumerate() {
        from[*i].get_or_insert(first_after + k);
    }
    let mut last = first_after;
    for (context, from) in contexts.iter_mut().zip(from) {
        last = from.unwrap_or(last);
        let model = &joint.contexts()[last];
        context.corrected_pressure = context.pressure - (model.pressure - model.corrected_pressure);
        context.friction = model.friction;
        context.gaylord = model.gaylord;
        context.quasi = model.quasi;
        context.elastic = model.elastic;
        context.stiffness = model.stiffness;
        context.pressure_slope = model.pressure_slope;
    }
    own.with_contexts(contexts)
}

/// Rows of both campaigns under the model that was fitted to BEFORE.
struct Joint {
    rows: Rows,
    /// Measured less modelled force, N.
    residual: Vec<f64>,
    /// The first row of AFTER, and its recording.
    first_after: usize,
    first_recording: u32,
    /// Share of rows on ramps of pressure at a held length.
    ramps: f64,
}

impl Joint {
    fn of(before: &Campaign, after: &Campaign, braid: &Braid<f64>, own: &Rows) -> Result<Self> {
        let recordings = before.recordings.iter().chain(&after.recordings).cloned().collect();
        let both = Campaign { recordings, clock: Clock::Separate, warnings: Vec::new() };
        let (prepared, _) = rows::prepare(&both, braid)?;
        // On a ramp of pressure at a held length friction turns by a share of its own: no state of the strokes is like it.
        let ramps = prepared.on_ramp.iter().filter(|r| **r).count() as f64 / prepared.len().max(1) as f64;
        let reversed = rests::reversed(&prepared);
        let joint = prepared.without(|i| prepared.on_ramp[i] || reversed[i]);
        let first_recording = (joint.names.len() - own.names.len().min(joint.names.len())) as u32;
        let first_after = joint.recording.iter().position(|r| *r >= first_recording).unwrap_or(joint.len());
        let reference_rows = joint.without(|i| i >= first_after);
        let mut fitted = baselines::fit(&reference_rows, Kind::Flexible(ORDERS), &[]);
        let (screened, _) = baselines::without_slack(&reference_rows, &fitted);
        if energy(screened.root_weight()) > 0.0 {
            fitted = baselines::fit(&screened, Kind::Flexible(ORDERS), &[]);
        }
        let residual = fitted.raw_residual.clone();
        let (joint, _) = baselines::without_slack(&joint, &fitted);
        let rows = baselines::linearised(&joint, &fitted);
        Ok(Self { rows, residual, first_after, first_recording, ramps })
    }

    /// Largest force before, N.
    fn largest(&self) -> f64 {
        self.rows.force[..self.first_after].iter().copied().fold(0.0, f64::max)
    }
}

/// The cells of AFTER that BEFORE has a state of, with a number for each.
#[derive(Default)]
struct Matched {
    cells: Vec<Cell>,
    /// Residual of each cell less the mean of BEFORE in the same state, N.
    difference: Vec<f64>,
    /// Variance of each difference, N².
    variance: Vec<f64>,
    /// Half the hysteresis of the model, N.
    half_gap: Vec<f64>,
    /// Cells of AFTER that BEFORE has nothing of.
    unmatched: usize,
}

impl Matched {
    /// Compares the states of AFTER with those of BEFORE. `place` is the row of `rows` for each joint row of AFTER; `floor` is the
    /// least variance, N².
    fn of(
        joint: &Joint,
        states: &States,
        level: &Level,
        (rows, place): (&Rows, &[usize]),
        floor: f64,
    ) -> Self {
        let (all, first_after) = (&joint.rows, joint.first_after);
        let new = gathered(all, states, first_after..all.len());
        let mut shared: BTreeMap<Key, f64> = BTreeMap::new();
        new.keys().for_each(|(_, key)| *shared.entry(*key).or_insert(0.0) += 1.0);
        let begin = rows.contexts().first().map_or(0.0, |c| c.time);
        let rest = rests::numbers(all);
        let mut found = Self::default();
        for ((_, key), members) in &new {
            let Some((before, count)) = level.means.get(key) else {
                found.unmatched += 1;
                continue;
            };
            let own_rows: Vec<usize> = members.iter().map(|j| place[j - first_after]).collect();
            let first = members.first().copied().unwrap_or(first_after);
            let d = mean(&joint.residual, members) - before;
            if !d.is_finite() {
                continue;
            }
            found.difference.push(d);
            // Cells of AFTER share the mean of BEFORE: each counts with its part of that mean's error.
            let own = level.variances.get(&key.3).copied().unwrap_or(level.variance);
            found.variance.push((own + floor) * (1.0 + shared.get(key).copied().unwrap_or(1.0) / count));
            let friction = |j: &usize| all.contexts()[*j].friction * all.contexts()[*j].quasi;
            let gap = members.iter().map(friction).sum::<f64>().abs() / members.len().max(1) as f64;
            found.half_gap.push(gap);
            found.cells.push(Cell {
                rest: rest[first],
                key: *key,
                recording: (all.recording[first] - joint.first_recording) as usize,
                time: rows.contexts()[own_rows[0]].time - begin,
                force: mean(&all.force, members),
                stroke: all.contexts()[first].stroke,
                direction: all.sign[first],
                rows: own_rows,
            });
        }
        found
    }

    /// Widens the errors of rests in which friction slipped in one of the campaigns; gives the number of such rests.
    fn widen_slipped(&mut self) -> usize {
        let slipped = rests::slipped(&self.cells, &self.difference, &self.variance, &self.half_gap);
        for i in (0..self.cells.len()).filter(|i| slipped[*i]) {
            self.variance[i] += (2.0 * self.half_gap[i]).powi(2);
        }
        let mut rests: Vec<usize> =
            self.cells.iter().zip(&slipped).filter(|(_, s)| **s).map(|(c, _)| c.rest).collect();
        rests.sort_unstable();
        rests.dedup();
        rests.len()
    }

    /// Which state each cell is of, and the number of states.
    fn groups(&self) -> (Vec<usize>, usize) {
        let mut states: Vec<Key> = self.cells.iter().map(|c| c.key).collect();
        states.sort_unstable();
        states.dedup();
        (self.cells.iter().map(|c| states.binary_search(&c.key).unwrap_or(0)).collect(), states.len())
    }
}

impl Cells {
    /// Compares two campaigns.
    ///
    /// # Errors
    /// Recordings without force, or campaigns that have too little in common.
    pub fn of(before: &Campaign, after: &Campaign, braid: &Braid<f64>) -> Result<Self> {
        let (own, _) = rows::prepare(after, braid)?;
        let joint = Joint::of(before, after, braid, &own)?;
        let first_after = joint.first_after;
        let states = States::of(&joint.rows, first_after);
        let level = Level::of(&gathered(&joint.rows, &states, 0..first_after), &joint.residual);
        let largest = joint.largest();
        let floor = (CATALOGUE_FLOOR * largest).powi(2);
        let place = matched(&joint.rows, &own, first_after, joint.first_recording);
        let rows = linearised(&joint.rows, &own, first_after, &place);
        let begin = rows.contexts().first().map_or(0.0, |c| c.time);
        let end = rows.contexts().last().map_or(1.0, |c| c.time);
        let mut found = Matched::of(&joint, &states, &level, (&rows, &place), floor);
        if found.cells.len() < CATALOGUE_FEWEST_CELLS || !(largest > 0.0) {
            return Err(Error::new(
                DataCode::RecordingOutOfRange,
                "AFTER and the reference have too little in common: no strokes at the same pressures and lengths",
            )
            .help("record the same pressures over the same stroke"));
        }
        let slipped = found.widen_slipped();
        let (group, groups) = found.groups();
        Ok(Self {
            group,
            groups,
            difference: DVector::from_vec(found.difference),
            variance: DVector::from_vec(found.variance),
            rows,
            largest,
            spread: (level.variance + floor).sqrt(),
            levels: joint.rows.levels.clone(),
            unmatched: found.unmatched,
            slipped,
            ramps: joint.ramps,
            names: own.names.clone(),
            duration: (end - begin).max(1e-9),
            cells: found.cells,
        })
    }

    /// Means of a column of AFTER's rows over the cells.
    pub fn means(&self, column: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.cells.len(), self.cells.iter().map(|c| mean(column, &c.rows)))
    }
}
