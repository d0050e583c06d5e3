//! An orthonormal basis of columns.

use super::products::{Stretch, add_all, energy, products};
use crate::criteria::baseline::DEPENDENT_COLUMN;

/// A unit vector that is zero outside a stretch of rows.
#[derive(Clone, Debug)]
struct Direction {
    from: usize,
    values: Vec<f64>,
}

impl Direction {
    fn new(column: Vec<f64>) -> Self {
        let from = column.iter().position(|v| *v != 0.0).unwrap_or(0);
        let to = column.iter().rposition(|v| *v != 0.0).map_or(0, |i| i + 1);
        let whole = 2 * (to - from) > column.len();
        if whole {
            Self { from: 0, values: column }
        } else {
            Self { from, values: column[from..to].to_vec() }
        }
    }

    fn stretch(&self) -> Stretch<'_> {
        Stretch { from: self.from, values: &self.values }
    }
}

/// An orthonormal basis of weighted columns, with the triangle that leads back to their coefficients.
///
/// Columns that are zero on most rows cost no more than the rows they have, if they come before those that are not.
#[derive(Clone, Debug, Default)]
pub(crate) struct Basis {
    q: Vec<Direction>,
    /// For each kept column: its coefficients on the basis vectors up to its own.
    r: Vec<Vec<f64>>,
    /// Which of the columns offered were kept.
    kept: Vec<usize>,
    offered: usize,
}

impl Basis {
    /// From columns, each multiplied by the square roots of the weights.
    pub(crate) fn new(columns: &[Vec<f64>], root_weight: &[f64]) -> Self {
        let mut basis = Self::default();
        for column in columns {
            basis.push(weighted(column, root_weight));
        }
        basis
    }

    /// Adds a column that is already weighted; `false` when it lies in the basis and is left out.
    pub(crate) fn push(&mut self, column: Vec<f64>) -> bool {
        self.push_beyond(column, DEPENDENT_COLUMN)
    }

    /// The same with another bound on how dependent a column may be.
    pub(crate) fn push_beyond(&mut self, mut column: Vec<f64>, dependent: f64) -> bool {
        let index = self.offered;
        self.offered += 1;
        let before = energy(&column).sqrt();
        if !(before > 0.0 && before.is_finite()) {
            return false;
        }
        let mut r = self.coefficients_out(&mut column);
        // Once more: the first pass leaves what rounding left (classical Gram–Schmidt; Kahan: "twice is enough").
        for (a, b) in r.iter_mut().zip(self.coefficients_out(&mut column)) {
            *a += b;
        }
        let norm = energy(&column).sqrt();
        if norm <= dependent * before {
            return false;
        }
        column.iter_mut().for_each(|v| *v /= norm);
        r.push(norm);
        self.q.push(Direction::new(column));
        self.r.push(r);
        self.kept.push(index);
        true
    }

    /// Adds a weighted column that is zero outside a stretch of rows; `rows` is how many all columns have. It costs no more than
    /// its stretch where no earlier column overlaps it.
    pub(crate) fn push_stretch(&mut self, from: usize, mut values: Vec<f64>, rows: usize) -> bool {
        let to = from + values.len();
        if self.q.iter().any(|q| q.from < to && from < q.from + q.values.len()) {
            let mut column = vec![0.0; rows];
            column[from..to].copy_from_slice(&values);
            return self.push(column);
        }
        let index = self.offered;
        self.offered += 1;
        let norm = energy(&values).sqrt();
        if !(norm > 0.0 && norm.is_finite()) {
            return false;
        }
        values.iter_mut().for_each(|v| *v /= norm);
        let mut r = vec![0.0; self.q.len()];
        r.push(norm);
        self.q.push(Direction { from, values });
        self.r.push(r);
        self.kept.push(index);
        true
    }

    /// How many independent columns it has.
    pub(crate) fn rank(&self) -> usize {
        self.q.len()
    }

    /// Takes out of `v` what lies in the basis; gives how much that was along each vector.
    fn coefficients_out(&self, v: &mut [f64]) -> Vec<f64> {
        let columns: Vec<Stretch> = self.q.iter().map(Direction::stretch).collect();
        let along = products(&columns, v);
        let less: Vec<f64> = along.iter().map(|c| -c).collect();
        add_all(v, &less, &columns);
        along
    }

    /// The orthonormal columns from the `first` on.
    pub(crate) fn columns(&self, first: usize, rows: usize) -> Vec<Vec<f64>> {
        let spread = |q: &Direction| {
            let mut column = vec![0.0; rows];
            column[q.from..q.from + q.values.len()].copy_from_slice(&q.values);
            column
        };
        self.q[first..].iter().map(spread).collect()
    }

    /// What a weighted column has along each of the orthonormal ones.
    pub(crate) fn along(&self, v: &[f64]) -> Vec<f64> {
        products(&self.q.iter().map(Direction::stretch).collect::<Vec<_>>(), v)
    }

    /// Which of the columns offered were kept.
    pub(crate) fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// Takes out of `v` (weighted) what the basis can express.
    pub(crate) fn project_out(&self, v: &mut [f64]) {
        self.coefficients_out(v);
    }

    /// Least-squares coefficients of `y` (weighted) on the columns offered; those left out get zero.
    pub(crate) fn solve(&self, y: &[f64]) -> Vec<f64> {
        let mut rest = y.to_vec();
        self.unravel(&self.coefficients_out(&mut rest))
    }

    /// Coefficients on the columns offered, from those on the orthonormal ones.
    pub(crate) fn unravel(&self, c: &[f64]) -> Vec<f64> {
        let mut solution = vec![0.0; self.offered];
        let mut x = vec![0.0; c.len()];
        for i in (0..c.len()).rev() {
            let mut v = c[i];
            for j in i + 1..c.len() {
                v -= self.r[j][i] * x[j];
            }
            x[i] = v / self.r[i][i];
            solution[self.kept[i]] = x[i];
        }
        solution
    }
}

/// A column times the square roots of the weights.
pub(crate) fn weighted(column: &[f64], root_weight: &[f64]) -> Vec<f64> {
    column.iter().zip(root_weight).map(|(c, w)| c * w).collect()
}
