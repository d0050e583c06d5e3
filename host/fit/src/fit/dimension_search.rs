//! Effective dimensions, and the length of each mounting: what a tape measure and a data sheet leave uncertain.
//!
//! Each such unknown enters as one more column of the joint problem, `∂F/∂p` at the present solution, with a prior as wide as the
//! uncertainty of the measurement that it represents. The columns are computed again at every step (Gauss–Newton), and a step goes only
//! as far as it lowers the objective of a table solved again at its end. Values stay within stated bounds. Each is reported with the
//! share of the prior's variance that the recordings removed.

use model_core::braid::Geometry;

use super::Options;
use super::basis::columns;
use super::condensed::condense;
use super::dimensions::{Mounting, Unknown, describe, moved};
use super::points::{HeldMounting, Points};
use super::problem::Problem;
use super::screen::Screen;
use super::smoothing::Smoothing;
use super::uncertainty::jackknife_root;
use super::weights::Weights;
use crate::numerics::symmetric::dot;

/// The mountings in which recordings were held at one length, and for each point the index of its own among them.
fn mountings(points: &Points) -> (Vec<HeldMounting>, Vec<Option<usize>>) {
    let mut distinct: Vec<HeldMounting> = Vec::new();
    let of: Vec<Option<usize>> = points
        .mountings
        .iter()
        .map(|held| {
            let held = held.as_ref()?;
            Some(distinct.iter().position(|d| d.is(held)).unwrap_or_else(|| {
                distinct.push(held.clone());
                distinct.len() - 1
            }))
        })
        .collect();
    let of_point = |recording: u32| of.get(recording as usize).copied().flatten();
    (distinct, points.list.iter().map(|p| of_point(p.recording)).collect())
}

/// The unknown dimensions, and what does not change while they are searched for.
struct Unknowns {
    list: Vec<Unknown>,
    nominal: Geometry,
    /// The mountings in which recordings were held.
    held: Vec<HeldMounting>,
    /// The index among them of each point's own.
    mounting: Vec<Option<usize>>,
    /// The measured force of every point, N.
    forces: Vec<f64>,
}

impl Unknowns {
    /// The dimensions that `options` leaves free.
    fn of(problem: &Problem, options: &Options) -> Self {
        let (held, mounting) = mountings(&problem.points);
        let mut list = Vec::new();
        if options.fit_geometry {
            list.extend([Unknown::Angle, Unknown::Diameter, Unknown::Wall]);
        }
        if options.fit_lengths {
            list.extend((0..held.len()).map(Unknown::Offset));
        }
        let forces = problem.design.rows.iter().map(|r| r.force).collect();
        Self { list, nominal: problem.nominal, held, mounting, forces }
    }

    /// The priors' part of the objective at a place; `excess` scales them as the misfit.
    fn prior(&self, at: &[f64], excess: f64) -> f64 {
        excess * self.list.iter().zip(at).map(|(u, a)| (a / u.prior().0).powi(2)).sum::<f64>()
    }

    /// The correction of each point's stroke, m.
    fn shifts(&self, at: &[f64]) -> Vec<f64> {
        let offset = |m: usize| {
            self.list.iter().zip(at).find(|(u, _)| **u == Unknown::Offset(m)).map_or(0.0, |(_, v)| *v)
        };
        self.mounting.iter().map(|m| m.map_or(0.0, offset)).collect()
    }
}

/// A table solved with fixed dimensions: `Σ w r²`, and the same with all penalties and priors.
struct Solved {
    misfit: f64,
    objective: f64,
}

/// A place in the space of the unknowns, with the problem and the table there.
struct Search<'a> {
    unknowns: Unknowns,
    weights: &'a [f64],
    problem: Problem,
    /// The table's parameters, then the unknowns'.
    parameters: Vec<f64>,
    /// The unknowns, each in its own scale.
    at: Vec<f64>,
    /// The ratio of the misfit to what the weights predict, at least 1.
    excess: f64,
    /// The weighted sum of squares that no parameter changes.
    within: f64,
}

/// How often the priors are compared again with the remaining misfit.
const PASSES: usize = 3;
/// Steps of a pass.
const STEPS: usize = 12;

/// Whether `options` leaves lengths open that no recording was held at.
pub(super) fn lacks_mountings(problem: &Problem, options: &Options) -> bool {
    options.fit_lengths && mountings(&problem.points).0.is_empty()
}

