//! A file read from front to end with a view ahead, in bounded memory.

use std::io::{self, Read};

/// Read at a time.
const STEP: usize = 1 << 16;

/// The bytes from the present position on, as far as they were requested.
pub(super) struct Window<R> {
    reader: R,
    bytes: Vec<u8>,
    /// Start of the present position in `bytes`.
    at: usize,
    ended: bool,
}

impl<R: Read> Window<R> {
    pub fn new(reader: R) -> Self {
        Self { reader, bytes: Vec::new(), at: 0, ended: false }
    }

    /// The next bytes, fewer than `count` only at the end of the file.
    pub fn peek(&mut self, count: usize) -> io::Result<&[u8]> {
        while self.bytes.len() - self.at < count && !self.ended {
            if self.at > STEP.max(self.bytes.len() / 2) {
                self.bytes.drain(..self.at);
                self.at = 0;
            }
            let more = STEP.max(count - (self.bytes.len() - self.at));
            let got = (&mut self.reader).take(more as u64).read_to_end(&mut self.bytes)?;
            self.ended = got < more;
        }
        let end = self.bytes.len().min(self.at.saturating_add(count));
        Ok(&self.bytes[self.at..end])
    }

    /// Skips n bytes that were seen.
    pub fn skip(&mut self, count: usize) {
        self.at = self.bytes.len().min(self.at + count);
    }
}
