//! Readings that say less than others: outliers, ends of the sensor's range, moments that are not known well enough.

use super::Rows;
use crate::kinematics::white_noise;
use crate::linear::median;
use pam_data::recording::Campaign;
use pam_fit::{Clip, clip};

/// Isolated spikes of a series: rows that stand out from the middle of their five neighbours by more than noise can.
pub(super) fn spikes(series: &[f64]) -> Vec<bool> {
    let n = series.len();
    let noise = white_noise(series);
    let (lo, hi) = series.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let limit = (9.0 * noise).max(0.004 * (hi - lo));
    (0..n)
        .map(|i| {
            if i < 2 || i + 3 > n || !(limit > 0.0) {
                return false;
            }
            let mut five = [series[i - 2], series[i - 1], series[i], series[i + 1], series[i + 2]];
            five.sort_unstable_by(f64::total_cmp);
            (series[i] - five[2]).abs() > limit
        })
        .collect()
}

/// A reading that is repeated as an end of the sensor's range is under load beyond this share of the largest.
const END_UNDER_LOAD: f64 = 0.02;

/// The ends of the force sensor's range that were met under load. A vented muscle may well read exactly nothing.
pub(super) fn ends(campaign: &Campaign) -> Vec<Clip> {
    let (low, high) = clip(campaign);
    let force = campaign.recordings.iter().filter_map(|r| r.force.as_deref()).flatten();
    let strongest = force.fold(0.0, |s: f64, f| s.max(f.abs()));
    [low, high].into_iter().flatten().filter(|c| c.force.abs() > END_UNDER_LOAD * strongest).collect()
}

/// Force and stroke are read together to this part of a row's time at best.
const TOGETHER: f64 = 0.25;

/// A stroke's steepest part changes the force from row to row by so many times what its middle does.
const STEEP: f64 = 3.0;

/// A misfit of this share of the largest force is no matter.
const NO_MATTER: f64 = 1e-3;

/// Where the force runs from one branch to the other within a few rows, each of them says as little as the moment of its reading is
/// known.
pub(super) fn blur(rows: &mut Rows) {
    let strongest = rows.force.iter().copied().fold(0.0, f64::max);
    let step = |i: usize| (rows.force[i + 1] - rows.force[i]).abs();
    let n = rows.len();
    let mut weights = rows.root_weight.clone();
    let mut from = 0;
    for i in 1..=n {
        if i < n && rows.block[i] == rows.block[from] && rows.recording[i] == rows.recording[from] {
            continue;
        }
        let mut steps: Vec<f64> = (from..i - 1).map(step).collect();
        let usual = if steps.is_empty() { 0.0 } else { median(&mut steps) };
        for j in from + 1..i.saturating_sub(1) {
            let excess = (step(j - 1).min(step(j)) - STEEP * usual).max(0.0);
            weights[j] /= (1.0 + (TOGETHER * excess / (NO_MATTER * strongest)).powi(2)).sqrt();
        }
        from = i;
    }
    rows.root_weight = weights;
}
