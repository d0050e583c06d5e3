//! Readings that repeat one exact value while the other readings move: a frozen or a saturated sensor.

use std::ops::Range;

use super::{Campaign, Channel, Kind, Recording, SensorFault, Usual};
use crate::statistics::{extremes, quantile};

/// Shorter runs are left to the outliers of the fit.
const SHORTEST: usize = 10;
/// While a reading is constant, the force changes by this share of its range beyond what the reading allows, and by this many usual
/// residuals (friction alone changes it by two). The change is that of the expected force where the force is constant, else that of the
/// residual.
const MOVES: (f64, f64) = (0.15, 6.0);
/// Constant readings are unknown of a column whose neighbours are rarely equal in the other recordings, with no run there a tenth as long.
const RARE: f64 = 0.2;
const LONGER: usize = 10;
/// Where constant readings are usual: more than this share of neighbours are equal in the other recordings.
const MOVES_MUCH: (f64, f64) = (0.30, 6.0);
const USUAL: f64 = 0.5;
/// Where constant readings are the rule.
const ALWAYS: f64 = 0.95;
/// Over a run in which the pressure changes by more than this share of its range, the length may be held: then the force follows the
/// expected one up to a scale, as the surface is least exact at the ends of the stroke, and up to this share of its own change, friction.
const RAMPS: f64 = 0.2;
const HELD_SCALE: (f64, f64) = (0.5, 2.0);
const HELD_LEAVES: f64 = 0.25;
/// A saturated force: the expected force lies above it by this share of the range of forces.
const ABOVE: f64 = 0.10;
/// A reading below this share of the range of forces may be a slack muscle.
const SLACK: f64 = 0.05;
/// A saturated sensor reaches its end in this many rows at least, and other recordings go beyond it by this share of the range.
const SATURATED: (usize, f64) = (10, 0.03);

/// Frozen and saturated stretches of a recording.
pub(super) fn find(campaign: &Campaign, index: usize, usual: &Usual, repeats: &Repeats) -> Vec<SensorFault> {
    let r = &campaign.recordings[index];
    let mut found = saturated_force(r, index, usual, repeats.largest_force);
    for channel in Channel::ALL {
        let column = channel.of(r);
        let habit = repeats.of_others(index, channel);
        let (low, high) = extremes(column);
        // A column that is always constant, such as a held length, says nothing by being so.
        if habit.equal > ALWAYS {
            continue;
        }
        for rows in runs(column) {
            let value = column[rows.start];
            let known =
                |f: &SensorFault| f.channel == channel && f.rows.start < rows.end && rows.start < f.rows.end;
            if found.iter().any(known)
                || !contradicted(r, &rows, channel, habit.bound(rows.len(), usual), usual)
            {
                continue;
            }
            let at_end = (value == low || value == high) && low < high;
            let kind = if at_end { Kind::Saturated } else { Kind::Frozen };
            found.push(SensorFault { recording: index, rows, channel, kind, value });
        }
    }
    found
}

/// Stretches of one exact value.
fn runs(column: &[f64]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for i in 1..=column.len() {
        if i == column.len() || column[i] != column[start] {
            if i - start >= SHORTEST {
                runs.push(start..i);
            }
            start = i;
        }
    }
    runs
}

/// How one column repeats its readings.
#[derive(Clone, Copy, Default)]
struct Column {
    /// Neighbours that are equal, and neighbours.
    equal: usize,
    all: usize,
    longest: usize,
}

impl Column {
    fn of(values: &[f64]) -> Self {
        let mut column = Self { all: values.len().saturating_sub(1), longest: 1, ..Self::default() };
        let mut run = 1;
        for pair in values.windows(2) {
            run = if pair[0] == pair[1] { run + 1 } else { 1 };
            column.equal += usize::from(run > 1);
            column.longest = column.longest.max(run);
        }
        column
    }
}

/// How the columns of a campaign repeat their readings, and the largest force of all.
pub(super) struct Repeats {
    /// By channel, by recording.
    columns: [Vec<Column>; Channel::ALL.len()],
    largest_force: f64,
}

