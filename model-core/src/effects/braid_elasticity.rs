//! The braid's fibres stretch under what they carry.
//!
//! ```text
//! T = (P′ − h) L B/(2πN²)        F_add = −(1 − s k_F) c T · B dT/dL = −(1 − s k_F) c (B³/4π²N⁴) L (P′ − h) (P′ − h − L h′)
//! h = E t ε_x/R                   E = F_el/c_1        L h′ = E (t/R) (L R′/R0 + ε_x L (t′/t − R′/R))       R′ = −L/(4π²N²R)
//! ```
//! `T` is the tension of all fibres taken as one, from the balance of hoop forces over a length `L` (`2 N` crossings that carry what
//! the wall leaves to the braid), N; `c = 1/(EA)` their compliance, 1/N. `h`, Pa, is the pressure that the wall's own hoop stress
//! carries, with the modulus `E` of the base model's elastic force at this stroke. Next to rest length, where force and `c_1` both
//! vanish, `E` is the modulus of the slope. About rest length the radius changes many times faster than the length, so that `L h′` is
//! the largest of the three. A longer fibre at the same length means a wider, flatter muscle that pulls less. To first order in `c`
//! this is the derivative of the elastic energy `−T² B c/2` of the fibres; it does not hold for soft braids that lose tens of per cent.

use super::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, Imitates, Info, Link, Memory, Owner, Parameter,
    Start, Traits,
};
use crate::scalar::Scalar;

/// The way over which the modulus is taken from the slope of the elastic force, as a part of the rest length.
const NEAR_REST: f32 = 1.0e-3;

/// See the [module](self).
pub(super) struct BraidElasticity;

impl Effect for BraidElasticity {
    const INFO: Info = Info {
        name: "braid-elasticity",
        link: Link::Braid,
        parameters: &[Parameter::amplitude("c", "fibre_compliance", "1/N", 1.0e-7, 1.0e-3)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −(1 − s·k_F)·c·(B³/4π²N⁴)·L·(P′ − h)·(P′ − h − L·h′), h = E·t_B·ε_x/R",
        summary: "The fibres of the braid stretch under load, so the muscle expands more and pulls less at high pressure.",
        source: "J. Chambers and N. Wereley, Actuators 11(8) (2022) 219, doi 10.3390/act11080219; the hoop balance is that of M. Gaylord, US patent 2,844,126",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::EndsAndDiameter)
        .check(BenchCheck::EndsAndDiameter)
        .imitates(Imitates::Description)
        .changed(Changed::new(Class::Gain, Owner::Muscle, "the braid's fibres stretch"));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let b = context.fibre_length;
        let n = context.turns;
        let per_turns = b / (n * n * T::from_f64(2.0 * core::f64::consts::PI));
        let (carried, its_slope) = carried_by_the_wall(context);
        let left = (context.corrected_pressure - carried).max(T::ZERO);
        let lost = parameters[0] * left * (left - its_slope) * context.length * b * per_turns * per_turns;
        -context.rubbed(lost)
    }
}

/// `h` and `L dh/dL`, Pa.
fn carried_by_the_wall<T: Scalar>(context: &Context<T>) -> (T, T) {
    let (length, radius) = (context.length, context.radius.max(T::from_f32(1.0e-6)));
    let around = context.turns * T::from_f64(2.0 * core::f64::consts::PI);
    // L²/(4π²N²)
    let squared = (length / around) * (length / around);
    // A = t L²/(2πN²R), so that t/R = A/(2 L²/(4π²N²) π).
    let thin = context.hoop_area / (squared * T::from_f64(2.0 * core::f64::consts::PI));
    // The modulus that gives the elastic force and, over a short way, its slope: at rest length the forces themselves are zero.
    let way = context.rest_length * T::from_f32(NEAR_REST);
    let steepness = context.length / (around * around * radius);
    let unit_slope = (context.axial_area / context.rest_length.max(T::from_f32(1.0e-6))
        + context.hoop_area * steepness / context.rest_radius.max(T::from_f32(1.0e-6)))
        * way;
    let gaylord_slope =
        context.corrected_pressure * context.length * T::from_f64(6.0 * core::f64::consts::PI)
            / (around * around);
    let elastic_slope = (context.stiffness + gaylord_slope) * way;
    let unit = context.unit_elastic();
    let modulus = (context.elastic * unit - elastic_slope * unit_slope)
        / (unit * unit + unit_slope * unit_slope).max(T::from_f32(1.0e-30));
    let strain = context.radial_strain;
    // L R′/R = −L²/(4π²N²R²), and as the wall keeps its volume L t′/t = −(L R′/R + 1 − t/2R)/(1 − t/R).
    let widening = -squared / (radius * radius);
    let thinning = (widening + T::ONE - T::from_f32(0.5) * thin) / (T::ONE - thin).max(T::from_f32(0.1));
    let slope =
        widening * radius / context.rest_radius.max(T::from_f32(1.0e-6)) - strain * (thinning + widening);
    (modulus * thin * strain, modulus * thin * slope)
}
