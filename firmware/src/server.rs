//! Answers the host: reads a frame, asks the controller or the store, writes a frame. No allocation.

mod answers;
mod upload;
mod wear;

use embedded_storage_async::nor_flash::NorFlash;
use model_core::effects::Memory;
use model_core::image::{self, ImageError};
use model_core::link::endpoints;
use model_core::link::frame::{self, Exchange, Header, Kind};
use model_core::link::hello::{self, Hello};
use model_core::link::messages::{Fault, Refusal, Side, StartedBy, StoreFault, TableFault, TableInfo};
use model_core::link::{LINK_VERSION, SCHEMA_HASH};
use model_core::table::{MuscleTable, TableError};

use crate::board::Identity;
use crate::control;
use crate::modes::Model;
use crate::shared::Shared;
use crate::store::{self, Kept, Started, Store};
use crate::update::Update;
use crate::watch::Finding;

use self::answers::Answers;
use self::upload::Upload;
use self::wear::Wear;

/// What takes another firmware: on a board in a static of its own.
#[cfg(any(test, feature = "std"))]
pub type Updates = std::boxed::Box<dyn Update + Send>;
/// What takes another firmware: on a board in a static of its own.
#[cfg(not(any(test, feature = "std")))]
pub type Updates = &'static mut (dyn Update + Send);

/// Where a request comes from. Each line has its answers; all share the controller, which its sessions guard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// The only line, or the one to a computer beside the device.
    Serial,
    /// A CAN bus.
    Can,
}

/// The link's server: one request at a time.
pub struct Server<F: NorFlash> {
    identity: Identity,
    store: Store<F>,
    starts: u32,
    upload: Upload,
    wear: Wear,
    counts: [frame::Counts; 2],
    restart: bool,
    update: Option<Updates>,
}

/// Turns an image's error into the wire's.
pub fn table_fault(error: ImageError) -> TableFault {
    match error {
        ImageError::Truncated => TableFault::Incomplete(0),
        ImageError::NotATable | ImageError::Body => TableFault::Malformed,
        ImageError::Version { found, expected } => TableFault::Version { found, known: expected },
        ImageError::Checksum => TableFault::Check,
        ImageError::TooLong => TableFault::TooLong(image::MAX_LEN as u32),
        ImageError::Table(TableError::Node(_)) => TableFault::NotOrdered,
        ImageError::Table(TableError::Effect(_)) => TableFault::UnknownEffect,
        ImageError::Table(TableError::BlockedForce) => TableFault::NotFinite,
        ImageError::Table(_) => TableFault::OutOfRange,
    }
}

impl<F: NorFlash> Server<F> {
    /// Opens the store, counts the start, and gives the controller its settings and tables. A store damaged beyond repair is made again,
    /// a damaged table is not used; both latch a fault, so that someone looks before anything moves. A write that fails erases nothing.
    ///
    /// # Errors
    /// The flash cannot hold a store at all, or cannot be read.
    #[inline(never)]
    pub fn start(identity: Identity, flash: F, shared: &Shared) -> Result<Self, StoreFault> {
        let mut store = Store::open(flash)?;
        let Started { starts, made_again } = store.start()?;
        let mut damaged = made_again;
        use_settings(&mut store, damaged, shared)?;
        let counts = [frame::Counts::default(); 2];
        let mut server = Self {
            identity,
            store,
            starts,
            upload: Upload::default(),
            wear: Wear::default(),
            counts,
            restart: false,
            update: None,
        };
        for side in Side::ALL {
            damaged |= server.use_kept(side, shared).is_err();
        }
        let started = match identity.started_by {
            StartedBy::Watchdog => Some(Fault::Watchdog),
            StartedBy::BrownOut => Some(Fault::BrownOut),
            StartedBy::Power | StartedBy::Request => None,
        };
        for fault in [identity.fault, started, damaged.then_some(Fault::TableInvalid)].into_iter().flatten() {
            let finding = Finding { fault, sensor: None, value: 0.0, limit: 0.0 };
            shared.with(|controller| controller.raise(Side::Agonist, &finding));
        }
        Ok(server)
    }

    /// Takes another firmware from now on.
    pub fn take_updates(&mut self, update: Updates) {
        self.update = Some(update);
    }

