//! All pressures at once: `P0`, every `E_kj` and `k_F,j`, by Gauss–Newton on sufficient statistics.
//!
//! ```text
//! r = F − G q − Σ_m a_m z_m       q = (P − P0) g(L) + Σ_k ẽ_k(P) c̃_k(L)      G = 1 − s k_F(P)
//! ∂F/∂ẽ_kj = G c̃_k φ_j            ∂F/∂k_F,j = −s q φ_j        ∂F/∂P0 = −G g       ∂F/∂a_m = z_m
//! ```
//! The model is linear in `(P0, ẽ, a)` at a given `k_F` and the reverse: from any sensible start a few steps converge
//! quadratically. `z_m` are columns that a caller adds (effects, corrections); they act beside friction.
//!
//! Points of nearly one pressure share their `φ_j`. Their normal equations are summed as a small matrix in the columns
//! `(c̃_1 … c̃_M, −s q, g, z)` and spread over the nodes only once per such bin, so that the work per point does not grow
//! with the number of nodes.

use std::ops::Range;

use model_core::table::MAX_ORDER;

use super::basis::{Orthonormal, PressureBasis};
use super::linear::{Symmetric, dot};

/// One point as the linear problem sees it.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Pa.
    pub pressure: f64,
    /// `g`, m².
    pub area: f64,
    /// `c̃_k`, of unit size.
    pub elastic: [f64; MAX_ORDER],
    /// `s`.
    pub direction: f64,
    /// N.
    pub force: f64,
    /// Its pressure bin.
    pub bin: u32,
}

/// Points of nearly one pressure.
#[derive(Debug, Clone)]
pub struct Bin {
    /// `φ_j` at their mean pressure.
    pub phi: Vec<f64>,
    /// The group that is left out together: a tested level, or an interval of a continuous range.
    pub group: u32,
}

/// The problem.
#[derive(Debug, Clone)]
pub struct Design {
    /// `φ_j`.
    pub basis: PressureBasis,
    /// `c̃ = c T`.
    pub orthonormal: Orthonormal,
    /// One per point.
    pub rows: Vec<Row>,
    /// Pressure bins.
    pub bins: Vec<Bin>,
    /// Number of groups.
    pub groups: usize,
    /// `z_m`, N per unit of `a_m`: `extras` numbers for each row.
    pub extra: Vec<f64>,
    /// Number of extra columns.
    pub extras: usize,
    /// Precision (1/σ²) of a prior about zero for each `a_m`; zero for none.
    pub extra_prior: Vec<f64>,
    /// Whether both directions of motion are there, so that `k_F` can be found.
    pub friction: bool,
    /// What `P0` counts from, Pa: the first unknown is `P0 − origin`.
    pub origin: f64,
    /// How strongly `P0` is held at its origin, N² per Pa² of the data's weight; zero where the points alone decide.
    pub hold_deadband: f64,
    /// A further penalty, where the user asks for more than the points say.
    pub held: Option<Symmetric>,
    /// Weight of a penalty on `E_k` that change with pressure at all; zero but where dimensions are fitted too.
    pub level: f64,
}

/// Where each unknown stands in the vector of all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// `M`.
    pub order: usize,
    /// `J`.
    pub nodes: usize,
    /// Number of `a_m`.
    pub extras: usize,
}

impl Layout {
    /// Of `P0`.
    pub const DEADBAND: usize = 0;

    /// Of `ẽ_kj`, `k` and `j` from 0.
    #[must_use]
    pub fn elastic(&self, k: usize, j: usize) -> usize {
        1 + k * self.nodes + j
    }
    /// Of `k_F,j`.
    #[must_use]
    pub fn friction(&self, j: usize) -> usize {
        1 + self.order * self.nodes + j
    }
    /// Of `a_m`.
    #[must_use]
    pub fn extra(&self, m: usize) -> usize {
        1 + (self.order + 1) * self.nodes + m
    }
    /// Unknowns in all.
    #[must_use]
    pub fn len(&self) -> usize {
        1 + (self.order + 1) * self.nodes + self.extras
    }
    /// Never: there is always `P0`.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }
}

