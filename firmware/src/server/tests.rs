//! What the server writes to flash and when, and what stays in use when a write fails.

use model_core::link::endpoints::Service;
use model_core::link::hello::Board;
use model_core::link::messages::{
    Fault, Mode, RollBack, Session, SetPoint, SetPointOrder, State, TableBegin, TableInfo, TablePiece,
};
use model_core::link::settings::Settings;
use model_core::table;
use model_core::units::Pressure;

mod answered;
mod bus;
mod keeping;
mod protection;

use super::answers::Answers;
use super::*;
use crate::board::{Inputs, Readings};
use crate::control::Controller;
use crate::store::mock_flash::MockFlash;

/// The session that arms and starts in these tests.
const OWNER: Session = Session { id: 7 };

/// A setpoint of the owner.
pub(super) fn to_pressure(pascals: f32) -> SetPointOrder {
    SetPointOrder { set_point: SetPoint::Pressure(pascals), session: OWNER }
}

fn started(flash: MockFlash, shared: &Shared) -> Server<MockFlash> {
    let identity = Identity {
        board: Board::Native,
        muscles: 1,
        serial: [0; 12],
        started_by: StartedBy::Power,
        fault: None,
    };
    Server::start(identity, flash, shared).expect("a store")
}

/// One tick of a muscle whose pressure follows the command.
fn step(shared: &Shared, tick: u32, pressure_pa: &mut f32) {
    let wiggle = (tick % 7) as f32;
    let readings = Readings {
        pressure_pa: *pressure_pa + wiggle,
        stroke_m: 1e-3 + 1e-7 * wiggle,
        force_n: 1e-3 * wiggle,
    };
    let outputs = shared.step(&Inputs { sides: [Some(readings.into()), None], ..Inputs::default() });
    let command = outputs.sides[0];
    *pressure_pa += ((if command.vent { 0.0 } else { command.pressure_pa }) - *pressure_pa) / 31.0;
}

/// Some ticks of it, with an owner that keeps it alive.
fn pass(shared: &Shared, ticks: u32, pressure_pa: &mut f32) {
    for tick in 0..ticks {
        step(shared, tick, pressure_pa);
        assert_eq!(shared.with(|c| c.keep_alive(OWNER)), Ok(()));
    }
}

fn image(deadband_kpa: f32) -> heapless::Vec<u8, { image::MAX_LEN }> {
    let table = MuscleTable { deadband: Pressure::from_kilopascals(deadband_kpa), ..table::example() };
    let mut bytes = [0; image::MAX_LEN];
    let written = image::write(&table, &mut bytes).expect("a table");
    heapless::Vec::from_slice(written).expect("it fits")
}

fn send(server: &mut Server<MockFlash>, shared: &Shared, image: &[u8]) -> Result<TableInfo, Refusal> {
    let mut answers = Answers { server, shared };
    let crc = model_core::check::of_image(image);
    let begin = TableBegin { side: Side::Agonist, length: image.len() as u32, crc };
    answers.table_begin(&begin, &mut ())?;
    let piece = TablePiece { offset: 0, bytes: heapless::Vec::from_slice(image).expect("a piece") };
    answers.table_piece(&piece, &mut 0)?;
    let mut info = TableInfo::default();
    answers.table_commit(&(), &mut info)?;
    Ok(info)
}

fn deadband_in_use(shared: &Shared) -> Option<f32> {
    // The force at no stroke vanishes at the deadband.
    shared.with(|controller| {
        let muscle = &controller.model(Side::Agonist)?.muscle;
        let mut held = model_core::muscle::AtStroke::NONE;
        let (stroke, force) = (Default::default(), model_core::units::Force::from_newtons(10.0));
        model_core::single_precision::hold(muscle, &mut held, stroke);
        let guess = Pressure::from_kilopascals(100.0);
        let found =
            model_core::single_precision::pressure_for(muscle, &held, 0.0, force, guess, &muscle.search());
        Some(found.pressure.pascals())
    })
}

