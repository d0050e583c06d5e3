//! The tables as evidence: they absorb physics, and keep its pattern over pressure.

use super::baselines::Baseline;
use super::candidate_fit::CandidateFit;
use super::candidates::Candidate;
use super::criteria::judgement::{
    FEWEST_LEVELS_READ, INVERSE_ADVANTAGE, INVERSE_PART, INVERSE_SHARE, MOST_LISTED, STRAIGHT_CHANGE,
    STRAIGHT_SHARE,
};
use super::criteria::selection::LEAST_SCORE;
use super::remark::Remark;
use super::rows::Rows;
use super::selection_step::Selection;

/// The remark where the tables differ between pressures more than a bladder does, and no effect is selected.
pub(super) fn absorbed_by_tables(
    selection: &Selection,
    library: &[Candidate],
    concealed: f64,
    blocked: f64,
) -> Remark {
    let mut able: Vec<&CandidateFit> =
        selection.first_scan.iter().filter(|t| t.score >= LEAST_SCORE).collect();
    able.sort_by(|a, b| b.score.total_cmp(&a.score));
    let names = able.iter().take(MOST_LISTED).map(|t| library[t.candidate].name().to_owned());
    Remark::Concealed { rms: concealed, share: concealed / blocked, candidates: names.collect() }
}

/// Remarks on patterns over pressure in the fitted tables: flexible tables absorb physics, and keep its pattern.
pub(super) fn patterns_over_pressure(production: &Baseline, rows: &Rows) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let levels = &rows.levels;
    if !rows.steady || levels.len() < FEWEST_LEVELS_READ {
        return remarks;
    }
    let fit_to = |values: &[f64], of: &dyn Fn(f64) -> f64| -> Option<(f64, f64, f64)> {
        let n = values.len() as f64;
        let x: Vec<f64> = levels.iter().map(|p| of(*p)).collect();
        let (mx, my) = (x.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
        let sxx: f64 = x.iter().map(|v| (v - mx).powi(2)).sum();
        let sxy: f64 = x.iter().zip(values).map(|(a, b)| (a - mx) * (b - my)).sum();
        let syy: f64 = values.iter().map(|v| (v - my).powi(2)).sum();
        (sxx > 0.0 && syy > 0.0).then(|| (my - sxy / sxx * mx, sxy / sxx, sxy * sxy / (sxx * syy)))
    };
    let k_f = &production.friction_nodes;
    if let (Some((a, b, by_inverse)), Some((_, _, straight))) =
        (fit_to(k_f, &|p| 1.0 / p), fit_to(k_f, &|p| p))
    {
        let lowest = b / levels[0];
        if by_inverse > INVERSE_SHARE
            && by_inverse > straight + INVERSE_ADVANTAGE
            && b > 0.0
            && lowest > INVERSE_PART * a.abs()
        {
            remarks.push(Remark::InverseFriction { constant: a, slope: b });
        }
    }
    if let Some(e_1) = production.elastic_nodes.first()
        && let Some((a, b, share)) = fit_to(e_1, &|p| p)
    {
        let change = b * (levels[levels.len() - 1] - levels[0]);
        if share > STRAIGHT_SHARE && change.abs() > STRAIGHT_CHANGE * a.abs() {
            remarks.push(Remark::StraightElasticity(change / a.abs().max(1e-9)));
        }
    }
    remarks
}
