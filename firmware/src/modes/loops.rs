//! Loops around the table: a trim of force on the load cell, and the force of the stroke loop.

use model_core::link::settings::{ForceLoop, StrokeLoop};
use model_core::scalar::Scalar;

use crate::tick::TICK_S;

/// An integrator that stops where continuing would only push further against a limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integral(f32);

impl Integral {
    /// Its value.
    pub fn value(self) -> f32 {
        self.0
    }

    /// Sets its value to zero.
    pub fn reset(&mut self) {
        self.0 = 0.0;
    }

    /// One tick of `rate`, unless `saturation` (last tick's command was limited) and the error points the way of the limit
    /// (`toward`: the sign of what was cut off).
    pub(crate) fn step(&mut self, rate: f32, limit: f32, saturation: f32) {
        if saturation * rate <= 0.0 {
            self.0 = (self.0 + rate * TICK_S).within(-limit, limit);
        }
    }
}

/// Trim of force on the load cell, Pa. `saturation` is the sign of what the last command's limits took away.
///
/// Without a table the error is that of the demanded force, and the loop `L(s) = g (K_p + K_i/s)` with `g = ∂F/∂P` crosses over
/// near `g K_i` rad/s; the regulator's lag requires much less than `1/lag`. With one it is that of the force which the
/// table gives at the measured pressure, less what the trim has added: an observer of what the table leaves out. The
/// regulator's lag is not in that loop, which has to wait only for its own filter of `g K_i` rad/s, and the trim does not
/// answer a wave with a wave of its own.
pub fn trim(force_loop: &ForceLoop, integral: &mut Integral, error_n: f32, saturation: f32) -> f32 {
    let limit = force_loop.trim_limit_pa;
    if limit <= 0.0 {
        return 0.0;
    }
    integral.step(force_loop.integral_pa_per_n_s * error_n, limit, saturation);
    (force_loop.proportional_pa_per_n * error_n + integral.value()).within(-limit, limit)
}

/// Demanded force of the stroke loop, N, for the stroke demanded now and the one that will be when a command acts. `saturation` as in [`trim`]; the
/// loop's own limits hold its integral as well.
pub fn stroke_force(
    stroke_loop: &StrokeLoop,
    integral: &mut Integral,
    [wanted_m, coming_m]: [f32; 2],
    stroke_m: f32,
    speed_m_per_s: f32,
    saturation: f32,
) -> f32 {
    let error = wanted_m - stroke_m;
    let force = stroke_loop.load_n
        + stroke_loop.load_stiffness_n_per_m * coming_m
        + stroke_loop.proportional_n_per_m * error
        + integral.value()
        - stroke_loop.damping_n_s_per_m * speed_m_per_s;
    let limited = force.within(0.0, stroke_loop.force_limit_n);
    let saturation = if force == limited { saturation } else { force - limited };
    integral.step(stroke_loop.integral_n_per_m_s * error, stroke_loop.force_limit_n, saturation);
    limited
}

#[cfg(test)]
mod tests;
