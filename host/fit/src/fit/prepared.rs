//! A campaign as one linear problem and its solution: what the steps of the fit work on, one file each.

use model_core::braid::{Braid, Geometry};

use super::basis::{Columns, Orthonormal, PressureBasis, columns};
use super::chunks::Place;
use super::design::{Bin, Design, Layout, Row};
use super::dimensions::{Adjusted, Mounting};
use super::linear::dot;
use super::nodes::Pressures;
use super::points::{Point, Points, median};
use super::screen::{Clip, Outlier, Use};
use super::smoothing::Smoothing;

/// A campaign, solved: everything that results and diagnoses are drawn from.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// The points.
    pub points: Points,
    /// Tested pressures and nodes.
    pub pressures: Pressures,
    /// The muscle at rest, as described.
    pub nominal: Geometry,
    /// The muscle at rest, as fitted: the same, unless dimensions were left open.
    pub geometry: Geometry,
    /// Its kinematics.
    pub braid: Braid<f64>,
    /// The linear problem; one row per point, in the same order.
    pub design: Design,
    /// What became of each point.
    pub used: Vec<Use>,
    /// Weight of each point; zero where it does not take part. About 1/variance, N⁻².
    pub weights: Vec<f64>,
    /// Chunks of stroke, pressure and direction that have points: as many independent witnesses as the weights assume.
    pub cells: f64,
    /// The solution, in the order of [`Layout`].
    pub parameters: Vec<f64>,
    /// The penalty on bending.
    pub smoothing: Smoothing,
    /// How far from a turn points were set aside, in shares of the ranges.
    pub turn_zone: f64,
    /// Whether the recordings show the muscle slack.
    pub goes_slack: bool,
    /// The ends of the force sensor's range, where rows stand at them.
    pub clips: (Option<Clip>, Option<Clip>),
    /// Readings that do not belong.
    pub outliers: Vec<Outlier>,
    /// Standard deviation of a `P0` that is held because a higher order found it, Pa.
    pub deadband_std: Option<f64>,
    /// Dimensions and lengths that were found too.
    pub adjusted: Vec<Adjusted>,
    /// Points of a slack muscle that take part because the model would pull there.
    pub held_down: Vec<bool>,
    /// Corrected mountings.
    pub mountings: Vec<Mounting>,
    /// What was added to each point's stroke, m.
    pub shift: Vec<f64>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Places of pressure at which curves are evaluated.
const BINS: usize = 1024;

impl Prepared {
    /// The braid's columns at every point, strokes moved by `shift` (m).
    #[must_use]
    pub fn columns(&self, shift: &[f64]) -> Vec<Columns> {
        self.points.list.iter().zip(shift).map(|(p, s)| columns(&self.braid, p.stroke + s)).collect()
    }

    /// Builds the linear problem on the present nodes.
    pub(super) fn build_design(&self, order: usize) -> Design {
        let basis = PressureBasis::new(&self.pressures.nodes);
        let columns = self.columns(&self.shift);
        let orthonormal = Orthonormal::over(&spread(&self.points, &columns, &self.used), order);
        let range = self.points.pressure;
        let per_bin = if range.span() > 0.0 { BINS as f64 / range.span() } else { 0.0 };
        let mut sums = vec![(0.0, 0.0); BINS + 1];
        let raw = |p: f64| (((p - range.low) * per_bin) as usize).min(BINS);
        for p in &self.points.list {
            let s = &mut sums[raw(p.pressure)];
            s.0 += f64::from(p.rows) * p.pressure;
            s.1 += f64::from(p.rows);
        }
        let mut index = vec![0_u32; sums.len()];
        let mut bins = Vec::new();
        for (to, (sum, n)) in index.iter_mut().zip(&sums) {
            if *n > 0.0 {
                *to = bins.len() as u32;
                let mean = sum / n;
                bins.push(Bin { phi: basis.at(mean), group: self.group(mean) });
            }
        }
        let directed = self.both_directions();
        let rows = self
            .points
            .list
            .iter()
            .zip(&columns)
            .map(|(p, c)| {
                let direction = if directed { p.direction } else { 0.0 };
                Row::new(p.pressure, p.force, direction, c, &orthonormal, index[raw(p.pressure)])
            })
            .collect();
        Design::new(basis, orthonormal, rows, bins, self.pressures.levels.len(), directed)
    }

    /// The tested level, or the interval, that a pressure belongs to.
    #[must_use]
    pub fn group(&self, pressure: f64) -> u32 {
        let levels = &self.pressures.levels;
        let nearest = (0..levels.len())
            .min_by(|a, b| (levels[*a] - pressure).abs().total_cmp(&(levels[*b] - pressure).abs()));
        nearest.unwrap_or(0) as u32
    }

    /// Where pressure moves, mid-lines are cut into hundredths of its range; levels are not.
    #[must_use]
    pub fn fine_pressure(&self, pressure: f64) -> u32 {
        let range = self.points.pressure;
        if self.pressures.held { 0 } else { ((pressure - range.low) / range.span().max(1.0) * 100.0) as u32 }
    }

