//! Another firmware, sent over the link into the slot that is not in use.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::PIECE;
use crate::fields::{fields, one_of};
use crate::firmware_image::HEADER;

/// Begins an installation; the slot that is not in use is no longer valid from then on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct UpdateBegin {
    /// The header of the image, see [`firmware_image`](crate::firmware_image).
    pub header: Vec<u8, HEADER>,
}

fields!(UpdateBegin { header });

/// The next piece of the program; all but the last have a length that is a multiple of eight.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct UpdatePiece {
    /// Place of the first byte.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8, PIECE>,
}

fields!(UpdatePiece { offset, bytes });

/// A program in a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Installed {
    /// Major, minor, patch.
    pub release: [u16; 3],
    /// Length of the program, bytes.
    pub length: u32,
    /// CRC-32 of header and program.
    pub crc: u32,
    /// The higher is the newer.
    pub order: u32,
    /// Whether a host has confirmed it.
    pub confirmed: bool,
}

fields!(Installed { release, length, crc, order, confirmed });

/// The two slots of a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct UpdateStatus {
    /// The slot that runs: 0 or 1.
    pub running: u8,
    /// Addresses of the programs.
    pub addresses: [u32; 2],
    /// Longest program, bytes.
    pub capacity: u32,
    /// What is in each; none where nothing valid is.
    pub slots: [Option<Installed>; 2],
}

fields!(UpdateStatus { running, addresses, capacity, slots });

/// Why an installation is refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum UpdateFault {
    /// Pieces came without a beginning.
    #[default]
    NotBegun,
    /// The header is none, or of another layout.
    Malformed,
    /// The program is for another board.
    Board,
    /// The program is linked for the slot that runs, or for another address.
    Slot,
    /// Longer than the slot.
    TooLong,
    /// The signature is not that of the key in this firmware.
    Signature,
    /// A piece does not follow the one before; this many bytes are there.
    Gap(u32),
    /// The program is not the one of the header.
    Digest,
    /// The flash failed.
    Medium,
    /// The other slot has no program to go back to.
    NoOther,
}

one_of!(UpdateFault {
    0 NotBegun {},
    1 Malformed {},
    2 Board {},
    3 Slot {},
    4 TooLong {},
    5 Signature {},
    6 Gap { 0: there },
    7 Digest {},
    8 Medium {},
    9 NoOther {},
});
