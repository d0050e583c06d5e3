//! The ends are not cylinders.
//!
//! ```text
//! F_add = −(1 − s k_F) P′ [k_t π R² (R/L) ε + k_v (R − R0)(3R − R0) L/(4πN²R)]
//! ```
//! Near its fittings the muscle tapers, and the more it has swollen the longer the taper. Two laws to choose from. In the first the
//! effective length is shorter than `L` by about `2 k_t R`, so the pressure pulls less, in proportion to `R/L` and to the contraction
//! `ε = ΔL/L0`. In the second the tapers enclose less air than the cylinder, by `k_v π R (R − R0)²`: as wide as the muscle, as deep and as
//! long as it has swollen; the pressure pulls less by the slope of that volume. `P′`, Pa; `R`, `L`, m; `k_t`, `k_v` dimensionless. First order in
//! `R/L`: for muscles shorter than about five diameters both are a trend only. Tables that are free at each pressure absorb them
//! whole; they show as `E_k` that rise in proportion to pressure.

use super::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, FurtherLaw, Imitates, Info, Link, Memory, Owner,
    Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct TipEffect;

impl Effect for TipEffect {
    const INFO: Info = Info {
        name: "tip-effect",
        link: Link::Braid,
        parameters: &[
            Parameter::amplitude("k_t", "tip_factor", "", 0.1, 4.0),
            Parameter::amplitude("k_v", "taper_volume", "", 0.1, 8.0),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: true,
        start: Start::Known,
        fading: &[],
        equation: "F = −(1 − s·k_F)·P′·[k_t·π·R²·(R/L)·ε + k_v·(R − R0)·(3R − R0)·L/(4πN²R)]",
        summary: "The muscle narrows towards its ends, which pull less than a cylinder.",
        source: "J. Chambers and N. Wereley, Actuators 10(4) (2021) 72, doi 10.3390/act10040072; E. G. Hocking, thesis, University of Maryland (2012), appendix on tip correction",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::EndsAndDiameter)
        .check(BenchCheck::EndsAndDiameter)
        .imitates(Imitates::Description)
        .changed(
            Changed::new(Class::Alone(Self::INFO.name), Owner::Muscle, "the ends are not cylinders")
                .further(FurtherLaw::TaperSlant),
        );

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let cross_section = T::from_f64(core::f64::consts::PI) * context.radius * context.radius;
        let slender = context.radius / context.length.max(context.radius);
        let swollen = context.radius - context.rest_radius;
        let around =
            context.turns * context.turns * context.radius * T::from_f64(4.0 * core::f64::consts::PI);
        let per_length = context.length / around.max(T::from_f32(1.0e-9));
        let lost = (swollen + context.radius + context.radius) * swollen * per_length;
        let area = parameters[0] * cross_section * slender * context.contraction + parameters[1] * lost;
        -context.rubbed(context.corrected_pressure * area)
    }
}
