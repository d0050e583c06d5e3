//! The linear algebra of the diagnosis: orthonormal bases of tall thin sets of columns, and amplitudes with signs.
//!
//! Columns are long (one entry per row of a recording) and few. Everything is computed column by column in a fixed
//! order, so a result does not depend on how many threads share the columns among them.

use rayon::prelude::*;

use super::criteria::baseline::{CACHED_ROWS, DEPENDENT_COLUMN, PRODUCT_PART};
use super::criteria::candidates::MOST_AMPLITUDES;

/// Sum of products.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    if a.len() <= PRODUCT_PART {
        return dot_of_part(a, b);
    }
    let parts: Vec<f64> =
        a.par_chunks(PRODUCT_PART).zip(b.par_chunks(PRODUCT_PART)).map(|(a, b)| dot_of_part(a, b)).collect();
    parts.iter().sum()
}

fn dot_of_part(a: &[f64], b: &[f64]) -> f64 {
    // Four partial sums: the compiler vectorises, and the order of summation stays fixed.
    let mut sums = [0.0; 4];
    let (ca, cb) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = ca.remainder().iter().zip(cb.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in ca.zip(cb) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

/// Sum of squares.
pub(crate) fn energy(a: &[f64]) -> f64 {
    dot(a, a)
}

/// `to += factor · from`.
pub(crate) fn add_scaled(to: &mut [f64], factor: f64, from: &[f64]) {
    let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(t, f)| *t += factor * f);
    if to.len() <= PRODUCT_PART {
        add(to, from);
    } else {
        to.par_chunks_mut(PRODUCT_PART)
            .zip(from.par_chunks(PRODUCT_PART))
            .for_each(|(to, from)| add(to, from));
    }
}

/// Part of a column: its values from a row on, zero elsewhere.
#[derive(Clone, Copy)]
pub(crate) struct Stretch<'a> {
    from: usize,
    values: &'a [f64],
}

impl<'a> Stretch<'a> {
    /// A whole column.
    pub(crate) fn whole(values: &'a [f64]) -> Self {
        Self { from: 0, values }
    }

    /// The values within `from..to`, and the first row of these.
    fn within(self, from: usize, to: usize) -> (usize, &'a [f64]) {
        let begin = from.max(self.from);
        let end = to.min(self.from + self.values.len());
        if begin < end { (begin, &self.values[begin - self.from..end - self.from]) } else { (from, &[]) }
    }
}

/// Scalar products of `v` with many columns. Rows are taken in blocks that stay in the cache, so that `v` is read from memory once.
pub(crate) fn products(columns: &[Stretch], v: &[f64]) -> Vec<f64> {
    let of_part = |part: usize, v: &[f64]| {
        let mut sums = vec![0.0; columns.len()];
        let first = part * PRODUCT_PART;
        for (block, v) in v.chunks(CACHED_ROWS).enumerate() {
            let from = first + block * CACHED_ROWS;
            for (sum, column) in sums.iter_mut().zip(columns) {
                let (begin, values) = column.within(from, from + v.len());
                *sum += dot_of_part(values, &v[begin - from..begin - from + values.len()]);
            }
        }
        sums
    };
    if v.len() <= PRODUCT_PART {
        return of_part(0, v);
    }
    let parts: Vec<Vec<f64>> =
        v.par_chunks(PRODUCT_PART).enumerate().map(|(part, v)| of_part(part, v)).collect();
    (0..columns.len()).map(|j| parts.iter().map(|p| p[j]).sum()).collect()
}

/// `to += Σ factors · columns`, by the same blocks.
pub(crate) fn add_all(to: &mut [f64], factors: &[f64], columns: &[Stretch]) {
    let of_part = |part: usize, to: &mut [f64]| {
        let first = part * PRODUCT_PART;
        for (block, to) in to.chunks_mut(CACHED_ROWS).enumerate() {
            let from = first + block * CACHED_ROWS;
            let end = from + to.len();
            for (factor, column) in factors.iter().zip(columns) {
                let (begin, values) = column.within(from, end);
                to[begin - from..].iter_mut().zip(values).for_each(|(t, f)| *t += factor * f);
            }
        }
    };
    if to.len() <= PRODUCT_PART {
        of_part(0, to);
    } else {
        to.par_chunks_mut(PRODUCT_PART).enumerate().for_each(|(part, to)| of_part(part, to));
    }
}

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

