//! What the table cannot imitate of the columns of effects. All that the design needs to compare two effects is in one small matrix: the table
//! is factorized once per step, however many effects are compared.
//!
//! ```text
//! L   = G_ee − G_te' (G_tt + P)⁻¹ G_te                        G: products of columns of table (t) and effects (e), P: the table's prior
//! d²  = a' L a − (L_c a)' (L_cc + 1/B²)⁻¹ (L_c a)             a: force of one effect, c: columns of its competitor, B: blocked force
//! ```
//! Block elimination: the same as refitting table and competitor together.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::columns::Table;

/// Products of the effects' columns beside a free table, and the table's errors.
#[derive(Debug, Clone)]
pub(crate) struct LeftOver {
    /// Variances of the force at unseen pressures and strokes, N².
    pub(crate) errors: Vec<f64>,
    /// Products of what the table leaves of the effects' columns.
    pub(crate) effects: DMatrix<f64>,
}

impl LeftOver {
    /// From products of all columns, the table's first; nothing where they are not finite.
    pub(crate) fn of(table: &Table, gram: &DMatrix<f64>) -> Option<Self> {
        let precision = table.precision(gram)?;
        Some(Self { errors: table.errors(&precision), effects: eliminated(gram, &precision)? })
    }

    /// The products with each column multiplied by its scale.
    pub(crate) fn scaled(&self, scale: &[f64]) -> DMatrix<f64> {
        let n = self.effects.nrows();
        DMatrix::from_fn(n, n, |i, j| self.effects[(i, j)] * scale[i] * scale[j])
    }
}

/// Products of the later columns with the first ones eliminated, whose factorized block is given.
fn eliminated(gram: &DMatrix<f64>, first: &Cholesky<f64, Dyn>) -> Option<DMatrix<f64>> {
    let m = first.l_dirty().nrows();
    let n = gram.nrows() - m;
    // G_te' (LL')⁻¹ G_te = |L⁻¹ G_te|².
    let mut half = gram.view((0, m), (m, n)).into_owned();
    first
        .l_dirty()
        .solve_lower_triangular_mut(&mut half)
        .then(|| gram.view((m, m), (n, n)) - half.tr_mul(&half))
}

/// The force of one effect beside a free table.
pub(crate) struct Image {
    /// Its product with each column.
    with: DVector<f64>,
    /// Its square.
    square: f64,
}

impl Image {
    /// Of a force given as coefficients of the columns.
    pub(crate) fn of(left: &DMatrix<f64>, force: &DVector<f64>) -> Self {
        let with = left * force;
        Self { square: force.dot(&with), with }
    }

    /// Squared distance from the nearest force that table and these columns imitate. `ridge` limits their amplitudes.
    pub(crate) fn distance(&self, left: &DMatrix<f64>, columns: &[usize], ridge: f64) -> Option<f64> {
        let n = columns.len();
        let mut inner = DMatrix::from_fn(n, n, |i, j| left[(columns[i], columns[j])]);
        for i in 0..n {
            inner[(i, i)] += ridge;
        }
        let cross = DVector::from_fn(n, |i, _| self.with[columns[i]]);
        let factor = Cholesky::new(inner)?;
        Some((self.square - cross.dot(&factor.solve(&cross))).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

    use super::*;

    /// The distance as it is defined: table and competitor refitted together.
    fn refitted(gram: &DMatrix<f64>, m: usize, force: &DVector<f64>, columns: &[usize], ridge: f64) -> f64 {
        let keep: Vec<usize> = (0..m).chain(columns.iter().map(|c| m + c)).collect();
        let mut inner = DMatrix::from_fn(keep.len(), keep.len(), |i, j| gram[(keep[i], keep[j])]);
        for i in 0..keep.len() {
            inner[(i, i)] += if i < m { 0.5 } else { ridge };
        }
        let mut whole = DVector::zeros(gram.nrows());
        whole.rows_mut(m, force.len()).copy_from(force);
        let image = gram * &whole;
        let cross = DVector::from_fn(keep.len(), |i, _| image[keep[i]]);
        whole.dot(&image) - cross.dot(&Cholesky::new(inner).unwrap().solve(&cross))
    }

    #[test]
    fn the_eliminated_table_gives_the_distances_of_the_refitted_one() {
        let (rows, m, n) = (40, 5, 6);
        // Any columns that are not dependent.
        let column = |i: usize, j: usize| ((i * i * (j + 3) + 7 * j) as f64 * 0.37).sin() + 0.2 * j as f64;
        let columns = DMatrix::from_fn(rows, m + n, column);
        let gram = columns.tr_mul(&columns);
        let mut block = gram.view((0, 0), (m, m)).into_owned();
        for i in 0..m {
            block[(i, i)] += 0.5;
        }
        let left = eliminated(&gram, &Cholesky::new(block).unwrap()).unwrap();
        let force = DVector::from_vec(vec![2.0, 0.0, -1.0, 0.0, 0.0, 0.0]);
        for competitor in [&[1][..], &[3, 4], &[5], &[]] {
            let direct = refitted(&gram, m, &force, competitor, 0.1);
            let fast = Image::of(&left, &force).distance(&left, competitor, 0.1).unwrap();
            assert!((fast - direct).abs() < 1e-9 * direct.max(1.0), "{competitor:?}: {fast} {direct}");
        }
    }
}
