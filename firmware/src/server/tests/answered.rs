//! What each request of a host is answered with, and what it brings about.

use model_core::link::messages::{
    DeviceInfo, Evaluate, Evaluated, FaultReport, Faults, ForgetMemory, HealthRead, HealthSums, MeanSignals,
    Mode, PastFault, Point, Reference, ReferenceOrder, ReferencePoints, SignalsRead, Start, Status,
    TableRead, TelemetryRate, TraceArm, TraceInfo, TracePiece, TraceRead, Trigger, UpdateBegin, UpdatePiece,
    UpdateStatus, Variable,
};

use super::*;
use crate::tick::{TICK_US, TICKS_PER_S};

/// A server with a table, after ten ticks.
fn with_table(shared: &Shared) -> Server<MockFlash> {
    let mut server = started(MockFlash::erased(), shared);
    assert!(send(&mut server, shared, &image(40.0)).is_ok());
    pass(shared, 10, &mut 0.0);
    server
}

#[test]
fn the_status_and_the_device_are_described_as_they_are() {
    let shared = Shared::new(Settings::default());
    let mut server = with_table(&shared);
    server.note_counts(Line::Serial, frame::Counts { good: 2, bad: 2 });
    server.note_counts(Line::Can, frame::Counts { good: 1, bad: 0 });
    let mut answers = Answers { server: &mut server, shared: &shared };
    let mut info = DeviceInfo::default();
    assert_eq!(answers.info(&(), &mut info), Ok(()));
    assert_eq!((info.muscles, info.ticks_per_s, info.started_by), (1, TICKS_PER_S, StartedBy::Power));
    assert_eq!(info.table_capacity as usize, image::MAX_LEN);
    assert_eq!(info.tables.map(|table| table.map(|table| table.generation)), [Some(1), None]);
    let mut status = Status::default();
    assert_eq!(answers.status(&(), &mut status), Ok(()));
    assert_eq!((status.state, status.mode, status.fault), (State::Disarmed, Mode::Vent, None));
    assert_eq!((status.ticks, status.time_us), (10, 10 * TICK_US));
    assert_eq!((status.frames_good, status.frames_bad, status.overruns), (3, 2, 0));
    let mut settings = Settings { motion_band_m: 0.0, ..Settings::default() };
    assert_eq!(answers.settings(&(), &mut settings), Ok(()));
    assert_eq!(settings, Settings::default());
    settings.motion_band_m = 0.0;
    assert_eq!(answers.board_settings(&(), &mut settings), Ok(()));
    assert_eq!(settings, shared.with(|controller| controller.hardware().settings));
    let mut health = HealthSums::default();
    assert_eq!(answers.health(&HealthRead { side: Side::Agonist }, &mut health), Ok(()));
    let blocked_n = table::example().blocked_force.newtons().abs();
    assert_eq!((health.force_n, health.blocks), (blocked_n, 0));
}

#[test]
fn orders_reach_the_controller_and_are_answered_with_its_state() {
    let shared = Shared::new(Settings::default());
    let mut server = with_table(&shared);
    let mut answers = Answers { server: &mut server, shared: &shared };
    let mut status = Status::default();
    assert_eq!(answers.arm(&OWNER, &mut status), Ok(()));
    assert_eq!(status.state, State::Armed);
    let start = Start { mode: Mode::Pressure, session: OWNER };
    assert_eq!(answers.start(&start, &mut status), Ok(()));
    assert_eq!((status.state, status.mode), (State::Running, Mode::Pressure));
    assert_eq!(answers.set_point(&to_pressure(300e3), &mut status), Ok(()));
    let mut pressure = 0.0;
    pass(&shared, 500, &mut pressure);
    assert!((pressure - 300e3).abs() < 3e3, "{pressure}");
    let points = ReferencePoints {
        points: [200e3, 250e3, 200e3].into_iter().collect(),
        session: OWNER,
        ..ReferencePoints::default()
    };
    let mut count = 0;
    assert_eq!(answers.reference_points(&points, &mut count), Ok(()));
    assert_eq!(count, 3);
    let reference = Reference::Sine { mean: 200e3, amplitude: 0.0, frequency_hz: 1.0 };
    assert_eq!(answers.reference(&ReferenceOrder { reference, session: OWNER }, &mut status), Ok(()));
    pass(&shared, 500, &mut pressure);
    assert!((pressure - 200e3).abs() < 3e3, "{pressure}");
    assert_eq!(answers.keep_alive(&Session { id: 99 }, &mut ()), Err(Refusal::OtherSession));
    assert_eq!(answers.stop(&(), &mut status), Ok(()));
    assert_eq!((status.state, status.mode), (State::Armed, Mode::Vent));
    assert_eq!(answers.set_point(&to_pressure(1.0), &mut status), Err(Refusal::WrongState(State::Armed)));
    assert_eq!(answers.disarm(&(), &mut status), Ok(()));
    assert_eq!(status.state, State::Disarmed);
    let mut rate = TelemetryRate::default();
    assert_eq!(answers.telemetry(&TelemetryRate { every_ticks: 1 }, &mut rate), Ok(()));
    assert_eq!(rate.every_ticks, 1);
    pass(&shared, 1, &mut pressure);
    assert!(shared.with(Controller::take_sample).is_some(), "telemetry is sent");
}