/// Normal equations at some parameters: `Σ w J Jᵀ`, `Σ w J r`, `Σ w r²`, `Σ w`.
#[derive(Debug, Clone)]
pub struct Normal {
    /// `Σ w J Jᵀ`.
    pub matrix: Symmetric,
    /// `Σ w J r`.
    pub right: Vec<f64>,
    /// `Σ w r²`.
    pub misfit: f64,
    /// `Σ w`.
    pub weight: f64,
}

impl Normal {
    fn zeros(n: usize) -> Self {
        Self { matrix: Symmetric::zeros(n), right: vec![0.0; n], misfit: 0.0, weight: 0.0 }
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

/// The parts of the model's force at one row.
#[derive(Debug, Clone, Copy)]
pub struct Evaluated {
    /// `q`, N.
    pub quasi: f64,
    /// `G`.
    pub grip: f64,
    /// The whole force, extra columns included, N.
    pub force: f64,
}

/// The curves at every bin, from one set of parameters.
pub struct Curves {
    order: usize,
    /// Per bin: `ẽ_1 … ẽ_M, k_F`.
    values: Vec<f64>,
}

/// Small sums of one bin.
struct Sums {
    square: Vec<f64>,
    right: Vec<f64>,
    misfit: f64,
    weight: f64,
}

impl Design {
    /// Where each unknown stands.
    #[must_use]
    pub fn layout(&self) -> Layout {
        Layout { order: self.orthonormal.order, nodes: self.basis.nodes().len(), extras: self.extras }
    }

    /// The curves at every bin.
    #[must_use]
    pub fn curves(&self, parameters: &[f64]) -> Curves {
        let layout = self.layout();
        let mut values = Vec::with_capacity(self.bins.len() * (layout.order + 1));
        for bin in &self.bins {
            for k in 0..=layout.order {
                let from = layout.elastic(k, 0);
                values.push(dot(&bin.phi, &parameters[from..from + layout.nodes]));
            }
        }
        Curves { order: layout.order, values }
    }

    /// The model at row `i`.
    #[inline]
    #[must_use]
    pub fn evaluate(&self, i: usize, parameters: &[f64], curves: &Curves) -> Evaluated {
        let row = &self.rows[i];
        let m = curves.order;
        let at = &curves.values[row.bin as usize * (m + 1)..][..=m];
        let mut quasi = (row.pressure - self.origin - parameters[Layout::DEADBAND]) * row.area;
        for (e, c) in at[..m].iter().zip(&row.elastic) {
            quasi += e * c;
        }
        let grip = 1.0 - row.direction * at[m];
        let mut force = grip * quasi;
        if self.extras > 0 {
            let from = parameters.len() - self.extras;
            force += dot(&self.extra[i * self.extras..(i + 1) * self.extras], &parameters[from..]);
        }
        Evaluated { quasi, grip, force }
    }

    /// `ẽ_1 … ẽ_M` at a bin.
    #[must_use]
    pub fn reduced_at<'a>(&self, bin: u32, curves: &'a Curves) -> &'a [f64] {
        &curves.values[bin as usize * (curves.order + 1)..][..curves.order]
    }

    /// `F − F_model` of every row, N.
    #[must_use]
    pub fn residuals(&self, parameters: &[f64]) -> Vec<f64> {
        let curves = self.curves(parameters);
        (0..self.rows.len())
            .map(|i| self.rows[i].force - self.evaluate(i, parameters, &curves).force)
            .collect()
    }

