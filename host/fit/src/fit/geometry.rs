//! Effective dimensions, and the true length of each mounting: what a tape measure and a data sheet leave open.
//!
//! Each such unknown enters as one more column of the joint problem, `∂F/∂p` at the present solution, with a prior as wide as
//! the measurement it stands for. The columns are computed anew at every step (Gauss–Newton), and a step goes only as far as it lowers
//! the objective of a table solved anew at its end. Values stay within stated bounds, and each is reported with how much of the prior's
//! uncertainty the recordings removed.

use model_core::braid::Geometry;

use super::Options;
use super::basis::columns;
use super::dimensions::{Mounting, Unknown, describe, moved};
use super::linear::dot;
use super::prepared::Prepared;
use super::smoothing::Smoothing;
use super::uncertainty;

/// The strokes that recordings were held at, and for each point which of them it belongs to.
fn mountings(prepared: &Prepared) -> (Vec<f64>, Vec<Option<usize>>) {
    let list = &prepared.points.list;
    let recordings = list.iter().map(|p| p.recording as usize + 1).max().unwrap_or(0);
    let mut held: Vec<Option<f64>> = vec![None; recordings];
    let mut moved = vec![false; recordings];
    for p in list {
        let r = p.recording as usize;
        match held[r] {
            None => held[r] = Some(p.stroke),
            // A tape measure's tenth of a millimetre.
            Some(s) => moved[r] |= (s - p.stroke).abs() > 1e-4,
        }
    }
    let mut strokes: Vec<f64> = Vec::new();
    let of: Vec<Option<usize>> = held
        .iter()
        .zip(&moved)
        .map(|(s, moved)| {
            let s = s.filter(|_| !moved)?;
            Some(strokes.iter().position(|k| (k - s).abs() <= 1e-4).unwrap_or_else(|| {
                strokes.push(s);
                strokes.len() - 1
            }))
        })
        .collect();
    (strokes, list.iter().map(|p| of[p.recording as usize]).collect())
}

/// The dimensions of a muscle while they are being found.
struct Search {
    nominal: Geometry,
    unknowns: Vec<Unknown>,
    /// The strokes that recordings were held at, m.
    strokes: Vec<f64>,
    /// Which of them each point belongs to.
    mounting: Vec<Option<usize>>,
    /// Where the unknowns stand, each in its own scale.
    at: Vec<f64>,
    /// The measured force of every point, N.
    forces: Vec<f64>,
    /// How much larger the misfit is than the weights take it for.
    excess: f64,
}

impl Search {
    /// What the unknowns' priors make of a place, in the misfit's scale.
    fn prior(&self, at: &[f64]) -> f64 {
        self.excess * self.unknowns.iter().zip(at).map(|(u, a)| (a / u.prior().0).powi(2)).sum::<f64>()
    }
}

/// A table with its dimensions held: `Σ w r²`, and that with all penalties and priors.
struct Held {
    misfit: f64,
    objective: f64,
}

/// How often the priors are weighed anew against the misfit that is left.
const PASSES: usize = 3;
/// Steps of a pass.
const STEPS: usize = 12;

