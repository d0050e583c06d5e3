//! Generalised least squares: what AFTER differs by beyond what repeats, and how strongly that supports a shape.

use nalgebra::{DMatrix, DVector};

use super::criteria::{LEAST_SCALE, SCALE_PRIOR};

/// `Π = K⁻¹ − K⁻¹X(X'K⁻¹X)⁻¹X'K⁻¹`, with X one level per (mounting, direction, bin).
#[derive(Debug, Clone)]
pub(super) struct Contrast {
    pub projector: DMatrix<f64>,
    pub residual: DVector<f64>,
    /// `Πy`: the residual after the levels, weighted by the inverse covariance.
    pub projected: DVector<f64>,
    /// `y'Πy`: the weighted sum of squares of the residual.
    pub energy: f64,
    /// Cells minus levels.
    pub free: f64,
    /// Independent directions that the runs can determine.
    pub taught: f64,
    /// Log density of the residual if nothing changed, up to a constant; of no meaning with levels.
    pub density: f64,
}

/// Log of the mean of exponentials.
pub(crate) fn log_mean(values: &[f64]) -> f64 {
    log_sum(values) - (values.len().max(1) as f64).ln()
}

/// Log of the sum of exponentials; −∞ for none.
pub(crate) fn log_sum(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if top.is_finite() { top + values.iter().map(|v| (v - top).exp()).sum::<f64>().ln() } else { top }
}

/// Log density of Student's t, up to a constant of its degrees of freedom.
pub(super) fn student(value: f64, variance: f64, degrees: f64) -> f64 {
    -0.5 * variance.ln() - 0.5 * (degrees + 1.0) * (value * value / (variance * degrees)).ln_1p()
}

/// Log evidence of a shape over its absence: `a = s'Πs`, `b = s'Πy`, the amplitude normal with each of the sizes equally likely.
pub(super) fn evidence(a: f64, b: f64, scale: f64, sizes: &[f64]) -> f64 {
    if !(a > 1e-12) {
        return f64::NEG_INFINITY;
    }
    let each: Vec<f64> = sizes
        .iter()
        .map(|size| {
            let t = size * size * a / scale;
            -0.5 * t.ln_1p() + 0.5 * b * b / (a * scale) * t / (1.0 + t)
        })
        .collect();
    log_mean(&each)
}

impl Contrast {
    /// `level` gives the level that each cell belongs to, as an index without gaps; without levels the reference is known.
    /// `None` where the covariance is not positive definite.
    pub fn new(k: DMatrix<f64>, level: Option<&[usize]>, y: DVector<f64>, taught: f64) -> Option<Self> {
        let n = y.len();
        let factor = k.cholesky()?;
        let spread: f64 = factor.l_dirty().diagonal().iter().map(|v| v.ln()).sum();
        let mut projector = factor.inverse();
        let mut levels = 0;
        if let Some(level) = level {
            levels = level.iter().max().map_or(0, |m| m + 1);
            let mut w = DMatrix::<f64>::zeros(n, levels);
            for (j, l) in level.iter().enumerate() {
                let column = projector.column(j).into_owned();
                let mut to = w.column_mut(*l);
                to += column;
            }
            let mut g = DMatrix::<f64>::zeros(levels, levels);
            for (i, l) in level.iter().enumerate() {
                for c in 0..levels {
                    g[(*l, c)] += w[(i, c)];
                }
            }
            let floor = 1e-12 * g.diagonal().max().max(f64::MIN_POSITIVE);
            for i in 0..levels {
                g[(i, i)] += floor;
            }
            let solved = g.cholesky()?.solve(&w.transpose());
            projector -= &w * solved;
        }
        let mut of = Self::from_projector(projector, y, (n as f64 - levels as f64).max(1.0), taught);
        of.density = -spread - 0.5 * of.energy;
        Some(of)
    }

    fn from_projector(projector: DMatrix<f64>, residual: DVector<f64>, free: f64, taught: f64) -> Self {
        let projected = &projector * &residual;
        let energy = residual.dot(&projected);
        Self { projector, residual, projected, energy, free, taught, density: 0.0 }
    }

