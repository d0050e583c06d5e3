//! The table of recordings at held lengths, static part and memory in one least-squares problem.
//!
//! ```text
//! F = (1 − s k_F(P)) [ γ P g_l − π g_l + u_l(P) + c W − b G − d D ]      u_l(P) = Σ_q e_q(P) w_q(l)
//! ```
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | `g_l` | area of the described muscle at length `l` | m² |
//! | `γ` | its scale: the square of the bladder's diameter over the described one | – |
//! | `π` | `γ P0` | Pa |
//! | `u_l` | what the wall gives at a shortened length; nothing at full length | N |
//! | `w_q` | orthonormal combinations of the elastic columns over the lengths, at most as many as there are lengths | – |
//! | `W, G, D` | the forces of [`EffectName::BladderCreep`] per unit of its amplitudes | |
//!
//! At a few held lengths the elastic polynomial is one curve over pressure for each length: those curves are the unknowns, and
//! are smooth. All except `k_F` and the drive of the wall is linear; both come from the last solution and settle in a few rounds.
//! A slack muscle pulls no more than it reads. The smoothing is chosen by leaving out runs.

use model_core::braid::Braid;
use model_core::effects::{EffectName, FittedEffect};
use model_core::table::MuscleTable;
use model_core::units::{Length, Pressure};
use nalgebra::{DMatrix, DVector};
use pam_data::statistics::extremes;
use pam_fit::numerics::jackknife::covariance_root;
use pam_fit::numerics::spline_basis::SplineBasis;
use pam_fit::numerics::symmetric::dot;
use pam_fit::table_file::{FitQuality, Uncertainty};

mod round;

use super::campaign::Points;
use super::criteria::{HELD_LAST_NODE, HELD_NODES, HELD_ORDER, KEPT_ERRORS, MEMORY_KEPT_GAIN, SHORTENED};
use crate::paired;
use round::{Round, Smoothing};

/// Where the unknowns stand.
struct Places {
    /// Place of `γ`, the scale of the described area.
    gamma: usize,
    /// Place of `π = γ P0`.
    deadband: usize,
    /// The first amplitude: those of the memory, on which `k_F` acts, then those of the friction that follows pressure.
    layers: usize,
    /// How many amplitudes the memory has.
    memory: usize,
    /// `k_F` at the first node; the wall's curves follow.
    friction: usize,
}

const AT: Places = Places { gamma: 0, deadband: 1, layers: 2, memory: 3, friction: 7 };

/// Amplitudes: three of the memory; of the friction that follows pressure `μ` with `μ_0 = −μ`, which is none at rest length, and `μ_0` alone.
pub(super) type Amplitudes = [f64; 5];
/// Which amplitudes are fitted.
pub(super) type Open = [bool; 5];

/// What is fitted, and beside which table.
pub(super) struct Problem<'a> {
    points: &'a Points,
    /// Readings without the zero of the load cell, N.
    force: &'a [f64],
    pulls: Vec<bool>,
    slack: Vec<bool>,
    /// A slack muscle pulls no more, N.
    least: f64,
    largest: f64,
    braid: Braid<f64>,
    base: &'a MuscleTable,
    /// `g_l` by mounting, m².
    area: Vec<f64>,
    /// Which shortened length a mounting has.
    length: Vec<Option<usize>>,
    /// Strokes of the shortened lengths, m.
    strokes: Vec<f64>,
    /// `w_q(l)`: one row for each shortened length, one column for each combination `q`.
    directions: DMatrix<f64>,
    basis: SplineBasis,
    /// `φ_j(P)` of each point.
    phi: Vec<Vec<f64>>,
}

/// A solution with the table that it is.
#[derive(Clone)]
pub(super) struct Solution {
    pub(super) table: MuscleTable,
    pub(super) amplitudes: Amplitudes,
    /// Sum of squared residuals, N².
    pub(super) squares: f64,
    smoothing: Smoothing,
    parameters: Vec<f64>,
    /// `k_F` and the force without friction at each point.
    friction: Vec<f64>,
    without_friction: Vec<f64>,
}

