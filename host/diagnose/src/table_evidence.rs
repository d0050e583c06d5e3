//! The tables as evidence: they absorb physics, and keep its pattern over pressure.

use super::baselines::Baseline;
use super::candidate_fit::CandidateFit;
use super::candidates::Candidate;
use super::criteria::judgement::{
    FEWEST_LEVELS_READ, INVERSE_ADVANTAGE, INVERSE_PART, INVERSE_SHARE, MOST_LISTED, STRAIGHT_CHANGE,
    STRAIGHT_SHARE,
};
use super::criteria::selection::LEAST_SCORE;
use super::rows::Rows;
use super::selection_step::Selection;

/// The remark where the tables differ between pressures more than a bladder does, and no effect is selected.
pub(super) fn absorbed_by_tables(
    selection: &Selection,
    library: &[Candidate],
    concealed: f64,
    blocked: f64,
) -> String {
    let mut able: Vec<&CandidateFit> =
        selection.first_scan.iter().filter(|t| t.score >= LEAST_SCORE).collect();
    able.sort_by(|a, b| b.score.total_cmp(&a.score));
    let names: Vec<&str> = able.iter().take(MOST_LISTED).map(|t| library[t.candidate].name()).collect();
    let which = if names.is_empty() {
        "no effect of the library makes such a surface".to_owned()
    } else {
        format!(
            "each of these would make such a surface: {}; none of them stands out enough to be named",
            names.join(", ")
        )
    };
    format!(
        "one bladder does not serve all pressures: the tables take up {concealed:.2} N rms ({:.2} % of blocked force) that changes \
         from pressure to pressure; {which}. Tested pressures are described well; between them and beyond, trust the tables less",
        100.0 * concealed / blocked
    )
}

/// Remarks on patterns over pressure in the fitted tables: flexible tables absorb physics, and keep its pattern.
pub(super) fn patterns_over_pressure(production: &Baseline, rows: &Rows) -> Vec<String> {
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
            remarks.push(format!(
                "k_F(P) follows {a:.3} + {:.1} kPa/P: what a friction that does not scale with the force (dry, seal, viscous at one \
                 speed) leaves in the tables",
                b * 1e-3
            ));
        }
    }
    if let Some(e_1) = production.elastic_nodes.first()
        && let Some((a, b, share)) = fit_to(e_1, &|p| p)
    {
        let change = b * (levels[levels.len() - 1] - levels[0]);
        if share > STRAIGHT_SHARE && change.abs() > STRAIGHT_CHANGE * a.abs() {
            remarks.push(format!(
                "E_1 {} in a straight line with pressure, by {:.0} % over the range: one bladder should not; ends that are not \
                 cylinders, a braid that stretches, a gain or a slow change in the order of testing leave this",
                if change > 0.0 { "rises" } else { "falls" },
                100.0 * change.abs() / a.abs().max(1e-9)
            ));
        }
    }
    remarks
}
