//! How differences between cells count: by the cells' own variance, what no law describes, and what campaigns usually differ by.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::super::criteria::{CATALOGUE_LAW_ERROR, CATALOGUE_TAKEN, CATALOGUE_USUAL};
use super::cells::Cells;

/// The metric of the cells: the inverse of `D + GS²G' + ZZ'`, freed of what was named before. `D` is the cells' own variance; `G` gives
/// each state a difference of its own, of deviation `S`, which no law describes; `Z` is what campaigns usually differ by.
pub(super) struct Metric<'a> {
    cells: &'a Cells,
    inverse: DVector<f64>,
    /// By state, 1/(1/s² + Σ 1/d).
    shrunk: Vec<f64>,
    z: DMatrix<f64>,
    images: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
    /// Log density of the difference without an effect, up to a constant.
    pub density: f64,
    /// Image of the difference.
    pub projected: DVector<f64>,
}

impl<'a> Metric<'a> {
    /// `deviation`: by state, N.
    pub fn of(cells: &'a Cells, usual: &[DVector<f64>], deviation: &[f64]) -> Self {
        let n = cells.cells.len();
        let inverse = cells.variance.map(|v| 1.0 / v);
        let mut sums = vec![0.0; cells.groups];
        for (i, w) in inverse.iter().enumerate() {
            sums[cells.group[i]] += w;
        }
        let squares: Vec<f64> = deviation.iter().map(|s| s * s).collect();
        let shrunk = sums.iter().zip(&squares).map(|(w, s2)| 1.0 / (1.0 / s2 + w)).collect();
        let z = if usual.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(usual) };
        let spread: f64 = cells.variance.iter().map(|v| v.ln()).sum::<f64>()
            + sums.iter().zip(&squares).map(|(w, s2)| (s2 * w).ln_1p()).sum::<f64>();
        let mut metric = Self {
            cells,
            inverse,
            shrunk,
            images: z.clone(),
            z,
            factor: None,
            density: 0.0,
            projected: DVector::zeros(n),
        };
        for k in 0..metric.z.ncols() {
            let image = metric.own(&metric.z.column(k).into_owned());
            metric.images.set_column(k, &image);
        }
        let inner = DMatrix::identity(metric.z.ncols(), metric.z.ncols()) + metric.z.tr_mul(&metric.images);
        metric.factor = inner.cholesky();
        let of_z: f64 =
            metric.factor.as_ref().map_or(0.0, |f| f.l_dirty().diagonal().iter().map(|v| 2.0 * v.ln()).sum());
        metric.projected = metric.apply(&cells.difference);
        metric.density = -0.5 * (spread + of_z + cells.difference.dot(&metric.projected));
        metric
    }

    /// Without `Z`.
    fn own(&self, v: &DVector<f64>) -> DVector<f64> {
        let mut weighted = v.component_mul(&self.inverse);
        let mut sums = vec![0.0; self.shrunk.len()];
        for (i, w) in weighted.iter().enumerate() {
            sums[self.cells.group[i]] += w;
        }
        for i in 0..weighted.len() {
            let g = self.cells.group[i];
            weighted[i] -= self.inverse[i] * self.shrunk[g] * sums[g];
        }
        weighted
    }

    pub fn apply(&self, v: &DVector<f64>) -> DVector<f64> {
        let own = self.own(v);
        let Some(factor) = &self.factor else { return own };
        let back = factor.solve(&self.images.tr_mul(v));
        own - &self.images * back
    }

    /// `v` without what campaigns usually differ by and what was named before, as far as `v` shows them.
    pub fn without_usual(&self, v: &DVector<f64>) -> DVector<f64> {
        let Some(factor) = &self.factor else { return v.clone() };
        v - &self.z * factor.solve(&self.images.tr_mul(v))
    }
}

