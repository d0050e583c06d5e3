//! Upload of a table: received piece by piece, checked as a whole before anything is kept.

use model_core::check;
use model_core::image;
use model_core::link::messages::{Refusal, Side, TableBegin, TableFault, TablePiece};

use super::{read_table, table_refusal};
use crate::shared::Shared;
use crate::shared_buffer::{Incoming, SharedBuffer};

/// What an upload has received. It takes the shared buffer from the trace, which ends and is lost.
#[derive(Default)]
pub(super) struct Upload {
    begun: Option<TableBegin>,
    room: Option<SharedBuffer>,
}

impl Upload {
    /// Begins; whatever was begun before is forgotten.
    pub(super) fn begin(&mut self, request: TableBegin, shared: &Shared) -> Result<(), Refusal> {
        if request.length as usize > image::MAX_LEN {
            return Err(Refusal::Table(TableFault::TooLong(image::MAX_LEN as u32)));
        }
        self.place(shared)?.image.clear();
        self.begun = Some(request);
        Ok(())
    }

    /// The place of a table on its way into use.
    ///
    /// # Errors
    /// None that can be: the room is here or with the trace.
    pub(super) fn place(&mut self, shared: &Shared) -> Result<&mut Incoming, Refusal> {
        if self.room.is_none() {
            self.room = shared.with(|controller| controller.trace().lend());
            if let Some(room) = &mut self.room {
                room.clear_for_table();
            }
        }
        self.room.as_mut().and_then(SharedBuffer::table).ok_or(Refusal::NotSupported)
    }

    /// Forgets what is there, and gives the room back.
    pub(super) fn forget(&mut self, shared: &Shared) {
        self.begun = None;
        if let Some(room) = self.room.take() {
            shared.with(|controller| controller.trace().take_back(room));
        }
    }

    /// What was begun, and what has come of it.
    fn begun(&mut self) -> Result<(&TableBegin, &mut Incoming), Refusal> {
        let begun = self.begun.as_ref().zip(self.room.as_mut().and_then(SharedBuffer::table));
        begun.ok_or(Refusal::Table(TableFault::NotBegun))
    }

    /// Takes the next piece; gives how many bytes are there.
    pub(super) fn add(&mut self, piece: &TablePiece) -> Result<u32, Refusal> {
        let (begun, Incoming { image, .. }) = self.begun()?;
        let there = image.len() as u32;
        if piece.offset != there {
            return Err(Refusal::Table(TableFault::Gap(there)));
        }
        if there as usize + piece.bytes.len() > begun.length as usize {
            return Err(Refusal::Table(TableFault::TooLong(begun.length)));
        }
        image.extend_from_slice(&piece.bytes).map_err(|_| Refusal::Range)?;
        Ok(image.len() as u32)
    }

    /// The whole image of a table that can be used, and the muscle it is for.
    pub(super) fn whole(&mut self) -> Result<(Side, &Incoming), Refusal> {
        let (begun, incoming) = self.begun()?;
        let Incoming { image: bytes, table } = &mut *incoming;
        if bytes.len() < begun.length as usize {
            return Err(Refusal::Table(TableFault::Incomplete(bytes.len() as u32)));
        }
        if check::of_image(bytes) != begun.crc {
            return Err(Refusal::Table(TableFault::Check));
        }
        // Bytes behind the image would be kept and never read.
        if image::announced_len(bytes).map_err(table_refusal)? != bytes.len() {
            return Err(Refusal::Table(TableFault::Malformed));
        }
        read_table(bytes, table)?;
        Ok((begun.side, incoming))
    }
}
