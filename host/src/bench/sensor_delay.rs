//! The force reading is late against stroke and pressure.
//!
//! ```text
//! F_add = −δ (∂F/∂x v + g (1 − s k_F) dP/dt)        or        F_add = −κ (F − LP_τ(F))
//! ```
//! `δ`, s, a skew between the channels, to first order and away from turns (negative: the stroke is the late one); or a first-order filter
//! of time constant `τ`, s, in the force channel, `κ = 1` for the whole, which also rounds the jumps at turns. `F`, N, is the base model's
//! force. Laws to choose from.

use model_core::effects::{Context, Effect, Fading, Info, Link, Memory, Parameter, Start};
use model_core::scalar::Scalar;

type Filter = Fading<1, 1>;

/// See the [module](self).
pub(super) struct SensorDelay;

impl Effect for SensorDelay {
    // memory: see Fading, one time constant, the force as drive
    const INFO: Info = Info {
        name: "sensor-delay",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("skew", "s", -0.3, 0.3),
            Parameter::amplitude("filtered_part", "", 0.1, 1.2),
            Parameter::shape("filter_time", "s", 1.0e-3, 0.5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[],
        equation: "F = −δ·(∂F/∂x·v + g·(1 − s·k_F)·dP/dt), or F = −κ·(F − LP_τ(F))",
        summary: "The force channel is late against the other channels.",
        source: "first-order filter or skew; 1 to 100 ms are usual",
    };

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        Filter::step(memory, context.dt, &[parameters[2]], &[context.force()]);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let rate = context.slope() * context.speed + context.pull_per_pressure() * context.pressure_rate;
        -parameters[0] * rate - parameters[1] * Filter::value(memory, 0, context.force())
    }
}
