//! A pair of fast on/off valves in place of a pressure regulator.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::fields::fields;

/// A fill valve and a vent valve, which open for a part of each period. The controller closes the loop of pressure over them, so that
/// the pressure follows a command with the lag `regulator.lag_s`.
///
/// Both rates are those of the muscle at its rest length. They are measured once: open one valve and take the steepest slope.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ValvePair {
    /// Period of the pulses, ticks; 0 where a regulator with an analogue input is fitted.
    pub period_ticks: u16,
    /// Pressure of the supply air, Pa.
    pub supply_pa: f32,
    /// Rate at which an empty muscle fills through the open fill valve, Pa/s.
    pub fill_pa_per_s: f32,
    /// Rate at which a muscle at the supply's pressure empties through the open vent valve, Pa/s.
    pub vent_pa_per_s: f32,
    /// By how much a valve opens later after its signal than it closes after the signal's end, s.
    pub dead_s: f32,
    /// Shortest time for which a valve can be open, s: no less than it takes to close, because a signal that ends before the valve has
    /// moved does nothing.
    pub least_s: f32,
    /// Time from the end of one valve's signal to the start of the other's, s: at least what a valve takes to close, so that they are never both open.
    pub apart_s: f32,
    /// Largest error of pressure at which both valves stay closed, Pa.
    pub band_pa: f32,
}

impl ValvePair {
    /// None fitted. The numbers are those of common valves that switch within a millisecond.
    pub const NONE: Self = Self {
        period_ticks: 0,
        supply_pa: 700e3,
        fill_pa_per_s: 4e6,
        vent_pa_per_s: 4e6,
        dead_s: 0.3e-3,
        least_s: 1e-3,
        apart_s: 2e-3,
        band_pa: 1e3,
    };

    /// Whether a pair is fitted.
    #[inline]
    pub const fn is_fitted(&self) -> bool {
        self.period_ticks > 0
    }
}

fields!(ValvePair {
    period_ticks,
    supply_pa,
    fill_pa_per_s,
    vent_pa_per_s,
    dead_s,
    least_s,
    apart_s,
    band_pa
});
