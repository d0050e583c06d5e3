//! `hello`: the first answer of every device, in a layout that never changes.
//!
//! Request: endpoint 0 with an empty body. Answer: endpoint 0 with the [`LENGTH`] bytes below, little-endian, not
//! postcard. Bytes may be appended by later versions; none of these ever moves, so that any host can name what any
//! device speaks, and say which of the two is older.
//!
//! | bytes | field |
//! | --- | --- |
//! | 0..4 | `PAM!` |
//! | 4..10 | release: major, minor, patch (`u16` each) |
//! | 10..12 | link version |
//! | 12..14 | table format |
//! | 14..16 | store format |
//! | 16..24 | schema hash (`u64`) |
//! | 24 | board ([`Board`] code) |
//! | 25 | muscles that the board can drive |
//! | 26..28 | reserved, zero |
//! | 28..40 | serial number of the chip |
//! | 40..44 | starts since the store was made |

/// Endpoint of `hello`.
pub const ID: u8 = 0;
/// Length of the answer's fixed part.
pub const LENGTH: usize = 44;
/// How every answer begins.
pub const MAGIC: [u8; 4] = *b"PAM!";

/// Boards by their number on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Board {
    /// The firmware's library running on a host.
    Native = 0,
    /// Arm MPS2 with the AN386 image, in QEMU.
    Mps2An386 = 1,
    /// ST Nucleo-F446RE.
    NucleoF446re = 2,
}

impl Board {
    /// The board of a number; `None` for a board that this version does not know.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Native),
            1 => Some(Self::Mps2An386),
            2 => Some(Self::NucleoF446re),
            _ => None,
        }
    }

    /// The name people use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Mps2An386 => "mps2-an386",
            Self::NucleoF446re => "nucleo-f446re",
        }
    }
}

/// Every version of a device, and which device it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hello {
    /// Release of the firmware: major, minor, patch.
    pub release: (u16, u16, u16),
    /// Number of the message set, see [`LINK_VERSION`](super::LINK_VERSION).
    pub link_version: u16,
    /// Version of table images that the device reads.
    pub table_format: u16,
    /// Version of the store's layout.
    pub store_format: u16,
    /// Hash of all endpoints and messages, see [`SCHEMA_HASH`](super::SCHEMA_HASH).
    pub schema_hash: u64,
    /// Board code; see [`Board::from_code`].
    pub board: u8,
    /// How many muscles the board can drive.
    pub muscles: u8,
    /// Serial number of the chip, zeros where it has none.
    pub serial: [u8; 12],
    /// Starts since the store was made.
    pub starts: u32,
}

/// Why an answer is not a `hello`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotHello {
    /// Fewer bytes than the fixed part.
    Short,
    /// It does not begin with `PAM!`: the peer is something else.
    Magic,
}

impl Hello {
    /// The bytes of the answer.
    pub fn to_bytes(&self) -> [u8; LENGTH] {
        let mut out = [0; LENGTH];
        out[..4].copy_from_slice(&MAGIC);
        out[4..6].copy_from_slice(&self.release.0.to_le_bytes());
        out[6..8].copy_from_slice(&self.release.1.to_le_bytes());
        out[8..10].copy_from_slice(&self.release.2.to_le_bytes());
        out[10..12].copy_from_slice(&self.link_version.to_le_bytes());
        out[12..14].copy_from_slice(&self.table_format.to_le_bytes());
        out[14..16].copy_from_slice(&self.store_format.to_le_bytes());
        out[16..24].copy_from_slice(&self.schema_hash.to_le_bytes());
        out[24] = self.board;
        out[25] = self.muscles;
        out[28..40].copy_from_slice(&self.serial);
        out[40..44].copy_from_slice(&self.starts.to_le_bytes());
        out
    }

    /// Reads an answer; bytes behind the fixed part are of a later version and left alone.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NotHello> {
        let (fixed, _) = bytes.split_first_chunk::<LENGTH>().ok_or(NotHello::Short)?;
        if fixed[..4] != MAGIC {
            return Err(NotHello::Magic);
        }
        let half = |at: usize| u16::from_le_bytes([fixed[at], fixed[at + 1]]);
        let mut hash = [0; 8];
        hash.copy_from_slice(&fixed[16..24]);
        let mut serial = [0; 12];
        serial.copy_from_slice(&fixed[28..40]);
        Ok(Self {
            release: (half(4), half(6), half(8)),
            link_version: half(10),
            table_format: half(12),
            store_format: half(14),
            schema_hash: u64::from_le_bytes(hash),
            board: fixed[24],
            muscles: fixed[25],
            serial,
            starts: u32::from_le_bytes([fixed[40], fixed[41], fixed[42], fixed[43]]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_keeps_its_number_and_its_name() {
        let boards = [
            (0, Board::Native, "native"),
            (1, Board::Mps2An386, "mps2-an386"),
            (2, Board::NucleoF446re, "nucleo-f446re"),
        ];
        for (code, board, name) in boards {
            assert_eq!((Board::from_code(code), board as u8, board.name()), (Some(board), code, name));
        }
        assert_eq!(Board::from_code(3), None, "a board of a later version");
    }

    /// If this test breaks, the layout of `hello` was changed, and every host in the field can no longer name what it
    /// met. Put the new field behind byte 44 instead.
    #[test]
    fn the_layout_is_frozen() {
        let hello = Hello {
            release: (1, 2, 3),
            link_version: 4,
            table_format: 5,
            store_format: 6,
            schema_hash: 0x0807_0605_0403_0201,
            board: 1,
            muscles: 2,
            serial: *b"abcdefghijkl",
            starts: 0x0101,
        };
        let bytes: [u8; LENGTH] = [
            b'P', b'A', b'M', b'!', 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0, 1, 2, 3, 4, 5, 6, 7, 8, 1, 2, 0, 0,
            b'a', b'b', b'c', b'd', b'e', b'f', b'g', b'h', b'i', b'j', b'k', b'l', 1, 1, 0, 0,
        ];
        assert_eq!(hello.to_bytes(), bytes);
        let mut longer = bytes.to_vec();
        longer.extend_from_slice(&[9, 9, 9]);
        assert_eq!(Hello::from_bytes(&longer), Ok(hello));
        assert_eq!(Hello::from_bytes(&bytes[..43]), Err(NotHello::Short));
        assert_eq!(Hello::from_bytes(&[0; LENGTH]), Err(NotHello::Magic));
    }
}