#[test]
fn faults_are_reported_and_cleared() {
    let shared = Shared::new(Settings::default());
    let mut server = with_table(&shared);
    let finding = Finding { fault: Fault::OverForce, sensor: None, value: 1.0, limit: 0.0 };
    shared.with(|controller| controller.raise(Side::Agonist, &finding));
    let mut answers = Answers { server: &mut server, shared: &shared };
    let mut faults = Faults::default();
    assert_eq!(answers.faults(&(), &mut faults), Ok(()));
    assert_eq!(faults.latched.map(|report| report.fault), Some(Fault::OverForce));
    let mut past: Option<FaultReport> = None;
    assert_eq!(answers.past_fault(&PastFault { back: 0 }, &mut past), Ok(()));
    assert_eq!(past.map(|report| report.fault), Some(Fault::OverForce), "kept before it is read");
    let mut status = Status::default();
    assert_eq!(answers.status(&(), &mut status), Ok(()));
    assert_eq!((status.state, status.fault), (State::Fault, Some(Fault::OverForce)));
    assert_eq!(answers.clear_fault(&(), &mut status), Ok(()));
    assert_eq!((status.state, status.fault), (State::Disarmed, None));
    assert!(shared.with(|controller| controller.faults().latched.is_none()));
}

#[test]
fn a_table_is_read_back_piece_by_piece_and_evaluated() {
    let shared = Shared::new(Settings::default());
    let mut server = with_table(&shared);
    let sent = image(40.0);
    let mut answers = Answers { server: &mut server, shared: &shared };
    let mut read = Vec::new();
    for _ in 0..100 {
        let mut piece = TablePiece::default();
        let request = TableRead { side: Side::Agonist, offset: read.len() as u32 };
        assert_eq!(answers.table_read(&request, &mut piece), Ok(()));
        assert_eq!(piece.offset as usize, read.len());
        if piece.bytes.is_empty() {
            break;
        }
        read.extend_from_slice(&piece.bytes);
    }
    assert_eq!(read, sent[..]);
    let none = TableRead { side: Side::Antagonist, offset: 0 };
    assert_eq!(
        answers.table_read(&none, &mut TablePiece::default()),
        Err(Refusal::NoTable(Side::Antagonist))
    );
    let points = [200e3, 300e3].map(|pressure_pa| Point { stroke_m: 1e-3, pressure_pa });
    let mut request = Evaluate { side: Side::Agonist, direction: -1, points: points.into_iter().collect() };
    let mut evaluated = Evaluated::default();
    assert_eq!(answers.evaluate(&request, &mut evaluated), Ok(()));
    let [low, high] = evaluated.values[..] else { panic!("{evaluated:?}") };
    assert!(high.force_n > low.force_n && low.force_n > 0.0, "{evaluated:?}");
    for (value, point) in evaluated.values.iter().zip(points) {
        assert!((value.pressure_pa - point.pressure_pa).abs() < 100.0, "the inverse: {value:?}");
    }
    request.direction = 1;
    let mut other = Evaluated::default();
    assert_eq!(answers.evaluate(&request, &mut other), Ok(()));
    assert!(other.values[0].force_n != low.force_n, "friction points the other way");
}

