//! Masses that move with the muscle's free end: `F_add = −m · dv/dt`.
//!
//! `m`, kg: moving head, fittings and half the muscle. Seen at turns and in fast runs only: 20 mN for 1 kg at 20 mm/s².

use model_core::effects::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct Inertia;

impl Effect for Inertia {
    const INFO: Info = Info {
        name: "inertia",
        link: Link::LoadPath,
        parameters: &[Parameter::amplitude("m", "mass", "kg", 0.02, 5.0)],
        depends_on_pressure: false,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −m·dv/dt",
        summary: "Moving masses between muscle and load cell need a force when they accelerate.",
        source: "Newton; moving heads of 0.1 to 2 kg",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Speeds).changed(Changed::new(
        Class::Alone(Self::INFO.name),
        Owner::Rig,
        "moving masses",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        -parameters[0] * context.acceleration
    }
}
