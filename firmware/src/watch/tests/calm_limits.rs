//! What is at a limit is calm as long as nothing is counted: only then does the controller save the time of a look at everything.

use super::*;

/// Whether a changed tick after a good one is let pass, where the settings are changed, too.
fn passes(set: impl Fn(&mut Settings), change: impl Fn(&mut Seen, &mut Readings, &Settings)) -> bool {
    let mut settings = Settings::default();
    for sensor in [&mut settings.pressure, &mut settings.stroke, &mut settings.force] {
        (sensor.low, sensor.high, sensor.jump) = (-1e9, 1e9, 1e9);
    }
    set(&mut settings);
    let mut watch = SideWatch::default();
    let mut seen = good();
    seen.model_n = seen.readings.map(|now| now.force_n);
    let mut found = Vec::new();
    watch.check(&seen, &settings, &mut |finding| found.push(finding));
    let mut now = seen.readings.unwrap_or_default();
    change(&mut seen, &mut now, &settings);
    seen.readings = seen.readings.map(|_| now);
    let calm = watch.pass(&seen, &settings);
    if calm {
        watch.check(&seen, &settings, &mut |finding| found.push(finding));
    }
    assert_eq!(found, []);
    calm
}

type Set = fn(&mut Settings);
type Change = fn(&mut Seen, &mut Readings, &Settings);

#[test]
fn a_tick_at_each_limit_is_calm_and_one_beyond_it_is_not() {
    let none: Set = |_| ();
    let cases: [(Set, Change, Change); 14] = [
        (none, |_, _, _| (), |seen, _, _| seen.readings = None),
        (
            none,
            |seen, _, s| seen.speed_m_per_s = s.limits.speed_m_per_s,
            |seen, _, _| seen.command.vent = true,
        ),
        (|s| s.watch.second_pressure_pa = 0.0, |_, _, _| (), |_, now, _| now.stroke_m = f32::NAN),
        (
            none,
            |_, now, s| now.force_n = s.limits.force_n,
            |_, now, s| now.force_n = s.limits.force_n.next_up(),
        ),
        (
            none,
            |_, now, s| now.stroke_m = s.limits.stroke_min_m,
            |_, now, s| now.stroke_m = s.limits.stroke_min_m.next_down(),
        ),
        (
            none,
            |_, now, s| now.stroke_m = s.limits.stroke_max_m,
            |_, now, s| now.stroke_m = s.limits.stroke_max_m.next_up(),
        ),
        (
            none,
            |seen, _, s| seen.speed_m_per_s = -s.limits.speed_m_per_s,
            |seen, _, s| seen.speed_m_per_s = -s.limits.speed_m_per_s.next_up(),
        ),
        (
            |s| s.watch.follow_pa = 1e9,
            |_, now, s| now.pressure_pa = s.limits.pressure_pa,
            |_, now, s| now.pressure_pa = s.limits.pressure_pa.next_up(),
        ),
        (
            none,
            |seen, _, s| seen.expected_pa += s.watch.follow_pa,
            |seen, _, s| seen.expected_pa += s.watch.follow_pa + 1.0,
        ),
        (
            none,
            |seen, _, s| seen.expected_pa -= s.watch.follow_pa,
            |seen, _, s| seen.expected_pa -= s.watch.follow_pa + 1.0,
        ),
        (|s| s.force.high = 50.0, |_, now, _| now.force_n = 50.0, |_, now, _| now.force_n = 51.0),
        (|s| s.force.low = 30.0, |_, now, _| now.force_n = 30.0, |_, now, _| now.force_n = 29.0),
        (|s| s.force.jump = 5.0, |_, now, _| now.force_n += 5.0, |_, now, _| now.force_n += 5.5),
        (
            |s| s.watch.disagree_n = 5.0,
            |seen, now, _| seen.model_n = Some(now.force_n - 5.0),
            |seen, now, _| seen.model_n = Some(now.force_n - 5.5),
        ),
    ];
    for (at, (set, within, beyond)) in cases.into_iter().enumerate() {
        assert!(passes(set, within), "within, case {at}");
        assert!(!passes(set, beyond), "beyond, case {at}");
    }
    // Two sensors have a watch of their own, whatever they read.
    assert!(!passes(
        |s| s.watch.second_pressure_pa = 1e3,
        |seen, now, _| seen.second_pa = Some(now.pressure_pa)
    ));
    // Without a bound or without a table nothing is compared.
    assert!(passes(|s| s.watch.disagree_n = 0.0, |seen, _, _| seen.model_n = Some(1e6)));
    assert!(passes(|s| s.watch.disagree_n = 5.0, |seen, _, _| seen.model_n = None));
}

#[test]
fn a_reading_may_stay_where_the_command_stays_and_the_command_may_move_where_the_reading_moves() {
    let moved = |by_pa: f32, live: f32| {
        passes(
            |_| (),
            |seen, now, _| {
                seen.command.pressure_pa += by_pa;
                (now.pressure_pa, now.stroke_m, now.force_n) =
                    (now.pressure_pa + 1e3 * live, now.stroke_m + 1e-5 * live, now.force_n + 0.1 * live);
            },
        )
    };
    assert!(moved(0.0, 0.0) && moved(20e3, 0.0) && moved(-20e3, 0.0));
    assert!(!moved(20.5e3, 0.0) && !moved(-20.5e3, 0.0));
    assert!(moved(100e3, 1.0) && moved(-100e3, -1.0));
}

#[test]
fn a_sensor_that_is_not_fitted_does_not_end_the_calm() {
    let cases: [(Set, Change); 3] = [
        (|s| s.pressure.fitted = false, |seen, now, _| (now.pressure_pa, seen.expected_pa) = (f32::NAN, 1e9)),
        (|s| s.stroke.fitted = false, |seen, now, _| (now.stroke_m, seen.speed_m_per_s) = (f32::NAN, 1e9)),
        (|s| s.force.fitted = false, |seen, now, _| (now.force_n, seen.model_n) = (f32::NAN, Some(1e9))),
    ];
    for (set, change) in cases {
        assert!(passes(set, change));
        assert!(!passes(|_| (), change));
    }
}
