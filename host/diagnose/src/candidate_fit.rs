//! The fit of one candidate beside a baseline.

use super::baselines::{Absorbable, PriorDeviations, projected};
use super::candidates::{Candidate, unplace};
use super::criteria::candidates::LOW_END;
use super::rows::Rows;

/// A candidate fitted beside a baseline at one set of shapes.
#[derive(Clone, Debug)]
pub(crate) struct CandidateFit {
    /// Index into the library.
    pub candidate: usize,
    /// Its shapes.
    pub shapes: Vec<f64>,
    /// Its amplitudes, signs kept.
    pub amplitudes: Vec<f64>,
    /// How much less the deviance is with it than without, less what its free numbers cost.
    pub score: f64,
    /// How much bladder and friction differ between pressures beside it.
    pub prior: PriorDeviations,
    /// Energy that it takes from the weighted residual, N².
    pub gain: f64,
    /// The energy that is there without it, N².
    pub before: f64,
    /// Energy that it takes where one bladder has to serve all pressures, N²; and what there was.
    pub relief: f64,
    /// See `relief`.
    pub unrelieved: f64,
    /// Share of its columns' energy that the baseline cannot imitate: not at all, and within its prior.
    pub visible: f64,
    /// Share that is left by the freest tables.
    pub beyond_tables: f64,
    /// Block by block, the inner product of its fitted trace and the residual (for tests by whole blocks).
    pub scores: Vec<f64>,
    /// The same for each single amplitude's column, per unit norm.
    pub singles: Vec<Vec<f64>>,
    /// Weighted root mean square of the fitted trace before the baseline is refitted, N.
    pub size: f64,
    /// The largest force that it makes at any row, N.
    pub peak: f64,
    /// The rows about the base that its law is made from, where that is another than the present one.
    pub about: Option<Rows>,
}

impl CandidateFit {
    /// The same, made from the base that these rows are linearised about.
    pub(super) fn seen_from(self, rows: Rows) -> Self {
        Self { about: Some(rows), ..self }
    }

    /// The rows that its law is made from.
    pub(super) fn source<'a>(&'a self, rows: &'a Rows) -> &'a Rows {
        self.about.as_ref().unwrap_or(rows)
    }

    /// Its force per unit of each amplitude, N.
    pub(crate) fn columns(&self, library: &[Candidate], rows: &Rows) -> Vec<Vec<f64>> {
        library[self.candidate].columns(&self.shapes, self.source(rows))
    }

    /// Whether it stays within what is known of the effect: no shape at the low end of its range, where a law becomes a simpler one (a
    /// memory a rate, a breakaway plain friction), and no lag beyond its known range. Other sizes depend on muscle and bench.
    pub(super) fn is_within_known_range(&self, candidate: &Candidate) -> bool {
        let amplitudes = candidate.info.parameters.iter().zip(&self.amplitudes);
        let seen = amplitudes.filter(|(p, _)| p.bounded).all(|(p, a)| a.abs() <= p.largest());
        seen && candidate.shapes().zip(&self.shapes).all(|(p, s)| unplace(&p, *s) > LOW_END)
    }
}

/// The fitted trace of a candidate over the rows, N.
pub(crate) fn trace(fit: &CandidateFit, library: &[Candidate], rows: &Rows) -> Vec<f64> {
    let columns = fit.columns(library, rows);
    (0..rows.len()).map(|i| fit.amplitudes.iter().zip(&columns).map(|(a, c)| a * c[i]).sum()).collect()
}

/// The weighted trace of a candidate (of its first column where it has no amplitude) freed of what the baseline expresses.
pub(crate) fn projected_trace(
    fit: &CandidateFit,
    library: &[Candidate],
    rows: &Rows,
    span: &Absorbable,
) -> Vec<f64> {
    let column = trace(fit, library, rows);
    projected(&[column], rows.root_weight(), span).swap_remove(0)
}