    /// The device restarts: see [`Update::restarted`].
    #[cfg(any(test, feature = "std"))]
    pub fn boot(&mut self) {
        if let Some(update) = &mut self.update {
            update.restarted();
        }
    }

    /// Has the controller use the kept table of a muscle, its effects with the memories that were kept. Where it cannot be used, no other
    /// stays in use. In two functions that are not inlined: the second reuses the stack of the first.
    fn use_kept(&mut self, side: Side, shared: &Shared) -> Result<(), Refusal> {
        match self.use_table(side, shared) {
            Ok(true) => self.remember(side, shared),
            Ok(false) => {}
            Err(refusal) => {
                shared.with(|controller| controller.forget_table(side));
                return Err(refusal);
            }
        }
        Ok(())
    }

    /// The same after a request has changed what is kept, or has failed to: what cannot be used latches a fault.
    fn use_again(&mut self, side: Side, shared: &Shared) -> Result<(), Refusal> {
        let used = self.use_kept(side, shared);
        if used.is_err() {
            let finding = Finding { fault: Fault::TableInvalid, sensor: None, value: 0.0, limit: 0.0 };
            shared.with(|controller| controller.raise(side, &finding));
        }
        used
    }

    /// Has the controller use the kept table of a muscle; returns whether there is one.
    #[inline(never)]
    fn use_table(&mut self, side: Side, shared: &Shared) -> Result<bool, Refusal> {
        let Some(bytes) = self.store.table(side).map_err(Refusal::Store)? else {
            shared.with(|controller| controller.forget_table(side));
            return Ok(false);
        };
        let table = &mut self.upload.place(shared)?.table;
        let used = read_table(bytes, table).and_then(|()| {
            let used = shared.with(|controller| controller.use_table(side, table));
            used.map_err(|error| table_refusal(ImageError::Table(error)))
        });
        self.upload.forget(shared);
        used.map(|()| true)
    }

    /// Gives a table's effects the memories that were kept.
    #[inline(never)]
    fn remember(&mut self, side: Side, shared: &Shared) {
        // What cannot be read is as if it had not been kept.
        let _ = self.store.each_memory(side, &mut |position, memory| {
            shared.with(|controller| {
                let Some(model) = controller.model_mut(side) else { return };
                let effect = model.chain.memories().nth(position);
                let persists = effect.is_some_and(|(effect, _)| effect.is_persistent());
                if persists && memory.iter().all(|value| value.is_finite()) {
                    model.chain.restore(position, memory);
                }
            });
        });
    }

    /// Keeps what must not be lost and is not requested: new faults, memories of effects. Called now and then by the link's
    /// task, and never while a muscle is not vented: a flash may stop the processor while it erases.
    pub fn keep(&mut self, shared: &Shared) {
        if !shared.with(|controller| controller.is_vented()) {
            return;
        }
        self.keep_fault(shared);
        self.keep_memories(shared, false);
    }

    #[inline(never)]
    fn keep_fault(&mut self, shared: &Shared) {
        while let Some(mut report) = shared.with(|controller| controller.machine().take_unsaved()) {
            // A store that fails here has no better place to say so than the next request that needs it.
            let _ = self.store.put_fault(&mut report);
        }
    }

    /// The same before a restart, and whatever has moved.
    fn keep_all(&mut self, shared: &Shared) {
        self.keep(shared);
        self.keep_memories(shared, true);
    }

    fn keep_memories(&mut self, shared: &Shared, always: bool) {
        for side in Side::ALL {
            self.keep_memory(side, shared, always);
        }
    }

    /// Keeps what all effects of a muscle's table remember, if any of them must and has moved.
    #[inline(never)]
    fn keep_memory(&mut self, side: Side, shared: &Shared, always: bool) {
        let (count, tick) = shared.with(|c| (c.model(side).map_or(0, persistent_memories), c.ticks()));
        let memory = |position| {
            let found = |model: &Model| model.chain.memories().nth(position).map(|(_, memory)| *memory);
            shared.with(|c| c.model(side).and_then(found).unwrap_or_default())
        };
        if count == 0 || !self.is_worth_keeping(side, count, &memory) {
            return;
        }
        if self.wear.allows(tick) || always {
            // What cannot be written now is tried again with the next change of state.
            let _ = self.store.put_memories(side, count, &memory);
        }
    }

