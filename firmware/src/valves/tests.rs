//! A pair of valves on a muscle of real air.

use std::vec::Vec;

use super::bench::{AIR_K, GAS_J_PER_MOL_K, Muscle, REST};
use super::*;

/// The pair and its muscle.
struct Bench {
    settings: Settings,
    pair: PairOfValves,
    muscle: Muscle,
}

impl Bench {
    fn new(change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = Settings::default();
        settings.valves.period_ticks = 10;
        change(&mut settings);
        Self { pair: PairOfValves::default(), muscle: Muscle::new(&settings.valves), settings }
    }

    /// One tick under a command; what the pair did.
    fn tick(&mut self, command: &Command) -> Valves {
        let muscle = &mut self.muscle;
        let widening_per_s = (muscle.widening / muscle.volume) as f32;
        let air = Air { fill: muscle.volume as f32, widening_per_s };
        let done = self.pair.step(command, muscle.pressure_pa() as f32, &air, Volume::Known, &self.settings);
        muscle.pass(done);
        done
    }

    /// Pressures of some ticks, Pa.
    fn hold(&mut self, pressure_pa: f32, ticks: u32) -> Vec<f64> {
        let command = Command { pressure_pa, vent: false };
        (0..ticks)
            .map(|_| {
                self.tick(&command);
                self.muscle.pressure_pa()
            })
            .collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_pressure_follows_a_step_with_the_lag_of_the_settings_up_and_down() {
    for (lag_s, ticks) in [(0.03, 10), (0.05, 10), (0.03, 5), (0.2, 20)] {
        let mut bench = Bench::new(|s| (s.regulator.lag_s, s.valves.period_ticks) = (lag_s, ticks));
        let lag_ticks = (lag_s * 1e3) as usize;
        for (from, to) in [(0.0, 80e3), (80e3, 200e3), (200e3, 300e3), (300e3, 240e3), (240e3, 200e3)] {
            let response = bench.hold(to, 10 * lag_ticks as u32);
            let gone = |at: usize| (response[at] - from) / f64::from(to - from as f32);
            // After one lag 1 − 1/e is gone, and no more than a period earlier or two later.
            let (early, late) = (lag_ticks - usize::from(ticks), lag_ticks + 2 * usize::from(ticks));
            assert!(
                gone(early) < 0.64 && gone(late) > 0.60,
                "lag {lag_s} s, {ticks} ticks, to {to}: {early}: {}, {late}: {}",
                gone(early),
                gone(late)
            );
            let rest = response.last().expect("ticks") - f64::from(to);
            assert!(rest.abs() < 2.5e3, "{rest} Pa from {to}, lag {lag_s} s, {ticks} ticks");
            let beyond = response.iter().map(|p| (p - f64::from(to)) * f64::from(to - from as f32).signum());
            assert!(beyond.fold(0.0, f64::max) < 3e3, "overshoot towards {to}, lag {lag_s} s, {ticks} ticks");
        }
    }
}

#[test]
fn the_two_valves_are_never_open_at_once_where_the_direction_changes() {
    let overlap = |apart_s: f32| {
        let mut bench = Bench::new(|s| s.valves.apart_s = apart_s);
        // The current through a coil with a diode ends slowly: such a valve closes later than the other one opens.
        bench.muscle.closes_s = 2.5e-3;
        for change in 0..40 {
            let pressure_pa = if change % 2 == 0 { 400e3 } else { 50e3 };
            bench.hold(pressure_pa, 17 + change);
        }
        assert!(bench.muscle.pulses.iter().all(|pulses| *pulses > 20), "{:?}", bench.muscle.pulses);
        bench.muscle.both_open
    };
    assert_eq!(overlap(2e-3), 0);
    assert!(overlap(0.0) > 0, "these valves take time to close");
}

#[test]
fn after_a_vent_the_vent_valve_has_time_to_close() {
    let mut bench = Bench::new(|_| ());
    for _ in 0..20 {
        bench.tick(&Command::VENT);
    }
    bench.hold(400e3, 100);
    assert_eq!(bench.muscle.both_open, 0);
}

#[test]
fn integrators_receive_what_the_valves_cannot_follow_and_in_which_direction() {
    let mut bench = Bench::new(|_| ());
    assert_eq!(bench.pair.limited_pa(), 0.0);
    bench.hold(600e3, 1);
    assert!((bench.pair.limited_pa() - 600e3).abs() < 1.0);
    bench.hold(600e3, 1_000);
    assert_eq!(bench.pair.limited_pa(), 0.0, "there");
    bench.hold(20e3, 11);
    assert!(bench.pair.limited_pa() < -100e3);
    bench.tick(&Command::VENT);
    assert_eq!(bench.pair.limited_pa(), 0.0, "vented");
}

#[test]
fn at_the_demanded_pressure_both_valves_rest() {
    let mut bench = Bench::new(|_| ());
    bench.hold(300e3, 1_000);
    bench.muscle.pulses = [0; 2];
    bench.hold(300e3, 1_000);
    assert_eq!(bench.muscle.pulses, [0; 2]);
}

/// A least pulse of 1 ms changes the pressure by 30 kPa here.
#[test]
fn valves_that_are_too_large_leave_an_error_and_do_not_oscillate() {
    let mut bench = Bench::new(|s| (s.valves.fill_pa_per_s, s.valves.vent_pa_per_s) = (30e6, 30e6));
    let response = bench.hold(300e3, 2_000);
    assert!(response[1_000..].iter().all(|p| (p - 300e3).abs() < 16e3), "{:?}", &response[1_990..]);
    bench.muscle.pulses = [0; 2];
    bench.hold(300e3, 1_000);
    assert_eq!(bench.muscle.pulses, [0; 2]);
}

#[test]
fn a_leak_is_met_by_pulses_that_no_valve_could_make_one_by_one() {
    let mut bench = Bench::new(|s| s.valves.band_pa = 0.0);
    // 300 kPa fall by 60 kPa/s: in a period as much as the fill valve lets in within 0.15 ms.
    bench.muscle.leak = 0.2 * REST / (GAS_J_PER_MOL_K * AIR_K);
    bench.hold(300e3, 1_000);
    bench.muscle.pulses = [0; 2];
    let response = bench.hold(300e3, 2_000);
    assert!((mean(&response) - 300e3).abs() < 3e3, "{}", mean(&response));
    let [fill, vent] = bench.muscle.pulses;
    assert!((20..150).contains(&fill) && vent == 0, "{fill} and {vent} pulses in 200 periods");
}

#[test]
fn a_muscle_that_widens_is_filled_and_one_that_narrows_is_vented() {
    for widening in [0.5, -0.5] {
        let mut bench = Bench::new(|_| ());
        bench.muscle.volume = 1.5;
        bench.hold(300e3, 1_000);
        bench.muscle.widening = widening;
        let response = bench.hold(300e3, 500);
        // Without regard to the volume, the pressure would be behind by (p + p_atm)·V̇/V·lag: 4 to 5 kPa.
        let off = mean(&response[200..]) - 300e3;
        assert!(off.abs() < 3e3, "{off} Pa at {widening}/s");
    }
}

#[test]
fn a_vent_acts_within_a_period_and_the_next_command_begins_one() {
    let mut bench = Bench::new(|_| ());
    let command = Command { pressure_pa: 400e3, vent: false };
    assert!(matches!(bench.tick(&command), Valves::Period { fill_us: 8_000, vent_us: 0, length_us: 10_000 }));
    assert_eq!(bench.tick(&command), Valves::Continue);
    assert_eq!(bench.tick(&Command::VENT), Valves::Vent);
    assert_eq!(bench.tick(&Command::VENT), Valves::Vent);
    for tick in 0..20 {
        let begins = matches!(bench.tick(&command), Valves::Period { .. });
        assert_eq!(begins, tick % 10 == 0, "tick {tick}");
    }
}

#[test]
fn in_the_test_of_the_dump_valve_both_are_closed() {
    let mut bench = Bench::new(|_| ());
    bench.hold(40e3, 500);
    assert_eq!(bench.tick(&Command { pressure_pa: 40e3, vent: true }), Valves::Closed);
}

#[test]
fn no_pressure_leaves_the_vent_valve_open_so_that_a_leaking_fill_valve_fills_nothing() {
    let mut bench = Bench::new(|_| ());
    let whole = Valves::Period { fill_us: 0, vent_us: 10_000, length_us: 10_000 };
    assert_eq!(bench.tick(&Command { pressure_pa: 0.0, vent: false }), whole);
    bench.muscle.leak = -1e-3 * REST;
    let response = bench.hold(0.0, 2_000);
    assert!(response[1_999] < 3e3, "{}", response[1_999]);
}

#[test]
fn a_reading_that_is_no_number_closes_both_and_no_command_vents() {
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let step = |pressure_pa: f32, air: Air| {
            let mut settings = Settings::default();
            settings.valves.period_ticks = 10;
            PairOfValves::default().step(
                &Command { pressure_pa, vent: false },
                wrong,
                &air,
                Volume::Known,
                &settings,
            )
        };
        let moving = Air { widening_per_s: -0.5, ..Air::default() };
        for air in [Air::default(), moving] {
            let closed = Valves::Period { fill_us: 0, vent_us: 0, length_us: 10_000 };
            assert_eq!(step(300e3, air), closed, "{wrong}");
            let vents = Valves::Period { fill_us: 0, vent_us: 10_000, length_us: 10_000 };
            for none in [0.0, -1.0, f32::NAN] {
                assert_eq!(step(none, air), vents, "{wrong}");
            }
        }
    }
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut bench = Bench::new(|_| ());
        bench.hold(300e3, 1_000);
        let air = Air { fill: wrong, widening_per_s: wrong };
        bench.pair.left = 0;
        let done = bench.pair.step(
            &Command { pressure_pa: 400e3, vent: false },
            300e3,
            &air,
            Volume::Known,
            &bench.settings,
        );
        assert_eq!(done, Valves::Period { fill_us: 0, vent_us: 0, length_us: 10_000 }, "air of {wrong}");
    }
}

