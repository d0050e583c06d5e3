//! The store's flash: three sectors of 16 KiB. Erasing one stops the processor for up to 0.8 s.

use embassy_stm32::flash::{Blocking, Error, Flash};
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

use super::{power, watchdog};

const STORE_AT: u32 = 16 * 1024;
const SECTOR: usize = 16 * 1024;

/// Sectors 1 to 3.
pub struct StoreFlash(Flash<'static, Blocking>);

impl StoreFlash {
    /// The store's part of the flash.
    pub fn new(flash: Flash<'static, Blocking>) -> Self {
        Self(flash)
    }
}

/// Why an access failed.
#[derive(Clone, Copy, Debug)]
pub struct StoreError(NorFlashErrorKind);

impl NorFlashError for StoreError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl From<Error> for StoreError {
    fn from(error: Error) -> Self {
        Self(match error {
            Error::Size => NorFlashErrorKind::OutOfBounds,
            Error::Unaligned => NorFlashErrorKind::NotAligned,
            _ => NorFlashErrorKind::Other,
        })
    }
}

impl ErrorType for StoreFlash {
    type Error = StoreError;
}

impl ReadNorFlash for StoreFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StoreError> {
        Ok(self.0.blocking_read(STORE_AT + offset, bytes)?)
    }

    fn capacity(&self) -> usize {
        3 * SECTOR
    }
}

impl NorFlash for StoreFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), StoreError> {
        // One at a time: the watchdog waits for one.
        for sector in (from..to).step_by(SECTOR) {
            let at = STORE_AT + sector;
            let erased = watchdog::patiently(|| self.0.blocking_erase(at, at + SECTOR as u32));
            power::flush_caches();
            erased.ok_or(StoreError(NorFlashErrorKind::Other))??;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), StoreError> {
        let written = self.0.blocking_write(STORE_AT + offset, bytes);
        power::flush_caches();
        Ok(written?)
    }
}