/// Which signs an amplitude may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    /// Either.
    Free,
    /// Zero or more.
    Positive,
    /// Zero or less.
    Negative,
}

/// Amplitudes of few columns `z` against `r` by least squares under sign constraints, and the energy they remove.
///
/// All subsets of up to `most` columns are tried (there are few), so the constrained optimum is exact.
pub(crate) fn amplitudes(gram: &[Vec<f64>], moment: &[f64], signs: &[Sign], most: u32) -> (Vec<f64>, f64) {
    let n = moment.len();
    let mut best = (vec![0.0; n], 0.0);
    for subset in (1_u32..(1 << n.min(MOST_AMPLITUDES as usize))).filter(|s| s.count_ones() <= most) {
        let chosen: Vec<usize> = (0..n).filter(|i| subset & (1 << i) != 0).collect();
        let Some(solution) = solve_symmetric(gram, moment, &chosen) else { continue };
        let allowed = chosen.iter().zip(&solution).all(|(i, a)| match signs[*i] {
            Sign::Free => true,
            Sign::Positive => *a >= 0.0,
            Sign::Negative => *a <= 0.0,
        });
        let gain: f64 = chosen.iter().zip(&solution).map(|(i, a)| a * moment[*i]).sum();
        if allowed && gain > best.1 {
            let mut full = vec![0.0; n];
            for (i, a) in chosen.iter().zip(solution) {
                full[*i] = a;
            }
            best = (full, gain);
        }
    }
    best
}

/// Solves the sub-system of `chosen` unknowns by Cholesky; `None` where it is singular.
pub(crate) fn solve_symmetric(gram: &[Vec<f64>], moment: &[f64], chosen: &[usize]) -> Option<Vec<f64>> {
    let n = chosen.len();
    let scale: Vec<f64> = chosen.iter().map(|i| gram[*i][*i].sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let mut v = gram[chosen[i]][chosen[j]] / (scale[i] * scale[j]);
            for k in 0..j {
                v -= l[i][k] * l[j][k];
            }
            if i == j {
                if v <= 1e-10 {
                    return None;
                }
                l[i][i] = v.sqrt();
            } else {
                l[i][j] = v / l[j][j];
            }
        }
    }
    let mut x: Vec<f64> = chosen.iter().zip(&scale).map(|(i, s)| moment[*i] / s).collect();
    for i in 0..n {
        for k in 0..i {
            x[i] -= l[i][k] * x[k];
        }
        x[i] /= l[i][i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            x[i] -= l[k][i] * x[k];
        }
        x[i] /= l[i][i];
    }
    Some(x.iter().zip(&scale).map(|(v, s)| v / s).collect())
}

