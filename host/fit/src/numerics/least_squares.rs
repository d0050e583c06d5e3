//! Small linear least-squares problems.
//!
//! `by_blocks` gives standard deviations for correlated rows: every block is left out in turn, because a block that pulls the
//! solution towards itself leaves little of its own error in the residuals (the jackknife of clusters; R. M. Bell and D. F. McCaffrey,
//! Survey Methodology 28 (2002) 169).

use nalgebra::{DMatrix, DVector};

use super::jackknife::variances;

mod serial_correlation;

/// The `order` coefficients of least squares. A row holds the values of its columns, of which the first `order` count, and its target.
///
/// Columns are scaled to unit size and reduced to a triangle by Householder reflections (QR). The triangle is solved by its singular
/// values, so that combinations which the rows do not determine stay at zero.
///
/// ```
/// use pam_fit::numerics::least_squares::least_squares;
///
/// let rows: Vec<([f64; 2], f64)> = (0..5).map(|x| ([1.0, f64::from(x)], 1.0 + 2.0 * f64::from(x))).collect();
/// let found = least_squares(&rows, 2);
/// assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn least_squares<const N: usize>(rows: &[([f64; N], f64)], order: usize) -> Vec<f64> {
    if rows.is_empty() || order == 0 {
        return vec![0.0; order];
    }
    let size = |k: usize| rows.iter().map(|(c, _)| c[k] * c[k]).sum::<f64>().sqrt();
    let scale: Vec<f64> = (0..order).map(|k| Some(size(k)).filter(|s| *s > 0.0).unwrap_or(1.0)).collect();
    // The target is one more column: above the triangle's last row it becomes Qᵀ b.
    let height = rows.len().max(order + 1);
    let all = DMatrix::from_fn(height, order + 1, |i, k| match rows.get(i) {
        Some((c, target)) => {
            if k < order {
                c[k] / scale[k]
            } else {
                *target
            }
        }
        None => 0.0,
    });
    let triangle = all.qr().unpack_r();
    let solution = triangle
        .view((0, 0), (order, order))
        .into_owned()
        .svd(true, true)
        .solve(&triangle.view((0, order), (order, 1)).into_owned(), 1e-9);
    match solution {
        Ok(x) => x.iter().zip(&scale).map(|(x, s)| x / s).collect(),
        Err(_) => vec![0.0; order],
    }
}

/// Coefficients with their standard deviations, in the unit of the target per unit of each column.
#[derive(Debug, Clone)]
pub(crate) struct BlockSolution {
    /// The coefficients.
    pub values: Vec<f64>,
    /// Their standard deviations.
    pub deviations: Vec<f64>,
    /// Degrees of freedom of these deviations: blocks beyond the columns, fewer where blocks share slow noise.
    pub freedom: f64,
}

/// Normal equations of some rows.
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

    /// The solution; `None` where the columns are linearly dependent.
    fn solve(&self) -> Option<DVector<f64>> {
        (self.gram.clone().symmetric_eigenvalues().min() >= 1e-9)
            .then(|| self.gram.clone().cholesky().map(|c| c.solve(&self.moment)))?
    }
}

/// Fits `y` by the columns. Rows of one block may be correlated; standard deviations come from leaving each block out in turn. With the
/// times of the rows, s, rising, what neighbouring blocks share of slow noise counts, too.
///
/// `None` where the columns are linearly dependent, with all blocks or with one left out, or where there are no more blocks than
/// columns.
#[must_use]
pub(crate) fn by_blocks(
    columns: &[Vec<f64>],
    y: &[f64],
    block: &[usize],
    time: Option<&[f64]>,
) -> Option<BlockSolution> {
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
    let variances = variances(&without.iter().map(|w| w.as_slice()).collect::<Vec<_>>());
    let values: Vec<f64> = (0..k).map(|j| solution[j] / sizes[j]).collect();
    let fitted = |i: usize| (0..k).map(|j| values[j] * columns[j][i]).sum::<f64>();
    let residual: Vec<f64> = y.iter().enumerate().map(|(i, y)| y - fitted(i)).collect();
    let shared = time.and_then(|time| serial_correlation::correlated(columns, &residual, block, time));
    let factor = |j: usize| shared.as_ref().map_or(1.0, |s| s.factors[j]);
    let freedom = (blocks.len() - k) as f64;
    Some(BlockSolution {
        deviations: (0..k).map(|j| factor(j) * variances[j].sqrt() / sizes[j]).collect(),
        freedom: shared.as_ref().map_or(freedom, |s| s.freedom.min(freedom)),
        values,
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
        let s = by_blocks(&[vec![1.0; 1000]], &y, &block, None).expect("solvable");
        assert!((s.values[0] - 5.0).abs() < 1e-12);
        // One over the root of ten stays (nine degrees of freedom), not of a thousand samples.
        assert!((s.deviations[0] - 1.0 / 3.0).abs() < 0.02, "{}", s.deviations[0]);
    }

    #[test]
    fn a_slope_that_one_block_alone_shows_has_no_error() {
        // A line through three stays at zero and one at ten: without that one there is no slope.
        let x: Vec<f64> = (0..40).map(|i| if i < 30 { 0.0 } else { 10.0 }).collect();
        let block: Vec<usize> = (0..40).map(|i| i / 10).collect();
        let y: Vec<f64> = x.iter().map(|x| 1.0 + 0.5 * x).collect();
        assert!(by_blocks(&[x.clone(), vec![1.0; 40]], &y, &block, None).is_none());
    }

    #[test]
    fn columns_that_are_the_same_are_refused() {
        let x: Vec<f64> = (0..50).map(f64::from).collect();
        let block: Vec<usize> = (0..50).map(|i| i / 5).collect();
        assert!(by_blocks(&[x.clone(), x.iter().map(|v| 2.0 * v).collect()], &x, &block, None).is_none());
    }
}
