//! Error measures: the model against the mid-line of the hysteresis loop, percent of blocked force.
//!
//! ```text
//! e = |F_model − F_AVG| / F_B(P)                                     thesis, eq. 24
//! ```
//! `F_B(P)` counts as at least a twentieth of that of the highest pressure
//! ([`blocked_for_errors`](super::prepared::Prepared::blocked_for_errors)): at the deadband it is zero.
//!
//! Chunks are those of the mid-line ([`super::chunks`]); in each the residual `F − F_model` (each sample with its own pressure and
//! direction) is averaged per branch, and the branches are averaged. Where both branches are there, the friction of either cancels in
//! the model as in the measurement, so that this is eq. 24 on loops at constant pressure. It also holds where pressure moves and where
//! only one branch was recorded (then the model's friction stands in for the missing branch). Samples just after a turn lie between
//! the branches and belong to neither: they count in no mid-line.
//!
//! ```
//! use pam_fit::fit::chunks::Place;
//! use pam_fit::fit::errors::{Sample, by_chunk, errors};
//!
//! // One chunk: 2 N too much while shortening, 1 N too little while lengthening; F_B is 200 N.
//! let at = |direction, residual| Sample {
//!     place: Place { group: 0, fine: 0, contraction: 0.0011, direction, rows: 1.0 }, residual, blocked: 200.0,
//! };
//! let chunks = by_chunk([at(1.0, 2.0), at(-1.0, -1.0)]);
//! // The mid-line is off by half a newton: a quarter of a percent.
//! assert!((errors(&chunks, |_| true).mean - 0.25).abs() < 1e-12);
//! ```

use super::chunks::{Place, cut};
use super::prepared::Prepared;

/// One sample, or a mean over some.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Its chunk and branch.
    pub place: Place,
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
    cut(samples.into_iter().map(|s| (s.place, [s.residual, s.blocked])))
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
pub fn chunks(prepared: &Prepared, residuals: &[f64], take: impl Fn(u32) -> bool) -> Vec<ChunkError> {
    let samples = prepared.counted().filter(|(_, place)| take(place.group)).map(|(i, place)| Sample {
        place,
        residual: residuals[i],
        blocked: prepared.blocked_for_errors(prepared.points.list[i].pressure),
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