    /// How much more the runs differ than their class, as a factor on the covariance.
    pub fn scale(&self) -> f64 {
        let taught = self.taught.min(self.free);
        let scale = (SCALE_PRIOR + taught * self.energy / self.free) / (SCALE_PRIOR + taught);
        if scale > LEAST_SCALE { scale } else { LEAST_SCALE }
    }

    /// `s'Πs` and `s'Πy`.
    pub fn products(&self, shape: &DVector<f64>) -> (f64, f64) {
        (shape.dot(&(&self.projector * shape)), shape.dot(&self.projected))
    }

    /// With these shapes at any size taken out: their directions are free. Those that add nothing are left alone.
    pub fn without_shapes(&self, shapes: &[DVector<f64>]) -> Self {
        let mut projector = self.projector.clone();
        for shape in shapes {
            let image = &projector * shape;
            let a = shape.dot(&image);
            if a > 1e-12 {
                projector -= &image * image.transpose() / a;
            }
        }
        Self::from_projector(
            projector,
            self.residual.clone(),
            (self.free - shapes.len() as f64).max(1.0),
            self.taught,
        )
    }

    /// Without some cells: each gets a free level of its own, which is the same as leaving it out.
    pub fn without_cells(&self, dropped: &[usize]) -> Option<Self> {
        if dropped.is_empty() {
            return Some(self.clone());
        }
        let columns = self.projector.select_columns(dropped);
        let mut inner = columns.select_rows(dropped);
        // A level that only dropped cells see leaves no information there.
        let floor = 1e-9 * inner.diagonal().max().max(f64::MIN_POSITIVE);
        for i in 0..dropped.len() {
            inner[(i, i)] += floor;
        }
        let solved = inner.cholesky()?.solve(&columns.transpose());
        let projector = &self.projector - &columns * solved;
        let free = (self.free - dropped.len() as f64).max(1.0);
        Some(Self::from_projector(projector, self.residual.clone(), free, self.taught))
    }

    /// With another residual.
    pub fn with_residual(&self, residual: DVector<f64>) -> Self {
        Self::from_projector(self.projector.clone(), residual, self.free, self.taught)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (DMatrix<f64>, DVector<f64>) {
        let k = DMatrix::from_fn(6, 6, |i, j| {
            (-0.3 * (i as f64 - j as f64).powi(2)).exp() + if i == j { 0.5 } else { 0.0 }
        });
        (k, DVector::from_vec(vec![1.0, -0.4, 0.2, 3.0, 0.7, -1.0]))
    }

    #[test]
    fn a_cell_with_a_free_level_counts_as_left_out() {
        let (k, y) = example();
        let all = Contrast::new(k.clone(), Some(&[0, 0, 1, 1, 0, 1]), y.clone(), 4.0).expect("definite");
        let without = all.without_cells(&[3]).expect("definite");
        let keep = [0, 1, 2, 4, 5];
        let small = Contrast::new(
            k.select_rows(&keep).select_columns(&keep),
            Some(&[0, 0, 1, 0, 1]),
            y.select_rows(&keep),
            4.0,
        )
        .expect("definite");
        assert!((without.energy - small.energy).abs() < 1e-6, "{} {}", without.energy, small.energy);
        assert_eq!(without.free, small.free);
    }

    #[test]
    fn a_level_changes_nothing_and_a_shape_is_found_with_its_size() {
        let (k, y) = example();
        let of = |y| Contrast::new(k.clone(), Some(&[0, 0, 0, 0, 0, 0]), y, 4.0).expect("definite");
        assert!((of(y.clone()).energy - of(y.add_scalar(50.0)).energy).abs() < 1e-8);
        let shape = DVector::from_vec(vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        let (a, b) = of(&shape * 2.5).products(&shape);
        assert!((b / a - 2.5).abs() < 1e-9);
        assert!(of(&shape * 2.5).without_shapes(&[shape]).energy.abs() < 1e-9);
    }

    #[test]
    fn evidence_is_against_a_shape_that_is_not_there_and_for_one_that_is() {
        assert!(evidence(100.0, 0.0, 1.0, &[1.0, 2.0]) < -1.0);
        assert!(evidence(100.0, 200.0, 1.0, &[1.0, 2.0]) > 100.0);
        assert_eq!(evidence(f64::NAN, 1.0, 1.0, &[1.0]), f64::NEG_INFINITY);
    }
}
