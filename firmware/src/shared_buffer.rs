//! One room for what is never needed immediately: a trace, or a table on its way into use. A small chip has no memory for both.

use heapless::Vec;
use model_core::image;
use model_core::table::MuscleTable;

use crate::compact_float::CompactFloat;
use crate::pair;
use crate::placement::{Placed, placed};

/// Values that a trace holds, three bytes each: the largest single part of the memory of a board for one muscle, and a free choice.
/// It may be as large as the chip allows; a host asks the device how many there are. A second muscle's table takes as much again,
/// and leaves the trace what a table on its way into use needs anyway.
pub const TRACE_CAPACITY: usize = if pair::SUPPORTED { 640 } else { 960 };

/// A table on its way into use.
#[derive(Debug)]
pub struct Incoming {
    /// Its image, as far as it has come.
    pub image: Vec<u8, { image::MAX_LEN }>,
    /// The table in it.
    pub table: MuscleTable,
}

/// With a number of its own for what it is: an empty trace is all zeros then, and takes no flash.
#[repr(u8)]
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "it is never moved: the one lends its room to the other")]
enum Content {
    Trace(Vec<CompactFloat, TRACE_CAPACITY>),
    Table(Incoming),
}

/// The room. Anyone who has it uses it for one of the two; what was in it for the other is lost.
#[derive(Debug)]
pub struct SharedBuffer(Placed<Content>);

impl SharedBuffer {
    /// The only one of a controller, empty.
    pub fn new() -> Self {
        Self(placed!(Content, Content::Trace(Vec::new())))
    }

    /// The values of a trace that is in it.
    pub fn values(&self) -> &[CompactFloat] {
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
    pub fn trace(&mut self) -> Option<&mut Vec<CompactFloat, TRACE_CAPACITY>> {
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

impl Default for SharedBuffer {
    fn default() -> Self {
        Self::new()
    }
}
