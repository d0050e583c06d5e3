//! This board has no flash: a file of the host, through semihosting, behaves like one and outlives a stopped emulator.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

use super::semihosting::File;

const PAGE: usize = 4096;
const PAGES: usize = 8;
const SIZE: usize = PAGE * PAGES;
const WORD: usize = 4;

/// Flash in a file, made erased where it does not exist or is too short.
pub struct FileFlash(File);

/// The file failed, or the access was outside or not aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileError(NorFlashErrorKind);

impl NorFlashError for FileError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl FileFlash {
    /// Opens it.
    pub fn open(name: &core::ffi::CStr) -> Option<Self> {
        let file = File::open(name)?;
        let mut length = file.length()?;
        while length < SIZE {
            let erased = [0xFF; 256];
            let piece = erased.len().min(SIZE - length);
            if !file.write(length, &erased[..piece]) {
                return None;
            }
            length += piece;
        }
        Some(Self(file))
    }
}

fn check(offset: u32, length: usize, unit: usize) -> Result<usize, FileError> {
    let offset = offset as usize;
    if !offset.is_multiple_of(unit) || !length.is_multiple_of(unit) {
        return Err(FileError(NorFlashErrorKind::NotAligned));
    }
    if offset.checked_add(length).is_none_or(|end| end > SIZE) {
        return Err(FileError(NorFlashErrorKind::OutOfBounds));
    }
    Ok(offset)
}

fn done(good: bool) -> Result<(), FileError> {
    if good { Ok(()) } else { Err(FileError(NorFlashErrorKind::Other)) }
}

impl ErrorType for FileFlash {
    type Error = FileError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = WORD;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        let offset = check(offset, bytes.len(), Self::READ_SIZE)?;
        done(self.0.read(offset, bytes))
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        let length = to.checked_sub(from).ok_or(FileError(NorFlashErrorKind::OutOfBounds))?;
        let offset = check(from, length as usize, PAGE)?;
        for piece in (0..length as usize).step_by(256) {
            done(self.0.write(offset + piece, &[0xFF; 256]))?;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        let offset = check(offset, bytes.len(), WORD)?;
        done(self.0.write(offset, bytes))
    }
}
