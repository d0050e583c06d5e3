//! ST Nucleo-F446RE: Cortex-M4 with floating point at 180 MHz, one muscle.
//!
//! | pin | Arduino name | what |
//! | --- | --- | --- |
//! | PA11, PA12 | – | CAN transceiver, receive and transmit: the link over a bus, see `can.rs` |
//! | PA2, PA3 | – | link: USART2 over the debug probe's USB port, 1 Mbaud |
//! | PA0 | A0 | pressure sensor, see [`PRESSURE`]; 100 kΩ to ground |
//! | PA1 | A1 | stroke sensor, see [`STROKE`]; 100 kΩ to ground |
//! | PB0 | A3 | load cell amplifier, see [`LOAD`]; 100 kΩ to ground |
//! | PC0 | A5 | second pressure sensor like the first, optional; 100 kΩ to ground |
//! | PC1 | A4 | pressure sensor of the supply air, optional; 100 kΩ to ground |
//! | PC7 | D9 | enable input, optional: 3.3 V through all contacts of the emergency stop; 10 kΩ to ground |
//! | PA5 | D13 | status light LD2, on the board |
//! | PA4 | A2 | analogue command (DAC 1) to the regulator's 0–10 V stage, whose input takes no current; 1 MΩ to ground |
//! | PB5 | D4 | dump valve: low opens it, so that a board without power vents; 10 kΩ to ground |
//! | PB8 | D15 | fill valve of a pair, in place of a regulator: high opens it; 10 kΩ to ground |
//! | PB9 | D14 | vent valve of a pair: low opens it, so that a board without power vents; 10 kΩ to ground |
//!
//! The resistors to ground are part of the circuit: an open wire reads the lowest code, which no sensor gives, and while the chip
//! starts its pins are open, so that they alone keep the valve open and the command at zero.
//!
//! The control loop runs on an interrupt of its own above all other tasks, at 1 kHz, and feeds the watchdog; if it stops for
//! 20 ms, the chip restarts, vented, with the fault latched. Flash: see `slots.rs`. Erasing a sector stops the
//! processor for up to two seconds, which is why the store is only written while every muscle is vented.
//!
//! | priority | interrupts |
//! | --- | --- |
//! | none can hold it back | failing crystal: valve open, restart |
//! | 1 | supply falls: valve open; above critical sections, see `critical.rs` |
//! | 6 | tick of the control loop, control loop |
//! | 8 | link, CAN, time |

mod can;
mod clock;
mod critical;
mod flash;
mod outputs;
mod power;
mod sampling;
mod slots;
mod status_light;
mod uart;
mod watchdog;

use core::panic::PanicInfo;

use cortex_m_rt::{entry, exception};
use embassy_executor::{Executor, InterruptExecutor, Spawner};
use embassy_futures::select::select;
use embassy_stm32::flash::Flash;
use embassy_stm32::interrupt::{self, Interrupt, InterruptExt, Priority};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::Timer;
use firmware::board::{Hardware, Identity, Inputs, Outputs, Plant, Signals, Span};
use firmware::modes::Seat;
use firmware::server::{Line, Server};
use firmware::shared::Shared;
use firmware::tasks::{self, SharedServer};
use firmware::tick::TICK_US;
use firmware::update::Updater;
use model_core::link::hello::Board;
use model_core::link::messages::{Fault, StartedBy};
use model_core::link::settings::{
    CommandOutput, Limits, Scales, SensorScale, SensorWatch, Settings, StrokeLoop, Watch,
};
use static_cell::StaticCell;

use self::flash::StoreFlash;
use self::outputs::dump;
use self::slots::Slots;
use self::status_light::StatusLight;
use self::uart::{Receiver, Sender};

/// Supply of the converters, V, and their highest code.
const REFERENCE: f32 = 3.3;
const FULL_SCALE: f32 = 4095.0;

/// Voltage at a pin.
fn volts(code: u16) -> f32 {
    f32::from(code) * (REFERENCE / FULL_SCALE)
}

/// Signals of every input, V.
const VOLTS: Span = Span { low: 0.0, high: REFERENCE };

/// Scales of a new device. Gauge pressure: 0–10 bar as 0.5–4.5 V behind a divider of 2/3.
const PRESSURE: SensorScale = SensorScale { at_zero: -125e3, per_unit: 375e3, filter_s: 0.0 };
/// Stroke: a potentiometer of 50 mm and 10 kΩ between two resistors of 560 Ω, so that its ends are 0.17 V from the converter's.
const STROKE: SensorScale = SensorScale { at_zero: -0.0028, per_unit: 0.050 / 3.3 * 1.112, filter_s: 0.0 };
/// Force: ±1 kN as 1.65 V ± 1.5 V.
const LOAD: SensorScale = SensorScale { at_zero: -1100.0, per_unit: 1000.0 / 1.5, filter_s: 0.0 };

