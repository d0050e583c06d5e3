//! Noise: repeats give its size, its correlation in time the number of rows per independent row; tests use whole blocks.

use pam_data::statistics::extremes;
use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::criteria::noise::{
    CORRELATION_END, FAMILY_PART, FEWEST_REPEATS, INSTRUMENT_MEMORY, INSTRUMENT_NOISE, LAG_GROWTH,
    LATER_REPEATS, LONGEST_LAG, REPEAT_BINS, REPEAT_OUTLIERS, REPEAT_PRESSURE_BINS, REPEAT_SPEED_BINS,
    SAME_LENGTH,
};
use super::linear::{Random, energy};
use super::remark::Scatter;
use super::resolution;
use super::rows::Rows;
use pam_data::statistics::{median, quantile};

/// The noise of the rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Standard deviation of a row, N.
    pub sigma: f64,
    /// Whether repeats of cycles gave it (else it is the residual of the most flexible model).
    pub from_repeats: bool,
    /// Correlation time, s.
    pub memory: f64,
    /// How many independent rows the recordings amount to.
    pub independent: f64,
}

impl Noise {
    /// Whether it is larger and lasts longer than what instruments scatter: then strokes under the same conditions differ by physics.
    /// `step` is the time between rows, s, `blocked` the blocked force, N.
    pub(crate) fn exceeds_instruments(&self, step: f64, blocked: f64) -> bool {
        self.sigma > INSTRUMENT_NOISE * blocked && self.remembers(step)
    }

    /// Whether it lasts longer than the noise of an instrument.
    pub(crate) fn remembers(&self, step: f64) -> bool {
        self.memory > INSTRUMENT_MEMORY * step
    }

    /// How strokes under the same conditions differ.
    pub(crate) fn scatter(&self, blocked: f64) -> Scatter {
        Scatter { sigma: self.sigma, share: self.sigma / blocked, memory: self.memory }
    }
}

/// For each row, the number of its recording among those of the same held length, from 1.
fn runs(rows: &Rows) -> Vec<u32> {
    let mut places: Vec<(f64, u32)> = Vec::new();
    let (mut last, mut run) = (None, 0);
    let mut of_row = Vec::with_capacity(rows.len());
    for (recording, context) in rows.recording.iter().zip(rows.contexts()) {
        if last != Some(*recording) {
            last = Some(*recording);
            let here = |p: &&mut (f64, u32)| (p.0 - context.contraction).abs() < SAME_LENGTH;
            run = match places.iter_mut().find(here) {
                Some(place) => {
                    place.1 += 1;
                    place.1
                }
                None => {
                    places.push((context.contraction, 1));
                    1
                }
            };
        }
        of_row.push(run);
    }
    of_row
}

/// Pure error from repeats: the same level, direction and contraction in successive cycles, or in successive recordings of one held
/// length.
fn from_repeats(rows: &Rows, residual: &[f64]) -> Option<f64> {
    #[derive(Default, Clone, Copy)]
    struct Cell {
        sum: f64,
        squares: f64,
        count: f64,
    }
    let range = extremes(
        rows.contexts().iter().zip(rows.root_weight()).filter(|(_, w)| **w > 0.0).map(|(c, _)| c.contraction),
    );
    let top = rows.contexts().iter().map(|c| c.pressure).fold(1.0, f64::max);
    let width = ((range.1 - range.0) / REPEAT_BINS).max(1e-6);
    let runs = runs(rows);
    let mut cells: BTreeMap<(u32, i8, i32, i32, u32), Cell> = BTreeMap::new();
    for i in 0..rows.len() {
        let c = rows.contexts()[i];
        if rows.root_weight()[i] > 0.0 && !rows.vented[i] && (c.speed != 0.0 || rows.isometric) {
            // Repeats at another speed are not repeats.
            // (At held length the place on the staircase takes the speed's part, and the run the cycle's.)
            let speed = if rows.isometric {
                (c.pressure / top * REPEAT_PRESSURE_BINS).round() as i32
            } else {
                (c.speed.abs().ln() * REPEAT_SPEED_BINS).round() as i32
            };
            let bin = (c.contraction / width).round() as i32;
            let repeat = if rows.isometric { runs[i] } else { rows.cycle[i] };
            let cell = cells.entry((rows.level[i], rows.sign[i] as i8, bin, speed, repeat)).or_default();
            cell.sum += residual[i];
            cell.squares += residual[i] * residual[i];
            cell.count += 1.0;
        }
    }
    let all: Vec<_> = cells.into_iter().collect();
    let mut between = Vec::new();
    let mut within = Vec::new();
    for (a, b) in all.iter().zip(all.iter().skip(1)) {
        let same = (a.0.0, a.0.1, a.0.2, a.0.3) == (b.0.0, b.0.1, b.0.2, b.0.3);
        if same && b.0.4 == a.0.4 + 1 && a.1.count > 0.0 && b.1.count > 0.0 {
            let d = a.1.sum / a.1.count - b.1.sum / b.1.count;
            between.push((d * d / 2.0, a.0.4));
            if b.1.count > 1.0 {
                let mean = b.1.sum / b.1.count;
                within.push((b.1.squares / b.1.count - mean * mean).max(0.0));
            }
        }
    }
    // The first cycle may differ for a reason; where there are three, it stays out.
    let later: Vec<f64> = between.iter().filter(|(_, cycle)| *cycle > 1).map(|(d, _)| *d).collect();
    let mut used =
        if later.len() >= LATER_REPEATS { later } else { between.iter().map(|(d, _)| *d).collect() };
    if used.len() < FEWEST_REPEATS {
        return None;
    }
    let cut = quantile(&mut used, REPEAT_OUTLIERS);
    let kept: Vec<f64> = used.into_iter().filter(|d| *d <= cut).collect();
    let slow = kept.iter().sum::<f64>() / kept.len() as f64;
    let fast = if within.is_empty() { 0.0 } else { median(&mut within) };
    Some((slow + fast).sqrt())
}

