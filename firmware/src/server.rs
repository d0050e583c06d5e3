//! Answers the host: reads a frame, asks the controller or the store, writes a frame. No allocation.

use embedded_storage_async::nor_flash::NorFlash;
use heapless::Vec;
use model_core::image::{self, ImageError};
use model_core::link::endpoints::{self, Service};
use model_core::link::frame::{self, Frame, Header, Kind, MAX_BODY, MAX_WIRE, crc32};
use model_core::link::hello::{self, Hello};
use model_core::link::messages::{
    DeviceInfo, Evaluate, Evaluated, Fault, FaultReport, Faults, ForgetMemory, PIECE, PastFault, Reference,
    ReferencePoints, Refusal, SetPoint, Side, Start, StartedBy, State, Status, StoreFault, TableBegin,
    TableFault, TableInfo, TablePiece, TableRead, TelemetryRate, TraceArm, TraceInfo, TracePiece, TraceRead,
    Value,
};
use model_core::link::settings::Settings;
use model_core::link::{LINK_VERSION, SCHEMA_HASH};
use model_core::table::TableError;
use model_core::units::{Length, Pressure};

use crate::board::Identity;
use crate::control::{self, Controller, TICKS_PER_S};
use crate::modes::{self, Model};
use crate::reference;
use crate::store::{self, Memories, Store};
use crate::tasks::Shared;
use crate::trace;
use crate::watch::Finding;

/// What an upload has gathered.
struct Upload {
    begun: Option<TableBegin>,
    bytes: Vec<u8, { image::MAX_LEN }>,
}

/// The link's server: one request at a time.
pub struct Server<F: NorFlash> {
    identity: Identity,
    store: Store<F>,
    starts: u32,
    upload: Upload,
    counts: frame::Counts,
    restart: bool,
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
    /// Opens the store, counts the start, and gives the controller its settings and tables. A damaged store is made anew,
    /// a damaged table is not used; both latch a fault, so that somebody looks before anything moves.
    ///
    /// # Errors
    /// The flash cannot hold a store at all.
    pub fn start(identity: Identity, flash: F, shared: &Shared) -> Result<Self, StoreFault> {
        let mut store = Store::open(flash)?;
        let mut damaged = false;
        let starts = match store.count_start() {
            Ok(starts) => starts,
            Err(_) => {
                damaged = true;
                store.erase()?;
                store.count_start()?
            }
        };
        if let Ok(Some(settings)) = store.settings()
            && control::check_settings(&settings).is_ok()
        {
            shared.with(|controller| controller.use_settings(settings));
        }
        let upload = Upload { begun: None, bytes: Vec::new() };
        let counts = frame::Counts::default();
        let mut server = Self { identity, store, starts, upload, counts, restart: false };
        for side in Side::ALL {
            match server.model(side) {
                Ok(model) => shared.with(|controller| controller.use_model(side, model)),
                Err(_) => damaged = true,
            }
        }
        let latch = match identity.started_by {
            StartedBy::Watchdog => Some(Fault::Watchdog),
            StartedBy::BrownOut => Some(Fault::BrownOut),
            StartedBy::Power | StartedBy::Request => damaged.then_some(Fault::TableInvalid),
        };
        if let Some(fault) = latch {
            let finding = Finding { fault, sensor: None, value: 0.0, limit: 0.0 };
            shared.with(|controller| controller.raise(Side::Agonist, &finding));
        }
        Ok(server)
    }

    /// The kept table of a muscle in the form that is evaluated, its effects with what they remembered.
    fn model(&mut self, side: Side) -> Result<Option<Model>, Refusal> {
        let Some(bytes) = self.store.table(side).map_err(Refusal::Store)? else { return Ok(None) };
        let table = image::read(bytes).map_err(|error| Refusal::Table(table_fault(error)))?;
        let mut model =
            Model::build(&table).map_err(|error| Refusal::Table(table_fault(ImageError::Table(error))))?;
        if let Ok(Some(memories)) = self.store.memories(side) {
            for (position, memory) in memories.iter().enumerate() {
                let persists = table.effects.get(position).is_some_and(|one| one.effect.is_persistent());
                if persists && memory.iter().all(|value| value.is_finite()) {
                    model.chain.restore(position, *memory);
                }
            }
        }
        Ok(Some(model))
    }

