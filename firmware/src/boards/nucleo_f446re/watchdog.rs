//! The independent watchdog, fed by a control tick that has done its work and by nothing else.
//!
//! It counts its own oscillator of 32 kHz (17 to 47) divided by 64. While the flash erases, the processor does not move for up to two
//! seconds, so anyone who erases requests patience and waits until a tick has granted it.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::super::register::Register;
use super::clock;

const KR: Register = Register::at(0x4000_3000);
const PR: Register = Register::at(0x4000_3004);
const RLR: Register = Register::at(0x4000_3008);
const SR: Register = Register::at(0x4000_300C);
const START: u32 = 0xCCCC;
const UNLOCK: u32 = 0x5555;
const FEED: u32 = 0xAAAA;
const DIVIDED_BY_64: u32 = 4;

/// 20 ms at 32 kHz, 14 to 38 over what the oscillator may be off.
const SHORT: u32 = 10;
/// 8.2 s at 32 kHz, at least 5.5: two erasures.
const LONG: u32 = 4095;
/// A reload value is being taken over (RVU): up to five periods of the divided oscillator, 10 ms at 32 kHz and 19 at 17. Another one that is
/// written meanwhile is ignored.
const TAKING_OVER: u32 = 1 << 1;
/// How long a tick may take to grant the setpoint, µs: two values that are taken over one after another, and some ticks.
const GRANTED_US: u32 = 45_000;
/// No time: none is known to be in force.
const NONE: u32 = 0;

/// Before the first tick everything has the long time: the store is opened then.
static USUAL: AtomicU32 = AtomicU32::new(LONG);
static PATIENT: AtomicBool = AtomicBool::new(false);
static GRANTED: AtomicU32 = AtomicU32::new(LONG);
static REQUESTED: AtomicU32 = AtomicU32::new(LONG);

/// Starts to watch.
pub fn start() {
    KR.write(START);
    KR.write(UNLOCK);
    PR.write(DIVIDED_BY_64);
    RLR.write(LONG);
    // Some periods of its divided oscillator until both are taken over; it runs, so this ends.
    while SR.read() & 0b11 != 0 {}
    KR.write(FEED);
}

/// From the first tick on only ticks keep it quiet.
pub fn be_short() {
    USUAL.store(SHORT, Ordering::Relaxed);
}

/// A control tick has done its work. Another time is written once the one before has been taken over, and granted in the tick that finds it
/// taken over and has fed the counter with it.
pub fn feed() {
    let wanted = if PATIENT.load(Ordering::Relaxed) { LONG } else { USUAL.load(Ordering::Relaxed) };
    let settled = SR.read() & TAKING_OVER == 0;
    KR.write(FEED);
    if !settled {
        return;
    }
    if REQUESTED.load(Ordering::Relaxed) == wanted {
        GRANTED.store(wanted, Ordering::Relaxed);
        return;
    }
    GRANTED.store(NONE, Ordering::Relaxed);
    REQUESTED.store(wanted, Ordering::Relaxed);
    KR.write(UNLOCK);
    RLR.write(wanted);
}

/// Does what stops the processor for longer than the watchdog waits; nothing where the long time is not granted, because the loop does not
/// move.
pub fn patiently<R>(act: impl FnOnce() -> R) -> Option<R> {
    PATIENT.store(true, Ordering::Relaxed);
    let asked = clock::micros();
    let granted = || GRANTED.load(Ordering::Relaxed) == LONG;
    while !granted() && clock::micros().wrapping_sub(asked) < GRANTED_US {}
    let done = granted().then(act);
    PATIENT.store(false, Ordering::Relaxed);
    done
}
