//! A table on its way in: gathered piece by piece, checked as a whole before anything is kept.

use heapless::Vec;
use model_core::check;
use model_core::image;
use model_core::link::messages::{Refusal, Side, TableBegin, TableFault, TablePiece};

use super::{look_at, table_fault};
use crate::room::{Room, room};

/// What an upload has gathered.
pub(super) struct Upload {
    begun: Option<TableBegin>,
    bytes: Room<Bytes>,
}

type Bytes = Vec<u8, { image::MAX_LEN }>;

impl Default for Upload {
    fn default() -> Self {
        Self { begun: None, bytes: room!(Bytes, Vec::new()) }
    }
}

impl Upload {
    /// Begins; whatever was begun before is forgotten.
    pub(super) fn begin(&mut self, request: TableBegin) -> Result<(), Refusal> {
        self.forget();
        if request.length as usize > image::MAX_LEN {
            return Err(Refusal::Table(TableFault::TooLong(image::MAX_LEN as u32)));
        }
        self.begun = Some(request);
        Ok(())
    }

    /// Forgets what is there.
    pub(super) fn forget(&mut self) {
        self.begun = None;
        self.bytes.clear();
    }

    /// Takes the next piece; gives how many bytes are there.
    pub(super) fn add(&mut self, piece: &TablePiece) -> Result<u32, Refusal> {
        let Some(begun) = &self.begun else { return Err(Refusal::Table(TableFault::NotBegun)) };
        let there = self.bytes.len() as u32;
        if piece.offset != there {
            return Err(Refusal::Table(TableFault::Gap(there)));
        }
        if there as usize + piece.bytes.len() > begun.length as usize {
            return Err(Refusal::Table(TableFault::TooLong(begun.length)));
        }
        self.bytes.extend_from_slice(&piece.bytes).map_err(|_| Refusal::Range)?;
        Ok(self.bytes.len() as u32)
    }

    /// The whole image of a table that can be used, and the muscle it is for.
    pub(super) fn whole(&self) -> Result<(Side, &[u8]), Refusal> {
        let Some(begun) = &self.begun else { return Err(Refusal::Table(TableFault::NotBegun)) };
        let bytes = self.bytes.as_slice();
        if bytes.len() < begun.length as usize {
            return Err(Refusal::Table(TableFault::Incomplete(bytes.len() as u32)));
        }
        if check::of_image(bytes) != begun.crc {
            return Err(Refusal::Table(TableFault::Check));
        }
        let refused = |error| Refusal::Table(table_fault(error));
        // Bytes behind the image would be kept and never read.
        if image::announced_len(bytes).map_err(refused)? != bytes.len() {
            return Err(Refusal::Table(TableFault::Malformed));
        }
        look_at(bytes, &mut |_| Ok(()))?;
        Ok((begun.side, bytes))
    }
}
