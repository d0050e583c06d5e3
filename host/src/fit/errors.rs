//! Error measures: the model against the mid-line of the hysteresis loop, percent of blocked force.
//!
//! ```text
//! e = |F_model − F_AVG| / F_B(P)                                     thesis, eq. 24
//! ```
//! The thesis cuts the stroke into chunks, 500 per unit of contraction, and averages force and contraction in each over
//! both branches and all cycles. Here the same chunks are taken; in each the residual `F − F_model` (each sample with its
//! own pressure and direction) is averaged per branch, and the branches are averaged. Where both branches are there, the
//! friction of either cancels in the model as in the measurement, so that this is eq. 24 on loops at constant pressure. It also
//! holds where pressure moves (chunks are cut in pressure too, a hundredth of its range) and where only one branch
//! was recorded (then the model's friction stands in for the missing branch). Samples just after a turn lie between the
//! branches and belong to neither: they count in no mid-line. Nor does a chunk that holds less than a tenth of the rows of the
//! median one: the noise of the stroke puts a row or two beyond rest length, and these are no mean of a loop.
//!
//! ```
//! use host::fit::errors::{Sample, by_chunk, errors};
//!
//! // One chunk: 2 N too much while shortening, 1 N too little while lengthening; F_B is 200 N.
//! let at = |direction, residual| Sample {
//!     group: 0, fine: 0, contraction: 0.0011, direction, rows: 1.0, residual, blocked: 200.0,
//! };
//! let chunks = by_chunk([at(1.0, 2.0), at(-1.0, -1.0)]);
//! // The mid-line is off by half a newton: a quarter of a percent.
//! assert!((errors(&chunks, |_| true).mean - 0.25).abs() < 1e-12);
//! ```

use std::collections::BTreeMap;

use super::points::median;
use super::prepared::Prepared;

/// Chunks per unit of contraction.
pub const CHUNKS: f64 = 500.0;

/// A chunk with fewer rows than this share of the median chunk's is no mid-line.
const LEAST_ROWS: f64 = 0.1;

/// One sample, or a mean over some.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// The tested level, or the interval of a continuous range.
    pub group: u32,
    /// A finer cut of pressure, where it moves; 0 for levels.
    pub fine: u32,
    /// ΔL/L0.
    pub contraction: f64,
    /// +1, −1, 0.
    pub direction: f64,
    /// How many rows it stands for.
    pub rows: f64,
    /// `F − F_model`, N.
    pub residual: f64,
    /// `F_B` at its pressure, N.
    pub blocked: f64,
}

/// Errors of one group, or of all.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    /// Mean over chunks, percent.
    pub mean: f64,
    /// Largest of a chunk, percent.
    pub max: f64,
    /// Chunks.
    pub chunks: usize,
}

/// One chunk's error, for pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChunkError {
    /// The group.
    pub group: u32,
    /// ΔL/L0 of the chunk's middle.
    pub contraction: f64,
    /// `(F_AVG − F_model) / F_B`, percent, with its sign.
    pub percent: f64,
}

/// The error of every chunk.
#[must_use]
pub fn by_chunk(samples: impl IntoIterator<Item = Sample>) -> Vec<ChunkError> {
    #[derive(Default)]
    struct Sum {
        rows: [f64; 3],
        residual: [f64; 3],
        blocked: f64,
    }
    let mut sums: BTreeMap<(u32, u32, i64), Sum> = BTreeMap::new();
    for s in samples {
        let chunk = (s.contraction * CHUNKS).floor() as i64;
        let sum = sums.entry((s.group, s.fine, chunk)).or_default();
        let branch = if s.direction > 0.0 { 2 } else { usize::from(s.direction == 0.0) };
        sum.rows[branch] += s.rows;
        sum.residual[branch] += s.rows * s.residual;
        sum.blocked += s.rows * s.blocked;
    }
    let least = least_rows(sums.iter().map(|((group, ..), sum)| (*group, sum.rows.iter().sum())));
    sums.into_iter()
        .filter_map(|((group, _, chunk), sum)| {
            let rows: f64 = sum.rows.iter().sum();
            if rows < least[&group] {
                return None;
            }
            let branches = sum.rows.iter().filter(|n| **n > 0.0).count();
            let residual: f64 =
                (0..3).filter(|b| sum.rows[*b] > 0.0).map(|b| sum.residual[b] / sum.rows[b]).sum();
            let blocked = sum.blocked / rows;
            (branches > 0 && blocked > 0.0).then(|| ChunkError {
                group,
                contraction: (chunk as f64 + 0.5) / CHUNKS,
                percent: 100.0 * residual / branches as f64 / blocked,
            })
        })
        .collect()
}

