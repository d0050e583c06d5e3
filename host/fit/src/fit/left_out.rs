//! Each tested pressure predicted from the others.

use rayon::prelude::*;

use super::Options;
use super::errors::{chunks, errors};
use super::prepared::Prepared;
use super::smoothing;
use pam_data::progress::Progress;

/// Each tested pressure predicted from the others by refitting without it, its smoothing chosen anew. Per group, the mean
/// error.
pub(super) fn left_out(prepared: &Prepared, options: &Options, progress: &dyn Progress) -> Vec<Option<f64>> {
    let groups = prepared.design.groups;
    let used: Vec<bool> = {
        let mut used = vec![false; groups];
        for (row, w) in prepared.design.rows.iter().zip(&prepared.weights) {
            used[prepared.design.bins[row.bin as usize].group as usize] |= *w > 0.0;
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
            let weights: Vec<f64> = prepared
                .design
                .rows
                .iter()
                .zip(&prepared.weights)
                .map(
                    |(row, w)| {
                        if prepared.design.bins[row.bin as usize].group as usize == g { 0.0 } else { *w }
                    },
                )
                .collect();
            let mut parameters = prepared.parameters.clone();
            let smoothing = if options.smoothing.is_some() {
                prepared.smoothing
            } else {
                smoothing::choose(&prepared.design, &parameters, &weights).0
            };
            let data = prepared.design.normal(&parameters, &weights);
            let penalty = prepared.design.penalty(&data, smoothing.elastic, smoothing.friction);
            prepared.design.solve(&mut parameters, &weights, &penalty, 6);
            let residuals = prepared.design.residuals(&parameters);
            let chunks = chunks(prepared, &residuals, |group| group as usize == g);
            progress.step();
            (!chunks.is_empty()).then(|| errors(&chunks, |_| true).mean)
        })
        .collect()
}
