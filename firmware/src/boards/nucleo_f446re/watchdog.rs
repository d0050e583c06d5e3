//! The independent watchdog, fed by a control tick that has done its work and by nothing else.
//!
//! It counts its own oscillator of 32 kHz (17 to 47) divided by 64. While the flash erases, the processor does not move for up to two
//! seconds, so anyone who erases requests patience and waits until a tick has granted it.

use core::sync::atomic::{AtomicU32, Ordering};

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
/// How long a tick may take to grant the setpoint, µs: two ticks, and nothing where the loop does not move.
const GRANTED_US: u32 = 10_000;

/// Before the first tick everything has the long time: the store is opened then.
static WANTED: AtomicU32 = AtomicU32::new(LONG);
static GRANTED: AtomicU32 = AtomicU32::new(LONG);
static REQUESTED: AtomicU32 = AtomicU32::new(LONG);

/// Starts to watch.
pub fn start() {
    KR.write(START);
    KR.write(UNLOCK);
    PR.write(DIVIDED_BY_64);
    RLR.write(LONG);
    // Some periods of its oscillator until both are taken over; it runs, so this ends.
    while SR.read() & 0b11 != 0 {}
    KR.write(FEED);
}

/// From the first tick on only ticks keep it quiet.
pub fn be_short() {
    WANTED.store(SHORT, Ordering::Relaxed);
}

/// A control tick has done its work. Another time takes some periods of the slow oscillator to be taken over, so it is written in one
/// tick and in force from the next.
pub fn feed() {
    let wanted = WANTED.load(Ordering::Relaxed);
    if REQUESTED.swap(wanted, Ordering::Relaxed) == wanted {
        KR.write(FEED);
        GRANTED.store(wanted, Ordering::Relaxed);
    } else {
        KR.write(UNLOCK);
        RLR.write(wanted);
    }
}

/// Does what stops the processor for longer than the watchdog waits.
pub fn patiently<R>(act: impl FnOnce() -> R) -> R {
    let usual = WANTED.swap(LONG, Ordering::Relaxed);
    let asked = clock::micros();
    while GRANTED.load(Ordering::Relaxed) != LONG && clock::micros().wrapping_sub(asked) < GRANTED_US {}
    let done = act();
    WANTED.store(usual, Ordering::Relaxed);
    done
}
