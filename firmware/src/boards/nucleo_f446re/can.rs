//! The link over a CAN bus: bxCAN1 on PA11 and PA12, classic messages of 8 bytes, cut and put together by `model_core::link::can`.
//!
//! Own code instead of the driver of embassy-stm32 0.6: that panics on a message whose length code is above 8, waits without end for a
//! bus that is at rest, and counts neither what its queues and the controller's lose nor a bus-off.
//!
//! | messages | controller | handled |
//! | --- | --- | --- |
//! | to this address | first FIFO | put into a queue for the link's task |
//! | to all | second FIFO | in the interrupt: vents, also while the link is busy |
//! | all others | filtered out | |
//!
//! What waits to be sent is dropped when the controller is off the bus, and when nothing has gone out for [`STALLED_US`], because no one
//! is there: a host that comes back must not be given old answers. After a bus-off the controller comes back on its own, when it has seen
//! the bus at rest 128 times for 11 bits (ABOM).

use core::cell::Cell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use critical_section::Mutex;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{Interrupt, InterruptExt};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::Timer;
use embedded_io_async::{ErrorType, Read, Write};
use firmware::shared::Shared;
use model_core::link::can::{self as codec, Address, CLASSIC, Format, Route, VENT};
use model_core::link::settings::CanLine;

use super::super::register::Register;
use super::clock;

const AHB1ENR: Register = Register::at(0x4002_3830);
const APB1ENR: Register = Register::at(0x4002_3840);
const GPIOA_MODER: Register = Register::at(0x4002_0000);
const GPIOA_OSPEEDR: Register = Register::at(0x4002_0008);
const GPIOA_PUPDR: Register = Register::at(0x4002_000C);
const GPIOA_AFRH: Register = Register::at(0x4002_0024);

const CAN1: usize = 0x4000_6400;
const MCR: Register = Register::at(CAN1);
const MSR: Register = Register::at(CAN1 + 0x04);
const TSR: Register = Register::at(CAN1 + 0x08);
const IER: Register = Register::at(CAN1 + 0x14);
const ESR: Register = Register::at(CAN1 + 0x18);
const BTR: Register = Register::at(CAN1 + 0x1C);
const FMR: Register = Register::at(CAN1 + 0x200);
const FM1R: Register = Register::at(CAN1 + 0x204);
const FS1R: Register = Register::at(CAN1 + 0x20C);
const FFA1R: Register = Register::at(CAN1 + 0x214);
const FA1R: Register = Register::at(CAN1 + 0x21C);
/// State of a receive FIFO, and its oldest message: identifier, length, data.
const fn fifo_state(fifo: usize) -> Register {
    Register::at(CAN1 + 0x0C + 4 * fifo)
}
const fn received(fifo: usize, offset: usize) -> Register {
    Register::at(CAN1 + 0x1B0 + 0x10 * fifo + offset)
}
const fn mailbox(number: u32, offset: usize) -> Register {
    Register::at(CAN1 + 0x180 + 0x10 * number as usize + offset)
}
/// The two words of a filter bank: identifier and mask.
const fn filter(bank: usize, word: usize) -> Register {
    Register::at(CAN1 + 0x240 + 8 * bank + 4 * word)
}

/// In MCR: no sleep; mailboxes in the order of their requests, the oldest messages of a full FIFO stay, back from bus-off on its own.
const INITIALISE: u32 = 1 << 0;
const OPERATE: u32 = 1 << 6 | 1 << 3 | 1 << 2;
const INITIALISED: u32 = 1 << 0;
/// In TSR: the requests that are done, all mailboxes empty, an order to give all three up.
const DONE: u32 = 1 | 1 << 8 | 1 << 16;
const EMPTY: u32 = 0b111 << 26;
const GIVE_UP: u32 = 1 << 7 | 1 << 15 | 1 << 23;
/// In the state of a FIFO: messages, a message was lost, the oldest is released.
const MESSAGES: u32 = 0b11;
const OVERRUN: u32 = 1 << 4;
const RELEASE: u32 = 1 << 5;
/// In IER: a mailbox is empty, either FIFO has a message, bus-off.
const INTERRUPTS: u32 = 1 << 15 | 1 << 10 | 1 << 4 | 1 << 1 | 1 << 0;
const BUS_OFF: u32 = 1 << 2;
const ERROR: u32 = 1 << 2;

/// Clock of the controller, kHz, and parts of a bit: 1 + 12 + 2, so that a bit is sampled at 87 % of it, near the 87.5 % of CiA 102. A
/// bit may be drawn out or cut by two parts.
const CLOCK_KHZ: u32 = 45_000;
const PARTS: u32 = 15;
const SEGMENTS: u32 = 1 << 24 | 1 << 20 | 11 << 16;

