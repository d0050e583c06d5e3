//! Friction of constant size: `F_add = −s_x · F_c − s · F_s`.
//!
//! `s_x` is the direction in which the stroke last went (a change of pressure at held length does not turn it: what rubs is a guide or
//! a fitting), `F_c` the friction force, N. Where the strands of the braid rub, `F_s`, N, their direction `s` follows filling and
//! emptying as well; only rests with a change of pressure report the two apart. It differs from the table's own friction, which is
//! proportional to the muscle's force: it is still there where the force is zero, and shows in the tables as
//! `k_F(P) ≈ a + b/P`. McKibben muscles have been reported with a hysteresis of 5–10 N that does not depend on speed.
//! Holds while the muscle slides; within the first tenths of a millimetre after a reversal see `presliding-hysteresis`. Until the
//! muscle first moves `s` is unknown and nothing is added.

use super::{
    Changed, Class, Context, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory, Owner, Parameter,
    Start, Traits, Vented, stroke_direction,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct CoulombFriction;

impl Effect for CoulombFriction {
    const INFO: Info = Info {
        name: "coulomb-friction",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("F_c", "friction_force", "N", 0.05, 20.0),
            Parameter::amplitude("F_s", "strand_friction", "N", 0.05, 20.0),
        ],
        depends_on_pressure: false,
        persistent: false,
        alternatives: true,
        start: Start::Branch,
        fading: &[],
        equation: "F = −s_x·F_c − s·F_s",
        summary: "A constant friction force opposes every motion, at any load.",
        source: "C.-P. Chou and B. Hannaford, IEEE Trans. Robotics and Automation 12 (1996) 90–102, doi 10.1109/70.481753",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::PressuresAndRamps).vented(Vented::FirstLaw).changed(
        Changed::new(Class::Friction, Owner::RigOrMuscle, "ΔF = −f·sgn v")
            .sized("force", "N")
            .takes(ForceShape::Direction)
            .inspect(Inspect::Guides),
    );

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: the direction of the stroke
        stroke_direction(context, memory, 0);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        -memory[0] * parameters[0] - context.direction * parameters[1]
    }
}
