//! CMSDK UARTs as asynchronous byte streams: interrupts on both sides of two pipes.
//!
//! The hardware holds one byte each way. QEMU keeps further bytes back until the one is read: a byte that finds its pipe full stays
//! where it is until the pipe is read, and nothing is ever lost. A real line would continue sending; what a real board needs is in
//! `nucleo_f446re.rs`.

use core::convert::Infallible;

use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, pipe::Pipe};
use embedded_io_async::{ErrorType, Read, Write};

use super::super::register::Register;

const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CTRL: usize = 0x08;
const INTERRUPT: usize = 0x0C;
const BAUD: usize = 0x10;

const TX_FULL: u32 = 1 << 0;
const RX_FULL: u32 = 1 << 1;
const INTERRUPT_TX: u32 = 1 << 0;
const INTERRUPT_RX: u32 = 1 << 1;
/// Transmitter, receiver, and an interrupt for each.
const ALL_ON: u32 = 0b1111;
/// 25 MHz / 25 = 1 Mbaud.
const DIVIDER: u32 = 25;

/// What waits in a pipe keeps the rest waiting at the emulator, so these are as short as the tasks' own buffers allow; and similar for
/// all lines, whose code is there once then.
const RECEIVED: usize = 64;
const SENDING: usize = 128;

/// Pipes of one line. A static of their own is all zeros and takes no flash.
pub struct Pipes {
    received: Pipe<CriticalSectionRawMutex, RECEIVED>,
    sending: Pipe<CriticalSectionRawMutex, SENDING>,
}

impl Pipes {
    /// Empty ones.
    pub const fn new() -> Self {
        Self { received: Pipe::new(), sending: Pipe::new() }
    }
}

/// One UART with its pipes.
pub struct Uart {
    base: usize,
    pipes: &'static Pipes,
}

impl Uart {
    /// The UART at a base address.
    pub const fn new(base: usize, pipes: &'static Pipes) -> Self {
        Self { base, pipes }
    }

    fn register(&self, offset: usize) -> Register {
        Register::at(self.base + offset)
    }

    /// Switches it on.
    pub fn start(&self) {
        self.register(BAUD).write(DIVIDER);
        self.register(CTRL).write(ALL_ON);
    }

    /// Its receive interrupt: takes what has come, as far as there is room.
    pub fn on_receive(&self) {
        self.register(INTERRUPT).write(INTERRUPT_RX);
        critical_section::with(|_| {
            while self.register(STATE).read() & RX_FULL != 0 && !self.pipes.received.is_full() {
                let byte = self.register(DATA).read() as u8;
                let _ = self.pipes.received.try_write(&[byte]);
            }
        });
    }

    /// Its transmit interrupt: sends what waits, as far as the hardware takes it.
    pub fn on_transmit(&self) {
        self.register(INTERRUPT).write(INTERRUPT_TX);
        critical_section::with(|_| {
            while self.register(STATE).read() & TX_FULL == 0 {
                let mut byte = [0];
                if self.pipes.sending.try_read(&mut byte).is_err() {
                    break;
                }
                self.register(DATA).write(u32::from(byte[0]));
            }
        });
    }

    /// Forgets what has been received and not read.
    pub fn discard(&self) {
        self.pipes.received.clear();
        self.on_receive();
    }
}

/// The receiving half.
pub struct Receiver(pub &'static Uart);

/// The sending half.
pub struct Sender(pub &'static Uart);

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = self.0.pipes.received.read(buffer).await;
        self.0.on_receive();
        Ok(count)
    }
}

impl ErrorType for Sender {
    type Error = Infallible;
}

impl Write for Sender {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let written = self.0.pipes.sending.write(bytes).await;
        self.0.on_transmit();
        Ok(written)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
