//! The wire between a controller board and the bench: one exchange per control tick, in lock-step.
//!
//! The board asks, the bench answers. The bench advances its plant by exactly one control period per accepted request and
//! never on its own, so a run is deterministic however slow or jerky the emulated board is. There is no hello and no
//! negotiation: both frames have a fixed size.
//!
//! # Bytes
//!
//! All numbers are little-endian; floats are IEEE-754 binary32.
//!
//! Request, board to bench, 18 bytes:
//!
//! | offset | size | field |
//! | --- | --- | --- |
//! | 0 | 1 | sync, `0xA5` |
//! | 1 | 1 | flags: bit 0 [`Request::RESET`], bit 1 [`Request::VENT`], bit 2 [`Request::END`]; the rest zero |
//! | 2 | 2 | `script` u16: with `RESET`, which motion script of the bench's list to start; otherwise ignored |
//! | 4 | 4 | `tick` u32: the board's control tick, echoed in the answer; wraps |
//! | 8 | 4 | `pressure_command` f32, Pa gauge, the regulator's setpoint for the coming period |
//! | 12 | 4 | `setpoint` f32, N: the board's present force setpoint; the bench only logs it |
//! | 16 | 2 | CRC-16 of bytes 0..16 |
//!
//! Answer, bench to board, 22 bytes:
//!
//! | offset | size | field |
//! | --- | --- | --- |
//! | 0 | 1 | sync, `0x5A` |
//! | 1 | 1 | status: bit 0 [`Answer::BAD_COMMAND`], bit 1 [`Answer::SCRIPT_DONE`], bit 2 [`Answer::BURST`], bit 3 [`Answer::SUPPLY_LOW`], bits 4–7 [`Answer::late`] |
//! | 2 | 2 | `temperature` i16, hundredths of a degree Celsius, of the bladder |
//! | 4 | 4 | `tick` u32 of the request that is answered |
//! | 8 | 4 | `pressure` f32, Pa gauge, as the sensor reads it |
//! | 12 | 4 | `stroke` f32, m, contraction positive, as the sensor reads it |
//! | 16 | 4 | `force` f32, N, positive as the muscle pulls (a push-PAM pushes), as the load cell reads it |
//! | 20 | 2 | CRC-16 of bytes 0..20 |
//!
//! The CRC is CRC-16/IBM-3740 (polynomial 0x1021, start 0xFFFF, no reflection, no final XOR; check value of
//! `"123456789"` is 0x29B1). A receiver that finds a wrong CRC drops one byte and looks for the next sync byte.
//!
//! # Course of a run
//!
//! 1. The board sends a request with `RESET` set: the plant is set to its seeded initial state at the given script's start
//!    (nothing is advanced), and the answer holds the first readings.
//! 2. Every further request holds its pressure command for one control period; the answer holds the readings at its end.
//! 3. When the answer to a tick does not come, the board may repeat the request: a request whose tick equals the last
//!    answered one, without `RESET`, is answered with the same bytes again and advances nothing.
//! 4. `VENT` opens the dump valve: the command counts as zero regardless of what it says. A command that is not finite counts as
//!    zero and sets `BAD_COMMAND`.
//! 5. `SCRIPT_DONE`: the motion script has ended (the plant then holds its last position). `END` asks the bench
//!    that the board is finished; it is answered, then the bench closes the connection.

use std::io::{self, Read, Write};

/// Size of a request in bytes.
pub(crate) const REQUEST_LEN: usize = 18;
/// Size of an answer in bytes.
pub(crate) const ANSWER_LEN: usize = 22;
/// First byte of a request.
pub(crate) const REQUEST_SYNC: u8 = 0xA5;
/// First byte of an answer.
pub(crate) const ANSWER_SYNC: u8 = 0x5A;

/// What the board sends to the bench in each control tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Request {
    /// Bits [`Self::RESET`], [`Self::VENT`], [`Self::END`].
    pub flags: u8,
    /// Index of the motion script to start, read with `RESET` only.
    pub script: u16,
    /// Control tick of the board.
    pub tick: u32,
    /// Pressure command, Pa gauge.
    pub pressure_command: f32,
    /// Present force setpoint, N, for the bench's log.
    pub setpoint: f32,
}

impl Request {
    /// Start (again) from the initial state with script [`Request::script`].
    pub const RESET: u8 = 1;
    /// Open the dump valve, regardless of the command.
    pub const VENT: u8 = 2;
    /// The board is finished.
    pub const END: u8 = 4;

    /// The frame of this request.
    pub fn encode(&self) -> [u8; REQUEST_LEN] {
        let mut b = [0u8; REQUEST_LEN];
        b[0] = REQUEST_SYNC;
        b[1] = self.flags;
        b[2..4].copy_from_slice(&self.script.to_le_bytes());
        b[4..8].copy_from_slice(&self.tick.to_le_bytes());
        b[8..12].copy_from_slice(&self.pressure_command.to_le_bytes());
        b[12..16].copy_from_slice(&self.setpoint.to_le_bytes());
        let crc = crc16(&b[..16]);
        b[16..18].copy_from_slice(&crc.to_le_bytes());
        b
    }

