//! Frames on the wire: COBS(header ‖ body ‖ CRC-32) 0x00, one encoder and one decoder for both ends.
//!
//! | bytes | field | |
//! | --- | --- | --- |
//! | 0 | kind | [`Kind`] |
//! | 1 | id | number of the endpoint or topic |
//! | 2..4 | sequence | little-endian; an answer repeats its request's, a topic counts its own |
//! | 4..n−4 | body | at most [`MAX_BODY`] bytes |
//! | n−4..n | check | CRC-32 (ISO-HDLC: polynomial 0x04C11DB7 reflected, as in Ethernet and zip) of all before it, little-endian |
//!
//! Consistent overhead byte stuffing (Cheshire and Baker, 1999, doi:10.1109/90.769765) leaves no zero byte inside, so
//! a receiver that lost its place waits for the next zero and is synchronised again.

use cobs::CobsEncoder;
use postcard::ser_flavors::Flavor;

use super::messages::Refusal;
use crate::check::{self, crc32};
use crate::fields::{Fields, Walk, Way};

mod accumulator;

pub use accumulator::{Accumulator, Counts};

/// Largest body that a frame carries.
pub const MAX_BODY: usize = 512;
/// Bytes of the header.
pub const HEADER: usize = 4;
/// Bytes of the check sum.
pub const CHECK: usize = 4;
/// Largest frame before stuffing.
pub const MAX_RAW: usize = HEADER + MAX_BODY + CHECK;
/// Largest frame on the wire, its closing zero included: COBS adds one byte for each 254 begun.
pub const MAX_WIRE: usize = MAX_RAW + MAX_RAW.div_ceil(254) + 1;

/// Largest frame on the wire of what the device says without a request: it is short, so that its sender needs little room.
pub const MAX_TOPIC: usize = 112;

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// The host asks.
    Request = 0,
    /// The device answers.
    Response = 1,
    /// The device refuses; the body is a [`Refusal`].
    Refusal = 2,
    /// The device speaks without a request: telemetry and events.
    Topic = 3,
}

impl Kind {
    /// The kind of a number, if it is one.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Request),
            1 => Some(Self::Response),
            2 => Some(Self::Refusal),
            3 => Some(Self::Topic),
            _ => None,
        }
    }
}

/// The head of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// What the frame is.
    pub kind: Kind,
    /// Endpoint or topic, see [`endpoints`](super::endpoints).
    pub id: u8,
    /// Sequence number: repeated by the answer, counted by each topic, wrapping.
    pub sequence: u16,
}

/// A decoded frame; its body is borrowed from the accumulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The head.
    pub header: Header,
    /// The postcard body.
    pub body: &'a [u8],
}

/// Why bytes are not a frame, or a message does not fit one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The frame is longer than the longest one.
    TooLong,
    /// Fewer bytes than a header and a check sum.
    TooShort,
    /// The stuffing is broken.
    Stuffing,
    /// The check sum differs.
    Check,
    /// The kind is none of [`Kind`].
    Kind,
    /// The message does not fit the body or the buffer.
    Space,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooLong => "the frame is longer than the longest one",
            Self::TooShort => "the frame is shorter than a header and a check sum",
            Self::Stuffing => "the byte stuffing is broken",
            Self::Check => "the check sum is wrong",
            Self::Kind => "the kind of frame is unknown",
            Self::Space => "the message does not fit a frame",
        })
    }
}

impl core::error::Error for FrameError {}

/// Writes a frame around a message and returns its length in `out`, the closing zero included, as a host does it.
///
/// `out` of [`MAX_WIRE`] bytes always suffices. Fails with [`FrameError::Space`] when the message is longer than
/// [`MAX_BODY`] or `out` is too short for it.
pub fn encode<M: serde::Serialize + ?Sized>(
    header: Header,
    message: &M,
    out: &mut [u8],
) -> Result<usize, FrameError> {
    let length = postcard::serialize_with_flavor(message, Writer::new(header, out)?);
    close(length.map_err(|_| FrameError::Space)?, out)
}

