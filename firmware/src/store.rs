//! What outlives a power cut: tables, settings, past faults, and what effects remember.
//!
//! # On flash
//!
//! A map of sequential-storage over whole erase pages (its items are written once and checked by their own CRC; a page is
//! erased only after what is alive in it has been copied). Keys are one byte:
//!
//! | key | value |
//! | --- | --- |
//! | 0x10 + side | which slot holds the table in use: [`Selected`], postcard |
//! | 0x20 + 2·side + slot | image of a table |
//! | 0x37, 0x34 | [`Settings`](model_core::link::settings::Settings), postcard, and the sum to expect of them (`store/settings.rs`); 0x31 to 0x33, 0x35 and 0x36 held those of the layouts 2 to 6 |
//! | 0x3F | number of the layout, `u16` |
//! | 0x40 + side | generation of a table, and what its effects remember if it must survive a power cycle: a new table brings its own; postcard |
//! | 0x50 + n | past fault n of a ring, postcard; 0x5F its next place |
//! | 0x60 | starts of the device, `u32` |
//!
//! A new table goes into the slot that is not in use, is read back and compared, and only then is the selection written: one
//! item, so it is there whole or not at all. Whenever power fails, the old table or the new one is in use. [`FORMAT`] moves
//! when this layout does.

use core::cell::RefCell;
use core::pin::pin;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use model_core::check;
use model_core::effects::{MAX_EFFECTS, MEMORY, Memory};
use model_core::fields;
use model_core::fields::{Fields, Walk};
use model_core::image;
use model_core::link::messages::{FAULT_LOG, FaultReport, Side, StoreFault, TableInfo};
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage, SerializationError, Value};

use crate::placement::{Placed, placed};

mod settings;

pub use settings::Kept;

/// Version of the layout. It changes when any kept value has other fields: postcard's bytes do not describe themselves, and a value
/// of another layout would be read as if it were of this one. Its key changes with it.
pub const FORMAT: u16 = 8;
/// Longest item with its key, rounded up to words of a flash of at most 16 bytes.
const BUFFER: usize = image::MAX_LEN + 16;

/// Which slot holds the table in use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selected {
    /// 0 or 1.
    pub slot: u8,
    /// Table in that slot.
    pub table: Described,
    /// Table in the other slot, if it can be gone back to.
    pub previous: Option<Described>,
}

/// What a start found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Started {
    /// Starts of the device, this one included; 0 where they cannot be read.
    pub starts: u32,
    /// Whether there was no store, or one damaged beyond repair: it is a new one now, and its settings are not to be trusted.
    pub made_again: bool,
}

/// A kept image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Described {
    /// Length in bytes.
    pub length: u16,
    /// CRC-32 of all of it.
    pub crc: u32,
    /// Counts commits, and never goes back.
    pub generation: u32,
}

fields!(Selected { slot, table, previous });
fields!(Described { length, crc, generation });

impl Selected {
    /// As the host is reported.
    pub fn info(&self) -> TableInfo {
        TableInfo {
            length: u32::from(self.table.length),
            crc: self.table.crc,
            generation: self.table.generation,
            has_previous: self.previous.is_some(),
        }
    }
}

/// A value on its way into the store, which writes it where the item is put together: no copy on the stack. It is read by
/// [`Store::value`].
struct Written<'v>(RefCell<&'v mut dyn Fields>);

impl Value<'_> for Written<'_> {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        let written = self.0.try_borrow_mut().ok().and_then(|mut value| fields::write(&mut **value, buffer));
        written.ok_or(SerializationError::BufferTooSmall)
    }

    fn deserialize_from(_: &[u8]) -> Result<(Self, usize), SerializationError> {
        Err(SerializationError::InvalidFormat)
    }
}

/// Memories on their way into the store, requested one at a time: all of them are half a kilobyte. Only ever written.
struct Remembered<'m> {
    generation: u32,
    count: usize,
    memory: &'m dyn Fn(usize) -> Memory<f32>,
}

impl Fields for Remembered<'_> {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        self.generation.walk(walk);
        // A list is its length and its elements.
        (self.count as u32).walk(walk);
        for position in 0..self.count {
            (self.memory)(position).walk(walk);
        }
    }
}

