//! Strokes at regulated pressures: what the middle of the loop and its half width changed by.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::answer::NotComparable;
use super::contrast::{log_mean, log_sum};
use super::criteria::{SIZES, STROKE_BINS, STROKE_LENGTH, STROKE_REPEATS, STROKE_SETS, STROKED_FLOOR};
use super::shapes::{Change, Class, ForceShape};
use super::strokes::{Band, Key, bands, ends, levels};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Campaign;
use pam_data::statistics::{extremes, slope};

/// What repeats between campaigns of strokes: shares of the largest force, or of friction. By principle; reshaped once after a first run
/// on the cylinder's recordings (friction as a share of friction, not of force).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StrokeRepeats {
    /// Zero of the load cell, of the largest force.
    pub zero: f64,
    /// Gain of a reseated part.
    pub gain: f64,
    /// A level's own zero, of the largest force.
    pub level: f64,
    /// Along the stroke, of the largest force.
    pub along: f64,
    /// Friction in common, of friction.
    pub friction: f64,
    /// Friction of a recording, of friction.
    pub friction_level: f64,
    /// Friction along the stroke, of friction.
    pub friction_along: f64,
}

/// What strokes at regulated pressures are tested for: two shapes of the middle of the loop, and two of its half width.
const TESTED: [ForceShape; 4] =
    [ForceShape::Constant, ForceShape::Force, ForceShape::Direction, ForceShape::DirectionTimesPressure];

/// The changes that are tested for strokes at regulated pressures.
pub(super) fn tested() -> impl Iterator<Item = Change> {
    TESTED.into_iter().filter_map(Change::of_shape)
}

/// The differences of both campaigns.
pub(super) struct Compared {
    pub keys: Vec<Key>,
    pub levels: Vec<f64>,
    pub before: Vec<Band>,
    pub after: Vec<Band>,
    /// Middles first, then halves, N.
    pub y: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Of each of [`TESTED`], N per unit.
    shapes: Vec<DVector<f64>>,
    pub largest: f64,
    pub not_comparable: Vec<NotComparable>,
}

/// What is tested, with its log evidence, prior included.
pub(super) struct Weighed {
    /// Probability of every set.
    pub sets: Vec<(Vec<Change>, f64)>,
    /// Size and standard deviation of every named change beside the others.
    pub sizes: BTreeMap<Change, (f64, f64)>,
    /// Alone: size and standard deviation.
    pub alone: BTreeMap<Change, (f64, f64)>,
}

impl Weighed {
    /// Probability that a change is there.
    pub fn marginal(&self, change: Change) -> f64 {
        self.sets.iter().filter(|(s, _)| s.contains(&change)).map(|(_, p)| p).sum()
    }

    /// Probability that one of a class is there.
    pub fn class(&self, class: Class) -> f64 {
        self.sets.iter().filter(|(s, _)| s.iter().any(|c| c.class() == class)).map(|(_, p)| p).sum()
    }

    /// Probability that nothing changed.
    pub fn none(&self) -> f64 {
        self.sets.iter().filter(|(s, _)| s.is_empty()).map(|(_, p)| p).sum()
    }
}

impl Compared {
    /// What a change adds per unit of its size, N; `None` for a change that strokes are not tested for.
    pub fn shape(&self, change: Change) -> Option<&DVector<f64>> {
        let place = TESTED.iter().position(|s| change.shape() == Some(*s))?;
        self.shapes.get(place)
    }
}

