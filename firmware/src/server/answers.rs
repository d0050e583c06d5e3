//! The answer to each endpoint.

use embedded_storage_async::nor_flash::NorFlash;
use model_core::effects::Memory;
use model_core::image::{self, ImageError};
use model_core::link::endpoints::Service;
use model_core::link::messages::{
    DeviceInfo, Evaluate, Evaluated, FaultReport, Faults, ForgetMemory, HealthRead, HealthSums, MeanSignals,
    PIECE, PastFault, ReferenceOrder, ReferencePoints, Refusal, RollBack, Session, SetPointOrder, Side,
    SignalsRead, Start, State, Status, TableBegin, TableInfo, TablePiece, TableRead, TelemetryRate, TraceArm,
    TraceInfo, TracePiece, TraceRead, UpdateBegin, UpdatePiece, UpdateStatus, Value,
};
use model_core::link::settings::Settings;
use model_core::muscle::AtStroke;
use model_core::single_precision;
use model_core::units::{Length, Pressure};

use super::{Server, table_refusal};
use crate::control::{self, Controller};
use crate::reference;
use crate::shared::Shared;
use crate::shared_buffer::{Incoming, TRACE_CAPACITY};
use crate::tick::TICKS_PER_S;
use crate::update::Update;

/// A server and the controller that it asks.
pub(super) struct Answers<'a, F: NorFlash> {
    pub(super) server: &'a mut Server<F>,
    pub(super) shared: &'a Shared,
}

