//! A pair of valves on a muscle of real air: amounts of gas through orifices, valves that open late, a volume that changes.

use std::vec::Vec;

use super::*;

const GAS_J_PER_MOL_K: f64 = 8.314;
const AIR_K: f64 = 293.15;
const ATMOSPHERE: f64 = 101_325.0;
/// Volume at rest length, m³.
const REST: f64 = 20e-6;
/// Step of the physics, s.
const STEP_S: f64 = 20e-6;

/// A valve that is open from some time after its signal on until some time after the signal's end.
#[derive(Clone, Copy, Default)]
struct Valve {
    /// Amount through it at 1 Pa before it, mol/(s·Pa), choked.
    conductance: f64,
    on_s: f64,
    off_s: f64,
    open: bool,
}

impl Valve {
    /// One step of the physics under its signal, from a pressure to another: mol.
    fn through(&mut self, on: bool, dead_s: f64, before: f64, behind: f64) -> f64 {
        if on {
            (self.on_s, self.off_s) = (self.on_s + STEP_S, 0.0);
        } else {
            (self.on_s, self.off_s) = (0.0, self.off_s + STEP_S);
        }
        // Closes at once, opens later: the dead time is the difference.
        self.open = on && self.on_s > dead_s;
        if !self.open || behind >= before {
            return 0.0;
        }
        let past = ((behind / before - 0.3) / 0.7).max(0.0);
        self.conductance * before * (1.0 - past * past).sqrt() * STEP_S
    }
}

/// A muscle between the two valves.
struct Bench {
    settings: Settings,
    pair: PairOfValves,
    fill: Valve,
    vent: Valve,
    /// Amount of gas, mol.
    gas: f64,
    /// Volume as a part of that at rest, and its change, 1/s.
    volume: f64,
    widening: f64,
    /// Leak, mol/(s·Pa).
    leak: f64,
    signal: (u32, u32, u32),
    since_us: u32,
    /// Pulses of each valve that were ordered.
    pulses: [u32; 2],
}

impl Bench {
    fn new(change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = Settings::default();
        settings.valves.period_ticks = 10;
        change(&mut settings);
        // Conductances by which the rates are those of the settings: `V dp/dt = RT dn/dt`.
        let supply = f64::from(settings.valves.supply_pa) + ATMOSPHERE;
        let by_rate = |rate: f32| f64::from(rate) * REST / (GAS_J_PER_MOL_K * AIR_K * supply);
        let valve = |rate| Valve { conductance: by_rate(rate), ..Valve::default() };
        Self {
            pair: PairOfValves::default(),
            fill: valve(settings.valves.fill_pa_per_s),
            vent: valve(settings.valves.vent_pa_per_s),
            settings,
            gas: ATMOSPHERE * REST / (GAS_J_PER_MOL_K * AIR_K),
            volume: 1.0,
            widening: 0.0,
            leak: 0.0,
            signal: (0, 0, 1),
            since_us: 0,
            pulses: [0; 2],
        }
    }

    fn pressure_pa(&self) -> f64 {
        self.gas * GAS_J_PER_MOL_K * AIR_K / (REST * self.volume) - ATMOSPHERE
    }

    /// One tick under a command; what the pair did.
    fn tick(&mut self, command: &Command) -> Valves {
        let air = Air { fill: self.volume as f32, widening_per_s: (self.widening / self.volume) as f32 };
        let done = self.pair.step(command, self.pressure_pa() as f32, &air, &self.settings);
        match done {
            Valves::Period { fill_us, vent_us, length_us } => {
                assert!(fill_us == 0 || vent_us == 0, "never both");
                self.signal = (fill_us.into(), vent_us.into(), length_us.into());
                self.since_us = 0;
                self.pulses[0] += u32::from(fill_us > 0);
                self.pulses[1] += u32::from(vent_us > 0);
            }
            Valves::Continue => {}
            Valves::Vent => (self.signal, self.since_us) = ((0, 1_000, 1_000), 0),
            Valves::Closed | Valves::Absent => (self.signal, self.since_us) = ((0, 0, 1_000), 0),
        }
        let dead_s = f64::from(self.settings.valves.dead_s);
        let supply = f64::from(self.settings.valves.supply_pa) + ATMOSPHERE;
        for _ in 0..(1e-3 / STEP_S) as u32 {
            let (fill_us, vent_us, length_us) = self.signal;
            let in_pulse = |time_us: u32| self.since_us >= length_us - time_us && self.since_us < length_us;
            let inside = self.pressure_pa() + ATMOSPHERE;
            self.gas += self.fill.through(in_pulse(fill_us), dead_s, supply, inside);
            self.gas -= self.vent.through(in_pulse(vent_us), dead_s, inside, ATMOSPHERE);
            self.gas -= self.leak * (inside - ATMOSPHERE) * STEP_S;
            self.volume += self.widening * STEP_S;
            self.since_us += (STEP_S * 1e6) as u32;
        }
        done
    }

