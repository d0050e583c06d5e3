//! The control tick: TIM3 starts a scan of the five sensors each millisecond, a DMA stream takes it to memory, and the control loop's
//! interrupt comes when it is there. Nothing waits for a converter.
//!
//! ```text
//! TIM3   0 µs: update → ADC1 scans channels 0, 1, 8, 10, 11 (96 cycles of 22.5 MHz each: 21.3 µs) → DMA2 stream 0
//!       25 µs: compare → interrupt → one control step
//! ```

use core::cell::UnsafeCell;

use embassy_stm32::interrupt;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use firmware::tick::TICK_US;

use super::super::register::Register;
use super::clock::TIMER_CLOCK_MHZ;
use super::uart;

const AHB1ENR: Register = Register::at(0x4002_3830);
const APB1ENR: Register = Register::at(0x4002_3840);
const APB2ENR: Register = Register::at(0x4002_3844);
const GPIOA_MODER: Register = Register::at(0x4002_0000);
const GPIOB_MODER: Register = Register::at(0x4002_0400);
const GPIOC_MODER: Register = Register::at(0x4002_0800);
const GPIOC_IDR: Register = Register::at(0x4002_0810);
/// Pin of the enable input.
const ENABLE: u32 = 7;

const ADC1: usize = 0x4001_2000;
const ADC_SR: Register = Register::at(ADC1);
const ADC_CR1: Register = Register::at(ADC1 + 0x04);
const ADC_CR2: Register = Register::at(ADC1 + 0x08);
const ADC_SMPR1: Register = Register::at(ADC1 + 0x0C);
const ADC_SMPR2: Register = Register::at(ADC1 + 0x10);
const ADC_SQR1: Register = Register::at(ADC1 + 0x2C);
const ADC_SQR3: Register = Register::at(ADC1 + 0x34);
const ADC_DR: usize = ADC1 + 0x4C;
const ADC_CCR: Register = Register::at(ADC1 + 0x304);
/// A conversion found the one before not fetched.
const OVERRUN: u32 = 1 << 5;

const DMA2: usize = 0x4002_6400;
const LISR: Register = Register::at(DMA2);
const LIFCR: Register = Register::at(DMA2 + 0x08);
const S0CR: Register = Register::at(DMA2 + 0x10);
const S0NDTR: Register = Register::at(DMA2 + 0x14);
const S0PAR: Register = Register::at(DMA2 + 0x18);
const S0M0AR: Register = Register::at(DMA2 + 0x1C);
/// All flags of stream 0, and that it has moved a whole scan.
const FLAGS: u32 = 0b11_1101;
const WHOLE: u32 = 1 << 5;

const TIM3: usize = 0x4000_0400;
const TIM_CR1: Register = Register::at(TIM3);
const TIM_CR2: Register = Register::at(TIM3 + 0x04);
const TIM_DIER: Register = Register::at(TIM3 + 0x0C);
const TIM_SR: Register = Register::at(TIM3 + 0x10);
const TIM_EGR: Register = Register::at(TIM3 + 0x14);
const TIM_PSC: Register = Register::at(TIM3 + 0x28);
const TIM_ARR: Register = Register::at(TIM3 + 0x2C);
const TIM_CCR1: Register = Register::at(TIM3 + 0x34);
const COMPARED: u32 = 1 << 1;
/// From the scan's start to the control step, µs.
const SCAN_US: u32 = 25;

/// Sensors of a scan.
pub const SENSORS: usize = 5;

/// Where the stream puts a scan.
struct Scan(UnsafeCell<[u16; SENSORS]>);
// SAFETY: written by the DMA stream alone, and read by `take` between two scans.
unsafe impl Sync for Scan {}
static SCAN: Scan = Scan(UnsafeCell::new([0; SENSORS]));

/// The control loop's next tick.
pub static TICK: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Sets converter, stream and timer up; the timer's interrupt must still be disabled.
pub fn start() {
    AHB1ENR.set(0b111 | 1 << 22);
    APB1ENR.set(1 << 1);
    APB2ENR.set(1 << 8);
    // PA0, PA1, PB0, PC0 and PC1 are analogue; PC7 is an input as it is.
    GPIOA_MODER.set(0b1111);
    GPIOB_MODER.set(0b11);
    GPIOC_MODER.set(0b1111);
    // Clock: APB2 / 4. All channels sample for 84 cycles.
    ADC_CCR.write(0b01 << 16);
    ADC_SMPR1.write(0b100 | 0b100 << 3);
    ADC_SMPR2.write(0b100 | 0b100 << 3 | 0b100 << 24);
    ADC_SQR1.write((SENSORS as u32 - 1) << 20);
    ADC_SQR3.write(1 << 5 | 8 << 10 | 10 << 15 | 11 << 20);
    ADC_CR1.write(1 << 8);
    start_scans();
    TIM_PSC.write(TIMER_CLOCK_MHZ - 1);
    TIM_ARR.write(TICK_US as u32 - 1);
    TIM_CCR1.write(SCAN_US);
    // The update is the converter's trigger.
    TIM_CR2.write(0b010 << 4);
    TIM_EGR.write(1);
    TIM_SR.write(0);
    TIM_DIER.write(COMPARED);
    TIM_CR1.write(1);
}

/// Starts the stream and the converter from the first sensor on.
fn start_scans() {
    // Without its requests the converter is at its first channel.
    ADC_CR2.write(1);
    S0CR.write(0);
    while S0CR.read() & 1 != 0 {}
    LIFCR.write(FLAGS);
    ADC_SR.write(!OVERRUN);
    S0PAR.write(ADC_DR as u32);
    S0M0AR.write(SCAN.0.get() as u32);
    S0NDTR.write(SENSORS as u32);
    // Half words, memory counts up, round and round; channel 0.
    S0CR.write(0b01 << 13 | 0b01 << 11 | 1 << 10 | 1 << 8);
    S0CR.set(1);
    // On, DMA as long as there are scans, triggered by the rising edge of TIM3's update.
    ADC_CR2.write(0b01 << 28 | 8 << 24 | 1 << 9 | 1 << 8 | 1);
}

/// Whether the circuit of the enable input is closed.
pub fn enable_is_closed() -> bool {
    GPIOC_IDR.read() >> ENABLE & 1 != 0
}

/// The scan of this tick, if it is whole.
pub fn take() -> Option<[u16; SENSORS]> {
    if ADC_SR.read() & OVERRUN != 0 {
        start_scans();
        return None;
    }
    if LISR.read() & WHOLE == 0 {
        return None;
    }
    LIFCR.write(FLAGS);
    // SAFETY: the scan is over, and the next begins with the next tick.
    Some(unsafe { SCAN.0.get().read_volatile() })
}

#[interrupt]
unsafe fn TIM3() {
    TIM_SR.write(!COMPARED);
    uart::on_tick();
    TICK.signal(());
}
