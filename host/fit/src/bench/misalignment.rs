//! Muscle and load cell are not in one line: `F_add = −a F (L0/L)² − b s |F|`.
//!
//! An offset `e` of the ends tilts the muscle by `φ = e/L`: the cell sees `F cos φ`, so `a = (e/L0)²/2`; the side force `F sin φ` rubs in the
//! guide, `b = μ e/L0` (taken at the rest length), against the direction `s` in which the stroke last went. `F`, N, is the base model's force. One degree costs 0.015 % of gain but puts 1.7 % of
//! the force on the guide.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start,
    Traits, stroke_direction,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct Misalignment;

impl Effect for Misalignment {
    const INFO: Info = Info {
        name: "misalignment",
        link: Link::LoadPath,
        parameters: &[
            Parameter::amplitude("a", "gain_loss", "", 1.0e-5, 0.02),
            Parameter::amplitude("b", "side_friction", "", 2.0e-4, 0.05),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Branch,
        fading: &[],
        equation: "F = −a·F·(L0/L)² − b·s·|F|",
        summary: "The muscle pulls at an angle, which reduces the measured force and causes friction in the guide.",
        source: "statics of an inclined pull",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::DeadWeights)
        .check(BenchCheck::DeadWeights)
        .consistent(guide_rubs)
        .changed(Changed::new(Class::Friction, Owner::Rig, "muscle and cell out of line"));

    fn step<T: Scalar>(_parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: the direction of the stroke
        stroke_direction(context, memory, 0);
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let longer = context.rest_length / context.length.max(context.rest_length * T::from_f32(0.1));
        let pull = context.force();
        -(parameters[0] * longer * longer * pull) - parameters[1] * memory[0] * pull.abs()
    }
}

/// An offset `e` of the ends costs `a = (e/L0)²/2` of the pull and rubs with `b = μ e/L0`: no guide is as smooth as `μ = 0.1`.
fn guide_rubs(amplitudes: &[f64], _shapes: &[f64]) -> bool {
    !matches!(amplitudes, [loss, rub] if !(*rub >= 0.1 * (2.0 * loss.max(0.0)).sqrt()))
}
