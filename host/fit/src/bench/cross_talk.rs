//! The pressure acts on the load cell past the muscle: `F_add = c · P`.
//!
//! `c`, m²: thrust on an end cap, a hose that straightens. Pressurise with the muscle disconnected, or blocked at both ends.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory, Owner,
    Parameter, Start, Traits, Vented,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct CrossTalk;

impl Effect for CrossTalk {
    const INFO: Info = Info {
        name: "cross-talk",
        link: Link::Reading,
        parameters: &[Parameter::amplitude("c", "thrust_area", "m²", -5.0e-5, 5.0e-5)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = c·P",
        summary: "Pressure in the hose or the fittings pushes on the load cell.",
        source: "end-cap thrust; 0.1 to 5 N per 100 kPa",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::DeadWeights)
        .check(BenchCheck::DeadWeights)
        .vented(Vented::Everything)
        .changed(
            Changed::new(Class::Gain, Owner::Rig, "ΔF = c·P")
                .sized("thrust_area", "m²")
                .adds(ForceShape::Pressure)
                .correctable()
                .inspect(Inspect::PressureOnLoadCell),
        );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        parameters[0] * context.pressure
    }
}