/// Finds the dimensions that `options` leaves free: the problem with these dimensions, and the table's parameters there. Both are as
/// they were where nothing is open.
pub(super) fn adjust(
    problem: &Problem,
    screen: &Screen,
    weights: &Weights,
    parameters: Vec<f64>,
    options: &Options,
) -> (Problem, Vec<f64>) {
    let unknowns = Unknowns::of(problem, options);
    let count = unknowns.list.len();
    if count == 0 {
        return (problem.clone(), parameters);
    }
    let size = problem.design.layout().len();
    // Runs that repeat at held lengths say it all in few points; the columns are computed for these again and again.
    let condensed = condense(problem, &weights.values, &unknowns.mounting);
    let found = match &condensed {
        None => None,
        Some(few) => {
            let unknowns = Unknowns::of(&few.problem, options);
            let mut search = Search::new(unknowns, &few.weights, few.problem.clone(), &parameters);
            // What the points of a cell differ by is no part of the few points' misfit.
            let all = problem.design.normal(&parameters, &weights.values).misfit;
            search.within = all - few.problem.design.normal(&parameters, &few.weights).misfit;
            search.find(weights.cells);
            Some((search.at, search.parameters, search.excess))
        }
    };
    let mut search = Search::new(unknowns, &weights.values, problem.clone(), &parameters);
    match found {
        None => search.find(weights.cells),
        Some((at, parameters, excess)) => {
            (search.at, search.parameters) = (at, parameters);
            search.scale_priors(excess);
        }
    }
    search.linearise();
    search.finish(screen, size)
}

impl<'a> Search<'a> {
    /// At the described dimensions, with a table's parameters.
    fn new(unknowns: Unknowns, weights: &'a [f64], mut problem: Problem, parameters: &[f64]) -> Self {
        let count = unknowns.list.len();
        let design = &mut problem.design;
        design.extras = count;
        design.extra = vec![0.0; design.rows.len() * count];
        // With the dimensions free, trends of E_k with pressure are theirs to explain first.
        design.level = 0.03;
        Self {
            at: vec![0.0; count],
            parameters: [parameters, &vec![0.0; count]].concat(),
            unknowns,
            weights,
            problem,
            excess: 1.0,
            within: 0.0,
        }
    }

    /// Finds the dimensions; `cells` is what the weights predict of the misfit.
    fn find(&mut self, cells: f64) {
        for pass in 0..PASSES {
            let at = self.at.clone();
            let misfit = self.solve_at(&at).misfit;
            // Weights take the model for nearly exact. Where it is not, they overstate the information of the points by as much as the
            // misfit exceeds what they predict, and the priors are scaled likewise.
            let before = self.excess;
            self.scale_priors((misfit / cells).max(1.0));
            if pass > 0 && (self.excess / before - 1.0).abs() < 0.05 {
                break;
            }
            self.descend();
        }
    }

    /// Priors at an excess of the misfit.
    fn scale_priors(&mut self, excess: f64) {
        self.excess = excess;
        let design = &mut self.problem.design;
        design.extra_prior = self.unknowns.list.iter().map(|u| excess * u.prior().0.powi(-2)).collect();
        design.hold_deadband = excess * design.origin.max(1.0).powi(-2);
    }

    /// Gauss–Newton steps in the dimensions, each no longer than lowers the objective of a table solved again there: far from the
    /// solution the columns `∂F/∂p` hold over a part of a step only, and whole steps would oscillate.
    fn descend(&mut self) {
        let size = self.parameters.len() - self.at.len();
        let start = self.at.clone();
        let mut best = self.solve_at(&start).objective;
        for _ in 0..STEPS {
            let before = self.parameters.clone();
            self.linearise();
            self.solve(6);
            let towards: Vec<f64> =
                self.parameters[size..].iter().zip(&self.at).map(|(new, a)| new - a).collect();
            // A long step leaves the range in which the columns are good. It is shortened as a whole: a step whose parts are cut
            // one by one need not go downhill.
            let within = self
                .unknowns
                .list
                .iter()
                .zip(&towards)
                .map(|(u, d)| u.prior().0 / d.abs())
                .fold(1.0, f64::min);
            let aim: Vec<f64> = self
                .unknowns
                .list
                .iter()
                .zip(self.at.iter().zip(&towards))
                .map(|(u, (a, d))| (a + within * d).clamp(-u.prior().1, u.prior().1))
                .collect();
            let lower = (0..9).map(|halvings| 0.5_f64.powi(halvings)).find_map(|share| {
                let there: Vec<f64> = self.at.iter().zip(&aim).map(|(a, b)| a + share * (b - a)).collect();
                self.parameters.clone_from(&before);
                let objective = self.solve_at(&there).objective;
                (objective < best).then_some((there, objective))
            });
            let Some((there, objective)) = lower else {
                self.parameters = before;
                let at = self.at.clone();
                self.solve_at(&at);
                return;
            };
            let gained = best - objective;
            (self.at, best) = (there, objective);
            if gained < 1e-4 * best {
                return;
            }
        }
    }

    fn solve(&mut self, steps: usize) {
        self.parameters = self.problem.solve(&self.parameters, self.weights, Smoothing::START, steps);
    }

    /// Solves the table with the dimensions fixed at a place.
    fn solve_at(&mut self, at: &[f64]) -> Solved {
        self.apply(at);
        self.problem.design.extra.fill(0.0);
        self.restore_forces();
        let size = self.parameters.len() - at.len();
        self.parameters[size..].fill(0.0);
        let data = self.problem.design.normal(&self.parameters, self.weights);
        let penalty = self.problem.penalty(&data, Smoothing::START);
        let design = &self.problem.design;
        let misfit =
            self.within + design.solve_from(data, &mut self.parameters, self.weights, &penalty, 6).misfit;
        let prior = self.unknowns.prior(at, self.excess);
        Solved { misfit, objective: misfit + penalty.quadratic(&self.parameters) + prior }
    }

