//! The vented rows: what is read there comes from the bench.

use std::ops::Range;

use super::Rows;
use crate::criteria::rows::{
    AT_REST_LENGTH, LEVEL_REACH, SAME_ZERO, SAME_ZERO_NOISE, TARE_ROWS, VENTED_PRESSURE, VENTED_SHARE,
};

/// The stretches of rows in which a muscle stays vented.
fn tares(rows: &Rows) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut from = 0;
    let together = |i: usize| (rows.vented[i], rows.recording[i]);
    (1..=rows.len()).filter_map(move |i| {
        if i < rows.len() && together(i) == together(from) {
            return None;
        }
        let stretch = from..i;
        from = i;
        rows.vented[stretch.start].then_some(stretch)
    })
}

/// Whether all tares read the same, within each and from one to the next. What does not is partly the muscle's: a bladder that still
/// remembers, a length that is not what it was, a guide that stuck.
fn zeros_agree<'a>(tares: impl Iterator<Item = &'a [f64]>) -> bool {
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let (mut least, mut most, mut doubt) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    for force in tares.filter(|f| f.len() >= TARE_ROWS) {
        let third = force.len() / 3;
        let ends = [mean(&force[..third]), mean(&force[force.len() - third..])];
        let steps: f64 = force.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        doubt = doubt.max((steps / (2 * (force.len() - 1) * third) as f64).sqrt());
        least = ends.iter().fold(least, |l, e| l.min(*e));
        most = ends.iter().fold(most, |m, e| m.max(*e));
    }
    most - least <= SAME_ZERO * most.abs().max(least.abs()) + SAME_ZERO_NOISE * doubt
}

/// Rows without pressure worth the name: the muscle cannot pull, so what is read comes from the bench.
/// Which way friction would act does not matter there: `readable` weights count while the length is held.
pub(super) fn mark_vented(rows: &mut Rows, readable: &[f64]) {
    let highest = rows.contexts.iter().map(|c| c.pressure).fold(0.0, f64::max);
    let limit = (VENTED_SHARE * highest).min(VENTED_PRESSURE);
    rows.vented = rows.contexts.iter().map(|c| c.pressure < limit).collect();
    if rows.vented.iter().all(|v| *v) {
        rows.vented.fill(false);
    }
    if zeros_agree(tares(rows).map(|tare| &rows.force[tare])) {
        for i in (0..rows.len()).filter(|i| rows.vented[*i]) {
            // Stretched beyond its rest length even a vented muscle pulls.
            if rows.contexts[i].contraction >= -AT_REST_LENGTH {
                rows.root_weight[i] = rows.root_weight[i].max(readable[i]);
            }
        }
    }
    rows.levels.retain(|l| *l >= limit || highest <= limit);
    if rows.levels.is_empty() {
        rows.levels.push(highest);
    }
    let last = rows.levels.len() as u32 - 1;
    if rows.steady {
        // Ramps below the lowest pressure worked at lead where no table reaches.
        for i in 0..rows.len() {
            if rows.contexts[i].pressure < LEVEL_REACH * rows.levels[0] && !rows.vented[i] {
                rows.root_weight[i] = 0.0;
            }
        }
    }
    let levels = rows.levels.clone();
    for (level, context) in rows.level.iter_mut().zip(&rows.contexts) {
        let p = context.pressure;
        *level = levels
            .iter()
            .enumerate()
            .min_by(|a, b| (a.1 - p).abs().total_cmp(&(b.1 - p).abs()))
            .map_or(0, |(i, _)| i as u32)
            .min(last);
    }
}
