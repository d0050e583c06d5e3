//! What the tasks share: the controller, and what waits to be sent to the host.

use core::cell::{RefCell, RefMut};
use core::mem::ManuallyDrop;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::{CriticalSection, Mutex, RestoreState};
#[cfg(feature = "log")]
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use model_core::link::frame::MAX_TOPIC;
use model_core::link::settings::Settings;

#[cfg(feature = "board")]
use crate::board::Hardware;
use crate::board::Outputs;
use crate::control::Controller;
#[cfg(feature = "board")]
use crate::modes::Seat;
use crate::outbox::Outgoing;
use crate::placement::{Placed, placed};

/// Samples that wait for the link: twice as many as come in the 5.2 ms that a longest answer takes at 1 Mbaud.
const WAITING: usize = 11;

/// The controller, in a critical section of its own. Neither end of it is grown into the many places that enter.
struct Entered<'s> {
    controller: ManuallyDrop<RefMut<'s, Controller>>,
    restore: RestoreState,
}

impl<'s> Entered<'s> {
    #[inline(never)]
    fn enter(controller: &'s Mutex<RefCell<Controller>>) -> Self {
        // SAFETY: left by the drop of what is given, which stays within `Shared::with`: sections end in the order of their scopes.
        let restore = unsafe { critical_section::acquire() };
        // SAFETY: in the section, and what is borrowed goes before it ends.
        let inside = unsafe { CriticalSection::new() };
        Self { controller: ManuallyDrop::new(controller.borrow_ref_mut(inside)), restore }
    }
}

impl Drop for Entered<'_> {
    #[inline(never)]
    fn drop(&mut self) {
        // SAFETY: both were made by `Entered::enter`, and nothing uses them after this.
        unsafe {
            ManuallyDrop::drop(&mut self.controller);
            critical_section::release(self.restore);
        }
        #[cfg(feature = "preempting")]
        LEFT.signal(());
    }
}

/// Signals that a task has left the controller. A board lets its loop interrupt at this moment: state that the task must have taken from
/// the controller before, and did not, then shows in the test.
#[cfg(feature = "preempting")]
pub static LEFT: Signal<CriticalSectionRawMutex, ()> = Signal::new();

type Waiting = Channel<CriticalSectionRawMutex, Outgoing, WAITING>;

/// What the tasks share: the controller, entered for short and never across an await, and what waits to be sent.
pub struct Shared {
    controller: Mutex<RefCell<Controller>>,
    outbox: Placed<Waiting>,
    dropped: AtomicU32,
    /// Times that the receiver lost bytes.
    line_errors: AtomicU32,
    /// Times that the CAN controller was off the bus.
    bus_offs: AtomicU32,
    /// The state changed: there may be something to keep.
    changed: Signal<CriticalSectionRawMutex, ()>,
}

impl Shared {
    /// A controller as after power-up, for two muscles.
    pub fn new(settings: Settings) -> Self {
        Self::around(Controller::new(&settings))
    }

    #[inline(always)]
    fn around(controller: Controller) -> Self {
        Self {
            controller: Mutex::new(RefCell::new(controller)),
            outbox: placed!(Waiting, Channel::new()),
            dropped: AtomicU32::new(0),
            line_errors: AtomicU32::new(0),
            bus_offs: AtomicU32::new(0),
            changed: Signal::new(),
        }
    }

