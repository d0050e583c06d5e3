//! The answer to each endpoint.

use embedded_storage_async::nor_flash::NorFlash;
use heapless::Vec;
use model_core::image;
use model_core::link::endpoints::Service;
use model_core::link::messages::{
    DeviceInfo, Evaluate, Evaluated, FaultReport, Faults, ForgetMemory, PIECE, PastFault, Reference,
    ReferencePoints, Refusal, SetPoint, Side, Start, State, Status, TableBegin, TableInfo, TablePiece,
    TableRead, TelemetryRate, TraceArm, TraceInfo, TracePiece, TraceRead, Value,
};
use model_core::link::settings::Settings;
use model_core::muscle::Held;
use model_core::single;
use model_core::units::{Length, Pressure};

use super::Server;
use crate::control::{self, Controller};
use crate::reference;
use crate::shared::Shared;
use crate::store::Memories;
use crate::tick::TICKS_PER_S;
use crate::trace;

/// A server and the controller it asks.
pub(super) struct Session<'a, F: NorFlash> {
    pub(super) server: &'a mut Server<F>,
    pub(super) shared: &'a Shared,
}

impl<F: NorFlash> Session<'_, F> {
    /// The status, if what was asked for could be done.
    #[inline(never)]
    fn status_after(&self, done: Result<(), Refusal>) -> Result<Status, Refusal> {
        done?;
        Ok(self.shared.with(|controller| Status {
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
        }))
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
        self.status_after(Ok(()))
    }

    fn arm(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(self.shared.with(Controller::arm))
    }

    fn start(&mut self, request: Start) -> Result<Status, Refusal> {
        self.status_after(self.shared.with(|controller| controller.start(request.mode)))
    }

    fn stop(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(self.shared.with(Controller::stop))
    }

    fn disarm(&mut self, (): ()) -> Result<Status, Refusal> {
        self.status_after(self.shared.with(Controller::disarm))
    }

    fn set_point(&mut self, request: SetPoint) -> Result<Status, Refusal> {
        self.status_after(self.shared.with(|controller| controller.set_point(request)))
    }

    fn reference(&mut self, request: Reference) -> Result<Status, Refusal> {
        self.status_after(self.shared.with(|controller| controller.reference(request)))
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
        self.status_after(self.shared.with(Controller::clear))
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
        self.server.upload.begin(request)
    }

    fn table_piece(&mut self, request: TablePiece) -> Result<u32, Refusal> {
        self.server.upload.add(&request)
    }

    fn table_commit(&mut self, (): ()) -> Result<TableInfo, Refusal> {
        self.at_rest()?;
        let (side, bytes) = self.server.upload.whole()?;
        let selected = self.server.store.commit(side, bytes).map_err(Refusal::Store)?;
        self.server.upload.forget();
        self.server.use_kept(side, self.shared)?;
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
        self.server.use_kept(request, self.shared)?;
        Ok(selected.info())
    }

    fn evaluate(&mut self, request: Evaluate) -> Result<Evaluated, Refusal> {
        let direction = f32::from(request.direction.signum());
        let mut values = Vec::new();
        for point in &request.points {
            let stroke = Length::from_metres(point.stroke_m);
            let pressure = Pressure::from_pascals(point.pressure_pa);
            let value = self.shared.with(|controller| {
                let muscle = &controller.model(request.side)?.muscle;
                // As the control step does it, so that no other form of either is in the image.
                let mut held = Held::NONE;
                let force = single::pose(muscle, &mut held, stroke, pressure, direction);
                let found = single::pressure_for(muscle, &held, direction, force, pressure, &muscle.search());
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
        self.server.use_kept(request.side, self.shared)
    }

    fn restart(&mut self, (): ()) -> Result<(), Refusal> {
        match self.shared.with(|controller| controller.state()) {
            State::Running | State::Armed => Err(Refusal::WrongState(self.shared.with(|c| c.state()))),
            State::Disarmed | State::Fault => {
                self.server.keep_all(self.shared);
                self.server.restart = true;
                Ok(())
            }
        }
    }
}
