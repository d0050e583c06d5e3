//! How much the curves over pressure may bend: chosen by predicting each pressure from the others.
//!
//! Around a solution the problem is linear, so leaving a group of points out is a subtraction from the normal equations:
//! every candidate weight is tried on every group without touching the points again.

use super::design::Design;
use super::normal_equations::NormalEquations;
use crate::numerics::symmetric::dot;

/// Scores that differ by less than this share are similar.
const ALIKE: f64 = 0.01;

/// Weights of the penalty on the curvature of the curves over pressure, relative to the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// Weight on the curvature of the `E_k`.
    pub elastic: f64,
    /// Weight on the curvature of `k_F`.
    pub friction: f64,
}

impl Smoothing {
    /// Stiff enough for straight lines.
    pub(crate) const STRAIGHT: Self = Self { elastic: 1e4, friction: 1e4 };
    /// A start: flexible, yet bridges gaps between pressures.
    pub const START: Self = Self { elastic: 1e-3, friction: 1e-2 };
}

/// One tried pair of weights with its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trial {
    /// The weights.
    pub smoothing: Smoothing,
    /// Mean weighted square error of left-out groups.
    pub score: f64,
}

/// Chooses the weights. `parameters` is a solution nearby, `groups` has the normal equations of each group there, and `points` is the
/// number of points with a weight. Groups without weight are passed over; with fewer than three
/// groups there is nothing to learn, and `START` is returned.
///
/// The first and the last pressure are predicted by continuation, which is another matter than prediction between pressures:
/// they count only where there are too few others.
#[must_use]
pub(crate) fn choose(
    design: &Design,
    parameters: &[f64],
    groups: &[NormalEquations],
    points: usize,
) -> (Smoothing, Vec<Trial>) {
    let used: Vec<usize> = (0..groups.len()).filter(|g| groups[*g].weight > 0.0).collect();
    if used.len() < 3 {
        return (Smoothing::START, Vec::new());
    }
    let mut total = groups[used[0]].clone();
    for g in &used[1..] {
        total.add_scaled(&groups[*g], 1.0);
    }
    let inner = if used.len() >= 4 { &used[1..used.len() - 1] } else { &used[..] };
    let mut trials = Vec::new();
    let mut score = |smoothing: Smoothing| {
        let score = leave_out(design, parameters, &total, groups, inner, smoothing);
        trials.push(Trial { smoothing, score });
        score
    };
    // Both together first, then friction alone: two curves that hardly depend on each other.
    let grid = |from: i32, to: i32| (from..=to).map(|e| 10.0_f64.powf(f64::from(e) / 2.0));
    // Of weights that score similar the stiffest: where the data do not care, curves stay calm.
    let best_of = |scored: Vec<(f64, f64)>, alike: f64| {
        let least = scored.iter().map(|(_, s)| *s).fold(f64::INFINITY, f64::min);
        scored.into_iter().filter(|(_, s)| *s <= (1.0 + alike) * least).map(|(w, _)| w).fold(0.0, f64::max)
    };
    let elastic = best_of(
        grid(-10, 6)
            .map(|w| (w, score(Smoothing { elastic: w, friction: Smoothing::START.friction })))
            .collect(),
        ALIKE,
    );
    let friction = if design.friction {
        // Friction is a small part of a force that noise is as large as: a hundredth of the score is then much evidence. Four units of
        // χ² is what chance does, and each point is about one.
        let alike = ALIKE.min(4.0 / points.max(1) as f64);
        best_of(grid(-8, 6).map(|w| (w, score(Smoothing { elastic, friction: w }))).collect(), alike)
    } else {
        Smoothing::START.friction
    };
    (Smoothing { elastic, friction }, trials)
}

