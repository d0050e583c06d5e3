//! What came of trying one candidate beside a baseline.

use super::baselines::{Give, Reach, projected};
use super::candidates::{Candidate, unplace};
use super::criteria::candidates::LOW_END;
use super::rows::Rows;

/// A candidate tried beside a baseline at one set of shapes.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    /// Index into the library.
    pub candidate: usize,
    /// Its shapes.
    pub shapes: Vec<f64>,
    /// Its amplitudes, signs kept.
    pub amplitudes: Vec<f64>,
    /// How much less the deviance is with it than without, less what its free numbers cost.
    pub score: f64,
    /// How much bladder and friction differ between pressures beside it.
    pub give: Give,
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
}

impl Trial {
    /// Whether it stays within what is known of the effect: no shape at the low end of its range, where a law becomes a simpler one (a
    /// memory a rate, a breakaway plain friction), and no lag beyond what anybody has seen. Other sizes go by the muscle and the bench.
    pub(super) fn keeps_within_the_known(&self, candidate: &Candidate) -> bool {
        let amplitudes = candidate.info.parameters.iter().zip(&self.amplitudes);
        let seen =
            amplitudes.filter(|(p, _)| p.unit == "s").all(|(p, a)| a.abs() <= p.low.abs().max(p.high.abs()));
        seen && candidate.shapes().zip(&self.shapes).all(|(p, s)| unplace(&p, *s) > LOW_END)
    }
}

/// The fitted trace of a trial over the rows, N.
pub(crate) fn trace(trial: &Trial, library: &[Candidate], rows: &Rows) -> Vec<f64> {
    let columns = library[trial.candidate].columns(&trial.shapes, rows);
    (0..rows.len()).map(|i| trial.amplitudes.iter().zip(&columns).map(|(a, c)| a * c[i]).sum()).collect()
}

/// The weighted trace of a trial (of its first column where it has no amplitude) freed of what the baseline expresses.
pub(crate) fn projected_trace(trial: &Trial, library: &[Candidate], rows: &Rows, span: &Reach) -> Vec<f64> {
    let column = trace(trial, library, rows);
    projected(&[column], rows.root_weight(), span).swap_remove(0)
}
