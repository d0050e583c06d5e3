//! Effective dimensions, and the true length of each mounting: what a tape measure and a data sheet leave open.
//!
//! Each such unknown enters as one more column of the joint problem, `∂F/∂p` at the present solution, with a prior as wide as
//! the measurement it stands for; the columns are computed anew until nothing moves (Gauss–Newton). Values stay within stated
//! bounds, and each is reported with how much of the prior's uncertainty the recordings removed.
//!
//! | unknown | prior (one standard deviation) | bounds |
//! | --- | --- | --- |
//! | braid angle | 2° | ± 8° |
//! | bladder diameter | 5 % | ± 25 % |
//! | bladder wall | 15 % | ± 50 % |
//! | length of a mounting (a stroke held through whole recordings) | 0.5 mm | ± 1 mm |
//!
//! The diameter scales the force and the angle bends it over contraction, so blocked forces at several lengths determine
//! both. The wall only scales the elastic part, which the `E_k` scale too: it stays where its prior has it, and says so.

use model_core::units::{Angle, Length};
use serde::Serialize;

use super::Options;
use super::basis::columns;
use super::prepare::Prepared;
use super::smoothing::Smoothing;
use super::uncertainty;

/// A dimension or a length that was found together with the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Adjusted {
    /// What it is.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// As described.
    pub nominal: f64,
    /// As found.
    pub value: f64,
    /// Standard deviation of what was found.
    pub std: f64,
    /// It was kept at or above this …
    pub low: f64,
    /// … and at or below this.
    pub high: f64,
    /// Share of the prior's variance that the recordings removed: near 1 they determine it, near 0 they say nothing.
    pub determined: f64,
    /// Whether it stopped at a bound.
    pub at_bound: bool,
}

/// A stroke that whole recordings were held at, and by how much it was off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    /// The stroke as recorded, m.
    pub stroke: f64,
    /// What is to be added to it, m.
    pub offset: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Unknown {
    Angle,
    Diameter,
    Wall,
    Offset(usize),
}

impl Unknown {
    /// Prior standard deviation and bound, in the unknown's own scale (rad, logarithm, m).
    fn prior(self) -> (f64, f64) {
        match self {
            Self::Angle => (2.0_f64.to_radians(), 8.0_f64.to_radians()),
            Self::Diameter => (0.05, 0.25),
            Self::Wall => (0.15, 0.5),
            Self::Offset(_) => (0.5e-3, 1.0e-3),
        }
    }

    /// Step of numerical differences.
    fn step(self) -> f64 {
        match self {
            Self::Offset(_) => 1e-6,
            _ => 1e-5,
        }
    }
}

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
                row.force = forces[i] + super::linear::dot(z, &at);
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
    fn apply(
        &mut self,
        nominal: &model_core::braid::Geometry,
        unknowns: &[Unknown],
        at: &[f64],
        mounting: &[Option<usize>],
    ) {
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
        nominal: &model_core::braid::Geometry,
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

fn moved(
    nominal: &model_core::braid::Geometry,
    unknowns: &[Unknown],
    at: &[f64],
) -> model_core::braid::Geometry {
    let mut g = *nominal;
    for (u, v) in unknowns.iter().zip(at) {
        match u {
            Unknown::Angle => {
                let angle = (g.braid_angle.radians() + v).clamp(0.62, 1.55);
                g.braid_angle = Angle::from_radians(angle);
            }
            Unknown::Diameter => g.outer_diameter = g.outer_diameter * v.exp(),
            Unknown::Wall => g.wall = g.wall * v.exp(),
            Unknown::Offset(_) => {}
        }
    }
    // A wall that fills the bore cannot be built.
    let most = g.outer_diameter * 0.49;
    g.wall = g.wall.min(Length::from_metres(most.metres()));
    g
}

fn describe(
    nominal: &model_core::braid::Geometry,
    unknown: Unknown,
    value: f64,
    std: f64,
    strokes: &[f64],
) -> Adjusted {
    let (sigma, bound) = unknown.prior();
    let scaled = |name: &str, unit, nominal: f64| Adjusted {
        name: name.into(),
        unit,
        nominal,
        value: nominal * value.exp(),
        std: nominal * value.exp() * std,
        low: nominal * (-bound).exp(),
        high: nominal * bound.exp(),
        determined: 0.0,
        at_bound: false,
    };
    let shifted = |name: String, unit, nominal: f64, per: f64| Adjusted {
        name,
        unit,
        nominal,
        value: nominal + value * per,
        std: std * per,
        low: nominal - bound * per,
        high: nominal + bound * per,
        determined: 0.0,
        at_bound: false,
    };
    let mut a = match unknown {
        Unknown::Angle => {
            shifted("braid_angle".into(), "deg", nominal.braid_angle.degrees(), 1.0_f64.to_degrees())
        }
        Unknown::Diameter => scaled("bladder_outer_diameter", "mm", nominal.outer_diameter.millimetres()),
        Unknown::Wall => scaled("bladder_wall", "mm", nominal.wall.millimetres()),
        Unknown::Offset(m) => {
            let name = format!("stroke_of_mounting_{}", m + 1);
            shifted(name, "mm", strokes[m] * 1e3, 1e3)
        }
    };
    a.determined = (1.0 - (std / sigma).powi(2)).clamp(0.0, 1.0);
    a.at_bound = value.abs() > 0.999 * bound;
    a
}
