//! One round of the least-squares problem: rows that are linear in the unknowns, penalties, bounds, and the choice of the smoothing.

use pam_fit::numerics::symmetric::{Symmetric, dot};

use super::super::criteria::{
    HELD_BOUND_ROUNDS, HELD_DEADBAND, HELD_DEADBAND_ERROR, HELD_FLATNESS, HELD_FOLDS, HELD_GAMMA_ERROR,
    HELD_NEXT_COEFFICIENT, HELD_RESIDUAL, HELD_SMOOTHNESS,
};
use super::{AT, Open, Problem, Solution};

/// Weights of the penalties on the curves over pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Smoothing {
    /// On second differences.
    pub(super) curvature: f64,
    /// On first differences.
    pub(super) slope: f64,
}

/// Normal equations of the pulling points of some runs, their right-hand side and its sum of squares.
#[derive(Clone)]
pub(super) struct Fold {
    matrix: Symmetric,
    moment: Vec<f64>,
    squares: f64,
}

/// The rows of one round: the columns depend on the last solution.
pub(super) struct Round<'a> {
    problem: &'a Problem<'a>,
    rows: Vec<Vec<(usize, f64)>>,
    right: Vec<f64>,
    /// Normal equations and right-hand sides of the pulling points, by fold.
    pub(super) folds: Vec<Fold>,
    /// Amplitudes that are fitted.
    open: Open,
}

impl<'a> Round<'a> {
    pub(super) fn new(
        problem: &'a Problem<'a>,
        columns: &[Vec<f64>],
        open: Open,
        last: Option<&Solution>,
    ) -> Self {
        let points = problem.points;
        let mut rows = Vec::with_capacity(points.len());
        let mut right = Vec::with_capacity(points.len());
        for i in 0..points.len() {
            let s = f64::from(points.direction[i]);
            let (friction, bare) =
                last.map_or((0.0, problem.force[i]), |l| (l.friction[i], l.without_friction[i]));
            let mut row = problem.static_row(i);
            // `F ≈ (1 − s k) T(θ) − s (k' − k) T`: linear in θ and k'.
            row.iter_mut().for_each(|(_, x)| *x *= 1.0 - s * friction);
            row.extend((0..open.len()).filter(|a| open[*a]).map(|a| (AT.layers + a, columns[a][i])));
            row.extend(problem.phi[i].iter().enumerate().map(|(j, phi)| (AT.friction + j, -s * phi * bare)));
            rows.push(row);
            right.push(problem.force[i] - s * friction * bare);
        }
        let count = problem.unknowns();
        let mut runs: Vec<usize> =
            (0..points.len()).filter(|i| problem.pulls[*i]).map(|i| points.run[i]).collect();
        runs.dedup();
        let groups = runs.len().clamp(1, HELD_FOLDS);
        let empty = Fold { matrix: Symmetric::zeros(count), moment: vec![0.0; count], squares: 0.0 };
        let mut folds = vec![empty; groups];
        let of_run = |run: usize| runs.iter().position(|r| *r == run).map_or(0, |r| r % groups);
        for i in (0..points.len()).filter(|i| problem.pulls[*i]) {
            let fold = &mut folds[of_run(points.run[i])];
            fold.matrix.add_row(&rows[i], 1.0);
            fold.squares += right[i] * right[i];
            rows[i].iter().for_each(|(a, x)| fold.moment[*a] += x * right[i]);
        }
        Self { problem, rows, right, folds, open }
    }

    fn model(&self, parameters: &[f64], i: usize) -> f64 {
        self.rows[i].iter().map(|(a, x)| x * parameters[*a]).sum()
    }

    /// Penalties and priors.
    fn penalty(&self, smoothing: Smoothing) -> (Symmetric, Vec<f64>) {
        let problem = self.problem;
        let count = problem.unknowns();
        let nodes = problem.basis.nodes();
        let pulling = problem.pulls.iter().filter(|p| **p).count() as f64;
        let mut matrix = Symmetric::zeros(count);
        let mut moment = vec![0.0; count];
        let step = (nodes[nodes.len() - 1] - nodes[0]) / (nodes.len() - 1) as f64;
        let of_point = pulling / nodes.len() as f64;
        let mut smooth = |first: usize, scale: f64| {
            let weight = of_point * scale * scale;
            for j in 1..nodes.len() {
                let h = (nodes[j] - nodes[j - 1]) / step;
                matrix.add_row(
                    &[(first + j - 1, -1.0 / h), (first + j, 1.0 / h)],
                    weight * h * smoothing.slope,
                );
                if j > 1 {
                    let before = (nodes[j - 1] - nodes[j - 2]) / step;
                    let row = [
                        (first + j - 2, 1.0 / before),
                        (first + j - 1, -1.0 / before - 1.0 / h),
                        (first + j, 1.0 / h),
                    ];
                    matrix.add_row(&row, weight * smoothing.curvature * 2.0 / (h + before));
                }
            }
        };
        smooth(AT.friction, problem.largest);
        (0..problem.directions.ncols()).for_each(|q| smooth(problem.curve(q), 1.0));
        let variance = (HELD_RESIDUAL * problem.largest).powi(2);
        let mut prior = |unknown: usize, value: f64, error: f64| {
            let weight = variance / error.powi(2);
            matrix.add(unknown, unknown, weight);
            moment[unknown] += weight * value;
        };
        // Where the lengths leave the wall's law open, each further coefficient gives a share of the one before.
        for q in 1..problem.directions.ncols() {
            let error = problem.largest * HELD_NEXT_COEFFICIENT.powi(q as i32);
            (0..nodes.len()).for_each(|j| prior(problem.curve(q) + j, 0.0, error));
        }
        prior(AT.gamma, 1.0, HELD_GAMMA_ERROR);
        let high = problem.points.highest() * 1e3;
        prior(AT.deadband, HELD_DEADBAND * high, HELD_DEADBAND_ERROR * high);
        (matrix, moment)
    }

