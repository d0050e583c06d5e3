//! Weight in the load path: `F_add = −g_n (m + ρ ΔL)`, `g_n = 9.807 m/s²`.
//!
//! `m`, kg, is a dead weight that the load cell's zero did not take in; `ρ`, kg/m, a weight that comes to bear as the muscle shortens (a hose
//! or chain lifted). The constant is a force offset under another name: weigh it, or turn the bench by 90°.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start,
    Traits, Vented,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct Gravity;

impl Effect for Gravity {
    const INFO: Info = Info {
        name: "gravity",
        link: Link::LoadPath,
        parameters: &[
            Parameter::amplitude("m", "mass", "kg", -5.0, 5.0),
            Parameter::amplitude("ρ", "mass_per_length", "kg/m", -5.0, 5.0),
        ],
        depends_on_pressure: false,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = −g_n·(m + ρ·ΔL)",
        summary: "A part of the muscle force carries the weight of muscle and fittings.",
        source: "Newton; 0.5 to 5 N for a hanging muscle",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::Weighing)
        .check(BenchCheck::Weighing)
        .vented(Vented::Constant)
        .changed(Changed::new(Class::Zero, Owner::Rig, "weight in the load path"));

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        let g = T::from_f64(9.806_65);
        -g * (parameters[0] + parameters[1] * context.stroke)
    }
}
