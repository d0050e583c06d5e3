//! One room for what is never needed at once: a trace, or a table on its way into use. A small chip has no memory for both.

use heapless::Vec;
use model_core::image;
use model_core::table::MuscleTable;

use crate::room::{Room, room};

/// Values that a trace holds, four bytes each: the largest single part of the controller's memory, and a free choice. It may be
/// as large as the chip allows; a host asks the device how many there are.
pub const TRACE_CAPACITY: usize = 1024;

/// A table on its way into use.
#[derive(Debug)]
pub struct Incoming {
    /// Its image, as far as it has come.
    pub image: Vec<u8, { image::MAX_LEN }>,
    /// The table in it.
    pub table: MuscleTable,
}

#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "it is never moved: the one lends its room to the other")]
enum Content {
    Trace(Vec<f32, TRACE_CAPACITY>),
    Table(Incoming),
}

/// The room. Whoever has it uses it for one of the two; what was in it for the other is lost.
#[derive(Debug)]
pub struct CommonRoom(Room<Content>);

impl CommonRoom {
    /// The only one of a controller, empty.
    pub fn new() -> Self {
        Self(room!(Content, Content::Trace(Vec::new())))
    }

    /// The values of a trace that is in it.
    pub fn values(&self) -> &[f32] {
        match &*self.0 {
            Content::Trace(values) => values,
            Content::Table(_) => &[],
        }
    }

    /// Makes it an empty trace's.
    pub fn clear_for_trace(&mut self) {
        *self.0 = Content::Trace(Vec::new());
    }

    /// The values of the trace that is in it, if it is a trace's.
    pub fn trace(&mut self) -> Option<&mut Vec<f32, TRACE_CAPACITY>> {
        match &mut *self.0 {
            Content::Trace(values) => Some(values),
            Content::Table(_) => None,
        }
    }

    /// Makes it an empty table's.
    #[inline(never)]
    pub fn clear_for_table(&mut self) {
        *self.0 = Content::Table(Incoming { image: Vec::new(), table: MuscleTable::empty() });
    }

    /// The table that is in it, if it is a table's.
    pub fn table(&mut self) -> Option<&mut Incoming> {
        match &mut *self.0 {
            Content::Table(incoming) => Some(incoming),
            Content::Trace(_) => None,
        }
    }
}

impl Default for CommonRoom {
    fn default() -> Self {
        Self::new()
    }
}