    fn restore_forces(&mut self) {
        for (row, force) in self.problem.design.rows.iter_mut().zip(&self.unknowns.forces) {
            row.force = *force;
        }
    }

    /// Puts the dimensions at the present place, and the columns of their steps beside the others.
    fn linearise(&mut self) {
        let at = self.at.clone();
        self.apply(&at);
        self.problem.design.extra = self.sensitivities();
        let design = &mut self.problem.design;
        for (i, row) in design.rows.iter_mut().enumerate() {
            let z = &design.extra[i * at.len()..(i + 1) * at.len()];
            // Linear about `at`: F(p) ≈ F(at) + z (p − at).
            row.force = self.unknowns.forces[i] + dot(z, &at);
        }
        let size = self.parameters.len() - at.len();
        self.parameters[size..].copy_from_slice(&at);
    }

    /// Puts the dimensions at `at` into geometry, braid and rows. `T` stays as it is, so that the `ẽ_k` keep their meaning.
    fn apply(&mut self, at: &[f64]) {
        let problem = &mut self.problem;
        problem.geometry = moved(&self.unknowns.nominal, &self.unknowns.list, at);
        if let Ok(braid) = problem.geometry.build() {
            problem.braid = braid;
        }
        let shift = self.unknowns.shifts(at);
        let design = &mut problem.design;
        for ((row, p), s) in design.rows.iter_mut().zip(&problem.points.list).zip(&shift) {
            let c = columns(&problem.braid, p.stroke + s);
            row.area = c.area;
            row.elastic = design.orthonormal.apply(&c);
        }
    }

    /// `∂F/∂p` of every point, by central differences of the columns at the present parameters.
    fn sensitivities(&self) -> Vec<f64> {
        let (problem, design) = (&self.problem, &self.problem.design);
        let curves = design.curves(&self.parameters);
        let grips: Vec<f64> =
            (0..design.rows.len()).map(|i| design.evaluate(i, &self.parameters, &curves).grip).collect();
        let deadband = problem.deadband(&self.parameters);
        let count = self.unknowns.list.len();
        let mut extra = vec![0.0; design.rows.len() * count];
        for (m, u) in self.unknowns.list.iter().enumerate() {
            let h = u.step();
            let side = |by: f64| {
                let mut to = self.at.clone();
                to[m] += by;
                let geometry = moved(&self.unknowns.nominal, &self.unknowns.list, &to);
                (geometry.build().unwrap_or(problem.braid), self.unknowns.shifts(&to))
            };
            let ((after, shift_after), (before, shift_before)) = (side(h), side(-h));
            for (i, p) in problem.points.list.iter().enumerate() {
                if let Unknown::Offset(k) = u
                    && self.unknowns.mounting[i] != Some(*k)
                {
                    continue;
                }
                let a = columns(&after, p.stroke + shift_after[i]);
                let b = columns(&before, p.stroke + shift_before[i]);
                let (ta, tb) = (design.orthonormal.apply(&a), design.orthonormal.apply(&b));
                let moduli = design.reduced_at(design.rows[i].bin, &curves);
                let mut force = (p.pressure - deadband) * (a.area - b.area);
                for ((e, x), y) in moduli.iter().zip(&ta).zip(&tb) {
                    force += e * (x - y);
                }
                extra[i * count + m] = grips[i] * force / (2.0 * h);
            }
        }
        extra
    }

    /// The problem with the found dimensions fixed, and the table's `size` parameters there.
    fn finish(mut self, screen: &Screen, size: usize) -> (Problem, Vec<f64>) {
        let data = self.problem.design.normal(&self.parameters, self.weights);
        let penalty = self.problem.penalty(&data, Smoothing::START);
        let root = jackknife_root(&self.problem, screen, self.weights, &self.parameters, (&data, &penalty));
        self.restore_forces();
        let Self { unknowns, weights, mut problem, mut parameters, at, .. } = self;
        let found = || unknowns.list.iter().zip(&at).enumerate();
        problem.adjusted = found()
            .map(|(m, (u, value))| {
                describe(&unknowns.nominal, *u, *value, root.std(size + m), &unknowns.held)
            })
            .collect();
        problem.mountings = found()
            .filter_map(|(_, (u, v))| match u {
                Unknown::Offset(m) => {
                    let held = &unknowns.held[*m];
                    Some(Mounting { label: held.label.clone(), stroke: held.stroke, offset: *v })
                }
                _ => None,
            })
            .collect();
        problem.shift = unknowns.shifts(&at);
        parameters.truncate(size);
        let design = &mut problem.design;
        (design.extras, design.extra, design.extra_prior) = (0, Vec::new(), Vec::new());
        let parameters = problem.solve(&parameters, weights, Smoothing::START, 8);
        (problem, parameters)
    }
}
