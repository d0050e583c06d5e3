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
    /// is off by up to 1 kPa, with M = 6 by a fifth of that.
    pub(super) fn settle_deadband(&mut self, options: &Options) {
        let order = MAX_ORDER;
        if options.order >= order
            || options.fit_geometry
            || options.fit_lengths
            || self.pressures.levels.len() < 2
        {
            return;
        }
        let mut finer = self.clone();
        finer.design = finer.build_design(order);
        let reaches_rest = self.points.stroke.low <= 0.02 * self.points.stroke.high;
        if finer.design.orthonormal.rank < order || !reaches_rest {
            return;
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
        self.deadband_std = Some(jackknife(&finer, &penalty).root.std(Layout::DEADBAND));
        let found = finer.deadband();
        self.parameters[Layout::DEADBAND] = 0.0;
        self.design.origin = found;
        // Stiffer than all the points together.
        let own =
            self.design.normal(&self.parameters, &self.weights).matrix.at(Layout::DEADBAND, Layout::DEADBAND);
        self.design.hold_deadband = 1e4 * own;
    }
}
