//! Values that no settings may have, and what replaces them.

use super::*;
use crate::board::Span;

const HARDWARE: &Hardware = &Hardware::SIMULATED;

fn refused(change: impl Fn(&mut Settings)) -> Option<Field> {
    let mut settings = Settings::DEFAULT;
    change(&mut settings);
    match check_settings(&settings, HARDWARE) {
        Err(Refusal::Value(field)) => Some(field),
        _ => None,
    }
}

#[test]
fn the_defaults_can_be_used_and_no_field_takes_what_is_no_number_or_has_no_bound() {
    assert_eq!(refused(|_| ()), None);
    type Set = fn(&mut Settings, f32);
    let fields: [(Field, Set); 54] = [
        (Field::ForceLoop, |s, v| s.force_loop.proportional_pa_per_n = v),
        (Field::ForceLoop, |s, v| s.force_loop.integral_pa_per_n_s = v),
        (Field::ForceLoop, |s, v| s.force_loop.trim_limit_pa = v),
        (Field::StrokeLoop, |s, v| s.stroke_loop.proportional_n_per_m = v),
        (Field::StrokeLoop, |s, v| s.stroke_loop.integral_n_per_m_s = v),
        (Field::StrokeLoop, |s, v| s.stroke_loop.damping_n_s_per_m = v),
        (Field::StrokeLoop, |s, v| s.stroke_loop.load_n = v),
        (Field::StrokeLoop, |s, v| s.stroke_loop.load_stiffness_n_per_m = v),
        (Field::StrokeLoop, |s, v| s.stroke_loop.force_limit_n = v),
        (Field::Joint, |s, v| s.joint.radius_m = v),
        (Field::Joint, |s, v| s.joint.rest_stroke_m = v),
        (Field::Joint, |s, v| s.joint.proportional_nm_per_rad = v),
        (Field::Joint, |s, v| s.joint.integral_nm_per_rad_s = v),
        (Field::Joint, |s, v| s.joint.damping_nm_s_per_rad = v),
        (Field::Joint, |s, v| s.joint.torque_limit_nm = v),
        (Field::Regulator, |s, v| s.regulator.gain = v),
        (Field::Regulator, |s, v| s.regulator.offset_pa = v),
        (Field::Regulator, |s, v| s.regulator.lag_s = v),
        (Field::Regulator, |s, v| s.regulator.line_s = v),
        (Field::Regulator, |s, v| s.regulator.rate_pa_per_s = v),
        (Field::Regulator, |s, v| s.regulator.deadband_pa = v),
        (Field::Regulator, |s, v| s.regulator.command_max_pa = v),
        (Field::Regulator, |s, v| s.regulator.lead = v),
        (Field::Limits, |s, v| s.limits.pressure_pa = v),
        (Field::Limits, |s, v| s.limits.stroke_min_m = v),
        (Field::Limits, |s, v| s.limits.stroke_max_m = v),
        (Field::Limits, |s, v| s.limits.speed_m_per_s = v),
        (Field::Limits, |s, v| s.limits.force_n = v),
        (Field::Limits, |s, v| s.limits.slew_pa_per_s = v),
        (Field::SensorWatch, |s, v| s.pressure.jump = v),
        (Field::SensorWatch, |s, v| s.stroke.low = v),
        (Field::SensorWatch, |s, v| s.force.jump = v),
        (Field::Watch, |s, v| s.watch.disagree_n = v),
        (Field::Watch, |s, v| s.watch.follow_pa = v),
        (Field::Watch, |s, v| s.watch.vented_pa = v),
        (Field::Watch, |s, v| s.watch.valve_test_pa = v),
        (Field::Bands, |s, v| s.motion_band_m = v),
        (Field::Bands, |s, v| s.pressure_band_pa = v),
        (Field::Scale, |s, v| s.scales.pressure.at_zero = v),
        (Field::Scale, |s, v| s.scales.pressure.per_unit = v),
        (Field::Scale, |s, v| s.scales.stroke.per_unit = v),
        (Field::Scale, |s, v| s.scales.force.filter_s = v),
        (Field::Scale, |s, v| s.scales.force.at_zero = v),
        (Field::Command, |s, v| s.command.low = v),
        (Field::Command, |s, v| s.command.full_pa = v),
        (Field::Watch, |s, v| s.watch.second_pressure_pa = v),
        (Field::Watch, |s, v| s.watch.supply_low_pa = v),
        (Field::Valves, |s, v| s.valves.supply_pa = v),
        (Field::Valves, |s, v| s.valves.fill_pa_per_s = v),
        (Field::Valves, |s, v| s.valves.vent_pa_per_s = v),
        (Field::Valves, |s, v| s.valves.dead_s = v),
        (Field::Valves, |s, v| s.valves.least_s = v),
        (Field::Valves, |s, v| s.valves.apart_s = v),
        (Field::Valves, |s, v| s.valves.band_pa = v),
    ];
    for (at, (field, set)) in fields.into_iter().enumerate() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3.4e38, 1e30, -1e30] {
            let found = refused(|settings| set(settings, value));
            // A stroke sensor's end that lies beyond the limits is refused there.
            let limits = found == Some(Field::Limits);
            assert!(found == Some(field) || limits, "field {at} takes {value}: {found:?}");
        }
    }
}

