//! The control loop above the other tasks, as on a real board, in an image that tests what they share.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use embassy_executor::{InterruptExecutor, SendSpawner};
use firmware::board::{Inputs, Outputs, Plant};

use super::bench::Benches;
use super::{EXECUTOR_LINE, Line};

static CONTROL: InterruptExecutor = InterruptExecutor::new();
const CONTROL_LINE: Line = Line(11);

/// Control steps that began while another task was at work: a debugger finds it by its name.
#[unsafe(no_mangle)]
static PREEMPTED: AtomicU32 = AtomicU32::new(0);

pub(super) extern "C" fn run_control() {
    // SAFETY: this is the handler of the interrupt that the executor was started on.
    unsafe { CONTROL.on_interrupt() }
}

/// Starts the loop's executor: above the tasks, below all devices.
pub(super) fn start() -> SendSpawner {
    // SAFETY: before that interrupt is enabled.
    unsafe { cortex_m::Peripherals::steal().NVIC.set_priority(CONTROL_LINE, 0xC0) };
    CONTROL.start(CONTROL_LINE)
}

/// Benches that count the steps which follow an answer in the midst of something else.
pub(super) struct Counted(pub(super) Benches);

impl Plant for Counted {
    async fn exchange(&mut self, outputs: &Outputs) -> Inputs {
        let inputs = self.0.exchange(outputs).await;
        if NVIC::is_active(EXECUTOR_LINE) {
            PREEMPTED.store(PREEMPTED.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
        inputs
    }
}
