//! A gear behind the muscle runs unevenly: `F_add = a sin(2π x/λ)`.

use model_core::effects::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct StrokeRipple;

impl Effect for StrokeRipple {
    const INFO: Info = Info {
        name: "stroke-ripple",
        link: Link::LoadPath,
        parameters: &[
            Parameter::amplitude("a", "ripple", "N", 0.01, 20.0),
            Parameter::shape("λ", "period", "m", 2.0e-3, 1.0e-2),
        ],
        depends_on_pressure: false,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = a·sin(2π·x/λ)",
        summary: "A gear with an eccentric wheel adds a force that repeats over the stroke.",
        source: "made for this test",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::NestedLoops).changed(Changed::new(
        Class::Alone(Self::INFO.name),
        Owner::Rig,
        "a gear runs unevenly",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let phase = context.stroke / parameters[1] * T::from_f64(std::f64::consts::TAU);
        parameters[0] * sine(phase)
    }
}

/// The sine of any phase.
fn sine<T: Scalar>(phase: T) -> T {
    T::from_f64(f64::sin(phase.to_f64()))
}
