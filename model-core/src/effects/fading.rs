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
//! At 1 kHz and `τ` of minutes `1 − a` is so small that single precision would absorb it. Steps shorter than a fiftieth of the
//! shortest `τ` therefore take in the drive's change immediately and let the fading pend until a fiftieth is full; a change that
//! comes in late is scaled up by what it must not fade. Both use the exponential's series, which at `dt/τ < 0.04` is exact to
//! 10⁻⁶: a controller with a steady tick never computes an exponential.

use super::{MEMORY, Memory};
use crate::scalar::Scalar;

/// `N` time constants for each of `D` drives, kept in an effect's memory.
///
/// Layout: seen, pending time, step that the shares hold for, `N` shares `1 − a`, `D` last drives, `N × D` over-stresses, `D` sums
/// of the rest of them. The sums are taken once a step, so that a search for pressure reads them at no cost.
pub struct Fading<const N: usize, const D: usize>;

const SEEN: usize = 0;
const PENDING: usize = 1;
const SHARES_FOR: usize = 2;
const SHARES: usize = 3;

/// The shortest time constant that is stepped, s; guards against a table's zero.
const SHORTEST: f32 = 1.0e-4;

/// `1 − e^(−x)` for `0 ≤ x < 0.04`, to 10⁻⁷.
#[inline]
fn small_share<T: Scalar>(x: T) -> T {
    x - x * x * (T::from_f32(0.5) - x * T::from_f64(1.0 / 6.0))
}

impl<const N: usize, const D: usize> Fading<N, D> {
    const LAST: usize = SHARES + N;
    const FIRST: usize = SHARES + N + D;
    const SUMS: usize = SHARES + N + D + N * D;
    const FITS: () = assert!(Self::SUMS + D <= MEMORY);

    /// How many slots of a memory it uses, from the first.
    pub const SLOTS: usize = Self::SUMS + D;

    /// Where the over-stress of drive `drive` and time constant `branch` is kept.
    pub const fn slot(drive: usize, branch: usize) -> usize {
        Self::FIRST + branch * D + drive
    }

    const SIZE: Size = Size { branches: N, drives: D };

    /// Lets `dt ≥ 0` seconds pass, while the drives ran straight to `drives`. `times` are in seconds, the shortest first.
    ///
    /// The first call only takes note of the drives: they are assumed to have been there for long.
    #[inline(always)]
    pub fn step<T: Scalar>(memory: &mut Memory<T>, dt: T, times: &[T; N], drives: &[T; D]) {
        let () = Self::FITS;
        let first = Self::is_new(memory);
        let dt = dt.at_least(T::ZERO);
        let full = times[0].at_least(T::from_f32(SHORTEST)) * T::from_f32(0.02);
        if first || !(dt < full) {
            Self::SIZE.step_long(memory, dt, times, drives);
            return;
        }
        Self::step_short(memory, dt, times, drives);
        if !(memory[PENDING] < full) {
            Self::SIZE.settle(memory, times);
            Self::SIZE.sum(memory);
        }
    }

    /// A step after which the fading still pends: the drives' change is taken in immediately.
    #[inline(always)]
    fn step_short<T: Scalar>(memory: &mut Memory<T>, dt: T, times: &[T; N], drives: &[T; D]) {
        let middle = memory[PENDING] + dt * T::from_f32(0.5);
        let pending = memory[PENDING] + dt;
        memory[PENDING] = pending;
        let mut changes = *drives;
        for (d, change) in changes.iter_mut().enumerate() {
            *change -= memory[Self::LAST + d];
            memory[Self::LAST + d] = drives[d];
        }
        let mut sums = [T::ZERO; D];
        for (branch, tau) in memory[Self::FIRST..Self::SUMS].chunks_exact_mut(D).zip(times) {
            let rate = T::ONE / tau.at_least(T::from_f32(SHORTEST));
            let x = middle * rate;
            let late = T::ONE + x + x * x * T::from_f32(0.5);
            let kept = T::ONE - small_share(pending * rate);
            for ((q, change), sum) in branch.iter_mut().zip(&changes).zip(&mut sums) {
                *q += *change * late;
                *sum += *q * kept;
            }
        }
        memory[Self::SUMS..Self::SLOTS].copy_from_slice(&sums);
    }

