//! Error measures: the model against the mid-line of the hysteresis loop, percent of blocked force.
//!
//! ```text
//! e = |F_model − F_AVG| / F_B(P)                                     thesis, eq. 24
//! ```
//! `F_B(P)` counts as at least a twentieth of that of the highest pressure
//! ([`blocked_for_errors`](super::solution::Solution::blocked_for_errors)): at the deadband it is zero.
//!
//! Chunks are those of the mid-line ([`super::chunks`]); in each the residual `F − F_model` (each sample with its own pressure and
//! direction) is averaged per branch, and the branches are averaged. Where both branches are there, the friction of either cancels in
//! the model as in the measurement, so that this is eq. 24 on loops at constant pressure. It also holds where pressure moves and where
//! only one branch was recorded (then the model's friction replaces the missing branch). Samples just after a reversal lie between
//! the branches and belong to neither: they count in no mid-line.

use super::chunks::{Place, in_chunks};
use super::solution::Solution;

/// A residual, of one row or of the mean of several.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// Chunk and branch of the sample.
    pub place: Place,
    /// The residual `F − F_model`, N.
    pub residual: f64,
    /// The blocked force `F_B` at the pressure of the sample, N.
    pub blocked: f64,
}

/// Errors of one group of chunks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Errors {
    /// Mean absolute error over chunks, percent of blocked force.
    pub mean: f64,
    /// Largest absolute error of a chunk, percent of blocked force.
    pub max: f64,
    /// The number of chunks.
    pub chunks: usize,
}

/// The error of one chunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChunkError {
    /// Index of the tested level, or of the interval of a continuous range.
    pub group: u32,
    /// Contraction ΔL/L0 of the middle of the chunk.
    pub contraction: f64,
    /// The signed error `(F_AVG − F_model) / F_B`, percent.
    pub percent: f64,
}

/// The error of every chunk.
#[must_use]
pub(crate) fn by_chunk(samples: impl IntoIterator<Item = Sample>) -> Vec<ChunkError> {
    in_chunks(samples.into_iter().map(|s| (s.place, [s.residual, s.blocked])))
        .into_iter()
        .filter_map(|chunk| {
            let [residual, blocked] = chunk.mean();
            (blocked > 0.0).then(|| ChunkError {
                group: chunk.group,
                contraction: chunk.contraction,
                percent: 100.0 * residual / blocked,
            })
        })
        .collect()
}

/// Errors by eq. 24 of points that took part and that `take` accepts.
pub(crate) fn chunks(solution: &Solution, residuals: &[f64], take: impl Fn(u32) -> bool) -> Vec<ChunkError> {
    let samples = solution.counted_points().filter(|(_, place)| take(place.group)).map(|(i, place)| Sample {
        place,
        residual: residuals[i],
        blocked: solution.blocked_for_errors(solution.problem.points.list[i].pressure),
    });
    by_chunk(samples)
}

/// Mean and largest error of chunks that `take` accepts.
#[must_use]
pub(crate) fn errors(chunks: &[ChunkError], take: impl Fn(&ChunkError) -> bool) -> Errors {
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
        let place = Place { group: 0, fine: 0, contraction, direction, rows: 1.0 };
        Sample { place, residual, blocked: 200.0 }
    }

    #[test]
    fn errors_are_means_and_largest_of_chunks() {
        let e = errors(
            &by_chunk([sample(0.0011, 1.0, 2.0), sample(0.0015, -1.0, -1.0), sample(0.0021, 1.0, -8.0)]),
            |_| true,
        );
        assert_eq!(e.chunks, 2);
        assert!((e.mean - 2.125).abs() < 1e-12 && (e.max - 4.0).abs() < 1e-12);
    }
}