    /// The force where it is more than half of the largest, as a share of what the braid alone makes of the pressure (`P g`); the median.
    #[must_use]
    pub fn share_of_braid(&self) -> Option<f64> {
        let shares =
            self.points.list.iter().filter(|p| p.force > 0.5 * self.points.force.high).filter_map(|p| {
                let of_braid = p.pressure * columns(&self.braid, p.stroke).area;
                (of_braid > 0.0).then(|| p.force / of_braid)
            });
        let mut shares: Vec<f64> = shares.collect();
        (!shares.is_empty()).then(|| median(&mut shares))
    }

    /// Whether a point counts in errors: it took part, and the muscle was not slack.
    #[must_use]
    pub fn counts(&self, i: usize) -> bool {
        self.used[i] == Use::Fitted && !self.held_down.get(i).copied().unwrap_or(false)
    }

    /// Every point that [counts](Self::counts), by its number, and where it lies in the loop.
    pub fn counted(&self) -> impl Iterator<Item = (usize, Place)> {
        let l0 = self.braid.rest_length();
        (0..self.points.list.len()).filter(|i| self.counts(*i)).map(move |i| {
            let p = &self.points.list[i];
            let place = Place {
                group: self.design.bins[self.design.rows[i].bin as usize].group,
                fine: self.fine_pressure(p.pressure),
                contraction: (p.stroke + self.shift[i]) / l0,
                direction: p.direction,
                rows: f64::from(p.rows),
            };
            (i, place)
        })
    }

    /// Whether enough points move either way for friction to be told from elasticity.
    fn both_directions(&self) -> bool {
        let rows = |s: f64| {
            let take = |(p, u): &(&Point, &Use)| p.direction == s && matches!(u, Use::Fitted | Use::NearTurn);
            self.points.list.iter().zip(&self.used).filter(take).map(|(p, _)| f64::from(p.rows)).sum::<f64>()
        };
        let (up, down) = (rows(1.0), rows(-1.0));
        up.min(down) > 0.02 * (up + down) && up.min(down) >= 3.0
    }

    /// Solves in place; returns `Σ w r²`.
    pub(super) fn solve(&mut self, smoothing: Smoothing, steps: usize) -> f64 {
        let data = self.design.normal(&self.parameters, &self.weights);
        let penalty = self.design.penalty(&data, smoothing.elastic, smoothing.friction);
        self.design.solve(&mut self.parameters, &self.weights, &penalty, steps).misfit
    }

    /// `P0`, Pa.
    #[must_use]
    pub fn deadband(&self) -> f64 {
        self.design.origin + self.parameters[Layout::DEADBAND]
    }

    /// `F_B` at a pressure: the friction-free force at rest length, N.
    #[must_use]
    pub fn blocked(&self, pressure: f64) -> f64 {
        // Every elastic column vanishes at rest length (without the tip correction exactly, with it to first order).
        (pressure - self.deadband()) * columns(&self.braid, 0.0).area
    }

    /// What errors at a pressure are a share of, N: `F_B`, but at least a twentieth of the largest, as below the deadband there is no
    /// blocked force to compare with.
    #[must_use]
    pub fn blocked_for_errors(&self, pressure: f64) -> f64 {
        self.blocked(pressure).max(0.05 * self.blocked(self.points.pressure.high).abs())
    }

    /// `E_1 … E_M` in pascals and `k_F` at a pressure.
    #[must_use]
    pub fn curves_at(&self, pressure: f64) -> (Vec<f64>, f64) {
        let layout = self.design.layout();
        let phi = self.design.basis.at(pressure);
        let curve = |from: usize| dot(&phi, &self.parameters[from..from + layout.nodes]);
        let reduced: Vec<f64> = (0..layout.order).map(|k| curve(layout.elastic(k, 0))).collect();
        (self.design.orthonormal.to_moduli(&reduced), curve(layout.friction(0)))
    }

    /// The friction-free force at a pressure and a stroke, N.
    #[must_use]
    pub fn quasi(&self, pressure: f64, stroke: f64) -> f64 {
        let c = columns(&self.braid, stroke);
        let (moduli, _) = self.curves_at(pressure);
        (pressure - self.deadband()) * c.area + moduli.iter().zip(c.elastic).map(|(e, c)| e * c).sum::<f64>()
    }
}

/// Columns at strokes spread evenly over the tested range: how long a recording dwelled somewhere does not matter. Strokes that
/// only noise sets apart are one stroke.
fn spread(points: &Points, columns: &[Columns], used: &[Use]) -> Vec<Columns> {
    const PLACES: usize = 400;
    /// Two readings of one length differ by less than so many standard deviations.
    const APART: f64 = 12.0;
    let range = points.stroke;
    let per_place = if range.span() > 0.0 { PLACES as f64 / range.span() } else { 0.0 };
    let mut taken = vec![None; PLACES + 1];
    for ((p, c), u) in points.list.iter().zip(columns).zip(used) {
        if matches!(u, Use::Fitted | Use::NearTurn) {
            taken[((p.stroke - range.low) * per_place) as usize] = Some((p.stroke, *c));
        }
    }
    let mut last = f64::NEG_INFINITY;
    let apart = |(stroke, columns): (f64, Columns)| {
        let far = stroke - last > APART * points.stroke_noise;
        far.then(|| {
            last = stroke;
            columns
        })
    };
    taken.into_iter().flatten().filter_map(apart).collect()
}
