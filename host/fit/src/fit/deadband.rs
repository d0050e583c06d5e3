//! `P0` by itself: where a low order of the elastic polynomial would bend it.

use model_core::table::MAX_ORDER;

use super::Options;
use super::design::Layout;
use super::prepared::Prepared;
use super::smoothing::{self, Smoothing};
use super::uncertainty::jackknife;

impl Prepared {
    /// Finds `P0` by the highest order that the strokes determine, then holds it.
    ///
    /// At rest length no elastic term acts, so `P0` is the blocked force's intercept. Away from it `P0` and the `E_k` trade, and
    /// what a low order cannot describe about the bladder would be put into `P0`: with M = 4 on a hyperelastic wall it
    /// is off by up to 1 kPa, with M = 6 by a fifth of that. Where no row is near rest length the curve is continued there, and a low
    /// order misses `P0` by many times its scatter (by 8 kPa from 0.8 % of contraction on, with M = 4): then what the last order changed
    /// tells how far the next ones might go, and half of it joins the standard deviation.
    pub(super) fn settle_deadband(&mut self, options: &Options) {
        if options.fit_geometry || options.fit_lengths || self.pressures.levels.len() < 2 {
            return;
        }
        let orders = (options.order + 1..=MAX_ORDER).rev();
        let Some((order, (found, scatter))) =
            orders.into_iter().find_map(|m| Some((m, self.deadband_by(m, options)?)))
        else {
            return;
        };
        let continued = if self.reaches_rest() {
            0.0
        } else {
            self.deadband_by(order - 1, options).map_or(0.0, |(before, _)| 0.5 * (found - before))
        };
        self.deadband_std = Some(scatter.hypot(continued));
        self.parameters[Layout::DEADBAND] = 0.0;
        self.design.origin = found;
        // Stiffer than all the points together.
        let own =
            self.design.normal(&self.parameters, &self.weights).matrix.at(Layout::DEADBAND, Layout::DEADBAND);
        self.design.hold_deadband = 1e4 * own;
    }

    /// Whether rows lie near enough to rest length to measure the blocked force.
    fn reaches_rest(&self) -> bool {
        self.points.stroke.low <= 0.02 * self.points.stroke.high
    }

    /// `P0` and its standard deviation by a fit of this order, Pa; nothing where the strokes do not determine so many coefficients.
    fn deadband_by(&self, order: usize, options: &Options) -> Option<(f64, f64)> {
        let mut finer = self.clone();
        finer.design = finer.build_design(order);
        if finer.design.orthonormal.rank < order {
            return None;
        }
        finer.parameters = finer.design.start(self.deadband());
        finer.solve(Smoothing::START, 8);
        let smoothing = match options.smoothing {
            Some(weight) => Smoothing { elastic: weight, friction: weight },
            None => smoothing::choose(&finer.design, &finer.parameters, &finer.weights).0,
        };
        finer.smoothing = smoothing;
        finer.solve_softened();
        let data = finer.design.normal(&finer.parameters, &finer.weights);
        let penalty = finer.design.penalty(&data, smoothing.elastic, smoothing.friction);
        Some((finer.deadband(), jackknife(&finer, &penalty).root.std(Layout::DEADBAND)))
    }
}
