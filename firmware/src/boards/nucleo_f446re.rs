//! ST Nucleo-F446RE: Cortex-M4 with floating point at 180 MHz, one muscle.
//!
//! | pin | Arduino name | what |
//! | --- | --- | --- |
//! | PA2, PA3 | – | link: USART2 over the debug probe's USB port, 1 Mbaud |
//! | PA0 | A0 | pressure sensor, see [`PRESSURE`] |
//! | PA1 | A1 | stroke sensor, see [`STROKE`] |
//! | PB0 | A3 | load cell amplifier, see [`LOAD`] |
//! | PA4 | A2 | analogue command (DAC 1) to the regulator's 0–10 V stage, see [`COMMAND`] |
//! | PB5 | D4 | dump valve: low opens it, so that a board without power vents |
//!
//! The control loop runs on an interrupt of its own above everything else, at 1 kHz, and feeds the watchdog; if it stops for
//! [`WATCHDOG_US`], the chip restarts, vented, with the fault latched. The store is the last two flash sectors of 128 KiB.
//! Erasing one stops the processor for up to two seconds, which is why the store is only written while nothing is
//! controlled; the watchdog is longer than that.

use core::panic::PanicInfo;

use cortex_m_rt::{entry, exception};
use embassy_executor::{Executor, InterruptExecutor, Spawner};
use embassy_stm32::adc::{Adc, AdcChannel, AnyAdcChannel, SampleTime};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::flash::{Blocking as BlockingFlash, Flash};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{ADC1, IWDG, USART2};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart, BufferedUartRx, BufferedUartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, Instant, Ticker, Timer};
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use firmware::board::{Identity, Inputs, Outputs, Plant, Readings};
use firmware::modes::Seat;
use firmware::server::Server;
use firmware::shared::Shared;
use firmware::tasks;
use firmware::tick::TICK_US;
use model_core::link::hello::Board;
use model_core::link::messages::StartedBy;
use model_core::link::settings::Settings;
use static_cell::StaticCell;

bind_interrupts!(struct Interrupts {
    USART2 => usart::BufferedInterruptHandler<USART2>;
});

/// A straight line between the converter's voltage and a quantity.
struct Line {
    /// Quantity at 0 V.
    at_zero: f32,
    /// Quantity per volt at the pin.
    per_volt: f32,
}

impl Line {
    fn value(&self, volts: f32) -> f32 {
        self.at_zero + self.per_volt * volts
    }
}

/// Gauge pressure: 0–10 bar as 0.5–4.5 V behind a divider of 2/3.
const PRESSURE: Line = Line { at_zero: -125e3, per_volt: 375e3 };
/// Stroke: a potentiometer of 50 mm over 0–3.3 V.
const STROKE: Line = Line { at_zero: 0.0, per_volt: 0.050 / 3.3 };
/// Force: ±1 kN as 1.65 V ± 1.5 V.
const LOAD: Line = Line { at_zero: -1100.0, per_volt: 1000.0 / 1.5 };
/// Command: 0–3.3 V of the converter become 0–10 V and 0–10 bar.
const COMMAND: Line = Line { at_zero: 0.0, per_volt: 1e6 / 3.3 };
/// Supply of the converters, V.
const REFERENCE: f32 = 3.3;
const FULL_SCALE: f32 = 4095.0;

/// Longer than the erasure of a flash sector.
const WATCHDOG_US: u32 = 4_000_000;

/// What waits to go out: a line of 1 Mbaud takes 100 bytes a millisecond, so the task that sends has 2.5 ms to bring more before the
/// line rests. Nothing keeps it longer while something is controlled: the control step above it takes hundredths of a millisecond, and
/// the flash, which stops the processor, is only written at rest. A longest answer holds up telemetry for
/// [`MAX_WIRE`](model_core::link::frame::MAX_WIRE) bytes, 5.2 ms; samples then wait in a queue of 11 ms
/// (`firmware/src/shared.rs`). So 1 kHz of two muscles, less than 100 bytes a tick, would fit too.
const SENDING: usize = 256;
/// What has come and is not read: all that the line can bring in the 5 ms in which a longest answer goes out and nobody reads.
const RECEIVED: usize = 512;

type Port = Mutex<CriticalSectionRawMutex, BufferedUartTx<'static>>;

/// The last two sectors.
const STORE_AT: u32 = 256 * 1024;
const SECTOR: usize = 128 * 1024;