impl<F: NorFlash> Answers<'_, F> {
    /// The status, if the setpoint could be done.
    #[inline(never)]
    fn status_after(&self, done: Result<(), Refusal>, answer: &mut Status) -> Result<(), Refusal> {
        done?;
        *answer = self.shared.with(|controller| Status {
            state: controller.state(),
            mode: controller.mode(),
            fault: controller.faults().latched.map(|report| report.fault),
            time_us: controller.time_us(),
            ticks: controller.ticks(),
            overruns: controller.overruns(),
            frames_good: self.server.frames(|counts| counts.good),
            frames_bad: self.server.frames(|counts| counts.bad),
            telemetry_dropped: self.shared.telemetry_dropped(),
            saturated_ticks: controller.saturated_ticks(),
            line_errors: self.shared.line_errors(),
            bus_offs: self.shared.bus_offs(),
            tables: Side::ALL.map(|side| controller.health(side).state()),
        });
        Ok(())
    }

    /// What a host has kept is changed only while every muscle is vented, because a flash may stop the processor, and not while the
    /// device is armed: the session that armed it relies on the settings and tables of then.
    fn at_rest(&self) -> Result<(), Refusal> {
        self.shared.with(|controller| match controller.state() {
            State::Disarmed | State::Fault if controller.is_vented() => Ok(()),
            state => Err(Refusal::WrongState(state)),
        })
    }

    fn updater(&mut self) -> Result<&mut (dyn Update + Send + 'static), Refusal> {
        match &mut self.server.update {
            Some(update) => Ok(&mut **update),
            None => Err(Refusal::NotSupported),
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

impl<F: NorFlash> Service for Answers<'_, F> {
    fn info(&mut self, (): &(), answer: &mut DeviceInfo) -> Result<(), Refusal> {
        *answer = DeviceInfo {
            ticks_per_s: TICKS_PER_S,
            muscles: self.server.identity.muscles,
            table_capacity: image::MAX_LEN as u32,
            trace_capacity: TRACE_CAPACITY as u32,
            reference_capacity: reference::CAPACITY as u32,
            tables: Side::ALL.map(|side| self.server.table_info(side)),
            started_by: self.server.identity.started_by,
        };
        Ok(())
    }

    fn status(&mut self, (): &(), answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(Ok(()), answer)
    }

    fn arm(&mut self, request: &Session, answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(self.shared.with(|controller| controller.arm(*request)), answer)
    }

    fn start(&mut self, request: &Start, answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(
            self.shared.with(|controller| controller.start(request.mode, request.session)),
            answer,
        )
    }

    fn stop(&mut self, (): &(), answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(self.shared.with(Controller::stop), answer)
    }

    fn disarm(&mut self, (): &(), answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(self.shared.with(Controller::disarm), answer)
    }

    fn set_point(&mut self, request: &SetPointOrder, answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(self.shared.with(|controller| controller.set_point(*request)), answer)
    }

    fn reference(&mut self, request: &ReferenceOrder, answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(self.shared.with(|controller| controller.reference(*request)), answer)
    }

    fn reference_points(&mut self, request: &ReferencePoints, answer: &mut u16) -> Result<(), Refusal> {
        *answer = self.shared.with(|controller| controller.reference_points(request))?;
        Ok(())
    }

    fn telemetry(&mut self, request: &TelemetryRate, answer: &mut TelemetryRate) -> Result<(), Refusal> {
        self.shared.with(|controller| controller.set_telemetry(request.every_ticks));
        *answer = *request;
        Ok(())
    }

    fn faults(&mut self, (): &(), answer: &mut Faults) -> Result<(), Refusal> {
        self.shared.with(|controller| *answer = *controller.faults());
        Ok(())
    }

    fn past_fault(&mut self, request: &PastFault, answer: &mut Option<FaultReport>) -> Result<(), Refusal> {
        self.server.keep(self.shared);
        *answer = self.server.store.past_fault(request.back).map_err(Refusal::Store)?;
        Ok(())
    }

    fn clear_fault(&mut self, (): &(), answer: &mut Status) -> Result<(), Refusal> {
        self.status_after(self.shared.with(Controller::clear), answer)?;
        // What a hold has kept back can be written now.
        self.server.keep(self.shared);
        Ok(())
    }

    fn settings(&mut self, (): &(), answer: &mut Settings) -> Result<(), Refusal> {
        self.shared.with(|controller| *answer = *controller.settings());
        Ok(())
    }

    fn set_settings(&mut self, request: &Settings, answer: &mut Settings) -> Result<(), Refusal> {
        let hardware = self.shared.with(|controller| controller.hardware());
        control::check_settings(request, hardware)?;
        self.at_rest()?;
        *answer = *request;
        self.server.store.put_settings(answer).map_err(Refusal::Store)?;
        self.shared.with(|controller| {
            controller.use_settings(request);
            controller.confirm_settings();
        });
        Ok(())
    }

    fn table_begin(&mut self, request: &TableBegin, (): &mut ()) -> Result<(), Refusal> {
        self.drives(request.side)?;
        self.server.upload.begin(*request, self.shared)
    }

    fn table_piece(&mut self, request: &TablePiece, answer: &mut u32) -> Result<(), Refusal> {
        *answer = self.server.upload.add(request)?;
        Ok(())
    }

    fn table_commit(&mut self, (): &(), answer: &mut TableInfo) -> Result<(), Refusal> {
        self.at_rest()?;
        let (side, Incoming { image, table }) = self.server.upload.whole()?;
        // Built before it is kept: what is selected on flash has been in use.
        let built = self.shared.with(|controller| controller.use_table(side, table));
        let kept = match built {
            Ok(()) => self.server.store.commit(side, image).map_err(Refusal::Store),
            Err(error) => Err(table_refusal(ImageError::Table(error))),
        };
        match kept {
            Ok(selected) => *answer = selected.info(),
            Err(refusal) => {
                // The table before stays the one in use. If it cannot be read either, there is none, and a fault says so.
                let _ = self.server.use_again(side, self.shared);
                return Err(refusal);
            }
        }
        self.server.use_again(side, self.shared)
    }

    fn table_read(&mut self, request: &TableRead, answer: &mut TablePiece) -> Result<(), Refusal> {
        let image = self.server.store.table(request.side).map_err(Refusal::Store)?;
        let image = image.ok_or(Refusal::NoTable(request.side))?;
        let rest = image.get(request.offset as usize..).unwrap_or_default();
        answer.offset = request.offset;
        answer.bytes.extend_from_slice(&rest[..rest.len().min(PIECE)]).map_err(|_| Refusal::Range)
    }

    fn table_rollback(&mut self, request: &RollBack, answer: &mut TableInfo) -> Result<(), Refusal> {
        self.at_rest()?;
        let RollBack { side, generation } = *request;
        *answer = self.server.store.roll_back(side, generation).map_err(Refusal::Store)?.info();
        self.server.use_again(side, self.shared)
    }

    fn evaluate(&mut self, request: &Evaluate, answer: &mut Evaluated) -> Result<(), Refusal> {
        let direction = f32::from(request.direction.signum());
        for point in &request.points {
            let stroke = Length::from_metres(point.stroke_m);
            let pressure = Pressure::from_pascals(point.pressure_pa);
            let value = self.shared.with(|controller| {
                let muscle = &controller.model(request.side)?.muscle;
                // As the control step does it, so that no other form of either is in the image.
                let mut held = AtStroke::NONE;
                let force = single_precision::pose(muscle, &mut held, stroke, pressure, direction);
                let found = single_precision::pressure_for(
                    muscle,
                    &held,
                    direction,
                    force,
                    pressure,
                    &muscle.search(),
                );
                Some(Value { force_n: force.newtons(), pressure_pa: found.pressure.pascals() })
            });
            let value = value.ok_or(Refusal::NoTable(request.side))?;
            answer.values.push(value).map_err(|_| Refusal::Range)?;
        }
        Ok(())
    }

    fn trace_arm(&mut self, request: &TraceArm, answer: &mut TraceInfo) -> Result<(), Refusal> {
        // A table upload uses the shared buffer of the trace.
        self.server.upload.forget(self.shared);
        self.shared.with(|controller| {
            controller.trace().arm(request)?;
            controller.trace().describe(answer);
            Ok(())
        })
    }

    fn trace_info(&mut self, (): &(), answer: &mut TraceInfo) -> Result<(), Refusal> {
        self.shared.with(|controller| controller.trace().describe(answer));
        Ok(())
    }

    fn trace_read(&mut self, request: &TraceRead, answer: &mut TracePiece) -> Result<(), Refusal> {
        self.shared.with(|controller| controller.trace().read(request.record, answer))
    }

    fn forget_memory(&mut self, request: &ForgetMemory, (): &mut ()) -> Result<(), Refusal> {
        self.at_rest()?;
        self.server.store.put_memories(request.side, 0, &|_| Memory::default()).map_err(Refusal::Store)?;
        self.server.use_again(request.side, self.shared)
    }

    fn restart(&mut self, (): &(), (): &mut ()) -> Result<(), Refusal> {
        self.at_rest()?;
        self.server.keep_all(self.shared);
        self.server.restart = true;
        Ok(())
    }

    fn health(&mut self, request: &HealthRead, answer: &mut HealthSums) -> Result<(), Refusal> {
        self.shared.with(|controller| controller.health(request.side).describe(answer));
        Ok(())
    }

    fn signals(&mut self, request: &SignalsRead, answer: &mut MeanSignals) -> Result<(), Refusal> {
        self.drives(request.side)?;
        self.shared.with(|controller| controller.take_signals(request.side, answer));
        Ok(())
    }

    fn board_settings(&mut self, (): &(), answer: &mut Settings) -> Result<(), Refusal> {
        *answer = self.shared.with(|controller| controller.hardware()).settings;
        Ok(())
    }

    fn update(&mut self, (): &(), answer: &mut UpdateStatus) -> Result<(), Refusal> {
        self.updater()?.status(answer)
    }

    fn update_begin(&mut self, request: &UpdateBegin, answer: &mut UpdateStatus) -> Result<(), Refusal> {
        self.at_rest()?;
        self.updater()?.begin(&request.header)?;
        self.updater()?.status(answer)
    }

    fn update_piece(&mut self, request: &UpdatePiece, answer: &mut u32) -> Result<(), Refusal> {
        self.at_rest()?;
        *answer = self.updater()?.piece(request)?;
        Ok(())
    }

    fn update_commit(&mut self, (): &(), answer: &mut UpdateStatus) -> Result<(), Refusal> {
        self.at_rest()?;
        self.updater()?.commit()?;
        self.updater()?.status(answer)
    }

    fn update_confirm(&mut self, (): &(), answer: &mut UpdateStatus) -> Result<(), Refusal> {
        self.at_rest()?;
        self.updater()?.confirm()?;
        self.updater()?.status(answer)
    }

    fn update_revert(&mut self, (): &(), answer: &mut UpdateStatus) -> Result<(), Refusal> {
        self.at_rest()?;
        self.updater()?.revert()?;
        self.updater()?.status(answer)
    }

    fn keep_alive(&mut self, request: &Session, (): &mut ()) -> Result<(), Refusal> {
        self.shared.with(|controller| controller.keep_alive(*request))
    }
}
