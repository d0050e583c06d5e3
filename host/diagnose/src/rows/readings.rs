//! Readings of less weight: outliers, ends of the sensor's range, readings on steep flanks.

use crate::criteria::rows::{
    FLANK_STEP, NEGLIGIBLE_ERROR, NO_LOAD, SIMULTANEITY, SPIKE_CHANGE, SPIKE_NOISE, SPIKE_RANGE,
};
use pam_data::recording::{Campaign, usual_change, white_noise};
use pam_data::statistics::extremes;
use pam_data::statistics::median;
use pam_fit::{Clip, clip};

/// Isolated spikes of a series: rows that stand out from the middle of their five neighbours by more than noise can, and by more than the
/// series changes beside them. Where a fast stroke turns, the force has an extremum.
pub(super) fn spikes(series: &[f64]) -> Vec<bool> {
    let n = series.len();
    let noise = white_noise(series);
    let (lo, hi) = extremes(series);
    let limit = (SPIKE_NOISE * noise).max(SPIKE_RANGE * (hi - lo));
    (0..n)
        .map(|i| {
            if i < 2 || i + 3 > n || !(limit > 0.0) {
                return false;
            }
            let mut five = [series[i - 2], series[i - 1], series[i], series[i + 1], series[i + 2]];
            five.sort_unstable_by(f64::total_cmp);
            let off = (series[i] - five[2]).abs();
            off > limit && off > SPIKE_CHANGE * usual_change(series, i..i + 1)
        })
        .collect()
}

/// The ends of the force sensor's range that were met under load. A vented muscle may well read exactly nothing.
pub(super) fn ends(campaign: &Campaign) -> Vec<Clip> {
    let (low, high) = clip(campaign);
    let force = campaign.recordings.iter().filter_map(|r| r.force.as_deref()).flatten();
    let strongest = force.fold(0.0, |s: f64, f| s.max(f.abs()));
    [low, high].into_iter().flatten().filter(|c| c.force.abs() > NO_LOAD * strongest).collect()
}

/// Weights, reduced where the force runs from one branch to the other within a few rows: there the time skew between force and stroke
/// dominates the error. `whole` holds the pieces in which the usual change from row to row is counted: half-strokes, or recordings where the
/// length is held, since a vent is a piece of its own there.
pub(super) fn blurred(force: &[f64], mut weights: Vec<f64>, whole: &[u32], recording: &[u32]) -> Vec<f64> {
    let strongest = force.iter().copied().fold(0.0, f64::max);
    let step = |i: usize| (force[i + 1] - force[i]).abs();
    let n = force.len();
    let mut from = 0;
    for i in 1..=n {
        if i < n && whole[i] == whole[from] && recording[i] == recording[from] {
            continue;
        }
        let mut steps: Vec<f64> = (from..i - 1).map(step).collect();
        let usual = if steps.is_empty() { 0.0 } else { median(&mut steps) };
        for j in from + 1..i.saturating_sub(1) {
            let excess = (step(j - 1).min(step(j)) - FLANK_STEP * usual).max(0.0);
            weights[j] /= (1.0 + (SIMULTANEITY * excess / (NEGLIGIBLE_ERROR * strongest)).powi(2)).sqrt();
        }
        from = i;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vent of half a second between two holds: a half-stroke of its own has no slower rows to compare it with.
    #[test]
    fn readings_of_a_vent_count_less_where_the_length_is_held() {
        let force: Vec<f64> =
            (0..200).map(|i| (1000.0 - 100.0 * (i as f64 - 100.0).clamp(0.0, 10.0)).max(0.0)).collect();
        let recording = vec![0; 200];
        let half_strokes: Vec<u32> = (0..200).map(|i| u32::from(i > 100) + u32::from(i > 110)).collect();
        let of_vent = |whole: &[u32]| blurred(&force, vec![1.0; 200], whole, &recording)[105];
        assert!(of_vent(&recording) < 0.1, "{}", of_vent(&recording));
        assert!(of_vent(&half_strokes) > 0.9, "{}", of_vent(&half_strokes));
    }

    /// The force of a fast stroke, which friction turns with, and the same with three spikes.
    #[test]
    fn the_extremum_of_a_fast_stroke_is_no_spike() {
        let noise = |i: usize| ((i * 7919 % 13) as f64 / 13.0 - 0.5) * 0.2;
        let triangle = |i: usize| (i % 16).abs_diff(8) as f64;
        let shortens = |i: usize| if i % 16 < 8 { 0.9 } else { 1.1 };
        let force: Vec<f64> =
            (0..320).map(|i| shortens(i) * (100.0 + 8.0 * triangle(i)) + noise(i)).collect();
        assert!(!spikes(&force).contains(&true));
        let mut spoiled = force;
        for i in [45, 120, 248] {
            spoiled[i] += 90.0;
        }
        let found: Vec<usize> = (0..320).filter(|i| spikes(&spoiled)[*i]).collect();
        assert_eq!(found, [45, 120, 248]);
    }
}
