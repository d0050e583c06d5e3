//! The boot loader of the Nucleo-F446RE: starts the newer of two programs that is whole, and the one before if the newer has been
//! started three times and no host has confirmed it. The decision is that of [`firmware_image`], which a host's tests try.
//!
//! It runs on the processor's own oscillator and sets up no pin: until the program runs, the resistors to ground keep the valve open
//! and the command at zero. For a program of 110 KiB the check takes about 0.1 s.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m_rt::{entry, exception};
use model_core::firmware_image::{Choice, PROGRAM, choose, found, try_at};
use model_core::link::hello::Board;

/// Address and length of both slots, as in `firmware/src/boards/nucleo_f446re/slots.rs`.
const SLOTS: [u32; 2] = [0x0801_0000, 0x0804_0000];
const LENGTH: usize = 192 * 1024;

const KEYR: *mut u32 = 0x4002_3C04 as *mut u32;
const SR: *mut u32 = 0x4002_3C0C as *mut u32;
const CR: *mut u32 = 0x4002_3C10 as *mut u32;
const BUSY: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// Programming, 32 bits at a time.
const PROGRAMS: u32 = 0b10 << 8 | 1;

fn bytes(slot: usize) -> &'static [u8] {
    // SAFETY: flash of this chip, which is mapped and only changed by `mark`, when no slice is in use.
    unsafe { core::slice::from_raw_parts(SLOTS[slot] as *const u8, LENGTH) }
}

/// Programs the word of a try with zero. A flash that refuses leaves it erased, and the try is not counted.
fn mark(slot: usize, number: usize) {
    let word = (SLOTS[slot] + try_at(number)) as *mut u32;
    // SAFETY: the flash's registers and a word of state, both mapped and aligned.
    unsafe {
        KEYR.write_volatile(0x4567_0123);
        KEYR.write_volatile(0xCDEF_89AB);
        CR.write_volatile(PROGRAMS);
        word.write_volatile(0);
        while SR.read_volatile() & BUSY != 0 {}
        CR.write_volatile(LOCK);
    }
}

const IWDG_KR: *mut u32 = 0x4000_3000 as *mut u32;
const IWDG_PR: *mut u32 = 0x4000_3004 as *mut u32;
const IWDG_RLR: *mut u32 = 0x4000_3008 as *mut u32;

/// Starts the independent watchdog: 8.2 s at 32 kHz, the time in which a program opens its store.
fn watch() {
    // SAFETY: the watchdog's registers.
    unsafe {
        IWDG_KR.write_volatile(0xCCCC);
        IWDG_KR.write_volatile(0x5555);
        IWDG_PR.write_volatile(4);
        IWDG_RLR.write_volatile(4095);
    }
}

#[entry]
fn main() -> ! {
    let slots = [0, 1].map(|slot| found(bytes(slot), Board::NucleoF446re as u8, slot as u8, SLOTS[slot]));
    if let Choice::Start { slot, mark: number } = choose(&slots) {
        if let Some(number) = number {
            mark(slot, number);
            // A program on trial may hang before it starts the watchdog itself.
            watch();
        }
        let program = SLOTS[slot] + PROGRAM;
        // SAFETY: a vector table of a whole program; nothing of this program is used after this.
        unsafe {
            (*cortex_m::peripheral::SCB::PTR).vtor.write(program);
            cortex_m::asm::bootload(program as *const u32)
        }
    }
    stop()
}

/// Nothing to start: the pins stay open, the muscle vented.
fn stop() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    stop()
}

#[exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    stop()
}
