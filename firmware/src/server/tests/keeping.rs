//! What a start finds and what is written to flash without a request: counted writes, kept memories, damaged tables.

use model_core::effects::{EffectName, FittedEffect};
use model_core::link::messages::{UpdatePiece, UpdateStatus};

use super::*;

/// A table with effects.
fn with_effects(effects: &[(EffectName, &[f64])]) -> heapless::Vec<u8, { image::MAX_LEN }> {
    let effects = effects.iter().map(|(effect, parameters)| FittedEffect::new(*effect, parameters)).collect();
    let table = MuscleTable { effects, ..table::example() };
    let mut bytes = [0; image::MAX_LEN];
    let written = image::write(&table, &mut bytes).expect("a table");
    heapless::Vec::from_slice(written).expect("it fits")
}

const MULLINS: (EffectName, &[f64]) = (EffectName::MullinsSoftening, &[0.4, 0.02, 0.1]);
const COULOMB: (EffectName, &[f64]) = (EffectName::CoulombFriction, &[1.0, 1.0]);

/// Words that are written while a server with a table keeps what it must some times, and each memory is moved in between by a part.
fn flash_words_written(image: &[u8], times: u32, part: f32) -> usize {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, image).is_ok());
    pass(&shared, 10, &mut 0.0);
    for time in 0..times {
        shared.with(|controller| {
            let Some(model) = controller.model_mut(Side::Agonist) else { return };
            let moved = 0.01 * (1.0 + part * time as f32);
            model.chain.restore(0, &[moved; model_core::effects::MEMORY]);
        });
        server.keep(&shared);
    }
    server.store.close().words_written()
}

#[test]
fn memories_are_written_when_they_have_moved_and_only_where_one_must_last() {
    let lasting = with_effects(&[MULLINS]);
    let none = flash_words_written(&lasting, 0, 0.0);
    let once = flash_words_written(&lasting, 1, 0.0);
    assert!(once > none, "{once} words, {none} without keeping");
    assert_eq!(flash_words_written(&lasting, 6, 0.0), once, "nothing has moved");
    assert_eq!(flash_words_written(&lasting, 6, 1e-4), once, "hardly");
    assert_eq!(flash_words_written(&lasting, 6, 0.1) - none, 6 * (once - none), "each time");
    let fleeting = with_effects(&[COULOMB]);
    assert_eq!(
        flash_words_written(&fleeting, 6, 0.1),
        flash_words_written(&fleeting, 0, 0.0),
        "nothing that must last"
    );
    assert_eq!(
        flash_words_written(&image(40.0), 6, 0.1),
        flash_words_written(&image(40.0), 0, 0.0),
        "no effects"
    );
}

#[test]
fn the_memories_of_all_effects_are_kept_with_the_one_that_must_last() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &with_effects(&[COULOMB, MULLINS])).is_ok());
    pass(&shared, 10, &mut 0.0);
    server.keep(&shared);
    let mut places = std::vec::Vec::new();
    assert_eq!(server.store.each_memory(Side::Agonist, &mut |place, _| places.push(place)), Ok(2));
    assert_eq!(places, [0, 1]);
}

#[test]
fn a_table_that_cannot_be_read_at_a_start_is_not_used_and_latches_a_fault() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &image(40.0)).is_ok());
    server.store.commit(Side::Agonist, &[1, 2, 3]).expect("room");
    let shared = Shared::new(Settings::default());
    let server = server.restarted(&shared).expect("a store");
    assert_eq!(shared.with(|c| c.faults().latched.map(|report| report.fault)), Some(Fault::TableInvalid));
    assert!(shared.with(|c| c.model(Side::Agonist).is_none()));
    drop(server);
}

#[test]
fn a_start_after_a_request_is_none_after_a_watchdog() {
    let shared = Shared::new(Settings::default());
    let identity = started(MockFlash::erased(), &shared).identity;
    let watchdog = Identity { started_by: StartedBy::Watchdog, ..identity };
    let server = Server::start(watchdog, MockFlash::erased(), &shared).expect("a store");
    let shared = Shared::new(Settings::default());
    let server = server.restarted(&shared).expect("a store");
    assert_eq!(server.identity.started_by, StartedBy::Request);
    assert_eq!((server.starts, shared.with(|c| c.faults().latched.is_none())), (2, true));
}

