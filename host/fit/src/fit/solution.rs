//! The solved problem: parameters, the points that took part, and the curves that the parameters make.

use super::basis::columns;
use super::chunks::Place;
use super::problem::Problem;
use super::screen::{PointUse, Screen};
use super::smoothing::Smoothing;
use crate::numerics::symmetric::dot;

/// A solved problem. Results, reports and diagnoses read it; nothing changes it.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The solved problem.
    pub problem: Problem,
    /// Which points took part, and why others did not.
    pub screen: Screen,
    /// Weight of each point, about 1/variance in N⁻²; zero where it did not take part.
    pub weights: Vec<f64>,
    /// The parameters in the order of the design's [`Layout`](super::design::Layout).
    pub parameters: Vec<f64>,
    /// The weights of the penalty on bending.
    pub smoothing: Smoothing,
    /// Standard deviation of a `P0` that is held because a higher order determined it, Pa.
    pub deadband_std: Option<f64>,
    /// What the user must know about the recordings and the search.
    pub warnings: Vec<String>,
}

impl Solution {
    /// Whether a point counts in errors: it took part, and the muscle was not slack.
    pub(super) fn counts(&self, i: usize) -> bool {
        self.screen.used[i] == PointUse::Fitted && !self.screen.held_down.get(i).copied().unwrap_or(false)
    }

    /// The number of every point that counts in errors, and its place in the loop.
    pub(super) fn counted_points(&self) -> impl Iterator<Item = (usize, Place)> {
        let l0 = self.problem.braid.rest_length();
        let points = &self.problem.points.list;
        (0..points.len()).filter(|i| self.counts(*i)).map(move |i| {
            let p = &points[i];
            let place = Place {
                group: self.problem.group_of(i) as u32,
                fine: self.problem.fine_pressure(p.pressure),
                contraction: (p.stroke + self.problem.shift[i]) / l0,
                direction: p.direction,
                rows: f64::from(p.rows),
            };
            (i, place)
        })
    }

    /// `P0`, Pa.
    #[must_use]
    pub fn deadband(&self) -> f64 {
        self.problem.deadband(&self.parameters)
    }

    /// The blocked force `F_B` at a pressure in Pa: the friction-free force at rest length, N.
    #[must_use]
    pub fn blocked(&self, pressure: f64) -> f64 {
        // Every elastic column vanishes at rest length (without the tip correction exactly, with it to first order).
        (pressure - self.deadband()) * columns(&self.problem.braid, 0.0).area
    }

    /// What errors at a pressure are a share of, N: the blocked force, but at least a twentieth of that at the highest pressure.
    /// Below the deadband there is no blocked force to compare with.
    pub(super) fn blocked_for_errors(&self, pressure: f64) -> f64 {
        self.blocked(pressure).max(0.05 * self.blocked(self.problem.points.pressure.high).abs())
    }

    /// `E_1 … E_M` in Pa and `k_F` at a pressure in Pa.
    #[must_use]
    pub fn curves_at(&self, pressure: f64) -> (Vec<f64>, f64) {
        let design = &self.problem.design;
        let layout = design.layout();
        let phi = design.basis.at(pressure);
        let curve = |from: usize| dot(&phi, &self.parameters[from..from + layout.nodes]);
        let reduced: Vec<f64> = (0..layout.order).map(|k| curve(layout.elastic(k, 0))).collect();
        (design.orthonormal.to_moduli(&reduced), curve(layout.friction(0)))
    }

    /// The friction-free force at a pressure in Pa and a stroke in m, N.
    #[must_use]
    pub fn quasi(&self, pressure: f64, stroke: f64) -> f64 {
        let c = columns(&self.problem.braid, stroke);
        let (moduli, _) = self.curves_at(pressure);
        (pressure - self.deadband()) * c.area + moduli.iter().zip(c.elastic).map(|(e, c)| e * c).sum::<f64>()
    }
}