/// Compares two campaigns. `reference_error`: what the reference itself is wrong by, N; zero for recordings.
///
/// # Errors
/// No common level, or a recording without force.
pub(super) fn compare(before: &Campaign, after: &Campaign, reference_error: f64) -> Result<Compared> {
    let levels = levels(&[before, after]);
    let ends = ends(before);
    let (old, new) = (bands(before, &levels, ends)?, bands(after, &levels, ends)?);
    let keys: Vec<Key> = old.keys().filter(|k| new.contains_key(k)).copied().collect();
    let mut not_comparable = vec![NotComparable::Strokes];
    for (i, pressure) in levels.iter().enumerate() {
        if !keys.iter().any(|k| k.0 == i) {
            not_comparable.push(NotComparable::Level { pressure: *pressure });
        }
    }
    if keys.len() < 3 {
        let list = |bands: &BTreeMap<Key, Band>| {
            let mut of: Vec<usize> = bands.keys().map(|k| k.0).collect();
            of.dedup();
            let names: Vec<String> = of.iter().map(|i| format!("{:.0}", levels[*i] / 1e3)).collect();
            if names.is_empty() { "no pressure".to_owned() } else { names.join(", ") + " kPa" }
        };
        return Err(Error::new(
            DataCode::RecordingOutOfRange,
            format!(
                "the compared recordings have too few strokes at the same pressure: {} in the later ones, {} in the reference; three bands of \
                 pressure and stroke are required, with two strokes each way",
                list(&new),
                list(&old)
            ),
        )
        .help(
            "record the same pressures over the same stroke, three cycles or more; files of one campaign belong into one folder, or share a \
             date in their names",
        ));
    }
    let pick = |bands: &BTreeMap<Key, Band>| keys.iter().map(|k| bands[k]).collect::<Vec<Band>>();
    let (before, after) = (pick(&old), pick(&new));
    let n = keys.len();
    let largest = before.iter().map(|b| b.middle.abs()).fold(0.0, f64::max);
    let by_pressure: Vec<f64> = (0..n)
        .map(|i| {
            let points: Vec<(f64, f64)> = (0..n)
                .filter(|j| keys[*j].1 == keys[i].1)
                .map(|j| (before[j].pressure, before[j].middle))
                .collect();
            if points.len() > 1 { slope(&points) } else { 0.0 }
        })
        .collect();
    let middle = |i: usize| {
        after[i].middle - before[i].middle - by_pressure[i] * (after[i].pressure - before[i].pressure)
    };
    let half = |i: usize| {
        after[i].half - before[i].half + by_pressure[i] * (after[i].pressure_half - before[i].pressure_half)
    };
    let y = DVector::from_iterator(2 * n, (0..n).map(middle).chain((0..n).map(half)));
    // More friction counts positive whichever way force and displacement count.
    let way = if before.iter().map(|b| b.half).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let column = |shape: ForceShape| {
        let of = |i: usize| match (shape, i < n) {
            (ForceShape::Constant, true) => 1.0,
            (ForceShape::Force, true) => before[i].middle,
            (ForceShape::Direction, false) => way,
            (ForceShape::DirectionTimesPressure, false) => way * before[i - n].pressure,
            _ => 0.0,
        };
        DVector::from_fn(2 * n, |i, _| of(i))
    };
    let shapes = TESTED.iter().map(|c| column(*c)).collect();
    let covariance = covariance(&keys, &before, &after, largest, reference_error);
    Ok(Compared { keys, levels, before, after, y, covariance, shapes, largest, not_comparable })
}

/// Covariance of the differences if nothing was changed, N².
fn covariance(
    keys: &[Key],
    before: &[Band],
    after: &[Band],
    largest: f64,
    reference_error: f64,
) -> DMatrix<f64> {
    let r: &StrokeRepeats = &STROKE_REPEATS;
    let n = keys.len();
    let (low, high) = extremes(before.iter().map(|b| b.stroke));
    let span = (high - low).max(f64::MIN_POSITIVE);
    let friction: Vec<f64> = (0..n)
        .map(|i| {
            let own = (0..n).filter(|j| keys[*j].0 == keys[i].0);
            let count = own.clone().count().max(1) as f64;
            // If nothing changed, both sides show the same friction: which of them came first must not matter.
            own.map(|j| (before[j].half.abs() + after[j].half.abs()) / 2.0).sum::<f64>() / count
        })
        .collect();
    let f2 = largest * largest;
    let mut s = DMatrix::zeros(2 * n, 2 * n);
    for i in 0..n {
        for j in 0..n {
            let same = f64::from(u8::from(keys[i].0 == keys[j].0));
            let apart = (before[i].stroke - before[j].stroke) / span / STROKE_LENGTH;
            let along = (-0.5 * apart * apart).exp() * same;
            s[(i, j)] = (r.zero * r.zero + r.level * r.level * same + r.along * r.along * along) * f2
                + r.gain * r.gain * before[i].middle * before[j].middle
                + reference_error * reference_error * along;
            let share = r.friction * r.friction
                + r.friction_level * r.friction_level * same
                + r.friction_along * r.friction_along * along;
            s[(n + i, n + j)] = share * friction[i] * friction[j] + reference_error * reference_error * along;
        }
        let error = before[i].error.hypot(after[i].error);
        let floor = (STROKED_FLOOR * largest).powi(2) + error * error;
        s[(i, i)] += floor + (r.along * largest).powi(2);
        s[(n + i, n + i)] += floor + (r.friction_along * friction[i]).powi(2);
    }
    s
}