impl Repeats {
    pub(super) fn of(campaign: &Campaign) -> Self {
        let column = |channel: Channel| {
            campaign.recordings.iter().map(|r| Column::of(channel.of(r))).collect::<Vec<Column>>()
        };
        let forces = campaign.recordings.iter().filter_map(|r| r.force.as_deref()).flatten();
        Self {
            columns: Channel::ALL.map(column),
            largest_force: forces.copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// The habit of the other recordings, or of this one where there are no others. A column that is constant throughout, such as a held
    /// length, does not show how the others repeat their readings.
    fn of_others(&self, index: usize, channel: Channel) -> Habit {
        let columns =
            Channel::ALL.iter().position(|c| *c == channel).map_or(&[][..], |c| &self.columns[c][..]);
        let alone = columns.len() < 2;
        let (mut equal, mut all, mut longest) = (0, 0, 1);
        let others = || columns.iter().enumerate().filter(|(i, _)| alone || *i != index).map(|(_, c)| c);
        let varies = |c: &&Column| c.equal < c.all;
        let held = !others().any(|c| varies(&c));
        for c in others().filter(|c| held || varies(c)) {
            (equal, all, longest) = (equal + c.equal, all + c.all, longest.max(c.longest));
        }
        Habit { equal: equal as f64 / all.max(1) as f64, longest: (!alone).then_some(longest) }
    }
}

/// How a column repeats its readings in the other recordings, or in this one where there are no others.
struct Habit {
    /// The share of neighbours that are equal.
    equal: f64,
    /// The longest run; `None` without other recordings.
    longest: Option<usize>,
}

impl Habit {
    /// How far the force must move during a run of this many rows, N.
    fn bound(&self, rows: usize, usual: &Usual) -> f64 {
        let unknown = self.longest.is_some_and(|longest| rows >= LONGER * longest);
        if self.equal < RARE && unknown {
            return usual.noticeable_unusually();
        }
        let (share, residuals) = if self.equal > USUAL { MOVES_MUCH } else { MOVES };
        (share * usual.spans[2]).max(residuals * usual.residual)
    }
}

/// Whether the other readings exclude that this one stood still.
fn contradicted(r: &Recording, rows: &Range<usize>, channel: Channel, bound: f64, usual: &Usual) -> bool {
    let stride = super::stride(rows.len());
    let spread = |of: &dyn Fn(usize) -> f64| {
        let mut values: Vec<f64> = rows.clone().step_by(stride).map(of).collect();
        quantile(&mut values, 0.95) - quantile(&mut values, 0.05)
    };
    match channel {
        Channel::Force => {
            let value = r.force.as_ref().map_or(0.0, |f| f[rows.start]);
            // A slack muscle makes one force at all pressures; a load cell that cannot read below zero does the same.
            value > usual.expected.floor() + SLACK * usual.spans[2]
                && spread(&|i| usual.expected.at(r, i)) > bound
        }
        Channel::Stroke if spread(&|i| r.pressure[i]) > RAMPS * usual.spans[0] => {
            let force = |i: usize| r.force.as_ref().map_or(0.0, |f| f[i]);
            let points: Vec<(f64, f64)> =
                rows.clone().step_by(stride).map(|i| (usual.expected.at(r, i), force(i))).collect();
            let scale = held_scale(&points);
            let left = spread(&|i| force(i) - scale * usual.expected.at(r, i));
            left > bound.max(HELD_LEAVES * spread(&force))
        }
        Channel::Pressure | Channel::Stroke => spread(&|i| usual.expected.residual(r, i)) > bound,
    }
}

/// By how much the force changes for each newton of the expected force, over pairs of expected and read force, within what a held length
/// allows.
fn held_scale(points: &[(f64, f64)]) -> f64 {
    let count = points.len().max(1) as f64;
    let (expected, force) = points.iter().fold((0.0, 0.0), |(e, f), p| (e + p.0 / count, f + p.1 / count));
    let (cross, square) = points
        .iter()
        .fold((0.0, 0.0), |(c, s), p| (c + (p.0 - expected) * (p.1 - force), s + (p.0 - expected).powi(2)));
    let scale = if square > 0.0 { cross / square } else { 1.0 };
    scale.clamp(HELD_SCALE.0, HELD_SCALE.1)
}

/// Rows at the largest force of a recording that other recordings exceed: the force sensor, or the range that was set for it, ends
/// there. A sensor that ends at one value in all recordings is found by the fit.
fn saturated_force(r: &Recording, index: usize, usual: &Usual, largest: f64) -> Vec<SensorFault> {
    let Some(force) = r.force.as_deref() else { return Vec::new() };
    let (_, high) = extremes(force);
    let at: Vec<usize> = (0..force.len()).filter(|i| force[*i] == high).collect();
    let next = force.iter().copied().filter(|f| *f < high).fold(f64::NEG_INFINITY, f64::max);
    let neighbours = force.iter().filter(|f| **f == next).count();
    let beyond = largest > high + SATURATED.1 * usual.spans[2];
    // Readings of a free sensor at its largest value are about as frequent as those next to it.
    if at.len() < SATURATED.0 || at.len() <= 3 * neighbours || !beyond {
        return Vec::new();
    }
    let mut above: Vec<f64> = at.iter().map(|i| usual.expected.at(r, *i) - high).collect();
    if !(quantile(&mut above, 0.75) > usual.noticeable(ABOVE).min(0.25 * usual.spans[2])) {
        return Vec::new();
    }
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for i in at {
        match stretches.last_mut() {
            Some(last) if last.end == i => last.end = i + 1,
            _ => stretches.push(i..i + 1),
        }
    }
    let fault = |rows| SensorFault {
        recording: index,
        rows,
        channel: Channel::Force,
        kind: Kind::Saturated,
        value: high,
    };
    stretches.into_iter().map(fault).collect()
}
