//! The bladder softens with the strain it has been worked through:
//! `F_add = −(1 − s k_F) b d F_b`, `d = 1 − (1 + (m − 1) ℓ/ℓ_0)^(−1/(m − 1))`.
//!
//! `ℓ` is the path that the strands have slid since the muscle was new, in rest lengths: a full cycle of 15 % contraction is 0.3, a small one
//! counts for less. `F_b` is the bladder's part of the pull ([`Context::bladder`]). The damage `d` grows as what can still be damaged
//! allows, `ℓ_0 dd/dℓ = (1 − d)^m`: an exponential for an order `m` of one, and the larger the order, the nearer to a softening that is the
//! same for each tenfold of path. Unlike a warming bladder a worn one does not recover at rest. The damage is computed only where the
//! path has grown by a thousandth.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits, decay,
    work::{PATH, WORK_SLOTS, work},
};
use crate::scalar::Scalar;

const DAMAGE: usize = WORK_SLOTS;
const FOR_PATH: usize = WORK_SLOTS + 1;

/// See the [module](self).
pub(super) struct CyclicSoftening;

impl Effect for CyclicSoftening {
    // memory: see `work`, then the damage and the path it belongs to
    const INFO: Info = Info {
        name: "cyclic-softening",
        link: Link::Bladder,
        parameters: &[
            Parameter::amplitude("b", "loss", "", 0.003, 0.4),
            Parameter::shape("ℓ_0", "path", "", 0.1, 300.0),
            Parameter::shape("m", "order", "", 1.0, 10.0),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: false,
        start: Start::Virgin,
        fading: &[],
        equation: "F = −(1 − s·k_F)·b·d·F_b, ℓ_0·dd/dℓ = (1 − d)^m",
        summary: "Each cycle softens the bladder a little.",
        source: "B. Woods, M. Gentry, C. Kothera, N. Wereley, J. Intelligent Material Systems and Structures 23 (2012) 327–343: fatigue of swaged muscles",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::RepeatsAfterRest).slow().changed(
        Changed::new(Class::Softening, Owner::Muscle, "the bladder softens with cycles").remembering(),
    );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        work(context, memory);
        let scale = parameters[1].max(T::from_f32(1.0e-3));
        let path = memory[PATH].max(T::ZERO);
        if (path - memory[FOR_PATH]).abs() > (scale + path) * T::from_f32(1.0e-3) {
            memory[FOR_PATH] = path;
            // Below a hundredth the order is one to a few thousandths of the damage.
            let beyond = (parameters[2] - T::ONE).max(T::from_f32(0.01));
            memory[DAMAGE] = T::ONE - decay((path / scale * beyond).ln_1p() / beyond);
        }
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        -context.rubbed(parameters[0] * memory[DAMAGE] * context.bladder())
    }
}
