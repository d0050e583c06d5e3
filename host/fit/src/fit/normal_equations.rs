//! Normal equations, summed bin by bin.
//!
//! Points of nearly one pressure share their `φ_j`. Their normal equations are a small matrix in the columns
//! `(c̃_1 … c̃_M, −s q, g, z)`. It is spread over the nodes only once per such bin, so that the work per point does not grow
//! with the number of nodes.

use std::ops::Range;

use super::design::{Curves, Design, Layout};
use crate::numerics::symmetric::Symmetric;

/// Normal equations at some parameters: `Σ w J Jᵀ`, `Σ w J r`, `Σ w r²`, `Σ w`.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    /// The matrix `Σ w J Jᵀ`.
    pub matrix: Symmetric,
    /// The right-hand side `Σ w J r`.
    pub right: Vec<f64>,
    /// The weighted sum of squares `Σ w r²`.
    pub misfit: f64,
    /// The sum of weights `Σ w`.
    pub weight: f64,
}

impl NormalEquations {
    pub(super) fn zeros(n: usize) -> Self {
        Self { matrix: Symmetric::zeros(n), right: vec![0.0; n], misfit: 0.0, weight: 0.0 }
    }

    /// With the lower half of the matrix copied to the upper one.
    fn mirrored(mut self) -> Self {
        self.matrix.mirror();
        self
    }

    /// `self + factor · other`.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        self.matrix.add_scaled(&other.matrix, factor);
        for (x, y) in self.right.iter_mut().zip(&other.right) {
            *x += factor * y;
        }
        self.misfit += factor * other.misfit;
        self.weight += factor * other.weight;
    }
}

/// Small sums of one bin.
struct Sums {
    square: Vec<f64>,
    right: Vec<f64>,
    misfit: f64,
    weight: f64,
}

/// Small sums of one bin, of a number of columns that the compiler knows.
struct Fixed<const D: usize> {
    square: [[f64; D]; D],
    right: [f64; D],
    misfit: f64,
    weight: f64,
}

/// The sums of all bins at some parameters and weights. One pass over the points gives them; the normal equations of all points, of each
/// group, and of all groups but one follow without another.
pub(crate) struct BinSums(Vec<(u32, Sums)>);

/// Where sums are taken.
struct At<'a> {
    rows: Range<usize>,
    parameters: &'a [f64],
    curves: &'a Curves,
    weights: &'a [f64],
}

impl Design {
    /// Sums by bin over a stretch of rows; bins without weight there are absent.
    fn sums(
        &self,
        rows: Range<usize>,
        parameters: &[f64],
        curves: &Curves,
        weights: &[f64],
    ) -> Vec<(u32, Sums)> {
        let at = At { rows, parameters, curves, weights };
        // A number of columns that the compiler knows takes half the time; extra columns come with few points.
        match (self.orthonormal.order + 2, self.extras) {
            (3, 0) => self.sums_of::<3>(at),
            (4, 0) => self.sums_of::<4>(at),
            (5, 0) => self.sums_of::<5>(at),
            (6, 0) => self.sums_of::<6>(at),
            (7, 0) => self.sums_of::<7>(at),
            (8, 0) => self.sums_of::<8>(at),
            _ => self.sums_with_extras(at),
        }
    }

    /// [`Design::sums`] of `D` columns, which are `M + 2`.
    fn sums_of<const D: usize>(&self, at: At<'_>) -> Vec<(u32, Sums)> {
        let mut place = vec![u32::MAX; self.bins.len()];
        let mut sums: Vec<(u32, Fixed<D>)> = Vec::new();
        let deadband = at.parameters[Layout::DEADBAND];
        for (row, w) in self.rows[at.rows.clone()].iter().zip(&at.weights[at.rows]) {
            let w = *w;
            if w <= 0.0 {
                continue;
            }
            let curves = at.curves.at::<D>(row.bin);
            let mut quasi = (row.pressure - self.origin - deadband) * row.area;
            for (e, c) in curves[..D - 2].iter().zip(&row.elastic) {
                quasi += e * c;
            }
            let grip = 1.0 - row.direction * curves[D - 2];
            let r = row.force - grip * quasi;
            let mut y = [0.0; D];
            for (y, c) in y[..D - 2].iter_mut().zip(&row.elastic) {
                *y = grip * c;
            }
            y[D - 2] = -row.direction * quasi;
            y[D - 1] = -grip * row.area;
            let place = &mut place[row.bin as usize];
            if *place == u32::MAX {
                *place = sums.len() as u32;
                sums.push((
                    row.bin,
                    Fixed { square: [[0.0; D]; D], right: [0.0; D], misfit: 0.0, weight: 0.0 },
                ));
            }
            let s = &mut sums[*place as usize].1;
            // The upper half is not used; whole rows are quicker than halves.
            for ((square, right), ya) in s.square.iter_mut().zip(&mut s.right).zip(&y) {
                let wy = w * ya;
                *right += wy * r;
                for (to, yb) in square.iter_mut().zip(&y) {
                    *to += wy * yb;
                }
            }
            s.misfit += w * r * r;
            s.weight += w;
        }
        let general = |s: Fixed<D>| Sums {
            square: s.square.concat(),
            right: s.right.to_vec(),
            misfit: s.misfit,
            weight: s.weight,
        };
        sums.into_iter().map(|(bin, s)| (bin, general(s))).collect()
    }