#[test]
fn nothing_is_written_while_a_fault_holds_a_command() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    let mut settings = Settings { hold_on: 1 << Fault::SetPointSilence.code(), ..Settings::default() };
    settings.watch.silence_ticks = 500;
    let set = |server: &mut Server<MockFlash>, settings: &Settings| {
        Answers { server, shared: &shared }.set_settings(settings, &mut Settings::default())
    };
    assert_eq!(set(&mut server, &settings), Ok(()));
    let mut pressure = 0.0;
    pass(&shared, 10, &mut pressure);
    assert_eq!(shared.with(|c| c.arm(OWNER)), Ok(()));
    assert_eq!(shared.with(|c| c.start(Mode::Pressure, OWNER)), Ok(()));
    assert_eq!(shared.with(|c| c.set_point(to_pressure(300e3))), Ok(()));
    pass(&shared, 600, &mut pressure);
    assert_eq!(shared.with(|c| c.state()), State::Fault);
    server.keep(&shared);
    assert_eq!(server.store.past_fault(0), Ok(None), "the command is held");
    assert_eq!(set(&mut server, &settings), Err(Refusal::WrongState(State::Fault)));
    let rolled = Answers { server: &mut server, shared: &shared }
        .table_rollback(&RollBack::default(), &mut TableInfo::default());
    assert_eq!(rolled, Err(Refusal::WrongState(State::Fault)));
    assert_eq!(shared.with(Controller::stop), Ok(()));
    server.keep(&shared);
    let kept = server.store.past_fault(0).expect("readable").map(|report| report.fault);
    assert_eq!(kept, Some(Fault::SetPointSilence));
    assert_eq!(set(&mut server, &settings), Ok(()));
}

#[test]
fn a_table_that_cannot_be_kept_is_not_used() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &image(40.0)).is_ok());
    let before = deadband_in_use(&shared);
    let identity = server.identity;
    let flash = server.store.close().powered(usize::MAX, 0).failing_after(3);
    let mut server = Server::start(Identity { started_by: StartedBy::Request, ..identity }, flash, &shared)
        .expect("a store");
    assert_eq!(deadband_in_use(&shared), before);
    let refused = send(&mut server, &shared, &image(60.0));
    assert_eq!(refused, Err(Refusal::Store(StoreFault::Medium)));
    assert_eq!(deadband_in_use(&shared), before, "the table before stays in use");
}

/// A request as it comes over the link; gives the kind of the answer.
fn ask<E: endpoints::Endpoint>(
    server: &mut Server<MockFlash>,
    shared: &Shared,
    request: &E::Request,
) -> Kind {
    let mut wire = [0; frame::MAX_WIRE];
    let header = Header { kind: Kind::Request, id: E::ID, sequence: 1 };
    let length = frame::encode(header, request, &mut wire).expect("it fits");
    let mut accumulator = frame::Accumulator::new();
    for &byte in &wire[..length - 1] {
        assert!(accumulator.push(byte).is_none());
    }
    let request = accumulator.push_to_answer(0).expect("a frame").expect("whole");
    let mut answer = [0; frame::MAX_WIRE];
    let written = server.handle(request, shared);
    answer[..written.len()].copy_from_slice(written);
    frame::decode(&mut answer[..written.len() - 1]).expect("an answer").header.kind
}

#[test]
fn no_request_of_a_reader_keeps_a_run_alive() {
    use endpoints::{GetFaults, GetInfo, GetSettings, GetStatus, KeepAlive, SetTelemetry};
    use model_core::link::messages::TelemetryRate;
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    let mut pressure = 0.0;
    pass(&shared, 10, &mut pressure);
    assert_eq!(shared.with(|c| c.arm(OWNER)), Ok(()));
    assert_eq!(shared.with(|c| c.start(Mode::Pressure, OWNER)), Ok(()));
    assert_eq!(shared.with(|c| c.set_point(to_pressure(300e3))), Ok(()));
    for tick in 0..1_100 {
        step(&shared, tick, &mut pressure);
        if tick % 50 == 0 {
            assert_eq!(ask::<GetStatus>(&mut server, &shared, &()), Kind::Response);
            assert_eq!(ask::<GetInfo>(&mut server, &shared, &()), Kind::Response);
            assert_eq!(ask::<GetSettings>(&mut server, &shared, &()), Kind::Response);
            assert_eq!(ask::<GetFaults>(&mut server, &shared, &()), Kind::Response);
            let rate = TelemetryRate { every_ticks: 1 };
            assert_eq!(ask::<SetTelemetry>(&mut server, &shared, &rate), Kind::Response);
        }
        if tick == 100 {
            let stranger = Session { id: OWNER.id + 1 };
            assert_eq!(ask::<KeepAlive>(&mut server, &shared, &stranger), Kind::Refusal);
        }
    }
    let latched = shared.with(|controller| controller.faults().latched.map(|report| report.fault));
    assert_eq!(latched, Some(Fault::HostSilence));
}