/// What campaigns usually differ by without a change, as columns of one standard deviation; and what was named before, at any size.
pub(super) fn usual(cells: &Cells, taken: &[DVector<f64>]) -> Vec<DVector<f64>> {
    let n = cells.cells.len();
    let unit = CATALOGUE_USUAL * cells.largest;
    let recordings = cells.cells.iter().map(|c| c.recording + 1).max().unwrap_or(0);
    let zero = |recording: usize| {
        DVector::from_fn(n, |i, _| if cells.cells[i].recording == recording { unit } else { 0.0 })
    };
    let mut columns: Vec<DVector<f64>> = (0..recordings).map(zero).collect();
    let contexts = cells.rows.contexts();
    let of_rows = |value: &dyn Fn(usize) -> f64| {
        let column: Vec<f64> = (0..contexts.len()).map(value).collect();
        cells.means(&column)
    };
    // The whole campaign: gain, zero of the gauge, stroke, friction.
    let whole = [
        of_rows(&|i| contexts[i].quasi),
        of_rows(&|i| contexts[i].pull_per_pressure()),
        of_rows(&|i| contexts[i].stiffness),
        of_rows(&|i| contexts[i].quasi * contexts[i].direction),
    ];
    let scaled = |column: &DVector<f64>, size: f64| {
        let peak = column.amax();
        (peak > 0.0 && peak.is_finite()).then(|| column * (size / peak))
    };
    columns.extend(whole.iter().filter_map(|c| scaled(c, unit)));
    columns.extend(taken.iter().filter_map(|c| scaled(c, CATALOGUE_TAKEN * cells.largest)));
    columns
}

/// What no law describes in each state, N, where one with this trace is there: beside `least`, a share of the trace in the state, and nowhere
/// less than that share of the usual trace. Laws of memory or of turns are concentrated in few states, and their error with them.
/// `state`: of each cell.
pub(super) fn with_error(state: &[usize], trace: &DVector<f64>, least: &[f64], share: f64) -> Vec<f64> {
    let usual = (trace.norm_squared() / trace.len().max(1) as f64).sqrt();
    let mut sums = vec![(0.0, 0.0); least.len()];
    for (t, s) in trace.iter().zip(state) {
        let sum = &mut sums[*s];
        *sum = (sum.0 + t * t, sum.1 + 1.0);
    }
    let own = |(square, count): (f64, f64)| f64::sqrt(square / f64::max(count, 1.0)).max(usual);
    sums.into_iter().zip(least).map(|(sum, least)| least.hypot(share * own(sum))).collect()
}

/// Whether two traces differ by less than a law is inexact by, by their products in the metric: then the cells do not distinguish them, at any
/// size.
pub(super) fn is_same(first: f64, second: f64, both: f64) -> bool {
    let cosine = both / (first * second).sqrt();
    cosine > 0.0 && 1.0 - cosine * cosine < CATALOGUE_LAW_ERROR * CATALOGUE_LAW_ERROR
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_law_is_largest_where_its_trace_is() {
        // Four states of one cell each; the law shows in the last.
        let trace = DVector::from_vec(vec![0.0, 0.0, 0.0, 8.0]);
        let error = with_error(&[0, 1, 2, 3], &trace, &[0.1; 4], CATALOGUE_LAW_ERROR);
        assert!((error[3] - f64::hypot(0.1, CATALOGUE_LAW_ERROR * 8.0)).abs() < 1e-12, "{error:?}");
        assert!((error[0] - f64::hypot(0.1, CATALOGUE_LAW_ERROR * 4.0)).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn traces_are_the_same_within_the_error_of_a_law() {
        let with = |share: f64| is_same(4.0, 1.0 + share * share, 2.0);
        assert!(with(0.0) && with(0.9 * CATALOGUE_LAW_ERROR) && !with(1.1 * CATALOGUE_LAW_ERROR));
        // The same shape the other way round is another change.
        assert!(!is_same(4.0, 1.0, -2.0));
        assert!(!is_same(0.0, 1.0, 0.0));
    }
}