/// Longest time in which nothing goes out before what waits is dropped, µs: 18 ms take the 76 messages of a longest answer at 500 kbit/s.
const STALLED_US: u32 = 100_000;
/// Longest time until the controller is ready to be set up, µs: a message that is on its way at 125 kbit/s, several times.
const READY_US: u32 = 10_000;
/// Messages of either queue: more than a longest frame has.
const QUEUE: usize = 96;
/// Messages of a topic's frame are taken only while the queue has at least this much room left.
const ROOM: usize = QUEUE / 2;

/// A classic message's length and data.
#[derive(Clone, Copy)]
struct Message {
    length: u32,
    words: [u32; 2],
}

impl Message {
    fn of(payload: &[u8]) -> Self {
        let mut bytes = [0; CLASSIC];
        let length = payload.len().min(CLASSIC);
        bytes[..length].copy_from_slice(&payload[..length]);
        let [a, b, c, d, e, f, g, h] = bytes;
        let words = [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])];
        Self { length: length as u32, words }
    }

    fn bytes(&self) -> [u8; CLASSIC] {
        let mut bytes = [0; CLASSIC];
        bytes[..4].copy_from_slice(&self.words[0].to_le_bytes());
        bytes[4..].copy_from_slice(&self.words[1].to_le_bytes());
        bytes
    }

    /// Takes the oldest message of a FIFO, if there is one. The length codes 9 to 15 mean 8 bytes.
    fn take(fifo: usize) -> Option<Self> {
        if fifo_state(fifo).read() & MESSAGES == 0 {
            return None;
        }
        let length = (received(fifo, 0x04).read() & 0xF).min(CLASSIC as u32);
        let words = [received(fifo, 0x08).read(), received(fifo, 0x0C).read()];
        fifo_state(fifo).write(RELEASE);
        Some(Self { length, words })
    }
}

static COMING: Channel<CriticalSectionRawMutex, Message, QUEUE> = Channel::new();
static WAITING: Channel<CriticalSectionRawMutex, Message, QUEUE> = Channel::new();
/// Identifier of what this device sends, as a mailbox has it.
static OWN: AtomicU32 = AtomicU32::new(0);
/// When a message last went out, or the first of several began to wait, µs.
static WENT_US: AtomicU32 = AtomicU32::new(0);
/// Whether a host has sent anything here: only then are topics sent over the bus.
static HAS_HOST: AtomicBool = AtomicBool::new(false);
static SHARED: Mutex<Cell<Option<&'static Shared>>> = Mutex::new(Cell::new(None));

/// What the interrupts count in; `None` before the bus is started.
fn shared() -> Option<&'static Shared> {
    critical_section::with(|cs| SHARED.borrow(cs).get())
}

/// Identifier in the upper bits of a word, as mailboxes and filters have it.
const fn standard(route: Route) -> u32 {
    (route.identifier() as u32) << 21
}

/// Joins the bus that the settings name; `None` where they name none. It takes part when it has seen the bus at rest.
pub fn start(shared: &'static Shared) -> Option<Receiver> {
    let CanLine { address, kbit_per_s } = shared.with(|controller| controller.settings().can);
    let address = Address::new(address)?;
    let prescaler = CLOCK_KHZ / (PARTS * u32::from(kbit_per_s.max(1)));
    critical_section::with(|cs| SHARED.borrow(cs).set(Some(shared)));
    OWN.store(standard(Route::From(address)), Ordering::Relaxed);
    AHB1ENR.set(0b1);
    APB1ENR.set(1 << 25);
    // PA11 and PA12 are CAN1's (alternate function 9); an open input counts as a bus at rest. The edges of 1 Mbit/s need the second speed.
    GPIOA_AFRH.write(GPIOA_AFRH.read() & !(0xFF << 12) | 0x99 << 12);
    GPIOA_PUPDR.write(GPIOA_PUPDR.read() & !(0b11 << 22) | 0b01 << 22);
    GPIOA_OSPEEDR.write(GPIOA_OSPEEDR.read() & !(0b11 << 24) | 0b01 << 24);
    GPIOA_MODER.write(GPIOA_MODER.read() & !(0b1111 << 22) | 0b1010 << 22);
    MCR.write(INITIALISE);
    let began_us = clock::micros();
    while MSR.read() & INITIALISED == 0 {
        if clock::micros().wrapping_sub(began_us) > READY_US {
            shared.count_line_errors(1);
            return None;
        }
    }
    BTR.write(SEGMENTS | (prescaler.max(1) - 1));
    // Two banks of a mask over 32 bits: all of the standard identifier, and that it is one of data (IDE and RTR clear).
    FMR.set(1);
    let mask = 0x7FF << 21 | 0b110;
    for (bank, route) in [Route::To(address), Route::ToAll].into_iter().enumerate() {
        filter(bank, 0).write(standard(route));
        filter(bank, 1).write(mask);
    }
    FM1R.write(0);
    FS1R.write(0b11);
    FFA1R.write(0b10);
    FA1R.write(0b11);
    FMR.write(FMR.read() & !1);
    IER.write(INTERRUPTS);
    MCR.write(OPERATE);
    Some(Receiver {
        codec: codec::Receiver::new(Format::Classic),
        rest: [0; CLASSIC],
        at: 0,
        length: 0,
        shared,
    })
}