impl<'a> Problem<'a> {
    /// `None` without points that pull.
    pub(super) fn new(
        points: &'a Points,
        force: &'a [f64],
        use_point: &[bool],
        least: f64,
        base: &'a MuscleTable,
    ) -> Option<Self> {
        let pulls: Vec<bool> = (0..points.len()).map(|i| use_point[i] && force[i] > least).collect();
        let slack = (0..points.len()).map(|i| use_point[i] && !pulls[i]).collect();
        let pressures = || (0..points.len()).filter(|i| pulls[*i]).map(|i| points.pressure[i] * 1e3);
        let (low, high) = extremes(pressures());
        if !(high > low) {
            return None;
        }
        let braid = base.geometry.cast().build().ok()?;
        let mut strokes: Vec<f64> = Vec::new();
        let length = points
            .mountings
            .iter()
            .map(|m| {
                if m.contraction.abs() <= SHORTENED {
                    return None;
                }
                let known = strokes.iter().position(|s| (s - m.stroke).abs() < 1e-6);
                Some(known.unwrap_or_else(|| {
                    strokes.push(m.stroke);
                    strokes.len() - 1
                }))
            })
            .collect();
        let area = points.mountings.iter().map(|m| posture(&braid, m.stroke).area).collect();
        let basis = SplineBasis::new(&nodes(low, high, f64::from(base.max_pressure.pascals())));
        let phi = points.pressure.iter().map(|p| basis.at(p * 1e3)).collect();
        let directions = elastic_columns(&braid, &strokes).qr().q();
        let largest = points.largest_force();
        Some(Self {
            points,
            force,
            pulls,
            slack,
            least,
            largest,
            braid,
            base,
            area,
            length,
            strokes,
            directions,
            basis,
            phi,
        })
    }

    fn unknowns(&self) -> usize {
        AT.friction + self.basis.nodes().len() * (1 + self.directions.ncols())
    }

    /// Place of the first value of a wall's curve.
    fn curve(&self, q: usize) -> usize {
        AT.friction + self.basis.nodes().len() * (1 + q)
    }

    /// The solution with the columns of the memory, after the last solution.
    pub(super) fn solve(
        &self,
        columns: &[Vec<f64>],
        open: Open,
        last: Option<&Solution>,
    ) -> Option<Solution> {
        let round = Round::new(self, columns, open, last);
        let smoothing = last.map_or_else(|| round.choose(), |last| last.smoothing);
        let parameters = round.solve(smoothing);
        self.solution(&round, smoothing, parameters, columns)
    }

    /// Squared errors of each group of runs when it is left out of the round of `solve` that gave a solution, N².
    pub(super) fn left_out(
        &self,
        columns: &[Vec<f64>],
        open: Open,
        last: Option<&Solution>,
        solution: &Solution,
    ) -> Vec<f64> {
        Round::new(self, columns, open, last).left_out(solution.smoothing)
    }

    fn solution(
        &self,
        round: &Round<'_>,
        smoothing: Smoothing,
        parameters: Vec<f64>,
        columns: &[Vec<f64>],
    ) -> Option<Solution> {
        let table = self.table(&parameters)?;
        let nodes = self.basis.nodes().len();
        let friction: Vec<f64> =
            self.phi.iter().map(|phi| dot(phi, &parameters[AT.friction..AT.friction + nodes])).collect();
        let squares = (0..self.points.len())
            .map(|i| match (self.pulls[i], self.slack[i]) {
                (true, _) => (round.pull(&parameters, i) - self.force[i]).powi(2),
                (_, true) => (round.pull(&parameters, i) - self.least).max(0.0).powi(2),
                _ => 0.0,
            })
            .sum();
        let without_friction = (0..self.points.len())
            .map(|i| {
                let statics: f64 = self.static_row(i).iter().map(|(a, x)| x * parameters[*a]).sum();
                let memory: f64 = (0..AT.memory).map(|a| columns[a][i] * parameters[AT.layers + a]).sum();
                // The columns contain the friction.
                statics + memory / (1.0 - f64::from(self.points.direction[i]) * friction[i])
            })
            .collect();
        let amplitudes = std::array::from_fn(|a| parameters[AT.layers + a]);
        Some(Solution { table, amplitudes, squares, smoothing, parameters, friction, without_friction })
    }

