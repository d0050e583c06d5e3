//! What each watch notices, and how soon.

use super::*;

mod boundaries;
mod calm;
mod calm_limits;

fn good() -> Seen {
    Seen {
        readings: Some(Readings { pressure_pa: 200e3, stroke_m: 0.002, force_n: 40.0 }),
        second_pa: None,
        speed_m_per_s: 0.0,
        command: Command { pressure_pa: 200e3, vent: false },
        expected_pa: 200e3,
        model_n: Some(41.0),
        most_above_n: 0.0,
    }
}

/// Ticks until the first finding of a stream of ticks.
fn first(ticks: impl IntoIterator<Item = Seen>, settings: &Settings) -> Option<(usize, Finding)> {
    let mut watch = SideWatch::default();
    ticks.into_iter().enumerate().find_map(|(at, seen)| {
        let mut first = None;
        watch.check(&seen, settings, &mut |finding| first = first.or(Some(finding)));
        first.map(|finding| (at + 1, finding))
    })
}

fn with(change: impl Fn(&mut Seen, &mut Readings, usize)) -> impl Iterator<Item = Seen> {
    (0..5000).map(move |tick| {
        let mut seen = good();
        // A live sensor never reads the same twice.
        let mut readings = seen.readings.unwrap_or_default();
        let wiggle = (tick % 7) as f32 - 3.0;
        readings.pressure_pa += wiggle;
        readings.force_n += 1e-3 * wiggle;
        seen.readings = Some(readings);
        if tick >= 100 {
            change(&mut seen, &mut readings, tick - 100);
            if seen.readings.is_some() {
                seen.readings = Some(readings);
            }
        }
        seen
    })
}

#[test]
fn a_healthy_muscle_gives_no_finding() {
    let mut settings = Settings::default();
    settings.watch.disagree_n = 10.0;
    assert_eq!(first(with(|_, _, _| ()), &settings), None);
}

#[test]
fn a_broken_load_cell_wire_is_noticed_within_two_ticks() {
    let broken = with(|_, readings, _| readings.force_n = -1e6);
    let (ticks, finding) = first(broken, &Settings::default()).expect("noticed");
    assert!(ticks <= 102);
    assert_eq!((finding.fault, finding.sensor), (Fault::SensorRange, Some(Sensor::Force)));
    let nan = with(|_, readings, _| readings.stroke_m = f32::NAN);
    assert_eq!(first(nan, &Settings::default()).map(|(_, f)| f.sensor), Some(Some(Sensor::Stroke)));
}

#[test]
fn each_limit_has_its_fault() {
    type Change = fn(&mut Seen, &mut Readings, usize);
    let cases: [(Fault, usize, Change); 9] = [
        (Fault::OverPressure, 2, |_, r, _| r.pressure_pa = 710e3),
        (Fault::OverStroke, 2, |_, r, _| r.stroke_m = 0.1),
        (Fault::OverSpeed, 2, |s, _, _| s.speed_m_per_s = -3.0),
        (Fault::OverForce, 2, |_, r, _| r.force_n = 3_500.0),
        (Fault::SensorsSilent, 2, |s, _, _| s.readings = None),
        (Fault::PressureNotRising, 200, |s, _, _| s.expected_pa = 400e3),
        (Fault::PressureNotFalling, 200, |s, _, _| s.expected_pa = 20e3),
        (Fault::SensorNoisy, 20, |_, r, t| r.pressure_pa = if t % 2 == 0 { 0.0 } else { 400e3 }),
        (Fault::SensorStuck, 260, |s, r, t| {
            r.pressure_pa = 200e3;
            s.command.pressure_pa = 200e3 + 1e3 * t as f32;
        }),
    ];
    for (fault, within, change) in cases {
        let (ticks, finding) = first(with(change), &Settings::default()).expect("noticed");
        assert_eq!(finding.fault, fault);
        assert!(ticks <= 100 + within, "{fault:?} after {ticks}");
    }
}

/// A cell whose contact loosens for a tick, from `first` on n times, n ticks apart: two jumps each.
fn loose(first: usize, times: usize, apart: usize) -> Option<usize> {
    let spikes = with(move |_, readings, tick| {
        let since = tick.wrapping_sub(first);
        if since < times * apart && since.is_multiple_of(apart) {
            readings.force_n += 2_000.0;
        }
    });
    let mut settings = Settings::default();
    settings.force.jump = 1_000.0;
    settings.limits.force_n = 1e9;
    first_noisy(spikes, &settings)
}

fn first_noisy(ticks: impl IntoIterator<Item = Seen>, settings: &Settings) -> Option<usize> {
    let (at, finding) = first(ticks, settings)?;
    assert_eq!((finding.fault, finding.sensor), (Fault::SensorNoisy, Some(Sensor::Force)));
    Some(at - 101)
}

#[test]
fn a_loose_contact_is_noticed_at_its_eighth_jump_whenever_it_begins() {
    for begin in 0..130 {
        // The eighth jump is the return from the fourth time.
        for apart in [2, 7, 40, 84] {
            assert_eq!(loose(begin, 4, apart), Some(begin + 3 * apart + 1), "from {begin}, {apart} apart");
        }
        assert_eq!(loose(begin, 3, 2), None, "six jumps are forgiven");
        assert_eq!(loose(begin, 30, 107), None, "and so are those that lie further apart than 320 ticks");
    }
}

#[test]
fn table_and_load_cell_may_not_contradict_each_other_for_long() {
    let mut settings = Settings::default();
    settings.watch.disagree_n = 10.0;
    let apart = with(|seen, _, _| seen.model_n = Some(70.0));
    let (ticks, finding) = first(apart, &settings).expect("noticed");
    assert_eq!(finding.fault, Fault::SensorsDisagree);
    assert!((290..=301).contains(&ticks), "{ticks}");
}

#[test]
fn a_single_bad_tick_is_forgiven() {
    let spike = with(|_, readings, tick| {
        if tick % 50 == 0 {
            readings.force_n = 5_000.0;
        }
    });
    let mut settings = Settings::default();
    settings.force.jump = 1e9;
    assert_eq!(first(spike, &settings), None);
}

#[test]
fn a_sensor_that_is_not_fitted_is_not_watched() {
    let mut settings = Settings::default();
    settings.force.fitted = false;
    assert_eq!(first(with(|_, readings, _| readings.force_n = f32::NAN), &settings), None);
}
