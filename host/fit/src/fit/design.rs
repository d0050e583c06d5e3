//! The problem of all pressures together: points, unknowns, and the model at each point.
//!
//! ```text
//! r = F − G q − Σ_m a_m z_m       q = (P − P0) g(L) + Σ_k ẽ_k(P) c̃_k(L)      G = 1 − s k_F(P)
//! ∂F/∂ẽ_kj = G c̃_k φ_j            ∂F/∂k_F,j = −s q φ_j        ∂F/∂P0 = −G g       ∂F/∂a_m = z_m
//! ```
//! `z_m` are columns that a caller adds (effects, corrections); they act beside friction.

use model_core::braid::Braid;
use model_core::table::MAX_ORDER;

use super::basis::{Columns, Orthonormal};
use crate::numerics::spline_basis::SplineBasis;
use crate::numerics::symmetric::{Symmetric, dot};

/// A force measured at a pressure and a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Gauge pressure, Pa.
    pub pressure: f64,
    /// Stroke (displacement from rest length, positive when shorter), m.
    pub stroke: f64,
    /// +1 shortening, −1 lengthening, 0 for a mid-line.
    pub direction: f64,
    /// Force, N.
    pub force: f64,
}

/// One point as the linear problem sees it.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Gauge pressure, Pa.
    pub pressure: f64,
    /// The area `g`, m².
    pub area: f64,
    /// The orthonormal elastic columns `c̃_k`, dimensionless.
    pub elastic: [f64; MAX_ORDER],
    /// The direction `s`: +1 shortening, −1 lengthening, 0 where friction is not fitted.
    pub direction: f64,
    /// The measured force, N.
    pub force: f64,
    /// Index of its pressure bin.
    pub bin: u32,
}

impl Row {
    /// A point whose columns are known. `pressure` in Pa, `force` in N.
    #[must_use]
    pub fn new(
        pressure: f64,
        force: f64,
        direction: f64,
        columns: &Columns,
        orthonormal: &Orthonormal,
        bin: u32,
    ) -> Self {
        Self { pressure, area: columns.area, elastic: orthonormal.apply(columns), direction, force, bin }
    }
}

/// Points at nearly one pressure.
#[derive(Debug, Clone)]
pub struct Bin {
    /// `φ_j` at their mean pressure.
    pub phi: Vec<f64>,
    /// The group that is left out together: a tested level, or an interval of a continuous range.
    pub group: u32,
}

/// The linear problem of all pressures: points, unknowns, and the model at each point.
#[derive(Debug, Clone)]
pub struct Design {
    /// The basis functions `φ_j` over pressure.
    pub basis: SplineBasis,
    /// The transformation `c̃ = c T` of the elastic columns.
    pub orthonormal: Orthonormal,
    /// The points, one row each.
    pub rows: Vec<Row>,
    /// The pressure bins.
    pub bins: Vec<Bin>,
    /// The number of groups that cross-validation leaves out in turn.
    pub groups: usize,
    /// `z_m`, N per unit of `a_m`: `extras` numbers for each row.
    pub extra: Vec<f64>,
    /// The number of extra columns.
    pub extras: usize,
    /// Precision (1/σ²) of a prior about zero for each `a_m`; zero for none.
    pub extra_prior: Vec<f64>,
    /// Whether both directions of motion are there, so that `k_F` can be found.
    pub friction: bool,
    /// The origin of `P0`, Pa: the first unknown is `P0 − origin`.
    pub origin: f64,
    /// The precision of a prior of `P0` about its origin, in units of the weighted sum of squares per Pa²; zero for no prior.
    pub hold_deadband: f64,
    /// A further penalty, for a constraint that the user requested.
    pub held: Option<Symmetric>,
    /// Weight of a penalty on the slope of `E_k` over pressure; zero unless pressure moves or dimensions are fitted.
    pub level: f64,
}

/// The index of each unknown in the vector of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// The order `M` of the elastic polynomial.
    pub order: usize,
    /// The number `J` of nodes.
    pub nodes: usize,
    /// The number of extra unknowns `a_m`.
    pub extras: usize,
}

impl Layout {
    /// Index of `P0`.
    pub const DEADBAND: usize = 0;

    /// Index of `ẽ_kj`, with `k` and `j` from 0.
    #[must_use]
    pub fn elastic(&self, k: usize, j: usize) -> usize {
        1 + k * self.nodes + j
    }
    /// Index of `k_F,j`, with `j` from 0.
    #[must_use]
    pub fn friction(&self, j: usize) -> usize {
        1 + self.order * self.nodes + j
    }
    /// Index of `a_m`, with `m` from 0.
    #[must_use]
    pub fn extra(&self, m: usize) -> usize {
        1 + (self.order + 1) * self.nodes + m
    }
    /// The number of unknowns.
    #[must_use]
    pub fn len(&self) -> usize {
        1 + (self.order + 1) * self.nodes + self.extras
    }
    /// Always false: there is always `P0`.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }
}