/// What these converters can deliver, the highest pressure that this board ever commands, and settings whose watches lie within.
static HARDWARE: Hardware = Hardware {
    pressure: VOLTS,
    stroke: VOLTS,
    force: VOLTS,
    second_pressure: Some(VOLTS),
    supply: Some(VOLTS),
    enable_input: true,
    valve_pair: true,
    can: true,
    command_ceiling_pa: 700e3,
    settings: Settings {
        scales: Scales {
            pressure: PRESSURE,
            stroke: STROKE,
            force: LOAD,
            second_pressure: PRESSURE,
            supply: PRESSURE,
        },
        // A 0–10 V stage: 3.3 V become 10 V, and those 10 bar.
        command: CommandOutput { low: 0.0, full_pa: 1e6 },
        stroke_loop: StrokeLoop { force_limit_n: 1000.0, ..Settings::DEFAULT.stroke_loop },
        limits: Limits {
            stroke_min_m: -0.001,
            stroke_max_m: 0.050,
            force_n: 1000.0,
            ..Settings::DEFAULT.limits
        },
        stroke: SensorWatch { low: -0.0015, high: 0.0515, jump: 0.005, ..Settings::DEFAULT.stroke },
        force: SensorWatch { low: -1050.0, high: 1050.0, jump: 500.0, ..Settings::DEFAULT.force },
        // Below the deadband of any muscle of the thesis (46 kPa), and twice what counts as empty.
        watch: Watch { valve_test_pa: 40e3, ..Settings::DEFAULT.watch },
        ..Settings::DEFAULT
    },
};

type Port = Mutex<CriticalSectionRawMutex, Sender>;
type Bus = Mutex<CriticalSectionRawMutex, can::Sender>;

/// The control loop's own: scans in, commands out.
struct Muscle {
    began_us: u32,
    /// Whether a step has been made since the loop began.
    stepped: bool,
    light: StatusLight,
}

impl Plant for Muscle {
    async fn exchange(&mut self, outputs: &Outputs) -> Inputs {
        let command = outputs.sides[0];
        outputs::command(outputs.levels[0], command.vent);
        outputs::valves(outputs.valves[0]);
        // A supply that falls during a step has opened the valve, and the step knows nothing of it. Afterwards, so that none falls between.
        if power::sags() {
            outputs::dump();
        }
        outputs::light(self.light.tick(outputs.state));
        let step_us = clock::micros().wrapping_sub(self.began_us);
        if self.stepped {
            watchdog::feed();
        }
        self.stepped = true;
        sampling::TICK.wait().await;
        let now = clock::micros();
        // However long the processor stood still, there is one step, and the ticks without one are counted. In 32 bits: a division of
        // 64 would take a third of a tick's instructions.
        let ticks = (now.wrapping_sub(self.began_us) + TICK_US as u32 / 2) / TICK_US as u32;
        self.began_us = now;
        let scan = sampling::take().map(|codes| codes.map(volts));
        let signals = scan.map(|[pressure, stroke, force, second, _]| Signals {
            pressure,
            stroke,
            force,
            second_pressure: Some(second),
        });
        Inputs {
            sides: [signals, None],
            supply_air: scan.map(|[.., supply]| supply),
            enable_open: !sampling::enable_is_closed(),
            missed_ticks: ticks.saturating_sub(1).min(u32::from(u16::MAX)) as u16,
            supply_low: power::supply_is_low(),
            step_us: step_us as f32,
        }
    }
}

#[embassy_executor::task]
async fn control(shared: &'static Shared) {
    sampling::start();
    sampling::TICK.wait().await;
    watchdog::be_short();
    let mut muscle = Muscle { began_us: clock::micros(), stepped: false, light: StatusLight::default() };
    tasks::control(&mut muscle, shared).await
}

#[embassy_executor::task]
async fn telemetry(port: &'static Port, bus: &'static Bus, shared: &'static Shared) {
    // While an answer is put into the bus's queue, a topic would fall into its midst.
    let offer = |frame: &[u8]| {
        if let Ok(mut sender) = bus.try_lock() {
            sender.offer(frame);
        }
    };
    tasks::telemetry(port, shared, offer).await;
}

#[embassy_executor::task]
async fn link(
    mut receiver: Receiver,
    port: &'static Port,
    shared: &'static Shared,
    server: &'static SharedServer<StoreFlash>,
) {
    // It returns when the host has requested a restart: neither end of this line fails.
    let answer = tasks::link(Line::Serial, &mut receiver, port, server, shared);
    select(answer, tasks::keep(server, shared)).await;
    restart().await;
}

/// The same over the bus.
#[embassy_executor::task]
async fn bus_link(
    mut receiver: can::Receiver,
    bus: &'static Bus,
    shared: &'static Shared,
    server: &'static SharedServer<StoreFlash>,
) {
    select(tasks::link(Line::Can, &mut receiver, bus, server, shared), can::supervise()).await;
    restart().await;
}

/// Restarts the chip once the answer is out.
async fn restart() {
    Timer::after_millis(20).await;
    dump();
    cortex_m::peripheral::SCB::sys_reset();
}

