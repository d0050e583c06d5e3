//! Flash in memory, written through to a file where one is given.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

const PAGE: usize = 4096;
const PAGES: usize = 8;

/// Flash in memory, written through to a file where one is given.
#[derive(Debug)]
pub struct MemoryFlash {
    bytes: Vec<u8>,
    file: Option<PathBuf>,
}

impl MemoryFlash {
    /// Erased, or as the file left it.
    ///
    /// # Errors
    /// The file is there and cannot be read.
    pub fn open(file: Option<PathBuf>) -> io::Result<Self> {
        let mut bytes = vec![0xFF; PAGE * PAGES];
        if let Some(path) = &file {
            match std::fs::read(path) {
                Ok(kept) => {
                    let length = kept.len().min(bytes.len());
                    bytes[..length].copy_from_slice(&kept[..length]);
                }
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
        }
        Ok(Self { bytes, file })
    }

    fn keep(&self) -> Result<(), MemoryError> {
        match &self.file {
            Some(path) => {
                std::fs::write(path, &self.bytes).map_err(|_| MemoryError(NorFlashErrorKind::Other))
            }
            None => Ok(()),
        }
    }

    fn range(&mut self, offset: u32, length: usize) -> Result<&mut [u8], MemoryError> {
        let offset = offset as usize;
        offset
            .checked_add(length)
            .and_then(|end| self.bytes.get_mut(offset..end))
            .ok_or(MemoryError(NorFlashErrorKind::OutOfBounds))
    }
}

/// An access outside the flash, or a file that failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryError(NorFlashErrorKind);

impl NorFlashError for MemoryError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl ErrorType for MemoryFlash {
    type Error = MemoryError;
}

impl ReadNorFlash for MemoryFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), MemoryError> {
        bytes.copy_from_slice(self.range(offset, bytes.len())?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for MemoryFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), MemoryError> {
        let length = to.checked_sub(from).ok_or(MemoryError(NorFlashErrorKind::OutOfBounds))?;
        self.range(from, length as usize)?.fill(0xFF);
        self.keep()
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), MemoryError> {
        self.range(offset, bytes.len())?.copy_from_slice(bytes);
        self.keep()
    }
}