    /// [`Design::sums`] of any number of columns.
    fn sums_with_extras(&self, at: At<'_>) -> Vec<(u32, Sums)> {
        let d = self.orthonormal.order + 2 + self.extras;
        let mut place = vec![u32::MAX; self.bins.len()];
        let mut sums: Vec<(u32, Sums)> = Vec::new();
        let mut y = vec![0.0; d];
        for i in at.rows {
            let (row, w) = (&self.rows[i], at.weights[i]);
            if w <= 0.0 {
                continue;
            }
            let e = self.evaluate(i, at.parameters, at.curves);
            let r = row.force - e.force;
            self.small_columns(i, &e, &mut y);
            let place = &mut place[row.bin as usize];
            if *place == u32::MAX {
                *place = sums.len() as u32;
                let empty = Sums { square: vec![0.0; d * d], right: vec![0.0; d], misfit: 0.0, weight: 0.0 };
                sums.push((row.bin, empty));
            }
            let s = &mut sums[*place as usize].1;
            for (a, ya) in y.iter().enumerate() {
                let wy = w * ya;
                s.right[a] += wy * r;
                for (to, yb) in s.square[a * d..=a * d + a].iter_mut().zip(&y) {
                    *to += wy * yb;
                }
            }
            s.misfit += w * r * r;
            s.weight += w;
        }
        sums
    }

    /// Adds the sums of one bin to the lower half of the matrix and to the other sums; [`NormalEquations::mirrored`] completes them.
    fn expand(&self, sums: &Sums, phi: &[f64], into: &mut NormalEquations) {
        if sums.weight <= 0.0 {
            return;
        }
        let layout = self.layout();
        let (m, n) = (layout.order, layout.len());
        let d = m + 2 + self.extras;
        into.misfit += sums.misfit;
        into.weight += sums.weight;
        self.spread(&sums.right, phi, 1.0, &mut into.right);
        // Functions that vanish here are left out: with few nodes none does, and nothing is lost. The others are neighbours.
        let live = phi.iter().position(|p| *p != 0.0).unwrap_or(0)
            ..phi.iter().rposition(|p| *p != 0.0).map_or(0, |last| last + 1);
        let phi = &phi[live.clone()];
        // `Σ value φ_i φ_j` into the block of the columns `a` and `b`.
        let block = |matrix: &mut Symmetric, a: usize, b: usize, value: f64| {
            for (i, p) in live.clone().zip(phi) {
                let v = value * p;
                let at = layout.elastic(a, i) * n + layout.elastic(b, live.start);
                for (to, q) in matrix.a[at..at + phi.len()].iter_mut().zip(phi) {
                    *to += v * q;
                }
            }
        };
        let place = |a: usize| if a == m + 1 { Layout::DEADBAND } else { layout.extra(a - m - 2) };
        for a in 0..d {
            for b in 0..=a {
                let value = sums.square[a * d + b];
                if value == 0.0 {
                    continue;
                }
                match (a <= m, b <= m) {
                    (true, true) => block(&mut into.matrix, a, b, value),
                    (false, true) => {
                        for (j, p) in live.clone().zip(phi) {
                            into.matrix.add(place(a), layout.elastic(b, j), value * p);
                        }
                    }
                    _ => into.matrix.add(place(a), place(b), value),
                }
            }
        }
    }

    /// The sums over all points.
    #[must_use]
    pub(crate) fn bin_sums(&self, parameters: &[f64], weights: &[f64]) -> BinSums {
        BinSums(self.sums(0..self.rows.len(), parameters, &self.curves(parameters), weights))
    }

    /// The normal equations of the groups that `take` chooses: as if the weights of all other points were zero.
    #[must_use]
    pub(crate) fn normal_of_groups(&self, sums: &BinSums, take: impl Fn(usize) -> bool) -> NormalEquations {
        let mut normal = NormalEquations::zeros(self.layout().len());
        for (bin, s) in &sums.0 {
            let bin = &self.bins[*bin as usize];
            if take(bin.group as usize) {
                self.expand(s, &bin.phi, &mut normal);
            }
        }
        normal.mirrored()
    }

    /// The normal equations of all points.
    #[must_use]
    pub fn normal(&self, parameters: &[f64], weights: &[f64]) -> NormalEquations {
        self.normal_of_groups(&self.bin_sums(parameters, weights), |_| true)
    }

    /// The normal equations of a stretch of points. `curves` are those of `parameters`.
    #[must_use]
    pub(crate) fn normal_of(
        &self,
        rows: Range<usize>,
        parameters: &[f64],
        curves: &Curves,
        weights: &[f64],
    ) -> NormalEquations {
        let mut normal = NormalEquations::zeros(self.layout().len());
        for (bin, s) in self.sums(rows, parameters, curves, weights) {
            self.expand(&s, &self.bins[bin as usize].phi, &mut normal);
        }
        normal.mirrored()
    }

    /// The normal equations of each group alone.
    #[must_use]
    pub(crate) fn normal_by_group(&self, sums: &BinSums) -> Vec<NormalEquations> {
        let mut normals = vec![NormalEquations::zeros(self.layout().len()); self.groups];
        for (bin, s) in &sums.0 {
            let bin = &self.bins[*bin as usize];
            if let Some(normal) = normals.get_mut(bin.group as usize) {
                self.expand(s, &bin.phi, normal);
            }
        }
        normals.into_iter().map(NormalEquations::mirrored).collect()
    }
}
