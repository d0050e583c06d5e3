//! Friction proportional to speed: `F_add = −(c + c_P P) · v`.
//!
//! `v` is the speed of shortening, m/s; `c` the damping, N·s/m; `c_P` a damping that grows with pressure, N·s/m per Pa. For a
//! large muscle 2.9 N·s/mm were found on inflation, and on deflation 1.57 N·s/mm up to 372 kPa and 0.311 + 0.00338 P/kPa above.
//! Holds at the speeds of one decade or two; rubber's own damping rises more slowly than speed (see `rate-power`). At rest it
//! vanishes immediately, unlike a lag of pressure.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct ViscousDamping;

impl Effect for ViscousDamping {
    const INFO: Info = Info {
        name: "viscous-damping",
        link: Link::Friction,
        parameters: &[
            Parameter::amplitude("c", "damping", "N·s/m", 10.0, 1.0e5),
            Parameter::amplitude("c_P", "damping_per_pressure", "N·s/m/Pa", 1.0e-5, 0.2),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = −(c + c_P·P)·v",
        summary: "A friction force proportional to speed opposes the motion.",
        source: "D. B. Reynolds et al., Annals of Biomedical Engineering 31 (2003) 310–317, doi 10.1114/1.1554921",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Speeds).changed(Changed::new(
        Class::RateOrPhase,
        Owner::Muscle,
        "friction proportional to speed",
    ));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        -(parameters[0] + parameters[1] * context.pressure) * context.speed
    }
}
