//! The sensors and the regulator of this board: a second UART to a virtual bench, one exchange a control tick, in
//! lock-step. The bench's side and the meaning of each byte are described in `host/virtual-bench/src/lockstep.rs`.
//!
//! The bench keeps the time: a tick is one answer. Without an answer the request is repeated, which advances nothing; after
//! [`PATIENCE`] the tick goes by without readings, so that the device stays alive on a bench that is gone.

use embassy_futures::poll_once;
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::{Read, Write};
use firmware::board::{Command, Inputs, Outputs, Plant, Readings, Signals};

use super::uart::{Receiver, Sender, Uart};
use super::watchdog;

const REQUEST: usize = 18;
const ANSWER: usize = 22;
const REQUEST_SYNC: u8 = 0xA5;
const ANSWER_SYNC: u8 = 0x5A;
const RESET: u8 = 1;
const VENT: u8 = 2;
const SUPPLY_LOW: u8 = 8;
/// Ticks between two questions whether there is a second bench.
const LOOK_EVERY: u8 = 100;

/// How long an answer may take before the tick passes without one. The bench is another process on a machine that may be
/// busy, and bench time stops while it waits. Only a bench that has ended stays silent for this long.
const PATIENCE: Duration = Duration::from_secs(3);
/// The same before the bench has answered at all: it may have been started later than the board.
const FIRST_PATIENCE: Duration = Duration::from_millis(100);

/// What a bench says each tick.
struct Said {
    readings: Readings,
    /// The bench's supply sags.
    supply_low: bool,
    /// Periods that passed on the bench without a command.
    missed: u16,
}

/// Check sum of a frame, CRC-16/IBM-3740.
fn crc16(bytes: &[u8]) -> u16 {
    let mut crc = 0xFFFF_u16;
    for byte in bytes {
        crc ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            crc = if crc & 0x8000 == 0 { crc << 1 } else { (crc << 1) ^ 0x1021 };
        }
    }
    crc
}

/// One muscle's bench.
pub struct Bench {
    uart: &'static Uart,
    tick: u32,
    /// Whether the bench has been commanded to start from its initial state.
    started: bool,
    buffer: [u8; ANSWER],
    filled: usize,
}

impl Bench {
    /// The bench behind a UART.
    pub const fn new(uart: &'static Uart) -> Self {
        Self { uart, tick: 0, started: false, buffer: [0; ANSWER], filled: 0 }
    }

    fn request(&self, command: &Command, setpoint: f32) -> [u8; REQUEST] {
        let mut bytes = [0; REQUEST];
        bytes[0] = REQUEST_SYNC;
        bytes[1] = if self.started { 0 } else { RESET } | if command.vent { VENT } else { 0 };
        bytes[4..8].copy_from_slice(&self.tick.to_le_bytes());
        bytes[8..12].copy_from_slice(&command.pressure_pa.to_le_bytes());
        bytes[12..16].copy_from_slice(&setpoint.to_le_bytes());
        let crc = crc16(&bytes[..16]);
        bytes[16..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    /// Whether what is held is a whole answer.
    fn is_whole(&self) -> bool {
        let crc = u16::from_le_bytes([self.buffer[20], self.buffer[21]]);
        self.buffer[0] == ANSWER_SYNC && crc16(&self.buffer[..20]) == crc
    }

    /// What a whole answer says, if it is to this tick.
    fn answer(&self) -> Option<Said> {
        let number = |at: usize| {
            f32::from_le_bytes([
                self.buffer[at],
                self.buffer[at + 1],
                self.buffer[at + 2],
                self.buffer[at + 3],
            ])
        };
        let ours = self.buffer[4..8] == self.tick.to_le_bytes();
        ours.then(|| Said {
            readings: Readings { pressure_pa: number(8), stroke_m: number(12), force_n: number(16) },
            supply_low: self.buffer[1] & SUPPLY_LOW != 0,
            missed: u16::from(self.buffer[1] >> 4),
        })
    }

    /// Waits for the answer to this tick, passing over anything else.
    async fn wait(&mut self) -> Said {
        loop {
            while self.filled < ANSWER {
                let room = &mut self.buffer[self.filled..];
                let Ok(count) = Receiver(self.uart).read(room).await;
                self.filled += count;
            }
            let whole = self.is_whole();
            let found = if whole { self.answer() } else { None };
            // A whole frame that is not ours is passed over; a broken one up to its next sync byte.
            let next = if whole {
                ANSWER
            } else {
                self.buffer[1..].iter().position(|&b| b == ANSWER_SYNC).map_or(ANSWER, |at| at + 1)
            };
            self.buffer.copy_within(next.., 0);
            self.filled = ANSWER - next;
            if let Some(said) = found {
                return said;
            }
        }
    }

    /// Whether a bench has been connected here: polled every few ticks, without waiting.
    fn poll_connection(&mut self) -> bool {
        if poll_once(self.wait()).is_ready() {
            self.started = true;
            self.tick = self.tick.wrapping_add(1);
        }
        self.started
    }

    /// One exchange.
    async fn exchange(&mut self, command: &Command, setpoint: f32) -> Option<Said> {
        watchdog::feed();
        let request = self.request(command, setpoint);
        let Ok(()) = Sender(self.uart).write_all(&request).await;
        // A quick bench has answered by now, and the loop would continue without end: the other tasks have their turn in every tick.
        yield_now().await;
        let patience = if self.started { PATIENCE } else { FIRST_PATIENCE };
        match select(self.wait(), Timer::after(patience)).await {
            Either::First(said) => {
                self.started = true;
                self.tick = self.tick.wrapping_add(1);
                Some(said)
            }
            Either::Second(()) => {
                // The same tick is requested again: if only the answer was lost, nothing advances twice.
                self.uart.discard();
                self.filled = 0;
                None
            }
        }
    }
}

/// Up to two muscles. The second bench is waited for only once it has answered, so that a board with one muscle does not wait
/// for another.
pub struct Benches {
    first: Bench,
    second: Bench,
    /// Ticks until the second is queried again whether it is there.
    until_asked: u8,
    stepped_at: Instant,
}

impl Benches {
    /// Benches behind two UARTs.
    pub fn new(first: Bench, second: Bench) -> Self {
        Self { first, second, until_asked: 0, stepped_at: Instant::now() }
    }
}

impl Plant for Benches {
    async fn exchange(&mut self, outputs: &Outputs) -> Inputs {
        let step_us = self.stepped_at.elapsed().as_micros() as u32 as f32;
        let first = self.first.exchange(&outputs.sides[0], outputs.setpoint).await;
        let mut second = None;
        if self.second.started || self.second.poll_connection() {
            second = self.second.exchange(&outputs.sides[1], 0.0).await;
        } else if self.until_asked == 0 {
            self.until_asked = LOOK_EVERY;
            let request = self.second.request(&outputs.sides[1], 0.0);
            let Ok(()) = Sender(self.second.uart).write_all(&request).await;
        } else {
            self.until_asked -= 1;
        }
        self.stepped_at = Instant::now();
        let benches = [first, second];
        let said = || benches.iter().flatten();
        Inputs {
            missed_ticks: said().map(|one| one.missed).max().unwrap_or(0),
            supply_low: said().any(|one| one.supply_low),
            sides: benches.each_ref().map(|one| one.as_ref().map(|one| Signals::from(one.readings))),
            step_us,
            ..Inputs::default()
        }
    }
}