/// Drops what waits to be sent: first the queue, from which the interrupt would fill the mailboxes again.
fn drop_waiting() {
    WAITING.clear();
    TSR.write(GIVE_UP);
}

/// Looks after the bus, without end: what no one takes is dropped.
pub async fn supervise() {
    loop {
        Timer::after_millis(20).await;
        let stalled = clock::micros().wrapping_sub(WENT_US.load(Ordering::Relaxed)) > STALLED_US;
        if stalled && TSR.read() & EMPTY != EMPTY {
            drop_waiting();
        }
    }
}

/// Puts what waits into the empty mailboxes.
#[interrupt]
unsafe fn CAN1_TX() {
    let state = TSR.read();
    if state & DONE != 0 || state & EMPTY == EMPTY {
        WENT_US.store(clock::micros(), Ordering::Relaxed);
    }
    // Written one by one: an order to give up is in the same register.
    TSR.write(DONE);
    while TSR.read() & EMPTY != 0 {
        let Ok(message) = WAITING.try_receive() else { return };
        let number = TSR.read() >> 24 & 0b11;
        mailbox(number, 0x04).write(message.length);
        mailbox(number, 0x08).write(message.words[0]);
        mailbox(number, 0x0C).write(message.words[1]);
        mailbox(number, 0x00).write(OWN.load(Ordering::Relaxed) | 1);
    }
}

/// Counts a message that the controller has lost.
fn note_overrun(fifo: usize) {
    if fifo_state(fifo).read() & OVERRUN != 0 {
        fifo_state(fifo).write(OVERRUN);
        if let Some(shared) = shared() {
            shared.count_line_errors(1);
        }
    }
}

#[interrupt]
unsafe fn CAN1_RX0() {
    note_overrun(0);
    while let Some(message) = Message::take(0) {
        // A queue that is full loses the newest: the gap in the numbers is counted.
        let _ = COMING.try_send(message);
    }
}

/// Messages to all: vents immediately.
#[interrupt]
unsafe fn CAN1_RX1() {
    note_overrun(1);
    while let Some(message) = Message::take(1) {
        if message.length == CLASSIC as u32
            && message.bytes() == VENT
            && let Some(shared) = shared()
        {
            shared.vent();
        }
    }
}

#[interrupt]
unsafe fn CAN1_SCE() {
    MSR.write(ERROR);
    if ESR.read() & BUS_OFF != 0 {
        if let Some(shared) = shared() {
            shared.count_bus_off();
        }
        drop_waiting();
    }
}

/// The receiving half.
pub struct Receiver {
    codec: codec::Receiver,
    /// Bytes of the last message that have not been read yet.
    rest: [u8; CLASSIC],
    at: usize,
    length: usize,
    shared: &'static Shared,
}

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        while self.at == self.length {
            let message = COMING.receive().await;
            HAS_HOST.store(true, Ordering::Relaxed);
            let lost = self.codec.counts().lost;
            self.length = 0;
            // Seven bytes, and a zero before them behind a gap.
            for byte in self.codec.take(&message.bytes()[..message.length as usize]) {
                self.rest[self.length % CLASSIC] = byte;
                self.length += 1;
            }
            self.at = 0;
            let lost = self.codec.counts().lost.wrapping_sub(lost);
            if lost > 0 {
                self.shared.count_line_errors(lost);
            }
        }
        let count = buffer.len().min(self.length - self.at);
        buffer[..count].copy_from_slice(&self.rest[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

/// The sending half.
pub struct Sender {
    codec: codec::Sender,
}

impl Sender {
    /// The only one.
    pub const fn new() -> Self {
        Self { codec: codec::Sender::new(Format::Classic) }
    }

    /// The message of up to seven bytes of the link.
    fn message(&mut self, bytes: &[u8]) -> Message {
        let mut message = Message { length: 0, words: [0; 2] };
        self.codec.send(bytes, |payload| message = Message::of(payload));
        message
    }

    /// Takes a whole frame if a host is there and the queue has room for it; a frame that is not taken leaves a gap in its numbers.
    pub fn offer(&mut self, frame: &[u8]) {
        let count = frame.len().div_ceil(Format::Classic.data());
        if !HAS_HOST.load(Ordering::Relaxed) || WAITING.free_capacity() < ROOM + count {
            return;
        }
        for piece in frame.chunks(Format::Classic.data()) {
            let _ = WAITING.try_send(self.message(piece));
        }
        Interrupt::CAN1_TX.pend();
    }
}

impl ErrorType for Sender {
    type Error = Infallible;
}

impl Write for Sender {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for piece in bytes.chunks(Format::Classic.data()) {
            if WAITING.is_full() {
                Interrupt::CAN1_TX.pend();
            }
            WAITING.send(self.message(piece)).await;
        }
        Interrupt::CAN1_TX.pend();
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
