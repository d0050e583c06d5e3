//! The link: USART2 at 1 Mbaud, both ways by DMA. No byte needs the processor, so none is lost however long a control step or a critical
//! section takes.
//!
//! What comes is written round and round into a ring. The timer of the control tick notes each millisecond how far it has come, so that
//! a reader that was too slow knows it; what was overwritten is counted and dropped, and the frames' check sums do the rest.

use core::cell::UnsafeCell;
use core::convert::Infallible;
use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;

use embassy_stm32::interrupt;
use embassy_sync::waitqueue::AtomicWaker;
use embedded_io_async::{ErrorType, Read, Write};
use firmware::shared::Shared;

use super::super::register::Register;
use super::clock;

const AHB1ENR: Register = Register::at(0x4002_3830);
const APB1ENR: Register = Register::at(0x4002_3840);
const GPIOA_MODER: Register = Register::at(0x4002_0000);
const GPIOA_PUPDR: Register = Register::at(0x4002_000C);
const GPIOA_AFRL: Register = Register::at(0x4002_0020);

const USART2: usize = 0x4000_4400;
const SR: Register = Register::at(USART2);
const DR: Register = Register::at(USART2 + 0x04);
const BRR: Register = Register::at(USART2 + 0x08);
const CR1: Register = Register::at(USART2 + 0x0C);
const CR3: Register = Register::at(USART2 + 0x14);
/// Framing, noise, overrun.
const ERRORS: u32 = 0b1110;
const FULL: u32 = 1 << 5;
/// 45 MHz / 45.
const DIVIDER: u32 = 45;

const DMA1: usize = 0x4002_6000;
const HISR: Register = Register::at(DMA1 + 0x04);
const HIFCR: Register = Register::at(DMA1 + 0x0C);
/// Registers of a stream: control, count, peripheral, memory.
const fn stream(number: usize, offset: usize) -> Register {
    Register::at(DMA1 + 0x10 + 0x18 * number + offset)
}
const RECEIVES: usize = 5;
const SENDS: usize = 6;
const CHANNEL_4: u32 = 4 << 25;
const SENDS_FLAGS: u32 = 0b11_1101 << 16;
/// Transfer complete, or an error that ended it.
const SENT: u32 = 1 << 21 | 1 << 19;

/// Bytes of the ring: ten milliseconds of the line, twice what a longest answer takes to go out.
const RING: usize = 1024;
const RING_US: u32 = 10 * RING as u32;

struct Ring(UnsafeCell<[u8; RING]>);
// SAFETY: written by the DMA stream alone; `Receiver` reads what it has written, and looks afterwards whether it still was that.
unsafe impl Sync for Ring {}
static BYTES: Ring = Ring(UnsafeCell::new([0; RING]));

/// Bytes that have come, wrapping, and where in the ring that was; both change in critical sections.
static COME: AtomicU32 = AtomicU32::new(0);
static NOTED_AT: AtomicU32 = AtomicU32::new(0);
static NOTED_US: AtomicU32 = AtomicU32::new(0);
static ERROR_COUNT: AtomicU32 = AtomicU32::new(0);
static CAME: AtomicWaker = AtomicWaker::new();
static WENT: AtomicWaker = AtomicWaker::new();

/// Switches the line on; its interrupts must still be disabled.
pub fn start() {
    AHB1ENR.set(0b1 | 1 << 21);
    APB1ENR.set(1 << 17);
    // PA2 and PA3 are USART2's (alternate function 7), an open input counts as a line at rest.
    GPIOA_AFRL.write(GPIOA_AFRL.read() & !(0xFF << 8) | 0x77 << 8);
    GPIOA_PUPDR.write(GPIOA_PUPDR.read() & !(0b11 << 6) | 0b01 << 6);
    GPIOA_MODER.write(GPIOA_MODER.read() & !(0b1111 << 4) | 0b1010 << 4);
    BRR.write(DIVIDER);
    stream(RECEIVES, 0x08).write(USART2 as u32 + 4);
    stream(RECEIVES, 0x0C).write(BYTES.0.get() as u32);
    stream(RECEIVES, 0x04).write(RING as u32);
    // Memory counts up, round and round.
    stream(RECEIVES, 0x00).write(CHANNEL_4 | 1 << 10 | 1 << 8);
    stream(RECEIVES, 0x00).set(1);
    // DMA both ways, an interrupt for errors.
    CR3.write(1 << 7 | 1 << 6 | 1);
    // On, transmitter, receiver, an interrupt when the line comes to rest.
    CR1.write(1 << 13 | 1 << 4 | 1 << 3 | 1 << 2);
}

