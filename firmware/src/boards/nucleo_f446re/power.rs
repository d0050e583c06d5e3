//! Supply and clocks: why the chip started, whether the supply sags, and what happens when the crystal fails.

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, interrupt};
use model_core::link::messages::StartedBy;

use super::super::register::Register;
use super::outputs::dump;

const RCC_CR: Register = Register::at(0x4002_3800);
const RCC_CIR: Register = Register::at(0x4002_380C);
const RCC_APB1ENR: Register = Register::at(0x4002_3840);
const RCC_CSR: Register = Register::at(0x4002_3874);
const PWR_CR: Register = Register::at(0x4000_7000);
const PWR_CSR: Register = Register::at(0x4000_7004);
const EXTI_IMR: Register = Register::at(0x4001_3C00);
const EXTI_RTSR: Register = Register::at(0x4001_3C08);
const EXTI_PR: Register = Register::at(0x4001_3C14);
const FLASH_ACR: Register = Register::at(0x4002_3C00);

const HSE_ON: u32 = 1 << 16;
const HSE_READY: u32 = 1 << 17;
const HSE_BYPASSED: u32 = 1 << 18;
const CLOCK_SECURITY: u32 = 1 << 19;
/// Looks at the crystal before it counts as dead: at 16 MHz some tenths of a second, and the debug probe's clock is there within
/// milliseconds.
const LOOKS: u32 = 400_000;
/// Line of the supply's detector among the external interrupts.
const SUPPLY_LINE: u32 = 1 << 16;

/// A word that a restart leaves as it is.
#[unsafe(link_section = ".uninit.NOTE")]
static mut NOTE: MaybeUninit<u32> = MaybeUninit::uninit();
/// "The clock has failed", as a word that does not arise by chance.
const CLOCK_FAILED: u32 = 0x7A3C_5D03;

fn note() -> *mut u32 {
    (&raw mut NOTE).cast()
}

/// Reads the reset flags and clears them.
pub fn started_by() -> StartedBy {
    let flags = RCC_CSR.read();
    RCC_CSR.write(flags | 1 << 24);
    if flags & (1 << 29 | 1 << 30) != 0 {
        StartedBy::Watchdog
    } else if flags & (1 << 27) != 0 {
        StartedBy::Power
    } else if flags & (1 << 25) != 0 {
        StartedBy::BrownOut
    } else {
        StartedBy::Request
    }
}

/// Whether a failing clock restarted the board; the note is taken away.
pub fn clock_had_failed() -> bool {
    // SAFETY: a word of its own, read and written before anything else runs.
    unsafe {
        let found = note().read_volatile();
        note().write_volatile(0);
        found == CLOCK_FAILED
    }
}

/// Starts the crystal, the 8 MHz that the debug probe gives; whether it runs.
pub fn start_crystal() -> bool {
    // The bypass can only be chosen while the oscillator is off.
    RCC_CR.set(HSE_BYPASSED);
    RCC_CR.set(HSE_ON);
    for _ in 0..LOOKS {
        if RCC_CR.read() & HSE_READY != 0 {
            return true;
        }
    }
    RCC_CR.write(RCC_CR.read() & !HSE_ON);
    RCC_CR.write(RCC_CR.read() & !HSE_BYPASSED);
    false
}

/// 180 MHz, from the crystal or from the processor's own oscillator of 16 MHz and 1 %, which the link still takes.
pub fn clocks(crystal: bool) -> Config {
    let mut all = Config::default();
    let config = &mut all.rcc;
    let (source, prediv) = if crystal {
        config.hse = Some(Hse { freq: Hertz::mhz(8), mode: HseMode::Bypass });
        (PllSource::HSE, PllPreDiv::DIV4)
    } else {
        (PllSource::HSI, PllPreDiv::DIV8)
    };
    config.pll_src = source;
    // 2 MHz · 180 / 2.
    config.pll = Some(Pll { prediv, mul: PllMul::MUL180, divp: Some(PllPDiv::DIV2), divq: None, divr: None });
    config.sys = Sysclk::PLL1_P;
    config.ahb_pre = AHBPrescaler::DIV1;
    config.apb1_pre = APBPrescaler::DIV4;
    config.apb2_pre = APBPrescaler::DIV2;
    all
}

/// Switches the flash's prefetch and both of its caches on: at 180 MHz an instruction is five cycles away without.
pub fn start_caches() {
    FLASH_ACR.set(1 << 8 | 1 << 9 | 1 << 10);
}

/// Forgets what the caches hold of flash that has been written or erased.
pub fn flush_caches() {
    let on = FLASH_ACR.read();
    let off = on & !(1 << 9 | 1 << 10);
    FLASH_ACR.write(off);
    FLASH_ACR.write(off | 1 << 11 | 1 << 12);
    FLASH_ACR.write(off);
    FLASH_ACR.write(on);
}

/// Watches the crystal: when it fails, the processor continues with its own oscillator and raises the non-maskable interrupt.
pub fn watch_crystal() {
    RCC_CR.set(CLOCK_SECURITY);
}

/// Watches the supply at 2.8 V (PVDE, PLS = 6), and has its interrupt come when it falls below.
pub fn watch_supply() {
    RCC_APB1ENR.set(1 << 28);
    PWR_CR.write(PWR_CR.read() & !(0b111 << 5) | 6 << 5 | 1 << 4);
    // The detector's output rises as the supply falls.
    EXTI_RTSR.set(SUPPLY_LINE);
    EXTI_PR.write(SUPPLY_LINE);
    EXTI_IMR.set(SUPPLY_LINE);
}

static SAGGED: AtomicBool = AtomicBool::new(false);

/// Whether the supply is below now, or has been since this was last asked.
pub fn supply_is_low() -> bool {
    SAGGED.swap(false, Ordering::Relaxed) || is_below()
}

/// Whether the supply is below now, or has been since the last tick: what a step commands that began before must not close the valve again.
pub fn sags() -> bool {
    SAGGED.load(Ordering::Relaxed) || is_below()
}

/// The output of the detector (PVDO).
fn is_below() -> bool {
    PWR_CSR.read() & 1 << 2 != 0
}

/// Above every critical section: it opens the valve and leaves the rest to the next tick.
#[interrupt]
unsafe fn PVD() {
    dump();
    EXTI_PR.write(SUPPLY_LINE);
    SAGGED.store(true, Ordering::Relaxed);
}

#[exception]
unsafe fn NonMaskableInt() -> ! {
    dump();
    // CSSC: the interrupt would come again and again.
    RCC_CIR.set(1 << 23);
    // SAFETY: nothing else runs any more.
    unsafe { note().write_volatile(CLOCK_FAILED) };
    SCB::sys_reset()
}