type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

const SELECTED: u8 = 0x10;
const IMAGE: u8 = 0x20;
const MEMORIES: u8 = 0x40;
const PAST_FAULT: u8 = 0x50;
const PAST_FAULT_NEXT: u8 = 0x5F;
const STARTS: u8 = 0x60;

fn image_key(side: Side, slot: u8) -> u8 {
    IMAGE + 2 * side.index() as u8 + (slot & 1)
}

fn fault_of<E>(error: Error<E>) -> StoreFault {
    match error {
        Error::FullStorage
        | Error::ItemTooBig
        | Error::BufferTooSmall(_)
        | Error::BufferTooBig
        | Error::SerializationError(SerializationError::BufferTooSmall) => StoreFault::Full,
        _ => StoreFault::Medium,
    }
}

/// The store over a flash. Its flash is one that answers immediately (it blocks, or it is a file), so that no task waits on it.
pub struct Store<F: NorFlash> {
    map: MapStorage<u8, F, NoCache>,
    buffer: Placed<[u8; BUFFER]>,
}

impl<F: NorFlash> Store<F> {
    /// Opens the whole of a flash as a store; an erased one is an empty store.
    ///
    /// # Errors
    /// [`StoreFault::Full`] when the flash has fewer than two pages or a page is too small.
    pub fn open(flash: F) -> Result<Self, StoreFault> {
        let end = u32::try_from(flash.capacity()).map_err(|_| StoreFault::Full)?;
        let config = MapConfig::try_new(0..end).map_err(|_| StoreFault::Full)?;
        Ok(Self {
            map: MapStorage::new(flash, config, Cache::new_uncached()),
            buffer: placed!([u8; BUFFER], [0; BUFFER]),
        })
    }

    /// Gives the flash back.
    pub fn close(self) -> F {
        self.map.destroy().0
    }

    /// Forgets everything, for a flash that holds something else.
    ///
    /// # Errors
    /// [`StoreFault::Medium`].
    pub fn erase(&mut self) -> Result<(), StoreFault> {
        block_on(pin!(self.map.erase_all())).map_err(fault_of)
    }

    fn found(&mut self, key: u8) -> Result<Option<&[u8]>, Error<F::Error>> {
        block_on(pin!(self.map.fetch_item::<&[u8]>(&mut self.buffer[..], &key)))
    }

    fn stored(&mut self, key: u8, value: &dyn Value<'_>) -> Result<(), Error<F::Error>> {
        block_on(pin!(self.map.store_item_generic(&mut self.buffer[..], &key, value)))
    }

    fn bytes(&mut self, key: u8) -> Result<Option<&[u8]>, StoreFault> {
        self.found(key).map_err(fault_of)
    }

    fn put(&mut self, key: u8, value: &dyn Value<'_>) -> Result<(), StoreFault> {
        self.stored(key, value).map_err(fault_of)
    }

    fn put_bytes(&mut self, key: u8, bytes: &[u8]) -> Result<(), StoreFault> {
        self.put(key, &bytes)
    }

    /// A small value; one that cannot be read counts as absent.
    fn value<V: Fields + Default>(&mut self, key: u8) -> Result<Option<V>, StoreFault> {
        let mut value = V::default();
        let there = self.bytes(key)?.is_some_and(|bytes| fields::read(bytes, &mut value));
        Ok(there.then_some(value))
    }

    fn put_value(&mut self, key: u8, value: &mut dyn Fields) -> Result<(), StoreFault> {
        self.put(key, &Written(RefCell::new(value)))
    }

    /// Which table of a muscle is in use.
    ///
    /// # Errors
    /// [`StoreFault::Medium`].
    pub fn selected(&mut self, side: Side) -> Result<Option<Selected>, StoreFault> {
        self.value(SELECTED + side.index() as u8)
    }

