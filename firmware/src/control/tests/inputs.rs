//! Scales and filters of sensors, the second pressure sensor, the supply air, the enable input, and the output to the regulator.

use super::*;
use model_core::link::messages::MeanSignals;
use model_core::link::settings::SensorScale;

/// A signal as the second pressure sensor of the first muscle gives it.
fn second(inputs: &mut Inputs, signal: Option<f32>) {
    inputs.sides[0] = Some(Signals { second_pressure: signal, ..Signals::default() });
}

#[test]
fn a_scale_turns_a_signal_into_a_reading_and_the_watches_judge_the_reading() {
    let mut bench = Bench::running(|_| ());
    // 5 V per MPa with 0.5 V at zero, as the volts of a converter.
    let volts = |pascals: f32| 0.5 + pascals * 5e-6;
    let mut settings = *bench.controller.settings();
    settings.scales.pressure = SensorScale { at_zero: -100e3, per_unit: 200e3, filter_s: 0.0 };
    bench.controller.use_settings(&settings);
    bench.pass_with(300, |now, _| now.pressure_pa = volts(now.pressure_pa));
    assert_eq!((bench.controller.state(), bench.latched()), (State::Running, None));
    bench.pass_with(3, |now, _| now.pressure_pa = volts(900e3));
    assert_eq!(bench.latched(), Some(Fault::OverPressure));
    let report = bench.controller.faults().latched.expect("latched");
    assert!((report.value - 900e3).abs() < 1.0, "{}", report.value);
    assert!(bench.is_vented());
}

#[test]
fn a_filter_smooths_what_is_controlled_and_delays_no_watch() {
    let slow = |settings: &mut Settings| settings.scales.pressure.filter_s = 0.1;
    let mut bench = Bench::running(slow);
    let ticks_until_vented = |bench: &mut Bench| {
        (1..=20).find(|_| {
            bench.pass_with(1, |now, _| now.pressure_pa = 900e3);
            bench.is_vented()
        })
    };
    assert_eq!(
        ticks_until_vented(&mut bench),
        Some(2),
        "after the debounce of two ticks, as without a filter"
    );
    assert_eq!(bench.latched(), Some(Fault::OverPressure));
    let last = bench.controller.faults().latched.expect("latched").last;
    assert!(last.pressure_pa < 450e3, "the reading for control is filtered: {}", last.pressure_pa);
}

/// A filter that has not yet followed must not hide pressure from arming.
#[test]
fn an_empty_muscle_is_judged_before_the_filter() {
    let mut bench = Bench::new(|settings| settings.scales.pressure.filter_s = 0.1);
    bench.pass(50);
    bench.pass_with(1, |now, _| now.pressure_pa = 300e3);
    assert_eq!(bench.controller.arm(OWNER), Err(Refusal::StillFaulty(Fault::NotVented)));
}

#[test]
fn two_pressure_sensors_that_disagree_vent_and_so_does_one_that_is_missing() {
    let compared = |settings: &mut Settings| settings.watch.second_pressure_pa = 20e3;
    for (signal, fault) in [
        (Some(401e3), None),
        (Some(430e3), Some(Fault::PressureSensorsDisagree)),
        (Some(370e3), Some(Fault::PressureSensorsDisagree)),
        (Some(f32::NAN), Some(Fault::PressureSensorsDisagree)),
        (None, Some(Fault::PressureSensorsDisagree)),
        // The first sensor reads low: the second alone notices too much pressure.
        (Some(750e3), Some(Fault::OverPressure)),
    ] {
        let mut bench = Bench::new(compared);
        bench.pass_with(10, |_, inputs| second(inputs, Some(0.0)));
        assert_eq!(bench.controller.arm(OWNER), Ok(()));
        assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
        assert_eq!(bench.controller.set_point(to_pressure(400e3)), Ok(()));
        bench.pass_with(600, |now, inputs| second(inputs, Some(now.pressure_pa)));
        assert_eq!(bench.latched(), None);
        bench.pass_with(201, |_, inputs| second(inputs, signal));
        assert_eq!(bench.latched(), fault, "{signal:?}");
        assert_eq!(bench.is_vented(), fault.is_some());
    }
}

#[test]
fn supply_air_below_its_least_pressure_is_a_fault_from_arming_on() {
    let watched = |settings: &mut Settings| settings.watch.supply_low_pa = 500e3;
    let mut bench = Bench::new(watched);
    bench.pass_with(300, |_, inputs| inputs.supply_air = Some(600e3));
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.pass_with(300, |_, inputs| inputs.supply_air = Some(600e3));
    assert_eq!(bench.latched(), None);
    // A dip while the muscle fills.
    bench.pass_with(150, |_, inputs| inputs.supply_air = Some(450e3));
    bench.pass_with(10, |_, inputs| inputs.supply_air = Some(600e3));
    assert_eq!(bench.latched(), None);
    bench.pass_with(201, |_, inputs| inputs.supply_air = Some(450e3));
    assert_eq!(bench.latched(), Some(Fault::SupplyPressureLow));
    let mut missing = Bench::new(watched);
    missing.pass(300);
    assert_eq!(missing.latched(), None, "disarmed, without air, is not a fault");
    assert_eq!(missing.controller.arm(OWNER), Ok(()));
    missing.pass(1);
    assert_eq!(missing.latched(), Some(Fault::SupplyPressureLow));
    // Without a least pressure no reading is too low, not even that of an input that is not connected.
    for supply_air in [None, Some(-1.0), Some(f32::NAN)] {
        let mut unwatched = Bench::running(|_| ());
        unwatched.pass_with(300, |_, inputs| inputs.supply_air = supply_air);
        assert_eq!(unwatched.latched(), None, "{supply_air:?}");
    }
}