    fn is_worth_keeping(&mut self, side: Side, count: usize, memory: &dyn Fn(usize) -> Memory<f32>) -> bool {
        let mut moved = false;
        let kept = self.store.each_memory(side, &mut |position, kept| {
            moved |= position >= count || wear::has_moved(kept, &memory(position));
        });
        moved || kept != Ok(count)
    }

    /// Starts again on the same flash, as after a restart that was requested.
    ///
    /// # Errors
    /// As [`Server::start`].
    pub fn restarted(self, shared: &Shared) -> Result<Self, StoreFault> {
        let identity = Identity { started_by: StartedBy::Request, ..self.identity };
        let mut again = Self::start(identity, self.store.close(), shared)?;
        again.update = self.update;
        Ok(again)
    }

    /// Whether the host requested a restart, once the answer is out.
    pub fn wants_restart(&self) -> bool {
        self.restart
    }

    /// Gives the server the counts of a line's frame accumulator.
    pub fn note_counts(&mut self, line: Line, counts: frame::Counts) {
        self.counts[line as usize] = counts;
    }

    /// A count of frames over all lines.
    fn frames(&self, count: fn(&frame::Counts) -> u32) -> u32 {
        self.counts.iter().map(count).fold(0, u32::wrapping_add)
    }

    /// Answers one frame in its own place; gives the answer, empty where there is none to give.
    #[inline(never)]
    pub fn handle<'a>(&mut self, mut exchange: Exchange<'a>, shared: &Shared) -> &'a [u8] {
        let header = exchange.header();
        if header.kind != Kind::Request {
            return &[];
        }
        let answered = if header.id == hello::ID {
            let hello = self.hello().to_bytes();
            frame::encode_bytes(Header { kind: Kind::Response, ..header }, &hello, exchange.room())
                .map_err(|_| Refusal::Range)
        } else {
            let mut answers = Answers { server: self, shared };
            endpoints::answer(&mut answers, &mut exchange)
                .or_else(|mut refusal| exchange.answer(Kind::Refusal, &mut refusal))
        };
        exchange.written(answered.unwrap_or(0))
    }

    fn hello(&self) -> Hello {
        let part = |text: &str| text.parse().unwrap_or(0);
        Hello {
            release: (
                part(env!("CARGO_PKG_VERSION_MAJOR")),
                part(env!("CARGO_PKG_VERSION_MINOR")),
                part(env!("CARGO_PKG_VERSION_PATCH")),
            ),
            link_version: LINK_VERSION,
            table_format: image::VERSION,
            store_format: store::FORMAT,
            schema_hash: SCHEMA_HASH,
            board: self.identity.board as u8,
            muscles: self.identity.muscles,
            serial: self.identity.serial,
            starts: self.starts,
        }
    }

    fn table_info(&mut self, side: Side) -> Option<TableInfo> {
        self.store.selected(side).ok().flatten().map(|selected| selected.info())
    }
}

/// Has the controller use the kept settings. What is damaged or of another layout is taken over as far as it can be, and latches a
/// fault: the device cannot be armed until someone has checked the settings in force and sent them.
#[inline(never)]
fn use_settings<F: NorFlash>(store: &mut Store<F>, damaged: bool, shared: &Shared) -> Result<(), StoreFault> {
    let hardware = shared.with(|controller| controller.hardware());
    let mut settings = hardware.settings;
    let kept = store.settings(&mut settings)?;
    let repaired = control::repair_settings(&mut settings, hardware);
    let untrusted = damaged || repaired || kept == Kept::Untrusted;
    if !untrusted && kept != Kept::Whole {
        store.put_settings(&mut settings)?;
    }
    shared.with(|controller| {
        controller.use_settings(&settings);
        if untrusted {
            controller.distrust_settings();
        }
    });
    Ok(())
}

fn table_refusal(error: ImageError) -> Refusal {
    Refusal::Table(table_fault(error))
}

/// Reads a table from its image, in the one copy of that code.
#[inline(never)]
fn read_table(image: &[u8], table: &mut MuscleTable) -> Result<(), Refusal> {
    image::read_into(image, table).map_err(table_refusal)
}

/// How many effects' memories must survive a power cycle: those of all, if any of them must.
fn persistent_memories(model: &Model) -> usize {
    let any = model.chain.memories().any(|(effect, _)| effect.is_persistent());
    if any { model.chain.memories().count() } else { 0 }
}

#[cfg(test)]
mod tests;
