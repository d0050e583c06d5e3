//! Checks that keep people safe: each test fails if the check that it names is removed.

use model_core::effects::{EffectName, FittedEffect};
use model_core::link::messages::{ForgetMemory, UpdateBegin, UpdatePiece, UpdateStatus};

use super::*;

fn info(server: &mut Server<MockFlash>) -> Option<TableInfo> {
    server.table_info(Side::Agonist)
}

/// A server with two tables, and its muscle under pressure.
fn running(shared: &Shared) -> (Server<MockFlash>, f32) {
    let mut server = started(MockFlash::erased(), shared);
    for deadband_kpa in [40.0, 50.0] {
        assert!(send(&mut server, shared, &image(deadband_kpa)).is_ok());
    }
    let mut pressure = 0.0;
    pass(shared, 10, &mut pressure);
    assert_eq!(shared.with(|c| c.arm(OWNER)), Ok(()));
    assert_eq!(shared.with(|c| c.start(Mode::Pressure, OWNER)), Ok(()));
    assert_eq!(shared.with(|c| c.set_point(to_pressure(300e3))), Ok(()));
    pass(shared, 500, &mut pressure);
    (server, pressure)
}

#[test]
fn nothing_that_writes_flash_is_done_while_a_mode_runs() {
    let shared = Shared::new(Settings::default());
    let (mut server, mut pressure) = running(&shared);
    let before = info(&mut server);
    let no = Refusal::WrongState(State::Running);
    assert_eq!(send(&mut server, &shared, &image(60.0)), Err(no), "commit");
    let generation = before.expect("a table").generation;
    let side = Side::Agonist;
    let mut answers = Answers { server: &mut server, shared: &shared };
    let back = RollBack { side, generation };
    assert_eq!(answers.table_rollback(&back, &mut TableInfo::default()), Err(no), "roll back");
    let settings = Settings::default();
    assert_eq!(answers.set_settings(&settings, &mut Settings::default()), Err(no), "settings");
    assert_eq!(answers.forget_memory(&ForgetMemory { side }, &mut ()), Err(no), "memories");
    assert_eq!(answers.restart(&(), &mut ()), Err(no), "restart");
    assert!(!server.wants_restart());
    assert_eq!(info(&mut server), before);
    pass(&shared, 10, &mut pressure);
    assert_eq!(shared.with(|c| c.state()), State::Running);
}

/// An updater that fails the test if it is used.
struct Untouched;

impl Update for Untouched {
    fn status(&mut self, _: &mut UpdateStatus) -> Result<(), Refusal> {
        Ok(())
    }

    fn begin(&mut self, _: &[u8]) -> Result<(), Refusal> {
        panic!("flash is written")
    }

    fn piece(&mut self, _: &UpdatePiece) -> Result<u32, Refusal> {
        panic!("flash is written")
    }

    fn commit(&mut self) -> Result<(), Refusal> {
        panic!("flash is written")
    }

    fn confirm(&mut self) -> Result<(), Refusal> {
        panic!("flash is written")
    }

    fn revert(&mut self) -> Result<(), Refusal> {
        panic!("flash is written")
    }

    fn restarted(&mut self) {}
}

#[test]
fn no_firmware_is_taken_while_a_mode_runs() {
    let shared = Shared::new(Settings::default());
    let (mut server, _) = running(&shared);
    let mut status = UpdateStatus::default();
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.update(&(), &mut status), Err(Refusal::NotSupported), "without a key");
    server.take_updates(std::boxed::Box::new(Untouched));
    let no = Err(Refusal::WrongState(State::Running));
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.update(&(), &mut status), Ok(()), "read");
    assert_eq!(answers.update_begin(&UpdateBegin::default(), &mut status), no, "begin");
    assert_eq!(answers.update_piece(&UpdatePiece::default(), &mut 0), no, "piece");
    assert_eq!(answers.update_commit(&(), &mut status), no, "commit");
    assert_eq!(answers.update_confirm(&(), &mut status), no, "confirm");
    assert_eq!(answers.update_revert(&(), &mut status), no, "revert");
}

#[test]
fn nothing_that_changes_an_armed_device_is_done() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    for deadband_kpa in [40.0, 50.0] {
        assert!(send(&mut server, &shared, &image(deadband_kpa)).is_ok());
    }
    let before = (info(&mut server), deadband_in_use(&shared));
    let generation = before.0.expect("a table").generation;
    server.take_updates(std::boxed::Box::new(Untouched));
    pass(&shared, 10, &mut 0.0);
    assert_eq!(shared.with(|c| c.arm(OWNER)), Ok(()));
    let no = Refusal::WrongState(State::Armed);
    assert_eq!(send(&mut server, &shared, &image(60.0)), Err(no), "commit");
    let side = Side::Agonist;
    let mut answers = Answers { server: &mut server, shared: &shared };
    let back = RollBack { side, generation };
    assert_eq!(answers.table_rollback(&back, &mut TableInfo::default()), Err(no), "roll back");
    let mut settings = Settings::default();
    settings.limits.force_n *= 0.5;
    assert_eq!(answers.set_settings(&settings, &mut Settings::default()), Err(no), "settings");
    assert_eq!(answers.forget_memory(&ForgetMemory { side }, &mut ()), Err(no), "memories");
    let mut status = UpdateStatus::default();
    assert_eq!(answers.update_begin(&UpdateBegin::default(), &mut status), Err(no), "update");
    assert_eq!(answers.update_commit(&(), &mut status), Err(no), "commit of an update");
    assert_eq!(shared.with(|c| *c.settings()), Settings::default());
    assert_eq!((info(&mut server), deadband_in_use(&shared)), before);
    assert_eq!(shared.with(Controller::disarm), Ok(()));
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.set_settings(&settings, &mut Settings::default()), Ok(()));
    assert_eq!(shared.with(|c| *c.settings()), settings);
}

