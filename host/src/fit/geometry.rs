//! Effective dimensions, and the true length of each mounting: what a tape measure and a data sheet leave open.
//!
//! Each such unknown enters as one more column of the joint problem, `∂F/∂p` at the present solution, with a prior as wide as
//! the measurement it stands for; the columns are computed anew until nothing moves (Gauss–Newton). Values stay within stated
//! bounds, and each is reported with how much of the prior's uncertainty the recordings removed.

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

impl Prepared {
    /// Finds what `options` leaves open, in place.
    pub(super) fn adjust(&mut self, options: &Options) {
        let nominal = self.nominal;
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
        let forces: Vec<f64> = self.design.rows.iter().map(|r| r.force).collect();
        let mut at = vec![0.0; unknowns.len()];
        let size = self.design.layout().len();
        self.design.extras = unknowns.len();
        self.design.extra = vec![0.0; self.design.rows.len() * unknowns.len()];
        self.design.extra_prior = unknowns.iter().map(|u| u.prior().0.powi(-2)).collect();
        // With the dimensions free, trends of E_k with pressure are theirs to explain first.
        self.design.level = 0.03;
        self.parameters.extend(&at);
        for round in 0..12 {
            self.apply(&nominal, &unknowns, &at, &mounting);
            self.sensitivities(&nominal, &unknowns, &at, &mounting);
            for (i, row) in self.design.rows.iter_mut().enumerate() {
                let z = &self.design.extra[i * at.len()..(i + 1) * at.len()];
                // Linear about `at`: F(p) ≈ F(at) + z (p − at).
                row.force = forces[i] + dot(z, &at);
            }
            self.parameters[size..].copy_from_slice(&at);
            let misfit = self.solve(Smoothing::START, 6);
            // Weights take the model for nearly right. Where it is not, they overstate what the points know by as much as the
            // misfit exceeds them, and the priors have to keep up.
            let excess = (misfit / self.cells).max(1.0);
            self.design.extra_prior = unknowns.iter().map(|u| excess * u.prior().0.powi(-2)).collect();
            self.design.hold_deadband = excess * self.design.origin.max(1.0).powi(-2);
            let mut moved = 0.0_f64;
            for (a, (u, new)) in at.iter_mut().zip(unknowns.iter().zip(&self.parameters[size..])) {
                let (sigma, bound) = u.prior();
                // A long step leaves the range in which the columns are good.
                let next = (*a + (new - *a).clamp(-sigma, sigma)).clamp(-bound, bound);
                moved = moved.max((next - *a).abs() / sigma);
                *a = next;
            }
            if moved < 1e-3 && round > 0 {
                break;
            }
        }
        let data = self.design.normal(&self.parameters, &self.weights);
        let penalty = self.design.penalty(&data, Smoothing::START.elastic, Smoothing::START.friction);
        let root = uncertainty::jackknife(self, &penalty).root;
        self.apply(&nominal, &unknowns, &at, &mounting);
        self.adjusted = unknowns
            .iter()
            .zip(&at)
            .enumerate()
            .map(|(m, (u, value))| describe(&nominal, *u, *value, root.std(size + m), &strokes))
            .collect();
        self.mountings = unknowns
            .iter()
            .zip(&at)
            .filter_map(|(u, v)| match u {
                Unknown::Offset(m) => Some(Mounting { stroke: strokes[*m], offset: *v }),
                _ => None,
            })
            .collect();
        self.shift = self.shifts(&unknowns, &at, &mounting);
        // From here on the dimensions are given.
        self.parameters.truncate(size);
        self.design.extras = 0;
        self.design.extra.clear();
        self.design.extra_prior.clear();
        for (row, force) in self.design.rows.iter_mut().zip(&forces) {
            row.force = *force;
        }
        self.solve(Smoothing::START, 8);
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
