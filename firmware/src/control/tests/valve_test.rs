//! The test of regulator and dump valve before arming, to the tick.

use super::*;
use crate::control::arming::Arming;

/// Pressure of the test, Pa.
const TEST_PA: f32 = 40e3;

/// Ticks in which the dump valve was closed and open during a test whose pressure is given by whether the valve is open.
fn tried(change: impl FnOnce(&mut Settings), pressure_pa: fn(bool) -> f32) -> (u32, u32, Bench) {
    let mut bench = Bench::new(|settings| {
        settings.watch.valve_test_pa = TEST_PA;
        settings.watch.follow_pa = 1e6;
        change(settings);
    });
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    let (mut closed, mut open) = (0, 0);
    while bench.controller.arming != Arming::Idle {
        let opened = matches!(bench.controller.arming, Arming::Dumping(_));
        *(if opened { &mut open } else { &mut closed }) += 1;
        bench.pass_with(1, |now, _| now.pressure_pa = pressure_pa(opened));
    }
    (closed, open, bench)
}

#[test]
fn the_regulator_is_given_four_time_constants_and_at_most_half_a_second() {
    let good = |open| if open { 0.0 } else { TEST_PA };
    for (lag_s, line_s, ticks) in [(0.02, 0.0051, 101), (0.0051, 0.02, 101), (0.0, 0.0, 0), (0.1, 0.5, 500)] {
        let change = |settings: &mut Settings| {
            (settings.regulator.lag_s, settings.regulator.line_s) = (lag_s, line_s);
        };
        let (closed, open, bench) = tried(change, good);
        assert_eq!((closed, open), (ticks + 1, 1), "{lag_s} s and {line_s} s");
        assert_eq!((bench.controller.state(), bench.latched()), (State::Armed, None));
    }
}

#[test]
fn half_of_the_pressure_must_come_and_go_within_a_second_and_never_twice_of_it() {
    let settled =
        |settings: &mut Settings| (settings.regulator.lag_s, settings.regulator.line_s) = (0.0, 0.0);
    let half = 0.5 * TEST_PA;
    let fault = |bench: &Bench| {
        bench.controller.faults().latched.map(|found| (found.fault, found.value, found.limit))
    };
    let failed = |value: f32, limit: f32| Some((Fault::ValveTest, value, limit));
    let (closed, open, bench) = tried(settled, |_| (0.5 * TEST_PA).next_down());
    assert_eq!((closed, open, fault(&bench)), (1_001, 0, failed(half.next_down(), half)));
    let (closed, open, bench) = tried(settled, |_| 0.5 * TEST_PA);
    assert_eq!((closed, open, fault(&bench)), (1, 1_001, failed(half, half)));
    let (closed, open, bench) =
        tried(settled, |open| if open { (0.5 * TEST_PA).next_down() } else { 2.0 * TEST_PA });
    assert_eq!((closed, open, fault(&bench)), (1, 1, None), "up to twice of it");
    assert_eq!(bench.controller.state(), State::Armed);
    let most = 2.0 * TEST_PA;
    let (closed, open, bench) = tried(settled, |_| (2.0 * TEST_PA).next_up());
    assert_eq!((closed, open, fault(&bench)), (1, 0, failed(most.next_up(), most)));
    let (_, _, bench) = tried(settled, |_| f32::NAN);
    assert_eq!(bench.controller.state(), State::Fault, "a pressure that is not a number");
}

#[test]
fn the_command_of_the_test_is_what_the_regulator_makes_its_pressure_of() {
    for (gain, offset_pa, most_pa, command_pa) in
        [(2.0, 3e3, 600e3, 17e3), (0.5, 0.0, 600e3, 80e3), (0.5, 0.0, 30e3, 30e3), (1.0, 50e3, 600e3, 0.0)]
    {
        let mut bench = Bench::new(|settings| {
            settings.watch.valve_test_pa = TEST_PA;
            settings.regulator.gain = gain;
            settings.regulator.offset_pa = offset_pa;
            settings.regulator.command_max_pa = most_pa;
        });
        bench.pass(10);
        assert_eq!(bench.controller.arm(OWNER), Ok(()));
        bench.pass(1);
        let sent = bench.last.sides[0];
        assert_eq!((sent.pressure_pa, sent.vent), (command_pa, false), "gain {gain}, offset {offset_pa} Pa");
    }
}

#[test]
fn an_armed_device_disarms_itself_in_the_tick_after_its_time() {
    let mut bench = Bench::new(|settings| settings.watch.armed_silence_ticks = 50);
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.hears_host = false;
    bench.pass(50);
    assert_eq!(bench.controller.state(), State::Armed);
    bench.pass(1);
    assert_eq!(bench.controller.state(), State::Disarmed);
}

#[test]
fn a_device_that_runs_in_the_mode_that_vents_disarms_itself_like_an_armed_one() {
    let mut bench = Bench::new(|settings| settings.watch.armed_silence_ticks = 50);
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    assert_eq!(bench.controller.start(Mode::Vent, OWNER), Ok(()));
    bench.pass(500);
    assert_eq!(bench.controller.state(), State::Running, "its owner keeps it alive");
    bench.hears_host = false;
    bench.pass(51);
    assert_eq!(bench.controller.state(), State::Disarmed);
    assert_eq!(bench.latched(), None);
}

/// A converter that misses a tick now and then: what was not read decides nothing.
#[test]
fn ticks_without_readings_pass_no_valve_test() {
    for (regulator_works, valve_works) in [(false, false), (false, true), (true, false)] {
        for missing in [[true, false], [false, true], [true, true]] {
            let mut bench = Bench::new(|settings| {
                settings.watch.valve_test_pa = TEST_PA;
                settings.watch.debounce_ticks = 20;
            });
            (bench.regulator_works, bench.valve_works) = (regulator_works, valve_works);
            let second = [Some(Readings { pressure_pa: 0.0, ..Readings::default() }.into()); 2];
            bench.controller.step(&Inputs { sides: second, ..Inputs::default() });
            bench.pass(10);
            assert_eq!(bench.controller.arm(OWNER), Ok(()));
            for _ in 0..2_100 {
                // In every other tick nothing arrives from one muscle, or from both.
                let now = Readings { pressure_pa: bench.pressure_pa, ..Readings::default() };
                let read = |side: usize| (!missing[side]).then(|| now.into());
                bench.controller.step(&Inputs { sides: [read(0), read(1)], ..Inputs::default() });
                bench.pass(1);
                assert_eq!(bench.controller.keep_alive(OWNER), Ok(()));
            }
            let found = (bench.controller.state(), bench.latched());
            assert_eq!(found, (State::Fault, Some(Fault::ValveTest)), "{regulator_works} {valve_works}");
        }
    }
}

#[test]
fn a_sound_muscle_passes_the_valve_test_although_ticks_are_missing() {
    let mut bench = Bench::new(|settings| {
        settings.watch.valve_test_pa = TEST_PA;
        settings.watch.debounce_ticks = 20;
    });
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    for _ in 0..300 {
        bench.controller.step(&Inputs::default());
        bench.pass(1);
    }
    assert_eq!((bench.controller.state(), bench.latched()), (State::Armed, None));
}