/// Weighs every set of changes. `none` is the prior probability of no change.
///
/// # Errors
/// Numbers that cannot be used.
pub(super) fn weigh(c: &Compared, none: f64) -> Result<Weighed> {
    let unusable =
        || Error::new(DataCode::RecordingNotFinite, "the recordings hold numbers that cannot be compared");
    let factor = c.covariance.clone().cholesky().ok_or_else(unusable)?;
    let precision = factor.inverse();
    let rms: Vec<f64> = c.shapes.iter().map(|s| (2.0 * s.norm_squared() / s.len() as f64).sqrt()).collect();
    let mut logs = Vec::new();
    let mut fits: Vec<Option<(DVector<f64>, DMatrix<f64>)>> = Vec::new();
    for set in STROKE_SETS {
        if set.is_empty() {
            logs.push(none.ln());
            fits.push(None);
            continue;
        }
        let columns: Vec<DVector<f64>> =
            set.iter().map(|k| &c.shapes[*k] / rms[*k].max(f64::MIN_POSITIVE)).collect();
        let v = DMatrix::from_columns(&columns);
        let (g, b) = (v.tr_mul(&(&precision * &v)), v.tr_mul(&(&precision * &c.y)));
        let each: Vec<f64> = SIZES
            .iter()
            .filter_map(|size| {
                let t = (size * c.largest).powi(2);
                let grown = DMatrix::identity(set.len(), set.len()) + &g * t;
                let solved = grown.clone().lu().solve(&b)?;
                Some(-0.5 * grown.determinant().ln() + 0.5 * t * b.dot(&solved))
            })
            .collect();
        logs.push(log_mean(&each) + ((1.0 - none) / (STROKE_SETS.len() - 1) as f64).ln());
        fits.push(g.cholesky().map(|f| (f.solve(&b), f.inverse())));
    }
    let total = log_sum(&logs);
    let sets: Vec<(Vec<Change>, f64)> = STROKE_SETS
        .iter()
        .zip(&logs)
        .map(|(s, l)| (s.iter().filter_map(|k| Change::of_shape(TESTED[*k])).collect(), (l - total).exp()))
        .collect();
    let of = |index: usize| -> BTreeMap<Change, (f64, f64)> {
        let Some((sizes, inverse)) = &fits[index] else { return BTreeMap::new() };
        let one = |(i, k): (usize, &usize)| {
            let unit = rms[*k].max(f64::MIN_POSITIVE);
            let change = Change::of_shape(TESTED[*k])?;
            Some((change, (sizes[i] / unit, inverse[(i, i)].max(0.0).sqrt() / unit)))
        };
        STROKE_SETS[index].iter().enumerate().filter_map(one).collect()
    };
    let alone = (1..=TESTED.len()).flat_map(of).collect();
    let mut weighed = Weighed { sets, sizes: BTreeMap::new(), alone };
    let named = named(&weighed);
    let holds = |i: &usize| named.iter().all(|n| weighed.sets[*i].0.contains(n));
    // The set of the named ones alone, where it is one of those tested: what is not named must not share out their sizes.
    let alone = |i: &usize| holds(i) && weighed.sets[*i].0.len() == named.len();
    let best = (0..STROKE_SETS.len())
        .filter(holds)
        .max_by(|a, b| alone(a).cmp(&alone(b)).then(weighed.sets[*a].1.total_cmp(&weighed.sets[*b].1)))
        .unwrap_or(0);
    weighed.sizes = of(best);
    Ok(weighed)
}

/// The best name of every class that is more probable than not.
pub(super) fn named(weighed: &Weighed) -> Vec<Change> {
    let mut all = Vec::new();
    for class in [Class::Gain, Class::Friction, Class::Zero] {
        if weighed.class(class) >= super::criteria::NAMED {
            let mut own = tested().filter(|c| c.class() == class);
            let first = own.next();
            let best = own.fold(first, |best, c| match best {
                Some(b) if weighed.marginal(b) >= weighed.marginal(c) => Some(b),
                _ => Some(c),
            });
            all.extend(best);
        }
    }
    all
}

/// rms of the difference without and with the changes, fitted to every other level (or part of the stroke) and judged on the rest, N.
pub(super) fn unseen(c: &Compared, changes: &[Change]) -> (f64, f64) {
    let rms = |v: &DVector<f64>| (v.norm_squared() / v.len().max(1) as f64).sqrt();
    let columns: Vec<DVector<f64>> = tested()
        .filter(|change| changes.contains(change))
        .filter_map(|change| c.shape(change))
        .map(|s| s / s.amax().max(f64::MIN_POSITIVE))
        .collect();
    if columns.is_empty() {
        return (rms(&c.y), rms(&c.y));
    }
    let n = c.keys.len();
    let mut present: Vec<usize> = c.keys.iter().map(|k| k.0).collect();
    present.dedup();
    let fold = |i: usize| {
        let key = c.keys[i % n];
        if present.len() > 1 { present.iter().position(|l| *l == key.0).unwrap_or(0) % 2 } else { key.1 % 2 }
    };
    let v = DMatrix::from_columns(&columns);
    let mut left = c.y.clone();
    for side in 0..2 {
        let kept: Vec<usize> = (0..2 * n).filter(|i| fold(*i) != side).collect();
        let k = c.covariance.select_rows(&kept).select_columns(&kept);
        let x = v.select_rows(&kept);
        let Some(factor) = k.cholesky() else { continue };
        let inner = x.tr_mul(&factor.solve(&x));
        let Some(inner) = inner.cholesky() else { continue };
        let sizes = inner.solve(&x.tr_mul(&factor.solve(&c.y.select_rows(&kept))));
        for i in (0..2 * n).filter(|i| fold(*i) == side) {
            left[i] -= (0..columns.len()).map(|k| v[(i, k)] * sizes[k]).sum::<f64>();
        }
    }
    (rms(&c.y), rms(&left))
}

/// Parts of the stroke of a level, for pictures.
pub(super) fn of_level(c: &Compared, level: usize) -> Vec<usize> {
    let mut own: Vec<usize> = (0..c.keys.len()).filter(|i| c.keys[*i].0 == level).collect();
    own.truncate(STROKE_BINS);
    own
}