/// The parts of the model's force at one row.
#[derive(Debug, Clone, Copy)]
pub struct Evaluated {
    /// The friction-free force `q`, N.
    pub quasi: f64,
    /// The friction factor `G = 1 − s k_F`.
    pub grip: f64,
    /// The force including extra columns, N.
    pub force: f64,
}

/// The curves at every bin, from one set of parameters.
pub struct Curves {
    order: usize,
    /// Per bin: `ẽ_1 … ẽ_M, k_F`.
    values: Vec<f64>,
}

impl Curves {
    /// `ẽ_1 … ẽ_M, k_F` at a bin, where `D` is `M + 2`.
    #[inline]
    pub(super) fn at<const D: usize>(&self, bin: u32) -> &[f64] {
        &self.values[bin as usize * (D - 1)..][..D - 1]
    }
}

impl Design {
    /// The problem of these points, without extra columns, priors and constraints.
    #[must_use]
    pub fn new(
        basis: SplineBasis,
        orthonormal: Orthonormal,
        rows: Vec<Row>,
        bins: Vec<Bin>,
        groups: usize,
        friction: bool,
    ) -> Self {
        Self {
            basis,
            orthonormal,
            rows,
            bins,
            groups,
            extra: Vec::new(),
            extras: 0,
            extra_prior: Vec::new(),
            friction,
            origin: 0.0,
            hold_deadband: 0.0,
            held: None,
            level: 0.0,
        }
    }

    /// Points at a few constant pressures, each of which becomes a node, a bin and a group. `order` is `M`; `friction`
    /// whether the directions of the points count.
    ///
    /// ```
    /// use pam_fit::{Design, Measured};
    /// use model_core::braid::miniature;
    ///
    /// // Blocked forces of a braid that begins to pull at 50 kPa: F = (P − P0) g(L0).
    /// let braid = miniature().build()?;
    /// let area = pam_fit::columns(&braid, 0.0).area;
    /// let points: Vec<Measured> = [200e3, 300e3, 400e3]
    ///     .map(|p| Measured { pressure: p, stroke: 0.0, direction: 0.0, force: (p - 50e3) * area })
    ///     .into();
    /// let design = Design::at_levels(&points, &braid, 1, false);
    /// let mut found = design.start(0.0);
    /// let weights = [1.0; 3];
    /// let penalty = design.penalty(&design.normal(&found, &weights), 1e-3, 1e-2);
    /// design.solve(&mut found, &weights, &penalty, 10);
    /// assert!((found[0] - 50e3).abs() < 1.0);
    /// # Ok::<(), model_core::braid::GeometryError>(())
    /// ```
    #[must_use]
    pub fn at_levels(points: &[Measured], braid: &Braid<f64>, order: usize, friction: bool) -> Self {
        let mut levels: Vec<f64> = points.iter().map(|p| p.pressure).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let basis = SplineBasis::new(&levels);
        let columns: Vec<Columns> = points.iter().map(|p| super::basis::columns(braid, p.stroke)).collect();
        let orthonormal = Orthonormal::over(&columns, order);
        let rows = points.iter().zip(&columns).map(|(p, c)| {
            let bin = levels.partition_point(|l| *l < p.pressure) as u32;
            Row::new(p.pressure, p.force, p.direction, c, &orthonormal, bin)
        });
        let rows = rows.collect();
        let bin = |(group, p): (usize, &f64)| Bin { phi: basis.at(*p), group: group as u32 };
        let bins = levels.iter().enumerate().map(bin).collect();
        Self::new(basis, orthonormal, rows, bins, levels.len(), friction)
    }

    /// The index of each unknown.
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
    pub(crate) fn reduced_at<'a>(&self, bin: u32, curves: &'a Curves) -> &'a [f64] {
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
    pub(super) fn small_columns(&self, i: usize, e: &Evaluated, out: &mut [f64]) {
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
    pub(super) fn spread(&self, small: &[f64], phi: &[f64], factor: f64, full: &mut [f64]) {
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

    /// A start for the iteration: no friction, no elasticity, this deadband.
    #[must_use]
    pub fn start(&self, deadband: f64) -> Vec<f64> {
        let mut parameters = vec![0.0; self.layout().len()];
        parameters[Layout::DEADBAND] = deadband - self.origin;
        parameters
    }
}
