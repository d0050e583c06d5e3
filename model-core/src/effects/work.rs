//! What a muscle has been put through since it was new: the measure of wear and set.

use super::{BraidTravel, Context, Memory};
use crate::scalar::Scalar;

/// The path that the strands have slid, in rest lengths.
pub(super) const PATH: usize = 0;
/// `∫|F_quasi| dt`, N·s.
pub(super) const IMPULSE: usize = 1;
const TRAVEL: usize = 2;
const PENDING_PATH: usize = TRAVEL + BraidTravel::SLOTS;
const PENDING_IMPULSE: usize = PENDING_PATH + 1;
/// How many slots of a memory [`work`] uses, from the first.
pub(super) const WORK_SLOTS: usize = PENDING_IMPULSE + 1;

/// Adds what happened since the last reading, over all recordings and power cycles.
///
/// Travel counts along the direction of motion: a noisy stroke at rest adds nothing on average, and the first reading after a
/// power-up, when the direction is unknown, nothing at all.
pub(super) fn work<T: Scalar>(context: &Context<T>, memory: &mut Memory<T>) {
    let travel = BraidTravel::step(context, memory, TRAVEL);
    // A tick's travel is too small for single precision to add to a life's: it is collected by the
    // thousandth of a length, and the impulse by ten newton-seconds.
    memory[PENDING_PATH] += context.direction * travel / context.rest_length.max(T::from_f32(1.0e-6));
    let pending = memory[PENDING_PATH];
    if pending.abs() > T::from_f32(1.0e-3) {
        memory[PATH] = (memory[PATH] + pending).max(T::ZERO);
        memory[PENDING_PATH] = T::ZERO;
    }
    // Over a pause no one read the force; a slack muscle's is small.
    memory[PENDING_IMPULSE] += context.quasi.abs() * context.dt.clamp(T::ZERO, T::from_f32(10.0));
    if memory[PENDING_IMPULSE] > T::from_f32(10.0) {
        memory[IMPULSE] += memory[PENDING_IMPULSE];
        memory[PENDING_IMPULSE] = T::ZERO;
    }
}