    /// The small columns of row `i`: `(G c̃_1 … G c̃_M, −s q, −G g, z …)`; the first `M + 1` are yet to be spread over nodes.
    #[inline]
    fn small_columns(&self, i: usize, e: &Evaluated, out: &mut [f64]) {
        let row = &self.rows[i];
        let m = self.orthonormal.order;
        for (y, c) in out.iter_mut().zip(&row.elastic).take(m) {
            *y = e.grip * c;
        }
        out[m] = -row.direction * e.quasi;
        out[m + 1] = -e.grip * row.area;
        out[m + 2..].copy_from_slice(&self.extra[i * self.extras..(i + 1) * self.extras]);
    }

    /// The Jacobian's row of point `i`: `∂F/∂θ`.
    #[must_use]
    pub fn gradient(&self, i: usize, parameters: &[f64], curves: &Curves) -> Vec<f64> {
        let layout = self.layout();
        let mut small = vec![0.0; layout.order + 2 + layout.extras];
        self.small_columns(i, &self.evaluate(i, parameters, curves), &mut small);
        let phi = &self.bins[self.rows[i].bin as usize].phi;
        let mut full = vec![0.0; layout.len()];
        self.spread(&small, phi, 1.0, &mut full);
        full
    }

    /// Adds a vector of small columns, spread over nodes by `phi`, times `factor`.
    fn spread(&self, small: &[f64], phi: &[f64], factor: f64, full: &mut [f64]) {
        let layout = self.layout();
        full[Layout::DEADBAND] += factor * small[layout.order + 1];
        for (k, y) in small[..=layout.order].iter().enumerate() {
            let from = layout.elastic(k, 0);
            for (f, p) in full[from..from + layout.nodes].iter_mut().zip(phi) {
                *f += factor * y * p;
            }
        }
        for m in 0..layout.extras {
            full[layout.extra(m)] += factor * small[layout.order + 2 + m];
        }
    }

