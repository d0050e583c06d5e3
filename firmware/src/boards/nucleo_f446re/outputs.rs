//! What acts on the muscle: the regulator's analogue command or a pair of valves, and the dump valve.
//!
//! The valves are outputs of TIM4, which counts microseconds and stops at the end of a period (one-pulse mode). A pulse lies at the end of
//! its period, so that a stopped counter, which is zero, closes the valve: if the program stops, nothing fills behind the period. The fill
//! valve opens at a high level, the vent valve at a low one, as a chip without power or in a reset gives it: fill closed, vent open.

use firmware::valves::Valves;

use super::super::register::Register;
use super::clock::TIMER_CLOCK_MHZ;

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

const GPIOB_AFRH: Register = Register::at(0x4002_0424);

const TIM4: usize = 0x4000_0800;
const TIM_CR1: Register = Register::at(TIM4);
const TIM_EGR: Register = Register::at(TIM4 + 0x14);
const TIM_CCMR2: Register = Register::at(TIM4 + 0x1C);
const TIM_CCER: Register = Register::at(TIM4 + 0x20);
const TIM_PSC: Register = Register::at(TIM4 + 0x28);
const TIM_ARR: Register = Register::at(TIM4 + 0x2C);
const TIM_CCR3: Register = Register::at(TIM4 + 0x3C);
const TIM_CCR4: Register = Register::at(TIM4 + 0x40);
/// Pins of the fill and the vent valve, channels 3 and 4.
const FILL: u32 = 8;
const VENT: u32 = 9;
/// Counts once, and whether it counts.
const ONE_PULSE: u32 = 1 << 3;
const COUNTS: u32 = 1;
/// Outputs on; that of channel 4 is active when it is low (CC4P).
const OUTPUTS: u32 = 1 << 13 | 1 << 12 | 1 << 8;
/// Modes of the outputs, channel 4 above channel 3: both inactive, only the vent valve active, both active from their compare on (PWM mode 2).
const BOTH_CLOSED: u32 = 0b100 << 12 | 0b100 << 4;
const VENT_OPEN: u32 = 0b101 << 12 | 0b100 << 4;
const PULSES: u32 = 0b111 << 12 | 0b111 << 4;

const VALVE: u32 = 5;
const LIGHT: u32 = 5;

/// Makes both outputs safe: before any clock is set up, with only the processor's own oscillator running.
pub fn start() {
    AHB1ENR.set(0b11);
    // The converter and the valves' timer.
    APB1ENR.set(1 << 29 | 1 << 2);
    dump();
    // PB5 is an output, PA4 analogue.
    GPIOB_MODER.write(GPIOB_MODER.read() & !(0b11 << (2 * VALVE)) | 0b01 << (2 * VALVE));
    GPIOA_MODER.set(0b11 << (2 * 4));
    // The light is an output.
    GPIOA_MODER.write(GPIOA_MODER.read() & !(0b11 << (2 * LIGHT)) | 0b01 << (2 * LIGHT));
    start_valves();
    // Converter 1 on, without its output buffer (BOFF1): through that it does not come below 0.2 V, which would be 60 kPa.
    DAC_CR.write(1 << 1 | 1 << 0);
}

/// The fill valve closed, the vent valve open; their timer stands.
fn start_valves() {
    TIM_CCMR2.write(VENT_OPEN);
    TIM_CCER.write(OUTPUTS);
    let second = |pin: u32| 2 << (4 * (pin - 8));
    let both = 0b1111 << (4 * (FILL - 8)) | 0b1111 << (4 * (VENT - 8));
    GPIOB_AFRH.write(GPIOB_AFRH.read() & !both | second(FILL) | second(VENT));
    let mode = |pin: u32, mode: u32| mode << (2 * pin);
    let pins = mode(FILL, 0b11) | mode(VENT, 0b11);
    GPIOB_MODER.write(GPIOB_MODER.read() & !pins | mode(FILL, 0b10) | mode(VENT, 0b10));
}

/// What the valves do in a tick.
pub fn valves(valves: Valves) {
    match valves {
        Valves::Continue => {}
        Valves::Closed => TIM_CCMR2.write(BOTH_CLOSED),
        Valves::Absent | Valves::Vent => TIM_CCMR2.write(VENT_OPEN),
        Valves::Period { fill_us, vent_us, length_us } => {
            let length = u32::from(length_us);
            TIM_CR1.write(ONE_PULSE);
            TIM_PSC.write(TIMER_CLOCK_MHZ - 1);
            TIM_ARR.write(length - 1);
            // Loads the prescaler, and begins at zero.
            TIM_EGR.write(1);
            // From 1 on: a stopped counter, which is zero, is before every pulse.
            TIM_CCR3.write((length - u32::from(fill_us)).max(1));
            TIM_CCR4.write((length - u32::from(vent_us)).max(1));
            TIM_CCMR2.write(PULSES);
            TIM_CR1.write(ONE_PULSE | COUNTS);
        }
    }
}

/// Switches the status light.
pub fn light(on: bool) {
    GPIOA_BSRR.write(if on { 1 << LIGHT } else { 1 << (16 + LIGHT) });
}

/// Opens the dump valve and the vent valve, closes the fill valve and asks the regulator for no pressure, which would continue filling
/// against them, whatever state the program is in.
pub fn dump() {
    GPIOB_BSRR.write(1 << (16 + VALVE));
    DAC_DHR12R1.write(0);
    TIM_CCMR2.write(VENT_OPEN);
}

/// Commands a part of the output's range, and the valve open or closed.
pub fn command(level: f32, open: bool) {
    // A number that is none becomes 0.
    let code = (level * FULL_CODE).clamp(0.0, FULL_CODE) as u32;
    DAC_DHR12R1.write(code);
    GPIOB_BSRR.write(if open { 1 << (16 + VALVE) } else { 1 << VALVE });
}
