//! Columns of the linear problem: functions of stroke, and functions of pressure.
//!
//! ```text
//! F = (1 − s k_F(P)) [ (P − P0) g(L) + Σ_k E_k(P) c_k(L) ]          g, c_k: model_core::braid
//! E_k(P) = Σ_j E_kj φ_j(P)        k_F(P) = Σ_j k_F,j φ_j(P)
//! ```
//! `φ_j` is the natural cubic spline that is 1 at node `j` and 0 at the others, held at its end values outside: the very
//! spline that the controller evaluates, so the fit's unknowns are the table's numbers.
//!
//! The columns `c_1 … c_M` are nearly collinear (condition numbers of 10³ to 10⁵). The fit works with combinations
//! `c̃ = c T` that are orthonormal over the strokes of the recordings, with `T` upper triangular: `E = T ẽ` at every node.

use model_core::braid::Braid;
use model_core::table::MAX_ORDER;
use model_core::units::Length;
use nalgebra::DMatrix;

use crate::numerics::symmetric::dot;

/// The columns of the linear model at one stroke.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Columns {
    /// The area `g` by which pressure acts on the length, m².
    pub area: f64,
    /// The elastic columns `c_1 … c_M`, m².
    pub elastic: [f64; MAX_ORDER],
}

/// The columns at a stroke in metres.
#[must_use]
pub fn columns(braid: &Braid<f64>, stroke: f64) -> Columns {
    let posture = braid.posture(Length::from_metres(stroke));
    Columns { area: posture.area, elastic: posture.elastic_columns() }
}

/// Combinations of the elastic columns that are orthonormal over given strokes.
#[derive(Debug, Clone, PartialEq)]
pub struct Orthonormal {
    /// The order `M` of the elastic polynomial.
    pub order: usize,
    /// `T`, upper triangular, `M × M`, row after row: `c̃_k = Σ_i c_i T_ik`.
    pub t: Vec<f64>,
    /// How many of the combinations the strokes determine.
    pub rank: usize,
    /// Condition number of the scaled columns; infinite where they are dependent.
    pub condition: f64,
}

/// Below this share of the muscle's area the first column is none: at a modulus twenty times the pressure the bladder would still
/// bear less than a five-thousandth of the force, and rounding or the noise of the stroke decides what would be found.
const NO_STRAIN: f64 = 1e-5;

impl Orthonormal {
    /// Over these strokes, all of equal weight. Columns that depend on earlier ones over these strokes (fewer different
    /// strokes than columns, or strokes so close that only rounding sets them apart) are left out: their `T_kk` is zero. So are
    /// all of them where every stroke is at rest length.
    #[must_use]
    pub fn over(columns: &[Columns], order: usize) -> Self {
        let rows = columns.len().max(1);
        let mut scale = vec![0.0_f64; order];
        for (k, s) in scale.iter_mut().enumerate() {
            *s = (columns.iter().map(|c| c.elastic[k].powi(2)).sum::<f64>() / rows as f64).sqrt();
        }
        let area = (columns.iter().map(|c| c.area.powi(2)).sum::<f64>() / rows as f64).sqrt();
        if scale.first().is_some_and(|first| *first < NO_STRAIN * area) {
            scale.fill(0.0);
        }
        let scaled = DMatrix::from_fn(columns.len(), order, |i, k| {
            if scale[k] > 0.0 { columns[i].elastic[k] / scale[k] } else { 0.0 }
        });
        // Modified Gram–Schmidt, each column twice: enough for condition numbers far beyond those met here.
        let mut q: Vec<Vec<f64>> = Vec::with_capacity(order);
        let mut t = vec![0.0; order * order];
        let mut rank = 0;
        let n = (rows as f64).sqrt();
        for k in 0..order {
            let mut v: Vec<f64> = scaled.column(k).iter().copied().collect();
            // v = c_k/scale_k − Σ …: `combination` follows the same steps on the columns' indices.
            let mut combination = vec![0.0; order];
            combination[k] = 1.0;
            for _ in 0..2 {
                for (j, u) in q.iter().enumerate() {
                    let projection = dot(&v, u) / rows as f64;
                    for (x, y) in v.iter_mut().zip(u) {
                        *x -= projection * y;
                    }
                    for i in 0..order {
                        combination[i] -= projection * t[i * order + j];
                    }
                }
            }
            let norm = (v.iter().map(|x| x * x).sum::<f64>()).sqrt() / n;
            if norm > 1e-7 && scale[k] > 0.0 {
                for x in &mut v {
                    *x /= norm;
                }
                for i in 0..order {
                    t[i * order + k] = combination[i] / norm;
                }
                rank += 1;
            } else {
                v.fill(0.0);
            }
            q.push(v);
        }
        // The scaled columns are Q T⁻¹ with orthonormal Q, so their condition number is that of T.
        let singular = DMatrix::from_row_slice(order, order, &t).singular_values();
        let condition = match (rank == order, singular.max() / singular.min()) {
            (true, ratio) if ratio < 1e12 => ratio,
            _ => f64::INFINITY,
        };
        for i in 0..order {
            for k in 0..order {
                t[i * order + k] = if scale[i] > 0.0 { t[i * order + k] / scale[i] } else { 0.0 };
            }
        }
        Self { order, t, rank, condition }
    }

