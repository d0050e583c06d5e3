//! Another firmware over the link: into the slot that does not run, checked as a whole, and only then the one of the next start.
//!
//! ```text
//! begin    header: signature, board, slot, length; the other slot is made invalid
//! piece    erases each sector before its first byte, programs the bytes
//! commit   SHA-512 of what is there against the signed header; header, order, CRC-32; the word `VALID` last
//! restart  the boot loader marks a try and starts it
//! confirm  the host has talked to it: it stays. Without this, the fourth start is that of the program before
//! ```
//! Whenever power fails, one of the two programs is whole and is started. The layout is that of
//! [`model_core::firmware_image`].

use ed25519_dalek::{Signature, VerifyingKey};
use model_core::firmware_image::{
    self, CONFIRMED_AT, Found, HEADER, Header, PROGRAM, STATE, STATE_LENGTH, State, VALID, VALID_AT,
};
use model_core::link::messages::{Installed, Refusal, UpdateFault, UpdatePiece, UpdateStatus};
use sha2::{Digest, Sha512};

/// Public key of who may send firmware.
pub type Key = [u8; 32];

/// The flash of both slots. Places are counted from the beginning of a slot; an access blocks.
pub trait SlotFlash {
    /// The slot that runs: 0 or 1.
    fn running(&self) -> u8;
    /// Address of a slot.
    fn address(&self, slot: u8) -> u32;
    /// Bytes of the smaller slot.
    fn capacity(&self) -> u32;
    /// Code of the board.
    fn board(&self) -> u8;
    /// All bytes of a slot, as they are now.
    fn bytes(&self, slot: u8) -> &[u8];
    /// Programs words, on erased places.
    ///
    /// # Errors
    /// The flash fails.
    fn program(&mut self, slot: u8, place: u32, bytes: &[u8]) -> Result<(), Failed>;
    /// Erases the sector of a slot that begins at this place, if one does.
    ///
    /// # Errors
    /// The flash fails.
    fn erase_at(&mut self, slot: u8, place: u32) -> Result<(), Failed>;
    /// Place of the first sector behind this place.
    fn next_sector(&self, slot: u8, place: u32) -> u32;
    /// Does what a boot loader would, where there is none.
    fn boot(&mut self) {}
}

/// The flash failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failed;

impl From<Failed> for Refusal {
    fn from(_: Failed) -> Self {
        Self::Update(UpdateFault::Medium)
    }
}

/// An installation that has begun.
struct Begun {
    header: Header,
    bytes: [u8; HEADER],
    there: u32,
    /// Erased up to this place of the slot.
    erased: u32,
}

/// What takes another firmware.
pub struct Updater<S> {
    key: Key,
    begun: Option<Begun>,
    slots: S,
}

/// An [`Updater`] of any flash.
pub trait Update {
    /// See [`Updater::status`].
    ///
    /// # Errors
    /// As there, and so for all others.
    fn status(&mut self, answer: &mut UpdateStatus) -> Result<(), Refusal>;
    /// See [`Updater::begin`].
    ///
    /// # Errors
    /// As there.
    fn begin(&mut self, header: &[u8]) -> Result<(), Refusal>;
    /// See [`Updater::piece`].
    ///
    /// # Errors
    /// As there.
    fn piece(&mut self, piece: &UpdatePiece) -> Result<u32, Refusal>;
    /// See [`Updater::commit`].
    ///
    /// # Errors
    /// As there.
    fn commit(&mut self) -> Result<(), Refusal>;
    /// See [`Updater::confirm`].
    ///
    /// # Errors
    /// As there.
    fn confirm(&mut self) -> Result<(), Refusal>;
    /// See [`Updater::revert`].
    ///
    /// # Errors
    /// As there.
    fn revert(&mut self) -> Result<(), Refusal>;
    /// The device restarts: where a process plays the device, it does what the boot loader would.
    fn restarted(&mut self);
}

impl<S: SlotFlash> Update for Updater<S> {
    fn status(&mut self, answer: &mut UpdateStatus) -> Result<(), Refusal> {
        self.status(answer)
    }

    fn begin(&mut self, header: &[u8]) -> Result<(), Refusal> {
        self.begin(header)
    }