/// Notes how far the ring has been written; gives the bytes that have come, wrapping.
fn note() -> u32 {
    critical_section::with(|_| {
        let at = (RING as u32).wrapping_sub(stream(RECEIVES, 0x04).read()) % RING as u32;
        let now = clock::micros();
        let more = at.wrapping_sub(NOTED_AT.swap(at, Ordering::Relaxed)) % RING as u32;
        let late = now.wrapping_sub(NOTED_US.swap(now, Ordering::Relaxed)) >= RING_US;
        // The processor stood still for so long that the line may have gone round: as good as a whole ring more.
        let more = if late && more > 0 { more + RING as u32 } else { more };
        let come = COME.load(Ordering::Relaxed).wrapping_add(more);
        COME.store(come, Ordering::Relaxed);
        come
    })
}

/// Each tick: a long message is read while it comes.
pub fn on_tick() {
    let before = COME.load(Ordering::Relaxed);
    if note() != before {
        CAME.wake();
    }
}

#[interrupt]
unsafe fn USART2() {
    let flags = SR.read();
    if flags & ERRORS != 0 {
        ERROR_COUNT.fetch_add(1, Ordering::Relaxed);
    }
    // Reading the data clears what has just been read of the flags. A byte that waits is the stream's, which clears them as well.
    if flags & FULL == 0 {
        let _ = DR.read();
    }
    CAME.wake();
}

#[interrupt]
unsafe fn DMA1_STREAM6() {
    // Only the interrupt is switched off: the sender looks at the flag.
    let control = stream(SENDS, 0x00);
    control.write(control.read() & !(1 << 4 | 1 << 2));
    WENT.wake();
}

/// The receiving half.
pub struct Receiver {
    /// Bytes that have been read, wrapping.
    read: u32,
    shared: &'static Shared,
}

impl Receiver {
    /// The only one; it counts what it loses.
    pub fn new(shared: &'static Shared) -> Self {
        Self { read: note(), shared }
    }

    /// Bytes that wait. What was overwritten before it was read is counted, and all that waits is dropped with it.
    fn waiting(&mut self) -> usize {
        let come = note();
        let waiting = come.wrapping_sub(self.read) as usize;
        if waiting <= RING {
            return waiting;
        }
        self.shared.count_line_errors(1);
        self.read = come;
        0
    }

    /// Copies what waits, as much as there is room for.
    fn take(&mut self, buffer: &mut [u8]) -> usize {
        let errors = ERROR_COUNT.swap(0, Ordering::Relaxed);
        if errors > 0 {
            self.shared.count_line_errors(errors);
        }
        let count = self.waiting().min(buffer.len());
        for (n, byte) in buffer[..count].iter_mut().enumerate() {
            // The count of bytes and the place in the ring differ by whole rounds.
            let place = self.read.wrapping_add(n as u32) as usize % RING;
            // SAFETY: within the ring; the stream may be writing elsewhere in it.
            *byte = unsafe { BYTES.0.get().cast::<u8>().add(place).read_volatile() };
        }
        if self.waiting() < count {
            // It was overwritten while it was copied.
            return 0;
        }
        self.read = self.read.wrapping_add(count as u32);
        count
    }
}

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|context| {
            CAME.register(context.waker());
            match self.take(buffer) {
                0 => Poll::Pending,
                count => Poll::Ready(Ok(count)),
            }
        })
        .await
    }
}

/// The sending half.
pub struct Sender(());

impl Sender {
    /// The only one.
    pub const fn new() -> Self {
        Self(())
    }
}

/// A transfer on its way; anyone who gives it up stops it, so that the stream never reads what is no longer there.
struct Transfer;

impl Drop for Transfer {
    fn drop(&mut self) {
        let control = stream(SENDS, 0x00);
        control.write(control.read() & !1);
        while control.read() & 1 != 0 {}
    }
}

impl ErrorType for Sender {
    type Error = Infallible;
}

impl Write for Sender {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(usize::from(u16::MAX));
        if count == 0 {
            return Ok(0);
        }
        HIFCR.write(SENDS_FLAGS);
        stream(SENDS, 0x08).write(USART2 as u32 + 4);
        stream(SENDS, 0x0C).write(bytes.as_ptr() as u32);
        stream(SENDS, 0x04).write(count as u32);
        let transfer = Transfer;
        // From memory, which counts up; an interrupt at its end and at an error.
        stream(SENDS, 0x00).write(CHANNEL_4 | 1 << 10 | 0b01 << 6 | 1 << 4 | 1 << 2);
        stream(SENDS, 0x00).set(1);
        poll_fn(|context| {
            WENT.register(context.waker());
            if HISR.read() & SENT != 0 { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
        drop(transfer);
        Ok(count)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
