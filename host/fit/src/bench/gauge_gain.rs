//! The pressure gauge's scale is wrong: `F_add = g(L) (1 − s k_F) · (γ P + γ_2 P²)`.
//!
//! `γ` (dimensionless) is the part by which it reads too low, `γ_2`, 1/Pa, a curvature. Of the same shape as a wrong force gain and a
//! direction-dependent friction within a few per cent: compare with a reference gauge at three pressures.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, ForceShape, Imitates, Info, Inspect, Link,
    Memory, Owner, Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct GaugeGain;

impl Effect for GaugeGain {
    const INFO: Info = Info {
        name: "gauge-gain",
        link: Link::Air,
        parameters: &[
            Parameter::amplitude("γ", "gain_missing", "", -0.05, 0.05),
            Parameter::amplitude("γ_2", "curvature", "1/Pa", -1.0e-7, 1.0e-7),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = g·(1 − s·k_F)·(γ·P + γ_2·P²)",
        summary: "The scale of the pressure gauge is wrong by some per cent.",
        source: "usual gauge accuracy, 0.1 to 1 %; sensitivity of the base model",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::ReferenceGauge)
        .check(BenchCheck::ReferenceGauge)
        .imitates(Imitates::Description)
        .changed(
            Changed::new(Class::Gain, Owner::Sensor, "ΔF = −γ·P·∂F/∂P")
                .sized("gain", "")
                .takes(ForceShape::PressureTimesSlope)
                .correctable()
                .inspect(Inspect::GaugeScale),
        );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        context.pull_per_pressure() * context.pressure * (parameters[0] + parameters[1] * context.pressure)
    }
}
