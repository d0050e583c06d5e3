//! The ends of the range of every setting: the smallest and the largest value are taken, the next number beyond is not.

use super::*;

/// A board whose converters end where its settings may not.
const BOARD: Hardware = Hardware {
    pressure: Span { low: -100e3, high: 1.2e6 },
    stroke: Span { low: -0.5, high: 1.0 },
    force: Span { low: -1_000.0, high: 5_000.0 },
    second_pressure: Some(Span { low: -100e3, high: 1e6 }),
    supply: Some(Span { low: -100e3, high: 1.5e6 }),
    ..Hardware::SIMULATED
};

fn found(hardware: &Hardware, change: impl FnOnce(&mut Settings)) -> Option<Field> {
    let mut settings = Settings::DEFAULT;
    change(&mut settings);
    match check_settings(&settings, hardware) {
        Ok(()) => None,
        Err(Refusal::Value(field)) => Some(field),
        Err(other) => panic!("{other:?}"),
    }
}

type Range = (Field, f32, f32, fn(&mut Settings, f32));

fn are_the_ends(ranges: &[Range]) {
    for (at, (field, low, high, set)) in ranges.iter().enumerate() {
        let with = |value| found(&BOARD, |settings| set(settings, value));
        assert_eq!([with(*low), with(*high)], [None, None], "row {at}: {field:?} from {low} to {high}");
        for beyond in [low.next_down(), high.next_up()] {
            assert_eq!(with(beyond), Some(*field), "row {at}: {beyond} beyond {low} to {high}");
        }
    }
}

#[test]
fn loops_joint_and_regulator_have_these_ranges() {
    are_the_ends(&[
        (Field::ForceLoop, 0.0, 1e9, |s, v| s.force_loop.proportional_pa_per_n = v),
        (Field::ForceLoop, 0.0, 1e9, |s, v| s.force_loop.integral_pa_per_n_s = v),
        (Field::ForceLoop, 0.0, 2e6, |s, v| s.force_loop.trim_limit_pa = v),
        (Field::StrokeLoop, 0.0, 1e9, |s, v| s.stroke_loop.proportional_n_per_m = v),
        (Field::StrokeLoop, 0.0, 1e9, |s, v| s.stroke_loop.integral_n_per_m_s = v),
        (Field::StrokeLoop, 0.0, 1e9, |s, v| s.stroke_loop.damping_n_s_per_m = v),
        (Field::StrokeLoop, -100e3, 100e3, |s, v| s.stroke_loop.load_n = v),
        (Field::StrokeLoop, -1e9, 1e9, |s, v| s.stroke_loop.load_stiffness_n_per_m = v),
        (Field::StrokeLoop, 1e-3, 100e3, |s, v| s.stroke_loop.force_limit_n = v),
        (Field::Joint, 1e-4, 2.0, |s, v| s.joint.radius_m = v),
        (Field::Joint, -2.0, 2.0, |s, v| s.joint.rest_stroke_m = v),
        (Field::Joint, 0.0, 1e9, |s, v| s.joint.proportional_nm_per_rad = v),
        (Field::Joint, 0.0, 1e9, |s, v| s.joint.integral_nm_per_rad_s = v),
        (Field::Joint, 0.0, 1e9, |s, v| s.joint.damping_nm_s_per_rad = v),
        (Field::Joint, 1e-3, 10e3, |s, v| s.joint.torque_limit_nm = v),
        (Field::Regulator, 0.1, 10.0, |s, v| s.regulator.gain = v),
        (Field::Regulator, -200e3, 200e3, |s, v| s.regulator.offset_pa = v),
        (Field::Regulator, 0.0, 10.0, |s, v| s.regulator.lag_s = v),
        (Field::Regulator, 0.0, 10.0, |s, v| s.regulator.line_s = v),
        (Field::Regulator, 1e3, 1e9, |s, v| s.regulator.rate_pa_per_s = v),
        (Field::Regulator, 0.0, 100e3, |s, v| s.regulator.deadband_pa = v),
        (Field::Regulator, 0.0, 1.0, |s, v| s.regulator.lead = v),
        (Field::Bands, 1e-9, 0.1, |s, v| s.motion_band_m = v),
        (Field::Bands, 1e-3, 1e6, |s, v| s.pressure_band_pa = v),
        (Field::Command, 0.0, 0.5, |s, v| s.command.low = v),
    ]);
    are_the_ends(&[
        // The largest command lies within the range of the output, and below the ceiling of the board.
        (Field::Regulator, 1e3, 2e6, |s, v| (s.regulator.command_max_pa, s.command.full_pa) = (v, 5e6)),
        (Field::Command, 10e3, 5e6, |s, v| (s.regulator.command_max_pa, s.command.full_pa) = (1e3, v)),
        (Field::Command, 650e3, 5e6, |s, v| s.command.full_pa = v),
        (Field::Valves, 10e3, 5e6, |s, v| s.valves.supply_pa = v),
        (Field::Valves, 1e3, 1e9, |s, v| s.valves.fill_pa_per_s = v),
        (Field::Valves, 1e3, 1e9, |s, v| s.valves.vent_pa_per_s = v),
        (Field::Valves, 0.0, 10e-3, |s, v| s.valves.dead_s = v),
        (Field::Valves, 0.0, 10e-3, |s, v| s.valves.least_s = v),
        (Field::Valves, 0.0, 10e-3, |s, v| s.valves.apart_s = v),
        (Field::Valves, 0.0, 100e3, |s, v| s.valves.band_pa = v),
    ]);
}

