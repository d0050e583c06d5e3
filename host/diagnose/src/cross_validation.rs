//! The improvement on held-out rows: whole pressures, recordings, cycles or stretches of time, never random
//! rows of the same stroke.

use std::ops::RangeInclusive;

use rayon::prelude::*;

use super::baselines::{self, Kind};
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::rows::NO_LOAD;
use super::criteria::uncertainty::{
    FEWEST_LEVELS_HELD_OUT, FEWEST_RECORDINGS, FEWEST_STROKES_HELD_OUT, FOLDS, HELD_OUT_ROWS, ONE_BLADDER,
    RECORDING_FOLDS, SEEN_ONCE, STROKE_PARTS,
};
use super::linear::energy;
use super::rows::Rows;
use super::verdict::{HeldOut, Split};

fn strongest(rows: &Rows) -> f64 {
    rows.force.iter().copied().fold(0.0, f64::max)
}

/// How rows are put into groups that are left out one at a time.
struct Groups {
    split: Split,
    group: Vec<u32>,
    groups: Vec<u32>,
}

fn split(split: Split, rows: &Rows, key: &dyn Fn(usize) -> u32) -> Groups {
    let group: Vec<u32> = (0..rows.len()).map(key).collect();
    let mut groups: Vec<u32> =
        group.iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0).map(|(g, _)| *g).collect();
    groups.sort_unstable();
    groups.dedup();
    Groups { split, group, groups }
}

fn stride(rows: &Rows) -> usize {
    rows.len().div_ceil(HELD_OUT_ROWS).max(1)
}

/// Every n-th row, with columns over them.
pub(super) fn thin(rows: &Rows, traces: &[Vec<f64>]) -> (Rows, Vec<Vec<f64>>) {
    let stride = stride(rows);
    let pick = |v: &Vec<f64>| v.iter().step_by(stride).copied().collect::<Vec<f64>>();
    (rows.thinned(stride), traces.iter().map(pick).collect())
}

/// Rows within the model's claim: all that count, and those about a reversal, which are masked for their direction alone. Slack rows and
/// ramps beyond the tested pressures stay out.
fn claimed(rows: &Rows) -> Vec<bool> {
    let sure = || (0..rows.len()).filter(|i| rows.root_weight()[*i] > 0.0);
    let strongest = sure().map(|i| rows.force[i]).fold(0.0, f64::max);
    let low = sure().map(|i| rows.contexts()[i].pressure).fold(f64::INFINITY, f64::min);
    let high = sure().map(|i| rows.contexts()[i].pressure).fold(f64::NEG_INFINITY, f64::max);
    (0..rows.len())
        .map(|i| {
            let pressure = rows.contexts()[i].pressure;
            rows.root_weight()[i] > 0.0
                || (rows.force[i] > NO_LOAD * strongest && low <= pressure && pressure <= high)
        })
        .collect()
}

/// The range of strokes of the fitted rows. Beyond it a polynomial extrapolates.
fn strokes(rows: &Rows) -> RangeInclusive<f64> {
    let fitted =
        || rows.contexts().iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0).map(|(c, _)| c.stroke);
    fitted().fold(f64::INFINITY, f64::min)..=fitted().fold(f64::NEG_INFINITY, f64::max)
}

/// Sums of squares on rows that the fit did not see: on the sure rows, and with those about the turns.
fn left_out(rows: &Rows, kind: Kind, traces: &[Vec<f64>], split: &Groups, tares: bool) -> [f64; 2] {
    let claimed = claimed(rows);
    rows.progress().stage("predicting what was left out", split.groups.len() as u64);
    let parts: Vec<([f64; 2], [f64; 2])> = split
        .groups
        .par_iter()
        .map(|g| {
            rows.progress().step();
            let blind = rows.without(|i| split.group[i] == *g);
            let reach = strokes(&blind);
            let fitted = baselines::fit(&blind, kind, traces);
            let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
            for i in 0..rows.len() {
                // The place where friction rests was fitted there and cannot be predicted.
                let within = reach.contains(&rows.contexts()[i].stroke);
                let judged =
                    if rows.vented[i] { tares } else { rows.sign[i] != 0.0 && rows.at_rest().rest[i] == 0 };
                if split.group[i] == *g && within && judged && claimed[i] {
                    let square = fitted.raw_residual[i].powi(2);
                    if square.is_finite() {
                        sums[1] += square;
                        counts[1] += 1.0;
                        if rows.root_weight()[i] > 0.0 {
                            sums[0] += square;
                            counts[0] += 1.0;
                        }
                    }
                }
            }
            (sums, counts)
        })
        .collect();
    std::array::from_fn(|k| {
        let sum: f64 = parts.iter().map(|p| p.0[k]).sum();
        let count: f64 = parts.iter().map(|p| p.1[k]).sum();
        (sum / f64::max(count, 1.0)).sqrt()
    })
}

/// Whether the residual of an effect's trace is concentrated in one group.
fn seen_once(rows: &Rows, kind: Kind, traces: &[Vec<f64>], split: &Groups) -> bool {
    let base = baselines::fit(rows, kind, &[]);
    baselines::projected(traces, rows.root_weight(), &base.span).iter().any(|trace| {
        let of = |g: &u32| {
            trace.iter().zip(&split.group).filter(|(_, h)| *h == g).map(|(v, _)| v * v).sum::<f64>()
        };
        split.groups.iter().map(of).fold(0.0, f64::max) > SEEN_ONCE * energy(trace)
    })
}

