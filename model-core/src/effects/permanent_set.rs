//! Use stretches the muscle permanently: its rest length grows by `δ` during its life.
//!
//! ```text
//! F_add = ∂F/∂x · [δ (1 − e^(−ℓ/ℓ_0)) + δ_l (1 − e^(−I/I_0))]
//! ```
//! `δ` and `δ_l`, m, are the final sets of two laws to choose from: driven by the path `ℓ` that the strands have slid (in rest lengths; a
//! full cycle of 15 % contraction is 0.3) over `ℓ_0`, or by the load's impulse `I = ∫|F_quasi| dt`, N·s, over `I_0`. At the same active length a
//! muscle with a longer rest length is contracted further and pulls less. First order in `δ`.

use super::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start,
    Traits, decay,
    work::{IMPULSE, PATH, work},
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct PermanentSet;

impl Effect for PermanentSet {
    // memory: see `work`
    const INFO: Info = Info {
        name: "permanent-set",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("δ", "set_by_work", "m", -2.0e-3, 2.0e-3),
            Parameter::amplitude("δ_l", "set_by_load", "m", -2.0e-3, 2.0e-3),
            Parameter::shape("ℓ_0", "path", "", 0.1, 300.0),
            Parameter::shape("I_0", "impulse", "N·s", 1.0e3, 1.0e6),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: true,
        start: Start::Virgin,
        fading: &[],
        equation: "F = ∂F/∂x·[δ·(1 − exp(−ℓ/ℓ_0)) + δ_l·(1 − exp(−I/I_0))]",
        summary: "Use lengthens the muscle permanently by a fraction of a per cent, mostly in its early life.",
        source: "change of rest length in early life, 0.1 to 1 %; E. G. Hocking, thesis, University of Maryland (2012): run-in over the first tests",
    };

    const TRAITS: Traits =
        Traits::shown_by(Experiment::VentedLength).check(BenchCheck::VentedLength).slow().changed(
            Changed::new(
                Class::Alone(Self::INFO.name),
                Owner::Muscle,
                "the muscle stays longer with every cycle",
            )
            .remembering(),
        );

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        work(context, memory);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let worked = T::ONE - decay(memory[PATH] / parameters[2].max(T::from_f32(1.0e-3)));
        let loaded = T::ONE - decay(memory[IMPULSE] / parameters[3].max(T::from_f32(1.0e-3)));
        context.slope() * (parameters[0] * worked + parameters[1] * loaded)
    }
}
