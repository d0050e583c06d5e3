//! Where the muscle is shortened at low pressure the bladder has not yet swollen to the braid, and the pressure does not pull.
//!
//! ```text
//! F_add = −λ · g(L) · clamp(P′, 0, p_c ε_x)
//! ```
//! The bladder reaches the braid at `P′ = p_c ε_x`: the deadband grows with the radial strain `ε_x`, with slope `p_c`, Pa. Below, the force
//! is missing; above, what it took to get there. `λ` (dimensionless) is 1 for the whole law, less if part of the bladder touches
//! early. `g`, m², is the muscle's effective area. Past the neutral angle (`g < 0`) the sign turns with the base model's.

use super::{Context, Effect, Info, Link, Memory, Parameter, Start};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct ContactLoss;

impl Effect for ContactLoss {
    const INFO: Info = Info {
        name: "contact-loss",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("missing_part", "", 0.1, 1.5),
            Parameter::shape("contact_pressure", "Pa", 3.0e3, 1.0e6),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −λ·g·clamp(P′, 0, p_c·ε_x)",
        summary: "A shortened muscle needs some pressure before its bladder touches the braid and pulls.",
        source: "deadband that depends on length, after S. Davis and D. Caldwell, Int. J. Robotics Research 25 (2006) 359–369, doi 10.1177/0278364906063227",
    };

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let needed = (parameters[1] * context.radial_strain).max(T::ZERO);
        -parameters[0] * context.area * context.corrected_pressure.clamp(T::ZERO, needed)
    }
}
