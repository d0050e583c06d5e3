//! The frame gives under load: the muscle is shorter than the stroke says by `F/K`.
//!
//! ```text
//! F_add = ∂F/∂x · F · (1/K)
//! ```
//! `x` is the contraction stroke, `∂F/∂x` negative, `F` the base model's force, N; `1/K`, m/N. First order: while `|∂F/∂x|/K` is well below
//! one. A stretching braid looks the same in free tables: measure with a rigid bar in the muscle's place.

use model_core::effects::{Context, Effect, Info, Link, Memory, Parameter, Start};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct RigCompliance;

impl Effect for RigCompliance {
    const INFO: Info = Info {
        name: "rig-compliance",
        link: Link::LoadPath,
        parameters: &[Parameter::amplitude("compliance", "m/N", 1.0e-8, 2.0e-4)],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Known,
        fading: &[],
        equation: "F = ∂F/∂x·F/K",
        summary: "The test frame bends, so the muscle is a little shorter than the stroke sensor says.",
        source: "first-order sensitivity of the base model; frames of 0.5 to 50 N/µm",
    };

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, _memory: &Memory<T>) -> T {
        context.stiffness * context.force() * parameters[0]
    }
}
