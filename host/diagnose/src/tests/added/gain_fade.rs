//! The supply of an amplifier falls while a campaign is recorded, and the gain of the load cell with it: `F_add = γ F t/T`.

use model_core::effects::{
    Changed, Class, Context, Course, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory, Owner,
    Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct GainFade;

impl Effect for GainFade {
    const INFO: Info = Info {
        name: "gain-fade",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("γ", "gain_at_end", "", -0.2, 0.2),
            Parameter::shape("T", "duration", "s", 10.0, 1.0e5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = γ·F·t/T",
        summary: "The gain of the load cell falls during the recording.",
        source: "made for this test",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::DeadWeights).changed(
        Changed::new(Class::Alone(Self::INFO.name), Owner::Sensor, "ΔF = γ·F·t/T")
            .sized("gain_at_end", "")
            .adds(ForceShape::Force)
            .courses(&[Course::Ramp])
            .inspect(Inspect::LoadCellWarmUp),
    );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        parameters[0] * context.force() * context.time / parameters[1]
    }
}