#[test]
fn limits_lie_between_the_ends_of_their_converters() {
    are_the_ends(&[
        (Field::Limits, 1e-4, 100.0, |s, v| s.limits.speed_m_per_s = v),
        (Field::Limits, 1e3, 1e9, |s, v| s.limits.slew_pa_per_s = v),
        (Field::Limits, 1e3, 1.2e6_f32.next_down(), |s, v| s.limits.pressure_pa = v),
        (Field::Limits, 1e-3, 5_000.0_f32.next_down(), |s, v| s.limits.force_n = v),
        (Field::Limits, (-0.5_f32).next_up(), 0.08_f32.next_down(), |s, v| s.limits.stroke_min_m = v),
        (Field::Limits, (-0.01_f32).next_up(), 1.0_f32.next_down(), |s, v| s.limits.stroke_max_m = v),
    ]);
}

#[test]
fn a_sensor_is_watched_between_the_ends_of_its_converter() {
    are_the_ends(&[
        (Field::SensorWatch, (-100e3_f32).next_up(), 1e6_f32.next_down(), |s, v| s.pressure.low = v),
        (Field::SensorWatch, (-50e3_f32).next_up(), 1.2e6_f32.next_down(), |s, v| s.pressure.high = v),
        (Field::SensorWatch, 1e-9, 1.3e6, |s, v| s.pressure.jump = v),
        (Field::SensorWatch, (-0.5_f32).next_up(), 0.2_f32.next_down(), |s, v| s.stroke.low = v),
        (Field::SensorWatch, (-0.02_f32).next_up(), 1.0_f32.next_down(), |s, v| s.stroke.high = v),
        (Field::SensorWatch, 1e-9, 1.5, |s, v| s.stroke.jump = v),
        (Field::SensorWatch, (-1_000.0_f32).next_up(), 4_000.0_f32.next_down(), |s, v| s.force.low = v),
        (Field::SensorWatch, (-500.0_f32).next_up(), 5_000.0_f32.next_down(), |s, v| s.force.high = v),
        (Field::SensorWatch, 1e-9, 6_000.0, |s, v| s.force.jump = v),
    ]);
    let none = found(&BOARD, |s| (s.force.fitted, s.force.low, s.force.jump) = (false, f32::NAN, 0.0));
    assert_eq!(none, None, "a sensor that is not there");
}

#[test]
fn watches_have_these_ranges() {
    are_the_ends(&[
        (Field::Watch, 0.0, 5_000.0, |s, v| s.watch.disagree_n = v),
        (Field::Watch, 1e3, 1.2e6, |s, v| s.watch.follow_pa = v),
        (Field::Watch, 100.0, 100e3, |s, v| s.watch.vented_pa = v),
        (Field::Watch, 0.0, 1.2e6, |s, v| s.watch.second_pressure_pa = v),
        (Field::Watch, 0.0, 1.5e6, |s, v| s.watch.supply_low_pa = v),
        // A test of the valves goes to twice what counts as vented at least.
        (Field::Watch, 40e3, 200e3, |s, v| s.watch.valve_test_pa = v),
        (Field::Watch, 60e3, 200e3, |s, v| (s.watch.vented_pa, s.watch.valve_test_pa) = (30e3, v)),
    ]);
    assert_eq!(found(&BOARD, |s| s.watch.valve_test_pa = 0.0), None, "no test");
    type Counts = (u32, u32, fn(&mut Settings, u32));
    let counts: [Counts; 10] = [
        (1, 20, |s, n| s.watch.debounce_ticks = n as u16),
        (1, 64, |s, n| s.watch.noisy_jumps = n as u16),
        (1, 2_000, |s, n| s.watch.disagree_ticks = n as u16),
        (1, 2_000, |s, n| s.watch.follow_ticks = n as u16),
        (0, 60_000, |s, n| s.watch.silence_ticks = n),
        (1, 60_000, |s, n| s.watch.host_silence_ticks = n),
        (1_000, 3_600_000, |s, n| s.watch.armed_silence_ticks = n),
        (1, 50, |s, n| s.watch.overrun_ticks = n as u16),
        (0, 600_000, |s, n| s.watch.hold_ticks = n),
        (100, 30_000, |s, n| s.watch.vent_ticks = n),
    ];
    for (at, (low, high, set)) in counts.into_iter().enumerate() {
        let with = |ticks| found(&BOARD, |settings| set(settings, ticks));
        assert_eq!([with(low), with(high)], [None, None], "row {at}");
        let below = low.checked_sub(1).map(with);
        assert!(below.is_none_or(|found| found == Some(Field::Watch)), "row {at} below {low}");
        assert_eq!(with(high + 1), Some(Field::Watch), "row {at} above {high}");
    }
    let sensors: [fn(&mut Settings, u16); 3] =
        [|s, n| s.pressure.stuck_ticks = n, |s, n| s.stroke.stuck_ticks = n, |s, n| s.force.stuck_ticks = n];
    for set in sensors {
        let with = |ticks| found(&BOARD, |settings| set(settings, ticks));
        assert_eq!((with(10_000), with(10_001)), (None, Some(Field::SensorWatch)));
    }
}

