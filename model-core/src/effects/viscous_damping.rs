//! Friction proportional to speed: `F_add = −c · v`.
//!
//! `v` is the speed of shortening, m/s, `c` the damping, N·s/m. For large muscles inflation coefficients of 2.9 N·s/mm were
//! measured (D. B. Reynolds et al., Annals of Biomedical Engineering 31 (2003) 310–317).

use super::{Context, Effect, Info, Link, Memory, Parameter};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct ViscousDamping;

impl Effect for ViscousDamping {
    const INFO: Info = Info {
        name: "viscous-damping",
        link: Link::Friction,
        parameters: &[Parameter::amplitude("damping", "N·s/m", 10.0, 3.0e3)],
        depends_on_pressure: false,
        persistent: false,
        summary: "The faster the muscle moves, the more it resists: a force proportional to speed.",
        source: "Reynolds et al. 2003, doi 10.1114/1.1554921",
    };

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        -parameters[0] * context.speed
    }
}
