//! Several recordings beside each other in one table, each with its own columns.

use super::sample::Sample;
use super::{Guess, Source, roles};
use crate::recording::Quantity;

/// Looks for recordings beside the first. Where they have the same columns, each is described; otherwise nothing is, since a part of the
/// file would pass for all of it. `false` where there is one recording.
pub(super) fn find(sample: &Sample, used: &mut [bool], guess: &mut Guess) -> bool {
    let of_quantity = |quantity: Quantity| -> Vec<usize> {
        let is = |n: &usize| sample.columns[*n].quantity_by_name() == Some(quantity);
        (0..sample.columns.len()).filter(is).collect()
    };
    let [times, pressures, forces] = [Quantity::Time, Quantity::Pressure, Quantity::Force].map(of_quantity);
    let strokes = [Quantity::Displacement, Quantity::Length, Quantity::Contraction]
        .map(|q| of_quantity(q).len())
        .into_iter();
    let recordings = forces.len();
    if recordings < 2 {
        return false;
    }
    if times.len() == recordings
        && let Some(step) = equal_steps(&times)
        && describe(sample, recordings, step, used, guess)
    {
        return true;
    }
    let one_time =
        times.len() == 1 && pressures.len() == recordings && strokes.clone().any(|n| n == recordings);
    if times.len() == recordings || one_time {
        guess.columns.clear();
        guess.unknown.push(format!(
            "{} of time and {recordings} of force: {recordings} recordings seem to be side by side, but not with the same columns in the \
             same order; make one file of each",
            if one_time { "one column".to_owned() } else { format!("{recordings} columns") }
        ).into());
        return true;
    }
    false
}

/// The columns from one recording to the next, where all steps are equal.
fn equal_steps(times: &[usize]) -> Option<usize> {
    let step = times[1] - times[0];
    times.windows(2).all(|w| w[1] - w[0] == step).then_some(step)
}

/// Describes the columns by their numbers, where each recording has them.
fn describe(sample: &Sample, recordings: usize, step: usize, used: &mut [bool], guess: &mut Guess) -> bool {
    let index = |source: &Source| (0..sample.columns.len()).find(|n| roles::source(sample, *n) == *source);
    let Some(own): Option<Vec<usize>> = guess.columns.iter().map(|c| index(&c.source)).collect() else {
        return false;
    };
    let alike = |n: usize, other: usize| {
        let (a, b) = (&sample.columns[n], sample.columns.get(other));
        b.is_some_and(|b| {
            let unit = |c: &super::sample::SampleColumn| c.name.unit.map(|u| u.text);
            a.quantity_by_name() == b.quantity_by_name() && unit(a) == unit(b)
        })
    };
    let all: Vec<usize> = (1..recordings).flat_map(|k| own.iter().map(move |n| n + k * step)).collect();
    let first = own.iter().all(|n| *n < step + own.iter().min().copied().unwrap_or_default());
    if !first || !all.iter().zip(own.iter().cycle()).all(|(other, n)| alike(*n, *other)) {
        return false;
    }
    for (column, n) in guess.columns.iter_mut().zip(&own) {
        column.source = Source::Number(n + 1);
    }
    all.iter().for_each(|n| used[*n] = true);
    guess.side_by_side = Some((recordings, step));
    guess.checks.retain(|note| !note.is_on_choice());
    guess.checks.push(format!("{recordings} recordings are side by side, {step} columns apart").into());
    if own.iter().chain(&all).any(|n| sample.columns[*n].missing > 0) {
        guess.skip_missing = true;
        guess.checks.push("some of them lack numbers in some rows, which are left out there".into());
    }
    true
}