    /// Keeps what must not be lost and is not asked for: new faults, memories of effects. Called now and then by the link's
    /// task, and never while running: a flash may stop the processor while it erases.
    pub fn keep(&mut self, shared: &Shared) {
        let (state, fault) = shared.with(|c| {
            let state = c.state();
            (state, if state == State::Running { None } else { c.machine().take_unsaved() })
        });
        if let Some(report) = fault {
            // A store that fails here has no better place to say so than the next request that needs it.
            let _ = self.store.put_fault(&report);
        }
        if state == State::Running {
            return;
        }
        for side in Side::ALL {
            let memories = shared.with(|c| c.model(side).map(persistent_memories)).unwrap_or_default();
            if !memories.is_empty() {
                let _ = self.store.put_memories(side, &memories);
            }
        }
    }

    /// Starts again on the same flash, as after a restart that was asked for.
    ///
    /// # Errors
    /// As [`Server::start`].
    pub fn restarted(self, shared: &Shared) -> Result<Self, StoreFault> {
        let identity = Identity { started_by: StartedBy::Request, ..self.identity };
        Self::start(identity, self.store.close(), shared)
    }

    /// Whether the host asked for a restart, once the answer is out.
    pub fn wants_restart(&self) -> bool {
        self.restart
    }

    /// Tells the server what the frame accumulator has counted.
    pub fn note_counts(&mut self, counts: frame::Counts) {
        self.counts = counts;
    }

    /// Answers one frame; gives the length of the answer in `out`, 0 where there is none to give.
    pub fn handle(&mut self, request: &Frame<'_>, shared: &Shared, out: &mut [u8; MAX_WIRE]) -> usize {
        if request.header.kind != Kind::Request {
            return 0;
        }
        shared.with(Controller::heard);
        let answered = Header { kind: Kind::Response, ..request.header };
        let written = if request.header.id == hello::ID {
            frame::encode_bytes(answered, &self.hello().to_bytes(), out)
        } else {
            let mut body = [0; MAX_BODY];
            let mut session = Session { server: self, shared };
            match endpoints::answer(&mut session, request.header.id, request.body, &mut body) {
                Ok(length) => frame::encode_bytes(answered, &body[..length], out),
                Err(refusal) => {
                    frame::encode(Header { kind: Kind::Refusal, ..request.header }, &refusal, out)
                }
            }
        };
        written.unwrap_or(0)
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

fn persistent_memories(model: &Model) -> Memories {
    let mut memories = Memories::new();
    let mut any = false;
    for (effect, memory) in model.chain.memories() {
        any |= effect.is_persistent();
        // The chain is no longer than the vector.
        let _ = memories.push(*memory);
    }
    if !any {
        memories.clear();
    }
    memories
}

/// A server and the controller it asks.
struct Session<'a, F: NorFlash> {
    server: &'a mut Server<F>,
    shared: &'a Shared,
}

impl<F: NorFlash> Session<'_, F> {
    fn status_after(
        &self,
        act: impl FnOnce(&mut Controller) -> Result<(), Refusal>,
    ) -> Result<Status, Refusal> {
        self.shared.with(|controller| {
            act(controller)?;
            Ok(self.status_of(controller))
        })
    }

    fn status_of(&self, controller: &Controller) -> Status {
        Status {
            state: controller.state(),
            mode: controller.mode(),
            fault: controller.faults().latched.map(|report| report.fault),
            time_us: controller.time_us(),
            ticks: controller.ticks(),
            overruns: controller.overruns(),
            frames_good: self.server.counts.good,
            frames_bad: self.server.counts.bad,
            telemetry_dropped: self.shared.telemetry_dropped(),
            saturated_ticks: controller.saturated_ticks(),
        }
    }

    /// The store may only be written while nothing is controlled.
    fn at_rest(&self) -> Result<(), Refusal> {
        match self.shared.with(|controller| controller.state()) {
            State::Running => Err(Refusal::WrongState(State::Running)),
            State::Disarmed | State::Armed | State::Fault => Ok(()),
        }
    }