    /// `c̃` of some columns.
    #[inline]
    #[must_use]
    pub fn apply(&self, columns: &Columns) -> [f64; MAX_ORDER] {
        let mut out = [0.0; MAX_ORDER];
        for (i, c) in columns.elastic.iter().enumerate().take(self.order) {
            for (k, o) in out.iter_mut().enumerate().take(self.order).skip(i) {
                *o += c * self.t[i * self.order + k];
            }
        }
        out
    }

    /// `E = T ẽ`.
    #[must_use]
    pub fn to_moduli(&self, reduced: &[f64]) -> Vec<f64> {
        (0..self.order)
            .map(|i| (i..self.order).map(|k| self.t[i * self.order + k] * reduced[k]).sum())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::braid::miniature;

    fn mini(strokes: impl Iterator<Item = f64>) -> Vec<Columns> {
        let braid = miniature().build().expect("a valid geometry");
        strokes.map(|s| columns(&braid, s)).collect()
    }

    #[test]
    fn orthonormal_combinations_are_orthonormal_though_the_columns_are_not() {
        let all = mini((0..=200).map(|i| f64::from(i) * 15e-6));
        let basis = Orthonormal::over(&all, 4);
        assert_eq!(basis.rank, 4);
        assert!(basis.condition > 100.0, "{}", basis.condition);
        let tilde: Vec<_> = all.iter().map(|c| basis.apply(c)).collect();
        for a in 0..4 {
            for b in 0..4 {
                let product = tilde.iter().map(|c| c[a] * c[b]).sum::<f64>() / tilde.len() as f64;
                assert!((product - f64::from(u8::from(a == b))).abs() < 1e-8, "{a} {b}: {product}");
            }
        }
        // E = T ẽ gives the same force as ẽ.
        let reduced = [3.0, -2.0, 1.0, 0.5];
        let moduli = basis.to_moduli(&reduced);
        for (c, t) in all.iter().zip(&tilde) {
            let with_moduli: f64 = moduli.iter().zip(c.elastic).map(|(e, c)| e * c).sum();
            let with_reduced: f64 = reduced.iter().zip(t).map(|(e, c)| e * c).sum();
            assert!((with_moduli - with_reduced).abs() < 1e-7, "{with_moduli} {with_reduced}");
        }
    }

    #[test]
    fn three_strokes_determine_two_moduli_beside_the_blocked_one() {
        // At zero stroke every column vanishes.
        let all = mini([0.0, 1e-3, 2e-3].into_iter());
        let basis = Orthonormal::over(&all, 4);
        assert_eq!(basis.rank, 2);
        assert!(basis.condition.is_infinite());
        assert_eq!(basis.to_moduli(&[1.0, 1.0, 0.0, 0.0])[2..], [0.0, 0.0]);
    }

    #[test]
    fn at_rest_length_no_modulus_is_determined_however_the_stroke_rounds() {
        let all = mini([0.0, 1e-12, -2e-9, 1e-8].into_iter());
        let basis = Orthonormal::over(&all, 4);
        assert_eq!(basis.rank, 0);
        assert_eq!(basis.to_moduli(&[1.0; 4]), [0.0; 4]);
    }
}
