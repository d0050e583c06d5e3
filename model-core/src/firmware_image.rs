//! Layout of a firmware image in one of a board's two slots: a signed header, words that are programmed once, the program.
//!
//! | place | content |
//! | --- | --- |
//! | 0 | header: what is signed, and the signature ([`Header`]) |
//! | 0x100 | order among the two slots: the higher is the newer |
//! | 0x104 | CRC-32 of header and program |
//! | 0x108 | [`VALID`], written last of an installation |
//! | 0x10C | three starts that have been tried |
//! | 0x118 | confirmed: the host has talked to this program |
//! | 0x200 | the program, from its vector table on |
//!
//! Flash bits can only be cleared between two erasures, so each word of state is erased or programmed, never changed.

use crate::check;

/// Bytes of the header that are signed.
pub const SIGNED: usize = 88;
/// Bytes of a header.
pub const HEADER: usize = SIGNED + 64;
/// Place of the words of state.
pub const STATE: u32 = 0x100;
/// Place of the program: a vector table of 113 entries is aligned to 512 bytes.
pub const PROGRAM: u32 = 0x200;
/// The word of an installation that is complete.
pub const VALID: u32 = 0x2A5C_96E1;
/// In place of the CRC-32 of a program that a debug probe has programmed; its header then has a digest of zeros.
pub const UNSUMMED: u32 = 0x0F0F_5AA5;
/// A word of state that has not been written.
pub const ERASED: u32 = u32::MAX;
/// Starts of a program that no host has confirmed.
pub const TRIES: usize = 3;

const MAGIC: [u8; 4] = *b"PAMF";
const LAYOUT: u16 = 1;

/// What is known of a program before it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Code of its board, see [`Board`](crate::link::hello::Board).
    pub board: u8,
    /// The slot that it is linked for: 0 or 1.
    pub slot: u8,
    /// Length of the program, bytes.
    pub length: u32,
    /// Its release.
    pub release: (u16, u16, u16),
    /// Address that it is linked to.
    pub address: u32,
    /// SHA-512 of the program.
    pub digest: [u8; 64],
    /// Ed25519 signature of all above.
    pub signature: [u8; 64],
}

impl Header {
    /// The bytes that are signed.
    #[must_use]
    pub fn signed(&self) -> [u8; SIGNED] {
        let mut out = [0; SIGNED];
        out[..4].copy_from_slice(&MAGIC);
        out[4..6].copy_from_slice(&LAYOUT.to_le_bytes());
        out[6] = self.board;
        out[7] = self.slot;
        out[8..12].copy_from_slice(&self.length.to_le_bytes());
        out[12..14].copy_from_slice(&self.release.0.to_le_bytes());
        out[14..16].copy_from_slice(&self.release.1.to_le_bytes());
        out[16..18].copy_from_slice(&self.release.2.to_le_bytes());
        out[20..24].copy_from_slice(&self.address.to_le_bytes());
        out[24..].copy_from_slice(&self.digest);
        out
    }

    /// All bytes.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; HEADER] {
        let mut out = [0; HEADER];
        out[..SIGNED].copy_from_slice(&self.signed());
        out[SIGNED..].copy_from_slice(&self.signature);
        out
    }

    /// Reads a header; none where the bytes are something else, or a layout that is not known.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (bytes, _) = bytes.split_first_chunk::<HEADER>()?;
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        if bytes[..4] != MAGIC || half(4) != LAYOUT || half(18) != 0 {
            return None;
        }
        let mut digest = [0; 64];
        digest.copy_from_slice(&bytes[24..SIGNED]);
        let mut signature = [0; 64];
        signature.copy_from_slice(&bytes[SIGNED..]);
        Some(Self {
            board: bytes[6],
            slot: bytes[7],
            length: word(8),
            release: (half(12), half(14), half(16)),
            address: word(20),
            digest,
            signature,
        })
    }
}

/// The words of state of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    /// Order among the slots.
    pub order: u32,
    /// CRC-32 of header and program.
    pub crc: u32,
    /// [`VALID`] or something else.
    pub valid: u32,
    /// Starts that have been tried: any that is not erased.
    pub tries: [u32; TRIES],
    /// Confirmed: if not erased.
    pub confirmed: u32,
}

/// Bytes of the words of state.
pub const STATE_LENGTH: usize = 4 * (4 + TRIES);
/// Places of single words of state within a slot.
pub const VALID_AT: u32 = STATE + 8;
/// See [`VALID_AT`].
pub const CONFIRMED_AT: u32 = STATE + 12 + 4 * TRIES as u32;

/// Place of the word of a try within a slot.
#[must_use]
pub const fn try_at(number: usize) -> u32 {
    STATE + 12 + 4 * number as u32
}

