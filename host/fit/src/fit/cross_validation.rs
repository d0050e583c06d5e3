//! Each tested pressure predicted from the others.

use rayon::prelude::*;

use super::Options;
use super::design::Row;
use super::errors::{chunks, errors};
use super::normal_equations::NormalEquations;
use super::smoothing;
use super::solution::Solution;
use pam_data::progress::Progress;

/// Each tested pressure predicted from the others by refitting without it, its smoothing chosen again. Per group, the mean
/// error.
pub(super) fn predict_left_out(
    solution: &Solution,
    options: &Options,
    progress: &dyn Progress,
) -> Vec<Option<f64>> {
    let design = &solution.problem.design;
    let groups = design.groups;
    let used: Vec<bool> = {
        let mut used = vec![false; groups];
        for (row, w) in design.rows.iter().zip(&solution.weights) {
            used[design.bins[row.bin as usize].group as usize] |= *w > 0.0;
        }
        used
    };
    if used.iter().filter(|u| **u).count() < 2 {
        return vec![None; groups];
    }
    progress.stage("predicting each pressure from the others", groups as u64);
    // Leaving a group out leaves the sums of the other bins as they are.
    let sums = design.bin_sums(&solution.parameters, &solution.weights);
    let by_group = design.normal_by_group(&sums);
    (0..groups)
        .into_par_iter()
        .map(|g| {
            if !used[g] {
                progress.step();
                return None;
            }
            let without = |(row, w): (&Row, &f64)| {
                if design.bins[row.bin as usize].group as usize == g { 0.0 } else { *w }
            };
            let weights: Vec<f64> = design.rows.iter().zip(&solution.weights).map(without).collect();
            let mut parameters = solution.parameters.clone();
            let smoothing = if options.smoothing.is_some() {
                solution.smoothing
            } else {
                let mut others = by_group.clone();
                others[g] = NormalEquations::zeros(design.layout().len());
                smoothing::choose(design, &parameters, &others, smoothing::points_with_weight(&weights)).0
            };
            let data = design.normal_of_groups(&sums, |group| group != g);
            let penalty = design.penalty(&data, smoothing.elastic, smoothing.friction);
            design.solve_from(data, &mut parameters, &weights, &penalty, 6);
            let residuals = design.residuals(&parameters);
            let chunks = chunks(solution, &residuals, |group| group as usize == g);
            progress.step();
            (!chunks.is_empty()).then(|| errors(&chunks, |_| true).mean)
        })
        .collect()
}