#[test]
fn without_a_pair_there_is_nothing_to_do() {
    let mut bench = Bench::new(|s| s.valves.period_ticks = 0);
    assert_eq!(bench.tick(&Command { pressure_pa: 300e3, vent: false }), Valves::Absent);
    assert_eq!(bench.tick(&Command::VENT), Valves::Absent);
}

#[test]
fn the_flow_is_that_of_the_standard() {
    for (ratio, part) in [(0.0, 1.0), (0.3, 1.0), (0.65, 0.866_025_4), (1.0, 0.0), (1.2, 0.0)] {
        assert!((flow(ratio) - part).abs() < 1e-6, "{} at {ratio}", flow(ratio));
    }
}

/// Steps, ramps, waves, leaks and motions of a real muscle, whose valves and volume are not what the settings say: the pressure answers.
#[test]
fn a_muscle_that_answers_is_never_taken_for_one_that_does_not() {
    type Change = fn(&mut Settings, &mut Muscle);
    let changes: [(&str, Change); 8] = [
        ("as its settings say", |_, _| ()),
        ("four times as large", |_, m| m.volume = 4.0),
        ("a third as large", |_, m| m.volume = 0.33),
        ("slow fill valve", |s, _| s.valves.fill_pa_per_s *= 2.0),
        ("slow vent valve", |s, _| s.valves.vent_pa_per_s *= 2.0),
        ("long periods", |s, _| (s.valves.period_ticks, s.regulator.lag_s) = (50, 0.1)),
        ("short periods", |s, _| s.valves.period_ticks = 4),
        // 10 kPa/s at 300 kPa.
        ("a leak", |_, m| m.leak = 10e3 * REST / (GAS_J_PER_MOL_K * AIR_K * 300e3)),
    ];
    for (name, change) in changes {
        let mut bench = Bench::new(|_| ());
        change(&mut bench.settings, &mut bench.muscle);
        for tick in 0..20_000_u32 {
            let t = 1e-3 * tick as f32;
            let pressure_pa = match tick / 1_000 {
                0..4 => [300e3, 500e3, 150e3, 600e3][(tick / 1_000) as usize],
                4..8 => 300e3 + 3e3 * (50.0 * t).sin(),
                8..12 => 350e3 + 200e3 * (6.0 * t).sin(),
                12..16 => 100e3 + 100e3 * (t - 12.0),
                _ => 300e3,
            };
            // The air that the controller knows of is that of a muscle at rest.
            let noise = 300.0 * (tick as f32 * 12.9898).sin();
            let measured = bench.muscle.pressure_pa() as f32 + noise;
            let command = Command { pressure_pa, vent: false };
            let done =
                bench.pair.step(&command, measured, &Air::default(), Volume::Still(0.0), &bench.settings);
            bench.muscle.pass(done);
            assert_eq!(bench.pair.unanswered_pa(), None, "{name}, at {t} s");
        }
    }
}

