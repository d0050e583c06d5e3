//! embassy's time on TIM5: 32 bits of microseconds, which wrap every 71 minutes, and a count of the wraps above them.
//!
//! The counter is the time, so nothing is divided. Even the longest erasure of the flash loses no wrap.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
use embassy_stm32::interrupt;
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

use super::super::register::Register;

const TIM5: usize = 0x4000_0C00;
const CR1: Register = Register::at(TIM5);
const DIER: Register = Register::at(TIM5 + 0x0C);
const SR: Register = Register::at(TIM5 + 0x10);
const EGR: Register = Register::at(TIM5 + 0x14);
const CNT: Register = Register::at(TIM5 + 0x24);
const PSC: Register = Register::at(TIM5 + 0x28);
const ARR: Register = Register::at(TIM5 + 0x2C);
const CCR1: Register = Register::at(TIM5 + 0x34);
/// Update and first compare, in DIER and SR.
const WRAP: u32 = 1 << 0;
const ALARM: u32 = 1 << 1;

/// The timers of APB1 run at twice its 45 MHz.
pub const TIMER_CLOCK_MHZ: u32 = 90;
/// Longest alarm that is set; the queue is looked through again at each wrap.
const LONGEST: u64 = 1 << 31;

struct Clock {
    wraps: AtomicU32,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static CLOCK: Clock = Clock {
    wraps: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl Clock {
    /// Sets the alarm for the queue's next time.
    fn arm(&self, cs: CriticalSection<'_>) {
        let mut queue = self.queue.borrow(cs).borrow_mut();
        loop {
            let next = queue.next_expiration(self.now());
            DIER.write(WRAP);
            if next == u64::MAX || next.saturating_sub(self.now()) > LONGEST {
                return;
            }
            CCR1.write(next as u32);
            SR.write(!ALARM);
            DIER.write(WRAP | ALARM);
            // A time that has passed meanwhile would be met after a wrap only.
            if self.now() < next {
                return;
            }
        }
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        critical_section::with(|_| {
            let mut wraps = self.wraps.load(Ordering::Relaxed);
            let mut low = CNT.read();
            // A wrap whose interrupt waits outside this section is counted here already; the counter is read again so that both
            // belong to the same side of it.
            if SR.read() & WRAP != 0 {
                low = CNT.read();
                wraps = wraps.wrapping_add(1);
            }
            u64::from(wraps) << 32 | u64::from(low)
        })
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let sooner = self.queue.borrow(cs).borrow_mut().schedule_wake(at, waker);
            if sooner {
                self.arm(cs);
            }
        });
    }
}

/// Starts the clock; its interrupt must still be disabled.
pub fn start() {
    PSC.write(TIMER_CLOCK_MHZ - 1);
    ARR.write(u32::MAX);
    // Takes the prescaler over.
    EGR.write(1);
    SR.write(0);
    DIER.write(WRAP);
    CR1.write(1);
}

/// Microseconds, wrapping.
pub fn micros() -> u32 {
    CNT.read()
}

#[interrupt]
unsafe fn TIM5() {
    critical_section::with(|cs| {
        let flags = SR.read();
        SR.write(!flags);
        if flags & WRAP != 0 {
            CLOCK.wraps.store(CLOCK.wraps.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
        CLOCK.arm(cs);
    });
}
