//! What acts on the muscle: the regulator's analogue command and the dump valve.

use super::super::register::Register;

const AHB1ENR: Register = Register::at(0x4002_3830);
const APB1ENR: Register = Register::at(0x4002_3840);
const GPIOA_MODER: Register = Register::at(0x4002_0000);
const GPIOB_MODER: Register = Register::at(0x4002_0400);
const GPIOB_BSRR: Register = Register::at(0x4002_0418);
const DAC_CR: Register = Register::at(0x4000_7400);
const DAC_DHR12R1: Register = Register::at(0x4000_7408);

const GPIOA_BSRR: Register = Register::at(0x4002_0018);
/// The converter's highest code.
const FULL_CODE: f32 = 4095.0;

const VALVE: u32 = 5;
const LIGHT: u32 = 5;

/// Makes both outputs safe: before any clock is set up, with nothing but the processor's own oscillator running.
pub fn start() {
    AHB1ENR.set(0b11);
    APB1ENR.set(1 << 29);
    dump();
    // PB5 is an output, PA4 analogue.
    GPIOB_MODER.write(GPIOB_MODER.read() & !(0b11 << (2 * VALVE)) | 0b01 << (2 * VALVE));
    GPIOA_MODER.set(0b11 << (2 * 4));
    // The light is an output.
    GPIOA_MODER.write(GPIOA_MODER.read() & !(0b11 << (2 * LIGHT)) | 0b01 << (2 * LIGHT));
    // Converter 1 on, without its output buffer (BOFF1): through that it does not come below 0.2 V, which would be 60 kPa.
    DAC_CR.write(1 << 1 | 1 << 0);
}

/// Switches the status light.
pub fn light(on: bool) {
    GPIOA_BSRR.write(if on { 1 << LIGHT } else { 1 << (16 + LIGHT) });
}

/// Opens the dump valve and asks the regulator for no pressure, which would continue filling against it, whatever state the program is in.
pub fn dump() {
    GPIOB_BSRR.write(1 << (16 + VALVE));
    DAC_DHR12R1.write(0);
}

/// Commands a part of the output's range, and the valve open or closed.
pub fn command(level: f32, open: bool) {
    // A number that is none becomes 0.
    let code = (level * FULL_CODE).clamp(0.0, FULL_CODE) as u32;
    DAC_DHR12R1.write(code);
    GPIOB_BSRR.write(if open { 1 << (16 + VALVE) } else { 1 << VALVE });
}
