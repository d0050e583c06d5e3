//! What is at a limit is not beyond it, each finding states the limit that it crossed, and no watch counts a tick too many.

use super::*;

/// Every finding of a stream of ticks, with the number of its tick from 1 on.
fn all(ticks: impl IntoIterator<Item = Seen>, settings: &Settings) -> Vec<(u32, Finding)> {
    let mut watch = SideWatch::default();
    let mut found = Vec::new();
    for (tick, seen) in (1..).zip(ticks) {
        watch.check(&seen, settings, &mut |finding| found.push((tick, finding)));
    }
    found
}

/// Readings that never change, at a pressure that the regulator expects.
fn still(pressure_pa: f32, stroke_m: f32, force_n: f32) -> Seen {
    Seen {
        readings: Some(Readings { pressure_pa, stroke_m, force_n }),
        speed_m_per_s: 0.0,
        command: Command { pressure_pa: 200e3, vent: false },
        expected_pa: pressure_pa,
        model_n: None,
        second_pa: None,
        most_above_n: 0.0,
    }
}

fn repeated(seen: Seen, settings: &Settings, fault: Fault) -> Option<(u32, Finding)> {
    all([seen; 400], settings).into_iter().find(|(_, finding)| finding.fault == fault)
}

/// Sensors that read anything, so that only the limits judge.
fn wide() -> Settings {
    let mut settings = Settings::default();
    for sensor in [&mut settings.pressure, &mut settings.stroke, &mut settings.force] {
        (sensor.low, sensor.high, sensor.jump, sensor.stuck_ticks) = (-1e9, 1e9, 1e9, 0);
    }
    settings
}

#[test]
fn a_value_at_a_limit_is_not_beyond_it() {
    let settings = wide();
    let limits = settings.limits;
    let speed = |speed_m_per_s| Seen { speed_m_per_s, ..still(200e3, 0.0, 0.0) };
    type Case<'a> = (Fault, &'a dyn Fn(f32) -> Seen, f32, f32);
    let cases: [Case<'_>; 6] = [
        (Fault::OverPressure, &|v| still(v, 0.0, 0.0), limits.pressure_pa, limits.pressure_pa.next_up()),
        (Fault::OverForce, &|v| still(200e3, 0.0, v), limits.force_n, limits.force_n.next_up()),
        (Fault::OverStroke, &|v| still(200e3, v, 0.0), limits.stroke_max_m, limits.stroke_max_m.next_up()),
        (Fault::OverStroke, &|v| still(200e3, v, 0.0), limits.stroke_min_m, limits.stroke_min_m.next_down()),
        (Fault::OverSpeed, &speed, limits.speed_m_per_s, limits.speed_m_per_s.next_up()),
        (Fault::OverSpeed, &speed, -limits.speed_m_per_s, -limits.speed_m_per_s.next_up()),
    ];
    for (fault, seen, at, beyond) in cases {
        assert_eq!(all([seen(at); 400], &settings), [], "{fault:?} at {at}");
        let (tick, finding) = repeated(seen(beyond), &settings, fault).expect("found");
        assert_eq!((tick, finding.value, finding.limit.abs()), (2, beyond, at.abs()), "{fault:?}");
        assert!(fault == Fault::OverSpeed || finding.limit == at, "{fault:?} states the other limit");
    }
}

#[test]
fn a_reading_at_the_end_of_its_range_is_within_and_a_finding_states_the_end_that_was_passed() {
    let mut settings = wide();
    (settings.limits.pressure_pa, settings.limits.force_n) = (1e9, 1e9);
    (settings.limits.stroke_min_m, settings.limits.stroke_max_m) = (-1e9, 1e9);
    for sensor in [Sensor::Pressure, Sensor::Stroke, Sensor::Force] {
        let mut settings = settings;
        let (watch, seen): (&mut SensorWatch, fn(f32) -> Seen) = match sensor {
            Sensor::Pressure => (&mut settings.pressure, |v| still(v, 0.0, 0.0)),
            Sensor::Stroke => (&mut settings.stroke, |v| still(0.0, v, 0.0)),
            Sensor::Force => (&mut settings.force, |v| still(0.0, 0.0, v)),
        };
        (watch.low, watch.high) = (-3.0, 5.0);
        for (end, beyond) in [(-3.0, -3.5), (5.0, 5.5)] {
            assert_eq!(all([seen(end); 400], &settings), [], "{sensor:?} at {end}");
            let (tick, finding) = repeated(seen(beyond), &settings, Fault::SensorRange).expect("found");
            assert_eq!((tick, finding.sensor, finding.limit), (2, Some(sensor), end));
        }
    }
}

