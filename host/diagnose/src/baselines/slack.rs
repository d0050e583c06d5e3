//! Rows at which the muscle does not pull: it hangs slack, or the rig pushes it.

use super::Baseline;
use crate::criteria::rows::{NO_LOAD, SLACK_MODEL};
use crate::rows::Rows;

/// Rows at which the rig pushes the muscle: the force is well below zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PushedRows {
    /// They say as little as those of a slack muscle: what presses on it need not be the muscle.
    Excluded,
    /// They count: a contraction stop is seen there.
    Count,
}

/// The rows without those at which the muscle hangs slack (no force although the pressure would give some), and how many these are. A
/// slack muscle's force is its floor, not the model's.
pub(crate) fn without_slack(rows: &Rows, fitted: &Baseline) -> (Rows, usize) {
    without_load(rows, fitted, PushedRows::Excluded)
}

/// The same, where rows at which the rig pushes the muscle may count.
pub(crate) fn without_load(rows: &Rows, fitted: &Baseline, pushed: PushedRows) -> (Rows, usize) {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let slack = |i: usize| {
        let force = if pushed == PushedRows::Count { rows.force[i].abs() } else { rows.force[i] };
        let slack = fitted.quasi[i] < SLACK_MODEL * strongest && force < NO_LOAD * strongest;
        slack && !rows.vented[i] && rows.root_weight()[i] > 0.0
    };
    (rows.without(slack), (0..rows.len()).filter(|i| slack(*i)).count())
}
