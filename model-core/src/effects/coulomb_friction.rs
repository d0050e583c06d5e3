//! Friction of constant size: `F_add = −s · F_c`.
//!
//! `s` is the direction of motion, `F_c` the friction force. It differs from the table's own friction, which is
//! proportional to the muscle's force: it is still there where the force is zero, and shows in the tables as
//! `k_F(P) ≈ a + b/P`. McKibben muscles have been reported with a hysteresis of 5–10 N that does not depend on speed
//! (C.-P. Chou and B. Hannaford, IEEE Trans. Robotics and Automation 12 (1996) 90–102).

use super::{Context, Effect, Info, Link, Memory, Parameter};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct CoulombFriction;

impl Effect for CoulombFriction {
    const INFO: Info = Info {
        name: "coulomb-friction",
        link: Link::Friction,
        parameters: &[Parameter::amplitude("friction_force", "N", 0.05, 20.0)],
        depends_on_pressure: false,
        persistent: false,
        summary: "A friction force of constant size opposes every motion, whatever the muscle pulls.",
        source: "Chou and Hannaford 1996, doi 10.1109/70.481753",
    };

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        -context.direction * parameters[0]
    }
}
