//! The first stretch of rubber is stiffer than all later ones up to the same strain (Ogden and Roxburgh's pseudo-elasticity).
//!
//! ```text
//! F_add = −(1 − s k_F) a · erf[(W_m − W)/(m + β W_m)] · F_b        W = λ_x² + λ_z² + 1/(λ_x λ_z)² − 3,  λ = 1 + ε
//! ```
//! `F_b` is the bladder's part of the pull ([`Context::bladder`]), `a = 1/r` its largest loss; `W` the neo-Hookean strain energy in units of
//! half the shear modulus, `W_m` the largest so far, `m` and `β` how soon the softening sets in. On a first stretch (`W = W_m`) nothing is
//! added; on the way back and on every later stroke below `W_m` the bladder resists less. Return to a lower strain softens no further. The
//! memory must outlive a power cycle, and a muscle worked before the recording has a `W_m` no one recorded. Rest heals little of it, and
//! this law nothing.
//! The error function is Abramowitz and Stegun's 7.1.27, within 5·10⁻⁴.

use super::{
    Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start, Traits,
};
use crate::scalar::Scalar;

/// See the [module](self).
pub(super) struct MullinsSoftening;

impl Effect for MullinsSoftening {
    const INFO: Info = Info {
        name: "mullins-softening",
        link: Link::Bladder,
        parameters: &[
            Parameter::amplitude("a", "largest_loss", "", 0.01, 0.7),
            Parameter::shape("m", "onset", "", 1.0e-3, 1.0),
            Parameter::shape("β", "onset_growth", "", 0.0, 1.0),
        ],
        depends_on_pressure: true,
        persistent: true,
        alternatives: false,
        start: Start::Virgin,
        fading: &[],
        equation: "F = −(1 − s·k_F)·a·erf[(W_m − W)/(m + β·W_m)]·F_b",
        summary: "The first stroke into new strain breaks bonds in the rubber; all later strokes meet less resistance.",
        source: "R. W. Ogden and D. G. Roxburgh, Proc. R. Soc. A 455 (1999) 2861–2877, doi 10.1098/rspa.1999.0431",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::FirstStrokes).changed(
        Changed::new(Class::Alone(Self::INFO.name), Owner::Muscle, "the first stretch softens the bladder")
            .remembering(),
    );

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [W_m]
        memory[0] = memory[0].max(energy(context));
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let most = memory[0];
        let below = (most - energy(context)).max(T::ZERO);
        let width = (parameters[1] + parameters[2] * most).max(T::from_f32(1.0e-6));
        -context.rubbed(parameters[0] * rising(below / width) * context.bladder())
    }
}

/// `W`, bounded so that a stroke far outside the model does not become the muscle's memory without end.
fn energy<T: Scalar>(context: &Context<T>) -> T {
    let low = T::from_f32(0.2);
    let x = (T::ONE + context.radial_strain).clamp(low, T::from_f32(8.0));
    let z = (T::ONE + context.axial_strain).clamp(low, T::from_f32(8.0));
    let (x, z) = (x * x, z * z);
    (x + z + T::ONE / (x * z) - T::from_f32(3.0)).max(T::ZERO)
}

/// `erf(x)` for `x ≥ 0`: `1 − 1/(1 + a_1 x + a_2 x² + a_3 x³ + a_4 x⁴)⁴`.
fn rising<T: Scalar>(x: T) -> T {
    let a = [0.078_108, 0.000_972, 0.230_389, 0.278_393, 1.0].map(T::from_f32);
    let mut sum = T::ZERO;
    for c in a {
        sum = sum * x + c;
    }
    let squared = sum * sum;
    T::ONE - T::ONE / (squared * squared)
}
