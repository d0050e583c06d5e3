//! The receiver's side: bytes as they come, gathered into frames.

use super::{Exchange, Frame, FrameError, HEADER, Header, MAX_WIRE, unstuff};

/// Counts of what an [`Accumulator`] has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Whole frames.
    pub good: u32,
    /// Frames that were refused.
    pub bad: u32,
}

/// Gathers bytes into frames and finds the way back after anything that is not one.
///
/// ```
/// use model_core::link::frame::{Accumulator, Header, Kind, MAX_WIRE, encode};
/// let mut wire = [0u8; MAX_WIRE];
/// let header = Header { kind: Kind::Request, id: 3, sequence: 7 };
/// let n = encode(header, &(1.5f32, 2u8), &mut wire)?;
/// let mut accumulator = Accumulator::new();
/// for &byte in b"noise\0" {
///     if let Some(frame) = accumulator.push(byte) {
///         assert!(frame.is_err());
///     }
/// }
/// let mut seen = None;
/// for &byte in &wire[..n] {
///     if let Some(Ok(frame)) = accumulator.push(byte) {
///         seen = Some(frame.header);
///     }
/// }
/// assert_eq!(seen, Some(header));
/// # Ok::<(), model_core::link::FrameError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Accumulator {
    buffer: [u8; MAX_WIRE],
    length: usize,
    overrun: bool,
    counts: Counts,
}

impl Default for Accumulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Accumulator {
    /// An empty one.
    pub const fn new() -> Self {
        Self { buffer: [0; MAX_WIRE], length: 0, overrun: false, counts: Counts { good: 0, bad: 0 } }
    }

    /// Takes one byte; at the end of a frame gives the frame, or why it is none.
    ///
    /// Zeros in a row are neither frames nor errors: a sender may flush the line with them.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        let frame = self.take(byte)?;
        Some(frame.map(|(header, body)| Frame { header, body: &self.buffer[HEADER..HEADER + body] }))
    }

    /// The same for anyone who answers in the place of what has come.
    pub fn push_to_answer(&mut self, byte: u8) -> Option<Result<Exchange<'_>, FrameError>> {
        let frame = self.take(byte)?;
        Some(frame.map(|(header, body)| Exchange { header, body, bytes: &mut self.buffer }))
    }

    fn take(&mut self, byte: u8) -> Option<Result<(Header, usize), FrameError>> {
        if byte != 0 {
            if self.length < self.buffer.len() {
                self.buffer[self.length] = byte;
                self.length += 1;
            } else {
                self.overrun = true;
            }
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.overrun) {
            self.counts.bad = self.counts.bad.wrapping_add(1);
            return Some(Err(FrameError::TooLong));
        }
        if length == 0 {
            return None;
        }
        let frame = unstuff(&mut self.buffer[..length]);
        match frame {
            Ok(_) => self.counts.good = self.counts.good.wrapping_add(1),
            Err(_) => self.counts.bad = self.counts.bad.wrapping_add(1),
        }
        Some(frame)
    }

    /// What has been seen since the beginning.
    pub const fn counts(&self) -> Counts {
        self.counts
    }
}