impl Prepared {
    /// Finds what `options` leaves open, in place.
    pub(super) fn adjust(&mut self, options: &Options) {
        let (strokes, mounting) = mountings(self);
        let mut unknowns = Vec::new();
        if options.fit_geometry {
            unknowns.extend([Unknown::Angle, Unknown::Diameter, Unknown::Wall]);
        }
        if options.fit_lengths {
            if strokes.is_empty() {
                self.warnings.push("no recording was held at one length: there is no mounting whose length could be corrected".into());
            }
            unknowns.extend((0..strokes.len()).map(Unknown::Offset));
        }
        if unknowns.is_empty() {
            return;
        }
        let size = self.design.layout().len();
        let mut search = Search {
            nominal: self.nominal,
            at: vec![0.0; unknowns.len()],
            forces: self.design.rows.iter().map(|r| r.force).collect(),
            unknowns,
            strokes,
            mounting,
            excess: 1.0,
        };
        self.design.extras = search.at.len();
        self.design.extra = vec![0.0; self.design.rows.len() * search.at.len()];
        // With the dimensions free, trends of E_k with pressure are theirs to explain first.
        self.design.level = 0.03;
        self.parameters.extend(&search.at);
        for pass in 0..PASSES {
            let misfit = self.held_at(&search, &search.at.clone()).misfit;
            // Weights take the model for nearly right. Where it is not, they overstate what the points know by as much as the
            // misfit exceeds them, and the priors have to keep up.
            let before = std::mem::replace(&mut search.excess, (misfit / self.cells).max(1.0));
            self.design.extra_prior =
                search.unknowns.iter().map(|u| search.excess * u.prior().0.powi(-2)).collect();
            self.design.hold_deadband = search.excess * self.design.origin.max(1.0).powi(-2);
            if pass > 0 && (search.excess / before - 1.0).abs() < 0.05 {
                break;
            }
            self.descend(&mut search);
        }
        self.linearise(&search);
        let data = self.design.normal(&self.parameters, &self.weights);
        let penalty = self.design.penalty(&data, Smoothing::START.elastic, Smoothing::START.friction);
        let root = uncertainty::jackknife(self, &penalty).root;
        let found = || search.unknowns.iter().zip(&search.at).enumerate();
        self.adjusted = found()
            .map(|(m, (u, value))| describe(&search.nominal, *u, *value, root.std(size + m), &search.strokes))
            .collect();
        self.mountings = found()
            .filter_map(|(_, (u, v))| match u {
                Unknown::Offset(m) => Some(Mounting { stroke: search.strokes[*m], offset: *v }),
                _ => None,
            })
            .collect();
        self.shift = self.shifts(&search.unknowns, &search.at, &search.mounting);
        // From here on the dimensions are given.
        self.parameters.truncate(size);
        self.design.extras = 0;
        self.design.extra.clear();
        self.design.extra_prior.clear();
        for (row, force) in self.design.rows.iter_mut().zip(&search.forces) {
            row.force = *force;
        }
        self.solve(Smoothing::START, 8);
    }

    /// Gauss–Newton steps in the dimensions, each no longer than lowers the objective of a table solved anew there: far from the
    /// solution the columns `∂F/∂p` hold over a part of a step only, and whole steps would leap from side to side for ever.
    fn descend(&mut self, search: &mut Search) {
        let size = self.parameters.len() - search.at.len();
        let mut best = self.held_at(search, &search.at.clone()).objective;
        for _ in 0..STEPS {
            let before = self.parameters.clone();
            self.linearise(search);
            self.solve(Smoothing::START, 6);
            let aim: Vec<f64> = search
                .unknowns
                .iter()
                .zip(&search.at)
                .zip(&self.parameters[size..])
                .map(|((u, a), new)| {
                    let (sigma, bound) = u.prior();
                    // A long step leaves the range in which the columns are good.
                    (*a + (new - *a).clamp(-sigma, sigma)).clamp(-bound, bound)
                })
                .collect();
            let lower = [1.0, 0.5, 0.25, 0.125, 0.0625].into_iter().find_map(|share| {
                let there: Vec<f64> = search.at.iter().zip(&aim).map(|(a, b)| a + share * (b - a)).collect();
                self.parameters.clone_from(&before);
                let objective = self.held_at(search, &there).objective;
                (objective < best).then_some((there, objective))
            });
            let Some((there, objective)) = lower else {
                self.parameters = before;
                self.held_at(search, &search.at.clone());
                return;
            };
            let gained = best - objective;
            (search.at, best) = (there, objective);
            if gained < 1e-4 * best {
                return;
            }
        }
    }