#[test]
fn an_armed_device_is_not_restarted() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    pass(&shared, 10, &mut 0.0);
    assert_eq!(shared.with(|c| c.arm(OWNER)), Ok(()));
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.restart(&(), &mut ()), Err(Refusal::WrongState(State::Armed)));
    assert!(!server.wants_restart());
    assert_eq!(shared.with(Controller::disarm), Ok(()));
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.restart(&(), &mut ()), Ok(()));
    assert!(server.wants_restart());
}

#[test]
fn pieces_end_at_the_stated_end_of_the_upload() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    let piece = |offset, length: usize| TablePiece {
        offset,
        bytes: heapless::Vec::from_slice(&[7; 200][..length]).expect("it fits"),
    };
    let mut answers = Answers { server: &mut server, shared: &shared };
    let begin = TableBegin { side: Side::Agonist, length: 100, crc: 0 };
    assert_eq!(answers.table_begin(&begin, &mut ()), Ok(()));
    let long = Refusal::Table(TableFault::TooLong(100));
    let mut there = 0;
    assert_eq!(answers.table_piece(&piece(0, 101), &mut there), Err(long));
    assert_eq!(answers.table_piece(&piece(0, 60), &mut there), Ok(()));
    assert_eq!(answers.table_piece(&piece(60, 41), &mut there), Err(long));
    assert_eq!(answers.table_piece(&piece(61, 10), &mut there), Err(Refusal::Table(TableFault::Gap(60))));
    assert_eq!(answers.table_piece(&piece(60, 40), &mut there), Ok(()));
    assert_eq!(there, 100);
    let incomplete = TableBegin { length: 101, ..begin };
    assert_eq!(answers.table_begin(&incomplete, &mut ()), Ok(()));
    assert_eq!(answers.table_piece(&piece(0, 100), &mut there), Ok(()));
    let missing = Refusal::Table(TableFault::Incomplete(100));
    assert_eq!(answers.table_commit(&(), &mut TableInfo::default()), Err(missing));
    let most = image::MAX_LEN as u32;
    let begun = answers.table_begin(&TableBegin { length: most + 1, ..begin }, &mut ());
    assert_eq!(begun, Err(Refusal::Table(TableFault::TooLong(most))));
    assert_eq!(answers.table_begin(&TableBegin { length: most, ..begin }, &mut ()), Ok(()));
    let second = TableBegin { side: Side::Antagonist, ..begin };
    assert_eq!(answers.table_begin(&second, &mut ()), Err(Refusal::NotSupported), "a board for one muscle");
}

#[test]
fn a_table_of_which_a_byte_is_wrong_is_neither_kept_nor_used() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &image(40.0)).is_ok());
    let (before, in_use) = (info(&mut server), deadband_in_use(&shared));
    let good = image(60.0);
    let upload = |server: &mut Server<MockFlash>, bytes: &[u8], crc: u32| {
        let mut answers = Answers { server, shared: &shared };
        let begin = TableBegin { side: Side::Agonist, length: bytes.len() as u32, crc };
        answers.table_begin(&begin, &mut ()).expect("it begins");
        let piece = TablePiece { offset: 0, bytes: heapless::Vec::from_slice(bytes).expect("a piece") };
        answers.table_piece(&piece, &mut 0).expect("it fits");
        answers.table_commit(&(), &mut TableInfo::default())
    };
    let crc = model_core::check::of_image(&good);
    assert_eq!(upload(&mut server, &good, crc ^ 1), Err(Refusal::Table(TableFault::Check)), "as announced");
    for at in 0..good.len() {
        let mut wrong = good.clone();
        wrong[at] ^= 0x10;
        // The host announces what it sends: the check of the image itself must see it.
        let refused = upload(&mut server, &wrong, model_core::check::of_image(&wrong));
        assert!(matches!(refused, Err(Refusal::Table(_))), "byte {at}: {refused:?}");
    }
    let mut longer = good.clone();
    longer.push(0).expect("room");
    let crc = model_core::check::of_image(&longer);
    assert!(matches!(upload(&mut server, &longer, crc), Err(Refusal::Table(_))), "a byte behind the image");
    assert_eq!((info(&mut server), deadband_in_use(&shared)), (before, in_use));
}