/// The strictest split that recordings allow.
fn strictest(rows: &Rows, kind: Kind) -> Groups {
    // Vented rows show what a load cell reads without a muscle: half of the tares predict the other half.
    let vented: Vec<usize> = (0..rows.len()).filter(|i| rows.vented[*i]).collect();
    let tare = |i: usize| (vented.partition_point(|v| *v < i) * 4 / vented.len().max(1)) as u32 % 2;
    let pressure = |i: usize| if rows.vented[i] { rows.levels.len() as u32 + tare(i) } else { rows.level[i] };
    let by_pressure = split(Split::Pressures, rows, &pressure);
    let by_stroke = split(Split::Cycles, rows, &|i| rows.block[i] / 2 % FOLDS);
    let by_recording = split(Split::Recordings, rows, &|i| rows.recording[i]);
    let by_run = split(Split::TenthRecordings, rows, &|i| rows.recording[i] % RECORDING_FOLDS);
    let quarter = rows.blocks.div_ceil(FOLDS as usize).max(1) as u32;
    let by_time = split(Split::Quarters, rows, &|i| rows.block[i] / quarter);
    // A pressure left out needs a baseline that reaches over pressures.
    if rows.isometric && rows.names.len() >= FEWEST_RECORDINGS {
        by_run
    } else if kind.reaches_over_pressures()
        && by_pressure.groups.iter().filter(|g| (**g as usize) < rows.levels.len()).count()
            >= FEWEST_LEVELS_HELD_OUT
    {
        by_pressure
    } else if rows.blocks >= FEWEST_STROKES_HELD_OUT {
        by_stroke
    } else if (2..=10).contains(&by_recording.groups.len()) && rows.levels.len() < 2 {
        by_recording
    } else {
        by_time
    }
}

/// How rows are left out, and what predicts them from the rest.
pub(super) struct HeldOutRows {
    rows: Rows,
    stride: usize,
    kind: Kind,
    split: Groups,
    /// Whether the effects are read of a vented muscle, too.
    tares: bool,
}

impl HeldOutRows {
    /// For effects of these traces, by the strictest split that the recordings allow.
    pub(super) fn new(rows: &Rows, kind: Kind, traces: &[Vec<f64>]) -> Self {
        // Directions with a prior are made for the pressures they were fitted to; a pressure left out needs one bladder,
        // if the base has one.
        let kind = match kind {
            Kind::Flexible(m) => Kind::Flexible(m.min(TABLE_ORDER)),
            Kind::Soft(prior) if prior.elastic > ONE_BLADDER * strongest(rows) => Kind::Flexible(TABLE_ORDER),
            Kind::Soft(_) | Kind::Stiff => Kind::Stiff,
        };
        let (thin, traces) = thin(rows, traces);
        let shows = |t: &Vec<f64>| t.iter().zip(&thin.vented).any(|(force, vented)| *vented && *force != 0.0);
        let tares = traces.iter().any(shows);
        let mut split = strictest(&thin, kind);
        if !thin.isometric && split.groups.len() > 1 && seen_once(&thin, kind, &traces, &split) {
            // What only the first stroke of a virgin muscle shows cannot be predicted from another stroke.
            let strokes = strokes(&thin);
            let part = (strokes.end() - strokes.start()) / STROKE_PARTS;
            let of =
                |i: usize| ((thin.contexts()[i].stroke - strokes.start()) / part).max(0.0) as u32 % FOLDS;
            split = self::split(Split::StrokeParts, &thin, &of);
        }
        Self { rows: thin, stride: stride(rows), kind, split, tares }
    }

    /// The error on rows that were left out, with effects of these traces: on the sure rows, and with those about the turns, N.
    fn errors(&self, traces: &[Vec<f64>]) -> [f64; 2] {
        let traces: Vec<Vec<f64>> =
            traces.iter().map(|t| t.iter().step_by(self.stride).copied().collect()).collect();
        if self.split.groups.len() < 2 {
            return [baselines::fit(&self.rows, self.kind, &traces).rms(&self.rows); 2];
        }
        left_out(&self.rows, self.kind, &traces, &self.split, self.tares)
    }

    /// The error on the sure rows that were left out, with effects of these traces, N.
    pub(super) fn error(&self, traces: &[Vec<f64>]) -> f64 {
        self.errors(traces)[0]
    }

    /// The error without effects and with them.
    pub(super) fn held_out(&self, traces: &[Vec<f64>], noise: f64) -> HeldOut {
        let before = self.errors(&[]);
        let after = if traces.is_empty() { before } else { self.errors(traces) };
        let split = if self.split.groups.len() < 2 { Split::NothingLeftOut } else { self.split.split };
        HeldOut {
            split,
            rms_before_N: before[0],
            rms_after_N: after[0],
            noise_N: noise,
            with_turns_before_N: before[1],
            with_turns_after_N: after[1],
        }
    }
}
