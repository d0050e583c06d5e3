//! Each tested pressure predicted from the others.

use rayon::prelude::*;

use super::Options;
use super::errors::{chunks, errors};
use super::smoothing;
use super::solution::Solution;
use pam_data::progress::Progress;

/// Each tested pressure predicted from the others by refitting without it, its smoothing chosen anew. Per group, the mean
/// error.
pub(super) fn predict_left_out(
    solution: &Solution,
    options: &Options,
    progress: &dyn Progress,
) -> Vec<Option<f64>> {
    let groups = solution.problem.design.groups;
    let used: Vec<bool> = {
        let mut used = vec![false; groups];
        for (row, w) in solution.problem.design.rows.iter().zip(&solution.weights) {
            used[solution.problem.design.bins[row.bin as usize].group as usize] |= *w > 0.0;
        }
        used
    };
    if used.iter().filter(|u| **u).count() < 2 {
        return vec![None; groups];
    }
    progress.stage("predicting each pressure from the others", groups as u64);
    (0..groups)
        .into_par_iter()
        .map(|g| {
            if !used[g] {
                progress.step();
                return None;
            }
            let weights: Vec<f64> = solution
                .problem
                .design
                .rows
                .iter()
                .zip(&solution.weights)
                .map(|(row, w)| {
                    if solution.problem.design.bins[row.bin as usize].group as usize == g { 0.0 } else { *w }
                })
                .collect();
            let mut parameters = solution.parameters.clone();
            let smoothing = if options.smoothing.is_some() {
                solution.smoothing
            } else {
                smoothing::choose(&solution.problem.design, &parameters, &weights).0
            };
            let data = solution.problem.design.normal(&parameters, &weights);
            let penalty = solution.problem.design.penalty(&data, smoothing.elastic, smoothing.friction);
            solution.problem.design.solve_from(data, &mut parameters, &weights, &penalty, 6);
            let residuals = solution.problem.design.residuals(&parameters);
            let chunks = chunks(solution, &residuals, |group| group as usize == g);
            progress.step();
            (!chunks.is_empty()).then(|| errors(&chunks, |_| true).mean)
        })
        .collect()
}