    /// The request in a frame, or `None` when sync byte or checksum are wrong.
    pub fn decode(b: &[u8; REQUEST_LEN]) -> Option<Self> {
        if b[0] != REQUEST_SYNC || crc16(&b[..16]) != u16::from_le_bytes([b[16], b[17]]) {
            return None;
        }
        Some(Self {
            flags: b[1],
            script: u16::from_le_bytes([b[2], b[3]]),
            tick: word(b, 4),
            pressure_command: f32::from_bits(word(b, 8)),
            setpoint: f32::from_bits(word(b, 12)),
        })
    }
}

/// What the bench answers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Answer {
    /// Bits [`Self::BAD_COMMAND`], [`Self::SCRIPT_DONE`], [`Self::BURST`], [`Self::SUPPLY_LOW`], and [`Self::late`].
    pub status: u8,
    /// Bladder temperature in hundredths of a degree Celsius.
    pub temperature_centi: i16,
    /// Tick of the request that is answered.
    pub tick: u32,
    /// Measured pressure, Pa gauge.
    pub pressure: f32,
    /// Measured contraction stroke, m.
    pub stroke: f32,
    /// Measured force, N.
    pub force: f32,
}

impl Answer {
    /// The command was not finite and was taken as zero.
    pub const BAD_COMMAND: u8 = 1;
    /// The motion script has ended.
    pub const SCRIPT_DONE: u8 = 2;
    /// The true pressure passed what the muscle is rated for: the controller did something dangerous.
    pub const BURST: u8 = 4;
    /// The supply that board and bench share sags.
    pub const SUPPLY_LOW: u8 = 8;

    /// The status of a bench on which `periods` (at most 15) have passed without a request: the board was late.
    pub const fn late(periods: u8) -> u8 {
        periods << 4
    }

    /// The frame of this answer.
    pub fn encode(&self) -> [u8; ANSWER_LEN] {
        let mut b = [0u8; ANSWER_LEN];
        b[0] = ANSWER_SYNC;
        b[1] = self.status;
        b[2..4].copy_from_slice(&self.temperature_centi.to_le_bytes());
        b[4..8].copy_from_slice(&self.tick.to_le_bytes());
        b[8..12].copy_from_slice(&self.pressure.to_le_bytes());
        b[12..16].copy_from_slice(&self.stroke.to_le_bytes());
        b[16..20].copy_from_slice(&self.force.to_le_bytes());
        let crc = crc16(&b[..20]);
        b[20..22].copy_from_slice(&crc.to_le_bytes());
        b
    }

    /// The answer in a frame, or `None` when sync byte or checksum are wrong.
    pub fn decode(b: &[u8; ANSWER_LEN]) -> Option<Self> {
        if b[0] != ANSWER_SYNC || crc16(&b[..20]) != u16::from_le_bytes([b[20], b[21]]) {
            return None;
        }
        Some(Self {
            status: b[1],
            temperature_centi: i16::from_le_bytes([b[2], b[3]]),
            tick: word(b, 4),
            pressure: f32::from_bits(word(b, 8)),
            stroke: f32::from_bits(word(b, 12)),
            force: f32::from_bits(word(b, 16)),
        })
    }
}

fn word(b: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([b[at], b[at + 1], b[at + 2], b[at + 3]])
}

/// CRC-16/IBM-3740.
///
/// ```
/// assert_eq!(virtual_bench::lockstep::crc16(b"123456789"), 0x29B1);
/// ```
pub fn crc16(bytes: &[u8]) -> u16 {
    let mut crc = 0xFFFFu16;
    for &byte in bytes {
        crc ^= u16::from(byte) << 8;
        for _ in 0..8 {
            crc = if crc & 0x8000 != 0 { (crc << 1) ^ 0x1021 } else { crc << 1 };
        }
    }
    crc
}

/// What is behind the wire: a plant that is reset and advanced one control period at a time.
pub trait Station {
    /// Go to the initial state of motion script `script` and give the readings there.
    fn reset(&mut self, script: u16) -> Answer;
    /// Advance one control period under a finite pressure command in Pa and give the readings at its end. `setpoint` is for
    /// the log.
    fn step(&mut self, pressure_command: f32, setpoint: f32) -> Answer;
}

