//! Friction that falls as the muscle gets faster: `F_add = −s (ΔF + κ |F_quasi|) e^(−|v|/v_s)`.
//!
//! `ΔF`, N, and `κ` (dimensionless, for strands that the muscle's own force presses together) are the excess at rest over that at
//! speed, `v_s`, m/s, the speed of the fall. Tondu and Lopez give the braid's friction this form. At one speed it cannot be reported
//! from dry friction; four speeds over two decades are needed, the slowest below 0.3 mm/s.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits, decay,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct StribeckFriction;

impl Effect for StribeckFriction {
    const INFO: Info = Info {
        name: "stribeck-friction",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("ΔF", "excess_friction", "N", 0.1, 20.0),
            Parameter::amplitude("κ", "excess_factor", "", 0.002, 0.2),
            Parameter::shape("v_s", "falloff_speed", "m/s", 5.0e-5, 2.0e-2),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = −s·(ΔF + κ·|F_quasi|)·exp(−|v|/v_s)",
        summary: "Friction is larger in slow motion than in fast motion.",
        source: "B. Tondu and P. Lopez, IEEE Control Systems Magazine 20(2) (2000) 15–38, doi 10.1109/37.833638; Armstrong-Hélouvry et al. 1994, doi 10.1016/0005-1098(94)90209-7",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Speeds).changed(Changed::new(
        Class::SlowSpeed,
        Owner::Muscle,
        "friction falls with speed",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let slow = decay(context.speed / parameters[2].max(T::from_f32(1.0e-6)));
        -context.direction * (parameters[0] + parameters[1] * context.quasi.abs()) * slow
    }
}