    fn piece(&mut self, piece: &UpdatePiece) -> Result<u32, Refusal> {
        self.piece(piece)
    }

    fn commit(&mut self) -> Result<(), Refusal> {
        self.commit()
    }

    fn confirm(&mut self) -> Result<(), Refusal> {
        self.confirm()
    }

    fn revert(&mut self) -> Result<(), Refusal> {
        self.revert()
    }

    fn restarted(&mut self) {
        self.begun = None;
        self.slots.boot();
    }
}

const fn no(fault: UpdateFault) -> Refusal {
    Refusal::Update(fault)
}

impl<S: SlotFlash> Updater<S> {
    /// For the flash of a board, and a key.
    pub const fn new(slots: S, key: Key) -> Self {
        Self { key, begun: None, slots }
    }
}

impl<S: SlotFlash> Updater<S> {
    /// The flash.
    pub fn slots(&mut self) -> &mut S {
        &mut self.slots
    }

    /// A slot as the boot loader finds it.
    pub fn found(&self, slot: u8) -> Found {
        firmware_image::found(self.slots.bytes(slot), self.slots.board(), slot, self.slots.address(slot))
    }

    fn other(&self) -> u8 {
        1 - (self.slots.running() & 1)
    }

    fn installed(&self, slot: u8) -> Option<(Installed, State)> {
        let bytes = self.slots.bytes(slot);
        let state = State::from_bytes(bytes.get(STATE as usize..)?.first_chunk::<STATE_LENGTH>()?);
        let header = Header::from_bytes(bytes).filter(|_| state.valid == VALID)?;
        let (major, minor, patch) = header.release;
        let installed = Installed {
            release: [major, minor, patch],
            length: header.length,
            crc: state.crc,
            order: state.order,
            confirmed: state.is_confirmed(),
        };
        Some((installed, state))
    }

    /// What is in both slots.
    ///
    /// # Errors
    /// [`UpdateFault::Medium`].
    pub fn status(&mut self, answer: &mut UpdateStatus) -> Result<(), Refusal> {
        answer.running = self.slots.running();
        answer.addresses = [0, 1].map(|slot| self.slots.address(slot) + PROGRAM);
        answer.capacity = self.slots.capacity() - PROGRAM;
        for slot in [0, 1] {
            answer.slots[usize::from(slot)] = self.installed(slot).map(|(installed, _)| installed);
        }
        Ok(())
    }

    /// Begins: what was begun before is forgotten, and the other slot is invalid from now on.
    ///
    /// # Errors
    /// A header that is malformed, not signed by the key, or of another board, slot, address or length.
    #[inline(never)]
    pub fn begin(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        self.begun = None;
        let whole = <[u8; HEADER]>::try_from(bytes).map_err(|_| no(UpdateFault::Malformed))?;
        let header = Header::from_bytes(&whole).ok_or(no(UpdateFault::Malformed))?;
        let slot = self.other();
        if header.board != self.slots.board() {
            return Err(no(UpdateFault::Board));
        }
        if header.slot != slot || header.address != self.slots.address(slot) + PROGRAM {
            return Err(no(UpdateFault::Slot));
        }
        if header.length == 0 || header.length > self.slots.capacity() - PROGRAM {
            return Err(no(UpdateFault::TooLong));
        }
        if !self.is_signed(&header) {
            return Err(no(UpdateFault::Signature));
        }
        if self.installed(slot).is_some() {
            // An erasure that loses power may leave any bits; this word cannot come back.
            self.slots.program(slot, VALID_AT, &[0; 4])?;
        }
        self.begun = Some(Begun { header, bytes: whole, there: 0, erased: 0 });
        Ok(())
    }

    fn is_signed(&self, header: &Header) -> bool {
        let Ok(key) = VerifyingKey::from_bytes(&self.key) else { return false };
        // Strict: no keys or signatures for which several messages verify.
        key.verify_strict(&header.signed(), &Signature::from_bytes(&header.signature)).is_ok()
    }