struct StoreFlash(Flash<'static, BlockingFlash>);

#[derive(Clone, Copy, Debug)]
struct StoreError(NorFlashErrorKind);

impl NorFlashError for StoreError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl From<embassy_stm32::flash::Error> for StoreError {
    fn from(error: embassy_stm32::flash::Error) -> Self {
        Self(match error {
            embassy_stm32::flash::Error::Size => NorFlashErrorKind::OutOfBounds,
            embassy_stm32::flash::Error::Unaligned => NorFlashErrorKind::NotAligned,
            _ => NorFlashErrorKind::Other,
        })
    }
}

impl ErrorType for StoreFlash {
    type Error = StoreError;
}

impl ReadNorFlash for StoreFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StoreError> {
        Ok(self.0.blocking_read(STORE_AT + offset, bytes)?)
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for StoreFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), StoreError> {
        Ok(self.0.blocking_erase(STORE_AT + from, STORE_AT + to)?)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), StoreError> {
        Ok(self.0.blocking_write(STORE_AT + offset, bytes)?)
    }
}

/// Registers that the library does not reach: why the chip started, and whether the supply sags.
mod supply {
    use model_core::link::messages::StartedBy;

    const RCC_CSR: *mut u32 = 0x4002_3874 as *mut u32;
    const RCC_APB1ENR: *mut u32 = 0x4002_3840 as *mut u32;
    const PWR_CR: *mut u32 = 0x4000_7000 as *mut u32;
    const PWR_CSR: *const u32 = 0x4000_7004 as *const u32;

