//! The problem that a fit solves: points, nodes, dimensions and the linear problem that they make. Solving does not change it.

use std::sync::Arc;

use model_core::braid::{Braid, Geometry};

use super::basis::{Columns, Orthonormal, columns};
use super::design::{Bin, Design, Layout, Row};
use super::dimensions::{Adjusted, Mounting};
use super::nodes::Pressures;
use super::normal_equations::NormalEquations;
use super::points::{Point, Points};
use super::screen::{Clip, PointUse, Screen};
use super::smoothing::Smoothing;
use crate::numerics::spline_basis::SplineBasis;
use crate::numerics::symmetric::Symmetric;
use pam_data::recording::HELD;
use pam_data::statistics::median;

/// A campaign as a linear problem.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Means over short pieces of motion, in time order. Shared by all problems of one campaign, as there may be a million of them.
    pub points: Arc<Points>,
    /// The tested pressures and the nodes of the curves over pressure, Pa.
    pub pressures: Pressures,
    /// The muscle at rest as the muscle description has it.
    pub nominal: Geometry,
    /// The muscle at rest as fitted: the nominal one unless the dimensions are fitted too.
    pub geometry: Geometry,
    /// The kinematics of `geometry`.
    pub braid: Braid<f64>,
    /// The correction of each point's stroke, m: zero unless the lengths of mountings are fitted.
    pub shift: Vec<f64>,
    /// Fitted dimensions and mounting lengths.
    pub adjusted: Vec<Adjusted>,
    /// Mountings with their correction.
    pub mountings: Vec<Mounting>,
    /// The lower and the upper end of the force sensor's range, where rows are at them.
    pub clips: (Option<Clip>, Option<Clip>),
    /// The linear problem; one row per point, in the same order.
    pub design: Design,
}

/// Bins of pressure; the curves are evaluated once per bin.
const BINS: usize = 1024;

/// What a problem is made of before its linear form exists.
pub(super) struct Ingredients {
    pub points: Points,
    pub pressures: Pressures,
    pub geometry: Geometry,
    pub braid: Braid<f64>,
    pub clips: (Option<Clip>, Option<Clip>),
}

impl Problem {
    /// Builds the linear problem of an elastic polynomial of this order.
    pub(super) fn new(from: Ingredients, screen: &Screen, order: usize) -> Self {
        let Ingredients { points, pressures, geometry, braid, clips } = from;
        let shift = vec![0.0; points.list.len()];
        let design = design(&points, &pressures, &braid, &shift, screen, order);
        Self {
            points: Arc::new(points),
            pressures,
            nominal: geometry,
            geometry,
            braid,
            shift,
            adjusted: Vec::new(),
            mountings: Vec::new(),
            clips,
            design,
        }
    }

    /// The same points with an elastic polynomial of another order.
    pub(super) fn of_order(&self, screen: &Screen, order: usize) -> Self {
        let design = design(&self.points, &self.pressures, &self.braid, &self.shift, screen, order);
        // Field by field: the clone of a whole problem would copy a design to throw it away.
        Self {
            points: Arc::clone(&self.points),
            pressures: self.pressures.clone(),
            nominal: self.nominal,
            geometry: self.geometry,
            braid: self.braid,
            shift: self.shift.clone(),
            adjusted: self.adjusted.clone(),
            mountings: self.mountings.clone(),
            clips: self.clips,
            design,
        }
    }

    /// The tested level, or the interval of a continuous range, that a point belongs to.
    pub(super) fn group_of(&self, point: usize) -> usize {
        self.design.bins[self.design.rows[point].bin as usize].group as usize
    }

    /// Where pressure moves, mid-lines are cut into hundredths of its range; levels are not.
    pub(super) fn fine_pressure(&self, pressure: f64) -> u32 {
        let range = self.points.pressure;
        if self.pressures.held { 0 } else { ((pressure - range.low) / range.span().max(1.0) * 100.0) as u32 }
    }

    /// The median ratio of the force to what the braid as described would make of the pressure (`P g`), over points above half
    /// of the largest force. `None` where there are none.
    pub(super) fn share_of_braid(&self) -> Option<f64> {
        let described = self.nominal.build().ok()?;
        let shares =
            self.points.list.iter().filter(|p| p.force > 0.5 * self.points.force.high).filter_map(|p| {
                let of_braid = p.pressure * columns(&described, p.stroke).area;
                (of_braid > 0.0).then(|| p.force / of_braid)
            });
        let mut shares: Vec<f64> = shares.collect();
        (!shares.is_empty()).then(|| median(&mut shares))
    }