/// The words before the program of an image that a debug probe programs into slot 0: confirmed, and without a sum, because the probe
/// has compared it.
#[must_use]
pub const fn probed(board: u8, release: (u16, u16, u16), address: u32) -> [u8; PROGRAM as usize] {
    let mut out = [0xFF; PROGRAM as usize];
    let mut at = 0;
    while at < HEADER {
        out[at] = 0;
        at += 1;
    }
    out[6] = board;
    put(&mut out, 0, &MAGIC);
    put(&mut out, 4, &LAYOUT.to_le_bytes());
    put(&mut out, 12, &release.0.to_le_bytes());
    put(&mut out, 14, &release.1.to_le_bytes());
    put(&mut out, 16, &release.2.to_le_bytes());
    put(&mut out, 20, &(address + PROGRAM).to_le_bytes());
    put(&mut out, STATE as usize, &[0; 4]);
    put(&mut out, STATE as usize + 4, &UNSUMMED.to_le_bytes());
    put(&mut out, VALID_AT as usize, &VALID.to_le_bytes());
    put(&mut out, CONFIRMED_AT as usize, &[0; 4]);
    out
}

const fn put(out: &mut [u8], place: usize, bytes: &[u8]) {
    let mut at = 0;
    while at < bytes.len() {
        out[place + at] = bytes[at];
        at += 1;
    }
}

impl State {
    /// Reads the words.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; STATE_LENGTH]) -> Self {
        let word = |at: usize| {
            u32::from_le_bytes([bytes[4 * at], bytes[4 * at + 1], bytes[4 * at + 2], bytes[4 * at + 3]])
        };
        Self {
            order: word(0),
            crc: word(1),
            valid: word(2),
            tries: [word(3), word(4), word(5)],
            confirmed: word(6),
        }
    }

    /// The first try that is left; none where all have been used.
    #[must_use]
    pub fn next_try(&self) -> Option<usize> {
        self.tries.iter().position(|word| *word == ERASED)
    }

    /// Whether a host has confirmed the program.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        self.confirmed != ERASED
    }
}

/// CRC-32 of a header and its program.
#[must_use]
pub fn sum(header: &[u8; HEADER], program: &[u8]) -> u32 {
    let mut digest = check::begin();
    digest.update(header);
    digest.update(program);
    digest.finalize()
}

/// A slot as a boot loader finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its words of state.
    pub state: State,
    /// Whether its program is whole: header of this board and this slot, length that fits, CRC-32.
    pub whole: bool,
}

impl Found {
    /// Whether it may be started at all.
    #[must_use]
    pub fn is_startable(&self) -> bool {
        self.whole && self.state.valid == VALID
    }
}

/// A slot as a boot loader finds it in its bytes. `address` is that of the slot.
#[must_use]
pub fn found(bytes: &[u8], board: u8, slot: u8, address: u32) -> Found {
    let state = bytes.get(STATE as usize..).and_then(|state| state.first_chunk::<STATE_LENGTH>());
    let state = State::from_bytes(state.unwrap_or(&[0xFF; STATE_LENGTH]));
    Found { whole: is_whole(bytes, &state, board, slot, address), state }
}

/// Whether a slot holds a program of this board and this slot that has not changed since it was installed.
fn is_whole(bytes: &[u8], state: &State, board: u8, slot: u8, address: u32) -> bool {
    let Some(written) = bytes.first_chunk::<HEADER>() else { return false };
    let Some(header) = Header::from_bytes(written) else { return false };
    let program = bytes.get(PROGRAM as usize..).and_then(|rest| rest.get(..header.length as usize));
    let Some(program) = program else { return false };
    if header.board != board || header.slot != slot || header.address != address + PROGRAM {
        return false;
    }
    if state.crc == UNSUMMED && header.digest == [0; 64] {
        return true;
    }
    sum(written, program) == state.crc
}

/// What a boot loader does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Starts this slot; before that it marks this try, where there is one.
    Start {
        /// 0 or 1.
        slot: usize,
        /// Try to mark.
        mark: Option<usize>,
    },
    /// Neither slot has a program.
    Nothing,
}

