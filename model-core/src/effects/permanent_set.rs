//! With the first cycles the muscle stays a little longer at rest: `F_add = ∂F/∂x · δ · (1 − e^(−n/n_0))`.
//!
//! `δ`, m, is the final set of the rest length; `n` the cycles since the muscle was new and `n_0` how many it takes. At the same active
//! length a muscle with a longer rest length is contracted further and pulls less. First order in `δ`.

use super::{Context, Effect, Info, Link, Memory, Parameter, Start, count_cycles, decay};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct PermanentSet;

impl Effect for PermanentSet {
    const INFO: Info = Info {
        name: "permanent-set",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("set", "m", -2.0e-3, 2.0e-3),
            Parameter::shape("cycles_to_settle", "", 0.5, 300.0),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: false,
        start: Start::Virgin,
        fading: &[],
        equation: "F = ∂F/∂x·δ·(1 − exp(−n/n_0))",
        summary: "Working stretches the muscle for good by a fraction of a per cent, mostly in its early life.",
        source: "catalogue of this project, V7; sensitivity of the base model",
    };

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [cycles worked, cycles at the last reading, seen]
        count_cycles(context, memory);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let done = T::ONE - decay(memory[0] / parameters[1].max(T::from_f32(1.0e-3)));
        context.stiffness * parameters[0] * done
    }
}
