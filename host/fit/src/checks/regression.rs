//! Least squares whose standard deviations go by whole blocks: neighbouring samples of a sensor are no independent samples.
//!
//! A check has a dozen blocks or less, and a block that pulls the line towards itself leaves little of its own error to see: so every
//! block is left out in turn (the jackknife of clusters; R. M. Bell, D. F. McCaffrey, Survey Methodology 28 (2002) 169–181).

use nalgebra::{DMatrix, DVector};

/// A solution with its standard deviations.
pub(super) struct Solution {
    pub values: Vec<f64>,
    pub deviations: Vec<f64>,
}

/// Normal equations of a stretch of rows.
#[derive(Clone)]
struct Normal {
    gram: DMatrix<f64>,
    moment: DVector<f64>,
}

impl Normal {
    fn of(columns: &[Vec<f64>], sizes: &[f64], y: &[f64], mine: impl Fn(usize) -> bool) -> Self {
        let rows: Vec<usize> = (0..y.len()).filter(|i| mine(*i)).collect();
        let a = DMatrix::from_fn(rows.len(), columns.len(), |i, j| columns[j][rows[i]] / sizes[j]);
        let y = DVector::from_iterator(rows.len(), rows.iter().map(|i| y[*i]));
        Self { gram: a.transpose() * &a, moment: a.transpose() * y }
    }

    /// The solution; `None` where the columns cannot be told apart.
    fn solve(&self) -> Option<DVector<f64>> {
        (self.gram.clone().symmetric_eigenvalues().min() >= 1e-9)
            .then(|| self.gram.clone().cholesky().map(|c| c.solve(&self.moment)))?
    }
}

/// Fits `y` by the columns; rows of one block may be as alike as they like. `None` where the columns cannot be told apart, be it that one
/// block is left out, or there are not more blocks than columns.
pub(super) fn by_blocks(columns: &[Vec<f64>], y: &[f64], block: &[usize]) -> Option<Solution> {
    let mut blocks = block.to_vec();
    blocks.dedup();
    let k = columns.len();
    if blocks.len() <= k || y.len() <= k {
        return None;
    }
    // Columns of one size, so that being singular means the same for all.
    let sizes: Vec<f64> = columns.iter().map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    if sizes.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let all = Normal::of(columns, &sizes, y, |_| true);
    let solution = all.solve()?;
    let without = blocks
        .iter()
        .map(|b| {
            let out = Normal::of(columns, &sizes, y, |i| block[i] == *b);
            Normal { gram: &all.gram - out.gram, moment: &all.moment - out.moment }.solve()
        })
        .collect::<Option<Vec<_>>>()?;
    let n = blocks.len() as f64;
    let deviation = |j: usize| {
        let mean = without.iter().map(|w| w[j]).sum::<f64>() / n;
        ((n - 1.0) / n * without.iter().map(|w| (w[j] - mean).powi(2)).sum::<f64>()).sqrt()
    };
    Some(Solution {
        values: (0..k).map(|j| solution[j] / sizes[j]).collect(),
        deviations: (0..k).map(|j| deviation(j) / sizes[j]).collect(),
    })
}

/// A standard deviation beside a reference that may be off by up to a limit, anywhere within it alike likely (JCGM 100:2008, 4.3.7).
pub(super) fn with_reference(deviation: f64, limit: f64) -> f64 {
    deviation.hypot(limit / 3.0_f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_that_are_shared_by_a_block_are_not_averaged_away() {
        // Ten stays of a hundred samples, each stay off by its own error of one.
        let off = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        let block: Vec<usize> = (0..1000).map(|i| i / 100).collect();
        let y: Vec<f64> = block.iter().map(|b| 5.0 + off[*b]).collect();
        let s = by_blocks(&[vec![1.0; 1000]], &y, &block).expect("solvable");
        assert!((s.values[0] - 5.0).abs() < 1e-12);
        // One over the root of ten stays (nine degrees of freedom), not of a thousand samples.
        assert!((s.deviations[0] - 1.0 / 3.0).abs() < 0.02, "{}", s.deviations[0]);
    }

    #[test]
    fn what_one_block_alone_tells_is_not_known_to_any_error() {
        // A line through three stays at zero and one at ten: without that one there is no slope.
        let x: Vec<f64> = (0..40).map(|i| if i < 30 { 0.0 } else { 10.0 }).collect();
        let block: Vec<usize> = (0..40).map(|i| i / 10).collect();
        let y: Vec<f64> = x.iter().map(|x| 1.0 + 0.5 * x).collect();
        assert!(by_blocks(&[x.clone(), vec![1.0; 40]], &y, &block).is_none());
    }

    #[test]
    fn columns_that_are_the_same_are_refused() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let block: Vec<usize> = (0..50).map(|i| i / 5).collect();
        assert!(by_blocks(&[x.clone(), x.iter().map(|v| 2.0 * v).collect()], &x, &block).is_none());
    }
}
