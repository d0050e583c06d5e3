//! Frames of the link on CAN: one to eight devices on one bus, each with an address.
//!
//! The bytes of the link, as on any other line, are cut into messages and put together again. A frame's check sum and its closing zero
//! find what is lost, as on a serial line. A bus has messages of one [`Format`].
//!
//! | format | longest message | byte 0 | byte 1 | then |
//! | --- | --- | --- | --- | --- |
//! | CAN FD | 64 | number | bytes of the link, 1 to 62 | these bytes, and zeros up to the next length that CAN FD has |
//! | classic CAN | 8 | number | 1 to 7 bytes of the link: the message's own length says how many | |
//!
//! The number is counted by the sender for each route, wrapping.
//!
//! | identifier (11 bits) | [`Route`] |
//! | --- | --- |
//! | `0x010` | from the host to all devices, before all else on the bus, to vent: frames of one message, or [`VENT`] |
//! | `0x100 + address` | from the host to one device |
//! | `0x200 + address` | from a device to the host |
//!
//! Source of the lengths and of arbitration by the lower identifier: ISO 11898-1:2015. A message whose end is disturbed may arrive twice
//! (the transmitter repeats it), which its number shows.

/// Longest message of CAN FD, and of any format.
pub const PAYLOAD: usize = 64;
/// Longest message of classic CAN.
pub const CLASSIC: usize = 8;
/// Devices on one bus.
pub const DEVICES: u8 = 8;
/// Lengths that a message of CAN FD can have, beyond 8.
const LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];

/// On classic CAN the one message to all devices: stop, vent and disarm, whatever they are doing. The requests `stop` and `disarm` with
/// their check sums do not fit its 8 bytes. All 64 bits must be right, twice as many as the check sum of a frame has. It has no number:
/// a device that takes it twice vents twice.
pub const VENT: [u8; CLASSIC] = *b"VENT all";

/// What a bus carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// CAN FD.
    #[default]
    Fd,
    /// Classic CAN.
    Classic,
}

impl Format {
    /// Bytes of the link that a message carries at most.
    pub const fn data(self) -> usize {
        match self {
            Self::Fd => PAYLOAD - self.header_length(),
            Self::Classic => CLASSIC - self.header_length(),
        }
    }

    /// The number, and a length where the message's own does not say it.
    const fn header_length(self) -> usize {
        match self {
            Self::Fd => 2,
            Self::Classic => 1,
        }
    }
}

const TO_ALL: u16 = 0x010;
const TO_DEVICE: u16 = 0x100;
const FROM_DEVICE: u16 = 0x200;

/// Which device: 1 to [`DEVICES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Address(u8);

impl Address {
    /// The first.
    pub const FIRST: Self = Self(1);

    /// The address of a number, if there is one.
    pub const fn new(number: u8) -> Option<Self> {
        if number >= 1 && number <= DEVICES { Some(Self(number)) } else { None }
    }

    /// Its number.
    pub const fn number(self) -> u8 {
        self.0
    }

    /// All addresses.
    pub fn all() -> impl Iterator<Item = Self> {
        (1..=DEVICES).map(Self)
    }
}

/// From where to where a message goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// From the host to all devices.
    ToAll,
    /// From the host to a device.
    To(Address),
    /// From a device to the host.
    From(Address),
}

impl Route {
    /// The identifier of its messages.
    pub const fn identifier(self) -> u16 {
        match self {
            Self::ToAll => TO_ALL,
            Self::To(address) => TO_DEVICE + address.0 as u16,
            Self::From(address) => FROM_DEVICE + address.0 as u16,
        }
    }

    /// The route of an identifier; `None` for messages of others on the bus.
    pub const fn of(identifier: u16) -> Option<Self> {
        let Some(address) = Address::new((identifier & 0xFF) as u8) else {
            return if identifier == TO_ALL { Some(Self::ToAll) } else { None };
        };
        match identifier & !0xFF {
            TO_DEVICE => Some(Self::To(address)),
            FROM_DEVICE => Some(Self::From(address)),
            _ => None,
        }
    }
}

/// The sender of one route.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sender {
    format: Format,
    number: u8,
}

impl Sender {
    /// A sender of messages of a format.
    pub const fn new(format: Format) -> Self {
        Self { format, number: 0 }
    }

    /// Cuts bytes of the link, such as a whole frame with its closing zero, into messages.
    pub fn send(&mut self, bytes: &[u8], mut message: impl FnMut(&[u8])) {
        let head = self.format.header_length();
        for piece in bytes.chunks(self.format.data()) {
            let mut payload = [0; PAYLOAD];
            payload[0] = self.number;
            if self.format == Format::Fd {
                payload[1] = piece.len() as u8;
            }
            payload[head..head + piece.len()].copy_from_slice(piece);
            self.number = self.number.wrapping_add(1);
            message(&payload[..padded(head + piece.len())]);
        }
    }
}

/// The next length that a message can have.
fn padded(length: usize) -> usize {
    if length <= 8 {
        return length;
    }
    LENGTHS.into_iter().find(|fits| *fits >= length).unwrap_or(PAYLOAD)
}

/// What a receiver has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages that the numbers miss.
    pub lost: u32,
    /// Messages that arrived twice.
    pub repeated: u32,
    /// Messages that are none of this protocol.
    pub malformed: u32,
}

/// The receiver of one route.
#[derive(Clone, Copy, Debug, Default)]
pub struct Receiver {
    format: Format,
    expected: Option<u8>,
    counts: Counts,
}

impl Receiver {
    /// A receiver of messages of a format.
    pub const fn new(format: Format) -> Self {
        Self { format, expected: None, counts: Counts { lost: 0, repeated: 0, malformed: 0 } }
    }

    /// Takes a message; gives its bytes of the link. Behind a gap a zero comes first, which ends the frame that is not whole.
    pub fn take<'a>(&mut self, payload: &'a [u8]) -> impl Iterator<Item = u8> + use<'a> {
        let bytes = self.accept(payload);
        let (gap, bytes) = bytes.unwrap_or((false, &[]));
        gap.then_some(0).into_iter().chain(bytes.iter().copied())
    }

    /// What it has seen since the beginning.
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    fn accept<'a>(&mut self, payload: &'a [u8]) -> Option<(bool, &'a [u8])> {
        let Some((number, bytes)) = parse(payload, self.format) else {
            self.counts.malformed = self.counts.malformed.wrapping_add(1);
            return None;
        };
        let lost = number.wrapping_sub(self.expected.unwrap_or(number));
        if lost == u8::MAX {
            self.counts.repeated = self.counts.repeated.wrapping_add(1);
            return None;
        }
        self.counts.lost = self.counts.lost.wrapping_add(u32::from(lost));
        self.expected = Some(number.wrapping_add(1));
        Some((lost > 0, bytes))
    }
}

/// Number and bytes of a message.
fn parse(payload: &[u8], format: Format) -> Option<(u8, &[u8])> {
    let (&number, rest) = payload.split_first()?;
    let (length, rest) = match format {
        Format::Classic => (rest.len(), rest),
        Format::Fd => rest.split_first().map(|(&length, rest)| (usize::from(length), rest))?,
    };
    if length == 0 || length > format.data() || payload.len() != padded(format.header_length() + length) {
        return None;
    }
    Some((number, rest.get(..length)?))
}

#[cfg(test)]
mod tests;