#[test]
fn inputs_that_a_board_does_not_have_are_not_monitored() {
    let without = Hardware::SIMULATED;
    let with = Hardware { enable_input: true, ..BOARD };
    let least = f32::MIN_POSITIVE;
    type Change = fn(&mut Settings, f32);
    let inputs: [Change; 3] = [
        |s, v| s.watch.second_pressure_pa = v,
        |s, v| s.watch.supply_low_pa = v,
        |s, v| s.watch.enable_input = v > 0.0,
    ];
    for change in inputs {
        assert_eq!(found(&without, |s| change(s, least)), Some(Field::Watch));
        assert_eq!(found(&without, |s| change(s, 0.0)), None);
        assert_eq!(found(&with, |s| change(s, least)), None);
    }
}

#[test]
fn a_pair_of_valves_needs_outputs_a_pressure_sensor_and_a_lag_of_two_periods() {
    let with = Hardware { valve_pair: true, ..BOARD };
    let pair = |ticks: u16, lag_s: f32| {
        move |settings: &mut Settings| {
            (settings.valves.period_ticks, settings.regulator.lag_s) = (ticks, lag_s);
            settings.valves.apart_s = 2e-3;
        }
    };
    for ticks in [4, 5, 50] {
        let lag_s = 2e-3 * f32::from(ticks);
        assert_eq!(found(&with, pair(ticks, lag_s)), None);
        assert_eq!(found(&with, pair(ticks, lag_s.next_down())), Some(Field::Valves), "{ticks}");
        assert_eq!(found(&BOARD, pair(ticks, lag_s)), Some(Field::Valves), "without outputs");
        let blind = |s: &mut Settings| {
            pair(ticks, lag_s)(s);
            s.pressure.fitted = false;
        };
        assert_eq!(found(&with, blind), Some(Field::Valves), "without a sensor");
    }
    for ticks in [1, 3, 51, u16::MAX] {
        assert_eq!(found(&with, pair(ticks, 10.0)), Some(Field::Valves), "{ticks}");
    }
    let mut settings = Settings::DEFAULT;
    pair(10, 0.1)(&mut settings);
    assert!(repair_settings(&mut settings, &BOARD) && !settings.valves.is_fitted());
}

#[test]
fn a_pair_of_valves_has_room_in_its_period_supply_for_its_command_and_a_quick_filter() {
    let with = Hardware { valve_pair: true, ..BOARD };
    let fitted = |change: fn(&mut Settings, f32), value: f32| {
        found(&with, move |s| {
            (s.valves.period_ticks, s.regulator.lag_s) = (8, 0.04);
            (s.valves.dead_s, s.valves.least_s, s.valves.apart_s) = (1e-3, 1e-3, 2e-3);
            change(s, value);
        })
    };
    type Change = fn(&mut Settings, f32);
    let edges: [(Change, f32, f32); 5] = [
        (|s, v| s.valves.dead_s = v, 4.9e-3, 5.1e-3),
        (|s, v| s.valves.least_s = v, 4.9e-3, 5.1e-3),
        (|s, v| s.valves.apart_s = v, 5.9e-3, 6.1e-3),
        (|s, v| s.scales.pressure.filter_s = v, 9.9e-3, 10.1e-3),
        (|s, v| s.valves.supply_pa = v, Settings::DEFAULT.regulator.command_max_pa, 649e3),
    ];
    for (at, (change, good, bad)) in edges.into_iter().enumerate() {
        assert_eq!(fitted(change, good), None, "{at}");
        assert_eq!(fitted(change, bad), Some(Field::Valves), "{at}");
    }
}

