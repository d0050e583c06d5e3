//! Critical sections that leave the most urgent interrupts alone.
//!
//! A section raises BASEPRI instead of closing all interrupts: what has a priority above [`LEVEL`] comes through even in the midst of a
//! control step, and must not touch anything that sections guard. That is the supply's interrupt, which only opens the valve.

use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::register::{basepri, basepri_max};
use critical_section::RawRestoreState;

/// Interrupts of this priority and below wait for the end of a section. The upper four bits count, and 0 is the most urgent.
pub const LEVEL: u8 = 0x20;

struct Basepri;
critical_section::set_impl!(Basepri);

// SAFETY: within a section no interrupt runs that enters one: all of those have priorities of `LEVEL` and below, which `priorities` in
// the board's file sets before the first is enabled.
unsafe impl critical_section::Impl for Basepri {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        basepri_max::write(LEVEL);
        compiler_fence(Ordering::SeqCst);
        before
    }

    unsafe fn release(before: RawRestoreState) {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: what was there when this section was entered; sections end in the reverse order.
        unsafe { basepri::write(before) };
    }
}
