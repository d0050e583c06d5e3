//! The vented rows: what is read there comes from the bench.

use std::ops::Range;

use super::gather::Gathered;
use super::levels::Levels;
use model_core::effects::Context;

use crate::criteria::rows::{
    AT_REST_LENGTH, LEVEL_REACH, SAME_ZERO, SAME_ZERO_NOISE, TARE_ROWS, VENTED_PRESSURE, VENTED_SHARE,
};

/// The stretches of rows in which a muscle stays vented.
fn tares<'a>(vented: &'a [bool], recording: &'a [u32]) -> impl Iterator<Item = Range<usize>> + 'a {
    let mut from = 0;
    let together = |i: usize| (vented[i], recording[i]);
    (1..=vented.len()).filter_map(move |i| {
        if i < vented.len() && together(i) == together(from) {
            return None;
        }
        let stretch = from..i;
        from = i;
        vented[stretch.start].then_some(stretch)
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

/// The pressure below which a muscle is vented that was worked up to a highest one, Pa.
pub(crate) fn vented_below(highest: f64) -> f64 {
    (VENTED_SHARE * highest).min(VENTED_PRESSURE)
}

/// The highest pressure, and the one below which a muscle is vented, Pa.
fn limit(contexts: &[Context<f64>]) -> (f64, f64) {
    let highest = contexts.iter().map(|c| c.pressure).fold(0.0, f64::max);
    (highest, vented_below(highest))
}

/// Rows without pressure: the muscle cannot pull, so what is read comes from the bench.
pub(super) fn vented(contexts: &[Context<f64>]) -> Vec<bool> {
    let (_, limit) = limit(contexts);
    let vented: Vec<bool> = contexts.iter().map(|c| c.pressure < limit).collect();
    if vented.iter().all(|v| *v) { vec![false; vented.len()] } else { vented }
}

/// The levels at which the muscle was not vented.
pub(super) fn without_vented(levels: Levels, contexts: &[Context<f64>]) -> Levels {
    let (highest, limit) = limit(contexts);
    let mut pressures = levels.pressures;
    pressures.retain(|l| *l >= limit || highest <= limit);
    if pressures.is_empty() {
        pressures.push(highest);
    }
    Levels { pressures, ..levels }
}

/// Weights of the rows. Which way friction would act does not matter while the muscle is vented: readable weights count there while
/// the length is held. Ramps below the lowest pressure worked at lead where no table reaches.
pub(super) fn weights(rows: &Gathered, vented: &[bool], levels: &Levels) -> Vec<f64> {
    let agree = zeros_agree(tares(vented, &rows.recording).map(|tare| &rows.force[tare]));
    let weight = |i: usize| {
        let context = &rows.contexts[i];
        if vented[i] {
            // Stretched beyond its rest length even a vented muscle pulls.
            let slack = agree && context.contraction >= -AT_REST_LENGTH;
            return if slack { rows.judged[i].max(rows.readable[i]) } else { rows.judged[i] };
        }
        let below = levels.steady && context.pressure < LEVEL_REACH * levels.pressures[0];
        if below { 0.0 } else { rows.judged[i] }
    };
    (0..vented.len()).map(weight).collect()
}