#[test]
fn a_scale_gives_a_span_that_its_sensor_can_have() {
    let refused = |change: fn(&mut Settings)| found(&BOARD, change) == Some(Field::Scale);
    // Zero pressure lies within the span of a pressure sensor, not at its end.
    assert!(refused(|s| s.scales.pressure.at_zero = 100e3) && !refused(|s| s.scales.pressure.at_zero = 99e3));
    assert!(refused(|s| s.scales.pressure.at_zero = 300e3), "all above zero");
    assert!(
        refused(|s| s.scales.pressure.at_zero = -1.2e6) && !refused(|s| s.scales.pressure.at_zero = -1.1e6)
    );
    assert!(refused(|s| s.scales.pressure.at_zero = -1.5e6), "all below zero");
    // Stroke and force may begin anywhere.
    assert!(!refused(|s| s.scales.stroke.at_zero = 0.5) && !refused(|s| s.scales.force.at_zero = 1e3));
    assert!(!refused(|s| s.scales.stroke.at_zero = 2.0) && !refused(|s| s.scales.force.at_zero = -1e4));
    // 20 kPa to 20 MPa, 1 mm to 10 m, 1 N to 1 MN.
    assert!(
        refused(|s| s.scales.pressure.per_unit = 0.0153) && !refused(|s| s.scales.pressure.per_unit = 0.0155)
    );
    assert!(
        refused(|s| s.scales.pressure.per_unit = 15.5) && !refused(|s| s.scales.pressure.per_unit = 15.3)
    );
    assert!(
        refused(|s| s.scales.stroke.per_unit = 6.6e-4) && !refused(|s| s.scales.stroke.per_unit = 6.8e-4)
    );
    assert!(refused(|s| s.scales.stroke.per_unit = 6.8) && !refused(|s| s.scales.stroke.per_unit = 6.6));
    assert!(refused(|s| s.scales.force.per_unit = 1.6e-4) && !refused(|s| s.scales.force.per_unit = 1.7e-4));
    assert!(refused(|s| s.scales.force.per_unit = 168.0) && !refused(|s| s.scales.force.per_unit = 166.0));
    are_the_ends(&[
        (Field::Scale, 0.0, 0.1, |s, v| s.scales.pressure.filter_s = v),
        (Field::Scale, 0.0, 0.1, |s, v| s.scales.stroke.filter_s = v),
        (Field::Scale, 0.0, 0.1, |s, v| s.scales.force.filter_s = v),
        (Field::Scale, 0.0, 0.1, |s, v| s.scales.second_pressure.filter_s = v),
        (Field::Scale, 0.0, 0.1, |s, v| s.scales.supply.filter_s = v),
    ]);
}

#[test]
fn the_scale_of_a_sensor_that_is_not_there_is_a_number_all_the_same() {
    type Change = fn(&mut Settings) -> &mut SensorScale;
    for one in [(|s| &mut s.scales.second_pressure) as Change, |s| &mut s.scales.supply] {
        type Spoil = fn(&mut SensorScale);
        let spoils: [Spoil; 4] = [
            |s| s.at_zero = f32::NAN,
            |s| s.per_unit = f32::INFINITY,
            |s| s.filter_s = 0.2,
            |s| s.filter_s = f32::NAN,
        ];
        for spoil in spoils {
            for hardware in [&BOARD, &Hardware::SIMULATED] {
                assert_eq!(found(hardware, |settings| spoil(one(settings))), Some(Field::Scale));
            }
        }
        let no_pressure = |settings: &mut Settings| one(settings).at_zero = 3e6;
        assert_eq!(found(&BOARD, no_pressure), Some(Field::Scale), "where it is there");
        assert_eq!(found(&Hardware::SIMULATED, no_pressure), None);
    }
}

#[test]
fn a_place_on_a_bus_needs_a_controller_an_address_and_a_common_bit_rate() {
    let with = Hardware { can: true, ..BOARD };
    for address in 0..=u8::MAX {
        let wrong = (address > 8).then_some(Field::Can);
        assert_eq!(found(&with, |s| s.can.address = address), wrong, "{address}");
    }
    assert_eq!(found(&BOARD, |s| s.can.address = 1), Some(Field::Can), "without a controller");
    let rates: std::vec::Vec<u16> =
        (0..=u16::MAX).filter(|rate| found(&with, |s| s.can.kbit_per_s = *rate).is_none()).collect();
    assert_eq!(rates, [125, 250, 500, 1000]);
}
