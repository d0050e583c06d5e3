//! The confidence band of a table's force.

use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};

use crate::numerics::spline_basis::SplineBasis;
use crate::table_file::TableFile;

/// The uncertainty of a table's force, prepared for evaluation at many places.
///
/// ```text
/// var F = gᵀ C g,   g = ∂F/∂(P0, E_kj, k_F,j) = (−G g(L), G c_k φ_j, −s q φ_j),   G = 1 − s k_F
/// ```
/// with `C` the covariance that the table file holds. It covers the base model; effects add uncertainty that it does not contain. First
/// order in the deviations, which is exact except for `k_F` times elasticity.
///
/// ```
/// use pam_fit::confidence_band::ConfidenceBand;
/// use pam_fit::table_file::{About, TableFile, Uncertainty};
///
/// // A table whose only uncertain number is P0, by 1 kPa.
/// let table = model_core::table::example();
/// let rows = 1 + (table.order() + 1) * table.nodes.len();
/// let mut root = vec![0.0; rows];
/// root[0] = 1e3;
/// let uncertainty = Uncertainty { rows: rows as u32, columns: 1, root, residual_newtons: 0.3 };
/// let about = About { uncertainty: Some(uncertainty), ..About::default() };
/// let band = ConfidenceBand::of(&TableFile { table, about }).expect("an uncertainty");
/// // At rest length the blocked force is (P − P0) g(L0), whatever the pressure.
/// let std = band.std(300e3, 0.0, 0.0);
/// assert!((std - band.std(500e3, 0.0, 0.0)).abs() < 1e-9 && std > 0.0);
/// assert!((band.reading_std(300e3, 0.0, 0.0) - std.hypot(0.3)).abs() < 1e-12);
/// ```
#[derive(Debug, Clone)]
pub struct ConfidenceBand {
    muscle: Muscle<f64>,
    basis: SplineBasis,
    order: usize,
    columns: usize,
    root: Vec<f64>,
    residual: f64,
}

impl ConfidenceBand {
    /// The band of a table file; `None` where the file holds no uncertainty, or that of another table.
    #[must_use]
    pub fn of(file: &TableFile) -> Option<Self> {
        let u = file.about.uncertainty.as_ref()?;
        let (nodes, order) = (file.table.nodes.len(), file.table.order());
        let (rows, columns) = (u.rows as usize, u.columns as usize);
        if rows != 1 + (order + 1) * nodes || columns == 0 || u.root.len() != rows * columns {
            return None;
        }
        let muscle = Muscle::<f64>::build(&file.table).ok()?;
        let nodes: Vec<f64> = file.table.nodes.iter().map(|p| f64::from(*p)).collect();
        let basis = SplineBasis::new(&nodes);
        Some(Self { muscle, basis, order, columns, root: u.root.clone(), residual: u.residual_newtons })
    }

    /// Standard deviation of the force at a pressure (Pa), a stroke (m) and a direction (+1 shortening, −1 lengthening, 0 for the
    /// friction-free force), N, from the uncertainty of the table's parameters.
    #[must_use]
    pub fn std(&self, pressure: f64, stroke: f64, direction: f64) -> f64 {
        let held = self.muscle.at_stroke(Length::from_metres(stroke));
        let parts = self.muscle.parts(&held, Pressure::from_pascals(pressure));
        let phi = self.basis.at(pressure);
        let grip = 1.0 - parts.friction * direction;
        let mut sum = vec![0.0; self.columns];
        let mut rows = self.root.chunks_exact(self.columns);
        let mut add = |slope: f64| {
            for (s, x) in sum.iter_mut().zip(rows.next().unwrap_or_default()) {
                *s += slope * x;
            }
        };
        add(-grip * held.posture.area);
        for c in &held.columns[..self.order] {
            phi.iter().for_each(|f| add(grip * c * f));
        }
        phi.iter().for_each(|f| add(-direction * parts.quasi() * f));
        sum.iter().map(|s| s * s).sum::<f64>().sqrt()
    }

    /// The standard deviation of a single reading, N: [`ConfidenceBand::std`] and the root mean square of the fit's residuals.
    #[must_use]
    pub fn reading_std(&self, pressure: f64, stroke: f64, direction: f64) -> f64 {
        self.with_scatter(self.std(pressure, stroke, direction))
    }

    /// The standard deviation of a single reading where that of the force is `std`, both in N.
    #[must_use]
    pub(crate) fn with_scatter(&self, std: f64) -> f64 {
        std.hypot(self.residual)
    }
}
