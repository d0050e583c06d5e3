//! embassy's time on two CMSDK timers: one runs through and counts, one wakes.
//!
//! Both count the 25 MHz system clock downwards over 32 bits. Timer 0 wraps every 171.8 s and its interrupt counts the
//! wraps; timer 1 is loaded with the time to the next alarm.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

use super::super::register::Register;

const TIMER0: usize = 0x4000_0000;
const TIMER1: usize = 0x4000_1000;
const CTRL: usize = 0x00;
const VALUE: usize = 0x04;
const RELOAD: usize = 0x08;
const INTERRUPT: usize = 0x0C;
const ENABLE: u32 = 1 << 0;
const ENABLE_INTERRUPT: u32 = 1 << 3;

/// Timer clocks in a microsecond, the tick of embassy's time.
const CLOCKS_PER_TICK: u32 = 25;
/// Ticks in a wrap of 2³² clocks, and the clocks left over.
const WRAP: (u64, u32) =
    ((1 << 32) / CLOCKS_PER_TICK as u64, ((1_u64 << 32) % CLOCKS_PER_TICK as u64) as u32);
/// Longest alarm that is set in one piece; the queue is looked through again when it ends.
const LONGEST: u64 = 100_000_000;

struct Clock {
    wraps: AtomicU32,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static CLOCK: Clock = Clock {
    wraps: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl Clock {
    /// Wraps, and clocks since the last.
    fn clocks(&self) -> (u32, u32) {
        critical_section::with(|_| {
            let mut wraps = self.wraps.load(Ordering::Relaxed);
            let mut left = Register::at(TIMER0 + VALUE).read();
            // A wrap whose interrupt waits outside this section is counted here already; the value is read again so
            // that both belong to the same side of it.
            if Register::at(TIMER0 + INTERRUPT).read() & 1 != 0 {
                left = Register::at(TIMER0 + VALUE).read();
                wraps = wraps.wrapping_add(1);
            }
            (wraps, u32::MAX - left)
        })
    }

    /// Sets the alarm for the queue's next time.
    fn arm(&self, cs: CriticalSection<'_>) {
        loop {
            let now = self.now();
            let next = self.queue.borrow(cs).borrow_mut().next_expiration(now);
            Register::at(TIMER1 + CTRL).write(0);
            if next == u64::MAX {
                return;
            }
            if let Some(wait) = next.checked_sub(self.now()).filter(|&wait| wait > 0) {
                let clocks = wait.min(LONGEST) as u32 * CLOCKS_PER_TICK;
                Register::at(TIMER1 + RELOAD).write(clocks);
                Register::at(TIMER1 + CTRL).write(ENABLE | ENABLE_INTERRUPT);
                return;
            }
        }
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        // As text: a division of 64 bits would be the only one of the image, and a kilobyte.
        let (wraps, clocks) = self.clocks();
        let rest = (clocks % CLOCKS_PER_TICK + wraps * WRAP.1) / CLOCKS_PER_TICK;
        u64::from(wraps) * WRAP.0 + u64::from(clocks / CLOCKS_PER_TICK) + u64::from(rest)
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            if self.queue.borrow(cs).borrow_mut().schedule_wake(at, waker) {
                self.arm(cs);
            }
        });
    }
}

/// Starts the clock; interrupts must still be disabled.
pub fn start() {
    Register::at(TIMER0 + RELOAD).write(u32::MAX);
    Register::at(TIMER0 + CTRL).write(ENABLE | ENABLE_INTERRUPT);
}

/// Interrupt of timer 0: the clock wrapped.
pub extern "C" fn on_wrap() {
    Register::at(TIMER0 + INTERRUPT).write(1);
    CLOCK.wraps.fetch_add(1, Ordering::Relaxed);
}

/// Interrupt of timer 1: an alarm is due.
pub extern "C" fn on_alarm() {
    Register::at(TIMER1 + INTERRUPT).write(1);
    critical_section::with(|cs| CLOCK.arm(cs));
}