    /// `P0` of a solution, Pa.
    pub(super) fn deadband(&self, parameters: &[f64]) -> f64 {
        self.design.origin + parameters[Layout::DEADBAND]
    }

    /// The penalty on bending, where these are the normal equations.
    pub(super) fn penalty(&self, data: &NormalEquations, smoothing: Smoothing) -> Symmetric {
        self.design.penalty(data, smoothing.elastic, smoothing.friction)
    }

    /// The solution from a start nearby, after at most `steps` steps of Gauss and Newton.
    pub(super) fn solve(
        &self,
        start: &[f64],
        weights: &[f64],
        smoothing: Smoothing,
        steps: usize,
    ) -> Vec<f64> {
        self.solve_from(self.design.normal(start, weights), start, weights, smoothing, steps)
    }

    /// As [`Problem::solve`], where the normal equations at the start are known.
    pub(super) fn solve_from(
        &self,
        data: NormalEquations,
        start: &[f64],
        weights: &[f64],
        smoothing: Smoothing,
        steps: usize,
    ) -> Vec<f64> {
        let penalty = self.penalty(&data, smoothing);
        let mut parameters = start.to_vec();
        self.design.solve_from(data, &mut parameters, weights, &penalty, steps);
        parameters
    }
}

fn design(
    points: &Points,
    pressures: &Pressures,
    braid: &Braid<f64>,
    shift: &[f64],
    screen: &Screen,
    order: usize,
) -> Design {
    let basis = SplineBasis::new(&pressures.nodes);
    let orthonormal = Orthonormal::over(&spread(points, shift, braid, &screen.used), order);
    let range = points.pressure;
    let per_bin = if range.span() > 0.0 { BINS as f64 / range.span() } else { 0.0 };
    let mut sums = vec![(0.0, 0.0); BINS + 1];
    let raw = |p: f64| (((p - range.low) * per_bin) as usize).min(BINS);
    for p in &points.list {
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
            bins.push(Bin { phi: basis.at(mean), group: pressures.nearest(mean) });
        }
    }
    let directed = both_directions(points, screen);
    let rows = points
        .list
        .iter()
        .zip(shift)
        .map(|(p, shift)| {
            let direction = if directed { p.direction } else { 0.0 };
            let columns = columns(braid, p.stroke + shift);
            Row::new(p.pressure, p.force, direction, &columns, &orthonormal, index[raw(p.pressure)])
        })
        .collect();
    Design::new(basis, orthonormal, rows, bins, pressures.levels.len(), directed)
}

/// Whether enough points move in each direction to separate friction from elasticity.
fn both_directions(points: &Points, screen: &Screen) -> bool {
    let rows = |s: f64| {
        let take = |(p, u): &(&Point, &PointUse)| {
            p.direction == s && matches!(u, PointUse::Fitted | PointUse::NearReversal)
        };
        points.list.iter().zip(&screen.used).filter(take).map(|(p, _)| f64::from(p.rows)).sum::<f64>()
    };
    let (up, down) = (rows(1.0), rows(-1.0));
    up.min(down) > 0.02 * (up + down) && up.min(down) >= 3.0
}

/// Columns at strokes spread evenly over the tested range, so that the time spent at a stroke does not matter. Strokes that differ by
/// noise only count once, and so does a mounting whose length was read again in each run.
fn spread(points: &Points, shift: &[f64], braid: &Braid<f64>, used: &[PointUse]) -> Vec<Columns> {
    const PLACES: usize = 400;
    /// Two readings of one length differ by less than this many standard deviations.
    const APART: f64 = 12.0;
    let range = points.stroke;
    let per_place = if range.span() > 0.0 { PLACES as f64 / range.span() } else { 0.0 };
    let mut taken = vec![None; PLACES + 1];
    for ((p, shift), u) in points.list.iter().zip(shift).zip(used) {
        if matches!(u, PointUse::Fitted | PointUse::NearReversal) {
            taken[((p.stroke - range.low) * per_place) as usize] = Some((p.stroke, *shift));
        }
    }
    let mut last = f64::NEG_INFINITY;
    let held = !points.held_lengths().is_empty();
    let noise = APART * points.stroke_noise;
    let same = if held { HELD } else { 0.0 }.max(noise);
    let apart = |(stroke, shift): (f64, f64)| {
        (stroke - last > same).then(|| {
            last = stroke;
            // A mounting at rest length does not show the elasticity, however its readings scatter about zero.
            let at_rest = held && (stroke + shift).abs() < noise;
            columns(braid, if at_rest { 0.0 } else { stroke + shift })
        })
    };
    taken.into_iter().flatten().filter_map(apart).collect()
}