    /// Whether nothing has been remembered yet.
    #[inline(always)]
    pub fn is_new<T: Scalar>(memory: &Memory<T>) -> bool {
        memory[SEEN] == T::ZERO
    }

    /// The sum over the time constants of one drive's over-stresses, with the drive now at `now`.
    #[inline(always)]
    pub fn value<T: Scalar>(memory: &Memory<T>, drive: usize, now: T) -> T {
        if Self::is_new(memory) {
            return T::ZERO;
        }
        memory[Self::SUMS + drive] + T::from_f32(N as f32) * (now - memory[Self::LAST + drive])
    }
}

/// How many time constants and drives there are: for the steps that come once in a while, which are the same code for all.
#[derive(Clone, Copy)]
struct Size {
    branches: usize,
    drives: usize,
}

impl Size {
    /// The over-stresses, branch by branch, and behind them the sums of each drive.
    fn stresses<T>(self, memory: &mut Memory<T>) -> (&mut [T], &mut [T]) {
        let (_, behind) = memory.split_at_mut(SHARES + self.branches + self.drives);
        behind.split_at_mut(self.branches * self.drives)
    }

    /// The first step, and any that is not short beside the time constants.
    #[inline(never)]
    fn step_long<T: Scalar>(self, memory: &mut Memory<T>, dt: T, times: &[T], drives: &[T]) {
        let last = SHARES + self.branches;
        if memory[SEEN] == T::ZERO {
            memory[SEEN] = T::ONE;
            memory[last..last + self.drives].copy_from_slice(drives);
            self.sum(memory);
            return;
        }
        self.settle(memory, times);
        let shortest = T::from_f32(SHORTEST);
        if memory[SHARES_FOR] != dt {
            // An endless pause is not worth remembering, and would not be a finite number.
            memory[SHARES_FOR] = if dt.is_finite() { dt } else { T::ZERO };
            for (share, tau) in memory[SHARES..].iter_mut().zip(times) {
                *share = -(-(dt / tau.at_least(shortest))).exp_m1();
            }
        }
        for (d, drive) in drives.iter().enumerate() {
            let change = *drive - memory[last + d];
            memory[last + d] = *drive;
            for (i, tau) in times.iter().enumerate() {
                let share = memory[SHARES + i];
                let q = &mut memory[last + self.drives + i * self.drives + d];
                *q = *q - *q * share + change * (share * (tau.at_least(shortest) / dt));
            }
        }
        self.sum(memory);
    }

    /// Fades by the time that has been pending.
    #[inline(never)]
    fn settle<T: Scalar>(self, memory: &mut Memory<T>, times: &[T]) {
        let pending = core::mem::replace(&mut memory[PENDING], T::ZERO);
        if pending == T::ZERO {
            return;
        }
        let (stresses, _) = self.stresses(memory);
        for (branch, tau) in stresses.chunks_exact_mut(self.drives).zip(times) {
            let share = small_share(pending / tau.at_least(T::from_f32(SHORTEST)));
            for q in branch {
                *q = *q - *q * share;
            }
        }
    }

    /// Sums where nothing pends, so that all of every over-stress is left.
    #[inline(never)]
    fn sum<T: Scalar>(self, memory: &mut Memory<T>) {
        let (stresses, sums) = self.stresses(memory);
        let sums = &mut sums[..self.drives];
        sums.fill(T::ZERO);
        for branch in stresses.chunks_exact(self.drives) {
            for (sum, q) in sums.iter_mut().zip(branch) {
                *sum += *q;
            }
        }
    }
}

/// `e^(−x)` for `x ≥ 0` to within 3·10⁻⁴, always falling, without a call into a library: the fourth power of a reciprocal
/// polynomial. Laws of friction are not known to that precision.
#[inline]
pub fn decay<T: Scalar>(x: T) -> T {
    let y = x.abs() * T::from_f32(0.25);
    let horner = |inner: T, c: f64| inner * y + T::from_f64(c);
    let p = horner(horner(horner(horner(T::from_f64(1.0 / 24.0), 1.0 / 6.0), 0.5), 1.0), 1.0);
    let squared = p * p;
    T::ONE / (squared * squared)
}
