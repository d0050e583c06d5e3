//! A stroke that does not move while it is controlled: a frozen sensor has the muscle filled up to its highest pressure.
//!
//! With a load cell the table shows it: at a stroke at which the muscle is not, it says more force than the cell (the watch of both sensors). Without
//! one, the force of the table may rise by half of the blocked force and the known load while the stroke stays where it is. More is a sensor
//! that does not move, or a muscle that something blocks: neither is controlled by its stroke.

use model_core::link::messages::{Fault, Mode, Sensor};
use model_core::link::settings::Settings;
use model_core::scalar::Scalar;

use super::actuator::Actuator;
use crate::modes::Model;
use crate::watch::{Finding, InARow};

/// Where a stroke has stood still, and the least force of the table since.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Standing {
    stroke_m: f32,
    least_n: f32,
    row: InARow,
}

impl Actuator {
    /// Half of the blocked force, N; without a table zero.
    #[inline(always)]
    pub(super) fn half_blocked_n(&self) -> f32 {
        self.model.as_ref().map_or(0.0, Model::half_blocked_n)
    }

    /// A stroke that does not move while it is controlled. In a joint, both muscles may rise together.
    pub(super) fn stands(&mut self, mode: Mode, settings: &Settings) -> Option<Finding> {
        if settings.force.fitted || mode != Mode::Stroke {
            return None;
        }
        let (model_n, stroke_m) = (self.model_n?, self.sample.stroke_m);
        let most_n = self.half_blocked_n() + settings.stroke_loop.load_n.at_least(0.0);
        let Standing { stroke_m: at_m, least_n, row } = &mut self.standing;
        if !((stroke_m - *at_m).abs() <= settings.motion_band_m) {
            self.standing = Standing { stroke_m, least_n: model_n.at_least(0.0), row: InARow::default() };
            return None;
        }
        *least_n = least_n.at_most(model_n).at_least(0.0);
        let rises = model_n - *least_n > most_n;
        row.count(rises, settings.watch.follow_ticks).then_some(Finding {
            fault: Fault::SensorStuck,
            sensor: Some(Sensor::Stroke),
            value: f32::from(settings.watch.follow_ticks),
            limit: f32::from(settings.watch.follow_ticks),
        })
    }
}
