//! The bladder softens with the strain it has been worked through:
//! `F_add = −(1 − s k_F) [b log10(1 + ℓ/ℓ_0) + b_∞ (1 − e^(−ℓ/ℓ_0))] F_el`.
//!
//! `ℓ` is the path that the strands have slid since the muscle was new, in rest lengths: a full cycle of 15 % contraction is 0.3, a small one
//! counts for less. `b` is the softening per tenfold of path beyond `ℓ_0`, `b_∞` the final one of a law that ends. The two are laws to choose
//! from. Unlike a warming bladder a worn one does not recover at rest. The logarithm is computed only where the path has grown by
//! a thousandth.

use super::{
    Context, Effect, Info, Link, Memory, Parameter, Start, decay,
    work::{PATH, WORK_SLOTS, work},
};
use crate::scalar::Scalar;

const LOGARITHM: usize = WORK_SLOTS;
const FOR_PATH: usize = WORK_SLOTS + 1;

/// See the [module](self).
pub(super) struct CyclicSoftening;

impl Effect for CyclicSoftening {
    // memory: see `work`, then log10(1 + ℓ/ℓ_0) and the path it belongs to
    const INFO: Info = Info {
        name: "cyclic-softening",
        link: Link::Bladder,
        parameters: &[
            Parameter::amplitude("loss_per_decade", "", 0.001, 0.1),
            Parameter::amplitude("final_loss", "", 0.003, 0.4),
            Parameter::shape("path", "", 0.1, 300.0),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: true,
        start: Start::Virgin,
        fading: &[],
        equation: "F = −(1 − s·k_F)·[b·log10(1 + ℓ/ℓ_0) + b_∞·(1 − exp(−ℓ/ℓ_0))]·F_el",
        summary: "Every cycle wears the bladder a little, so it resists less and less.",
        source: "B. Woods, M. Gentry, C. Kothera, N. Wereley, J. Intelligent Material Systems and Structures 23 (2012) 327–343: fatigue of swaged muscles",
    };

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        work(context, memory);
        let scale = parameters[2].max(T::from_f32(1.0e-3));
        let path = memory[PATH].max(T::ZERO);
        if (path - memory[FOR_PATH]).abs() > (scale + path) * T::from_f32(1.0e-3) {
            memory[FOR_PATH] = path;
            memory[LOGARITHM] = (path / scale).ln_1p() * T::from_f64(core::f64::consts::LOG10_E);
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let settled = T::ONE - decay(memory[PATH] / parameters[2].max(T::from_f32(1.0e-3)));
        -context.rubbed((parameters[0] * memory[LOGARITHM] + parameters[1] * settled) * context.elastic)
    }
}
