//! Ramps of pressure at held length: where they begin, and from where they are judged.

use super::Kinematics;
use crate::criteria::motion::{RAMP_SETTLES, RAMP_STEADY};
use crate::linear::median;

/// A ramp begins before it has passed the threshold by which it is found: back to where the pressure left what it had been about the
/// hold's beginning, even while the muscle still moved. A hold begins and ends within `margin` rows of what the slope of the stroke gives.
pub(super) fn mark_ramps_from_their_start(k: &mut Kinematics, pressure: &[f64], noise: f64, margin: usize) {
    let n = pressure.len();
    let mut from = 0;
    while from < n {
        let mut to = from;
        while to < n && k.held[to] == k.held[from] {
            to += 1;
        }
        if k.held[from]
            && let Some(first) = (from..to).find(|i| k.ramped[*i])
        {
            let earliest = from.saturating_sub(2 * margin);
            let before = median(&mut pressure[earliest..=from.saturating_sub(margin)].to_vec());
            let begun = (earliest..first)
                .rev()
                .find(|i| (pressure[*i] - before).abs() <= noise)
                .map_or(earliest, |i| i + 1);
            k.ramped[begun..(to + margin).min(n)].fill(true);
        }
        from = to;
    }
}

/// Marks the rows of slow ramps, from `turning` Pa after a turn on, as long as the pressure goes on the same way.
pub(super) fn mark_steady_ramps(k: &mut Kinematics, time: &[f64], pressure: &[f64], turning: f64) {
    let mut turn = 0;
    for row in 1..pressure.len() {
        if !k.ramped[row] || !k.ramped[row - 1] || k.direction[row] != k.direction[row - 1] {
            turn = row;
        }
        let (passed, gone) = (time[row] - time[turn], (pressure[row] - pressure[turn]) * k.direction[row]);
        let goes_on = k.pressure_rate[row] * k.direction[row] > RAMP_STEADY * gone / passed.max(1e-9);
        k.on_ramp[row] = k.ramped[row] && k.held[row] && passed > RAMP_SETTLES && gone > turning && goes_on;
    }
}
