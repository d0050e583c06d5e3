//! How far the braid's strands have slid over one another: what friction with a memory of travel is driven by.

use super::{Context, Memory};
use crate::scalar::Scalar;

/// Follows the strands from reading to reading in two slots of a memory and a flag.
///
/// While the muscle moves they slide with the stroke. While its length is held and the pressure changes, they creep the way
/// the pressure drives them, as far as the muscle would have moved had it been free to: `Δξ = Δx + ΔP (∂F/∂P)/|∂F/∂x|`. Where the
/// muscle moves because its pressure changes both parts have the same sign, and a memory of travel only forgets sooner.
pub struct BraidTravel;

impl BraidTravel {
    /// The slots it uses, from `at`: last stroke, last pressure, seen.
    pub const SLOTS: usize = 3;

    /// The travel since the last call, m, positive while shortening or filling; zero on the first.
    #[inline]
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
        let per_pascal = (context.pressure_slope / context.stiffness.abs()).clamp(T::ZERO, limit);
        moved + filled * per_pascal
    }
}
