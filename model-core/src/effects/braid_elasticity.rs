//! The braid's fibres stretch under the pressure they carry.
//!
//! ```text
//! T_b = P′ L B/(2πN²)        δB = B T_b c        F_add = ∂F_G/∂B δB = −c P′² L B³/(4π²N⁴)
//! ```
//! `T_b` is the tension of all fibres taken as one, from the balance of hoop forces over a length `L` (`2 N` crossings that carry
//! `2 P′ R L`), N; `c = 1/(EA)` their compliance, 1/N. A longer fibre at the same length means a wider, flatter muscle that
//! pulls less. First order in the stretch and without the bladder's own extra stretch; soft braids with tens of per cent of loss
//! are beyond it.

use super::{Context, Effect, Info, Link, Memory, Parameter, Start};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct BraidElasticity;

impl Effect for BraidElasticity {
    const INFO: Info = Info {
        name: "braid-elasticity",
        link: Link::Braid,
        parameters: &[Parameter::amplitude("fibre_compliance", "1/N", 1.0e-7, 1.0e-3)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −c·P′²·L·B³/(4π²·N⁴)",
        summary: "The fibres of the braid stretch under load, so the muscle swells more and pulls less at high pressure.",
        source: "J. Chambers and N. Wereley, Actuators 11(8) (2022) 219, doi 10.3390/act11080219; the hoop balance is that of M. Gaylord, US patent 2,844,126",
    };

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let b = context.fibre_length;
        let n = context.turns;
        let per_turns = b / (n * n * T::from_f64(2.0 * core::f64::consts::PI));
        let p = context.corrected_pressure.max(T::ZERO);
        -parameters[0] * p * p * context.length * b * per_turns * per_turns
    }
}