    /// The one of a board: a static of its own, made in its place and apart from what continues to use it.
    #[cfg(feature = "board")]
    #[inline(never)]
    pub fn take(hardware: &'static Hardware, seats: [Seat; 2]) -> &'static Self {
        static SHARED: static_cell::StaticCell<Shared> = static_cell::StaticCell::new();
        SHARED.uninit().write(Self::around(Controller::seated(&hardware.settings, hardware, seats)))
    }

    /// Enters the controller.
    pub fn with<R>(&self, act: impl FnOnce(&mut Controller) -> R) -> R {
        act(&mut Entered::enter(&self.controller).controller)
    }

    /// Samples that found no room, since the start.
    pub fn telemetry_dropped(&self) -> u32 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Times that received bytes were lost, since the start.
    pub fn line_errors(&self) -> u32 {
        self.line_errors.load(Ordering::Relaxed)
    }

    /// Counts what the receiver has lost.
    pub fn count_line_errors(&self, times: u32) {
        self.line_errors.fetch_add(times, Ordering::Relaxed);
    }

    /// Times that the CAN controller was off the bus, since the start.
    pub fn bus_offs(&self) -> u32 {
        self.bus_offs.load(Ordering::Relaxed)
    }

    /// Counts that the CAN controller went off the bus.
    pub fn count_bus_off(&self) {
        self.bus_offs.fetch_add(1, Ordering::Relaxed);
    }

    /// Vents and disarms, also for those who do not own the device: the message to all devices of a bus. In a fault the device stays there, vented.
    pub fn vent(&self) {
        self.with(|controller| {
            // As the requests `stop` and `disarm`, whose refusals name the fault in which nothing more is to be done.
            let _ = controller.stop();
            let _ = controller.disarm();
        });
    }

    /// One control step; what it says is put where the telemetry task finds it. A sample without room is dropped and
    /// counted: the loop never waits for the link.
    pub fn step(&self, inputs: &crate::board::Inputs) -> Outputs {
        let outputs = self.with(|controller| controller.step(inputs));
        self.report();
        outputs
    }

    /// Queues the event and the sample of the step. Not inlined: the step itself must not need the stack of this function.
    #[inline(never)]
    fn report(&self) {
        let event = self.with(Controller::take_event);
        #[cfg(feature = "log")]
        crate::log::record(self.with(|controller| controller.ticks()), event.as_ref());
        if let Some(event) = event {
            self.changed.signal(());
            // The host must receive it, whatever else waits: the oldest sample makes room.
            if self.outbox.is_full() && self.outbox.try_receive().is_ok() {
                self.drop_one();
            }
            self.enqueue(Outgoing::Event(event));
        }
        if let Some(sample) = self.with(Controller::take_sample) {
            self.enqueue(Outgoing::Sample(sample));
        }
    }

    fn enqueue(&self, outgoing: Outgoing) {
        if self.outbox.try_send(outgoing).is_err() {
            self.drop_one();
        }
    }

    fn drop_one(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// Waits until the state changes.
    pub(crate) async fn change(&self) {
        self.changed.wait().await;
    }

    /// Whether the state has changed since this was last asked.
    pub fn has_changed(&self) -> bool {
        self.changed.try_take().is_some()
    }

    /// Placed for what the next step may say.
    pub fn has_room(&self) -> bool {
        self.outbox.free_capacity() >= 2
    }

    /// The next frame to send without being asked, when there is one. Written where it is taken: nothing of it is kept over a wait.
    pub(crate) async fn next(&self, out: &mut [u8; MAX_TOPIC]) -> usize {
        loop {
            #[cfg(feature = "log")]
            if let Either::Second(line) = select(self.outbox.ready_to_receive(), crate::log::next()).await {
                return Outgoing::Log(line).encode(out);
            }
            #[cfg(not(feature = "log"))]
            self.outbox.ready_to_receive().await;
            if let Some(length) = self.next_outgoing(out) {
                return length;
            }
        }
    }

    /// The next frame to send without being asked, if there is one.
    pub fn next_outgoing(&self, out: &mut [u8; MAX_TOPIC]) -> Option<usize> {
        self.outbox.try_receive().ok().map(|mut outgoing| outgoing.encode(out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Inputs, Readings};
    use model_core::link::frame::Accumulator;
    use model_core::link::messages::Session;

    #[test]
    fn a_change_of_state_wakes_the_link_to_keep_what_must_not_be_lost() {
        let shared = Shared::new(Settings::default());
        let inputs = Inputs { sides: [Some(Readings::default().into()), None], ..Inputs::default() };
        shared.step(&inputs);
        assert!(!shared.has_changed());
        assert_eq!(shared.with(|controller| controller.arm(Session::default())), Ok(()));
        shared.step(&inputs);
        assert!(shared.has_changed());
        assert!(!shared.has_changed(), "once for each change");
    }

    #[test]
    fn samples_without_room_are_dropped_counted_and_leave_a_gap_in_their_numbers() {
        let shared = Shared::new(Settings::default());
        shared.with(|controller| controller.set_telemetry(1));
        for _ in 0..WAITING + 5 {
            shared.step(&Inputs::default());
        }
        assert_eq!(shared.telemetry_dropped(), 5);
        let mut out = [0; MAX_TOPIC];
        let mut accumulator = Accumulator::new();
        let mut number = |shared: &Shared| {
            let length = shared.next_outgoing(&mut out)?;
            out[..length].iter().find_map(|&byte| Some(accumulator.push(byte)?.ok()?.header.sequence))
        };
        assert_eq!(number(&shared), Some(0));
        shared.step(&Inputs::default());
        let rest: std::vec::Vec<_> = core::iter::from_fn(|| number(&shared)).collect();
        assert_eq!(rest.last().copied(), Some(WAITING as u16 + 5));
        assert_eq!(rest.len(), WAITING);
    }
}