    /// Normal equations of all folds but one, with the penalties.
    fn normal(&self, smoothing: Smoothing, without: Option<usize>) -> (Symmetric, Vec<f64>) {
        let (mut matrix, mut moment) = self.penalty(smoothing);
        for (_, fold) in self.folds.iter().enumerate().filter(|(index, _)| Some(*index) != without) {
            matrix.add_scaled(&fold.matrix, 1.0);
            moment.iter_mut().zip(&fold.moment).for_each(|(m, r)| *m += r);
        }
        (matrix, moment)
    }

    /// The solution without one fold, and without the bounds of a slack muscle.
    pub(super) fn without(&self, fold: usize, smoothing: Smoothing) -> Vec<f64> {
        let (matrix, moment) = self.normal(smoothing, Some(fold));
        self.not_negative(&matrix, &moment)
    }

    /// The unknowns that would be negative and may not are held at zero, the most negative first.
    fn not_negative(&self, matrix: &Symmetric, moment: &[f64]) -> Vec<f64> {
        let nodes = self.problem.basis.nodes().len();
        let mut closed: Vec<usize> =
            (0..self.open.len()).filter(|a| !self.open[*a]).map(|a| AT.layers + a).collect();
        loop {
            let mut held = matrix.clone();
            for a in &closed {
                held.add(*a, *a, 1e9 * matrix.at(*a, *a).max(1.0));
            }
            let mut solved = held.factor().solve(moment);
            closed.iter().for_each(|a| solved[*a] = 0.0);
            let negative = |a: &usize| solved[*a] * matrix.at(*a, *a).sqrt();
            // A wall relaxes, a contact spreads with time and takes pressure, friction resists.
            let worst = (AT.layers..AT.friction + nodes)
                .filter(|a| solved[*a] < 0.0 && !closed.contains(a))
                .min_by(|a, b| negative(a).total_cmp(&negative(b)));
            match worst {
                Some(worst) => closed.push(worst),
                None => return solved,
            }
        }
    }

    /// The solution that pulls a slack muscle no more than it reads.
    pub(super) fn solve(&self, smoothing: Smoothing) -> Vec<f64> {
        let (mut matrix, mut moment) = self.normal(smoothing, None);
        let mut parameters = self.not_negative(&matrix, &moment);
        let mut bound = vec![false; self.rows.len()];
        for _ in 0..HELD_BOUND_ROUNDS {
            let above = |i: &usize| {
                let most = self.problem.least;
                self.problem.slack[*i] && !bound[*i] && self.pull(&parameters, *i) > most
            };
            let more: Vec<usize> = (0..self.rows.len()).filter(above).collect();
            if more.is_empty() {
                break;
            }
            for i in more {
                bound[i] = true;
                let right = self.right[i] - self.problem.force[i] + self.problem.least;
                matrix.add_row(&self.rows[i], 1.0);
                self.rows[i].iter().for_each(|(a, x)| moment[*a] += x * right);
            }
            parameters = self.not_negative(&matrix, &moment);
        }
        parameters
    }

    /// The force of the model, N.
    pub(super) fn pull(&self, parameters: &[f64], i: usize) -> f64 {
        self.model(parameters, i) - self.right[i] + self.problem.force[i]
    }

    /// Squared errors of each group of runs when it is left out, N².
    pub(super) fn left_out(&self, smoothing: Smoothing) -> Vec<f64> {
        let of = |(index, fold): (usize, &Fold)| {
            let parameters = self.without(index, smoothing);
            fold.matrix.quadratic(&parameters) - 2.0 * dot(&fold.moment, &parameters) + fold.squares
        };
        self.folds.iter().enumerate().map(of).collect()
    }

    /// The smoothing that predicts left-out runs best.
    pub(super) fn choose(&self) -> Smoothing {
        let all = HELD_SMOOTHNESS.iter().flat_map(|curvature| {
            HELD_FLATNESS
                .iter()
                .map(move |share| Smoothing { curvature: *curvature, slope: share * curvature })
        });
        let scored = all.map(|s| (self.left_out(s).iter().sum::<f64>(), s)).filter(|(q, _)| q.is_finite());
        let best = scored.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(Smoothing { curvature: 1.0, slope: 1.0 }, |(_, s)| s)
    }
}
