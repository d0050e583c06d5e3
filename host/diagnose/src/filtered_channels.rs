//! A low-pass filter that force, pressure and stroke all passed through.
//!
//! Friction changes its sign at a reversal. In filtered recordings the stroke turns smoothly, and the force passes over to the
//! other branch within the time of the filter, from before the recorded reversal to behind it ([`law`]). No friction of a muscle begins to
//! turn before the muscle does: that distinguishes a filter from presliding, backlash and lags, which the same rows are compared with. In
//! rows about a reversal a filter mixes both directions of friction. They would be taken for one of these effects, and no longer count.

mod law;
mod turn;

use rayon::prelude::*;

use super::baselines::{self, Baseline, Kind};
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::filtered_channels::{
    FILTER_FEWEST, FILTER_LEAVES, FILTER_MARGIN, FILTER_NEARBY, FILTER_REVERSALS, FILTER_TURNED,
    FILTER_WIDTHS,
};
use super::rows::Rows;
use law::Law;
use pam_data::statistics::median;
use turn::{Turn, turns};

/// What a law leaves about the reversals, N².
fn energy(rows: &Rows, fitted: &Baseline, turns: &[&Turn], law: Law) -> f64 {
    let at = |time: &dyn Fn(&Turn) -> f64| -> f64 {
        turns.iter().map(|turn| turn.energy(rows, fitted, time(turn), law)).sum()
    };
    match law {
        Law::Filter { .. } | Law::AsSpeed(_) => at(&|turn| turn.meets),
        // A motor that slows down before it turns, and one that does not.
        Law::Sharp(_) | Law::AfterTime(_) | Law::AfterTravel(_) => {
            at(&|turn| turn.meets).min(at(&|turn| turn.farthest))
        }
    }
}

/// The law of the least energy.
fn best(rows: &Rows, fitted: &Baseline, turns: &[&Turn], laws: Vec<Law>) -> Option<(Law, f64)> {
    let energies: Vec<f64> = laws.par_iter().map(|law| energy(rows, fitted, turns, *law)).collect();
    laws.into_iter().zip(energies).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The law of a filter, where the reversals show one.
fn filter(rows: &Rows, turns: &[Turn]) -> Option<Law> {
    if turns.len() < FILTER_FEWEST {
        return None;
    }
    let some: Vec<&Turn> = turns.iter().step_by(turns.len().div_ceil(FILTER_REVERSALS)).collect();
    let positive = |value: f64| Some(value).filter(|v| *v > 0.0);
    let mut steps: Vec<f64> = rows.contexts().iter().filter_map(|c| positive(c.dt)).collect();
    let mut speeds: Vec<f64> = rows.contexts().iter().filter_map(|c| positive(c.speed.abs())).collect();
    let (step, speed) = (median(&mut steps), median(&mut speeds));
    let widths = FILTER_WIDTHS.map(|width| width * step);
    let fitted = baselines::fit(rows, Kind::Flexible(TABLE_ORDER), &[]);
    let (_, unfiltered) = best(rows, &fitted, &some, Law::unfiltered(&widths, speed))?;
    let mut found = best(rows, &fitted, &some, Law::filters(&widths))?;
    for factors in FILTER_NEARBY {
        let nearby = factors.iter().filter_map(|factor| found.0.widened(*factor)).collect();
        found = best(rows, &fitted, &some, nearby).filter(|near| near.1 < found.1).unwrap_or(found);
    }
    let (law, filtered) = found;
    (filtered < FILTER_LEAVES * unfiltered).then_some(law)
}

/// The rows without those about reversals at which a filter of all channels mixes both directions of friction; and over which time, s,
/// friction turns in the recordings, where they show a filter.
pub(crate) fn settle(rows: &Rows) -> (Rows, Option<f64>) {
    let turns = turns(rows);
    let Some(law) = filter(rows, &turns) else { return (rows.clone(), None) };
    let mut mixed = vec![false; rows.len()];
    let mut times = Vec::new();
    for turn in &turns {
        let is_mixed =
            |i: &usize| (rows.sign[*i] - turn.friction(rows, *i, turn.meets, law)).abs() > FILTER_TURNED;
        // From the reversal on, on both sides.
        let before = (turn.from..turn.at).rev().take_while(is_mixed).count();
        let after = (turn.at..turn.to).take_while(is_mixed).count();
        let time = |i: usize| rows.local_time[i];
        times.push(time(turn.at + after) - time(turn.at - before));
        let wider = |n: usize| (FILTER_MARGIN * n as f64).ceil() as usize;
        let from = turn.at.saturating_sub(wider(before)).max(turn.from);
        mixed[from..(turn.at + wider(after)).min(turn.to)].fill(true);
    }
    (rows.without(|i| mixed[i]), Some(median(&mut times)))
}
