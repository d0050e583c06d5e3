//! The ends are not cylinders: `F_add = −k_t · P′ · π R² · (R/L) · ε`.
//!
//! Near its fittings the muscle tapers, and the more it has swollen the longer the taper: the effective length is shorter than `L`
//! by about `2 k_t R`, so the pressure pulls less, in proportion to `R/L` and to the contraction `ε = ΔL/L0`. `P′`, Pa; `R`, `L`, m; `k_t`
//! dimensionless. First order in `R/L`: for muscles shorter than about five diameters it is a trend only. Tables that are free at
//! each pressure swallow it whole; it shows as `E_k` that rise in proportion to pressure.

use super::{Context, Effect, Info, Link, Memory, Parameter, Start};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct TipEffect;

impl Effect for TipEffect {
    const INFO: Info = Info {
        name: "tip-effect",
        link: Link::Braid,
        parameters: &[Parameter::amplitude("tip_factor", "", 0.1, 4.0)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −k_t·P′·π·R²·(R/L)·ε",
        summary: "The muscle narrows towards its ends, which do not pull like a cylinder.",
        source: "J. Chambers and N. Wereley, Actuators 10(4) (2021) 72, doi 10.3390/act10040072; E. G. Hocking, thesis, University of Maryland (2012), appendix on tip correction",
    };

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let cross_section = T::from_f64(core::f64::consts::PI) * context.radius * context.radius;
        let slender = context.radius / context.length.max(context.radius);
        -parameters[0] * context.corrected_pressure * cross_section * slender * context.contraction
    }
}