    /// Pressures of some ticks, Pa.
    fn hold(&mut self, pressure_pa: f32, ticks: u32) -> Vec<f64> {
        let command = Command { pressure_pa, vent: false };
        (0..ticks)
            .map(|_| {
                self.tick(&command);
                self.pressure_pa()
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
            let course = bench.hold(to, 10 * lag_ticks as u32);
            let gone = |at: usize| (course[at] - from) / f64::from(to - from as f32);
            // After one lag 1 − 1/e is gone, and no more than a period earlier or two later.
            let (early, late) = (lag_ticks - usize::from(ticks), lag_ticks + 2 * usize::from(ticks));
            assert!(
                gone(early) < 0.64 && gone(late) > 0.60,
                "lag {lag_s} s, {ticks} ticks, to {to}: {early}: {}, {late}: {}",
                gone(early),
                gone(late)
            );
            let rest = course.last().expect("ticks") - f64::from(to);
            assert!(rest.abs() < 2e3, "{rest} Pa from {to}, lag {lag_s} s, {ticks} ticks");
            let beyond = course.iter().map(|p| (p - f64::from(to)) * f64::from(to - from as f32).signum());
            assert!(beyond.fold(0.0, f64::max) < 3e3, "overshoot towards {to}, lag {lag_s} s, {ticks} ticks");
        }
    }
}

#[test]
fn at_the_demanded_pressure_both_valves_rest() {
    let mut bench = Bench::new(|_| ());
    bench.hold(300e3, 1_000);
    bench.pulses = [0; 2];
    bench.hold(300e3, 1_000);
    assert_eq!(bench.pulses, [0; 2]);
}

/// A least pulse of 0.5 ms changes the pressure by 30 kPa here.
#[test]
fn valves_that_are_too_large_leave_an_error_and_do_not_oscillate() {
    let mut bench = Bench::new(|s| (s.valves.fill_pa_per_s, s.valves.vent_pa_per_s) = (60e6, 60e6));
    let course = bench.hold(300e3, 2_000);
    assert!(course[1_000..].iter().all(|p| (p - 300e3).abs() < 16e3), "{:?}", &course[1_990..]);
    bench.pulses = [0; 2];
    bench.hold(300e3, 1_000);
    assert_eq!(bench.pulses, [0; 2]);
}

#[test]
fn a_leak_is_met_by_pulses_that_no_valve_could_make_one_by_one() {
    let mut bench = Bench::new(|s| s.valves.band_pa = 0.0);
    // 300 kPa fall by 60 kPa/s: in a period as much as the fill valve lets in within 0.15 ms.
    bench.leak = 0.2 * REST / (GAS_J_PER_MOL_K * AIR_K);
    bench.hold(300e3, 1_000);
    bench.pulses = [0; 2];
    let course = bench.hold(300e3, 2_000);
    assert!((mean(&course) - 300e3).abs() < 3e3, "{}", mean(&course));
    let [fill, vent] = bench.pulses;
    assert!((20..150).contains(&fill) && vent == 0, "{fill} and {vent} pulses in 200 periods");
}

#[test]
fn a_muscle_that_widens_is_filled_and_one_that_narrows_is_vented() {
    for widening in [0.5, -0.5] {
        let mut bench = Bench::new(|_| ());
        bench.volume = 1.5;
        bench.hold(300e3, 1_000);
        bench.widening = widening;
        let course = bench.hold(300e3, 500);
        // Without regard to the volume, the pressure would be behind by (p + p_atm)·V̇/V·lag: 4 to 5 kPa.
        let off = mean(&course[200..]) - 300e3;
        assert!(off.abs() < 3e3, "{off} Pa at {widening}/s");
    }
}

#[test]
fn a_vent_acts_within_a_period_and_the_next_command_begins_one() {
    let mut bench = Bench::new(|_| ());
    let command = Command { pressure_pa: 400e3, vent: false };
    assert!(matches!(
        bench.tick(&command),
        Valves::Period { fill_us: 10_000, vent_us: 0, length_us: 10_000 }
    ));
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
    bench.leak = -1e-3 * REST;
    let course = bench.hold(0.0, 2_000);
    assert!(course[1_999] < 3e3, "{}", course[1_999]);
}

#[test]
fn a_reading_that_is_no_number_closes_both() {
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut pair = PairOfValves::default();
        let mut settings = Settings::default();
        settings.valves.period_ticks = 10;
        for pressure_pa in [0.0, 300e3] {
            let command = Command { pressure_pa, vent: false };
            let done = pair.step(&command, wrong, &Air::default(), &settings);
            assert_eq!(done, Valves::Period { fill_us: 0, vent_us: 0, length_us: 10_000 }, "{wrong}");
            pair.left = 0;
        }
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
