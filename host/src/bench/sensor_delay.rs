//! The force reading is late against stroke and pressure.
//!
//! ```text
//! F_add = −δ (∂F/∂x v + g (1 − s k_F) dP/dt)    or    F_add = −κ (F − LP_τ(F))    or    F_add = −κ_d (F − D_τ(F)),  D_τ = LP⁴_{τ/4}
//! ```
//! `δ`, s, a skew between the channels, to first order and away from turns (negative: the stroke is the late one); or a first-order filter
//! of time constant `τ`, s, in the force channel, `κ = 1` for the whole, which also rounds the jumps at turns; or a delay by `τ` behind a
//! converter's filter: four equal filters in a row, which bring a jump late and not at once. `F`, N, is the base model's force. Laws to
//! choose from.

use model_core::effects::{Context, Effect, Fading, Info, Link, Memory, Parameter, Start};
use model_core::scalar::Scalar;

type Filter = Fading<1, 1>;
/// Filters in a row behind a delay.
const ROW: usize = 4;
/// Where they begin in the memory: whether anything was seen, the force, what each filter gives.
const SEEN: usize = Filter::SLOTS;

/// See the [module](self).
pub(super) struct SensorDelay;

impl Effect for SensorDelay {
    // memory: see Fading, one time constant, the force as drive; then the row of filters
    const INFO: Info = Info {
        name: "sensor-delay",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("δ", "skew", "s", -0.3, 0.3),
            Parameter::amplitude("κ", "filtered_part", "", 0.1, 1.2),
            Parameter::amplitude("κ_d", "delayed_part", "", 0.1, 1.2),
            Parameter::shape("τ", "filter_time", "s", 1.0e-3, 0.5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Settled,
        fading: &[],
        equation: "F = −δ·(∂F/∂x·v + g·(1 − s·k_F)·dP/dt), or F = −κ·(F − LP_τ(F)), or F = −κ_d·(F − D_τ(F))",
        summary: "The force channel is late against the other channels.",
        source: "first-order filter or skew; 1 to 100 ms are usual",
    };

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        Filter::step(memory, context.dt, &[parameters[3]], &[context.force()]);
        let force = context.force();
        if memory[SEEN] == T::ZERO {
            memory[SEEN] = T::ONE;
            memory[SEEN + 1..SEEN + 2 + ROW].fill(force);
            return;
        }
        let row = &mut memory[SEEN + 1..SEEN + 2 + ROW];
        let mut input = (row[0], force);
        row[0] = force;
        let time = parameters[3].max(T::from_f32(1.0e-4)) / T::from_f64(ROW as f64);
        let dt = context.dt.max(T::ZERO);
        let kept = (-dt / time).exp();
        // Exact where the input runs straight between two moments.
        let mean = if dt > T::ZERO { (T::ONE - kept) * time / dt } else { T::ONE };
        for output in &mut row[1..] {
            let before = *output;
            *output = kept * before + (T::ONE - mean) * input.1 + (mean - kept) * input.0;
            input = (before, *output);
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let rate = context.slope() * context.speed + context.pull_per_pressure() * context.pressure_rate;
        let filtered = Filter::value(memory, 0, context.force());
        let delayed =
            if memory[SEEN] == T::ZERO { T::ZERO } else { context.force() - memory[SEEN + 1 + ROW] };
        -(parameters[0] * rate + parameters[1] * filtered + parameters[2] * delayed)
    }
}