/// A small, fast generator of reproducible random numbers (SplitMix64; G. Steele et al., OOPSLA 2014), for permutations.
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// Uniform in `0..n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
    /// Uniform in [0, 1).
    #[cfg(test)]
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
    /// Standard normal (Box and Muller).
    #[cfg(test)]
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_are_zero_on_most_rows_make_the_same_basis() {
        let mut random = Random(3);
        let stretch = |from: usize, to: usize| -> Vec<f64> {
            (0..90).map(|i| if (from..to).contains(&i) { 1.0 + i as f64 } else { 0.0 }).collect()
        };
        let (first, second) = (stretch(10, 20), stretch(20, 35));
        let whole: Vec<f64> = (0..90).map(|_| random.normal()).collect();
        let y: Vec<f64> = (0..90).map(|i| 2.0 * first[i] - 3.0 * second[i] + 0.5 * whole[i]).collect();
        let ones = vec![1.0; 90];
        for columns in [[&first, &second, &whole], [&whole, &second, &first]] {
            let basis = Basis::new(&columns.map(Vec::clone), &ones);
            let mut by_stretches = Basis::default();
            for c in columns {
                let at = |v: &f64| *v != 0.0;
                let (from, to) = (c.iter().position(at), c.iter().rposition(at));
                let (from, to) = (from.expect("not zero"), to.expect("not zero") + 1);
                assert!(by_stretches.push_stretch(from, c[from..to].to_vec(), 90));
            }
            for (a, b) in by_stretches.solve(&y).iter().zip(basis.solve(&y)) {
                assert!((a - b).abs() < 1e-12);
            }
            let found = basis.solve(&y);
            let expected = columns.map(|c| {
                if *c == first {
                    2.0
                } else if *c == second {
                    -3.0
                } else {
                    0.5
                }
            });
            for (a, b) in found.iter().zip(expected) {
                assert!((a - b).abs() < 1e-9, "{found:?}");
            }
            let (mut rest, along) = (y.clone(), basis.along(&y));
            basis.project_out(&mut rest);
            assert!(energy(&rest) < 1e-16 * energy(&y));
            assert!((energy(&along) - energy(&y)).abs() < 1e-9 * energy(&y));
            for (q, c) in basis.columns(0, 90).iter().zip(along) {
                assert!((energy(q) - 1.0).abs() < 1e-12 && (dot(q, &y) - c).abs() < 1e-9 * energy(&y).sqrt());
            }
        }
    }

    #[test]
    fn products_by_blocks_are_those_of_whole_columns() {
        let mut random = Random(5);
        let n = PRODUCT_PART + 3 * CACHED_ROWS + 17;
        let column = |random: &mut Random| (0..n).map(|_| random.normal()).collect::<Vec<f64>>();
        let (a, b, v) = (column(&mut random), column(&mut random), column(&mut random));
        let (from, to) = (CACHED_ROWS - 3, PRODUCT_PART + 5);
        let columns = [Stretch::whole(&a), Stretch { from, values: &b[from..to] }];
        let found = products(&columns, &v);
        let whole: Vec<f64> = (0..n).map(|i| if (from..to).contains(&i) { b[i] } else { 0.0 }).collect();
        for (got, want) in found.iter().zip([dot(&a, &v), dot(&whole, &v)]) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
        let mut sum = v.clone();
        add_all(&mut sum, &[2.0, -3.0], &columns);
        for i in 0..n {
            assert!((sum[i] - (v[i] + 2.0 * a[i] - 3.0 * whole[i])).abs() < 1e-12, "row {i}");
        }
    }

    #[test]
    fn nearly_dependent_columns_make_an_orthonormal_basis() {
        let n = 3 * CACHED_ROWS;
        let t: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
        // Powers of a number between 0 and 1: the ninth differs from the others by a millionth of itself.
        let columns: Vec<Vec<f64>> = (0..9).map(|k| t.iter().map(|t| t.powi(k)).collect()).collect();
        let basis = Basis::new(&columns, &vec![1.0; n]);
        assert_eq!(basis.rank(), 9);
        let q = basis.columns(0, n);
        for (i, a) in q.iter().enumerate() {
            for (j, b) in q.iter().enumerate() {
                let want = f64::from(u8::from(i == j));
                assert!((dot(a, b) - want).abs() < 1e-12, "{i} {j}: {}", dot(a, b));
            }
        }
    }

    #[test]
    fn coefficients_of_an_exact_combination_come_back_and_dependent_columns_are_left_out() {
        let n = 200;
        let t: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
        let columns = vec![
            vec![1.0; n],
            t.clone(),
            t.iter().map(|v| 2.0 * v - 1.0).collect(),
            t.iter().map(|v| v * v * v).collect(),
        ];
        let w: Vec<f64> = t.iter().map(|v| 0.5 + v).collect();
        let basis = Basis::new(&columns, &w);
        assert_eq!(basis.rank(), 3);
        let y: Vec<f64> = t.iter().map(|v| 3.0 - 2.0 * v + 0.7 * v.powi(3)).collect();
        let c = basis.solve(&weighted(&y, &w));
        for (got, want) in c.iter().zip([3.0, -2.0, 0.0, 0.7]) {
            assert!((got - want).abs() < 1e-9, "{c:?}");
        }
    }

    #[test]
    fn amplitudes_keep_their_signs() {
        // r = 2 a − b with nearly parallel a and b: without b allowed below zero, a alone must serve.
        let gram = vec![vec![1.0, 0.9], vec![0.9, 1.0]];
        let moment = vec![2.0 - 0.9, 1.8 - 1.0];
        let (free, gain_free) = amplitudes(&gram, &moment, &[Sign::Free, Sign::Free], 2);
        assert!((free[0] - 2.0).abs() < 1e-9 && (free[1] + 1.0).abs() < 1e-9);
        let (signed, gain) = amplitudes(&gram, &moment, &[Sign::Positive, Sign::Positive], 2);
        assert!((signed[0] - 1.1).abs() < 1e-9 && signed[1] == 0.0 && gain < gain_free);
    }
}
