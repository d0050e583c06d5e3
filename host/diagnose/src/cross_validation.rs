//! The improvement on held-out rows: whole pressures, recordings, cycles or stretches of time, never random
//! rows of the same stroke.

use std::ops::RangeInclusive;

use rayon::prelude::*;

use super::baselines::{self, Kind};
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::noise::SAME_LENGTH;
use super::criteria::rows::NO_LOAD;
use super::criteria::uncertainty::{
    FEWEST_LENGTHS_HELD_OUT, FEWEST_LEVELS_HELD_OUT, FEWEST_RECORDINGS, FEWEST_STROKES_HELD_OUT,
    FEWEST_UNITS, FOLDS, HELD_OUT_ERRORS, HELD_OUT_LEAVES, HELD_OUT_ROWS, ONE_BLADDER, RECORDING_FOLDS,
    RECORDINGS_HELD_OUT, SEEN_ONCE, STROKE_PARTS,
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
pub(super) fn downsample(rows: &Rows, traces: &[Vec<f64>]) -> (Rows, Vec<Vec<f64>>) {
    let stride = stride(rows);
    let pick = |v: &Vec<f64>| v.iter().step_by(stride).copied().collect::<Vec<f64>>();
    (rows.downsampled(stride), traces.iter().map(pick).collect())
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

/// Squared errors on rows that the fit did not see, and their number: on the sure rows, and with those about the turns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Squares {
    sums: [f64; 2],
    counts: [f64; 2],
}

impl Squares {
    fn add(&mut self, other: &Self) {
        for k in 0..2 {
            self.sums[k] += other.sums[k];
            self.counts[k] += other.counts[k];
        }
    }
}

/// Squared errors on rows that the fit did not see, by independent unit.
fn left_out(rows: &Rows, kind: Kind, traces: &[Vec<f64>], split: &Groups, tares: bool) -> Vec<Squares> {
    let claimed = claimed(rows);
    let units = units(rows, split);
    let count = units.iter().max().map_or(0, |last| *last as usize + 1);
    rows.progress().stage("predicting what was left out", split.groups.len() as u64);
    let parts: Vec<Vec<Squares>> = split
        .groups
        .par_iter()
        .map(|g| {
            rows.progress().step();
            let blind = rows.without(|i| split.group[i] == *g);
            let reach = strokes(&blind);
            let fitted = baselines::fit(&blind, kind, traces);
            let mut squares = vec![Squares::default(); count];
            for i in 0..rows.len() {
                // The place where friction rests was fitted there and cannot be predicted.
                let within = reach.contains(&rows.contexts()[i].stroke);
                let judged =
                    if rows.vented[i] { tares } else { rows.sign[i] != 0.0 && rows.at_rest().rest[i] == 0 };
                let square = fitted.raw_residual[i].powi(2);
                if split.group[i] == *g && within && judged && claimed[i] && square.is_finite() {
                    let sure = if rows.root_weight()[i] > 0.0 { 1.0 } else { 0.0 };
                    squares[units[i] as usize]
                        .add(&Squares { sums: [sure * square, square], counts: [sure, 1.0] });
                }
            }
            squares
        })
        .collect();
    let mut total = vec![Squares::default(); count];
    for part in &parts {
        total.iter_mut().zip(part).for_each(|(t, p)| t.add(p));
    }
    total
}

/// The independent unit of each row in a comparison of two models: the group that is left out with it. Runs of one held length share the
/// static error of that length, so there the unit is the length.
fn units(rows: &Rows, split: &Groups) -> Vec<u32> {
    if !rows.isometric {
        let place = |g: &u32| split.groups.iter().position(|h| h == g).unwrap_or(0) as u32;
        return split.group.iter().map(place).collect();
    }
    let mut lengths: Vec<f64> = Vec::new();
    let mut of_row = Vec::with_capacity(rows.len());
    for context in rows.contexts() {
        let here = |l: &f64| (l - context.contraction).abs() < SAME_LENGTH;
        let known = lengths.iter().position(here);
        of_row.push(known.unwrap_or(lengths.len()) as u32);
        if known.is_none() {
            lengths.push(context.contraction);
        }
    }
    of_row
}

/// Root mean square error over all units: on the sure rows, and with those about the turns.
fn rms(units: &[Squares]) -> [f64; 2] {
    let mut total = Squares::default();
    units.iter().for_each(|u| total.add(u));
    std::array::from_fn(|k| (total.sums[k] / total.counts[k].max(1.0)).sqrt())
}

/// Whether the error is lower after than before by more than its standard error over independent units.
fn is_lower(before: &[Squares], after: &[Squares]) -> bool {
    let seen = before.iter().zip(after).filter(|(b, _)| b.counts[0] > 0.0);
    let gains: Vec<f64> = seen.map(|(b, a)| b.sums[0] - a.sums[0]).collect();
    let n = gains.len() as f64;
    let sum: f64 = gains.iter().sum();
    if gains.len() < FEWEST_UNITS {
        return sum > 0.0;
    }
    let scatter: f64 = gains.iter().map(|g| (g - sum / n).powi(2)).sum();
    sum > HELD_OUT_ERRORS * (scatter * n / (n - 1.0)).sqrt()
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
    } else if (RECORDINGS_HELD_OUT.0..=RECORDINGS_HELD_OUT.1).contains(&by_recording.groups.len())
        && rows.levels.len() < 2
    {
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
    /// Where the length was held: how lengths are left out.
    lengths: Option<Groups>,
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
        let (downsampled, traces) = downsample(rows, traces);
        let shows =
            |t: &Vec<f64>| t.iter().zip(&downsampled.vented).any(|(force, vented)| *vented && *force != 0.0);
        let tares = traces.iter().any(shows);
        let mut split = strictest(&downsampled, kind);
        if !downsampled.isometric && split.groups.len() > 1 && seen_once(&downsampled, kind, &traces, &split)
        {
            // What only the first stroke of a virgin muscle shows cannot be predicted from another stroke.
            let strokes = strokes(&downsampled);
            let part = (strokes.end() - strokes.start()) / STROKE_PARTS;
            let of = |i: usize| {
                ((downsampled.contexts()[i].stroke - strokes.start()) / part).max(0.0) as u32 % FOLDS
            };
            split = self::split(Split::StrokeParts, &downsampled, &of);
        }
        let lengths = downsampled.isometric.then(|| {
            let length = units(&downsampled, &split);
            self::split(Split::Recordings, &downsampled, &|i| length[i])
        });
        let lengths = lengths.filter(|l| l.groups.len() >= FEWEST_LENGTHS_HELD_OUT);
        Self { rows: downsampled, stride: stride(rows), kind, split, tares, lengths }
    }

    /// Squared errors on rows that were left out, with effects of these traces, by independent unit; where nothing can be left out, on all.
    fn squares(&self, traces: &[Vec<f64>], split: &Groups) -> Vec<Squares> {
        let traces: Vec<Vec<f64>> =
            traces.iter().map(|t| t.iter().step_by(self.stride).copied().collect()).collect();
        if split.groups.len() < 2 {
            let rms = baselines::fit(&self.rows, self.kind, &traces).rms(&self.rows);
            return vec![Squares { sums: [rms * rms; 2], counts: [1.0; 2] }];
        }
        left_out(&self.rows, self.kind, &traces, split, self.tares)
    }

    /// The error on rows that were left out, with effects of these traces: on the sure rows, and with those about the turns, N.
    fn errors(&self, traces: &[Vec<f64>]) -> [f64; 2] {
        rms(&self.squares(traces, &self.split))
    }

    /// The errors without the last of some effects and with it, N, and whether it lowers them: by [`HELD_OUT_LEAVES`], and by more than
    /// the standard error of the difference; of an effect that a test by whole blocks supports (`tested`) that is known to be no chance.
    /// Where the length was held, blocks of one length share the static error of the model there, which any surface over pressure and length
    /// takes up: the error must be lower by more than its standard error, and at lengths that are left out, too.
    pub(super) fn last_helps(&self, traces: &[Vec<f64>], tested: bool) -> (f64, f64, bool) {
        let (without, with, helps) = self.compared(traces, &self.split, tested && !self.rows.isometric);
        match self.lengths.as_ref().filter(|_| helps) {
            Some(lengths) => self.compared(traces, lengths, false),
            None => (without, with, helps),
        }
    }

    fn compared(&self, traces: &[Vec<f64>], split: &Groups, tested: bool) -> (f64, f64, bool) {
        let before = self.squares(&traces[..traces.len().saturating_sub(1)], split);
        let after = self.squares(traces, split);
        let ([without, _], [with, _]) = (rms(&before), rms(&after));
        (without, with, with < HELD_OUT_LEAVES * without && (tested || is_lower(&before, &after)))
    }

    /// The last effect, except the very last, without which the others predict held-out rows better than all together, whose error is
    /// `with`, N; and the error without it, N.
    pub(super) fn harmful(&self, traces: &[Vec<f64>], with: f64) -> Option<(usize, f64)> {
        (0..traces.len().saturating_sub(1)).rev().find_map(|place| {
            let without = self.error(&[&traces[..place], &traces[place + 1..]].concat());
            (without < with).then_some((place, without))
        })
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

#[cfg(test)]
mod tests {
    use model_core::units::{Length, Pressure};
    use pam_data::recording::{Campaign, Recording};

    use super::*;
    use crate::rows::prepare;
    use crate::tests::{geometry, muscle};

    /// Pressure cycles at five held lengths, long enough that rows are downsampled.
    fn isometric() -> Campaign {
        let muscle = muscle();
        let n = 3 * HELD_OUT_ROWS / 5;
        let held = |k: usize| {
            let stroke = 1e-3 * k as f64;
            let time: Vec<f64> = (0..n).map(|i| 0.1 * i as f64).collect();
            let pressure: Vec<f64> = time.iter().map(|t| 4e5 - 1e5 * (0.02 * t).cos()).collect();
            let force = |p: &f64| {
                muscle.force(Pressure::from_pascals(*p), Length::from_metres(stroke), 0.0).newtons()
            };
            Recording {
                name: format!("held {k}"),
                force: Some(pressure.iter().map(force).collect()),
                stroke: vec![stroke; n],
                time,
                pressure,
                ..Recording::default()
            }
        };
        Campaign::new((0..5).map(held).collect())
    }

    #[test]
    fn isometric_recordings_are_predicted_from_the_others() {
        let braid = geometry().build().expect("a braid");
        let (rows, _) = prepare(&isometric(), &braid).expect("rows");
        assert!(rows.isometric && stride(&rows) > 1);
        let held = HeldOutRows::new(&rows, Kind::Stiff, &[]);
        assert_eq!(held.rows.names.len(), 5);
        assert_eq!((held.split.split, held.split.groups.len()), (Split::TenthRecordings, 5));
    }

    #[test]
    fn a_gain_of_one_group_is_not_beyond_its_standard_error() {
        let units = |sums: [f64; 4]| sums.map(|s| Squares { sums: [s; 2], counts: [100.0; 2] });
        let before = units([400.0; 4]);
        assert!(is_lower(&before, &units([300.0, 310.0, 290.0, 305.0])));
        assert!(!is_lower(&before, &units([100.0, 410.0, 405.0, 395.0])), "all of it comes from one group");
        assert!(!is_lower(&before, &before));
        assert!(is_lower(&before[..2], &units([300.0; 4])[..2]), "two groups have no standard error");
    }

    #[test]
    fn held_lengths_are_left_out_too() {
        let braid = geometry().build().expect("a braid");
        let (rows, _) = prepare(&isometric(), &braid).expect("rows");
        let held = HeldOutRows::new(&rows, Kind::Stiff, &[]);
        assert_eq!(held.lengths.as_ref().map(|l| l.groups.len()), Some(5));
        // What acts at one end of the lengths only cannot be predicted there, however well it fits runs of it.
        let trace: Vec<f64> =
            rows.contexts().iter().map(|c| if c.stroke < 5e-4 { 10.0 } else { 0.0 }).collect();
        let shifted = rows.with_force(rows.force.iter().zip(&trace).map(|(f, t)| f + t).collect());
        let held = HeldOutRows::new(&shifted, Kind::Stiff, std::slice::from_ref(&trace));
        assert!(!held.last_helps(std::slice::from_ref(&trace), true).2);
    }

    #[test]
    fn an_earlier_effect_that_raises_the_held_out_error_is_found() {
        let braid = geometry().build().expect("a braid");
        let (rows, _) = prepare(&isometric(), &braid).expect("rows");
        let wave = |i: usize, frequency: f64| 10.0 * (frequency * rows.contexts()[i].time).sin();
        let all = |f: &dyn Fn(usize) -> f64| (0..rows.len()).map(f).collect::<Vec<f64>>();
        // One wave is in every recording; the other in the first one only, though its trace has it in all, with alternating signs.
        let sign = |i: usize| if rows.recording[i] % 2 == 0 { 1.0 } else { -1.0 };
        let by_chance = all(&|i| sign(i) * wave(i, 0.7));
        let founded = all(&|i| wave(i, 0.3));
        let extra = |i: usize| founded[i] + if rows.recording[i] == 0 { by_chance[i] } else { 0.0 };
        let shifted = rows.with_force((0..rows.len()).map(|i| rows.force[i] + extra(i)).collect());
        let held = HeldOutRows::new(&shifted, Kind::Stiff, &[]);
        let harmful = |traces: &[Vec<f64>]| held.harmful(traces, held.error(traces));
        let harm = [by_chance.clone(), founded.clone()];
        let (place, without) = harmful(&harm).expect("the first one does harm");
        let with = held.error(&harm);
        assert!(place == 0 && without < with, "{place}: {without} N without it, {with} N with it");
        assert_eq!(harmful(&[founded.clone(), by_chance]), None, "the first one helps");
        assert_eq!(harmful(&[founded]), None, "one effect is the last one");
    }
}