#[test]
fn a_hello_is_answered_as_a_response_and_an_answer_not_at_all() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    for (kind, answered) in [(Kind::Request, true), (Kind::Response, false), (Kind::Topic, false)] {
        let mut wire = [0; frame::MAX_WIRE];
        let header = Header { kind, id: hello::ID, sequence: 9 };
        let length = frame::encode(header, &(), &mut wire).expect("it fits");
        let mut accumulator = frame::Accumulator::new();
        for &byte in &wire[..length - 1] {
            assert!(accumulator.push(byte).is_none());
        }
        let request = accumulator.push_to_answer(0).expect("a frame").expect("whole");
        let written = server.handle(request, &shared).to_vec();
        if !answered {
            assert_eq!(written, [], "{kind:?}");
            continue;
        }
        let mut answer = written[..written.len() - 1].to_vec();
        let found = frame::decode(&mut answer).expect("an answer");
        assert_eq!(found.header, Header { kind: Kind::Response, ..header });
        let said = Hello::from_bytes(found.body).expect("a hello");
        assert_eq!((said.starts, said.muscles, said.store_format), (1, 1, store::FORMAT));
    }
}

/// Counts its restarts.
struct RestartCounter(std::sync::Arc<std::sync::atomic::AtomicU32>);

impl Update for RestartCounter {
    fn status(&mut self, _: &mut UpdateStatus) -> Result<(), Refusal> {
        Err(Refusal::NotSupported)
    }

    fn begin(&mut self, _: &[u8]) -> Result<(), Refusal> {
        Err(Refusal::NotSupported)
    }

    fn piece(&mut self, _: &UpdatePiece) -> Result<u32, Refusal> {
        Err(Refusal::NotSupported)
    }

    fn commit(&mut self) -> Result<(), Refusal> {
        Err(Refusal::NotSupported)
    }

    fn confirm(&mut self) -> Result<(), Refusal> {
        Err(Refusal::NotSupported)
    }

    fn revert(&mut self) -> Result<(), Refusal> {
        Err(Refusal::NotSupported)
    }

    fn restarted(&mut self) {
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    }
}

#[test]
fn a_restart_reaches_what_takes_another_firmware() {
    let shared = Shared::new(Settings::default());
    let count = std::sync::Arc::new(std::sync::atomic::AtomicU32::new(0));
    let mut server = started(MockFlash::erased(), &shared);
    server.boot();
    server.take_updates(std::boxed::Box::new(RestartCounter(count.clone())));
    server.boot();
    assert_eq!(count.load(std::sync::atomic::Ordering::Relaxed), 1);
    // It stays with the server that starts again.
    server.restarted(&shared).expect("a store").boot();
    assert_eq!(count.load(std::sync::atomic::Ordering::Relaxed), 2);
}

const SET: (EffectName, &[f64]) = (EffectName::PermanentSet, &[1e-4, 0.0, 10.0, 1e4]);

/// Tables A and B, and back to A; B's effect remembers something, and that lies on the flash.
#[test]
fn a_table_sent_after_a_rollback_has_no_memory_of_the_one_gone_back_from() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &image(40.0)).is_ok());
    let second = send(&mut server, &shared, &with_effects(&[MULLINS])).expect("it is taken");
    pass(&shared, 10, &mut 0.0);
    let worked = [3.5; model_core::effects::MEMORY];
    shared.with(|c| c.model_mut(Side::Agonist).expect("a table").chain.restore(0, &worked));
    server.keep(&shared);
    let back = RollBack { side: Side::Agonist, generation: second.generation };
    let mut first = TableInfo::default();
    assert_eq!(Answers { server: &mut server, shared: &shared }.table_rollback(&back, &mut first), Ok(()));
    let third = send(&mut server, &shared, &with_effects(&[SET])).expect("it is taken");
    assert!(third.generation > second.generation, "{third:?} after {second:?}");
    let memory = || {
        let first =
            |c: &Controller| c.model(Side::Agonist)?.chain.memories().next().map(|(_, memory)| *memory);
        shared.with(|c| first(c).expect("an effect"))
    };
    assert_ne!(memory(), worked);
    let server = server.restarted(&shared).expect("a store");
    assert_ne!(memory(), worked, "after a restart");
    drop(server);
}

