//! Firmware over the link: images packed and signed into one file, and sent into the slot that does not run.
//!
//! A file holds a program for each slot, because a program is linked for its address. The device says which slot is free.
//!
//! The requests of an update have not changed their layout since they exist, so a program of another release can send them: the
//! versions of the link need not agree.

use std::path::Path;

use ed25519_dalek::{Signer, SigningKey};
use model_core::firmware_image::{HEADER, Header, PROGRAM};
use model_core::link::endpoints::{BeginUpdate, CommitUpdate, GetUpdate, SendUpdatePiece};
use model_core::link::hello::Board;
use model_core::link::messages::{PIECE, UpdateBegin, UpdatePiece, UpdateStatus};
use sha2::{Digest, Sha512};

use crate::Client;
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// First bytes of a file of images.
const MAGIC: [u8; 8] = *b"PAMFW\x01\r\n";
/// Longest file: two images of 192 KiB, and room.
const LONGEST: u64 = 4 << 20;
/// Addresses of the slots of the Nucleo-F446RE.
const NUCLEO_SLOTS: [u32; 2] = [0x0801_0000, 0x0804_0000];

/// A program with its header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// What is signed, and the signature.
    pub header: Header,
    /// The program.
    pub program: Vec<u8>,
}

fn invalid(cause: impl Into<String>) -> Error {
    Error::new(DataCode::CallInvalid, cause).help("pack images of `firmware/build` with `host update pack`")
}

/// The program of an ELF file of `firmware/build` for the Nucleo, and the slot that it is linked for. What lies before the program (the
/// boot loader, the words of the slot) is left out.
///
/// # Errors
/// Bytes that are not an ELF file, or an image whose vector table is in neither slot.
pub(crate) fn program_of(elf: &[u8]) -> Result<(u8, Vec<u8>)> {
    let segments = placed(elf);
    if !elf.starts_with(b"\x7fELF\x01\x01") || segments.is_empty() {
        return Err(invalid("this is not an ELF file of a microcontroller"));
    }
    let holds =
        |address: u64| segments.iter().any(|(at, data)| (*at..*at + data.len() as u64).contains(&address));
    for (slot, address) in NUCLEO_SLOTS.into_iter().enumerate() {
        let start = u64::from(address + PROGRAM);
        if !holds(start) {
            continue;
        }
        let end = start + 192 * 1024;
        let mut program = Vec::new();
        for (at, data) in segments.iter().filter(|(at, _)| (start..end).contains(at)) {
            let place = (at - start) as usize;
            if place + data.len() > 192 * 1024 {
                break;
            }
            program.resize(program.len().max(place + data.len()), 0xFF);
            program[place..place + data.len()].copy_from_slice(data);
        }
        return Ok((slot as u8, program));
    }
    Err(invalid("this image is linked for no slot of a board"))
}

/// Loaded bytes with the addresses at which they are programmed, from the program headers (ELF of 32 bits, little-endian).
fn placed(elf: &[u8]) -> Vec<(u64, &[u8])> {
    let word = |at: usize| {
        let bytes = elf.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize)
    };
    let half =
        |at: usize| elf.get(at..at + 2).map(|bytes| usize::from(u16::from_le_bytes([bytes[0], bytes[1]])));
    let (Some(table), Some(size), Some(count)) = (word(28), half(42), half(44)) else { return Vec::new() };
    (0..count)
        .filter_map(|n| {
            let at = table.checked_add(n * size)?;
            let (kind, from, address, length) = (word(at)?, word(at + 4)?, word(at + 12)?, word(at + 16)?);
            let data = elf.get(from..from.checked_add(length)?)?;
            (kind == 1 && length > 0).then_some((address as u64, data))
        })
        .collect()
}

/// A key of its 32 bytes.
#[must_use]
pub fn key_of(bytes: &[u8; 32]) -> SigningKey {
    SigningKey::from_bytes(bytes)
}

/// Its public part.
#[must_use]
pub fn public_of(key: &SigningKey) -> [u8; 32] {
    key.verifying_key().to_bytes()
}

/// A key of 64 hexadecimal digits.
#[must_use]
pub fn key_from_hex(text: &str) -> Option<SigningKey> {
    let mut bytes = [0; 32];
    if text.len() != 64 || !text.is_ascii() {
        return None;
    }
    for (byte, at) in bytes.iter_mut().zip((0..64).step_by(2)) {
        *byte = u8::from_str_radix(&text[at..at + 2], 16).ok()?;
    }
    Some(key_of(&bytes))
}

/// Bytes as hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A program, hashed and signed.
#[must_use]
pub fn signed(
    board: Board,
    slot: u8,
    address: u32,
    release: (u16, u16, u16),
    program: &[u8],
    key: &SigningKey,
) -> Image {
    let mut digest = [0; 64];
    digest.copy_from_slice(&Sha512::digest(program));
    let mut header = Header {
        board: board as u8,
        slot,
        length: program.len() as u32,
        release,
        address: address + PROGRAM,
        digest,
        signature: [0; 64],
    };
    header.signature = key.sign(&header.signed()).to_bytes();
    Image { header, program: program.to_vec() }
}