    /// The image of the table in use.
    ///
    /// # Errors
    /// [`StoreFault::Verify`] when a table is selected and its bytes are not those that were kept.
    pub fn table(&mut self, side: Side) -> Result<Option<&[u8]>, StoreFault> {
        let Some(selected) = self.selected(side)? else { return Ok(None) };
        let image = self.bytes(image_key(side, selected.slot))?;
        match image {
            Some(image) if fits(image, &selected.table) => Ok(Some(image)),
            _ => Err(StoreFault::Verify),
        }
    }

    /// Keeps a new table and selects it. The image must have been checked already.
    ///
    /// # Errors
    /// As the medium fails; the table in use stays the old one then.
    pub fn commit(&mut self, side: Side, image: &[u8]) -> Result<Selected, StoreFault> {
        let old = self.selected(side)?;
        let slot = old.map_or(0, |old| 1 - (old.slot & 1));
        let table = Described {
            length: u16::try_from(image.len()).map_err(|_| StoreFault::Full)?,
            crc: check::of_image(image),
            generation: self.newest(side, old)?.wrapping_add(1),
        };
        let key = image_key(side, slot);
        self.put_bytes(key, image)?;
        if self.bytes(key)? != Some(image) {
            return Err(StoreFault::Verify);
        }
        let selected = Selected { slot, table, previous: old.map(|old| old.table) };
        self.select(side, selected)
    }

    /// Goes back to the table before the one of a generation. If that is not in use any more because it was gone back from already, nothing
    /// changes: the request has been repeated.
    ///
    /// # Errors
    /// [`StoreFault::NoPrevious`]; [`StoreFault::Verify`] when its bytes are damaged, and nothing changes then.
    pub fn roll_back(&mut self, side: Side, generation: u32) -> Result<Selected, StoreFault> {
        let now = self.selected(side)?.ok_or(StoreFault::NoPrevious)?;
        let before = now.previous.ok_or(StoreFault::NoPrevious)?;
        if now.table.generation != generation {
            let done = before.generation == generation;
            return if done { Ok(now) } else { Err(StoreFault::NoPrevious) };
        }
        let slot = 1 - (now.slot & 1);
        if !self.bytes(image_key(side, slot))?.is_some_and(|image| fits(image, &before)) {
            return Err(StoreFault::Verify);
        }
        self.select(side, Selected { slot, table: before, previous: Some(now.table) })
    }

    /// The highest generation that anything kept of a muscle is of: both of its tables, for after a rollback the newer one is the one before,
    /// and what effects remember, for a damaged selection is replaced by an earlier one. A new table must not find memories of another.
    fn newest(&mut self, side: Side, selected: Option<Selected>) -> Result<u32, StoreFault> {
        let remembered = self.bytes(MEMORIES + side.index() as u8)?.map_or(0, |bytes| generation_of(bytes).0);
        let tables = selected.map(|selected| (selected.table.generation, selected.previous));
        let (now, before) = tables.unwrap_or_default();
        Ok(now.max(before.map_or(0, |before| before.generation)).max(remembered))
    }

    fn select(&mut self, side: Side, mut selected: Selected) -> Result<Selected, StoreFault> {
        self.put_value(SELECTED + side.index() as u8, &mut selected)?;
        match self.selected(side)? {
            Some(kept) if kept == selected => Ok(selected),
            _ => Err(StoreFault::Verify),
        }
    }

    /// Hands what each effect remembered of a muscle since its table was committed to `act`, by its place in the table; gives how
    /// many there are. They are read one at a time: all of them are half a kilobyte.
    ///
    /// # Errors
    /// [`StoreFault::Medium`].
    pub fn each_memory(
        &mut self,
        side: Side,
        act: &mut dyn FnMut(usize, &Memory<f32>),
    ) -> Result<usize, StoreFault> {
        let generation = self.generation(side)?;
        let kept = self.bytes(MEMORIES + side.index() as u8)?;
        Ok(kept.map_or(0, |bytes| each_kept(bytes, generation, act)))
    }

    /// Keeps what n effects remember, by their places in the table; none forgets.
    ///
    /// # Errors
    /// As the medium fails.
    pub fn put_memories(
        &mut self,
        side: Side,
        count: usize,
        memory: &dyn Fn(usize) -> Memory<f32>,
    ) -> Result<(), StoreFault> {
        let generation = self.generation(side)?;
        self.put_value(MEMORIES + side.index() as u8, &mut Remembered { generation, count, memory })
    }