/// A table with an effect whose memory survives a power cycle.
fn remembering() -> heapless::Vec<u8, { image::MAX_LEN }> {
    let mut table = table::example();
    table.effects.clear();
    let mullins = FittedEffect::new(EffectName::MullinsSoftening, &[0.4, 0.02, 0.1]);
    table.effects.push(mullins).expect("room");
    let mut bytes = [0; image::MAX_LEN];
    let written = image::write(&table, &mut bytes).expect("a table");
    heapless::Vec::from_slice(written).expect("it fits")
}

/// The memory of the first effect in use.
fn memory(shared: &Shared) -> Memory<f32> {
    shared.with(|controller| {
        let model = controller.model(Side::Agonist).expect("a table");
        *model.chain.memories().next().expect("an effect").1
    })
}

fn restarted(server: Server<MockFlash>, shared: &Shared) -> Server<MockFlash> {
    server.restarted(shared).expect("a store")
}

#[test]
fn a_memory_is_restored_if_it_is_finite_and_of_this_table() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &remembering()).is_ok());
    let fresh = memory(&shared);
    let mut worked = fresh;
    worked[0] += 0.011;
    let keep = |server: &mut Server<MockFlash>, memory: Memory<f32>| {
        server.store.put_memories(Side::Agonist, 1, &|_| memory).expect("room");
    };
    keep(&mut server, worked);
    let mut server = restarted(server, &shared);
    assert_eq!(memory(&shared), worked, "of this table");
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for place in 0..worked.len() {
            let mut broken = worked;
            broken[place] = bad;
            keep(&mut server, broken);
            server = restarted(server, &shared);
            assert_eq!(memory(&shared), fresh, "{bad} in place {place}");
        }
    }
    keep(&mut server, worked);
    assert!(send(&mut server, &shared, &remembering()).is_ok());
    assert_eq!(memory(&shared), fresh, "another table, even of the same bytes");
    let server = restarted(server, &shared);
    assert_eq!(memory(&shared), fresh, "also after a restart");
    drop(server);
}

#[test]
fn a_start_after_the_watchdog_or_a_brown_out_is_a_latched_fault() {
    for (started_by, fault) in [
        (StartedBy::Watchdog, Some(Fault::Watchdog)),
        (StartedBy::BrownOut, Some(Fault::BrownOut)),
        (StartedBy::Power, None),
        (StartedBy::Request, None),
    ] {
        let shared = Shared::new(Settings::default());
        let identity = started(MockFlash::erased(), &shared).identity;
        let shared = Shared::new(Settings::default());
        let server = Server::start(Identity { started_by, ..identity }, MockFlash::erased(), &shared)
            .expect("a store");
        drop(server);
        let latched = shared.with(|c| c.faults().latched.map(|report| report.fault));
        assert_eq!(latched, fault, "{started_by:?}");
    }
}

#[test]
fn memories_of_effects_are_stored_at_rest_and_before_a_restart() {
    let work = |shared: &Shared, by: f32| {
        shared.with(|controller| {
            let model = controller.model_mut(Side::Agonist).expect("a table");
            let mut worked = *model.chain.memories().next().expect("an effect").1;
            worked[0] += by;
            model.chain.restore(0, &worked);
        });
        memory(shared)
    };
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &remembering()).is_ok());
    pass(&shared, 10, &mut 0.0);
    let worked = work(&shared, 0.011);
    server.keep(&shared);
    let mut server = restarted(server, &shared);
    assert_eq!(memory(&shared), worked, "kept at rest");
    // The allowance of writes is used up at rest; a restart that is requested writes all the same.
    for _ in 0..40 {
        work(&shared, 0.001);
        server.keep(&shared);
    }
    let last = memory(&shared);
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.restart(&(), &mut ()), Ok(()));
    let server = restarted(server, &shared);
    assert_eq!(memory(&shared), last, "kept before a restart");
    drop(server);
}

#[test]
fn kept_settings_come_into_force_at_a_start_and_those_that_cannot_be_used_are_not_trusted() {
    let latched = |shared: &Shared| shared.with(|c| c.faults().latched.map(|report| report.fault));
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert_eq!(
        server.store.settings(&mut Settings::default()),
        Ok(Kept::Whole),
        "a new device keeps its own"
    );
    assert_eq!(latched(&shared), None);
    let mut settings = Settings::default();
    settings.limits.force_n *= 0.5;
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.set_settings(&settings, &mut Settings::default()), Ok(()));
    let shared = Shared::new(Settings::default());
    let mut server = restarted(server, &shared);
    assert_eq!(shared.with(|controller| *controller.settings()), settings);
    assert_eq!(latched(&shared), None);
    let mut unusable = settings;
    unusable.regulator.gain = f32::NAN;
    assert_eq!(server.store.put_settings(&mut unusable), Ok(()));
    let shared = Shared::new(Settings::default());
    let server = restarted(server, &shared);
    assert_eq!(latched(&shared), Some(Fault::SettingsInvalid));
    assert!(shared.with(|controller| controller.settings().regulator.gain.is_finite()));
    drop(server);
}