/// The same for a program of the Nucleo.
///
/// # Errors
/// As `program_of`.
pub fn signed_elf(elf: &[u8], release: (u16, u16, u16), key: &SigningKey) -> Result<Image> {
    let (slot, program) = program_of(elf)?;
    Ok(signed(Board::NucleoF446re, slot, NUCLEO_SLOTS[usize::from(slot)], release, &program, key))
}

/// The bytes of a file of images.
#[must_use]
pub fn to_bytes(images: &[Image]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    for image in images {
        out.extend_from_slice(&image.header.to_bytes());
        out.extend_from_slice(&image.program);
    }
    out
}

/// Reads a file of images.
///
/// # Errors
/// A file that cannot be read, is too long, or holds something else or a part only.
pub fn read(path: &Path) -> Result<Vec<Image>> {
    let unreadable =
        |error: std::io::Error| Error::new(DataCode::FileUnreadable, error.to_string()).file(path);
    if std::fs::metadata(path).map_err(unreadable)?.len() > LONGEST {
        return Err(invalid("this file is too long for firmware").file(path));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    from_bytes(&bytes).ok_or_else(|| invalid("this file does not hold whole images of firmware").file(path))
}

fn from_bytes(bytes: &[u8]) -> Option<Vec<Image>> {
    let mut rest = bytes.strip_prefix(&MAGIC)?;
    let mut images = Vec::new();
    while !rest.is_empty() {
        let header = Header::from_bytes(rest)?;
        let program = rest.get(HEADER..HEADER.checked_add(header.length as usize)?)?;
        images.push(Image { header, program: program.to_vec() });
        rest = &rest[HEADER + program.len()..];
    }
    (!images.is_empty()).then_some(images)
}

/// Sends the image for the slot that does not run; `progress` receives the number of bytes that have arrived.
///
/// # Errors
/// No image for this board and slot, and what the device refuses.
pub fn send(client: &mut Client, images: &[Image], mut progress: impl FnMut(usize)) -> Result<UpdateStatus> {
    let status = client.call::<GetUpdate>(&())?;
    let free = 1 - (status.running & 1);
    let board = client.hello().board;
    let image = images.iter().find(|image| image.header.board == board && image.header.slot == free);
    let image = image.ok_or_else(|| {
        let board = Board::from_code(board).map_or("this board", Board::name);
        invalid(format!("the file has no image for slot {free} of {board}"))
    })?;
    let header = heapless::Vec::from_slice(&image.header.to_bytes())
        .map_err(|_| Error::new(DeviceCode::DeviceRefused, "the header is too long"))?;
    client.call_once::<BeginUpdate>(&UpdateBegin { header })?;
    let mut there = 0;
    for bytes in image.program.chunks(PIECE) {
        let piece = UpdatePiece {
            offset: there,
            bytes: heapless::Vec::from_slice(bytes)
                .map_err(|_| Error::new(DeviceCode::DeviceRefused, "the piece is too long"))?,
        };
        // A sector may have to be erased first. The same piece may come again.
        there = client
            .call_once::<SendUpdatePiece>(&piece)
            .or_else(|_| client.call_once::<SendUpdatePiece>(&piece))?;
        progress(there as usize);
    }
    client.call_once::<CommitUpdate>(&())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> SigningKey {
        SigningKey::from_bytes(&[7; 32])
    }

    #[test]
    fn a_file_of_images_is_read_as_it_was_written_and_no_part_of_it_is_one() {
        let image = |slot: u8, length: usize| {
            signed(
                Board::NucleoF446re,
                slot,
                NUCLEO_SLOTS[usize::from(slot)],
                (1, 2, 3),
                &vec![slot; length],
                &key(),
            )
        };
        let images = vec![image(0, 1000), image(1, 777)];
        let bytes = to_bytes(&images);
        assert_eq!(from_bytes(&bytes), Some(images));
        for end in 0..bytes.len() {
            let part = from_bytes(&bytes[..end]);
            assert!(part.is_none_or(|images| images.len() == 1 && end == 8 + HEADER + 1000), "{end}");
        }
        assert_eq!(from_bytes(b"something else"), None);
    }

    #[test]
    fn a_header_is_signed_with_the_key_and_names_the_program() {
        let image = signed(Board::NucleoF446re, 1, NUCLEO_SLOTS[1], (1, 2, 3), b"a program", &key());
        let signature = ed25519_dalek::Signature::from_bytes(&image.header.signature);
        assert!(key().verifying_key().verify_strict(&image.header.signed(), &signature).is_ok());
        assert_eq!((image.header.length, image.header.address), (9, 0x0804_0200));
        assert_eq!(image.header.digest[..], Sha512::digest(b"a program")[..]);
    }

    #[test]
    fn files_that_are_not_images_of_a_slot_are_refused() {
        assert!(program_of(b"no ELF").is_err());
        let mut elf = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        elf.truncate(1 << 20);
        assert!(program_of(&elf).is_err());
    }
}
