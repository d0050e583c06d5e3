//! A request that is repeated gives no watch more time.

use super::*;

/// Ticks between two repetitions: several within the time after which pressure that does not follow is a fault.
const REPEAT_TICKS: u32 = 50;

/// Lets time pass with changed readings and repeats requests; returns the ticks until a fault is latched.
fn ticks_to_a_fault(
    bench: &mut Bench,
    change: impl Fn(&mut Readings),
    repeat: impl Fn(&mut Controller),
) -> Option<u32> {
    for ticks in 1..=1_000 {
        bench.pass_with(1, |now, _| change(now));
        if bench.latched().is_some() {
            return Some(ticks);
        }
        if ticks % REPEAT_TICKS == 0 {
            repeat(&mut bench.controller);
        }
    }
    None
}

fn start(controller: &mut Controller, modes: &[Mode]) {
    for mode in modes {
        assert_eq!(controller.start(*mode, OWNER), Ok(()));
    }
}

#[test]
fn a_repeated_start_hides_no_burst() {
    let burst = |now: &mut Readings| now.pressure_pa *= 1e-3;
    let once = ticks_to_a_fault(&mut Bench::running(|_| ()), burst, |_| ());
    assert!(once.is_some_and(|ticks| ticks <= 210), "{once:?}");
    for modes in [&[Mode::Pressure][..], &[Mode::Vent, Mode::Pressure]] {
        let mut bench = Bench::running(|_| ());
        let repeated = ticks_to_a_fault(&mut bench, burst, |controller| {
            start(controller, modes);
            assert_eq!(controller.set_point(to_pressure(400e3)), Ok(()));
        });
        assert_eq!(bench.latched(), Some(Fault::PressureNotRising), "{modes:?}");
        assert_eq!(repeated, once, "{modes:?}");
        assert!(bench.is_vented());
    }
}

#[test]
fn a_repeated_start_gives_air_that_stays_no_more_time() {
    let jammed = || {
        let mut bench = Bench::running(|_| ());
        (bench.regulator_works, bench.valve_works) = (false, false);
        start(&mut bench.controller, &[Mode::Vent]);
        bench
    };
    let once = ticks_to_a_fault(&mut jammed(), |_| (), |_| ());
    assert!(once.is_some_and(|ticks| ticks < 400), "{once:?}");
    let mut bench = jammed();
    let repeated = ticks_to_a_fault(&mut bench, |_| (), |controller| start(controller, &[Mode::Vent]));
    assert_eq!(bench.latched(), Some(Fault::PressureNotFalling));
    assert_eq!(repeated, once);
}

#[test]
fn a_mode_that_follows_a_vent_begins_at_what_is_measured() {
    let mut bench = Bench::running(|_| ());
    start(&mut bench.controller, &[Mode::Vent]);
    bench.pass(20);
    let left_pa = bench.pressure_pa;
    assert!((150e3..300e3).contains(&left_pa), "{left_pa}");
    start(&mut bench.controller, &[Mode::Pressure]);
    bench.pass(300);
    assert_eq!(bench.latched(), None);
    assert!((bench.pressure_pa - left_pa).abs() < 10e3, "{} of {left_pa}", bench.pressure_pa);
}

#[test]
fn a_repeated_arm_gives_no_sensor_more_time() {
    // The second pressure sensor gives no reading.
    let armed = || {
        let mut bench = Bench::new(|settings| settings.watch.second_pressure_pa = 20e3);
        bench.pass(10);
        assert_eq!(bench.controller.arm(OWNER), Ok(()));
        bench
    };
    let once = ticks_to_a_fault(&mut armed(), |_| (), |_| ());
    assert!(once.is_some_and(|ticks| ticks <= 210), "{once:?}");
    let mut bench = armed();
    let repeated =
        ticks_to_a_fault(&mut bench, |_| (), |controller| assert_eq!(controller.arm(OWNER), Ok(())));
    assert_eq!(bench.latched(), Some(Fault::PressureSensorsDisagree));
    assert_eq!(repeated, once);
}
