//! The frame gives under load: the muscle is shorter than the stroke says by `F/K`.
//!
//! ```text
//! F_add = (1/K) · [∂F/∂x · F/(1 − c ∂F/∂x) + k_F F_quasi (s − z)/c]        dz = dx/(c k_F F_quasi), within ±1
//! ```
//! `x` is the contraction stroke, `∂F/∂x` negative, `F` the base model's force, N; `1/K`, m/N. The frame gives by the force that is left
//! once it has given, hence the denominator. At a reversal the friction has to change by `2 k_F F` before the strands slide back; a frame
//! that gives takes that change as travel, so that the jump becomes a ramp: `c`, m/N, is the give by which it does, the same `1/K` where
//! nothing else gives. A stretching braid looks the same in free tables except at the reversals: measure with a rigid bar in the muscle's
//! place.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, ForceShape, Info, Inspect, Link, Memory, Owner,
    Parameter, Start, Traits,
};
use model_core::scalar::Scalar;

/// See the [module](self).
pub(super) struct RigCompliance;

impl Effect for RigCompliance {
    const INFO: Info = Info {
        name: "rig-compliance",
        link: Link::LoadPath,
        parameters: &[
            Parameter::amplitude("1/K", "compliance", "m/N", 1.0e-8, 2.0e-4),
            Parameter::shape("c", "compliance_at_turns", "m/N", 1.0e-8, 2.0e-4),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Branch,
        fading: &[],
        equation: "F = (1/K)·[∂F/∂x·F/(1 − c·∂F/∂x) + k_F·F_quasi·(s − z)/c], dz = dx/(c·k_F·F_quasi) within ±1",
        summary: "The test frame bends, so the muscle is shorter than the stroke sensor shows.",
        source: "first-order sensitivity of the base model; frames of 0.5 to 50 N/µm",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::RigidBar)
        .stroke_follows_force()
        .made_from_base()
        .check(BenchCheck::RigidBar)
        .consistent(gives_alike)
        .changed(
            Changed::new(Class::Gain, Owner::Rig, "ΔF = c·F·∂F/∂x")
                .sized("compliance", "m/N")
                // Not correctable: the law has a part at reversals that this shape does not measure.
                .adds(ForceShape::ForceTimesStrokeSlope)
                .inspect(Inspect::Frame),
        );

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [z, last stroke, seen]
        let moved = if memory[2] == T::ZERO { T::ZERO } else { context.stroke - memory[1] };
        if memory[2] == T::ZERO {
            memory[0] = context.direction;
        }
        if context.speed == T::ZERO {
            // At rest the strands' friction is not the turn's.
            memory[1] = context.stroke;
            memory[2] = T::ONE;
            return;
        }
        let needed = give(parameters) * (context.friction * context.quasi).abs();
        memory[0] = (memory[0] + moved / needed.max(T::from_f32(1.0e-9))).clamp(-T::ONE, T::ONE);
        memory[1] = context.stroke;
        memory[2] = T::ONE;
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let turning = if context.speed == T::ZERO { T::ZERO } else { context.direction - memory[0] };
        let late = context.friction * context.quasi * turning / give(parameters);
        let given = context.force() / (T::ONE - give(parameters) * context.slope()).max(T::ONE);
        parameters[0] * (context.slope() * given + late)
    }
}

/// `c`, guarded against a table's zero.
fn give<T: Scalar>(parameters: &[T]) -> T {
    parameters[1].max(T::from_f32(1.0e-10))
}

/// The compliance under load is the compliance at the reversals; half-strokes that overlap leave a factor of 2.5 between them.
fn gives_alike(amplitudes: &[f64], shapes: &[f64]) -> bool {
    !matches!((amplitudes, shapes), ([under_load], [at_turns]) if !(*under_load <= 2.5 * at_turns))
}