#[test]
fn an_open_enable_input_vents_within_three_ticks_and_nothing_is_armed_while_it_is_open() {
    let mut bench = Bench::running(|settings| settings.watch.enable_input = true);
    bench.pass_with(2, |_, inputs| inputs.enable_open = true);
    assert_eq!(bench.latched(), Some(Fault::EnableOpen));
    assert!(bench.is_vented());
    bench.pass_with(300, |_, inputs| inputs.enable_open = true);
    assert_eq!(bench.controller.clear(), Err(Refusal::StillFaulty(Fault::EnableOpen)));
    bench.pass(300);
    assert_eq!(bench.controller.clear(), Ok(()));
    bench.pass_with(1, |_, inputs| inputs.enable_open = true);
    assert_eq!(bench.controller.arm(OWNER), Err(Refusal::StillFaulty(Fault::EnableOpen)));
    bench.pass(1);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));

    let mut without = Bench::running(|_| ());
    without.pass_with(300, |_, inputs| inputs.enable_open = true);
    assert_eq!(without.latched(), None, "a board whose enable input is not used");
}

#[test]
fn a_scale_that_is_ten_times_wrong_is_found_by_the_valve_test() {
    for per_unit in [0.1, 10.0] {
        let mut bench = Bench::new(|settings| {
            settings.watch.valve_test_pa = 40e3;
            settings.scales.pressure.per_unit = per_unit;
        });
        bench.pass_with(10, |now, _| now.pressure_pa = 0.0);
        assert_eq!(bench.controller.arm(OWNER), Ok(()));
        bench.pass(1_100);
        assert_eq!((bench.controller.state(), bench.latched()), (State::Fault, Some(Fault::ValveTest)));
        assert!(bench.is_vented());
    }
}

#[test]
fn the_output_is_a_part_of_its_range_from_its_low_end_on() {
    let mut bench = Bench::running(|settings| {
        (settings.command.low, settings.command.full_pa) = (0.2, 1e6);
    });
    let [command, level] = [bench.last.sides[0].pressure_pa * 1e-6, bench.last.levels[0]];
    assert!((level - (0.2 + 0.8 * command)).abs() < 1e-6, "{level} at {command} MPa");
    assert!((level - 0.52).abs() < 0.01, "4–20 mA: 10.4 mA at 4 of 10 bar, {level}");
    assert_eq!(bench.last.state, State::Running);
    assert_eq!(bench.controller.disarm(), Ok(()));
    bench.pass(1);
    assert_eq!((bench.last.levels[0], bench.is_vented()), (0.2, true), "4 mA");
}

#[test]
fn signals_are_read_as_means_before_any_scale() {
    let mut bench = Bench::new(|settings| settings.scales.force.per_unit = 1_000.0);
    let mut answer = MeanSignals::default();
    bench.controller.take_signals(Side::Agonist, &mut answer);
    bench.pass_with(50, |now, inputs| {
        now.force_n = 0.25;
        second(inputs, Some(0.5));
        inputs.supply_air = Some(1.5);
    });
    bench.controller.take_signals(Side::Agonist, &mut answer);
    assert_eq!((answer.ticks, answer.mean.force, answer.mean.second_pressure), (50, 0.25, Some(0.5)));
    assert_eq!((answer.supply, answer.enabled), (Some(1.5), true));
}

#[test]
fn an_open_enable_input_ends_the_test_of_the_valves_within_three_ticks() {
    let mut bench = Bench::new(|settings| {
        settings.watch.enable_input = true;
        settings.watch.valve_test_pa = 40e3;
    });
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.pass(20);
    assert!(bench.pressure_pa > 10e3 && !bench.is_vented(), "the muscle is being filled");
    bench.pass_with(3, |_, inputs| inputs.enable_open = true);
    assert_eq!((bench.controller.state(), bench.latched()), (State::Fault, Some(Fault::EnableOpen)));
    assert!(bench.is_vented());
    bench.pass(1_000);
    assert_eq!(bench.controller.clear(), Ok(()));
    bench.pass(1_000);
    assert_eq!(bench.controller.state(), State::Disarmed, "the test does not continue without a request");
    assert!(bench.is_vented());
}

/// A load comes off and the muscle moves at twice its limit, over a distance of 50 mm.
#[test]
fn a_filter_of_the_stroke_hides_no_speed() {
    let noticed = |filter_s: f32| {
        let mut bench = Bench::running(|settings| {
            settings.scales.stroke.filter_s = filter_s;
            settings.limits.speed_m_per_s = 0.5;
            settings.stroke.jump = 0.1;
        });
        (0..200_u16).find(|tick| {
            let gone_m = 1e-3 * f32::from((*tick).min(50));
            bench.pass_with(1, |now, _| now.stroke_m += gone_m);
            bench.latched() == Some(Fault::OverSpeed)
        })
    };
    let without = noticed(0.0);
    assert!(without.is_some_and(|ticks| (10..20).contains(&ticks)), "{without:?}");
    assert_eq!([noticed(0.02), noticed(0.1)], [without; 2]);
}
