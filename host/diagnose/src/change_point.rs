//! The confidence interval of a change point: when something slipped.
//!
//! A trace does not change smoothly with its change point, so no tangent gives an interval. The likelihood is profiled instead: the change
//! point moves reading by reading with the amplitude refitted, until the likelihood ratio exceeds its 95 % quantile. For a step in
//! noise that is where twice the logarithm has fallen by `−2 ln(1 − √0.95)`
//! (B. E. Hansen, Econometrica 68 (2000) 575–603).

use super::baselines;
use super::candidates::Candidate;
use model_core::effects::Axis;

use super::candidate_fit::{self, CandidateFit};
use super::criteria::uncertainty::{CHANGE_POINT_RATIO, CHANGE_POINT_SCAN};
use super::linear::{add_scaled, dot, energy};
use super::rows::Rows;
use super::selection_step::{SelectedEffect, Selection};
use super::why::ChangePoint;
use pam_data::statistics::NORMAL_95;

/// The index of a change point among an effect's shapes, if it has one.
pub(crate) fn place(candidate: &Candidate, fit: &CandidateFit) -> Option<usize> {
    let axis = |shape: usize| candidate.info.parameters.get(fit.amplitudes.len() + shape).map(|p| p.axis);
    (0..fit.shapes.len()).find(|s| axis(*s) == Some(Axis::Time))
}

/// Where in the campaign a change point lies.
pub(crate) fn of(moment: f64, rows: &Rows) -> ChangePoint {
    let name = |row: usize| rows.names[rows.recording[row] as usize].clone();
    let after = rows.contexts().partition_point(|c| c.time < moment);
    if after == 0 {
        return ChangePoint::Before(name(0));
    }
    if after == rows.len() {
        return ChangePoint::After(name(after - 1));
    }
    if rows.recording[after] != rows.recording[after - 1] {
        return ChangePoint::Between(name(after - 1), name(after));
    }
    let local = rows.local_time[after] - (rows.contexts()[after].time - moment);
    ChangePoint::In(name(after), local)
}

/// The standard deviation of a change point, s; none where the recordings do not determine it.
pub(crate) fn deviation(
    selection: &Selection,
    selected: &SelectedEffect,
    place: usize,
    library: &[Candidate],
    rows: &Rows,
) -> Option<f64> {
    let base = baselines::fit(rows, selection.joint.kind, &[]);
    let at = |moment: f64| {
        let mut fit = selected.fit.clone();
        fit.shapes[place] = moment;
        let trace = candidate_fit::trace(&fit, library, rows);
        baselines::projected(&[trace], rows.root_weight(), &base.span).swap_remove(0)
    };
    let moment = selected.fit.shapes[place];
    let mut unexplained = selection.joint.residual.clone();
    add_scaled(&mut unexplained, 1.0, &at(moment));
    let all = energy(&unexplained);
    let left = |moment: f64| {
        let trace = at(moment);
        all - dot(&unexplained, &trace).powi(2) / energy(&trace).max(f64::MIN_POSITIVE)
    };
    // Change points are distinguishable by the gaps between readings that count.
    let mut times: Vec<f64> = rows
        .contexts()
        .iter()
        .zip(rows.root_weight())
        .filter(|(_, w)| **w > 0.0)
        .map(|(c, _)| c.time)
        .collect();
    times.dedup();
    let gaps = times.len().checked_sub(1).filter(|g| *g > 0)?;
    let here = times.partition_point(|t| *t < moment).clamp(1, gaps);
    let least = left(moment);
    let row = least / selection.noise.independent.max(1.0);
    let possible = |gap: usize| left(0.5 * (times[gap - 1] + times[gap])) - least < CHANGE_POINT_RATIO * row;
    // The likelihood may have several maxima: the whole campaign is scanned first.
    let elsewhere: Vec<usize> =
        (1..=gaps).step_by(gaps.div_ceil(CHANGE_POINT_SCAN)).filter(|gap| possible(*gap)).collect();
    let [first, last] = [elsewhere.first(), elsewhere.last()].map(|gap| gap.map_or(here, |gap| *gap));
    let (first, last) = (first.min(here), last.max(here));
    let earliest = times[first - 1 - farthest(first - 1, |back| possible(first - back))];
    let latest = times[last + farthest(gaps - last, |on| possible(last + on))];
    let deviation = (latest - moment).max(moment - earliest).max(0.0) / NORMAL_95;
    deviation.is_finite().then_some(deviation)
}

/// The farthest possible step out of `steps`, found by strides that double, then halve.
fn farthest(steps: usize, possible: impl Fn(usize) -> bool) -> usize {
    let (mut inside, mut stride) = (0, 1);
    while inside + stride <= steps && possible(inside + stride) {
        inside += stride;
        stride *= 2;
    }
    while stride > 1 {
        stride /= 2;
        if inside + stride <= steps && possible(inside + stride) {
            inside += stride;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::farthest;

    #[test]
    fn the_farthest_possible_step_is_found_wherever_it_is() {
        for steps in 0..40 {
            for last in 0..=steps {
                assert_eq!(farthest(steps, |s| s <= last), last, "of {steps}");
            }
        }
    }
}