/// A muscle that a machine stretches and releases once a second, up to twice its volume, at constant pressure.
#[test]
fn the_air_that_a_moving_muscle_takes_needs_no_answer() {
    for known in [true, false] {
        let mut bench = Bench::new(|s| (s.valves.fill_pa_per_s, s.valves.vent_pa_per_s) = (6e6, 6e6));
        // The valves give two thirds of what the settings say.
        (bench.settings.valves.fill_pa_per_s, bench.settings.valves.vent_pa_per_s) = (9e6, 9e6);
        for tick in 0..10_000_u32 {
            let t = 1e-3 * f64::from(tick);
            let swing = core::f64::consts::TAU * t;
            bench.muscle.volume = 1.5 - 0.5 * swing.cos();
            let widening = 0.5 * core::f64::consts::TAU * swing.sin() / bench.muscle.volume;
            let air = Air { fill: bench.muscle.volume as f32, widening_per_s: widening as f32 };
            let stroke_m = (1.5e-3 - 1.5e-3 * swing.cos()) as f32;
            let (air, volume) =
                if known { (air, Volume::Known) } else { (Air::default(), Volume::Still(stroke_m)) };
            let command = Command { pressure_pa: 300e3, vent: false };
            let done =
                bench.pair.step(&command, bench.muscle.pressure_pa() as f32, &air, volume, &bench.settings);
            bench.muscle.pass(done);
            assert_eq!(bench.pair.unanswered_pa(), None, "known: {known}, at {t} s");
        }
    }
}