#[test]
fn a_change_as_large_as_the_bound_is_no_jump() {
    let mut settings = wide();
    settings.force.jump = 100.0;
    let alternating =
        |change: f32| (0..40).map(move |tick| still(200e3, 0.0, if tick % 2 == 0 { 0.0 } else { change }));
    assert_eq!(all(alternating(100.0), &settings), []);
    let (tick, finding) = all(alternating(100.5), &settings)[0];
    // The first reading is not a jump.
    assert_eq!(
        (tick, finding.fault, finding.limit),
        (u32::from(settings.watch.noisy_jumps) + 1, Fault::SensorNoisy, 100.0)
    );
}

/// A reading that stays the same while the command goes from `before` to `after` in tick 51.
fn stuck(before: f32, after: f32, stuck_ticks: u16) -> Option<u32> {
    let mut settings = wide();
    settings.pressure.stuck_ticks = stuck_ticks;
    let ticks = (1..=400).map(|tick| Seen {
        command: Command { pressure_pa: if tick <= 50 { before } else { after }, vent: false },
        ..still(200e3, 0.0, 0.0)
    });
    let (tick, finding) = all(ticks, &settings).into_iter().next()?;
    assert_eq!((finding.fault, finding.sensor), (Fault::SensorStuck, Some(Sensor::Pressure)));
    Some(tick)
}

#[test]
fn a_sensor_is_stuck_where_it_stays_the_same_while_the_command_moves_by_more_than_20_kpa() {
    assert_eq!(stuck(200e3, 200e3, 100), None, "nothing moves");
    assert_eq!(stuck(200e3, 220e3, 100), None, "as much as the bound");
    assert_eq!(stuck(200e3, 220.5e3, 100), Some(150));
    assert_eq!(stuck(200e3, 179.5e3, 100), Some(150), "downwards, too");
    assert_eq!(stuck(200e3, 300e3, 1), Some(51));
    assert_eq!(stuck(200e3, 300e3, 0), None, "a watch that is off");
}

#[test]
fn pressure_follows_within_its_band_and_a_finding_states_the_end_of_the_band() {
    let settings = wide();
    let (follow, ticks) = (settings.watch.follow_pa, u32::from(settings.watch.follow_ticks));
    let expected = 200e3;
    let at = |pressure_pa: f32| Seen { expected_pa: expected, ..still(pressure_pa, 0.0, 0.0) };
    for (fault, end, beyond) in [
        (Fault::PressureNotFalling, expected + follow, expected + follow + 1.0),
        (Fault::PressureNotRising, expected - follow, expected - follow - 1.0),
    ] {
        assert_eq!(all([at(end); 400], &settings), [], "{fault:?}");
        let (tick, finding) = repeated(at(beyond), &settings, fault).expect("found");
        assert_eq!((tick, finding.value, finding.limit), (ticks, beyond, end));
    }
}

#[test]
fn a_muscle_is_not_vented_from_the_tick_after_its_time_on() {
    let settings = wide();
    let (time, vented) = (settings.watch.vent_ticks, settings.watch.vented_pa);
    let seen = |pressure_pa: f32| Seen { command: Command::VENT, ..still(pressure_pa, 0.0, 0.0) };
    let ticks = time as usize + 10;
    assert_eq!(all(vec![seen(vented); ticks], &settings), []);
    let (tick, finding) = all(vec![seen(vented + 1.0); ticks], &settings)[0];
    assert_eq!(
        (tick, finding.fault, finding.limit),
        (time + 2, Fault::NotVented, vented),
        "two ticks beyond the time"
    );
    // A command in between restarts the time.
    let mut interrupted = vec![seen(vented + 1.0); ticks];
    interrupted[time as usize - 5].command.vent = false;
    assert_eq!(all(interrupted, &settings), []);
}

