//! The bladder softens with the number of cycles: `F_add = −[b log10(1 + n) + b_∞ (1 − e^(−n/n_0))] F_el`.
//!
//! `n` counts cycles since the muscle was new; `b` is the softening per tenfold of cycles, `b_∞` the final one of a law that ends after about
//! `n_0` cycles. The two are laws to choose from. Unlike a warming bladder a worn one does not recover at rest. The logarithm is
//! computed only where `n` changes.

use super::{Context, Effect, Info, Link, Memory, Parameter, Start, count_cycles, decay};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct CyclicSoftening;

impl Effect for CyclicSoftening {
    const INFO: Info = Info {
        name: "cyclic-softening",
        link: Link::Bladder,
        parameters: &[
            Parameter::amplitude("loss_per_decade", "", 0.001, 0.1),
            Parameter::amplitude("final_loss", "", 0.003, 0.4),
            Parameter::shape("cycles_to_settle", "", 0.5, 300.0),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: true,
        start: Start::Virgin,
        fading: &[],
        equation: "F = −[b·log10(1 + n) + b_∞·(1 − exp(−n/n_0))]·F_el",
        summary: "Every cycle wears the bladder a little, so it resists less and less.",
        source: "B. Woods, M. Gentry, C. Kothera, N. Wereley, J. Intelligent Material Systems and Structures 23 (2012): fatigue of swaged muscles",
    };

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [cycles worked, cycles at the last reading, seen, log10(1 + n), the n it belongs to]
        count_cycles(context, memory);
        if memory[4] != memory[0] {
            memory[4] = memory[0];
            memory[3] = memory[0].ln_1p() * T::from_f64(core::f64::consts::LOG10_E);
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let settled = T::ONE - decay(memory[0] / parameters[2].max(T::from_f32(1.0e-3)));
        -(parameters[0] * memory[3] + parameters[1] * settled) * context.elastic
    }
}
