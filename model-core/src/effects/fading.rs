//! Memories that fade exponentially: the one integrator behind relaxation, creep, lags and filters.
//!
//! For each drive `u` and time constant `τ` an over-stress `q` obeys
//!
//! ```text
//! dq/dt = du/dt − q/τ          (high-pass of the drive; u − q is its low-pass)
//! ```
//! The step is exact for a drive that runs straight between two readings, whatever their distance:
//! `q ← q − q (1−a) + Δu (1−a) τ/dt`, `1 − a = 1 − e^(−dt/τ)`.
//!
//! At 1 kHz and `τ` of minutes `1 − a` is so small that single precision would swallow it. The memory therefore lets time
//! pend until a fiftieth of the shortest `τ` has gone by, and only then steps; in between the value is extrapolated to first
//! order (error below 2·10⁻⁴ of `q`). The exponential is computed anew only where the pending time changes: on a controller
//! with a steady tick, never.

use super::{MEMORY, Memory};
use crate::scalar::Scalar;

/// `N` time constants for each of `D` drives, kept in an effect's memory.
///
/// Layout: seen, pending time, step that the shares hold for, `N` shares `1 − a`, `D` last drives, `D × N` over-stresses.
pub struct Fading<const N: usize, const D: usize>;

const SEEN: usize = 0;
const PENDING: usize = 1;
const SHARES_FOR: usize = 2;
const SHARES: usize = 3;

/// The shortest time constant that is stepped, s; guards against a table's zero.
const SHORTEST: f32 = 1.0e-4;

impl<const N: usize, const D: usize> Fading<N, D> {
    const LAST: usize = SHARES + N;
    const FIRST: usize = SHARES + N + D;
    const FITS: () = assert!(SHARES + N + D + N * D <= MEMORY);

    /// Where the over-stress of drive `drive` and time constant `branch` is kept.
    pub const fn slot(drive: usize, branch: usize) -> usize {
        Self::FIRST + drive * N + branch
    }

    /// Lets `dt ≥ 0` seconds pass, while the drives ran straight to `drives`. `times` are in seconds, the shortest first.
    ///
    /// The first call only takes note of the drives: they are assumed to have been there for long.
    pub fn step<T: Scalar>(memory: &mut Memory<T>, dt: T, times: &[T; N], drives: &[T; D]) {
        let () = Self::FITS;
        if memory[SEEN] == T::ZERO {
            memory[SEEN] = T::ONE;
            memory[Self::LAST..Self::FIRST].copy_from_slice(drives);
            return;
        }
        let shortest = T::from_f32(SHORTEST);
        let pending = memory[PENDING] + dt.max(T::ZERO);
        if !(pending >= times[0].max(shortest) * T::from_f32(0.02)) {
            memory[PENDING] = pending;
            return;
        }
        memory[PENDING] = T::ZERO;
        if memory[SHARES_FOR] != pending {
            // An endless pause is not worth remembering, and would not be a finite number.
            memory[SHARES_FOR] = if pending.is_finite() { pending } else { T::ZERO };
            for (share, tau) in memory[SHARES..].iter_mut().zip(times) {
                *share = -(-(pending / tau.max(shortest))).exp_m1();
            }
        }
        let per_pending = T::ONE / pending;
        for (d, drive) in drives.iter().enumerate() {
            let change = *drive - memory[Self::LAST + d];
            memory[Self::LAST + d] = *drive;
            for (i, tau) in times.iter().enumerate() {
                let share = memory[SHARES + i];
                let q = &mut memory[Self::slot(d, i)];
                *q = *q - *q * share + change * share * tau.max(shortest) * per_pending;
            }
        }
    }

    /// The sum over the time constants of one drive's over-stresses, with the drive now at `now`.
    #[inline]
    pub fn value<T: Scalar>(memory: &Memory<T>, times: &[T; N], drive: usize, now: T) -> T {
        let change = if memory[SEEN] == T::ZERO { T::ZERO } else { now - memory[Self::LAST + drive] };
        let mut sum = T::ZERO;
        for (i, tau) in times.iter().enumerate() {
            let q = memory[Self::slot(drive, i)];
            sum += q - q * memory[PENDING] / tau.max(T::from_f32(SHORTEST)) + change;
        }
        sum
    }
}

/// `e^(−x)` for `x ≥ 0` to within 3·10⁻⁴, always falling, without a call into a library: the fourth power of a reciprocal
/// polynomial. Laws of friction are not known to that precision.
#[inline]
pub fn decay<T: Scalar>(x: T) -> T {
    let y = x.abs() * T::from_f32(0.25);
    let horner = |inner: T, c: f32| inner * y + T::from_f32(c);
    let p = horner(horner(horner(horner(T::from_f32(1.0 / 24.0), 1.0 / 6.0), 0.5), 1.0), 1.0);
    let squared = p * p;
    T::ONE / (squared * squared)
}
