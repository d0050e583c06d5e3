//! Two slots for firmware in memory, and the boot loader's decision at each start. What is in them is kept and never run.

use model_core::firmware_image::{self, Choice, choose, found, try_at};
use model_core::link::hello::Board;

use crate::update::{Failed, SlotFlash};

/// Bytes of a slot, and of a sector.
const LENGTH: u32 = 64 * 1024;
const SECTOR: u32 = 16 * 1024;
/// Addresses that no program is linked to.
const AT: [u32; 2] = [0x0001_0000, 0x0002_0000];

/// The slots of a device in this process.
#[derive(Debug, Clone)]
pub struct MemorySlots {
    bytes: [Vec<u8>; 2],
    running: u8,
}

impl MemorySlots {
    /// Slot 0 holds a program that a debug probe has programmed.
    pub fn probed() -> Self {
        let mut first = vec![0xFF; LENGTH as usize];
        let words = firmware_image::probed(Board::Native as u8, (0, 1, 0), AT[0]);
        first[..words.len()].copy_from_slice(&words);
        let bytes = [first, vec![0xFF; LENGTH as usize]];
        Self { bytes, running: 0 }
    }
}

impl SlotFlash for MemorySlots {
    fn running(&self) -> u8 {
        self.running
    }

    fn address(&self, slot: u8) -> u32 {
        AT[usize::from(slot & 1)]
    }

    fn capacity(&self) -> u32 {
        LENGTH
    }

    fn board(&self) -> u8 {
        Board::Native as u8
    }

    fn bytes(&self, slot: u8) -> &[u8] {
        &self.bytes[usize::from(slot & 1)]
    }

    fn program(&mut self, slot: u8, place: u32, bytes: &[u8]) -> Result<(), Failed> {
        let place = place as usize;
        let there = self.bytes[usize::from(slot & 1)].get_mut(place..place + bytes.len()).ok_or(Failed)?;
        for (there, byte) in there.iter_mut().zip(bytes) {
            *there &= byte;
        }
        Ok(())
    }

    fn erase_at(&mut self, slot: u8, place: u32) -> Result<(), Failed> {
        let end = self.next_sector(slot, place) as usize;
        self.bytes[usize::from(slot & 1)].get_mut(place as usize..end).ok_or(Failed)?.fill(0xFF);
        Ok(())
    }

    fn next_sector(&self, _: u8, place: u32) -> u32 {
        (place / SECTOR + 1) * SECTOR
    }

    fn boot(&mut self) {
        let slots = [0, 1].map(|slot| found(self.bytes(slot), Board::Native as u8, slot, self.address(slot)));
        let Choice::Start { slot, mark } = choose(&slots) else { return };
        if let Some(mark) = mark {
            // Memory does not fail.
            let _ = self.program(slot as u8, try_at(mark), &[0; 4]);
        }
        self.running = slot as u8;
    }
}