    /// Takes the next piece; gives how many bytes are there. The piece before may come again, where its answer was lost.
    ///
    /// # Errors
    /// [`UpdateFault::NotBegun`], [`UpdateFault::Gap`], [`UpdateFault::TooLong`], [`UpdateFault::Medium`].
    pub fn piece(&mut self, piece: &UpdatePiece) -> Result<u32, Refusal> {
        let slot = self.other();
        let begun = self.begun.as_mut().ok_or(no(UpdateFault::NotBegun))?;
        let end = piece.offset.checked_add(piece.bytes.len() as u32).ok_or(no(UpdateFault::TooLong))?;
        if end > begun.header.length {
            return Err(no(UpdateFault::TooLong));
        }
        let last = end == begun.header.length;
        if end == begun.there && !piece.bytes.is_empty() {
            return Ok(begun.there);
        }
        if piece.offset != begun.there || !(last || piece.bytes.len().is_multiple_of(8)) {
            return Err(no(UpdateFault::Gap(begun.there)));
        }
        while begun.erased < PROGRAM + end {
            self.slots.erase_at(slot, begun.erased)?;
            begun.erased = self.slots.next_sector(slot, begun.erased);
        }
        let (words, rest) = piece.bytes.as_chunks::<8>();
        self.slots.program(slot, PROGRAM + piece.offset, words.as_flattened())?;
        if !rest.is_empty() {
            let mut word = [0xFF; 8];
            word[..rest.len()].copy_from_slice(rest);
            let place = PROGRAM + piece.offset + words.as_flattened().len() as u32;
            self.slots.program(slot, place, &word[..rest.len().next_multiple_of(4)])?;
        }
        begun.there = end;
        Ok(end)
    }

    /// Checks the program and makes it the one of the next start. Asked again after it was done, it changes nothing.
    ///
    /// # Errors
    /// [`UpdateFault::NotBegun`]; [`UpdateFault::Digest`] where the program is not that of the header, or not all of it is there.
    #[inline(never)]
    pub fn commit(&mut self) -> Result<(), Refusal> {
        let slot = self.other();
        let begun = self.begun.as_ref().ok_or(no(UpdateFault::NotBegun))?;
        if begun.there != begun.header.length {
            return Err(no(UpdateFault::Gap(begun.there)));
        }
        let (digest, bytes, length) = (begun.header.digest, begun.bytes, begun.header.length);
        if self.installed(slot).is_some() {
            return Ok(());
        }
        let program =
            self.slots.bytes(slot).get(PROGRAM as usize..).and_then(|rest| rest.get(..length as usize));
        let program = program.ok_or(no(UpdateFault::TooLong))?;
        if Sha512::digest(program)[..] != digest {
            self.begun = None;
            return Err(no(UpdateFault::Digest));
        }
        let sum = firmware_image::sum(&bytes, program);
        let order = self.installed(slot ^ 1).map_or(1, |(running, _)| running.order.wrapping_add(1));
        self.slots.program(slot, 0, &bytes)?;
        self.slots.program(slot, STATE, &order.to_le_bytes())?;
        self.slots.program(slot, STATE + 4, &sum.to_le_bytes())?;
        if !self.slots.bytes(slot).starts_with(&bytes) {
            return Err(no(UpdateFault::Medium));
        }
        self.slots.program(slot, VALID_AT, &VALID.to_le_bytes())?;
        match self.installed(slot) {
            Some((there, _)) if there.order == order => Ok(()),
            _ => Err(no(UpdateFault::Medium)),
        }
    }

    /// Confirms the program that runs.
    ///
    /// # Errors
    /// [`UpdateFault::Medium`].
    pub fn confirm(&mut self) -> Result<(), Refusal> {
        let running = self.slots.running();
        match self.installed(running) {
            Some((_, state)) if !state.is_confirmed() => {
                Ok(self.slots.program(running, CONFIRMED_AT, &[0; 4])?)
            }
            _ => Ok(()),
        }
    }

    /// Makes the other program the one of the next start.
    ///
    /// # Errors
    /// [`UpdateFault::NoOther`] where there is none, [`UpdateFault::Medium`].
    pub fn revert(&mut self) -> Result<(), Refusal> {
        let running = self.slots.running();
        // Not only valid: the boot loader must find it whole, or the device would start nothing.
        if self.begun.is_some() || !self.found(running ^ 1).is_startable() {
            return Err(no(UpdateFault::NoOther));
        }
        Ok(self.slots.program(running, VALID_AT, &[0; 4])?)
    }
}

#[cfg(test)]
mod tests;