/// As [`encode`], by the fields of the message: as a controller does it.
pub fn encode_fields(header: Header, message: &mut dyn Fields, out: &mut [u8]) -> Result<usize, FrameError> {
    let mut writer = Writer::new(header, out)?;
    let mut walk = Walk::new(&mut writer);
    message.walk(&mut walk);
    if !walk.is_whole() {
        return Err(FrameError::Space);
    }
    let length = writer.end().ok_or(FrameError::Space)?;
    close(length, out)
}

/// As [`encode`], for a body that is already bytes.
pub fn encode_bytes(header: Header, body: &[u8], out: &mut [u8]) -> Result<usize, FrameError> {
    let mut writer = Writer::new(header, out)?;
    let length = writer.push(body).and_then(|()| writer.end()).ok_or(FrameError::Space)?;
    close(length, out)
}

/// A frame on its way out. Each byte is checked and stuffed as it comes, so that a message is never held a second time.
struct Writer<'a> {
    wire: CobsEncoder<'a>,
    check: check::Digest,
    /// Bytes that there is still room for.
    room: usize,
}

impl<'a> Writer<'a> {
    fn new(header: Header, out: &'a mut [u8]) -> Result<Self, FrameError> {
        let mut writer = Self { wire: CobsEncoder::new(out), check: check::begin(), room: HEADER + MAX_BODY };
        let [low, high] = header.sequence.to_le_bytes();
        writer.push(&[header.kind as u8, header.id, low, high]).ok_or(FrameError::Space)?;
        Ok(writer)
    }

    #[inline(never)]
    fn push(&mut self, bytes: &[u8]) -> Option<()> {
        self.room = self.room.checked_sub(bytes.len())?;
        self.check.update(bytes);
        self.wire.push(bytes).ok()
    }

    /// Gives the length without the closing zero.
    #[inline(never)]
    fn end(mut self) -> Option<usize> {
        let check = self.check.finalize().to_le_bytes();
        self.wire.push(&check).ok()?;
        Some(self.wire.finalize())
    }
}

impl Way for Writer<'_> {
    fn reads(&self) -> bool {
        false
    }

    fn pass(&mut self, bytes: &mut [u8]) -> bool {
        self.push(bytes).is_some()
    }
}

impl Flavor for Writer<'_> {
    /// The length without the closing zero.
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.push(bytes).ok_or(postcard::Error::SerializeBufferFull)
    }

    fn finalize(self) -> postcard::Result<usize> {
        self.end().ok_or(postcard::Error::SerializeBufferFull)
    }
}

/// Puts the zero behind a frame.
fn close(length: usize, out: &mut [u8]) -> Result<usize, FrameError> {
    *out.get_mut(length).ok_or(FrameError::Space)? = 0;
    Ok(length + 1)
}

/// Decodes one frame in place: the stuffed bytes, without the closing zero.
pub fn decode(stuffed: &mut [u8]) -> Result<Frame<'_>, FrameError> {
    let (header, body) = unstuff(stuffed)?;
    Ok(Frame { header, body: &stuffed[HEADER..HEADER + body] })
}

/// The head of a frame and the length of its body, which is left behind where the head was.
fn unstuff(stuffed: &mut [u8]) -> Result<(Header, usize), FrameError> {
    let length = cobs::decode_in_place(stuffed).map_err(|_| FrameError::Stuffing)?;
    let raw = &stuffed[..length];
    if raw.len() < HEADER + CHECK {
        return Err(FrameError::TooShort);
    }
    // One byte more than the longest frame fits the buffer, because the stuffing of both is equally long.
    if raw.len() > MAX_RAW {
        return Err(FrameError::TooLong);
    }
    let (checked, check) = raw.split_at(raw.len() - CHECK);
    if check != crc32(checked).to_le_bytes() {
        return Err(FrameError::Check);
    }
    let kind = Kind::from_code(checked[0]).ok_or(FrameError::Kind)?;
    let sequence = u16::from_le_bytes([checked[2], checked[3]]);
    Ok((Header { kind, id: checked[1], sequence }, checked.len() - HEADER))
}

/// A frame that has come, and the room for its answer: the same bytes, one after the other, so that a small device needs them
/// once.
#[derive(Debug)]
pub struct Exchange<'a> {
    header: Header,
    body: usize,
    bytes: &'a mut [u8; MAX_WIRE],
}

