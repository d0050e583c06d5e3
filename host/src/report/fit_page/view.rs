//! What the figures of a fit share: points with their residuals, and how tested pressures are called and coloured.

use model_core::units::{Length, Pressure};

use super::super::{Colour, figures, fixed};
use crate::fit::basis::columns;
use crate::fit::points::Point;
use crate::fit::result::Fit;
use crate::fit::screen::Use;
use crate::fit::uncertainty;
use crate::recording::Campaign;

/// A fit, ready to be drawn.
pub(super) struct View<'a> {
    pub fit: &'a Fit,
    pub campaign: &'a Campaign,
    /// Tested pressures, or middles of intervals, Pa.
    pub levels: &'a [f64],
    /// m.
    pub l0: f64,
    /// `F − F_model` of every point by the table itself, N.
    pub residual: Vec<f64>,
    muscle: Option<model_core::muscle::Muscle<f64>>,
}

impl<'a> View<'a> {
    pub fn new(fit: &'a Fit, campaign: &'a Campaign) -> Self {
        let muscle = model_core::muscle::Muscle::<f64>::build(&fit.table).ok();
        let l0 = fit.prepared.braid.rest_length();
        let levels = fit.prepared.pressures.levels.as_slice();
        let mut view = Self { fit, campaign, levels, l0, residual: Vec::new(), muscle };
        view.residual = view
            .points()
            .iter()
            .map(|p| p.force - view.force(p.pressure, p.stroke, view.direction(p)))
            .collect();
        view
    }

    pub fn points(&self) -> &'a [Point] {
        &self.fit.prepared.points.list
    }

    fn direction(&self, p: &Point) -> f64 {
        if self.fit.prepared.design.friction { p.direction } else { 0.0 }
    }

    /// The table's force, N.
    pub fn force(&self, pressure: f64, stroke: f64, direction: f64) -> f64 {
        self.muscle.as_ref().map_or(f64::NAN, |m| {
            m.force(Pressure::from_pascals(pressure), Length::from_metres(stroke), direction).newtons()
        })
    }

    /// The tested pressure that a point belongs to.
    pub fn group(&self, i: usize) -> usize {
        let design = &self.fit.prepared.design;
        design.bins[design.rows[i].bin as usize].group as usize
    }

    pub fn fitted(&self, i: usize) -> bool {
        self.fit.prepared.used[i] == Use::Fitted
    }

    /// Contraction in percent.
    pub fn contraction(&self, stroke: f64) -> f64 {
        100.0 * stroke / self.l0
    }

    pub fn name(&self, group: usize) -> String {
        let Some(p) = self.levels.get(group) else { return String::new() };
        if self.fit.prepared.pressures.held {
            format!("{} kPa", fixed(p / 1e3, 0))
        } else {
            format!("about {} kPa", fixed(p / 1e3, 0))
        }
    }

    pub fn colour(&self, group: usize) -> Colour {
        Colour::ordered(group, self.levels.len())
    }

    /// At most `most` tested pressures, the lowest and the highest among them.
    pub fn some(&self, most: usize) -> Vec<usize> {
        let n = self.levels.len();
        if n <= most {
            return (0..n).collect();
        }
        let last = (most - 1).max(1);
        (0..most).map(|i| i * (n - 1) / last).collect()
    }

    /// Strokes over the range tested at one pressure, m.
    pub fn strokes(&self, group: usize, count: usize) -> Vec<f64> {
        let of =
            (0..self.points().len()).filter(|i| self.group(*i) == group).map(|i| self.points()[i].stroke);
        let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        if !(low < high) {
            return if low.is_finite() { vec![low] } else { Vec::new() };
        }
        (0..count).map(|i| low + (high - low) * i as f64 / (count - 1).max(1) as f64).collect()
    }

    /// Standard deviation of the friction-free force, N.
    pub fn force_std(&self, pressure: f64, strokes: &[f64]) -> Vec<f64> {
        let prepared = &self.fit.prepared;
        let root = uncertainty::of_table(prepared, &self.fit.uncertain.root, &[pressure]);
        let order = prepared.design.layout().order;
        strokes
            .iter()
            .map(|x| {
                let c = columns(&prepared.braid, *x);
                let mut g = vec![-c.area];
                g.extend(&c.elastic[..order]);
                g.push(0.0);
                root.variance(&g).sqrt()
            })
            .collect()
    }

    /// Where the largest error is, in words.
    pub fn worst_place(&self) -> String {
        let worst = self.fit.chunks.iter().max_by(|a, b| a.percent.abs().total_cmp(&b.percent.abs()));
        worst.map_or(String::new(), |c| {
            format!("at {}, contraction {} %", self.name(c.group as usize), figures(100.0 * c.contraction, 2))
        })
    }
}
