//! A flash in memory whose power is cut, that wears out, or that has a bad cell.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use heapless::Vec;

const PAGE: usize = 2048;
const PAGES: usize = 6;
const WORD: usize = 4;

/// Flash in memory that counts its words and erases, and loses power after some of them.
#[derive(Clone, Debug)]
pub(crate) struct MockFlash {
    pub(crate) bytes: Vec<u8, { PAGE * PAGES }>,
    /// Words that may still be written (an erase of a page counts as one).
    left: usize,
    pub(super) done: usize,
    pub(super) off: bool,
    /// Writes that still work, where the flash wears out and is read all the same.
    lasts: usize,
    /// Writes that fail, before all others work.
    fails: usize,
    /// What a cut leaves of the word or page it hits: 0 nothing happened, 1 half, 2 all of it.
    tear: usize,
    /// The word, counted from now, of which a bit is written wrongly.
    wrong: usize,
}

#[derive(Debug)]
pub(crate) struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl MockFlash {
    pub(crate) fn erased() -> Self {
        let mut bytes = Vec::new();
        bytes.resize(PAGE * PAGES, 0xFF).expect("its own size");
        Self {
            bytes,
            left: usize::MAX,
            done: 0,
            off: false,
            lasts: usize::MAX,
            fails: 0,
            tear: 0,
            wrong: usize::MAX,
        }
    }

    /// The same under a supply that sags: the next n writes fail.
    pub(crate) fn failing_first(mut self, writes: usize) -> Self {
        self.fails = writes;
        self
    }

    /// The same worn out: n more writes work, and everything is read.
    pub(crate) fn failing_after(mut self, writes: usize) -> Self {
        self.lasts = writes;
        self
    }

    /// Words that were written, each erase of a page one of them.
    pub(crate) fn words_written(&self) -> usize {
        self.done
    }

    /// Counts one operation; false when the power goes with it.
    fn spend(&mut self) -> bool {
        if self.left == 0 {
            self.off = true;
            return false;
        }
        self.left -= 1;
        self.done += 1;
        true
    }

    /// The same with a bad cell in the word that is written after n others.
    pub(super) fn wrong_at(mut self, word: usize) -> Self {
        (self.done, self.wrong) = (0, word);
        self
    }

    pub(crate) fn powered(mut self, left: usize, tear: usize) -> Self {
        (self.left, self.off, self.done, self.tear) = (left, false, 0, tear);
        self
    }
}

impl ErrorType for MockFlash {
    type Error = PowerCut;
}

impl ReadNorFlash for MockFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        if self.off {
            return Err(PowerCut);
        }
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        PAGE * PAGES
    }
}

impl NorFlash for MockFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(PAGE) && to.is_multiple_of(PAGE), "an erase is of whole pages");
        for page in (from..to).step_by(PAGE) {
            if self.off {
                return Err(PowerCut);
            }
            if self.spend() {
                self.bytes[page..page + PAGE].fill(0xFF);
            } else {
                self.bytes[page..page + PAGE * self.tear / 2].fill(0xFF);
                return Err(PowerCut);
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        let offset = offset as usize;
        assert!(offset.is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD), "a write is of whole words");
        if self.lasts == 0 {
            return Err(PowerCut);
        }
        self.lasts = self.lasts.saturating_sub(1);
        if self.fails > 0 {
            self.fails -= 1;
            return Err(PowerCut);
        }
        for (n, word) in bytes.chunks(WORD).enumerate() {
            if self.off {
                return Err(PowerCut);
            }
            let place = offset + n * WORD;
            let there = &mut self.bytes[place..place + WORD];
            // Bits can only be cleared between erases. A word that a cut left half written may be finished; the F446's flash
            // has no error correction that would forbid it.
            let clears_only = there.iter().zip(word).all(|(old, new)| old & new == *new);
            assert!(clears_only, "a write cannot set bits");
            if !self.spend() {
                let torn = WORD * self.tear / 2;
                self.bytes[place..place + torn].copy_from_slice(&word[..torn]);
                return Err(PowerCut);
            }
            self.bytes[place..place + WORD].copy_from_slice(word);
            if self.done - 1 == self.wrong {
                // A cell that has lost its charge reads as written, or as not written.
                self.bytes[place] ^= 0x04;
            }
        }
        Ok(())
    }
}
