//! The firmware's log: lines of `defmt`, sent to the host as frames of a topic beside telemetry.
//!
//! A line is put together inside a critical section, which its few bytes keep short, and waits here until the telemetry task
//! has time for it. A line that finds no room is dropped and counted, and the next one that finds room says how many were: the
//! loop never waits for the log.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::RestoreState;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use heapless::Vec;
use model_core::link::messages::{Event, FaultReport};

/// Bytes of the longest line.
const LINE: usize = 64;
/// Lines that wait.
const WAITING: usize = 16;

/// One line as the host's decoder takes it.
pub type Frame = Vec<u8, LINE>;

static LINES: Channel<CriticalSectionRawMutex, Frame, WAITING> = Channel::new();
static DROPPED: AtomicU32 = AtomicU32::new(0);
static TICK: AtomicU32 = AtomicU32::new(0);

defmt::timestamp!("{=u32:ms}", TICK.load(Ordering::Relaxed));

/// Gives the log the time, in ticks of a millisecond, and the event of that tick.
pub(crate) fn record(tick: u64, event: Option<&Event>) {
    TICK.store(tick as u32, Ordering::Relaxed);
    match event {
        Some(Event::Fault(FaultReport { fault, value, limit, .. })) => {
            defmt::warn!("fault {=u8}, {=f32} against {=f32}", fault.code(), *value, *limit);
        }
        Some(Event::State(state)) => defmt::info!("state {=u8}", *state as u8),
        Some(Event::TraceFull) => defmt::info!("trace full"),
        None => {}
    }
}

/// The next line, when there is one.
pub async fn next() -> Frame {
    let dropped = DROPPED.swap(0, Ordering::Relaxed);
    if dropped > 0 {
        defmt::warn!("{=u32} lines of the log were dropped", dropped);
    }
    LINES.receive().await
}

struct Line {
    frame: UnsafeCell<(Frame, bool)>,
    restore: UnsafeCell<RestoreState>,
}

// SAFETY: both cells are only touched between `acquire` and `release`, inside a critical section.
unsafe impl Sync for Line {}

static OPEN: Line =
    Line { frame: UnsafeCell::new((Vec::new(), true)), restore: UnsafeCell::new(RestoreState::invalid()) };

#[defmt::global_logger]
struct Logger;

// SAFETY: `acquire` enters a critical section that `release` leaves, so a line is never open twice.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: paired with the release below, which defmt calls exactly once for each acquire.
        let restore = unsafe { critical_section::acquire() };
        // SAFETY: inside the critical section.
        unsafe {
            *OPEN.restore.get() = restore;
            *OPEN.frame.get() = (Vec::new(), true);
        }
    }

    unsafe fn flush() {}

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: defmt writes between acquire and release, inside the critical section.
        let (frame, whole) = unsafe { &mut *OPEN.frame.get() };
        *whole &= frame.extend_from_slice(bytes).is_ok();
    }

    unsafe fn release() {
        // SAFETY: inside the critical section that acquire entered.
        let (frame, whole) = unsafe { core::mem::take(&mut *OPEN.frame.get()) };
        if !whole || LINES.try_send(frame).is_err() {
            DROPPED.fetch_add(1, Ordering::Relaxed);
        }
        // SAFETY: paired with the acquire above.
        unsafe { critical_section::release(*OPEN.restore.get()) };
    }
}
