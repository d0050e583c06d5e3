//! Natural cubic splines as a basis: `φ_j` is 1 at node `j`, 0 at the others, and constant outside the nodes.
//!
//! It is the spline that the controller evaluates ([`model_core::spline`]), so the coefficients of a fit are the table's values at
//! its nodes.

use model_core::spline::{self, Cubic, MAX_NODES, MAX_PIECES, Nodes};

/// The functions `φ_j` over pressure.
///
/// ```
/// use pam_fit::numerics::spline_basis::SplineBasis;
///
/// let basis = SplineBasis::new(&[1e5, 2e5, 4e5]);
/// assert_eq!(basis.at(2e5), [0.0, 1.0, 0.0]);
/// assert!((basis.at(3e5).iter().sum::<f64>() - 1.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone)]
pub struct SplineBasis {
    nodes: Vec<f64>,
    places: Nodes<f64>,
    /// Per function, its cubics.
    cubics: Vec<[Cubic<f64>; MAX_PIECES]>,
}

impl SplineBasis {
    /// On increasing nodes, Pa; at most [`MAX_NODES`] of them count.
    #[must_use]
    pub fn new(nodes: &[f64]) -> Self {
        let nodes = &nodes[..nodes.len().min(MAX_NODES)];
        let cubics = (0..nodes.len())
            .map(|j| {
                let mut unit = [0.0; MAX_NODES];
                unit[j] = 1.0;
                Nodes::<f64>::pieces(nodes, &unit[..nodes.len()])
            })
            .collect();
        Self { nodes: nodes.to_vec(), places: Nodes::new(nodes), cubics }
    }

    /// The nodes, Pa.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// `φ_1(P) … φ_J(P)`.
    #[must_use]
    pub fn at(&self, pressure: f64) -> Vec<f64> {
        let piece = self.places.place(pressure);
        let above = pressure - self.places.origin(piece);
        self.cubics.iter().map(|c| spline::value(&c[piece], above)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_functions_are_one_at_their_own_node_and_sum_to_one() {
        let basis = SplineBasis::new(&[1e5, 2e5, 4e5, 5e5]);
        for (j, p) in [1e5, 2e5, 4e5, 5e5].into_iter().enumerate() {
            for (i, v) in basis.at(p).iter().enumerate() {
                assert!((v - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        for p in [0.0, 1.3e5, 3.0e5, 9e5] {
            assert!((basis.at(p).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!(SplineBasis::new(&[3e5]).at(1e5), [1.0]);
    }
}
