//! Arm MPS2 with the AN386 image (Cortex-M4 with floating point), as QEMU emulates it.
//!
//! | UART | what |
//! | --- | --- |
//! | 0 | link to the host |
//! | 1, 2 | virtual benches of the first and second muscle, see [`bench`] |
//!
//! The store's file `pam-store.bin` and the end of the run go through semihosting. QEMU is started with
//! `-M mps2-an386 -semihosting-config enable=on,target=native` and a `-serial` for each UART.

mod bench;
mod flash;
mod semihosting;
mod time;
mod uart;
mod watchdog;

use core::panic::PanicInfo;

use cortex_m::peripheral::NVIC;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_futures::select::select;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::Timer;
use firmware::board::{Hardware, Identity};
use firmware::modes::Seat;
use firmware::server::Server;
use firmware::shared::Shared;
use firmware::tasks::{self, SharedServer};
use model_core::link::hello::Board;
use static_cell::StaticCell;

use self::bench::{Bench, Benches};
use self::flash::FileFlash;
use self::uart::{Pipes, Receiver, Sender, Uart};

static LINK: Uart = {
    static PIPES: Pipes = Pipes::new();
    Uart::new(0x4000_4000, &PIPES)
};
static BENCH: Uart = {
    static PIPES: Pipes = Pipes::new();
    Uart::new(0x4000_5000, &PIPES)
};
static SECOND_BENCH: Uart = {
    static PIPES: Pipes = Pipes::new();
    Uart::new(0x4000_6000, &PIPES)
};

type Port = Mutex<CriticalSectionRawMutex, Sender>;

/// One word of the vector table.
#[repr(C)]
pub union Vector {
    handler: extern "C" fn(),
    reserved: usize,
}

extern "C" fn link_received() {
    LINK.on_receive();
}
extern "C" fn link_sent() {
    LINK.on_transmit();
}
extern "C" fn bench_received() {
    BENCH.on_receive();
}
extern "C" fn bench_sent() {
    BENCH.on_transmit();
}
extern "C" fn second_received() {
    SECOND_BENCH.on_receive();
}
extern "C" fn second_sent() {
    SECOND_BENCH.on_transmit();
}

/// Everything runs on an interrupt that no device uses, below all that do, and the main program sleeps: in QEMU only an
/// interrupt wait lets the host's processor rest (an event wait, the thread executor's, spins). The control loop is not above the rest
/// as on a real board, except in the image that is built to try that: the bench keeps its time, and would continue while the link waits
/// for the file that is the flash.
static EXECUTOR: InterruptExecutor = InterruptExecutor::new();
const EXECUTOR_LINE: Line = Line(10);

extern "C" fn run_tasks() {
    // SAFETY: this is the handler of the interrupt that the executor was started on.
    unsafe { EXECUTOR.on_interrupt() }
}

#[cfg(feature = "preempting")]
mod preempting;

const RESERVED: Vector = Vector { reserved: 0 };

/// The board's interrupts by their numbers: three UARTs (receive, transmit), two GPIO blocks, two timers, the one that runs the tasks,
/// and one for a control loop above them.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
#[used]
pub static __INTERRUPTS: [Vector; 12] = [
    Vector { handler: link_received },
    Vector { handler: link_sent },
    Vector { handler: bench_received },
    Vector { handler: bench_sent },
    Vector { handler: second_received },
    Vector { handler: second_sent },
    RESERVED,
    RESERVED,
    Vector { handler: time::on_wrap },
    Vector { handler: time::on_alarm },
    Vector { handler: run_tasks },
    #[cfg(feature = "preempting")]
    Vector { handler: preempting::run_control },
    #[cfg(not(feature = "preempting"))]
    RESERVED,
];

/// An interrupt's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Line(u16);

// SAFETY: the numbers below are those of the table above.
unsafe impl cortex_m::interrupt::InterruptNumber for Line {
    fn number(self) -> u16 {
        self.0
    }
}