#[test]
fn a_vented_muscle_that_is_stretched_has_its_time_to_vent_again() {
    let settings = wide();
    let (time, vented) = (settings.watch.vent_ticks, settings.watch.vented_pa);
    let seen = |pressure_pa: f32| Seen { command: Command::VENT, ..still(pressure_pa, 0.0, 0.0) };
    let ticks = time as usize;
    let after = |low: f32, high: usize| {
        let rest = vec![seen(0.0); ticks + 10];
        all([rest, vec![seen(low); 10], vec![seen(vented + 1.0); high]].concat(), &settings)
    };
    assert_eq!(after(0.0, ticks + 1), [], "a rise that is over in time");
    let begun = time + 20;
    for low in [0.0, 0.5 * vented] {
        let (tick, finding) = after(low, ticks + 2)[0];
        assert_eq!(
            (tick, finding.fault),
            (begun + time + 2, Fault::NotVented),
            "a rise that stays, from {low}"
        );
    }
    // Noise about the limit gives no new time.
    let noisy: Vec<Seen> =
        (0..2 * ticks).map(|tick| seen(if tick % 4 == 0 { 0.6 * vented } else { vented + 1.0 })).collect();
    assert!(all(noisy, &settings)[0].0 <= time + 4);
}

#[test]
fn a_restart_forgets_what_was_counted_but_not_how_long_the_muscle_has_been_vented() {
    let settings = wide();
    let over = still(settings.limits.pressure_pa + 1.0, 0.0, 0.0);
    let mut watch = SideWatch::default();
    let mut found = Vec::new();
    watch.check(&over, &settings, &mut |finding| found.push(finding));
    watch.restart();
    watch.check(&over, &settings, &mut |finding| found.push(finding));
    assert_eq!(found, [], "two ticks in a row, with a restart between them");
    watch.check(&over, &settings, &mut |finding| found.push(finding));
    assert_eq!(found.len(), 1);

    let full = Seen { command: Command::VENT, ..still(settings.watch.vented_pa + 1.0, 0.0, 0.0) };
    let mut watch = SideWatch::default();
    let mut found = Vec::new();
    for _ in 0..settings.watch.vent_ticks {
        watch.check(&full, &settings, &mut |finding| found.push(finding));
    }
    watch.restart();
    for _ in 0..2 {
        watch.check(&full, &settings, &mut |finding| found.push(finding));
    }
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].fault, Fault::NotVented);
}

#[test]
fn table_and_load_cell_may_differ_by_the_bound() {
    let mut settings = wide();
    settings.watch.disagree_n = 10.0;
    let apart = |by: f32| Seen { model_n: Some(40.0 + by), ..still(200e3, 0.0, 40.0) };
    assert_eq!(all([apart(10.0); 400], &settings), []);
    let (tick, finding) = repeated(apart(-10.5), &settings, Fault::SensorsDisagree).expect("found");
    let ticks = u32::from(settings.watch.disagree_ticks);
    assert_eq!((tick, finding.value, finding.limit), (ticks, 10.5, 10.0));
    settings.watch.disagree_n = 0.0;
    assert_eq!(all([apart(100.0); 400], &settings), [], "a watch that is off");
}

#[test]
fn one_good_tick_restarts_every_count() {
    let mut settings = wide();
    settings.watch.follow_ticks = 3;
    settings.watch.debounce_ticks = 3;
    let limits = settings.limits;
    let follow = settings.watch.follow_pa;
    let apart = |miss: f32| Seen { expected_pa: 200e3, ..still(200e3 + miss, 0.0, 0.0) };
    let full = Seen { command: Command::VENT, ..still(settings.watch.vented_pa + 1.0, 0.0, 0.0) };
    // At the limit: no pressure from which the time would restart.
    let empty = Seen { command: Command::VENT, ..still(settings.watch.vented_pa, 0.0, 0.0) };
    let good = still(200e3, 0.0, 0.0);
    let cases = [
        (Fault::OverPressure, still(limits.pressure_pa + 1.0, 0.0, 0.0), good),
        (Fault::OverForce, still(200e3, 0.0, limits.force_n + 1.0), good),
        (Fault::OverStroke, still(200e3, limits.stroke_max_m + 1.0, 0.0), good),
        (Fault::OverSpeed, Seen { speed_m_per_s: limits.speed_m_per_s + 1.0, ..good }, good),
        (Fault::PressureNotFalling, apart(follow + 1.0), apart(0.0)),
        (Fault::PressureNotRising, apart(-follow - 1.0), apart(0.0)),
        (Fault::NotVented, full, empty),
    ];
    for (fault, bad, good) in cases {
        // As long as a muscle takes to vent.
        let before = vec![good; settings.watch.vent_ticks as usize + 2];
        let ticks = |pattern: &[Seen]| [before.clone(), pattern.repeat(20)].concat();
        assert_eq!(all(ticks(&[bad, bad, good]), &settings), [], "{fault:?}");
        let found = all(ticks(&[bad, bad, bad, good]), &settings);
        assert_eq!(found.len(), 20, "{fault:?}: {:?}", found.first());
        assert!(found.iter().all(|(_, finding)| finding.fault == fault), "{fault:?}");
    }
}