#[test]
fn traces_and_signals_are_recorded_and_read() {
    let shared = Shared::new(Settings::default());
    let mut server = with_table(&shared);
    let mut answers = Answers { server: &mut server, shared: &shared };
    let mut signals = MeanSignals::default();
    let request = SignalsRead { side: Side::Agonist };
    assert_eq!(answers.signals(&request, &mut signals), Ok(()));
    pass(&shared, 5, &mut 0.0);
    assert_eq!(answers.signals(&request, &mut signals), Ok(()));
    assert_eq!((signals.ticks, signals.enabled), (5, true));
    let other = SignalsRead { side: Side::Antagonist };
    assert_eq!(answers.signals(&other, &mut signals), Err(Refusal::NotSupported), "one muscle only");
    let begin = TableBegin { side: Side::Antagonist, length: 10, crc: 0 };
    assert_eq!(answers.table_begin(&begin, &mut ()), Err(Refusal::NotSupported));

    let variables = [Variable::Stroke].into_iter().collect();
    let arm = TraceArm { variables, every_ticks: 2, trigger: Trigger::Now };
    let mut info = TraceInfo::default();
    assert_eq!(answers.trace_arm(&arm, &mut info), Ok(()));
    assert_eq!((info.every_ticks, info.complete), (2, false));
    let capacity = answers_capacity(&mut answers);
    pass(&shared, 2 * capacity, &mut 0.0);
    let mut info = TraceInfo::default();
    assert_eq!(answers.trace_info(&(), &mut info), Ok(()));
    assert_eq!((info.records, info.complete), (capacity, true));
    let mut piece = TracePiece::default();
    assert_eq!(answers.trace_read(&TraceRead { record: 0 }, &mut piece), Ok(()));
    assert!(piece.values.first().is_some_and(|stroke| (stroke - 1e-3).abs() < 1e-5), "{piece:?}");
}

fn answers_capacity(answers: &mut Answers<'_, MockFlash>) -> u32 {
    let mut info = DeviceInfo::default();
    assert_eq!(answers.info(&(), &mut info), Ok(()));
    info.trace_capacity
}

/// An updater that says what was last asked of it.
struct Said(u32);

impl Update for Said {
    fn status(&mut self, status: &mut UpdateStatus) -> Result<(), Refusal> {
        status.capacity = self.0;
        Ok(())
    }

    fn begin(&mut self, header: &[u8]) -> Result<(), Refusal> {
        self.0 = 100 + header.len() as u32;
        Ok(())
    }

    fn piece(&mut self, piece: &UpdatePiece) -> Result<u32, Refusal> {
        Ok(piece.offset + 200)
    }

    fn commit(&mut self) -> Result<(), Refusal> {
        self.0 = 300;
        Ok(())
    }

    fn confirm(&mut self) -> Result<(), Refusal> {
        self.0 = 400;
        Ok(())
    }

    fn revert(&mut self) -> Result<(), Refusal> {
        self.0 = 500;
        Ok(())
    }

    fn restarted(&mut self) {
        self.0 = 600;
    }
}

#[test]
fn firmware_is_handed_on_while_nothing_runs() {
    let shared = Shared::new(Settings::default());
    let mut server = with_table(&shared);
    server.take_updates(std::boxed::Box::new(Said(1)));
    let mut answers = Answers { server: &mut server, shared: &shared };
    let mut status = UpdateStatus::default();
    assert_eq!((answers.update(&(), &mut status), status.capacity), (Ok(()), 1));
    let begin = UpdateBegin { header: [1, 2, 3].into_iter().collect() };
    assert_eq!((answers.update_begin(&begin, &mut status), status.capacity), (Ok(()), 103));
    let mut received = 0;
    let piece = UpdatePiece { offset: 7, ..UpdatePiece::default() };
    assert_eq!((answers.update_piece(&piece, &mut received), received), (Ok(()), 207));
    assert_eq!((answers.update_commit(&(), &mut status), status.capacity), (Ok(()), 300));
    assert_eq!((answers.update_confirm(&(), &mut status), status.capacity), (Ok(()), 400));
    assert_eq!((answers.update_revert(&(), &mut status), status.capacity), (Ok(()), 500));
    assert_eq!(answers.forget_memory(&ForgetMemory { side: Side::Agonist }, &mut ()), Ok(()));
}
