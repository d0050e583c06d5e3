//! Static friction that has grown during a rest and is lost over the first tenths of a millimetre.
//!
//! ```text
//! F_add = −s · (m (ΔF_s + κ |F_quasi|) + κ_h |F_quasi|) · ln(1 + θ/τ_s),   θ = t_rest · e^(−d/δ)
//! ```
//! Contacts grip harder with the logarithm of their age `θ`, s, which counts how long the muscle rested, `t_rest`, and is lost over the
//! distance `δ` of travel `d` since, m; before `τ_s`, s, no ageing shows. `ΔF_s`, N, and `κ` (of the muscle's force, which presses the
//! strands together) are the excess for each e-fold of age: laws to choose from. The memory notes where the muscle rested and how long; a
//! turn without rest counts as a rest of no length. `m` is 1 in motion and 0 at rest: a static friction shows only once it is overcome.
//! `κ_h` is for friction that changes during the rest itself: positive where contacts grip harder, negative where they creep and let the
//! force go to the middle of the loop.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits, decay,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct BreakawayFriction;

impl Effect for BreakawayFriction {
    const INFO: Info = Info {
        name: "breakaway-friction",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("ΔF_s", "excess_friction", "N", 0.02, 10.0),
            Parameter::amplitude("κ", "excess_factor", "", 0.001, 0.1),
            Parameter::amplitude("κ_h", "held_factor", "", -0.1, 0.1),
            Parameter::shape("δ", "loss_distance", "m", 5.0e-6, 1.0e-3),
            Parameter::shape("τ_s", "growth_time", "s", 0.3, 100.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = −s·(m·(ΔF_s + κ·|F_quasi|) + κ_h·|F_quasi|)·ln(1 + t_rest/τ_s·exp(−d_rest/δ))",
        summary: "After a rest the first motion needs an extra force, which grows with the duration of the rest.",
        source: "J. H. Dieterich, J. Geophys. Res. 84 (1979) 2161–2168, doi 10.1029/JB084iB05p02161",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Rests).changed(
        Changed::new(Class::Alone(Self::INFO.name), Owner::Muscle, "friction is higher after a rest")
            .remembering(),
    );

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [where it rested, for how long, last hold time, whether it moves, seen]
        let resting = memory[4] == T::ZERO || context.resting != T::ZERO || context.hold_time > memory[2];
        let turned = context.hold_time < memory[2];
        memory[4] = T::ONE;
        memory[2] = context.hold_time;
        if resting || turned {
            memory[0] = context.stroke;
            memory[1] = context.hold_time;
        }
        memory[3] = if resting { T::ZERO } else { T::ONE };
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let gone = (context.stroke - memory[0]) / parameters[3].max(T::from_f32(1.0e-6));
        let age = memory[1] / parameters[4].max(T::from_f32(1.0e-3)) * decay(gone);
        let pull = context.quasi.abs();
        let excess = memory[3] * (parameters[0] + parameters[1] * pull) + parameters[2] * pull;
        -context.direction * excess * age.ln_1p()
    }
}