/// The settings of a user who has a lower limit and a valve test.
fn own_settings() -> Settings {
    let mut settings = Settings::default();
    settings.limits.pressure_pa = 300e3;
    settings.watch.valve_test_pa = 40e3;
    settings
}

/// A flash with a table and settings of a user.
fn in_use() -> MockFlash {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    assert!(send(&mut server, &shared, &image(40.0)).is_ok());
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.set_settings(&own_settings(), &mut Settings::default()), Ok(()));
    server.store.close()
}

/// What is in force after a start: the settings, the latched fault, and whether there is a table.
fn in_force(shared: &Shared) -> (Settings, Option<Fault>, bool) {
    shared.with(|controller| {
        let latched = controller.faults().latched.map(|report| report.fault);
        (*controller.settings(), latched, controller.model(Side::Agonist).is_some())
    })
}

#[test]
fn writes_that_fail_at_a_start_erase_neither_settings_nor_tables() {
    for fails in [1, 2, 3, 5, 10, 1_000] {
        let mut flash = in_use().failing_first(fails);
        for start in 1..=4 {
            let shared = Shared::new(Settings::default());
            let server = started(flash, &shared);
            assert_eq!(in_force(&shared), (own_settings(), None, true), "start {start}, {fails} failures");
            flash = server.store.close();
        }
    }
}

#[test]
fn a_store_that_had_to_be_erased_is_trusted_at_no_start_until_settings_are_sent() {
    let mut flash = in_use();
    // Every page says that it is full, and none can be read.
    flash.bytes.fill(0);
    for start in 1..=3 {
        let shared = Shared::new(Settings::default());
        let server = started(flash, &shared);
        let (_, latched, has_table) = in_force(&shared);
        assert_eq!((latched, has_table), (Some(Fault::SettingsInvalid), false), "start {start}");
        assert_eq!(shared.with(Controller::clear), Err(Refusal::StillFaulty(Fault::SettingsInvalid)));
        assert!(shared.with(|controller| controller.arm(OWNER)).is_err());
        flash = server.store.close();
    }
    let shared = Shared::new(Settings::default());
    let mut server = started(flash, &shared);
    let mut answers = Answers { server: &mut server, shared: &shared };
    assert_eq!(answers.set_settings(&own_settings(), &mut Settings::default()), Ok(()));
    let shared = Shared::new(Settings::default());
    let server = started(server.store.close(), &shared);
    assert_eq!(in_force(&shared), (own_settings(), None, false), "confirmed");
    drop(server);
}

/// A new table cannot be kept, and the one before cannot be read any more: no table is in use, and not the one that was refused.
#[test]
fn a_refused_table_does_not_stay_in_use_where_the_one_before_is_damaged() {
    let shared = Shared::new(Settings::default());
    let mut server = started(MockFlash::erased(), &shared);
    let before = image(40.0);
    assert!(send(&mut server, &shared, &before).is_ok());
    let empty = Store::open(MockFlash::erased()).expect("a store");
    let mut flash = core::mem::replace(&mut server.store, empty).close();
    let place = flash.bytes.windows(64).position(|bytes| bytes == &before[..64]).expect("it is on the flash");
    flash.bytes[place + 10] ^= 0x10;
    server.store = Store::open(flash.failing_after(0)).expect("a store");
    assert!(matches!(send(&mut server, &shared, &image(60.0)), Err(Refusal::Store(_))));
    let (_, latched, has_table) = in_force(&shared);
    assert_eq!((latched, has_table), (Some(Fault::TableInvalid), false));
    assert_eq!(deadband_in_use(&shared), None);
}
