//! Least squares whose standard deviations go by whole blocks: neighbouring samples of a sensor are no independent samples.

use nalgebra::{DMatrix, DVector};

/// A solution with its standard deviations.
pub(super) struct Solution {
    pub values: Vec<f64>,
    pub deviations: Vec<f64>,
}

/// Fits `y` by the columns; rows of one block may be as alike as they like. `None` where the columns cannot be told apart or there are
/// not more blocks than columns.
pub(super) fn by_blocks(columns: &[Vec<f64>], y: &[f64], block: &[usize]) -> Option<Solution> {
    let blocks = block.iter().max().map_or(0, |b| b + 1);
    let (n, k) = (y.len(), columns.len());
    if blocks <= k || n <= k {
        return None;
    }
    // Columns of one size, so that being singular means the same for all.
    let sizes: Vec<f64> = columns.iter().map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    if sizes.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let a = DMatrix::from_fn(n, k, |i, j| columns[j][i] / sizes[j]);
    let normal = a.transpose() * &a;
    if normal.clone().symmetric_eigenvalues().min() < 1e-9 {
        return None;
    }
    let inverse = normal.try_inverse()?;
    let solution = &inverse * (a.transpose() * DVector::from_column_slice(y));
    let left = DVector::from_column_slice(y) - &a * &solution;
    let mut scores = DMatrix::<f64>::zeros(blocks, k);
    for i in 0..n {
        for j in 0..k {
            scores[(block[i], j)] += a[(i, j)] * left[i];
        }
    }
    let spread = (blocks as f64) / (blocks - k) as f64;
    let covariance = &inverse * (scores.transpose() * &scores) * &inverse * spread;
    Some(Solution {
        values: (0..k).map(|j| solution[j] / sizes[j]).collect(),
        deviations: (0..k).map(|j| covariance[(j, j)].max(0.0).sqrt() / sizes[j]).collect(),
    })
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
    fn columns_that_are_the_same_are_refused() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let block: Vec<usize> = (0..50).map(|i| i / 5).collect();
        assert!(by_blocks(&[x.clone(), x.iter().map(|v| 2.0 * v).collect()], &x, &block).is_none());
    }
}
