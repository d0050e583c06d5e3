//! The flash of 512 KiB, and its two slots for programs.
//!
//! | sectors | address | length | content |
//! | --- | --- | --- | --- |
//! | 0 | 0x0800_0000 | 16 KiB | boot loader |
//! | 1 to 3 | 0x0800_4000 | 3 × 16 KiB | store |
//! | 4, 5 | 0x0801_0000 | 64 + 128 KiB | slot 0 |
//! | 6, 7 | 0x0804_0000 | 2 × 128 KiB, of which 192 are used | slot 1 |

use embassy_stm32::flash::{Blocking, Flash};
use firmware::update::{Failed, Key, SlotFlash};
use model_core::link::hello::Board;

use super::{power, watchdog};

const FLASH_AT: u32 = 0x0800_0000;
const AT: [u32; 2] = [0x1_0000, 0x4_0000];
const LENGTH: u32 = 192 * 1024;
/// Place of the second sector within each slot.
const SECOND: [u32; 2] = [0x1_0000, 0x2_0000];

/// The words before the program and the boot loader, in the image that a debug probe programs.
#[cfg(not(feature = "slot-b"))]
mod probed {
    use super::{AT, Board, FLASH_AT};
    use model_core::firmware_image::{self, PROGRAM};

    const fn number(text: &str) -> u16 {
        let (bytes, mut at, mut number) = (text.as_bytes(), 0, 0);
        while at < bytes.len() {
            number = 10 * number + (bytes[at] - b'0') as u16;
            at += 1;
        }
        number
    }

    #[used]
    #[unsafe(link_section = ".slot_words")]
    static WORDS: [u8; PROGRAM as usize] = firmware_image::probed(
        Board::NucleoF446re as u8,
        (
            number(env!("CARGO_PKG_VERSION_MAJOR")),
            number(env!("CARGO_PKG_VERSION_MINOR")),
            number(env!("CARGO_PKG_VERSION_PATCH")),
        ),
        FLASH_AT + AT[0],
    );

    #[used]
    #[unsafe(link_section = ".bootloader")]
    static BOOTLOADER: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/bootloader.bin")).len()] =
        *include_bytes!(concat!(env!("OUT_DIR"), "/bootloader.bin"));
}

/// The key of who may send firmware, from the environment of the build: 64 hexadecimal digits.
pub const KEY: Option<Key> = match option_env!("PAM_UPDATE_KEY") {
    Some(text) if text.len() == 64 => {
        let (bytes, mut key, mut at) = (text.as_bytes(), [0; 32], 0);
        while at < 64 {
            let digit = match bytes[at] {
                digit @ b'0'..=b'9' => digit - b'0',
                digit @ b'a'..=b'f' => digit - b'a' + 10,
                _ => panic!("PAM_UPDATE_KEY is not hexadecimal"),
            };
            key[at / 2] = key[at / 2] << 4 | digit;
            at += 1;
        }
        Some(key)
    }
    None => None,
    Some(text) if text.is_empty() => None,
    Some(_) => panic!("PAM_UPDATE_KEY has not 64 digits"),
};

/// The slots of this chip. The store has a driver of its own; both are used by the task of the link alone.
pub struct Slots(Flash<'static, Blocking>);

impl Slots {
    /// Over the chip's flash.
    pub fn new(flash: Flash<'static, Blocking>) -> Self {
        Self(flash)
    }
}

impl SlotFlash for Slots {
    fn running(&self) -> u8 {
        u8::from(running_at() >= FLASH_AT + AT[1])
    }

    fn address(&self, slot: u8) -> u32 {
        FLASH_AT + AT[usize::from(slot & 1)]
    }

    fn capacity(&self) -> u32 {
        LENGTH
    }

    fn board(&self) -> u8 {
        Board::NucleoF446re as u8
    }

    fn bytes(&self, slot: u8) -> &[u8] {
        // SAFETY: flash of this chip; it is only written through `self`, while no slice of it is there.
        unsafe { core::slice::from_raw_parts(self.address(slot) as *const u8, LENGTH as usize) }
    }

    fn program(&mut self, slot: u8, place: u32, bytes: &[u8]) -> Result<(), Failed> {
        let written = self.0.blocking_write(AT[usize::from(slot & 1)] + place, bytes);
        power::flush_caches();
        written.map_err(|_| Failed)
    }

    fn erase_at(&mut self, slot: u8, place: u32) -> Result<(), Failed> {
        let (from, to) =
            (AT[usize::from(slot & 1)] + place, AT[usize::from(slot & 1)] + self.next_sector(slot, place));
        let erased = watchdog::patiently(|| self.0.blocking_erase(from, to));
        power::flush_caches();
        erased.ok_or(Failed)?.map_err(|_| Failed)
    }

    fn next_sector(&self, slot: u8, place: u32) -> u32 {
        let second = SECOND[usize::from(slot & 1)];
        if place < second { second } else { second + 0x2_0000 }
    }
}

/// Address of the vector table in force, which the boot loader has set.
fn running_at() -> u32 {
    // SAFETY: a read of a register of the core.
    unsafe { (*cortex_m::peripheral::SCB::PTR).vtor.read() }
}
