//! Friction of a push-rod's seal or guide: a constant part, and one that the pressure presses on, both higher when slow.
//!
//! ```text
//! F_add = −s_x [F_0 + A_s (P_a + P)] (1 + (k − 1) e^(−|v|/v_s))
//! ```
//! `s_x` is the direction in which the stroke last went; `F_0`, N, comes from the seal's interference fit; `A_s = μ_s π d w`, m², is the seal's rubbing area times its coefficient,
//! `P_a = 101.3 kPa`; `k` the ratio of breakaway to running friction and `v_s`, m/s, the speed over which it falls off. Below 1 to
//! 5 mm/s real seals stick and slip, which a mean force describes only on average.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits, Vented,
    decay, stroke_direction,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct SealFriction;

impl Effect for SealFriction {
    const INFO: Info = Info {
        name: "seal-friction",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("F_0", "fit_friction", "N", 0.2, 20.0),
            Parameter::amplitude("A_s", "rubbing_area", "m²", 5.0e-7, 1.0e-4),
            Parameter::shape("k", "breakaway_ratio", "", 1.0, 3.0),
            Parameter::shape("v_s", "falloff_speed", "m/s", 1.0e-4, 2.0e-2),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Branch,
        fading: &[],
        equation: "F = −s_x·[F_0 + A_s·(P_a + P)]·(1 + (k−1)·exp(−|v|/v_s))",
        summary: "The seal around a push-rod causes friction, which grows with pressure and is largest at low speed.",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083–1138, doi 10.1016/0005-1098(94)90209-7",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::PressuresAndRamps)
        .made_from_base()
        .vented(Vented::Everything)
        .changed(Changed::new(Class::Friction, Owner::Muscle, "a rod's seal rubs"));

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: the direction of the stroke
        stroke_direction(context, memory, 0);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let atmosphere = T::from_f32(101.325e3);
        let slow =
            T::ONE + (parameters[2] - T::ONE) * decay(context.speed / parameters[3].max(T::from_f32(1.0e-6)));
        let running = parameters[0] + parameters[1] * (atmosphere + context.pressure.max(-atmosphere));
        -memory[0] * running * slow
    }
}
