//! The protocol of serial CAN adapters (slcan, after Lawicel's CAN232): text lines that end with a carriage return.
//!
//! | line | meaning |
//! | --- | --- |
//! | `C`, `S4` to `S8`, `O` | closes the channel, sets its bit rate, opens it |
//! | `tIIILDD…` | a standard message both ways: identifier and length in hexadecimal digits, data |
//! | an empty line, `z` | done |
//! | the character 7 | refused |
//!
//! A received message may be followed by four digits of time. Not all adapters answer every line. Remote and extended messages, those of
//! CAN FD (`d`, `D`, `b`, `B`) and answers about versions and flags are passed over.

use std::fmt::Write;

use model_core::link::can::CLASSIC;

/// Ends a line.
const END: u8 = b'\r';
const REFUSED: u8 = 7;
/// Longest line that is kept: an extended message of CAN FD with its time has 142 characters.
const LONGEST: usize = 160;
/// Digits of a received message's time.
const TIME: usize = 4;
/// How lines begin that an adapter may send and that have no meaning here.
const PASSED_OVER: &[u8] = b"TrRdDbBFVvNnZzALE";

/// What an adapter has said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// A standard message with its identifier.
    Message(u16, Vec<u8>),
    /// The last line is done.
    Done,
    /// The last line is refused.
    Refused,
    /// Something without a meaning here.
    PassedOver,
    /// Nothing that an adapter says.
    Foreign,
}

/// Gathers bytes into lines.
#[derive(Debug, Default)]
pub struct Parser {
    line: Vec<u8>,
}

impl Parser {
    /// Takes a byte; gives what a line says at its end.
    pub fn push(&mut self, byte: u8) -> Option<Received> {
        match byte {
            REFUSED => {
                self.line.clear();
                Some(Received::Refused)
            }
            END => {
                let received = received(&self.line);
                self.line.clear();
                Some(received)
            }
            // Some adapters end a line with both.
            b'\n' => None,
            _ => {
                // One more than the longest stays too long.
                if self.line.len() <= LONGEST {
                    self.line.push(byte);
                }
                None
            }
        }
    }
}

fn received(line: &[u8]) -> Received {
    match line {
        [] | [b'z' | b'Z'] => Received::Done,
        [b't', rest @ ..] => message(rest).unwrap_or(Received::Foreign),
        [first, ..] if line.len() <= LONGEST && line.is_ascii() && PASSED_OVER.contains(first) => {
            Received::PassedOver
        }
        _ => Received::Foreign,
    }
}

/// A message without its first letter.
fn message(line: &[u8]) -> Option<Received> {
    let digits: Option<Vec<u8>> = line
        .iter()
        .map(|byte| char::from(*byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok()))
        .collect();
    let digits = digits?;
    let ([a, b, c, length], data) = digits.split_first_chunk::<4>()?;
    let length = usize::from(*length);
    if length > CLASSIC || (data.len() != 2 * length && data.len() != 2 * length + TIME) {
        return None;
    }
    let identifier = u16::from(*a) << 8 | u16::from(*b) << 4 | u16::from(*c);
    let bytes = data[..2 * length].chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect();
    (identifier < 0x800).then_some(Received::Message(identifier, bytes))
}

/// The line that sends a message.
#[must_use]
pub fn transmit(identifier: u16, data: &[u8]) -> String {
    let mut line = format!("t{identifier:03X}{}", data.len());
    for byte in data {
        // Writing to a string does not fail.
        let _ = write!(line, "{byte:02X}");
    }
    line.push('\r');
    line
}

/// The line that sets a bit rate.
#[must_use]
pub(crate) const fn bit_rate(kbit_per_s: u16) -> &'static str {
    match kbit_per_s {
        125 => "S4\r",
        250 => "S5\r",
        1000 => "S8\r",
        _ => "S6\r",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<Received> {
        let mut parser = Parser::default();
        bytes.iter().filter_map(|byte| parser.push(*byte)).collect()
    }

    #[test]
    fn a_message_is_read_as_it_is_written() {
        for length in 0..=8 {
            let data: Vec<u8> = (0..length).map(|n| 0xA0 + n).collect();
            let line = transmit(0x201, &data);
            assert_eq!(all(line.as_bytes()), [Received::Message(0x201, data.clone())]);
            let timed = format!("{}1f2e\r", line.trim_end());
            assert_eq!(all(timed.as_bytes()), [Received::Message(0x201, data)]);
        }
        assert_eq!(transmit(0x010, b"VENT all"), "t010856454E5420616C6C\r");
    }

    #[test]
    fn other_lines_of_an_adapter_are_distinguished() {
        let said = all(b"\rz\r\x07V1013\rT000000801AA\rt10\x07t2011FF\n\r");
        let message = Received::Message(0x201, vec![0xFF]);
        assert_eq!(
            said,
            [
                Received::Done,
                Received::Done,
                Received::Refused,
                Received::PassedOver,
                Received::PassedOver,
                Received::Refused,
                message
            ]
        );
    }

    #[test]
    fn a_line_that_is_no_message_is_none() {
        for line in [
            "t",
            "t1",
            "t101",
            "t1019",
            "t101F0011223344556677",
            "t1012AA",
            "t1011AABB",
            "t1011AA123",
            "t1011GG",
            "t8010",
            "tFFF0",
            "t101-1",
            "hello",
            "login: ",
            "t1011\u{e9}",
        ] {
            assert_eq!(all(format!("{line}\r").as_bytes()), [Received::Foreign], "{line}");
        }
        let endless = "t1011AA".repeat(100);
        assert_eq!(
            all(format!("{endless}\rt2010\r").as_bytes()),
            [Received::Foreign, Received::Message(0x201, Vec::new())]
        );
    }

    #[test]
    fn any_bytes_are_survived_and_the_next_line_is_read() {
        let mut state = 1_u32;
        let mut parser = Parser::default();
        for _ in 0..200_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let _ = parser.push((state >> 24) as u8);
        }
        let _ = parser.push(END);
        let said: Vec<Received> = b"t2010\r".iter().filter_map(|byte| parser.push(*byte)).collect();
        assert_eq!(said, [Received::Message(0x201, Vec::new())]);
    }
}