/// The autocorrelation of a series at a lag, from products within recordings; 0 where no rows are that far apart.
fn autocorrelation(rows: &Rows, series: &[f64], lag: usize) -> f64 {
    let variance = energy(series) / rows.effective().max(1) as f64;
    let (mut product, mut count) = (0.0, 0.0);
    for i in lag..rows.len() {
        if rows.recording[i] == rows.recording[i - lag]
            && rows.root_weight()[i] > 0.0
            && rows.root_weight()[i - lag] > 0.0
        {
            product += series[i] * series[i - lag];
            count += 1.0;
        }
    }
    if count > 0.0 && variance > 0.0 { product / count / variance } else { 0.0 }
}

/// The sum of the autocorrelation of a residual, in s; at each lag times that of a trace, where one is given.
fn correlation_sum(rows: &Rows, residual: &[f64], trace: Option<&[f64]>, step: f64) -> f64 {
    let mut sum = 0.5;
    let mut lag = 1_usize;
    let mut last = 0_usize;
    while lag < rows.len() / LONGEST_LAG {
        let r = autocorrelation(rows, residual, lag);
        if r < CORRELATION_END {
            break;
        }
        sum += r * trace.map_or(1.0, |t| autocorrelation(rows, t, lag)) * (lag - last) as f64;
        last = lag;
        lag = (lag as f64 * LAG_GROWTH).ceil() as usize;
    }
    2.0 * sum * step
}

/// The correlation time of a residual, s.
pub(crate) fn correlation_time(rows: &Rows, residual: &[f64], step: f64) -> f64 {
    correlation_sum(rows, residual, None, step)
}

/// How many independent rows the amplitude of a trace is estimated from, beside a residual of this correlation time `alone`, s. A slow residual says little
/// about a slow trace, and much about one that changes its sign with every stroke. Not fewer than the residual alone has.
///
/// M. S. Bartlett, J. Royal Statistical Society 98 (1935) 536–543: the variance of a correlation grows with the sum of the products of both
/// autocorrelations.
pub(crate) fn independent_beside(rows: &Rows, residual: &[f64], alone: f64, trace: &[f64], step: f64) -> f64 {
    let effective = rows.effective().max(1) as f64;
    let memory = correlation_sum(rows, residual, Some(trace), step).clamp(step.min(alone), alone);
    (effective * step / memory).clamp(2.0, effective)
}

/// Estimates the noise from the weighted residual of the most flexible model.
pub(crate) fn estimate(rows: &Rows, residual: &[f64], step: f64) -> Noise {
    let effective = rows.effective().max(1) as f64;
    let rms = (energy(residual) / energy(rows.root_weight()).max(1e-12)).sqrt();
    let repeats = from_repeats(rows, residual).map(|sigma| sigma.hypot(resolution::of_stroke(rows)));
    let sigma = repeats.unwrap_or(rms).min(rms);
    let memory = correlation_time(rows, residual, step);
    let independent = (effective * step / memory).clamp(2.0, effective);
    Noise { sigma, from_repeats: repeats.is_some(), memory, independent }
}