impl<'a> Exchange<'a> {
    /// The head of what has come.
    pub fn header(&self) -> Header {
        self.header
    }

    /// Its body.
    pub fn body(&self) -> &[u8] {
        &self.bytes[HEADER..HEADER + self.body]
    }

    /// Placed for an answer; what has come is overwritten.
    pub fn room(&mut self) -> &mut [u8; MAX_WIRE] {
        self.bytes
    }

    /// Writes an answer, and gives the length of its frame.
    ///
    /// # Errors
    /// [`Refusal::Range`] when it does not fit a frame.
    pub fn answer(&mut self, kind: Kind, message: &mut dyn Fields) -> Result<usize, Refusal> {
        encode_fields(Header { kind, ..self.header }, message, self.bytes).map_err(|_| Refusal::Range)
    }

    /// The first bytes, when an answer is in them.
    pub fn written(self, length: usize) -> &'a [u8] {
        &self.bytes[..length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(accumulator: &mut Accumulator, bytes: &[u8]) -> (usize, usize) {
        let before = accumulator.counts();
        for &byte in bytes {
            let _ = accumulator.push(byte);
        }
        let after = accumulator.counts();
        ((after.good - before.good) as usize, (after.bad - before.bad) as usize)
    }

    #[test]
    fn the_longest_body_fits_and_one_byte_more_does_not() {
        let header = Header { kind: Kind::Topic, id: 1, sequence: 65535 };
        let mut wire = [0u8; MAX_WIRE];
        let mut longest = 0;
        for fill in [0u8, 1, 255] {
            let body = [fill; MAX_BODY];
            let n = encode_bytes(header, &body, &mut wire).expect("the longest body fits");
            let mut accumulator = Accumulator::new();
            let mut seen = 0;
            for &byte in &wire[..n] {
                if let Some(frame) = accumulator.push(byte) {
                    let frame = frame.expect("a whole frame");
                    assert_eq!(frame.header, header);
                    assert_eq!(frame.body, body);
                    seen += 1;
                }
            }
            assert_eq!(seen, 1);
            longest = longest.max(n);
        }
        assert_eq!(longest, MAX_WIRE, "and fills its room");
        assert_eq!(encode_bytes(header, &[1; MAX_BODY + 1], &mut wire), Err(FrameError::Space));
        assert_eq!(encode_bytes(header, &[1; 100], &mut [0; 60]), Err(FrameError::Space));
    }

    #[test]
    fn a_body_is_read_up_to_its_longest_and_refused_beyond() {
        for (length, expected) in [(511, Ok(511)), (512, Ok(512)), (513, Err(FrameError::TooLong))] {
            let mut raw = vec![Kind::Request as u8, 9, 1, 0];
            raw.resize(HEADER + length, 7);
            raw.extend_from_slice(&crc32(&raw).to_le_bytes());
            let mut wire = vec![0; 2 * MAX_WIRE];
            let stuffed = cobs::encode(&raw, &mut wire);
            let mut accumulator = Accumulator::new();
            let mut seen = None;
            for &byte in &wire[..=stuffed] {
                seen = seen.or(accumulator.push(byte).map(|frame| frame.map(|frame| frame.body.len())));
            }
            assert_eq!(seen, Some(expected), "{length} bytes");
            assert_eq!(decode(&mut wire[..stuffed]).map(|frame| frame.body.len()), expected);
        }
    }

    #[test]
    fn fewer_bytes_than_a_header_and_a_check_sum_are_no_frame() {
        for length in 0..HEADER + CHECK {
            // With a check sum of their own where there is room for one.
            let mut raw = vec![1; length.saturating_sub(CHECK)];
            raw.extend_from_slice(&crc32(&raw).to_le_bytes());
            raw.truncate(length);
            let mut wire = [0; 32];
            let stuffed = cobs::encode(&raw, &mut wire);
            assert_eq!(decode(&mut wire[..stuffed]), Err(FrameError::TooShort), "{length} bytes");
        }
    }

    #[test]
    fn any_single_flipped_bit_is_noticed_and_the_next_frame_is_read() {
        let header = Header { kind: Kind::Request, id: 9, sequence: 300 };
        let mut wire = [0u8; MAX_WIRE];
        let n = encode(header, &[7u8, 0, 0, 200, 13], &mut wire).expect("fits");
        for bit in 0..(n - 1) * 8 {
            let mut broken = wire;
            broken[bit / 8] ^= 1 << (bit % 8);
            let mut accumulator = Accumulator::new();
            let (good, bad) = frames(&mut accumulator, &broken[..n]);
            assert_eq!(good, 0, "bit {bit} passed unseen");
            assert!(bad >= 1);
            assert_eq!(frames(&mut accumulator, &wire[..n]), (1, 0), "after bit {bit}");
        }
    }

    #[test]
    fn finds_its_way_back_after_an_overlong_run_and_after_half_a_frame() {
        let header = Header { kind: Kind::Response, id: 2, sequence: 1 };
        let mut wire = [0u8; MAX_WIRE];
        let n = encode(header, &[1u8; 40][..], &mut wire).expect("fits");
        let mut accumulator = Accumulator::new();
        for _ in 0..5 * MAX_WIRE {
            assert!(accumulator.push(0x55).is_none());
        }
        assert_eq!(accumulator.push(0), Some(Err(FrameError::TooLong)));
        assert_eq!(frames(&mut accumulator, &wire[..n]), (1, 0));
        // Half a frame and then a whole one: the first zero ends the mixture, the frame after it is whole.
        assert_eq!(frames(&mut accumulator, &wire[..n / 2]), (0, 0));
        assert_eq!(frames(&mut accumulator, &wire[..n]), (0, 1));
        assert_eq!(frames(&mut accumulator, &wire[..n]), (1, 0));
    }

    #[test]
    fn an_answer_is_written_over_what_it_answers() {
        let asked = Header { kind: Kind::Request, id: 9, sequence: 300 };
        let mut wire = [0u8; MAX_WIRE];
        let n = encode(asked, &[7u8, 0, 0, 200, 13], &mut wire).expect("fits");
        let mut device = Accumulator::new();
        for &byte in &wire[..n - 1] {
            assert!(device.push(byte).is_none());
        }
        let mut exchange = device.push_to_answer(0).expect("a frame").expect("whole");
        assert_eq!((exchange.header(), exchange.body()), (asked, &[7u8, 0, 0, 200, 13][..]));
        let answered = Header { kind: Kind::Response, ..asked };
        let length = encode_bytes(answered, &[5; MAX_BODY], exchange.room()).expect("the longest body fits");
        let mut host = Accumulator::new();
        assert_eq!(frames(&mut host, exchange.written(length)), (1, 0));
        assert_eq!(
            frames(&mut device, &wire[..n]),
            (1, 0),
            "the next is read as if nothing had been answered"
        );
    }

    proptest::proptest! {
        #[test]
        fn a_frame_is_the_stuffing_of_its_head_body_and_check(body in proptest::collection::vec(0u8..3, 0..MAX_BODY)) {
            let header = Header { kind: Kind::Topic, id: 2, sequence: 256 };
            let mut wire = [0u8; MAX_WIRE];
            let n = encode_bytes(header, &body, &mut wire).expect("fits");
            let mut raw = vec![3, 2, 0, 1];
            raw.extend_from_slice(&body);
            raw.extend_from_slice(&crc32(&raw).to_le_bytes());
            let mut stuffed = [0u8; MAX_WIRE];
            let length = cobs::encode(&raw, &mut stuffed);
            proptest::prop_assert_eq!(&wire[..n], &stuffed[..=length]);
        }

        #[test]
        fn bytes_of_any_kind_never_stop_the_next_frame(noise in proptest::collection::vec(0u8.., 0..2000)) {
            let header = Header { kind: Kind::Response, id: 2, sequence: 1 };
            let mut wire = [0u8; MAX_WIRE];
            let n = encode(header, &[1u8; 40][..], &mut wire).expect("fits");
            let mut accumulator = Accumulator::new();
            frames(&mut accumulator, &noise);
            let _ = accumulator.push(0);
            proptest::prop_assert_eq!(frames(&mut accumulator, &wire[..n]), (1, 0));
        }
    }
}