#[test]
fn no_message_may_make_a_watch_blind_or_wait_for_days() {
    type Change = fn(&mut Settings);
    let blind: [Change; 13] = [
        |s| s.watch.debounce_ticks = 65_535,
        |s| s.watch.debounce_ticks = 0,
        |s| s.watch.noisy_jumps = 65_535,
        |s| s.watch.disagree_ticks = 65_535,
        |s| s.watch.follow_ticks = 65_535,
        |s| s.watch.silence_ticks = u32::MAX,
        |s| s.watch.host_silence_ticks = u32::MAX,
        |s| s.watch.host_silence_ticks = 0,
        |s| s.watch.armed_silence_ticks = LEAST_ARMED - 1,
        |s| s.watch.armed_silence_ticks = MOST_ARMED + 1,
        |s| s.watch.overrun_ticks = 65_535,
        |s| s.watch.hold_ticks = u32::MAX,
        |s| s.watch.vent_ticks = u32::MAX,
    ];
    for (at, change) in blind.into_iter().enumerate() {
        assert_eq!(refused(change), Some(Field::Watch), "change {at}");
    }
    assert_eq!(refused(|s| s.force.stuck_ticks = 65_535), Some(Field::SensorWatch));
}

#[test]
fn a_watch_or_a_limit_where_the_board_cannot_read_is_refused() {
    let potentiometer = Hardware { stroke: Span { low: -0.003, high: 0.053 }, ..Hardware::SIMULATED };
    let cell = Hardware { force: Span { low: -1_100.0, high: 1_100.0 }, ..Hardware::SIMULATED };
    for narrow in [potentiometer, cell] {
        let refused = check_settings(&Settings::DEFAULT, &narrow);
        assert!(matches!(refused, Err(Refusal::Value(Field::Limits | Field::SensorWatch))), "{refused:?}");
    }
    assert_eq!(refused(|s| s.limits.force_n = 200e3), Some(Field::Limits));
    assert_eq!(refused(|s| s.limits.stroke_max_m = 5.0), Some(Field::Limits));
    assert_eq!(refused(|s| s.pressure.high = 20e6), Some(Field::SensorWatch));
}

#[test]
fn unusable_settings_are_replaced_group_by_group_and_the_rest_is_kept() {
    let mut settings = Settings::DEFAULT;
    settings.limits.pressure_pa = 250e3;
    settings.regulator.line_s = 1e30;
    settings.watch.debounce_ticks = 65_535;
    assert!(repair_settings(&mut settings, HARDWARE));
    assert_eq!(settings.limits.pressure_pa, 250e3);
    assert_eq!((settings.regulator, settings.watch), (Settings::DEFAULT.regulator, Settings::DEFAULT.watch));
    assert_eq!(check_settings(&settings, HARDWARE), Ok(()));
    assert!(!repair_settings(&mut settings, HARDWARE), "once");
}