static CONTROL: InterruptExecutor = InterruptExecutor::new();

// SAFETY: the interrupt of a peripheral that this board does not use, lent to the executor.
#[embassy_stm32::interrupt]
unsafe fn UART5() {
    // SAFETY: called from the interrupt that the executor was started on.
    unsafe { CONTROL.on_interrupt() }
}

/// Gives every interrupt its priority before it is let through: one without would lie above the critical sections.
fn start_interrupts() {
    const { assert!((Priority::P1 as u8) < critical::LEVEL) };
    const { assert!((Priority::P6 as u8) >= critical::LEVEL) };
    let all = [
        (Interrupt::PVD, Priority::P1),
        (Interrupt::TIM3, Priority::P6),
        (Interrupt::UART5, Priority::P6),
        (Interrupt::TIM5, Priority::P8),
        (Interrupt::USART2, Priority::P8),
        (Interrupt::DMA1_STREAM6, Priority::P8),
        (Interrupt::CAN1_TX, Priority::P8),
        (Interrupt::CAN1_RX0, Priority::P8),
        (Interrupt::CAN1_RX1, Priority::P8),
        (Interrupt::CAN1_SCE, Priority::P8),
    ];
    for (line, priority) in all {
        line.set_priority(priority);
        // SAFETY: each handler touches its own registers and what critical sections guard.
        unsafe { line.enable() };
    }
}

/// What the board found out before it set its clocks up.
struct Start {
    started_by: StartedBy,
    /// Whether the crystal runs, and has never failed since power came on.
    crystal: bool,
    clock_failed: bool,
}

#[inline(never)]
fn spawn(spawner: Spawner, start: &Start) -> Option<()> {
    static PORT: StaticCell<Port> = StaticCell::new();
    let p = embassy_stm32::init(power::clocks(start.crystal));
    if start.crystal {
        power::watch_crystal();
    }
    power::start_caches();
    power::watch_supply();
    clock::start();
    uart::start();
    start_interrupts();
    let shared = Shared::take(&HARDWARE, Seat::single());
    let port: &'static Port = PORT.init_with(|| Mutex::new(Sender::new()));
    let identity = Identity {
        board: Board::NucleoF446re,
        muscles: 1,
        serial: embassy_stm32::uid::uid(),
        started_by: start.started_by,
        fault: (start.clock_failed || !start.crystal).then_some(Fault::ClockFailed),
    };
    // In a place of its own: a task would keep it twice, as its argument and as its variable.
    static SERVER: StaticCell<SharedServer<StoreFlash>> = StaticCell::new();
    static BUS: StaticCell<Bus> = StaticCell::new();
    // SAFETY: the store and the slots use different sectors, and only the server, which answers one line at a time, uses either.
    let slots_flash = Flash::new_blocking(unsafe { embassy_stm32::peripherals::FLASH::steal() });
    let flash = StoreFlash::new(Flash::new_blocking(p.FLASH));
    let mut server = Server::start(identity, flash, shared).ok()?;
    if let Some(key) = slots::KEY {
        static UPDATER: StaticCell<Updater<Slots>> = StaticCell::new();
        server.take_updates(UPDATER.init(Updater::new(Slots::new(slots_flash), key)));
    }
    let server: &'static SharedServer<StoreFlash> = SERVER.init(Mutex::new(server));
    let bus: &'static Bus = BUS.init(Mutex::new(can::Sender::new()));
    CONTROL.start(interrupt::UART5).spawn(control(shared).ok()?);
    // Without its crystal the clock is not exact enough for a bus that others use.
    if start.crystal
        && let Some(receiver) = can::start(shared)
    {
        spawner.spawn(bus_link(receiver, bus, shared, server).ok()?);
    }
    spawner.spawn(telemetry(port, bus, shared).ok()?);
    spawner.spawn(link(Receiver::new(shared), port, shared, server).ok()?);
    super::log!("started");
    Some(())
}

#[entry]
fn main() -> ! {
    static EXECUTOR: StaticCell<Executor> = StaticCell::new();
    // Safe first: nothing below can hang before the muscle is vented and the watchdog runs.
    outputs::start();
    watchdog::start();
    let start = Start {
        clock_failed: power::clock_had_failed(),
        started_by: power::started_by(),
        crystal: power::start_crystal(),
    };
    EXECUTOR.init_with(Executor::new).run(|spawner| {
        if spawn(spawner, &start).is_none() {
            // Without a store no one can be informed; the board stays vented, and the watchdog tries again.
            dump();
        }
    })
}

/// Vents and waits for the watchdog, which restarts the chip; that then says so.
fn stop() -> ! {
    cortex_m::interrupt::disable();
    dump();
    loop {
        cortex_m::asm::nop();
    }
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    stop()
}

#[exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    stop()
}

#[exception]
unsafe fn DefaultHandler(_number: i16) -> ! {
    stop()
}