    /// The table solved with the dimensions held at a place.
    fn held_at(&mut self, search: &Search, at: &[f64]) -> Held {
        self.apply(&search.nominal, &search.unknowns, at, &search.mounting);
        self.design.extra.fill(0.0);
        for (row, force) in self.design.rows.iter_mut().zip(&search.forces) {
            row.force = *force;
        }
        let size = self.parameters.len() - at.len();
        self.parameters[size..].fill(0.0);
        let data = self.design.normal(&self.parameters, &self.weights);
        let penalty = self.design.penalty(&data, Smoothing::START.elastic, Smoothing::START.friction);
        let misfit = self.design.solve(&mut self.parameters, &self.weights, &penalty, 6).misfit;
        Held { misfit, objective: misfit + penalty.quadratic(&self.parameters) + search.prior(at) }
    }

    /// Puts the dimensions where they stand, and the columns of their steps beside the others.
    fn linearise(&mut self, search: &Search) {
        let Search { nominal, unknowns, mounting, at, forces, .. } = search;
        self.apply(nominal, unknowns, at, mounting);
        self.sensitivities(nominal, unknowns, at, mounting);
        for (i, row) in self.design.rows.iter_mut().enumerate() {
            let z = &self.design.extra[i * at.len()..(i + 1) * at.len()];
            // Linear about `at`: F(p) ≈ F(at) + z (p − at).
            row.force = forces[i] + dot(z, at);
        }
        let size = self.parameters.len() - at.len();
        self.parameters[size..].copy_from_slice(at);
    }

    fn shifts(&self, unknowns: &[Unknown], at: &[f64], mounting: &[Option<usize>]) -> Vec<f64> {
        let offset = |m: usize| {
            unknowns.iter().zip(at).find(|(u, _)| **u == Unknown::Offset(m)).map_or(0.0, |(_, v)| *v)
        };
        mounting.iter().map(|m| m.map_or(0.0, offset)).collect()
    }

    /// Puts the dimensions at `at` into geometry, braid and rows. `T` stays as it is, so that the `ẽ_k` keep their meaning.
    fn apply(&mut self, nominal: &Geometry, unknowns: &[Unknown], at: &[f64], mounting: &[Option<usize>]) {
        self.geometry = moved(nominal, unknowns, at);
        if let Ok(braid) = self.geometry.build() {
            self.braid = braid;
        }
        let shift = self.shifts(unknowns, at, mounting);
        let columns = self.columns(&shift);
        for (row, c) in self.design.rows.iter_mut().zip(&columns) {
            row.area = c.area;
            row.elastic = self.design.orthonormal.apply(c);
        }
    }

    /// `∂F/∂p` of every point, by central differences of the columns at the present parameters.
    fn sensitivities(
        &mut self,
        nominal: &Geometry,
        unknowns: &[Unknown],
        at: &[f64],
        mounting: &[Option<usize>],
    ) {
        let curves = self.design.curves(&self.parameters);
        let grips: Vec<f64> = (0..self.design.rows.len())
            .map(|i| self.design.evaluate(i, &self.parameters, &curves).grip)
            .collect();
        let count = unknowns.len();
        let mut extra = vec![0.0; self.design.rows.len() * count];
        for (m, u) in unknowns.iter().enumerate() {
            let h = u.step();
            let side = |by: f64| {
                let mut to = at.to_vec();
                to[m] += by;
                let braid = moved(nominal, unknowns, &to).build().unwrap_or(self.braid);
                let shift = self.shifts(unknowns, &to, mounting);
                (braid, shift)
            };
            let ((after, shift_after), (before, shift_before)) = (side(h), side(-h));
            for (i, p) in self.points.list.iter().enumerate() {
                if let Unknown::Offset(k) = u
                    && mounting[i] != Some(*k)
                {
                    continue;
                }
                let a = columns(&after, p.stroke + shift_after[i]);
                let b = columns(&before, p.stroke + shift_before[i]);
                let (ta, tb) = (self.design.orthonormal.apply(&a), self.design.orthonormal.apply(&b));
                let moduli = self.design.reduced_at(self.design.rows[i].bin, &curves);
                let mut force = (p.pressure - self.deadband()) * (a.area - b.area);
                for ((e, x), y) in moduli.iter().zip(&ta).zip(&tb) {
                    force += e * (x - y);
                }
                extra[i * count + m] = grips[i] * force / (2.0 * h);
            }
        }
        self.design.extra = extra;
    }
}
