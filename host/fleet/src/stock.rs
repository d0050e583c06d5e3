//! A table for a muscle with few recordings, shrunk towards its kin: other muscles of the same type that were fitted before.
//!
//! ```text
//! θ = (P0, E_k at the nodes, k_F at the nodes),     θ = μ + A z,   z ~ N(0, I)                          the stock
//! F_i = F(θ; P_i, L_i, s_i) + ε_i,   ε_i ~ N(0, σ²/w_i)                                                 the recordings
//! ```
//! `μ` is the mean of the kin, and `A Aᵀ` their covariance for a further muscle, `S (1 + 1/n) (n − 1)/(n − 3)`: the factor is the variance of
//! Student's distribution, because the covariance is known from `n` muscles only. The most probable `z` follows from Gauss–Newton
//! steps, because the force is nearly linear in `θ`, and its covariance from the last step. Points within a half-stroke are correlated: together they
//! weigh as much as the numbers that a half-stroke can determine. What the kin's deviations do not span stays outside; the bands are
//! therefore scaled by how well each of the kin is predicted from the others in the same way.

use model_core::muscle::Muscle;
use model_core::table::MuscleTable;
use model_core::units::{Force, Length, Pressure};
use nalgebra::{DMatrix, DVector};
use pam_data::error::{Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_data::statistics::median;
use pam_fit::error::FitCode;
use pam_fit::numerics::spline_basis::SplineBasis;
use pam_fit::table_file::{TableFile, Uncertainty};
use pam_fit::{Columns, Fit, Options, PointUse, columns, fit, with_friction};

/// Fewer kin do not determine a covariance: the factor `(n − 1)/(n − 3)` of Student's distribution has a meaning from 4 on, and is 2 at 5.
pub(crate) const FEWEST: usize = 5;
/// Nodes of the table over the kin's pressures.
const NODES: usize = 8;
/// Steps of the iteration; the force is linear in all but the product of `k_F` with the others.
const STEPS: usize = 8;
/// Directions of the force at which a table is compared.
const DIRECTIONS: [f64; 2] = [1.0, -1.0];

/// One place of the model: the columns of its force.
#[derive(Debug, Clone)]
struct Place {
    pressure: f64,
    phi: Vec<f64>,
    columns: Columns,
    direction: f64,
}

/// What the kin have in common.
#[derive(Debug, Clone)]
struct Prior {
    nodes: Vec<f64>,
    order: usize,
    mean: DVector<f64>,
    /// `A`: one column per muscle.
    root: DMatrix<f64>,
}

/// A table that a stock supports.
#[derive(Debug, Clone)]
pub struct StockFit {
    /// The table; its uncertainty contains the variation of the stock.
    pub table: MuscleTable,
    /// Its uncertainty.
    pub uncertainty: Uncertainty,
    /// The fit of the recordings alone.
    pub alone: Fit,
    /// Kin that were used.
    pub kin: usize,
    /// Factor by which the bands were widened so that they hold for the kin.
    pub widened: f64,
    /// Root mean square of the residuals of the recordings, N.
    pub rms: f64,
}

/// The kin's tables as one distribution.
fn prior(kin: &[&TableFile], order: usize) -> Option<Prior> {
    if kin.len() < FEWEST {
        return None;
    }
    let middle =
        |of: &dyn Fn(&MuscleTable) -> f64| median(&mut kin.iter().map(|k| of(&k.table)).collect::<Vec<_>>());
    let low = middle(&|t| f64::from(t.tested.pressure_low.pascals()));
    let high = middle(&|t| f64::from(t.tested.pressure_high.pascals()));
    if !(high > low) {
        return None;
    }
    let nodes: Vec<f64> = (0..NODES).map(|i| low + (high - low) * i as f64 / (NODES - 1) as f64).collect();
    let vectors: Vec<DVector<f64>> = kin.iter().map(|k| vector(&k.table, &nodes, order)).collect();
    let n = vectors.len() as f64;
    let mean = vectors.iter().fold(DVector::zeros(vectors[0].len()), |sum, v| sum + v) / n;
    let scale = ((1.0 + 1.0 / n) / (n - 3.0)).sqrt();
    let root = DMatrix::from_columns(&vectors.iter().map(|v| (v - &mean) * scale).collect::<Vec<_>>());
    Some(Prior { nodes, order, mean, root })
}

/// A table's numbers at other nodes.
fn vector(table: &MuscleTable, nodes: &[f64], order: usize) -> DVector<f64> {
    let own: Vec<f64> = table.nodes.iter().map(|p| f64::from(*p)).collect();
    let basis = SplineBasis::new(&own);
    let phis: Vec<Vec<f64>> = nodes.iter().map(|p| basis.at(*p)).collect();
    let curve = |values: &[f32]| -> Vec<f64> {
        phis.iter().map(|phi| phi.iter().zip(values).map(|(f, v)| f * f64::from(*v)).sum()).collect()
    };
    let mut all = vec![f64::from(table.deadband.pascals())];
    for k in 0..order {
        match table.elastic.get(k) {
            Some(values) => all.extend(curve(values)),
            None => all.resize(all.len() + nodes.len(), 0.0),
        }
    }
    all.extend(curve(&table.friction));
    DVector::from_vec(all)
}

impl Prior {
    /// Force and its derivatives by the table's numbers.
    fn force(&self, theta: &DVector<f64>, place: &Place) -> (f64, Vec<f64>) {
        let nodes = self.nodes.len();
        let at = |from: usize| place.phi.iter().enumerate().map(|(j, f)| f * theta[from + j]).sum::<f64>();
        let friction = at(1 + self.order * nodes);
        let elastic: f64 = (0..self.order).map(|k| at(1 + k * nodes) * place.columns.elastic[k]).sum();
        let quasi = (place.pressure - theta[0]) * place.columns.area + elastic;
        let grip = 1.0 - place.direction * friction;
        let mut slopes = vec![-grip * place.columns.area];
        for k in 0..self.order {
            slopes.extend(place.phi.iter().map(|f| grip * place.columns.elastic[k] * f));
        }
        slopes.extend(place.phi.iter().map(|f| -place.direction * quasi * f));
        (grip * quasi, slopes)
    }

    /// The most probable numbers and a root of their covariance, from forces with weights `1/σ²`.
    fn update(
        &self,
        places: &[Place],
        forces: &[f64],
        weights: &[f64],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let kin = self.root.ncols();
        let mut z = DVector::<f64>::zeros(kin);
        let mut theta = self.mean.clone();
        let mut root = None;
        for _ in 0..STEPS {
            let mut normal = DMatrix::<f64>::identity(kin, kin);
            let mut right = DVector::<f64>::zeros(kin);
            for ((place, force), weight) in places.iter().zip(forces).zip(weights) {
                let (model, slopes) = self.force(&theta, place);
                let b = self.root.tr_mul(&DVector::from_vec(slopes));
                // The linear model at z: model + b (z' − z).
                let off = force - model + b.dot(&z);
                normal.ger(*weight, &b, &b, 1.0);
                right.axpy(weight * off, &b, 1.0);
            }
            let factor = normal.cholesky()?;
            z = factor.solve(&right);
            theta = &self.mean + &self.root * &z;
            // C = (L Lᵀ)⁻¹, so that L⁻ᵀ is a root of it.
            root = factor.l().try_inverse().map(|inverse| &self.root * inverse.transpose());
        }
        let usable = theta.iter().all(|v| v.is_finite());
        root.filter(|_| usable).map(|root| (theta, root))
    }

    fn place(&self, basis: &SplineBasis, pressure: f64, columns: Columns, direction: f64) -> Place {
        Place { pressure, phi: basis.at(pressure), columns, direction }
    }
}

/// Standard deviation of the force at a place from a root of the covariance.
fn deviation(prior: &Prior, theta: &DVector<f64>, root: &DMatrix<f64>, place: &Place) -> f64 {
    let (_, slopes) = prior.force(theta, place);
    root.tr_mul(&DVector::from_vec(slopes)).norm()
}

/// How much wider the bands must be so that they hold for the kin. Each is predicted from the others by its forces at the places of the
/// recordings, and compared over all pressures and strokes. The root mean square of the standardised errors, at least 1.
fn widening(
    kin: &[&TableFile],
    order: usize,
    places: &[Place],
    weights: &[f64],
    grid: &[Place],
    sigma: f64,
) -> f64 {
    let mut errors = Vec::new();
    for left_out in 0..kin.len() {
        let others: Vec<&TableFile> =
            kin.iter().enumerate().filter(|(i, _)| *i != left_out).map(|(_, k)| *k).collect();
        let Some(prior) = prior(&others, order) else { continue };
        let truth = vector(&kin[left_out].table, &prior.nodes, order);
        let basis = SplineBasis::new(&prior.nodes);
        let moved = |list: &[Place]| -> Vec<Place> {
            list.iter().map(|p| prior.place(&basis, p.pressure, p.columns, p.direction)).collect()
        };
        let (places, grid) = (moved(places), moved(grid));
        let forces: Vec<f64> = places.iter().map(|p| prior.force(&truth, p).0).collect();
        let Some((theta, root)) = prior.update(&places, &forces, weights) else { continue };
        for place in &grid {
            let off = prior.force(&theta, place).0 - prior.force(&truth, place).0;
            // What no table resolves counts as known.
            errors.push((off / deviation(&prior, &theta, &root, place).hypot(sigma)).powi(2));
        }
    }
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    if mean > 1.0 { mean.sqrt() } else { 1.0 }
}

/// Fits a muscle beside its kin.
///
/// # Errors
/// Too few kin of the muscle's kind, or recordings that cannot be fitted at all.
pub fn stock_fit(
    campaign: &Campaign,
    muscle: &MuscleDescription,
    kin: &[TableFile],
    options: &Options,
) -> Result<StockFit> {
    let alone = fit(campaign, muscle, options)?;
    let order = options.order;
    let usable: Vec<&TableFile> =
        kin.iter().filter(|k| k.table.kind == alone.table.kind && k.table.effects.is_empty()).collect();
    let too_few = || {
        Error::new(
            FitCode::FitUnderdetermined,
            format!("the stock has {} usable muscles, at least {FEWEST} are needed", usable.len()),
        )
        .help("fit more muscles of this type with `host batch`, or select more of them")
    };
    let prior = prior(&usable, order).ok_or_else(too_few)?;
    let basis = SplineBasis::new(&prior.nodes);
    let solution = &alone.solution;
    let (points, used) = (&solution.problem.points.list, &solution.screen.used);
    let fitted: Vec<usize> =
        (0..points.len()).filter(|i| used[*i] == PointUse::Fitted && points[*i].direction != 0.0).collect();
    let place = |i: &usize| {
        let p = &points[*i];
        let stroke = p.stroke + solution.problem.shift[*i];
        prior.place(&basis, p.pressure, columns(&solution.problem.braid, stroke), p.direction)
    };
    let places: Vec<Place> = fitted.iter().map(place).collect();
    let forces: Vec<f64> = fitted.iter().map(|i| points[*i].force).collect();
    // The error that remains where a muscle is well known: noise, and what the model does not describe.
    let mut residuals: Vec<f64> =
        usable.iter().filter_map(|k| k.about.uncertainty.as_ref()).map(|u| u.residual_newtons).collect();
    let typical = if residuals.is_empty() { 0.0 } else { median(&mut residuals) };
    let sigma = typical.max(alone.summary.rms_N).max(f64::MIN_POSITIVE);
    let blocks: Vec<u32> = fitted.iter().map(|i| points[*i].block).collect();
    let weights: Vec<f64> = blocks
        .iter()
        .map(|b| {
            let together = blocks.iter().filter(|o| *o == b).count() as f64;
            ((order + 1) as f64 / together).min(1.0) / (sigma * sigma)
        })
        .collect();
    let (theta, root) = prior.update(&places, &forces, &weights).ok_or_else(too_few)?;
    let grid = grid(&prior, &usable, &alone);
    let widened = widening(&usable, order, &places, &weights, &grid, sigma);
    let root = root * widened;
    let square: f64 = places.iter().zip(&forces).map(|(p, f)| (f - prior.force(&theta, p).0).powi(2)).sum();
    let rms = (square / places.len().max(1) as f64).sqrt();
    let table = table(&prior, &theta, &usable, &alone)?;
    let uncertainty = Uncertainty {
        rows: root.nrows() as u32,
        columns: root.ncols() as u32,
        root: root.transpose().as_slice().to_vec(),
        residual_newtons: sigma.max(rms),
    };
    Ok(StockFit { table, uncertainty, alone, kin: usable.len(), widened, rms })
}

/// Places over the pressures and strokes of the kin.
fn grid(prior: &Prior, kin: &[&TableFile], alone: &Fit) -> Vec<Place> {
    let basis = SplineBasis::new(&prior.nodes);
    let mut ends: Vec<f64> = kin.iter().map(|k| f64::from(k.table.tested.contraction_high)).collect();
    let end = median(&mut ends) * alone.solution.problem.braid.rest_length();
    let mut places = Vec::new();
    for pressure in &prior.nodes {
        for i in 0..8 {
            for direction in DIRECTIONS {
                let stroke = end * f64::from(i) / 7.0;
                let columns = columns(&alone.solution.problem.braid, stroke);
                places.push(prior.place(&basis, *pressure, columns, direction));
            }
        }
    }
    places
}

fn table(prior: &Prior, theta: &DVector<f64>, kin: &[&TableFile], alone: &Fit) -> Result<MuscleTable> {
    let nodes = prior.nodes.len();
    let curve = |from: usize| theta.as_slice()[from..from + nodes].iter();
    let middle = |of: &dyn Fn(&MuscleTable) -> f32| {
        median(&mut kin.iter().map(|k| f64::from(of(&k.table))).collect::<Vec<_>>()) as f32
    };
    let mut table = alone.table.clone();
    table.deadband = Pressure::from_pascals(theta[0] as f32);
    table.nodes = prior.nodes.iter().map(|p| *p as f32).collect();
    table.elastic = (0..prior.order).map(|k| curve(1 + k * nodes).map(|e| *e as f32).collect()).collect();
    let tested = &mut table.tested;
    tested.pressure_low = Pressure::from_pascals(prior.nodes[0] as f32);
    tested.pressure_high = Pressure::from_pascals(prior.nodes[nodes - 1] as f32);
    tested.contraction_low = middle(&|t| t.tested.contraction_low);
    tested.contraction_high = middle(&|t| t.tested.contraction_high);
    table.max_pressure = Pressure::from_pascals(middle(&|t| t.max_pressure.pascals()));
    let unusable = |what: String| {
        Error::new(FitCode::FitUnderdetermined, format!("the stock gives no usable table: {what}"))
    };
    let friction: Vec<f64> = curve(1 + prior.order * nodes).copied().collect();
    let mut table = with_friction(table, &friction).map_err(|e| unusable(e.to_string()))?;
    let built = Muscle::<f64>::build(&table).map_err(|e| unusable(e.to_string()))?;
    let highest = Pressure::from_pascals(prior.nodes[nodes - 1]);
    let blocked = built.force(highest, Length::from_metres(0.0), 0.0).newtons();
    table.blocked_force = Force::from_newtons(blocked as f32);
    table.check().map_err(|e| unusable(e.to_string()))?;
    Ok(table)
}