/// Serve one connection until the board ends the run or closes; returns the number of periods advanced.
///
/// Frames with a wrong checksum are skipped byte by byte, as the module documentation says.
pub fn serve<S: Read + Write>(stream: &mut S, station: &mut dyn Station) -> io::Result<u64> {
    let mut frame = [0u8; REQUEST_LEN];
    let mut held = 0;
    let mut last: Option<Answer> = None;
    let mut periods = 0;
    loop {
        while held < REQUEST_LEN {
            match stream.read(&mut frame[held..]) {
                Ok(0) => return Ok(periods),
                Ok(n) => held += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) if e.kind() == io::ErrorKind::ConnectionReset => return Ok(periods),
                Err(e) => return Err(e),
            }
        }
        let Some(request) = Request::decode(&frame) else {
            let next = frame[1..].iter().position(|&b| b == REQUEST_SYNC).map_or(REQUEST_LEN, |i| i + 1);
            frame.copy_within(next.., 0);
            held = REQUEST_LEN - next;
            continue;
        };
        held = 0;
        let reset = request.flags & Request::RESET != 0;
        let answer = match last {
            Some(answered) if !reset && answered.tick == request.tick => answered,
            _ => {
                let finite = request.pressure_command.is_finite();
                let mut answer = if reset {
                    station.reset(request.script)
                } else {
                    let vent = request.flags & Request::VENT != 0 || !finite;
                    periods += 1;
                    station.step(if vent { 0.0 } else { request.pressure_command }, request.setpoint)
                };
                answer.tick = request.tick;
                if !finite {
                    answer.status |= Answer::BAD_COMMAND;
                }
                answer
            }
        };
        last = Some(answer);
        stream.write_all(&answer.encode())?;
        stream.flush()?;
        if request.flags & Request::END != 0 {
            return Ok(periods);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A station that counts: pressure is the last command, force the number of periods.
    struct Counter(f32);
    impl Station for Counter {
        fn reset(&mut self, script: u16) -> Answer {
            self.0 = f32::from(script);
            Answer { force: self.0, ..Answer::default() }
        }
        fn step(&mut self, pressure_command: f32, _: f32) -> Answer {
            self.0 += 1.0;
            Answer { pressure: pressure_command, force: self.0, ..Answer::default() }
        }
    }

    /// Input from one buffer, output to another.
    struct Pipe(io::Cursor<Vec<u8>>, Vec<u8>);
    impl Read for Pipe {
        fn read(&mut self, b: &mut [u8]) -> io::Result<usize> {
            self.0.read(b)
        }
    }
    impl Write for Pipe {
        fn write(&mut self, b: &[u8]) -> io::Result<usize> {
            self.1.extend_from_slice(b);
            Ok(b.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn answers(input: Vec<u8>) -> Vec<Answer> {
        let mut pipe = Pipe(io::Cursor::new(input), Vec::new());
        serve(&mut pipe, &mut Counter(0.0)).expect("buffers do not fail");
        pipe.1
            .chunks(ANSWER_LEN)
            .map(|c| Answer::decode(c.try_into().expect("whole frames")).expect("valid frames"))
            .collect()
    }

    #[test]
    fn the_bytes_of_a_request_are_fixed() {
        let r = Request { flags: 1, script: 2, tick: 0x0403_0201, pressure_command: 1.0, setpoint: -2.0 };
        let bytes = r.encode();
        let body = [0xA5, 1, 2, 0, 1, 2, 3, 4, 0, 0, 0x80, 0x3F, 0, 0, 0, 0xC0];
        assert_eq!(bytes[..16], body);
        assert_eq!(Request::decode(&bytes), Some(r));
        for i in 0..REQUEST_LEN * 8 {
            let mut bad = bytes;
            bad[i / 8] ^= 1 << (i % 8);
            assert_eq!(Request::decode(&bad), None, "a flipped bit {i} is seen");
        }
    }

    #[test]
    fn noise_on_the_line_costs_no_later_frame_and_repeats_advance_nothing() {
        let ask =
            |flags, tick, p| Request { flags, script: 7, tick, pressure_command: p, setpoint: 0.0 }.encode();
        let mut input = vec![0xA5, 0x00, 0xFF, 0xA5];
        input.extend(ask(Request::RESET, 10, 0.0));
        input.extend(ask(0, 11, 5.0));
        input.extend(ask(0, 11, 5.0));
        input.extend([0xA5; 5]);
        input.extend(ask(Request::VENT, 12, 5.0));
        input.extend(ask(0, 13, f32::NAN));
        input.extend(ask(Request::END, 14, 1.0));
        input.extend(ask(0, 15, 1.0));
        let a = answers(input);
        assert_eq!(a.iter().map(|a| a.tick).collect::<Vec<_>>(), [10, 11, 11, 12, 13, 14]);
        assert_eq!(a.iter().map(|a| a.force).collect::<Vec<_>>(), [7.0, 8.0, 8.0, 9.0, 10.0, 11.0]);
        assert_eq!(a.iter().map(|a| a.pressure).collect::<Vec<_>>(), [0.0, 5.0, 5.0, 0.0, 0.0, 1.0]);
        assert_eq!(a[4].status, Answer::BAD_COMMAND);
    }
}