fn start_interrupts() {
    // SAFETY: before any interrupt is enabled; the lowest of the eight priorities that this core has.
    unsafe {
        let mut core = cortex_m::Peripherals::steal();
        core.NVIC.set_priority(EXECUTOR_LINE, 0xE0);
    }
    for line in [0, 1, 2, 3, 4, 5, 8, 9] {
        // SAFETY: every handler only touches its own registers and what critical sections guard.
        unsafe { NVIC::unmask(Line(line)) };
    }
}

#[embassy_executor::task]
async fn control(shared: &'static Shared) {
    let benches = Benches::new(Bench::new(&BENCH), Bench::new(&SECOND_BENCH));
    #[cfg(feature = "preempting")]
    let benches = preempting::Inconvenient::new(benches);
    let mut benches = benches;
    tasks::control(&mut benches, shared).await
}

#[embassy_executor::task]
async fn telemetry(port: &'static Port, shared: &'static Shared) {
    tasks::telemetry(port, shared, |_| {}).await;
}

#[embassy_executor::task]
async fn link(port: &'static Port, shared: &'static Shared, server: &'static SharedServer<FileFlash>) {
    let mut receiver = Receiver(&LINK);
    let answer = tasks::link(firmware::server::Line::Serial, &mut receiver, port, server, shared);
    select(answer, tasks::keep(server, shared)).await;
    // The answer is on its way out of the pipe.
    Timer::after_millis(20).await;
    watchdog::restart_on_request();
}

fn spawn(spawner: SendSpawner, shared: &'static Shared, port: &'static Port) -> Result<(), &'static str> {
    let flash = FileFlash::open(c"pam-store.bin").ok_or("no pam-store.bin")?;
    let identity = Identity {
        board: Board::Mps2An386,
        muscles: 2,
        serial: *b"emulated\0\0\0\0",
        started_by: watchdog::started_by(),
        fault: None,
    };
    // In a place of its own: a task would keep it twice, as its argument and as its variable.
    static SERVER: StaticCell<SharedServer<FileFlash>> = StaticCell::new();
    let server = Server::start(identity, flash, shared).map_err(|_| "the store cannot be opened")?;
    let server = SERVER.init(Mutex::new(server));
    let full = |_| "a task has no place";
    #[cfg(feature = "preempting")]
    preempting::start().spawn(control(shared).map_err(full)?);
    #[cfg(not(feature = "preempting"))]
    spawner.spawn(control(shared).map_err(full)?);
    watchdog::start();
    spawner.spawn(telemetry(port, shared).map_err(full)?);
    spawner.spawn(link(port, shared, server).map_err(full)?);
    super::log!("started");
    Ok(())
}

/// Apart from `main`, which never returns: what this takes of the stack is given back.
#[inline(never)]
fn start() -> Result<(), &'static str> {
    static PORT: StaticCell<Port> = StaticCell::new();
    time::start();
    for uart in [&BENCH, &SECOND_BENCH] {
        uart.start();
    }
    LINK.start();
    start_interrupts();
    let shared = Shared::take(&Hardware::SIMULATED, Seat::pair());
    let port: &'static Port = PORT.init_with(|| Mutex::new(Sender(&LINK)));
    spawn(EXECUTOR.start(EXECUTOR_LINE), shared, port)
}

#[entry]
fn main() -> ! {
    if let Err(why) = start() {
        semihosting::print("firmware: ");
        semihosting::print(why);
        semihosting::print("\n");
        semihosting::fail();
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// Says so and ends the emulator. The place is reported by the image with logs only: it would keep the names of all source files in
/// flash.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    semihosting::print("firmware: panic\n");
    #[cfg(feature = "log")]
    if let Some(place) = info.location() {
        defmt::error!("panic in {}, line {}", place.file(), place.line());
    }
    #[cfg(not(feature = "log"))]
    let _ = info;
    semihosting::fail();
}

#[exception]
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    semihosting::print("firmware: hard fault\n");
    semihosting::fail();
}