    fn drives(&self, side: Side) -> Result<(), Refusal> {
        if side.index() < usize::from(self.server.identity.muscles) {
            Ok(())
        } else {
            Err(Refusal::NotSupported)
        }
    }

    fn use_kept(&mut self, side: Side) -> Result<(), Refusal> {
        let model = self.server.model(side)?;
        self.shared.with(|controller| controller.use_model(side, model));
        Ok(())
    }
}

impl<F: NorFlash> Service for Session<'_, F> {
    fn info(&mut self, (): ()) -> Result<DeviceInfo, Refusal> {
        Ok(DeviceInfo {
            ticks_per_s: TICKS_PER_S,
            muscles: self.server.identity.muscles,
            table_capacity: image::MAX_LEN as u32,
            trace_capacity: trace::CAPACITY as u32,
            reference_capacity: reference::CAPACITY as u32,
            tables: Side::ALL.map(|side| self.server.table_info(side)),
            started_by: self.server.identity.started_by,
        })
    }

    fn status(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(|_| Ok(()))
    }

    fn arm(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(Controller::arm)
    }

    fn start(&mut self, request: Start) -> Result<Status, Refusal> {
        self.status_after(|controller| controller.start(request.mode))
    }

    fn stop(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(Controller::stop)
    }

    fn disarm(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(Controller::disarm)
    }

    fn set_point(&mut self, request: SetPoint) -> Result<Status, Refusal> {
        self.status_after(|controller| controller.set_point(request))
    }

    fn reference(&mut self, request: Reference) -> Result<Status, Refusal> {
        self.status_after(|controller| controller.reference(request))
    }

    fn reference_points(&mut self, request: ReferencePoints) -> Result<u16, Refusal> {
        self.shared.with(|controller| controller.generator().take_points(&request))
    }

    fn telemetry(&mut self, request: TelemetryRate) -> Result<TelemetryRate, Refusal> {
        self.shared.with(|controller| controller.set_telemetry(request.every_ticks));
        Ok(request)
    }

    fn faults(&mut self, (): ()) -> Result<Faults, Refusal> {
        Ok(self.shared.with(|controller| controller.faults().clone()))
    }

    fn past_fault(&mut self, request: PastFault) -> Result<Option<FaultReport>, Refusal> {
        self.server.keep(self.shared);
        self.server.store.past_fault(request.back).map_err(Refusal::Store)
    }

    fn clear_fault(&mut self, (): ()) -> Result<Status, Refusal> {
        // The report goes to the log before it is forgotten.
        self.server.keep(self.shared);
        self.status_after(Controller::clear)
    }

    fn settings(&mut self, (): ()) -> Result<Settings, Refusal> {
        Ok(self.shared.with(|controller| *controller.settings()))
    }

    fn set_settings(&mut self, request: Settings) -> Result<Settings, Refusal> {
        control::check_settings(&request)?;
        self.at_rest()?;
        self.server.store.put_settings(&request).map_err(Refusal::Store)?;
        self.shared.with(|controller| controller.use_settings(request));
        Ok(request)
    }

    fn table_begin(&mut self, request: TableBegin) -> Result<(), Refusal> {
        self.drives(request.side)?;
        self.server.upload.begun = None;
        self.server.upload.bytes.clear();
        if request.length as usize > image::MAX_LEN {
            return Err(Refusal::Table(TableFault::TooLong(image::MAX_LEN as u32)));
        }
        self.server.upload.begun = Some(request);
        Ok(())
    }

    fn table_piece(&mut self, request: TablePiece) -> Result<u32, Refusal> {
        let Upload { begun, bytes } = &mut self.server.upload;
        let Some(begun) = begun else { return Err(Refusal::Table(TableFault::NotBegun)) };
        let there = bytes.len() as u32;
        if request.offset != there {
            return Err(Refusal::Table(TableFault::Gap(there)));
        }
        if there as usize + request.bytes.len() > begun.length as usize {
            return Err(Refusal::Table(TableFault::TooLong(begun.length)));
        }
        bytes.extend_from_slice(&request.bytes).map_err(|_| Refusal::Range)?;
        Ok(bytes.len() as u32)
    }

    fn table_commit(&mut self, (): ()) -> Result<TableInfo, Refusal> {
        self.at_rest()?;
        let Upload { begun, bytes } = &self.server.upload;
        let Some(begun) = *begun else { return Err(Refusal::Table(TableFault::NotBegun)) };
        if bytes.len() < begun.length as usize {
            return Err(Refusal::Table(TableFault::Incomplete(bytes.len() as u32)));
        }
        if crc32(bytes) != begun.crc {
            return Err(Refusal::Table(TableFault::Check));
        }
        // Bytes behind the image would be kept and never read.
        let announced = image::announced_len(bytes).map_err(|error| Refusal::Table(table_fault(error)))?;
        if announced != bytes.len() {
            return Err(Refusal::Table(TableFault::Malformed));
        }
        let table = image::read(bytes).map_err(|error| Refusal::Table(table_fault(error)))?;
        Model::build(&table).map_err(|error| Refusal::Table(table_fault(ImageError::Table(error))))?;
        let selected = self.server.store.commit(begun.side, bytes).map_err(Refusal::Store)?;
        self.server.upload.begun = None;
        self.use_kept(begun.side)?;
        Ok(selected.info())
    }

    fn table_read(&mut self, request: TableRead) -> Result<TablePiece, Refusal> {
        let image = self.server.store.table(request.side).map_err(Refusal::Store)?;
        let image = image.ok_or(Refusal::NoTable(request.side))?;
        let rest = image.get(request.offset as usize..).unwrap_or_default();
        let piece = &rest[..rest.len().min(PIECE)];
        let bytes = Vec::from_slice(piece).map_err(|_| Refusal::Range)?;
        Ok(TablePiece { offset: request.offset, bytes })
    }

    fn table_rollback(&mut self, request: Side) -> Result<TableInfo, Refusal> {
        self.at_rest()?;
        let selected = self.server.store.roll_back(request).map_err(Refusal::Store)?;
        self.use_kept(request)?;
        Ok(selected.info())
    }

    fn evaluate(&mut self, request: Evaluate) -> Result<Evaluated, Refusal> {
        let direction = f32::from(request.direction.signum());
        let mut values = Vec::new();
        for point in &request.points {
            let value = self.shared.with(|controller| {
                let model = controller.model(request.side)?;
                let held = model.muscle.held(Length::from_metres(point.stroke_m));
                let pressure = Pressure::from_pascals(point.pressure_pa);
                let force = model.muscle.force(pressure, Length::from_metres(point.stroke_m), direction);
                let found = modes::base_pressure(
                    &model.muscle,
                    &held,
                    direction,
                    force,
                    pressure,
                    &model.muscle.search(),
                );
                Some(Value { force_n: force.newtons(), pressure_pa: found.pressure.pascals() })
            });
            values.push(value.ok_or(Refusal::NoTable(request.side))?).map_err(|_| Refusal::Range)?;
        }
        Ok(Evaluated { values })
    }

    fn trace_arm(&mut self, request: TraceArm) -> Result<TraceInfo, Refusal> {
        self.shared.with(|controller| {
            controller.trace().arm(&request)?;
            Ok(controller.trace().info())
        })
    }

    fn trace_info(&mut self, (): ()) -> Result<TraceInfo, Refusal> {
        Ok(self.shared.with(|controller| controller.trace().info()))
    }

    fn trace_read(&mut self, request: TraceRead) -> Result<TracePiece, Refusal> {
        self.shared.with(|controller| controller.trace().read(request.record))
    }

    fn forget_memory(&mut self, request: ForgetMemory) -> Result<(), Refusal> {
        self.at_rest()?;
        self.server.store.put_memories(request.side, &Memories::new()).map_err(Refusal::Store)?;
        self.use_kept(request.side)
    }

    fn restart(&mut self, (): ()) -> Result<(), Refusal> {
        match self.shared.with(|controller| controller.state()) {
            State::Running | State::Armed => Err(Refusal::WrongState(self.shared.with(|c| c.state()))),
            State::Disarmed | State::Fault => {
                self.server.keep(self.shared);
                self.server.restart = true;
                Ok(())
            }
        }
    }
}
