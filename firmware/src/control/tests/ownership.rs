//! A device belongs to the session that armed it or started its mode.

use model_core::link::messages::{Event, Reference, ReferenceOrder, ReferencePoints};

use super::*;

#[test]
fn only_the_session_that_started_the_mode_keeps_it_going() {
    let mut bench = Bench::running(|_| ());
    bench.hears_host = false;
    let watcher = Session { id: OWNER.id + 1 };
    let mut refused = 0;
    for _ in 0..20 {
        bench.pass(100);
        refused += u32::from(bench.controller.keep_alive(watcher) == Err(Refusal::OtherSession));
    }
    assert_eq!(bench.latched(), Some(Fault::HostSilence));
    assert!(bench.is_vented());
    assert!(
        (10..=11).contains(&refused),
        "refused {refused} times while it ran: nothing is owned in a vented fault"
    );
}

#[test]
fn only_the_session_that_started_the_mode_gives_it_orders() {
    let mut bench = Bench::running(|_| ());
    let other = Session { id: OWNER.id + 1 };
    let set_point = SetPoint::Pressure(600e3);
    let wave = Reference::Sine { mean: 500e3, amplitude: 50e3, frequency_hz: 1.0 };
    let points = ReferencePoints { points: [600e3].into_iter().collect(), session: other, offset: 0 };
    let refused = Err(Refusal::OtherSession);
    let controller = &mut bench.controller;
    assert_eq!(controller.set_point(SetPointOrder { set_point, session: other }), refused);
    assert_eq!(controller.reference(ReferenceOrder { reference: wave, session: other }), refused);
    assert_eq!(controller.reference_points(&points), Err(Refusal::OtherSession));
    assert_eq!(controller.start(Mode::Pressure, other), refused);
    assert_eq!(controller.start(Mode::Vent, other), refused);
    bench.pass(500);
    assert!((bench.pressure_pa - 400e3).abs() < 1e3, "{}", bench.pressure_pa);
    let owned = ReferencePoints { session: OWNER, ..points };
    assert_eq!(bench.controller.reference_points(&owned), Ok(1));
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
    // To vent is open to each.
    assert_eq!(bench.controller.stop(), Ok(()));
    bench.pass(1);
    assert!(bench.is_vented());
    assert_eq!(bench.controller.arm(other), refused, "armed, its owner is alive");
    assert_eq!(bench.controller.disarm(), Ok(()));
    bench.pass(1_000);
    assert_eq!(bench.controller.arm(other), Ok(()));
}

#[test]
fn the_order_of_another_session_is_refused_during_the_valve_test() {
    let mut bench = Bench::new(|settings| settings.watch.valve_test_pa = 40e3);
    bench.pass(10);
    let other = Session { id: OWNER.id + 1 };
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.pass(5);
    assert_eq!(bench.controller.arm(other), Err(Refusal::OtherSession));
    bench.pass(1_000);
    assert_eq!(bench.controller.state(), State::Armed);
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
}

#[test]
fn a_session_takes_over_from_an_owner_that_is_silent_and_is_the_one_that_counts() {
    let mut bench = Bench::new(|_| ());
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.hears_host = false;
    let second = Session { id: OWNER.id + 1 };
    bench.pass(1_000);
    assert_eq!(bench.controller.start(Mode::Pressure, second), Err(Refusal::OtherSession));
    bench.pass(1);
    assert_eq!(bench.controller.start(Mode::Pressure, second), Ok(()));
    assert_eq!(bench.controller.keep_alive(OWNER), Err(Refusal::OtherSession));
    bench.pass(900);
    assert_eq!(bench.controller.keep_alive(second), Ok(()));
    bench.pass(900);
    assert_eq!(bench.controller.state(), State::Running);
    bench.pass(200);
    assert_eq!(bench.latched(), Some(Fault::HostSilence));
}

#[test]
fn a_held_command_is_let_go_when_its_owner_is_silent_whoever_else_asks() {
    let mut bench = Bench::holding();
    bench.hears_host = false;
    bench.pass(500);
    assert_eq!(bench.controller.keep_alive(Session { id: 99 }), Err(Refusal::OtherSession));
    assert!(!bench.is_vented());
    bench.pass(600);
    assert!(bench.is_vented());
}

#[test]
fn an_armed_device_whose_owner_is_silent_disarms_itself() {
    let mut bench = Bench::new(|settings| settings.watch.armed_silence_ticks = 2_000);
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.pass(5_000);
    assert_eq!(bench.controller.state(), State::Armed, "its owner keeps it alive");
    bench.hears_host = false;
    bench.pass(1_999);
    assert_eq!(bench.controller.keep_alive(Session { id: 99 }), Err(Refusal::OtherSession));
    let _ = bench.controller.take_event();
    assert_eq!(bench.controller.state(), State::Armed);
    bench.pass(2);
    assert_eq!(bench.controller.state(), State::Disarmed);
    assert_eq!(bench.controller.take_event(), Some(Event::State(State::Disarmed)));
    assert!(bench.is_vented());
    assert_eq!(bench.latched(), None);
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Err(Refusal::WrongState(State::Disarmed)));
}
