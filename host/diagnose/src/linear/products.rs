//! Products and sums of long columns, computed in a fixed order.

use rayon::prelude::*;

use crate::criteria::baseline::{CACHED_ROWS, PRODUCT_PART};

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
    pub(super) from: usize,
    pub(super) values: &'a [f64],
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