/// The largest statistic of each throw of all blocks' signs.
fn largest_of_family(scores: &[&[f64]], inverse: &[f64], throws: usize, random: &mut Random) -> Vec<f64> {
    let blocks = scores.first().map_or(0, |s| s.len());
    // Statistics times throws are a product of matrices, of which both stay in the cache part by part.
    let families: Vec<DMatrix<f64>> = scores
        .chunks(FAMILY_PART)
        .zip(inverse.chunks(FAMILY_PART))
        .map(|(scores, inverse)| DMatrix::from_fn(scores.len(), blocks, |j, b| scores[j][b] * inverse[j]))
        .collect();
    let mut largest = Vec::with_capacity(throws);
    while largest.len() < throws {
        let many = FAMILY_PART.min(throws - largest.len());
        let signs = DMatrix::from_fn(blocks, many, |_, _| if random.next() & 1 == 0 { 1.0 } else { -1.0 });
        let tops: Vec<Vec<f64>> = families
            .par_iter()
            .map(|family| (family * &signs).column_iter().map(|c| c.amax()).collect())
            .collect();
        largest.extend((0..many).map(|t| tops.iter().map(|tops| tops[t]).fold(0.0, f64::max)));
    }
    largest
}

/// The frequency with which the largest of many statistics (sums over blocks, divided by their scatter) exceeds each observed one
/// when the sign of every block is thrown by a coin: p-values that hold for the whole family.
///
/// `scores[j][b]` is statistic `j`'s share from block `b`. Blocks stay whole, so correlation within them does not matter.
pub(crate) fn family_p(scores: &[&[f64]], throws: usize, seed: u64) -> Vec<f64> {
    let inverse: Vec<f64> = scores
        .iter()
        .map(|s| {
            let scatter = energy(s).sqrt();
            if scatter > 0.0 { 1.0 / scatter } else { 0.0 }
        })
        .collect();
    let observed: Vec<f64> =
        scores.iter().zip(&inverse).map(|(s, i)| s.iter().sum::<f64>().abs() * i).collect();
    let largest = largest_of_family(scores, &inverse, throws, &mut Random(seed));
    observed
        .iter()
        .map(|o| {
            let beyond = largest.iter().filter(|l| **l >= *o - 1e-12).count();
            (beyond as f64 + 1.0) / (throws as f64 + 1.0)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{prepare, typical_step};
    use crate::tests::{geometry, loops, recorded};

    /// A residual that drifts slowly through each recording: friction, which changes its sign with every stroke, is estimated beside it
    /// from many rows, a drift from as few as the residual itself.
    #[test]
    fn a_slow_residual_weakens_slow_traces_only() {
        let campaign = recorded(loops(&[0.2]), 4, |_, _| 0.0, |_, _, _| 0.0);
        let (rows, _) = prepare(&campaign, &geometry().build().expect("a braid")).expect("rows");
        let step = typical_step(&rows);
        let middle =
            |i: usize| rows.recording.iter().filter(|r| **r == rows.recording[i]).count() as f64 / 2.0;
        let first = |i: usize| rows.recording.iter().position(|r| *r == rows.recording[i]).unwrap_or(0);
        let slow: Vec<f64> = (0..rows.len())
            .map(|i| rows.root_weight()[i] * ((i - first(i)) as f64 / middle(i) - 1.0))
            .collect();
        let friction: Vec<f64> = rows.root_weight().iter().zip(&rows.sign).map(|(w, s)| w * s).collect();
        let memory = correlation_time(&rows, &slow, step);
        let alone = rows.effective() as f64 * step / memory;
        let of_slow = independent_beside(&rows, &slow, memory, &slow, step);
        let of_friction = independent_beside(&rows, &slow, memory, &friction, step);
        assert!(of_slow < 3.0 * alone, "{of_slow} {alone}");
        assert!(of_friction > 4.0 * of_slow, "{of_friction} {of_slow}");
    }

    #[test]
    fn the_family_is_controlled_and_a_real_one_is_found() {
        let mut random = Random(3);
        let mut alarms = 0;
        for trial in 0..60 {
            let scores: Vec<Vec<f64>> =
                (0..100).map(|_| (0..36).map(|_| random.normal()).collect()).collect();
            let views: Vec<&[f64]> = scores.iter().map(Vec::as_slice).collect();
            let p = family_p(&views, 299, trial);
            alarms += usize::from(p.iter().any(|p| *p <= 0.05));
        }
        assert!(alarms <= 9, "{alarms} of 60 at five percent");
        let mut scores: Vec<Vec<f64>> =
            (0..100).map(|_| (0..36).map(|_| random.normal()).collect()).collect();
        scores[7].iter_mut().for_each(|s| *s += 2.0);
        let views: Vec<&[f64]> = scores.iter().map(Vec::as_slice).collect();
        let p = family_p(&views, 999, 5);
        assert!(p[7] <= 0.002);
    }
}
