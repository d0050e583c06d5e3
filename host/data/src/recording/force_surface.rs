//! A smooth surface of force over pressure and stroke, for checks of whole recordings against each other.
//!
//! ```text
//! F ≈ p (a0 + a1 u + a2 u² + a3 u³) + b0 + b1 u + b2 u² + b3 u³
//! ```
//! with `p` and `u` pressure and stroke as shares of their ranges, `a` and `b` in N. A muscle's force is linear in pressure at
//! constant length, and smooth in length: a cubic is enough to distinguish a wrong unit or a dead sensor from a muscle. It is not a model of
//! the muscle; that is the fit's.

use nalgebra::{SMatrix, SVector};

/// Coefficients of the surface.
pub(super) const TERMS: usize = 8;

/// The coefficients `a0 … a3, b0 … b3`, N.
#[derive(Debug, Clone, Default)]
pub(super) struct ForceSurface(SVector<f64, TERMS>);

impl ForceSurface {
    /// Least squares over rows of `[p, u]` and force (N). `ridge` holds each coefficient towards zero, per row, so that what the rows
    /// do not determine stays small. `None` where the equations are singular.
    pub(super) fn fit(rows: impl Iterator<Item = ([f64; 2], f64)>, ridge: &[f64; TERMS]) -> Option<Self> {
        let (mut matrix, mut right) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
        let mut count = 0_usize;
        for (at, force) in rows {
            let row = columns(at);
            matrix += row * row.transpose();
            right += row * force;
            count += 1;
        }
        matrix += SMatrix::from_diagonal(&(SVector::from(*ridge) * count as f64));
        Some(Self(matrix.cholesky()?.solve(&right)))
    }

    /// The force at `[p, u]`, N.
    pub(super) fn force(&self, at: [f64; 2]) -> f64 {
        columns(at).dot(&self.0)
    }
}

fn columns([p, u]: [f64; 2]) -> SVector<f64, TERMS> {
    SVector::from([p, p * u, p * u * u, p * u.powi(3), 1.0, u, u * u, u.powi(3)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_of_its_own_form_is_found_again() {
        let truth = |p: f64, u: f64| p * (40.0 - 30.0 * u + 5.0 * u * u) - 4.0 - 2.0 * u;
        let rows: Vec<([f64; 2], f64)> = (0..400)
            .map(|i| [f64::from(i % 20) / 19.0, f64::from(i / 20) / 19.0])
            .map(|[p, u]| ([p, u], truth(p, u)))
            .collect();
        let found = ForceSurface::fit(rows.into_iter(), &[1e-9; TERMS]).expect("determined");
        assert!((found.force([0.33, 0.71]) - truth(0.33, 0.71)).abs() < 1e-4);
    }

    #[test]
    fn no_rows_make_no_surface() {
        assert!(ForceSurface::fit(std::iter::empty(), &[1e-6; TERMS]).is_none());
    }
}