    /// The columns of the static part without friction.
    fn static_row(&self, i: usize) -> Vec<(usize, f64)> {
        let m = self.points.mounting[i];
        let area = self.area[m];
        let mut row = vec![(AT.gamma, self.points.pressure[i] * 1e3 * area), (AT.deadband, -area)];
        if let Some(l) = self.length[m] {
            for q in 0..self.directions.ncols() {
                let (first, w) = (self.curve(q), self.directions[(l, q)]);
                row.extend(self.phi[i].iter().enumerate().map(|(j, phi)| (first + j, w * phi)));
            }
        }
        row
    }

    /// The table that the unknowns are; `None` where it is none.
    fn table(&self, parameters: &[f64]) -> Option<MuscleTable> {
        let gamma = parameters[AT.gamma];
        if !(gamma > 0.0) {
            return None;
        }
        let mut table = self.base.clone();
        table.effects.clear();
        table.geometry.outer_diameter = table.geometry.outer_diameter * gamma.sqrt() as f32;
        table.deadband = Pressure::from_pascals((parameters[AT.deadband] / gamma) as f32);
        let braid: Braid<f64> = table.geometry.cast().build().ok()?;
        let columns = elastic_columns(&braid, &self.strokes);
        let scale: Vec<f64> = columns.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
        let scaled = DMatrix::from_fn(columns.nrows(), columns.ncols(), |l, k| columns[(l, k)] / scale[k]);
        let decomposed = scaled.svd(true, true);
        let nodes = self.basis.nodes();
        table.nodes = nodes.iter().map(|p| *p as f32).collect();
        table.elastic = (0..scale.len().max(1)).map(|_| nodes.iter().map(|_| 0.0).collect()).collect();
        for j in 0..nodes.len() {
            let e = DVector::from_fn(self.directions.ncols(), |q, _| parameters[self.curve(q) + j]);
            let wall = &self.directions * e;
            let moduli = decomposed.solve(&wall, 1e-12).ok()?;
            for (k, scale) in scale.iter().enumerate() {
                table.elastic[k][j] = (moduli[k] / scale) as f32;
            }
        }
        table.friction =
            parameters[AT.friction..AT.friction + nodes.len()].iter().map(|k| *k as f32).collect();
        table.check().is_ok().then_some(table)
    }

    /// The errors of a solution on the points that pull, relative to the blocked force of their pressure.
    pub(super) fn quality(&self, solution: &Solution, warnings: Vec<String>) -> FitQuality {
        let parameters = &solution.parameters;
        let pulling: Vec<usize> = (0..self.points.len()).filter(|i| self.pulls[*i]).collect();
        let of = |i: &usize| {
            let s = f64::from(self.points.direction[*i]);
            let model = (1.0 - s * solution.friction[*i]) * solution.without_friction[*i];
            let pressure = self.points.pressure[*i] * 1e3;
            let blocked =
                (parameters[AT.gamma] * pressure - parameters[AT.deadband]) * posture(&self.braid, 0.0).area;
            100.0 * (model - self.force[*i]).abs() / blocked.max(self.least)
        };
        let errors: Vec<f64> = pulling.iter().map(of).collect();
        let count = errors.len().max(1) as f64;
        FitQuality {
            samples: errors.len() as u64,
            rms_newtons: (solution.squares / count).sqrt(),
            mean_error_percent: errors.iter().sum::<f64>() / count,
            max_error_percent: errors.iter().copied().fold(0.0, f64::max),
            left_out_percent: None,
            warnings,
        }
    }

