//! The control loop with a pair of on/off valves, on a muscle of real air: pressure and force follow, and every fault vents.

use std::vec::Vec;

use super::*;
use crate::board::Hardware;
use crate::valves::Valves;
use crate::valves::bench::Muscle;

/// The loop and the muscle between its valves, without a dump valve.
struct Loop {
    controller: Controller,
    muscle: Muscle,
    tick: u32,
}

impl Loop {
    fn new(change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = Settings::default();
        settings.valves.period_ticks = 10;
        change(&mut settings);
        let hardware = Hardware { valve_pair: true, ..Hardware::SIMULATED };
        assert_eq!(crate::control::check_settings(&settings, &hardware), Ok(()));
        // Valves that give a tenth less than their settings say.
        let mut real = settings.valves;
        (real.fill_pa_per_s, real.vent_pa_per_s) = (0.9 * real.fill_pa_per_s, 0.9 * real.vent_pa_per_s);
        Self { controller: Controller::new(&settings), muscle: Muscle::new(&real), tick: 0 }
    }

    fn running(change: impl FnOnce(&mut Settings)) -> Self {
        let mut it = Self::new(change);
        it.pass(10);
        assert_eq!(it.controller.arm(OWNER), Ok(()));
        assert_eq!(it.controller.start(Mode::Pressure, OWNER), Ok(()));
        it
    }

    fn pass_with(&mut self, change: impl Fn(&mut Readings)) -> Outputs {
        self.tick += 1;
        let wiggle = (self.tick % 7) as f32 - 3.0;
        let mut now = Readings {
            pressure_pa: self.muscle.pressure_pa() as f32 + 50.0 * wiggle,
            stroke_m: 1e-3 + 1e-7 * wiggle,
            force_n: 1e-3 * wiggle,
        };
        change(&mut now);
        let mut inputs = Inputs::default();
        inputs.sides[0] = Some(now.into());
        let outputs = self.controller.step(&inputs);
        assert_eq!(self.controller.keep_alive(OWNER), Ok(()));
        assert_eq!(outputs.levels, [0.0; 2], "the output of a regulator");
        self.muscle.pass(outputs.valves[0]);
        outputs
    }

    fn pass(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.pass_with(|_| ());
        }
    }

    fn to(&mut self, pascals: f32) {
        assert_eq!(self.controller.set_point(to_pressure(pascals)), Ok(()));
    }

    fn latched(&self) -> Option<Fault> {
        self.controller.faults().latched.map(|report| report.fault)
    }
}

/// Half of what the shortest pulse changes, 2 kPa at the rates of the settings, and the noise.
const RESOLUTION_PA: f64 = 2.5e3;

#[test]
fn pressure_is_within_five_percent_of_a_step_after_four_lags_and_then_within_the_resolution() {
    for ticks in [5, 10, 14] {
        let mut it = Loop::running(|s| s.valves.period_ticks = ticks);
        let mut from = 0.0;
        for to in [200e3, 400e3, 300e3, 200e3] {
            it.to(to);
            let to = f64::from(to);
            let response: Vec<f64> = (0..400)
                .map(|_| {
                    it.pass(1);
                    it.muscle.pressure_pa()
                })
                .collect();
            let gone = |pressure: &f64| (pressure - from) / (to - from);
            let most = response.iter().map(gone).fold(f64::MIN, f64::max);
            let least = response[120..].iter().map(gone).fold(f64::MAX, f64::min);
            assert!(most < 1.05 && least > 0.95, "{least} to {most} at {to} Pa, {ticks} ticks");
            let rest = response[250..].iter().map(|p| (p - to).abs()).fold(0.0, f64::max);
            assert!(rest < RESOLUTION_PA, "{rest} Pa at {to} Pa, {ticks} ticks");
            from = to;
        }
        assert_eq!((it.controller.state(), it.latched()), (State::Running, None));
        assert_eq!(it.muscle.both_open, 0);
    }
}

#[test]
fn pressure_follows_a_ramp_within_five_kilopascals() {
    let mut it = Loop::running(|_| ());
    let mut worst = 0.0_f64;
    for tick in 0..2_000_u32 {
        // 100 to 500 kPa and back within a second each.
        let wanted = 100e3 + 400.0 * if tick < 1_000 { tick } else { 2_000 - tick } as f32;
        it.to(wanted);
        it.pass(1);
        // After the reversal the lead of the regulator's model needs some lags.
        if tick % 1_000 > 200 {
            worst = worst.max((it.muscle.pressure_pa() - f64::from(wanted)).abs());
        }
    }
    assert!(worst < 5e3, "{worst} Pa");
    assert_eq!(it.latched(), None);
}