    /// Reads the reset flags and clears them.
    pub fn started_by() -> StartedBy {
        // SAFETY: RCC_CSR is always mapped; RMVF (bit 24) clears the flags and nothing else.
        let flags = unsafe {
            let flags = RCC_CSR.read_volatile();
            RCC_CSR.write_volatile(flags | 1 << 24);
            flags
        };
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

    /// Watches the supply at 2.8 V.
    pub fn watch() {
        // SAFETY: bit 28 clocks the power controller; PVDE and PLS = 6 switch its detector on. Both registers are always
        // mapped, and nothing else changes them after the clocks are set up.
        unsafe {
            RCC_APB1ENR.write_volatile(RCC_APB1ENR.read_volatile() | 1 << 28);
            let control = PWR_CR.read_volatile() & !(0b111 << 5);
            PWR_CR.write_volatile(control | 6 << 5 | 1 << 4);
        }
    }

    /// Whether it is below now.
    pub fn is_low() -> bool {
        // SAFETY: a register that is only read.
        unsafe { PWR_CSR.read_volatile() & 1 << 2 != 0 }
    }
}

/// Opens the dump valve and asks the regulator for no pressure, which would go on filling against it, whatever state the program is in.
fn dump() {
    const GPIOB_BSRR: *mut u32 = 0x4002_0418 as *mut u32;
    const DAC_DHR12R1: *mut u32 = 0x4000_7408 as *mut u32;
    // SAFETY: a write-only register, whose bit 21 sets PB5 low and nothing else, and the code of the converter on PA4.
    unsafe {
        GPIOB_BSRR.write_volatile(1 << (16 + 5));
        DAC_DHR12R1.write_volatile(0);
    }
}

/// Converters, valve and clock of the control loop.
struct Sensors {
    adc: Adc<'static, ADC1>,
    pressure: AnyAdcChannel<'static, ADC1>,
    stroke: AnyAdcChannel<'static, ADC1>,
    load: AnyAdcChannel<'static, ADC1>,
    command: DacChannel<'static, Blocking>,
    valve: Output<'static>,
    watchdog: IndependentWatchdog<'static, IWDG>,
    ticker: Ticker,
    due: Instant,
    began: Instant,
}

impl Sensors {
    fn read(&mut self) -> Readings {
        let mut volts = [0.0; 3];
        for (volt, channel) in volts.iter_mut().zip([&mut self.pressure, &mut self.stroke, &mut self.load]) {
            let code = self.adc.blocking_read(channel, SampleTime::CYCLES84);
            *volt = f32::from(code) * (REFERENCE / FULL_SCALE);
        }
        Readings {
            pressure_pa: PRESSURE.value(volts[0]),
            stroke_m: STROKE.value(volts[1]),
            force_n: LOAD.value(volts[2]),
        }
    }
}

impl Plant for Sensors {
    async fn exchange(&mut self, outputs: &Outputs) -> Inputs {
        let command = outputs.sides[0];
        let pressure = if command.vent { 0.0 } else { command.pressure_pa };
        let code = ((pressure - COMMAND.at_zero) / COMMAND.per_volt * (FULL_SCALE / REFERENCE))
            .clamp(0.0, FULL_SCALE);
        self.command.set(Value::Bit12Right(code as u16));
        self.valve.set_level(if command.vent { Level::Low } else { Level::High });
        self.watchdog.pet();
        // In words: no tick is an hour late, and nothing here divides 64 bits.
        let step_us = self.began.elapsed().as_micros() as u32 as f32;
        self.ticker.next().await;
        self.began = Instant::now();
        let late = self.began.saturating_duration_since(self.due).as_micros() as u32 / TICK_US as u32;
        self.due += Duration::from_micros(TICK_US * u64::from(1 + late));
        Inputs {
            sides: [Some(self.read()), None],
            missed_ticks: late.min(u32::from(u16::MAX)) as u16,
            supply_low: supply::is_low(),
            step_us,
        }
    }
}

#[embassy_executor::task]
async fn control(mut sensors: Sensors, shared: &'static Shared) {
    sensors.watchdog.unleash();
    sensors.ticker.reset();
    sensors.due = Instant::now() + Duration::from_micros(TICK_US);
    tasks::control(&mut sensors, shared).await
}

#[embassy_executor::task]
async fn telemetry(port: &'static Port, shared: &'static Shared) {
    tasks::telemetry(port, shared).await;
}

#[embassy_executor::task]
async fn link(
    mut receiver: BufferedUartRx<'static>,
    port: &'static Port,
    shared: &'static Shared,
    server: &'static mut Server<StoreFlash>,
) {
    loop {
        // A receiver that was overrun by noise says so and goes on.
        tasks::link(&mut receiver, port, server, shared).await;
        if server.wants_restart() {
            Timer::after_millis(20).await;
            dump();
            cortex_m::peripheral::SCB::sys_reset();
        }
    }
}

static CONTROL: InterruptExecutor = InterruptExecutor::new();

// SAFETY: the interrupt of a peripheral that this board does not use, lent to the executor.
#[embassy_stm32::interrupt]
unsafe fn UART5() {
    // SAFETY: called from the interrupt that the executor was started on.
    unsafe { CONTROL.on_interrupt() }
}

fn clocks() -> Config {
    use embassy_stm32::rcc::{
        AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
    };
    let mut config = Config::default();
    // The debug probe gives 8 MHz: 8 / 4 · 180 / 2 = 180 MHz.
    config.rcc.hse = Some(Hse { freq: Hertz::mhz(8), mode: HseMode::Bypass });
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL180,
        divp: Some(PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

#[inline(never)]
fn spawn(spawner: Spawner, started_by: StartedBy) -> Option<()> {
    static PORT: StaticCell<Port> = StaticCell::new();
    static OUT: StaticCell<[u8; SENDING]> = StaticCell::new();
    static IN: StaticCell<[u8; RECEIVED]> = StaticCell::new();
    let p = embassy_stm32::init(clocks());
    supply::watch();
    // Low from the first moment: vented.
    let valve = Output::new(p.PB5, Level::Low, Speed::Low);
    let mut line = usart::Config::default();
    line.baudrate = 1_000_000;
    let (sending, received) = (OUT.init([0; SENDING]), IN.init([0; RECEIVED]));
    let uart = BufferedUart::new(p.USART2, p.PA3, p.PA2, sending, received, Interrupts, line).ok()?;
    let (sender, receiver) = uart.split();
    let shared = Shared::take(&Settings::default(), Seat::single());
    let port: &'static Port = PORT.init_with(|| Mutex::new(sender));
    let identity =
        Identity { board: Board::NucleoF446re, muscles: 1, serial: embassy_stm32::uid::uid(), started_by };
    // In a place of its own: a task would keep it twice, as its argument and as its variable.
    static SERVER: StaticCell<Server<StoreFlash>> = StaticCell::new();
    let server = SERVER.init(Server::start(identity, StoreFlash(Flash::new_blocking(p.FLASH)), shared).ok()?);
    let sensors = Sensors {
        adc: Adc::new(p.ADC1),
        pressure: p.PA0.degrade_adc(),
        stroke: p.PA1.degrade_adc(),
        load: p.PB0.degrade_adc(),
        command: DacChannel::new_blocking(p.DAC1, p.PA4),
        valve,
        watchdog: IndependentWatchdog::new(p.IWDG, WATCHDOG_US),
        ticker: Ticker::every(Duration::from_micros(TICK_US)),
        due: Instant::now(),
        began: Instant::now(),
    };
    interrupt::UART5.set_priority(Priority::P6);
    CONTROL.start(interrupt::UART5).spawn(control(sensors, shared).ok()?);
    spawner.spawn(telemetry(port, shared).ok()?);
    spawner.spawn(link(receiver, port, shared, server).ok()?);
    super::log!("started");
    Some(())
}

#[entry]
fn main() -> ! {
    static EXECUTOR: StaticCell<Executor> = StaticCell::new();
    let started_by = supply::started_by();
    EXECUTOR.init_with(Executor::new).run(|spawner| {
        if spawn(spawner, started_by).is_none() {
            // Without a link or a store there is nobody to tell; the board stays vented.
            dump();
        }
    })
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    dump();
    // The watchdog restarts the chip, which then says so.
    loop {
        cortex_m::asm::nop();
    }
}

#[exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    dump();
    loop {
        cortex_m::asm::nop();
    }
}
