//! The control loop above the other tasks, as on a real board, in an image that tests what they share.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_futures::select::select;
use embassy_time::{Duration, Timer};
use firmware::board::{Inputs, Outputs, Plant};
use firmware::shared::LEFT;

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

/// The most times that tasks may leave the controller before a step, and how long that is waited for.
const LEAVINGS: u8 = 5;
const PATIENCE: Duration = Duration::from_millis(2);

/// Benches that count the steps which follow an answer in the midst of something else. Every other answer is kept until tasks have left
/// the controller for the first, the second … time since it came: what they take out of it in two halves is two ticks' then.
pub(super) struct Inconvenient {
    benches: Benches,
    tick: u8,
}

impl Inconvenient {
    pub(super) fn new(benches: Benches) -> Self {
        Self { benches, tick: 0 }
    }
}

impl Plant for Inconvenient {
    async fn exchange(&mut self, outputs: &Outputs) -> Inputs {
        let inputs = self.benches.exchange(outputs).await;
        self.tick = (self.tick + 1) % (2 * LEAVINGS);
        if self.tick % 2 == 1 {
            LEFT.reset();
            let left = async {
                for _ in 0..=self.tick / 2 {
                    LEFT.wait().await;
                }
            };
            select(left, Timer::after(PATIENCE)).await;
        }
        if NVIC::is_active(EXECUTOR_LINE) {
            PREEMPTED.store(PREEMPTED.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
        inputs
    }
}
