//! The pressure gauge reads too low by `δ`: `F_add = g(L) (1 − s k_F) · δ`.
//!
//! `g = ∂F_G/∂P`, m². Identical to a shift of the deadband `P0`, at every pressure and stroke: never named alone, reported as "`P0` includes the
//! gauge's zero". Read the gauge with the muscle vented.

use model_core::effects::{
    Changed, Class, Context, Effect, Experiment, ForceShape, Imitates, Info, Inspect, Link, Memory, Owner,
    Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct GaugeOffset;

impl Effect for GaugeOffset {
    const INFO: Info = Info {
        name: "gauge-offset",
        link: Link::Air,
        parameters: &[Parameter::amplitude("δ", "pressure_missing", "Pa", -1.0e4, 1.0e4)],
        depends_on_pressure: false,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = g·(1 − s·k_F)·δ",
        summary: "The zero of the pressure gauge is wrong.",
        source: "usual gauge accuracy, 0.1 to 0.5 % of full scale; sensitivity of the base model",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::ReferenceGauge).imitates(Imitates::Deadband).changed(
        Changed::new(Class::GaugeOffset, Owner::SensorOrMuscle, "ΔF = −δ·∂F/∂P")
            .sized("offset", "Pa")
            .takes(ForceShape::PressureSlope)
            .correctable()
            .inspect(Inspect::GaugeZero),
    );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        parameters[0] * context.pull_per_pressure()
    }
}
