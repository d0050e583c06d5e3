//! Play between the stroke sensor and the muscle: after a reversal the sensor moves and the muscle does not.
//!
//! ```text
//! F_add = κ · [∂F_quasi/∂x · (1 − k_F s_y) · (y − x) + k_F F_quasi (s − s_y)]        y = play_{b/2}(x)
//! ```
//! `b`, m, is the width of the play, `y` its output: it is constant until the stroke has gone back by `b`. `κ` (dimensionless) is 1 for a joint
//! that is free over all of `b`, less if it is tight at times. A preloaded joint has none. The side on which the play begins is
//! unknown until the first turn. While the joint is
//! loose the muscle rests, and its friction keeps the direction `s_y` of its own last motion; once it is drawn along again, that turns
//! over a travel of `η b`, as the joint does not bear all at once and the braid gives a little before it slides. What fills or empties
//! the muscle between two recordings turns its friction, too.

use model_core::effects::{
    BenchCheck, Changed, Class, Context, Effect, Experiment, Info, Link, Memory, Owner, Parameter, Start,
    Traits, decay,
};
use model_core::scalar::Scalar;

/// A pressure that changes by more than this part from one reading to the next was changed between two recordings.
const REFILLED: f64 = 0.05;

/// See the [module](self).
pub(super) struct Backlash;

impl Effect for Backlash {
    const INFO: Info = Info {
        name: "backlash",
        link: Link::LoadPath,
        parameters: &[
            Parameter::amplitude("κ", "free_part", "", 0.1, 1.2),
            Parameter::shape("b", "width", "m", 5.0e-6, 2.0e-3),
            Parameter::shape("η", "softness", "", 0.02, 0.5),
        ],
        depends_on_pressure: true,
        persistent: false,
        alternatives: false,
        start: Start::Branch,
        fading: &[],
        equation: "F = κ·[∂F_quasi/∂x·(1 − k_F·s_y)·(y − x) + k_F·F_quasi·(s − s_y)], y = play of x, b wide, ds_y = (s − s_y)·|dy|/(η·b)",
        summary: "A joint has play: after every reversal the sensor moves before the muscle does.",
        source: "play operator; sensitivity of the base model",
    };

    const TRAITS: Traits = Traits::shown_by(Experiment::RigidBar)
        .delays_reversals()
        .made_from_base()
        .check(BenchCheck::RigidBar)
        .consistent(no_looser_than_free)
        .changed(Changed::new(Class::Alone(Self::INFO.name), Owner::Rig, "a loose joint").remembering());

    fn step<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &mut Memory<T>) {
        // memory: [play(x) − x, last stroke, seen, direction of the muscle behind the play, last direction, last pressure]
        let half = (parameters[1] * T::from_f32(0.5)).max(T::ZERO);
        let moved = if memory[2] == T::ZERO { T::ZERO } else { context.stroke - memory[1] };
        let behind = memory[0] - moved;
        memory[0] = behind.clamp(-half, half);
        if behind != memory[0] {
            let drawn = if memory[0] < T::ZERO { T::ONE } else { -T::ONE };
            let over = (parameters[2] * parameters[1]).max(T::from_f32(1.0e-9));
            memory[3] = drawn + (memory[3] - drawn) * decay((behind - memory[0]) / over);
        } else if memory[3] == T::ZERO {
            memory[3] = context.direction;
        } else if context.speed == T::ZERO && memory[2] != T::ZERO {
            // What turns friction at held length is pressure, which the muscle feels behind a loose joint as well.
            memory[3] = (memory[3] + context.direction - memory[4]).clamp(-T::ONE, T::ONE);
        }
        let (before, now) = (memory[5], context.pressure);
        let refilled = (now - before).abs() > T::from_f64(REFILLED) * before.max(now);
        if refilled && memory[2] != T::ZERO {
            memory[3] = if now > before { T::ONE } else { -T::ONE };
        }
        memory[1] = context.stroke;
        memory[2] = T::ONE;
        memory[4] = context.direction;
        memory[5] = context.pressure;
    }

    fn force<T: Scalar>(parameters: &[T], context: &Context<T>, memory: &Memory<T>) -> T {
        let known = memory[3] != T::ZERO && context.direction != T::ZERO;
        let late = if known { context.direction - memory[3] } else { T::ZERO };
        // What the muscle's place changes rubs as the muscle last moved, not as the sensor does.
        let slope = context.slope() + context.stiffness * context.friction * late;
        parameters[0] * (slope * memory[0] + context.friction * context.quasi * late)
    }
}

/// No joint is looser than free: `κ` is 1 at most, and 1.3 with its error.
fn no_looser_than_free(amplitudes: &[f64], _shapes: &[f64]) -> bool {
    !matches!(amplitudes, [free] if !(*free <= 1.3))
}
