//! The load cell's scale is wrong: `F_add = γ F + γ_2 F |F|`.
//!
//! `γ` (dimensionless), `γ_2`, 1/N; `F`, N, the base model's force. Hang known weights.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, ForceShape, Imitates, Info, Inspect, Link,
    Memory, Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct ForceGain;

impl Effect for ForceGain {
    const INFO: Info = Info {
        name: "force-gain",
        link: Link::Reading,
        parameters: &[
            Parameter::amplitude("γ", "gain_missing", "", -0.05, 0.05),
            Parameter::amplitude("γ_2", "curvature", "1/N", -1.0e-3, 1.0e-3),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = γ·F + γ_2·F·|F|",
        summary: "The scale of the load cell is wrong by some per cent.",
        source: "non-linearity of 0.02 to 0.1 % of full scale: manufacturers of load cells; wrong calibration 1 to 3 %",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::DeadWeights)
        .check(BenchCheck::DeadWeights)
        .imitates(Imitates::Description)
        .changed(
            Changed::new(Class::Gain, Owner::Sensor, "ΔF = γ·F")
                .sized("gain", "")
                .adds(ForceShape::Force)
                .correctable()
                .inspect(Inspect::LoadCellScale),
        );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let pull = context.force();
        pull * (parameters[0] + parameters[1] * pull.abs())
    }
}
