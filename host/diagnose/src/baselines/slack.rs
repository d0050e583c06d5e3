//! Rows at which the muscle does not pull: it hangs slack, or the rig pushes it.

use super::Baseline;
use pam_data::statistics::median;

use crate::criteria::rows::{AT_REST_LENGTH, NO_LOAD, SLACK_MODEL, TARE_ROWS};
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
    let zeros = zeros(rows);
    let slack = |i: usize| {
        let pull = rows.force[i] - zeros[rows.recording[i] as usize];
        let force = if pushed == PushedRows::Count { pull.abs() } else { pull };
        let slack = fitted.quasi[i] < SLACK_MODEL * strongest && force < NO_LOAD * strongest;
        slack && !rows.vented[i] && rows.root_weight()[i] > 0.0
    };
    (rows.without(slack), (0..rows.len()).filter(|i| slack(*i)).count())
}

/// What the load cell reads of a vented muscle in each recording, N; where a recording has no such rows, in all of them, or else zero. A
/// cell whose zero is wrong reads it of a slack muscle too.
fn zeros(rows: &Rows) -> Vec<f64> {
    let recordings = rows.names.len();
    let mut read = vec![Vec::new(); recordings];
    let at_rest = |i: &usize| rows.vented[*i] && rows.contexts()[*i].contraction >= -AT_REST_LENGTH;
    for i in (0..rows.len()).filter(at_rest) {
        read[rows.recording[i] as usize].push(rows.force[i]);
    }
    let mut all: Vec<f64> = read.concat();
    let common = if all.len() >= TARE_ROWS { median(&mut all) } else { 0.0 };
    let zero = |own: &mut Vec<f64>| if own.len() >= TARE_ROWS { median(own) } else { common };
    read.iter_mut().map(zero).collect()
}
