//! Friction between strands that the pressure presses together: `F_add = −s · P · π (μ R² + μ_0 R0²)`.
//!
//! `μ` and `μ_0` are effective coefficients (dimensionless), `P` the gauge pressure at the muscle, Pa (no less than zero), `R` the present
//! radius and `R0` that at rest, m. Tondu and Lopez derive a thread friction proportional to pressure and contact area; the area that takes
//! part is not measured, so it is counted in cross-sections of the muscle here: one that grows as the muscle does, or one that stays. Friction that grows with pressure but not with force
//! differs from the table's own where a contracted muscle is pressurised and pulls little. Below contact (`P < P0`) the law
//! overstates friction.

use super::{
    Changed, Class, Context, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory, Owner, Parameter,
    Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct PressureFriction;

impl Effect for PressureFriction {
    const INFO: Info = Info {
        name: "pressure-friction",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("μ", "friction_coefficient", "", 0.002, 0.5),
            Parameter::amplitude("μ_0", "constant_area_coefficient", "", 0.002, 0.5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = −s·P·π·(μ·R² + μ_0·R0²)",
        summary: "Pressure pushes the braid strands together; their friction is proportional to it, even at low load.",
        source: "B. Tondu and P. Lopez, IEEE Control Systems Magazine 20(2) (2000) 15–38, doi 10.1109/37.833638; B. Tondu, J. Intelligent Material Systems and Structures 23 (2012) 225–253, doi 10.1177/1045389X11435435",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::PressuresAndRamps).changed(
        Changed::new(Class::Friction, Owner::RigOrMuscle, "ΔF = −μ·P·sgn v")
            .sized("force_per_pressure", "m²")
            .takes(ForceShape::DirectionTimesPressure)
            .inspect(Inspect::SealOrBraid),
    );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let (now, at_rest) = (context.radius * context.radius, context.rest_radius * context.rest_radius);
        let pressed = context.pressure.max(T::ZERO) * T::from_f64(core::f64::consts::PI);
        -context.direction * pressed * (parameters[0] * now + parameters[1] * at_rest)
    }
}
