//! Chunks of a loop: what the thesis averages over to draw a mid-line through the two branches of hysteresis.
//!
//! The thesis cuts the stroke into chunks, 500 per unit of contraction, and averages in each over both branches and all cycles. So here,
//! but each branch is first averaged separately: a branch that the recording dwelled on does not pull the mid-line to its side. Chunks
//! are cut in pressure too where pressure moves. One that holds less than a tenth of the rows of the median chunk of its group is no
//! mid-line: the noise of the stroke puts a row or two beyond rest length, and these are no mean of a loop.

use std::collections::BTreeMap;

use pam_data::statistics::median;

/// Chunks per unit of contraction.
pub(crate) const PER_CONTRACTION: f64 = 500.0;

/// A chunk with fewer rows than this share of the median chunk's is no mid-line.
const LEAST_ROWS: f64 = 0.1;

/// Where a sample lies: its chunk, and its branch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Index of the tested level, or of the interval of a continuous range.
    pub group: u32,
    /// A finer cut of pressure, where it moves; 0 for levels.
    pub fine: u32,
    /// Contraction ΔL/L0.
    pub contraction: f64,
    /// +1 shortening, −1 lengthening, 0 unknown.
    pub direction: f64,
    /// How many rows the sample represents.
    pub rows: f64,
}

/// One chunk: the means of `N` quantities on each of its branches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chunk<const N: usize> {
    /// The tested level, or the interval of a continuous range.
    pub group: u32,
    /// ΔL/L0 of its middle.
    pub contraction: f64,
    /// While lengthening, with no known direction, while shortening; `None` where there is no such row.
    pub branches: [Option<[f64; N]>; 3],
}

impl<const N: usize> Chunk<N> {
    /// The means of all branches that are there, each with the same weight.
    #[must_use]
    pub(crate) fn mean(&self) -> [f64; N] {
        let present = self.branches.iter().flatten();
        let n = present.clone().count() as f64;
        std::array::from_fn(|i| present.clone().map(|b| b[i]).sum::<f64>() / n)
    }
}

/// Rows, and the sums of the quantities over them, of each branch.
type Sums<const N: usize> = [(f64, [f64; N]); 3];

/// Cuts samples of `N` quantities into chunks, in order of group, finer pressure and contraction.
#[must_use]
pub(crate) fn in_chunks<const N: usize>(
    samples: impl IntoIterator<Item = (Place, [f64; N])>,
) -> Vec<Chunk<N>> {
    let mut sums: BTreeMap<(u32, u32, i64), Sums<N>> = BTreeMap::new();
    for (at, values) in samples {
        let number = (at.contraction * PER_CONTRACTION).floor() as i64;
        let branches = sums.entry((at.group, at.fine, number)).or_insert([(0.0, [0.0; N]); 3]);
        let (rows, sum) =
            &mut branches[if at.direction > 0.0 { 2 } else { usize::from(at.direction == 0.0) }];
        *rows += at.rows;
        for (s, v) in sum.iter_mut().zip(values) {
            *s += at.rows * v;
        }
    }
    let rows = |branches: &Sums<N>| branches.iter().map(|(rows, _)| rows).sum::<f64>();
    let mut by_group: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for ((group, ..), branches) in &sums {
        by_group.entry(*group).or_default().push(rows(branches));
    }
    let least: BTreeMap<u32, f64> =
        by_group.into_iter().map(|(group, mut rows)| (group, LEAST_ROWS * median(&mut rows))).collect();
    sums.into_iter()
        .filter(|((group, ..), branches)| rows(branches) >= least[group] && rows(branches) > 0.0)
        .map(|((group, _, number), branches)| Chunk {
            group,
            contraction: (number as f64 + 0.5) / PER_CONTRACTION,
            branches: branches.map(|(rows, sum)| (rows > 0.0).then(|| sum.map(|s| s / rows))),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(contraction: f64, direction: f64) -> Place {
        Place { group: 0, fine: 0, contraction, direction, rows: 1.0 }
    }

    #[test]
    fn branches_count_alike_however_many_rows_each_has() {
        // Three rows up at 2, one down at −1: the mean of the two branches is a half.
        let chunks = in_chunks(
            [(0.0011, 1.0, 2.0), (0.0012, 1.0, 2.0), (0.0013, 1.0, 2.0), (0.0015, -1.0, -1.0)]
                .map(|(x, direction, value)| (at(x, direction), [value])),
        );
        assert_eq!(chunks.len(), 1);
        assert_eq!(chunks[0].branches, [Some([-1.0]), None, Some([2.0])]);
        assert_eq!(chunks[0].mean(), [0.5]);
    }

    #[test]
    fn a_row_that_noise_puts_beyond_rest_length_is_no_mid_line() {
        let full = (0..60).map(|i| (at(1e-4 * f64::from(i), 1.0), [0.2]));
        let chunks = in_chunks(full.chain([(at(-1e-5, 1.0), [20.0])]));
        assert_eq!(chunks.len(), 3);
        assert!(
            chunks.iter().all(|c| (c.mean()[0] - 0.2).abs() < 1e-12 && c.contraction > 0.0),
            "{chunks:?}"
        );
    }
}
