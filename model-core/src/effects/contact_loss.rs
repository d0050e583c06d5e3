//! Where the muscle is shortened its bladder has to swell to the braid first, and that pressure does not pull.
//!
//! ```text
//! F_add = −g(L) (1 − s k_F) · [λ clamp(P′, 0, p_c ε_x) + p_1 ε_x]
//! ```
//! Two laws to choose from. In the first the bladder reaches the braid at `P′ = p_c ε_x`: the deadband grows with the radial strain `ε_x`,
//! with slope `p_c`, Pa; below, the force is missing, above, what it took to get there. `λ` (dimensionless) is 1 for the whole law,
//! less if part of the bladder touches early. In the second, for pressures that are all above contact, the deadband grows by `p_1 ε_x`,
//! Pa, without a kink. `g`, m², is the muscle's effective area; past the neutral angle (`g < 0`) the sign turns with the base model's.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct ContactLoss;

impl Effect for ContactLoss {
    const INFO: Info = Info {
        name: "contact-loss",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("λ", "missing_part", "", 0.1, 1.5),
            Parameter::amplitude("p_1", "deadband_growth", "Pa", 1.0e3, 3.0e5),
            Parameter::shape("p_c", "contact_pressure", "Pa", 3.0e3, 1.0e6),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = −g·(1 − s·k_F)·[λ·clamp(P′, 0, p_c·ε_x) + p_1·ε_x]",
        summary: "A shortened muscle pulls only above the pressure at which its bladder touches the braid.",
        source: "deadband that depends on length, after S. Davis and D. Caldwell, Int. J. Robotics Research 25 (2006) 359–369, doi 10.1177/0278364906063227",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::PressureRamps).changed(Changed::new(
        Class::Alone(Self::INFO.name),
        Owner::Muscle,
        "the bladder does not touch the braid yet",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let needed = (parameters[2] * context.radial_strain).max(T::ZERO);
        let missing = parameters[0] * context.corrected_pressure.clamp(T::ZERO, needed);
        -context.pull_per_pressure() * (missing + parameters[1] * context.radial_strain)
    }
}