#[test]
fn the_higher_of_two_pressure_sensors_is_judged_while_both_are_watched() {
    let mut settings = wide();
    let limit = settings.limits.pressure_pa;
    let both = |first: f32, second: f32| Seen { second_pa: Some(second), ..still(first, 0.0, 0.0) };
    // Apart by so much that their own watch says nothing.
    for (watched_pa, first, second, judged) in [
        (1e6, limit + 1.0, 0.0, Some(limit + 1.0)),
        (1e6, 0.0, limit + 1.0, Some(limit + 1.0)),
        (1e6, limit, limit, None),
        (0.0, 0.0, limit + 1.0, None),
        (0.0, limit + 1.0, 0.0, Some(limit + 1.0)),
    ] {
        settings.watch.second_pressure_pa = watched_pa;
        let found = repeated(both(first, second), &settings, Fault::OverPressure);
        let value = found.map(|(tick, finding)| (tick, finding.value));
        assert_eq!(value, judged.map(|value| (2, value)), "{first} and {second}");
    }
}

#[test]
fn two_watches_with_equal_counts_are_both_reported_and_both_restart_in_a_good_tick() {
    let settings = wide();
    let limits = settings.limits;
    let good = still(200e3, 0.0, 0.0);
    let over: [fn(&mut Seen, &mut Readings, &Settings); 4] = [
        |_, now, settings| now.pressure_pa = settings.limits.pressure_pa + 1.0,
        |_, now, settings| now.force_n = settings.limits.force_n + 1.0,
        |_, now, settings| now.stroke_m = settings.limits.stroke_max_m + 1.0,
        |seen, _, settings| seen.speed_m_per_s = settings.limits.speed_m_per_s + 1.0,
    ];
    for (at, first) in over.iter().enumerate() {
        for second in &over[at + 1..] {
            let (mut bad, mut now) = (good, good.readings.unwrap_or_default());
            first(&mut bad, &mut now, &settings);
            second(&mut bad, &mut now, &settings);
            (bad.readings, bad.expected_pa) = (Some(now), now.pressure_pa);
            assert_eq!(all([bad, good].repeat(20), &settings), [], "{bad:?} beyond {limits:?}");
            let found = all([bad, bad, good], &settings);
            assert_eq!(found.len(), 2, "both are reported: {found:?}");
        }
    }
    // Pressure in a vented muscle is more than the regulator's model says, too.
    let empty = Seen { command: Command::VENT, ..still(settings.watch.vented_pa, 0.0, 0.0) };
    let full = Seen { expected_pa: 0.0, command: Command::VENT, ..still(300e3, 0.0, 0.0) };
    assert!(300e3 > settings.watch.vented_pa && 300e3 > settings.watch.follow_pa);
    let before = vec![empty; settings.watch.vent_ticks as usize + 2];
    assert_eq!(all([&before[..], &[full, empty].repeat(20)].concat(), &settings), []);
    let found = all([&before[..], &[full; 300]].concat(), &settings);
    for (fault, enough) in [
        (Fault::NotVented, settings.watch.debounce_ticks),
        (Fault::PressureNotFalling, settings.watch.follow_ticks),
    ] {
        let first = found.iter().find(|(_, finding)| finding.fault == fault).map(|(tick, _)| *tick);
        assert_eq!(first, Some(settings.watch.vent_ticks + 2 + u32::from(enough)), "{fault:?}");
    }
}
