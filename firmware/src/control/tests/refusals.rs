//! Orders that are refused in the wrong state, and the refusal that the host receives.

use model_core::link::messages::{Event, Reference, ReferenceOrder};

use super::*;

#[test]
fn a_setpoint_is_refused_unless_something_runs() {
    let wave = ReferenceOrder {
        reference: Reference::Sine { mean: 200e3, amplitude: 50e3, frequency_hz: 1.0 },
        session: OWNER,
    };
    let mut bench = Bench::new(|_| ());
    bench.pass(10);
    assert_eq!(bench.controller.set_point(to_pressure(300e3)), Err(Refusal::WrongState(State::Disarmed)));
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    assert_eq!(bench.controller.take_event(), Some(Event::State(State::Armed)));
    assert_eq!(bench.controller.take_event(), None);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    assert_eq!(bench.controller.take_event(), None, "it was armed before");
    assert_eq!(bench.controller.set_point(to_pressure(300e3)), Err(Refusal::WrongState(State::Armed)));
    assert_eq!(bench.controller.reference(wave), Err(Refusal::WrongState(State::Armed)));
    assert_eq!(bench.controller.start(Mode::Vent, OWNER), Ok(()));
    assert_eq!(bench.controller.mode(), Mode::Vent);
    assert_eq!(bench.controller.reference(wave), Err(Refusal::WrongMode(Mode::Vent)));
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
    assert_eq!(bench.controller.mode(), Mode::Pressure);
    let force = SetPointOrder { set_point: SetPoint::Force(10.0), session: OWNER };
    assert_eq!(bench.controller.set_point(force), Err(Refusal::WrongMode(Mode::Pressure)));
    assert!(matches!(bench.controller.set_point(to_pressure(f32::NAN)), Err(Refusal::Value(_))));
    assert_eq!(bench.controller.reference(wave), Ok(()));
    let holding = &mut Bench::holding().controller;
    let latched = Refusal::Latched(Fault::SetPointSilence);
    assert_eq!(holding.set_point(to_pressure(300e3)), Err(latched), "the held command stays");
}

#[test]
fn ticks_and_missed_ticks_are_counted() {
    let mut bench = Bench::new(|_| ());
    bench.pass(25);
    assert_eq!((bench.controller.ticks(), bench.controller.time_us()), (25, 25_000));
    assert_eq!(bench.controller.overruns(), 0);
    bench.pass_with(3, |_, inputs| inputs.missed_ticks = 2);
    assert_eq!(bench.controller.overruns(), 6);
    assert_eq!((bench.controller.state(), bench.latched()), (State::Disarmed, None), "nothing runs");
    let mut running = Bench::running(|settings| settings.watch.overrun_ticks = 5);
    running.pass_with(2, |_, inputs| inputs.missed_ticks = 2);
    assert_eq!(running.latched(), None);
    running.pass(1);
    running.pass_with(2, |_, inputs| inputs.missed_ticks = 2);
    assert_eq!(running.latched(), None, "they were not in a row");
    running.pass_with(1, |_, inputs| inputs.missed_ticks = 1);
    assert_eq!(running.latched(), Some(Fault::LoopOverrun));
    assert!(running.is_vented());
}

#[test]
fn a_fault_that_stays_during_a_fault_is_counted_once() {
    let mut bench = Bench::running(|_| ());
    bench.pass_with(100, |now, _| now.pressure_pa = 900e3);
    assert_eq!(bench.latched(), Some(Fault::OverPressure));
    let count = |bench: &Bench, fault: Fault| bench.controller.faults().counts[usize::from(fault.code())];
    assert_eq!(count(&bench, Fault::OverPressure), 1, "it is the same one");
}

#[test]
fn setpoints_that_stop_vent_after_their_time_and_references_are_none() {
    let mut bench = Bench::running(|settings| settings.watch.silence_ticks = 1_100);
    bench.pass(100);
    assert_eq!(bench.latched(), None, "just not yet");
    bench.pass(2);
    assert_eq!(bench.latched(), Some(Fault::SetPointSilence));
    assert!(bench.is_vented());
    let mut waves = Bench::running(|settings| settings.watch.silence_ticks = 1_100);
    let reference = Reference::Sine { mean: 300e3, amplitude: 50e3, frequency_hz: 1.0 };
    assert_eq!(waves.controller.reference(ReferenceOrder { reference, session: OWNER }), Ok(()));
    waves.pass(3_000);
    assert_eq!(waves.latched(), None);
}
