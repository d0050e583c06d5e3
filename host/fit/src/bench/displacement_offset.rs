//! The stroke is counted from the wrong place: `F_add = ∂F/∂x · δ`.
//!
//! `δ`, m, is how much more the muscle is contracted than the stroke says. First order. Measure the vented length with a caliper.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Course, Effect, Experiment, ForceShape, Imitates, Info, Inspect,
    Link, Memory, Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct DisplacementOffset;

impl Effect for DisplacementOffset {
    const INFO: Info = Info {
        name: "displacement-offset",
        link: Link::Reading,
        parameters: &[Parameter::amplitude("δ", "offset", "m", -3.0e-3, 3.0e-3)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = ∂F/∂x·δ",
        summary: "The zero of the stroke sensor is not the rest length of the muscle.",
        source: "sensitivity of the base model; 0.1 to 1 mm are usual",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::VentedLength)
        .check(BenchCheck::VentedLength)
        .imitates(Imitates::Description)
        .changed(
            Changed::new(Class::Gain, Owner::Rig, "ΔF = δ·∂F/∂x")
                .sized("offset", "m")
                .adds(ForceShape::StrokeSlope)
                // A sudden one is a slip.
                .courses(&[Course::Whole, Course::Ramp])
                .correctable()
                .inspect(Inspect::MountedLength),
        );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        parameters[0] * context.slope()
    }
}