#[test]
fn a_fault_closes_the_fill_valve_opens_the_vent_valve_and_empties_the_muscle() {
    type Change = fn(&mut Readings);
    let faults: [(Fault, Change); 4] = [
        (Fault::OverPressure, |now| now.pressure_pa = 900e3),
        (Fault::SensorRange, |now| now.pressure_pa = f32::NAN),
        (Fault::SensorRange, |now| now.force_n = f32::INFINITY),
        (Fault::OverForce, |now| now.force_n = 3_900.0),
    ];
    for (fault, change) in faults {
        let mut it = Loop::running(|_| ());
        it.to(400e3);
        // The fill valve is open.
        it.pass(15);
        let ticks = (1..=5).find(|_| it.pass_with(change).valves[0] == Valves::Vent);
        assert!(ticks.is_some_and(|ticks| ticks <= 3), "{fault:?}: {ticks:?}");
        assert_eq!(it.latched(), Some(fault));
        for _ in 0..1_000 {
            assert_eq!(it.pass_with(|_| ()).valves[0], Valves::Vent);
        }
        assert!(it.muscle.pressure_pa() < 1e3, "{}", it.muscle.pressure_pa());
    }
}

#[test]
fn a_hold_keeps_the_pressure_without_a_reading_and_ends_vented() {
    let mut it = Loop::running(|s| {
        s.watch.hold_ticks = 500;
        s.hold_on = 1 << Fault::SensorRange.code();
    });
    it.to(300e3);
    it.pass(500);
    let broken = |now: &mut Readings| now.pressure_pa = f32::NAN;
    let mut closed = true;
    for tick in 0..400 {
        let done = it.pass_with(broken).valves[0];
        let is_closed = matches!(done, Valves::Continue | Valves::Period { fill_us: 0, vent_us: 0, .. });
        closed &= tick < 10 || is_closed;
    }
    assert_eq!(it.latched(), Some(Fault::SensorRange));
    assert!(closed && it.muscle.pressure_pa() > 280e3, "{}", it.muscle.pressure_pa());
    for _ in 0..600 {
        it.pass_with(broken);
    }
    assert!(it.muscle.pressure_pa() < 5e3, "{}", it.muscle.pressure_pa());
}

#[test]
fn a_jammed_fill_valve_is_a_fault() {
    let mut it = Loop::running(|_| ());
    it.to(150e3);
    it.pass(500);
    it.muscle.fill_jammed = true;
    let ticks = (1..1_000).find(|_| {
        it.pass(1);
        it.latched().is_some()
    });
    // 150 kPa beyond the model, which takes some tens of milliseconds, and that for 200.
    assert!(ticks.is_some_and(|ticks| (200..300).contains(&ticks)), "{ticks:?}");
    assert_eq!(it.latched(), Some(Fault::PressureNotFalling));
    assert_eq!(it.pass_with(|_| ()).valves[0], Valves::Vent);
}

/// An outer loop that continues while the valves are as far open as they can be would overshoot afterwards.
#[test]
fn while_the_valves_cannot_follow_no_integrator_continues() {
    let mut it = Loop::running(|s| (s.valves.fill_pa_per_s, s.valves.vent_pa_per_s) = (200e3, 200e3));
    it.to(400e3);
    it.pass(100);
    assert!(it.controller.sides[0].saturation > 100e3, "{}", it.controller.sides[0].saturation);
    it.to(100e3);
    it.pass(5_000);
    assert_eq!(it.controller.sides[0].saturation, 0.0);
}

/// A blocked line or a frozen converter: without a fault, the loop would fill the muscle up to the pressure of the supply.
#[test]
fn a_pressure_reading_that_does_not_answer_the_valves_vents_before_the_muscle_is_far_beyond() {
    type Reading = fn(u32) -> f32;
    let readings: [(&str, Reading); 3] = [
        ("frozen", |_| 0.0),
        ("blocked line", |tick| 400.0 * (tick as f32 * 12.9898).sin()),
        ("slow drift", |tick| -0.5 * tick as f32),
    ];
    for (name, reading) in readings {
        for (low_pa, hold_on) in [(2.5e3, 0), (4e3, 0), (4e3, u32::MAX), (20e3, 0), (60e3, 0)] {
            let mut it = Loop::running(|s| s.hold_on = hold_on);
            it.to(200e3);
            it.pass(500);
            let frozen = 200e3 - low_pa;
            let (mut most, mut at) = (0.0_f64, None);
            for tick in 0..20_000 {
                it.pass_with(|now| now.pressure_pa = frozen + reading(tick));
                most = most.max(it.muscle.pressure_pa());
                if at.is_none() && it.latched().is_some() {
                    at = Some(tick);
                }
            }
            assert_eq!(it.latched(), Some(Fault::PressureNotRising), "{name}, {low_pa} Pa low");
            assert!(most < 350e3, "{name}, {low_pa} Pa low: {most} Pa, fault after {at:?} ms");
            assert!(it.muscle.pressure_pa() < 1e3, "{}", it.muscle.pressure_pa());
        }
    }
}

#[test]
fn a_pressure_sensor_that_reads_nothing_ends_the_valve_test_before_the_muscle_is_full() {
    let mut it = Loop::new(|s| s.watch.valve_test_pa = 40e3);
    it.pass(10);
    assert_eq!(it.controller.arm(OWNER), Ok(()));
    let mut most = 0.0_f64;
    for _ in 0..2_000 {
        it.pass_with(|now| now.pressure_pa = 0.0);
        most = most.max(it.muscle.pressure_pa());
    }
    assert_eq!(it.latched(), Some(Fault::ValveTest));
    assert!(most < 200e3, "{most} Pa");
}
