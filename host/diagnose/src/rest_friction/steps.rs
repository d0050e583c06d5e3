//! Slips of static friction at held length: the force steps, in one step or in a burst of small slips.

use super::residual_at;
use crate::baselines::Baseline;
use crate::criteria::rest_friction::{
    STEP_BEFORE, STEP_BESIDE, STEP_NOISE, STEP_OF_GAP, STEP_ROWS, STEP_SHARPNESS, STEP_TIME,
};
use crate::rows::Rows;
use pam_data::recording::white_noise;
use pam_data::statistics::median;

/// Where the force steps while the length is held, hold by hold: static friction was released there, shaken by more than the pressure's
/// samples show.
pub(super) fn of(
    rows: &Rows,
    fitted: &Baseline,
    holds: &[(usize, usize)],
    directions: &[Vec<f64>],
) -> Vec<Vec<bool>> {
    let found = |((from, to), way): (&(usize, usize), &Vec<f64>)| {
        let left: Vec<f64> = (*from..*to).map(|i| residual_at(rows, fitted, i, way[i - from])).collect();
        let noise = white_noise(&left);
        let least = |i: usize| {
            let gap = 2.0 * (fitted.quasi[from + i] * fitted.friction[from + i]).abs();
            (STEP_NOISE * noise).max(STEP_OF_GAP * gap)
        };
        let time = |i: usize| rows.contexts()[from + i].time;
        let mut steps = vec![false; left.len()];
        let mut near = vec![false; left.len()];
        for within in STEP_ROWS {
            let short =
                |i: &usize| time(i + within) - time(i - within) <= STEP_TIME || within == STEP_ROWS[0];
            let mut sharp: Vec<(usize, f64)> =
                sharp_steps(&left, within, &least).filter(|(i, _)| short(i)).collect();
            sharp.sort_by(|a, b| b.1.total_cmp(&a.1));
            for (i, _) in sharp {
                if near[i] {
                    continue;
                }
                let reach = within + STEP_BESIDE;
                near[i.saturating_sub(reach)..(i + reach + 1).min(left.len())].fill(true);
                // What lies within a burst is a rest of its own.
                steps[i + 1 - within] = true;
                steps[i + within - 1] = true;
            }
        }
        steps
    };
    holds.iter().zip(directions).map(found).collect()
}

/// Times in a hold at which the residual changes, within `within` rows on either side, by more than the `least` step and by most of the change
/// from the time before to the time after; with the size of the change.
fn sharp_steps(
    left: &[f64],
    within: usize,
    least: &impl Fn(usize) -> f64,
) -> impl Iterator<Item = (usize, f64)> {
    let beside = STEP_BESIDE.max(2 * within);
    // A single step can follow the start of a hold directly; a burst needs a time before it.
    let begin = if within == STEP_ROWS[0] { STEP_BEFORE } else { within + beside };
    (begin..left.len().saturating_sub(within + beside - 1)).filter_map(move |i| {
        let middle = |part: &[f64]| median(&mut part.to_vec());
        let before = &left[(i + 1 - within).saturating_sub(beside)..=i - within];
        let step = middle(&left[i + within..i + within + beside]) - middle(before);
        let gone = (left[i + within] - left[i - within]) * step.signum();
        (step.abs() > least(i) && gone >= STEP_SHARPNESS * step.abs()).then_some((i, gone))
    })
}

#[cfg(test)]
mod tests {
    use super::sharp_steps;

    /// The widths within which some step of at least a newton is sharp.
    fn widths(left: &[f64]) -> Vec<usize> {
        let sharp = |within: &usize| sharp_steps(left, *within, &|_| 1.0).next().is_some();
        super::STEP_ROWS.iter().copied().filter(sharp).collect()
    }

    #[test]
    fn a_step_and_a_burst_of_slips_are_sharp_and_what_relaxes_or_drifts_is_not() {
        let held = |f: &dyn Fn(f64) -> f64| (0..300).map(|i| f(0.1 * f64::from(i))).collect::<Vec<f64>>();
        assert!(widths(&held(&|t| if t < 12.05 { 20.0 } else { -20.0 })).contains(&1));
        let burst = held(&|t| 20.0 - 10.0 * ((t - 12.0) / 0.2).floor().clamp(0.0, 4.0));
        let found = widths(&burst);
        assert!(!found.contains(&1) && found.contains(&4), "{found:?}");
        for time in [0.3, 1.0, 3.0, 10.0] {
            assert_eq!(widths(&held(&|t| 20.0 * (-t / time).exp())), [0; 0], "relaxes within {time} s");
        }
        assert_eq!(widths(&held(&|t| 3.0 * t)), [0; 0], "drifts");
        assert_eq!(widths(&held(&|t| 5.0 * (0.6 * t).sin())), [0; 0], "swings");
    }
}