    /// Square root of the covariance of the table's numbers: a jackknife over groups of runs.
    pub(super) fn uncertainty(&self, columns: &[Vec<f64>], solution: &Solution) -> Option<Uncertainty> {
        let round = Round::new(self, columns, solution.amplitudes.map(|a| a != 0.0), Some(solution));
        let all: Option<Vec<Vec<f64>>> = (0..round.folds.len())
            .map(|fold| self.table(&round.without(fold, solution.smoothing)).map(|t| numbers(&t)))
            .collect();
        let all = all.filter(|all| all.len() > 1)?;
        let count = all.len() as f64;
        let rows = all[0].len();
        let mean: Vec<f64> = (0..rows).map(|r| all.iter().map(|n| n[r]).sum::<f64>() / count).collect();
        let changes: Vec<Vec<f64>> =
            all.iter().map(|n| n.iter().zip(&mean).map(|(n, mean)| n - mean).collect()).collect();
        let root = covariance_root(&changes, rows);
        let used = self.pulls.iter().filter(|p| **p).count().max(1) as f64;
        Some(Uncertainty {
            rows: root.rows as u32,
            columns: root.columns as u32,
            root: root.s,
            residual_newtons: (solution.squares / used).sqrt(),
        })
    }
}

/// `P0`, the elastic curves, `k_F`.
fn numbers(table: &MuscleTable) -> Vec<f64> {
    let curves = table.elastic.iter().chain([&table.friction]);
    let mut numbers = vec![f64::from(table.deadband.pascals())];
    numbers.extend(curves.flat_map(|c| c.iter().map(|v| f64::from(*v))));
    numbers
}

/// Nodes over the pressures that pull, and one at the highest that may be commanded.
fn nodes(low: f64, high: f64, max_pressure: f64) -> Vec<f64> {
    let step = (high - low) / (HELD_NODES - 1) as f64;
    let mut nodes: Vec<f64> = (0..HELD_NODES).map(|j| low + step * j as f64).collect();
    if max_pressure > high + HELD_LAST_NODE.0 * step {
        nodes.push(max_pressure.min(high + HELD_LAST_NODE.1 * step));
    }
    nodes
}

fn posture(braid: &Braid<f64>, stroke: f64) -> model_core::braid::Posture<f64> {
    braid.posture(Length::from_metres(stroke))
}

/// `c_k(l)`, as many as the lengths determine.
fn elastic_columns(braid: &Braid<f64>, strokes: &[f64]) -> DMatrix<f64> {
    let order = strokes.len().min(HELD_ORDER);
    let columns: Vec<[f64; HELD_ORDER]> =
        strokes.iter().map(|s| posture(braid, *s).elastic_columns()).collect();
    DMatrix::from_fn(strokes.len(), order, |l, k| columns[l][k])
}

/// Whether left-out runs are predicted better: by a share of their squares, and beyond the scatter of the groups.
pub(super) fn predicts_better(with: &[f64], without: &[f64]) -> bool {
    let (gain, error) = paired::gain(with, without);
    let before: f64 = without.iter().sum();
    gain > MEMORY_KEPT_GAIN * before && gain > KEPT_ERRORS * error
}

impl Solution {
    /// The table with the layers that have a share.
    pub(super) fn with_layers(&self, width: f64) -> MuscleTable {
        let [c, b, d, growing, constant] = self.amplitudes;
        let mut table = self.table.clone();
        let layers = [
            FittedEffect::new(EffectName::BladderCreep, &[c, b, d, width]),
            FittedEffect::new(EffectName::PressureFriction, &[growing, constant - growing]),
        ];
        for layer in layers {
            if layer.parameters[..layer.effect.info().amplitudes()].iter().any(|a| *a != 0.0) {
                let _ = table.effects.push(layer);
            }
        }
        table
    }
}
