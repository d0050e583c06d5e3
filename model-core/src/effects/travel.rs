//! How far the braid's strands have slid over one another: what friction with a memory of travel is driven by.

use super::{Context, Memory};
use crate::scalar::Scalar;

/// Follows the strands from reading to reading in two slots of a memory and a flag.
///
/// While the muscle moves they slide with the stroke. While its length is held and the pressure changes, they creep the way
/// the pressure drives them, by a small part of what the muscle would have moved had it been free to:
/// `Δξ = Δx + σ ΔP g/|∂F/∂x|`, `σ = 1/20`. How large that part is no one has measured; it has to be small, or the ripple of a regulator
/// would stir the strands of a moving muscle, and not zero, as pressure alone turns the friction of isometric recordings round.
pub struct BraidTravel;

/// `σ`: the part of the free motion that strands slip at held length.
const SLIP: f64 = 0.05;

impl BraidTravel {
    /// The slots it uses, from `at`: last stroke, last pressure, seen.
    pub const SLOTS: usize = 3;

    /// The travel since the last call, m, positive while shortening or filling; zero on the first.
    #[inline(never)]
    pub fn step<T: Scalar>(context: &Context<T>, memory: &mut Memory<T>, at: usize) -> T {
        let seen = memory[at + 2] != T::ZERO;
        let moved = context.stroke - memory[at];
        let filled = context.pressure - memory[at + 1];
        memory[at] = context.stroke;
        memory[at + 1] = context.pressure;
        memory[at + 2] = T::ONE;
        if !seen {
            return T::ZERO;
        }
        // Where the stiffness vanishes the free stroke would be endless; a muscle does not move by more than its length
        // for one atmosphere.
        let limit = context.rest_length * T::from_f32(1.0e-5);
        let per_pascal = (context.area / context.stiffness.abs()).clamp(T::ZERO, limit) * T::from_f64(SLIP);
        moved + filled * per_pascal
    }
}

/// Which way the stroke last went, in three slots of a memory from `at`: +1 shortening, −1 lengthening, 0 unknown; the stroke; seen.
///
/// A guide or a seal at held length does not slide when the pressure changes, as the strands of the braid do: the direction that
/// [`Context::direction`] takes from filling and emptying is not theirs. A muscle that rests elsewhere than where it was last seen
/// went there on the straight way.
#[inline(never)]
pub fn stroke_direction<T: Scalar>(context: &Context<T>, memory: &mut Memory<T>, at: usize) {
    let seen = memory[at + 2] != T::ZERO;
    let moved = context.stroke - memory[at + 1];
    memory[at + 1] = context.stroke;
    memory[at + 2] = T::ONE;
    // Slower than a ten-thousandth of its length in a second the muscle rests.
    let little = context.rest_length * T::from_f32(1.0e-4);
    if context.resting == T::ZERO && context.speed.abs() > little {
        if context.direction != T::ZERO {
            memory[at] = context.direction;
        }
    } else if seen && moved.abs() > little * T::from_f32(10.0) {
        memory[at] = if moved > T::ZERO { T::ONE } else { -T::ONE };
    }
}
