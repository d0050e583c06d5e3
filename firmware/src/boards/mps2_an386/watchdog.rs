//! The CMSDK watchdog: a control loop that stops restarts the board, and the board knows why it started.
//!
//! The watchdog counts 25 MHz down. At zero it raises the non-maskable interrupt, whose handler leaves a note and restarts;
//! if even that hangs, the second zero restarts the board itself. The note is a word at the end of RAM, above the stack
//! (see `memory.x`), which neither the start-up code nor the emulator's loader touches.

use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use model_core::link::messages::StartedBy;

use super::super::register::Register;

const LOAD: Register = Register::at(0x4000_8000);
const CONTROL: Register = Register::at(0x4000_8008);
const CLEAR: Register = Register::at(0x4000_800C);
const LOCK: Register = Register::at(0x4000_8C00);
const KEY: u32 = 0x1ACC_E551;
/// Interrupt and restart.
const ON: u32 = 0b11;
const CLOCK_HZ: u32 = 25_000_000;

/// How long the control loop may do not move, s: longer than it waits for a bench that is gone.
const PATIENCE_S: u32 = 5;

/// Where the note is left.
const NOTE: Register = Register::at(0x203F_FFF0);
/// "The watchdog" and "someone asked", as words that do not arise by chance.
const BY_WATCHDOG: u32 = 0x7A3C_5D01;
const BY_REQUEST: u32 = 0x7A3C_5D02;

/// Why the board started; the note is taken away.
pub fn started_by() -> StartedBy {
    let note = NOTE.read();
    NOTE.write(0);
    match note {
        BY_WATCHDOG => StartedBy::Watchdog,
        BY_REQUEST => StartedBy::Request,
        _ => StartedBy::Power,
    }
}

/// Starts to watch.
pub fn start() {
    LOCK.write(KEY);
    LOAD.write(PATIENCE_S * CLOCK_HZ);
    CONTROL.write(ON);
}

/// The control loop is alive.
pub fn feed() {
    CLEAR.write(1);
}

fn restart(note: u32) -> ! {
    NOTE.write(note);
    SCB::sys_reset()
}

/// Restarts because someone asked.
pub fn restart_on_request() -> ! {
    restart(BY_REQUEST)
}

#[exception]
unsafe fn NonMaskableInt() -> ! {
    restart(BY_WATCHDOG)
}