/// Chooses how strongly `E_k` are held constant over pressure, where pressure moved through a range and the muscle was slack
/// at part of it: there a curve without data would run away.
#[must_use]
pub(crate) fn choose_level(design: &Design, parameters: &[f64], groups: &[NormalEquations]) -> f64 {
    let candidates = [1e-4, 1e-3, 1e-2, 1e-1, 1.0];
    let used: Vec<usize> = (0..groups.len()).filter(|g| groups[*g].weight > 0.0).collect();
    if used.len() < 3 {
        return candidates[1];
    }
    let mut total = groups[used[0]].clone();
    for g in &used[1..] {
        total.add_scaled(&groups[*g], 1.0);
    }
    let mut design = design.clone();
    let scores: Vec<f64> = candidates
        .iter()
        .map(|level| {
            design.level = *level;
            let smoothing = [1e-3, 1e-1, 10.0].map(|elastic| Smoothing { elastic, ..Smoothing::START });
            // All groups, the ends too: continuation is what this penalty is for.
            smoothing
                .map(|s| leave_out(&design, parameters, &total, groups, &used, s))
                .into_iter()
                .fold(f64::INFINITY, f64::min)
        })
        .collect();
    let least = scores.iter().copied().fold(f64::INFINITY, f64::min);
    let best = candidates.iter().zip(&scores).filter(|(_, s)| **s <= 1.05 * least).map(|(c, _)| *c);
    best.fold(candidates[0], f64::max)
}

/// The number of points that have a weight.
pub(crate) fn points_with_weight(weights: &[f64]) -> usize {
    weights.iter().filter(|w| **w > 0.0).count()
}

fn leave_out(
    design: &Design,
    parameters: &[f64],
    total: &NormalEquations,
    groups: &[NormalEquations],
    inner: &[usize],
    smoothing: Smoothing,
) -> f64 {
    let penalty = design.penalty(total, smoothing.elastic, smoothing.friction);
    let pull = penalty.times(parameters);
    let mut sum = 0.0;
    for &g in inner {
        let group = &groups[g];
        let mut matrix = total.matrix.clone();
        matrix.add_scaled(&group.matrix, -1.0);
        matrix.add_scaled(&penalty, 1.0);
        let right: Vec<f64> =
            total.right.iter().zip(&group.right).zip(&pull).map(|((a, b), p)| a - b - p).collect();
        let step = matrix.factor().solve(&right);
        let misfit = group.misfit - 2.0 * dot(&group.right, &step) + group.matrix.quadratic(&step);
        sum += misfit / group.weight;
    }
    sum / inner.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::gauss_newton::tests::known_design;

    #[test]
    fn the_quadratic_short_cut_is_the_refit_itself() {
        let (mut design, mut parameters) = known_design(3);
        for (i, row) in design.rows.iter_mut().enumerate() {
            row.force += 0.3 * (i as f64 * 1.7).sin();
        }
        let weights = vec![1.0; design.rows.len()];
        let smoothing = Smoothing { elastic: 1e-2, friction: 1e-2 };
        let all = design.normal(&parameters, &weights);
        let penalty = design.penalty(&all, smoothing.elastic, smoothing.friction);
        design.solve(&mut parameters, &weights, &penalty, 30);
        let groups = design.normal_by_group(&design.bin_sums(&parameters, &weights));
        let short = leave_out(&design, &parameters, &all, &groups, &[2], smoothing);
        let without: Vec<f64> = design.rows.iter().map(|r| f64::from(u8::from(r.bin != 2))).collect();
        let mut refit = parameters.clone();
        design.solve(&mut refit, &without, &penalty, 30);
        let r = design.residuals(&refit);
        let (sum, n) = design
            .rows
            .iter()
            .zip(&r)
            .filter(|(row, _)| row.bin == 2)
            .fold((0.0, 0.0), |(s, n), (_, r)| (s + r * r, n + 1.0));
        // One Gauss–Newton step against a whole refit: friction times elasticity is not linear.
        assert!((short - sum / n).abs() < 0.05 * short, "{short} {}", sum / n);
    }

    #[test]
    fn straight_curves_are_found_to_be_straight() {
        let (mut design, parameters) = known_design(2);
        for (i, row) in design.rows.iter_mut().enumerate() {
            row.force += 0.5 * (i as f64 * 12.9898).sin();
        }
        let weights = vec![1.0; design.rows.len()];
        let groups = design.normal_by_group(&design.bin_sums(&parameters, &weights));
        let (chosen, trials) = choose(&design, &parameters, &groups, weights.len());
        assert!(chosen.elastic >= 1.0 && chosen.friction >= 1.0, "{chosen:?}");
        assert!(trials.iter().all(|t| t.score.is_finite()));
    }
}