/// The slot to start: the newer one that is whole and either confirmed or not yet tried too often; else the other; and where both have
/// been tried too often, the newer one all the same, because a device that starts nothing can only be repaired with a debug probe.
#[must_use]
pub fn choose(slots: &[Found; 2]) -> Choice {
    let newer = match (slots[0].is_startable(), slots[1].is_startable()) {
        (false, false) => return Choice::Nothing,
        (true, false) => 0,
        (false, true) => 1,
        // Orders differ by one; with a wrap the later one is 0.
        (true, true) => usize::from(slots[1].state.order.wrapping_sub(slots[0].state.order) as i32 > 0),
    };
    for slot in [newer, 1 - newer] {
        let state = &slots[slot].state;
        if !slots[slot].is_startable() {
            continue;
        }
        if state.is_confirmed() {
            return Choice::Start { slot, mark: None };
        }
        if let Some(mark) = state.next_try() {
            return Choice::Start { slot, mark: Some(mark) };
        }
    }
    Choice::Start { slot: newer, mark: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        Header {
            board: 2,
            slot: 1,
            length: 100_000,
            release: (1, 2, 3),
            address: 0x0804_0200,
            digest: core::array::from_fn(|n| n as u8),
            signature: core::array::from_fn(|n| 255 - n as u8),
        }
    }

    #[test]
    fn a_header_is_read_as_it_was_written_and_other_bytes_are_none() {
        let bytes = header().to_bytes();
        assert_eq!(Header::from_bytes(&bytes), Some(header()));
        assert_eq!(bytes[..SIGNED], header().signed());
        for at in [0, 3, 4, 18] {
            let mut wrong = bytes;
            wrong[at] ^= 1;
            assert_eq!(Header::from_bytes(&wrong), None, "byte {at}");
        }
        assert_eq!(Header::from_bytes(&bytes[..HEADER - 1]), None);
        assert_eq!(Header::from_bytes(&[0xFF; HEADER]), None, "an erased slot");
    }

    fn slot(order: u32, tried: usize, confirmed: bool) -> Found {
        let tries = core::array::from_fn(|at| if at < tried { 0 } else { ERASED });
        let confirmed = if confirmed { 0 } else { ERASED };
        Found { state: State { order, crc: 0, valid: VALID, tries, confirmed }, whole: true }
    }

    const EMPTY: Found = Found {
        state: State { order: ERASED, crc: ERASED, valid: ERASED, tries: [ERASED; 3], confirmed: ERASED },
        whole: false,
    };

    #[test]
    fn the_newer_program_is_tried_three_times_and_then_the_older_one_is_back() {
        let old = slot(5, 1, true);
        for tried in 0..TRIES {
            let start = Choice::Start { slot: 1, mark: Some(tried) };
            assert_eq!(choose(&[old, slot(6, tried, false)]), start);
        }
        assert_eq!(choose(&[old, slot(6, 3, false)]), Choice::Start { slot: 0, mark: None }, "rolled back");
        assert_eq!(choose(&[old, slot(6, 3, true)]), Choice::Start { slot: 1, mark: None }, "confirmed");
        assert_eq!(
            choose(&[slot(0, 0, true), slot(u32::MAX, 0, true)]),
            Choice::Start { slot: 0, mark: None }
        );
    }

    #[test]
    fn a_slot_is_whole_if_its_program_is_the_one_that_was_installed_there() {
        let address = 0x0804_0000;
        let program = [0x5A; 300];
        let header = Header { length: 300, ..header() }.to_bytes();
        let mut bytes = [0xFF; PROGRAM as usize + 400];
        bytes[..HEADER].copy_from_slice(&header);
        bytes[PROGRAM as usize..][..300].copy_from_slice(&program);
        bytes[STATE as usize + 4..][..4].copy_from_slice(&sum(&header, &program).to_le_bytes());
        bytes[VALID_AT as usize..][..4].copy_from_slice(&VALID.to_le_bytes());
        assert!(found(&bytes, 2, 1, address).is_startable());
        for (board, slot, address) in [(1, 1, address), (2, 0, address), (2, 1, address + 4)] {
            assert!(!found(&bytes, board, slot, address).is_startable());
        }
        for at in [0, 60, 150, STATE as usize + 4, VALID_AT as usize, PROGRAM as usize + 299] {
            let mut wrong = bytes;
            wrong[at] ^= 1;
            assert!(!found(&wrong, 2, 1, address).is_startable(), "byte {at}");
        }
        assert!(!found(&bytes[..PROGRAM as usize + 299], 2, 1, address).is_startable());
        assert!(!found(&[], 2, 1, address).is_startable());
        let probed = probed(2, (0, 1, 0), 0x0801_0000);
        let there = found(&probed, 2, 0, 0x0801_0000);
        assert!(there.is_startable() && there.state.is_confirmed());
    }

    #[test]
    fn incomplete_or_invalid_firmware_is_never_started() {
        let good = slot(5, 0, true);
        let mut torn = slot(6, 0, true);
        torn.state.valid = VALID & 0xFFFF;
        assert_eq!(choose(&[good, torn]), Choice::Start { slot: 0, mark: None });
        let damaged = Found { whole: false, ..slot(6, 0, true) };
        assert_eq!(choose(&[good, damaged]), Choice::Start { slot: 0, mark: None });
        assert_eq!(choose(&[EMPTY, good]), Choice::Start { slot: 1, mark: None });
        assert_eq!(choose(&[EMPTY, damaged]), Choice::Nothing);
        assert_eq!(
            choose(&[EMPTY, slot(6, 3, false)]),
            Choice::Start { slot: 1, mark: None },
            "better than nothing"
        );
    }
}