    /// Sums by bin over a stretch of rows; bins without weight there are absent.
    fn sums(
        &self,
        rows: Range<usize>,
        parameters: &[f64],
        curves: &Curves,
        weights: &[f64],
    ) -> Vec<(u32, Sums)> {
        let d = self.orthonormal.order + 2 + self.extras;
        let mut place = vec![u32::MAX; self.bins.len()];
        let mut sums: Vec<(u32, Sums)> = Vec::new();
        let mut y = vec![0.0; d];
        for i in rows {
            let (row, w) = (&self.rows[i], weights[i]);
            if w <= 0.0 {
                continue;
            }
            let e = self.evaluate(i, parameters, curves);
            let r = row.force - e.force;
            self.small_columns(i, &e, &mut y);
            let at = &mut place[row.bin as usize];
            if *at == u32::MAX {
                *at = sums.len() as u32;
                let empty = Sums { square: vec![0.0; d * d], right: vec![0.0; d], misfit: 0.0, weight: 0.0 };
                sums.push((row.bin, empty));
            }
            let s = &mut sums[*at as usize].1;
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

    fn expand(&self, sums: &Sums, phi: &[f64], into: &mut Normal) {
        if sums.weight <= 0.0 {
            return;
        }
        let layout = self.layout();
        let (m, nodes, n) = (layout.order, layout.nodes, layout.len());
        let d = m + 2 + self.extras;
        into.misfit += sums.misfit;
        into.weight += sums.weight;
        self.spread(&sums.right, phi, 1.0, &mut into.right);
        // Functions that vanish here are left out: with few nodes none does, and nothing is lost.
        let live: Vec<usize> = (0..nodes).filter(|j| phi[*j] != 0.0).collect();
        let place = |a: usize| if a == m + 1 { Layout::DEADBAND } else { layout.extra(a - m - 2) };
        for a in 0..d {
            for b in 0..=a {
                let value = sums.square[a * d + b];
                if value == 0.0 {
                    continue;
                }
                match (a <= m, b <= m) {
                    (true, true) => {
                        for &i in &live {
                            let row = layout.elastic(a, i) * n;
                            let column = layout.elastic(b, 0);
                            let v = value * phi[i];
                            for &j in &live {
                                into.matrix.a[row + column + j] += v * phi[j];
                            }
                        }
                        if a != b {
                            for &i in &live {
                                let row = layout.elastic(b, i) * n;
                                let column = layout.elastic(a, 0);
                                let v = value * phi[i];
                                for &j in &live {
                                    into.matrix.a[row + column + j] += v * phi[j];
                                }
                            }
                        }
                    }
                    (false, true) => {
                        for &j in &live {
                            into.matrix.add(place(a), layout.elastic(b, j), value * phi[j]);
                        }
                    }
                    _ => into.matrix.add(place(a), place(b), value),
                }
            }
        }
    }

    /// The normal equations of all points.
    #[must_use]
    pub fn normal(&self, parameters: &[f64], weights: &[f64]) -> Normal {
        self.normal_of(0..self.rows.len(), parameters, &self.curves(parameters), weights)
    }

    /// The normal equations of a stretch of points. `curves` are those of `parameters`.
    #[must_use]
    pub fn normal_of(
        &self,
        rows: Range<usize>,
        parameters: &[f64],
        curves: &Curves,
        weights: &[f64],
    ) -> Normal {
        let mut normal = Normal::zeros(self.layout().len());
        for (bin, s) in self.sums(rows, parameters, curves, weights) {
            self.expand(&s, &self.bins[bin as usize].phi, &mut normal);
        }
        normal
    }

    /// The normal equations of each group by itself.
    #[must_use]
    pub fn normal_by_group(&self, parameters: &[f64], weights: &[f64]) -> Vec<Normal> {
        let mut normals = vec![Normal::zeros(self.layout().len()); self.groups];
        for (bin, s) in self.sums(0..self.rows.len(), parameters, &self.curves(parameters), weights) {
            let bin = &self.bins[bin as usize];
            if let Some(normal) = normals.get_mut(bin.group as usize) {
                self.expand(&s, &bin.phi, normal);
            }
        }
        normals
    }

    /// A start for the iteration: no friction, no elasticity, this deadband.
    #[must_use]
    pub fn start(&self, deadband: f64) -> Vec<f64> {
        let mut parameters = vec![0.0; self.layout().len()];
        parameters[Layout::DEADBAND] = deadband - self.origin;
        parameters
    }

    /// The penalty on curves that bend, and on unknowns that nothing else holds.
    ///
    /// `bend_elastic` and `bend_friction` weigh the squared second differences of `ẽ_k` (N) and of `k_F` (times the
    /// typical force, N) between neighbouring nodes against the data's mean weight.
    #[must_use]
    pub fn penalty(&self, data: &Normal, bend_elastic: f64, bend_friction: f64) -> Symmetric {
        let layout = self.layout();
        let nodes = self.basis.nodes();
        let mut penalty = Symmetric::zeros(layout.len());
        let scale = data.weight / layout.nodes as f64;
        // Σ w q² over points, from the diagonal of the friction columns: the scale of force in k_F's own equations.
        let force_squared = {
            let all: f64 = (0..layout.nodes)
                .map(|i| {
                    (0..layout.nodes)
                        .map(|j| data.matrix.at(layout.friction(i), layout.friction(j)))
                        .sum::<f64>()
                })
                .sum();
            if data.weight > 0.0 { all / data.weight } else { 0.0 }
        };
        let span = nodes.last().unwrap_or(&0.0) - nodes.first().unwrap_or(&0.0);
        let mean = span / (nodes.len().max(2) - 1) as f64;
        for k in 0..=layout.order {
            let weight =
                if k < layout.order { bend_elastic * scale } else { bend_friction * scale * force_squared };
            let place = |j: usize| layout.elastic(k, j);
            for j in 1..nodes.len().saturating_sub(1) {
                let (before, after) = (nodes[j] - nodes[j - 1], nodes[j + 1] - nodes[j]);
                // ∫ (f″)² over the nodes' share, in units where equal spacing gives the plain second difference.
                let share = 0.5 * (before + after) / mean;
                let unit = mean / (0.5 * (before + after));
                let (a, c) = (unit * mean / before, unit * mean / after);
                let row = [(place(j - 1), a), (place(j), -a - c), (place(j + 1), c)];
                penalty.add_row(&row, weight * share);
            }
            if k < layout.order && self.level > 0.0 {
                for j in 1..nodes.len() {
                    penalty.add_row(&[(place(j - 1), -1.0), (place(j), 1.0)], self.level * scale);
                }
            }
            if k == layout.order {
                // Beyond the data friction tends to stay: a trend continued for long would pass zero or one.
                for j in 1..nodes.len() {
                    penalty.add_row(&[(place(j - 1), -1.0), (place(j), 1.0)], 0.02 * weight);
                }
            }
        }
        penalty.add(Layout::DEADBAND, Layout::DEADBAND, self.hold_deadband);
        if let Some(held) = &self.held {
            penalty.add_scaled(held, 1.0);
        }
        // Ten digits below the data: only what nothing else determines is held by it.
        let hold = 1e-10 * data.weight;
        for k in 0..layout.order {
            for j in 0..layout.nodes {
                penalty.add(layout.elastic(k, j), layout.elastic(k, j), hold);
            }
        }
        for j in 0..layout.nodes {
            let weight =
                if self.friction { 1e-10 * data.weight * force_squared } else { data.weight.max(1.0) };
            penalty.add(layout.friction(j), layout.friction(j), weight);
        }
        for (m, p) in self.extra_prior.iter().enumerate() {
            penalty.add(layout.extra(m), layout.extra(m), *p);
        }
        penalty
    }

    /// Gauss–Newton from `parameters`, in place; returns the normal equations at the end.
    ///
    /// A step that raises the objective is halved. It ends when the step changes the force by less than a millionth of
    /// its size, or after `most` steps: what is reached then is still the best so far.
    pub fn solve(
        &self,
        parameters: &mut Vec<f64>,
        weights: &[f64],
        penalty: &Symmetric,
        most: usize,
    ) -> Normal {
        let objective = |normal: &Normal, at: &[f64]| normal.misfit + penalty.quadratic(at);
        let mut normal = self.normal(parameters, weights);
        let mut best = objective(&normal, parameters);
        for _ in 0..most {
            let mut matrix = normal.matrix.clone();
            matrix.add_scaled(penalty, 1.0);
            let pull = penalty.times(parameters);
            let right: Vec<f64> = normal.right.iter().zip(&pull).map(|(b, p)| b - p).collect();
            let mut step = matrix.factor().solve(&right);
            let gain = dot(&step, &right);
            let mut accepted = false;
            for _ in 0..8 {
                let trial: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p + s).collect();
                let at_trial = self.normal(&trial, weights);
                let value = objective(&at_trial, &trial);
                if value <= best * (1.0 + 1e-12) {
                    *parameters = trial;
                    normal = at_trial;
                    best = value;
                    accepted = true;
                    break;
                }
                for s in &mut step {
                    *s *= 0.5;
                }
            }
            if !accepted || gain <= 1e-9 * best {
                break;
            }
        }
        normal
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fit::basis::columns;
    use model_core::braid::miniature;

    /// Loops of a known table at six pressures: a parametrised truth for the solver.
    pub(crate) fn known(order: usize) -> (Design, Vec<f64>) {
        let braid = miniature().build().expect("a valid geometry");
        let levels: Vec<f64> = (0..6).map(|i| 207e3 + 69e3 * f64::from(i)).collect();
        let basis = PressureBasis::new(&levels);
        let strokes: Vec<_> = (0..60).map(|i| columns(&braid, f64::from(i) * 5e-5)).collect();
        let orthonormal = Orthonormal::over(&strokes, order);
        let mut rows = Vec::new();
        for (bin, p) in levels.iter().enumerate() {
            for s in [1.0, -1.0] {
                for c in &strokes {
                    let elastic = orthonormal.apply(c);
                    rows.push(Row {
                        pressure: *p,
                        area: c.area,
                        elastic,
                        direction: s,
                        force: 0.0,
                        bin: bin as u32,
                    });
                }
            }
        }
        let bins =
            levels.iter().enumerate().map(|(g, p)| Bin { phi: basis.at(*p), group: g as u32 }).collect();
        let mut design = Design {
            basis,
            orthonormal,
            rows,
            bins,
            groups: 6,
            extra: Vec::new(),
            extras: 0,
            extra_prior: Vec::new(),
            friction: true,
            origin: 0.0,
            hold_deadband: 0.0,
            held: None,
            level: 0.0,
        };
        let layout = design.layout();
        let mut truth = design.start(76.5e3);
        for k in 0..order {
            for j in 0..6 {
                truth[layout.elastic(k, j)] = -8.0 / (1.0 + k as f64) - 0.3 * j as f64 * (k as f64 - 1.0);
            }
        }
        for j in 0..6 {
            truth[layout.friction(j)] = 0.14 - 0.018 * j as f64;
        }
        let curves = design.curves(&truth);
        for i in 0..design.rows.len() {
            design.rows[i].force = design.evaluate(i, &truth, &curves).force;
        }
        (design, truth)
    }

    #[test]
    fn without_noise_the_truth_is_found_to_the_last_digits() {
        let (design, truth) = known(4);
        let weights = vec![1.0; design.rows.len()];
        let mut found = design.start(30e3);
        let normal = design.normal(&found, &weights);
        let mut penalty = design.penalty(&normal, 0.0, 0.0);
        penalty.a.fill(0.0);
        design.solve(&mut found, &weights, &penalty, 30);
        assert!((found[0] - truth[0]).abs() < 1e-3, "P0 {} Pa", found[0]);
        let layout = design.layout();
        for j in 0..6 {
            let (f, t) = (found[layout.friction(j)], truth[layout.friction(j)]);
            assert!((f - t).abs() < 1e-8, "k_F {f} {t}");
        }
        for r in design.residuals(&found) {
            assert!(r.abs() < 1e-6, "{r} N");
        }
    }

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let (mut design, mut at) = known(3);
        design.extras = 1;
        design.extra = (0..design.rows.len()).map(|i| (i as f64 * 0.37).sin()).collect();
        design.extra_prior = vec![0.0];
        at.push(0.5);
        for i in [0, 77, 300, 500] {
            let analytic = design.gradient(i, &at, &design.curves(&at));
            for u in 0..at.len() {
                let h = if u == 0 { 10.0 } else { 1e-5 };
                let force = |by: f64| {
                    let mut moved = at.clone();
                    moved[u] += by;
                    design.evaluate(i, &moved, &design.curves(&moved)).force
                };
                let numeric = (force(h) - force(-h)) / (2.0 * h);
                assert!((analytic[u] - numeric).abs() < 1e-6 * (1.0 + numeric.abs()), "row {i}, unknown {u}");
            }
        }
    }

    #[test]
    fn sums_by_bin_are_the_sums_of_rows() {
        let (design, mut at) = known(2);
        at[3] += 0.7;
        at[0] += 3e3;
        let weights: Vec<f64> = (0..design.rows.len()).map(|i| 1.0 + (i % 3) as f64).collect();
        let normal = design.normal(&at, &weights);
        let curves = design.curves(&at);
        let n = design.layout().len();
        let mut direct = Normal::zeros(n);
        for (i, w) in weights.iter().enumerate() {
            let j: Vec<(usize, f64)> = design.gradient(i, &at, &curves).into_iter().enumerate().collect();
            let r = design.rows[i].force - design.evaluate(i, &at, &curves).force;
            direct.matrix.add_row(&j, *w);
            for (k, v) in &j {
                direct.right[*k] += w * v * r;
            }
        }
        for (a, b) in normal.matrix.a.iter().zip(&direct.matrix.a) {
            assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} {b}");
        }
        for (a, b) in normal.right.iter().zip(&direct.right) {
            assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}