    fn generation(&mut self, side: Side) -> Result<u32, StoreFault> {
        Ok(self.selected(side)?.map_or(0, |selected| selected.table.generation))
    }

    /// Adds a fault to the log.
    ///
    /// # Errors
    /// As the medium fails.
    pub fn put_fault(&mut self, report: &mut FaultReport) -> Result<(), StoreFault> {
        let next = self.value::<u8>(PAST_FAULT_NEXT)?.unwrap_or(0) % FAULT_LOG as u8;
        self.put_value(PAST_FAULT + next, report)?;
        let mut after = (next + 1) % FAULT_LOG as u8;
        self.put_value(PAST_FAULT_NEXT, &mut after)
    }

    /// A past fault, 0 the last.
    ///
    /// # Errors
    /// [`StoreFault::Medium`].
    pub fn past_fault(&mut self, back: u8) -> Result<Option<FaultReport>, StoreFault> {
        let log = FAULT_LOG as u8;
        if back >= log {
            return Ok(None);
        }
        let next = self.value::<u8>(PAST_FAULT_NEXT)?.unwrap_or(0) % log;
        self.value(PAST_FAULT + (next + log - 1 - back) % log)
    }

    /// Counts a start. A store that cannot be read because something else lies on the flash, or because it is damaged beyond repair, is
    /// made again; from then on it says that its settings are lost, until someone sends some. A flash that only fails to write, as under
    /// a supply that sags, has lost nothing: it is read as it is, and the start is not counted.
    ///
    /// # Errors
    /// As the medium fails to read, or to take a store that is made again.
    pub fn start(&mut self) -> Result<Started, StoreFault> {
        let mut starts = 0;
        match self.count(&mut starts) {
            Ok(()) => return Ok(Started { starts, made_again: false }),
            // Whether it can be read is found out by those who read.
            Err(Error::Storage { .. }) => return Ok(Started { starts, made_again: false }),
            Err(_) => {}
        }
        self.erase()?;
        // First: without it, the remaining store looks like that of a new device.
        self.put_layout()?;
        starts = 0;
        self.count(&mut starts).map_err(fault_of)?;
        Ok(Started { starts, made_again: true })
    }

    fn count(&mut self, starts: &mut u32) -> Result<(), Error<F::Error>> {
        if let Some(bytes) = self.found(STARTS)?
            && !fields::read(bytes, starts)
        {
            *starts = 0;
        }
        *starts = starts.wrapping_add(1);
        self.stored(STARTS, &Written(RefCell::new(starts)))
    }
}

/// Hands what was kept for a table of this generation to `act`; gives how many memories there were.
#[inline(never)]
fn each_kept(bytes: &[u8], generation: u32, act: &mut dyn FnMut(usize, &Memory<f32>)) -> usize {
    let (kept, mut rest) = generation_of(bytes);
    if kept != generation {
        return 0;
    }
    let mut walk = Walk::new(&mut rest);
    // A list is its length and its elements.
    let mut count = 0_u32;
    count.walk(&mut walk);
    let mut read = 0;
    while read < (count as usize).min(MAX_EFFECTS) {
        let mut memory: Memory<f32> = [0.0; MEMORY];
        memory.walk(&mut walk);
        if !walk.is_whole() {
            break;
        }
        act(read, &memory);
        read += 1;
    }
    read
}

/// Of which table's generation memories are, and what follows.
fn generation_of(bytes: &[u8]) -> (u32, &[u8]) {
    let (mut rest, mut generation) = (bytes, 0_u32);
    generation.walk(&mut Walk::new(&mut rest));
    (generation, rest)
}

fn fits(image: &[u8], described: &Described) -> bool {
    image.len() == usize::from(described.length) && check::of_image(image) == described.crc
}

#[cfg(test)]
mod format_tests;
#[cfg(test)]
pub(crate) mod mock_flash;
#[cfg(test)]
mod protection_tests;
#[cfg(test)]
mod side_tests;
#[cfg(test)]
mod tests;