/// How many rows a chunk of each group must hold to be a mid-line, from the group and the rows of every chunk.
pub(super) fn least_rows(chunks: impl IntoIterator<Item = (u32, f64)>) -> BTreeMap<u32, f64> {
    let mut by_group: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for (group, rows) in chunks {
        by_group.entry(group).or_default().push(rows);
    }
    by_group.into_iter().map(|(group, mut rows)| (group, LEAST_ROWS * median(&mut rows))).collect()
}

/// Errors by eq. 24 of points that took part and that `take` accepts.
pub fn chunks(prepared: &Prepared, residuals: &[f64], take: impl Fn(u32) -> bool) -> Vec<ChunkError> {
    let l0 = prepared.braid.rest_length();
    let pressure = prepared.points.pressure;
    let least = 0.05 * prepared.blocked(pressure.high).abs();
    let samples = (0..prepared.points.list.len()).filter_map(|i| {
        let p = &prepared.points.list[i];
        let group = prepared.design.bins[prepared.design.rows[i].bin as usize].group;
        (prepared.counts(i) && take(group)).then(|| Sample {
            group,
            fine: prepared.fine_pressure(p.pressure),
            contraction: (p.stroke + prepared.shift[i]) / l0,
            direction: p.direction,
            rows: f64::from(p.rows),
            residual: residuals[i],
            // Below the deadband there is no blocked force to compare with.
            blocked: prepared.blocked(p.pressure).max(least),
        })
    });
    by_chunk(samples)
}

/// Mean and largest error of chunks that `take` accepts.
#[must_use]
pub fn errors(chunks: &[ChunkError], take: impl Fn(&ChunkError) -> bool) -> Errors {
    let mut e = Errors::default();
    for c in chunks.iter().filter(|c| take(c)) {
        e.mean += c.percent.abs();
        e.max = e.max.max(c.percent.abs());
        e.chunks += 1;
    }
    if e.chunks > 0 {
        e.mean /= e.chunks as f64;
    }
    e
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(contraction: f64, direction: f64, residual: f64) -> Sample {
        Sample { group: 0, fine: 0, contraction, direction, rows: 1.0, residual, blocked: 200.0 }
    }

    #[test]
    fn branches_count_alike_however_many_rows_each_has() {
        // 3 rows up at +2 N, one down at −1 N: the mid-line is off by 0.5 N of 200 N.
        let rows = [
            sample(0.0011, 1.0, 2.0),
            sample(0.0012, 1.0, 2.0),
            sample(0.0013, 1.0, 2.0),
            sample(0.0015, -1.0, -1.0),
        ];
        let chunks = by_chunk(rows);
        assert_eq!(chunks.len(), 1);
        assert!((chunks[0].percent - 0.25).abs() < 1e-12);
        let other = by_chunk(rows.into_iter().chain([sample(0.0021, 1.0, -8.0)]));
        let e = errors(&other, |_| true);
        assert_eq!(e.chunks, 2);
        assert!((e.mean - 2.125).abs() < 1e-12 && (e.max - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_row_that_noise_puts_beyond_rest_length_is_no_mid_line() {
        let full = (0..60).map(|i| sample(1e-4 * f64::from(i), 1.0, 0.2));
        let e = errors(&by_chunk(full.chain([sample(-1e-5, 1.0, 20.0)])), |_| true);
        assert_eq!(e.chunks, 3);
        assert!((e.max - 0.1).abs() < 1e-12, "{e:?}");
    }
}
