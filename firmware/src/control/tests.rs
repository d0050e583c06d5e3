//! What the controller does when something goes wrong, as physical statements on a muscle that follows its command within 30 ms.

use model_core::link::messages::{Fault, Mode, Refusal, Session, SetPoint, SetPointOrder, Side, State};
use model_core::link::settings::Settings;

use super::Controller;
use crate::board::{Inputs, Outputs, Readings, Signals};
use crate::watch::Finding;

mod bounds;
mod comparison;
mod exact;
mod inputs;
mod joint;
mod ownership;
mod recorded;
mod refusals;
mod repeated;
mod silences;
mod standing;
mod tracking;
mod valve_test;
mod valves;

/// The session that arms and starts in these tests.
const OWNER: Session = Session { id: 7 };

/// A setpoint of the owner.
fn to_pressure(pascals: f32) -> SetPointOrder {
    SetPointOrder { set_point: SetPoint::Pressure(pascals), session: OWNER }
}

/// A muscle, its regulator and its dump valve.
struct Bench {
    controller: Controller,
    pressure_pa: f32,
    tick: u32,
    /// Whether the regulator and the dump valve obey.
    regulator_works: bool,
    valve_works: bool,
    hears_host: bool,
    last: Outputs,
}

impl Bench {
    fn new(change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = Settings::default();
        change(&mut settings);
        let controller = Controller::new(&settings);
        let last = Outputs::VENT;
        Self {
            controller,
            pressure_pa: 0.0,
            tick: 0,
            regulator_works: true,
            valve_works: true,
            hears_host: true,
            last,
        }
    }

    /// N ticks, whose readings and supply are changed on their way.
    fn pass_with(&mut self, ticks: u32, change: impl Fn(&mut Readings, &mut Inputs)) {
        for _ in 0..ticks {
            self.tick += 1;
            // Live sensors never read the same twice.
            let wiggle = (self.tick % 7) as f32 - 3.0;
            let mut now = Readings {
                pressure_pa: self.pressure_pa + wiggle,
                stroke_m: 1e-3 + 1e-7 * wiggle,
                force_n: 1e-3 * wiggle,
            };
            let mut inputs = Inputs::default();
            change(&mut now, &mut inputs);
            let second_pressure = inputs.sides[0].and_then(|signals| signals.second_pressure);
            inputs.sides[0] = Some(Signals { second_pressure, ..now.into() });
            self.last = self.controller.step(&inputs);
            if self.hears_host {
                assert_eq!(self.controller.keep_alive(OWNER), Ok(()));
            }
            let command = self.last.sides[0];
            let target = if command.vent && self.valve_works {
                0.0
            } else if self.regulator_works {
                command.pressure_pa
            } else {
                self.pressure_pa
            };
            self.pressure_pa += (target - self.pressure_pa) / 31.0;
        }
    }

    fn pass(&mut self, ticks: u32) {
        self.pass_with(ticks, |_, _| ());
    }

    /// Under pressure.
    fn running(change: impl FnOnce(&mut Settings)) -> Self {
        let mut bench = Self::new(change);
        bench.pass(10);
        assert_eq!(bench.controller.arm(OWNER), Ok(()));
        assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
        assert_eq!(bench.controller.set_point(to_pressure(400e3)), Ok(()));
        bench.pass(1000);
        assert_eq!(bench.controller.state(), State::Running);
        bench
    }

    /// Holding 400 kPa after a silence of setpoints.
    fn holding() -> Self {
        Self::holding_for(Fault::SetPointSilence)
    }

    /// The same where the settings would hold for another fault as well.
    fn holding_for(another: Fault) -> Self {
        let mut bench = Self::running(|settings| {
            settings.watch.silence_ticks = 1_500;
            settings.hold_on = 1 << Fault::SetPointSilence.code() | 1 << another.code();
        });
        bench.pass(600);
        assert_eq!(bench.latched(), Some(Fault::SetPointSilence));
        assert!(!bench.is_vented() && bench.last.sides[0].pressure_pa > 390e3);
        bench
    }

    fn latched(&self) -> Option<Fault> {
        self.controller.faults().latched.map(|report| report.fault)
    }

    fn is_vented(&self) -> bool {
        self.last.sides[0].vent
    }
}

#[test]
fn a_fault_that_vents_ends_a_hold_and_a_held_fault_does_not_hide_it() {
    type Change = fn(&mut Readings, &mut Inputs);
    let cases: [(Fault, Change); 4] = [
        (Fault::OverPressure, |now, _| now.pressure_pa = 900e3),
        (Fault::OverForce, |now, _| now.force_n = 3_900.0),
        (Fault::BrownOut, |_, inputs| inputs.supply_low = true),
        (Fault::SensorRange, |now, _| now.pressure_pa = f32::NAN),
    ];
    for (fault, change) in cases {
        let mut bench = Bench::holding();
        assert_ne!(bench.controller.take_event(), None);
        bench.pass_with(3, change);
        assert!(bench.is_vented(), "{fault:?} does not end the hold");
        assert_eq!(bench.latched(), Some(Fault::SetPointSilence), "the first stays latched");
        assert!(bench.controller.faults().counts[usize::from(fault.code())] > 0);
        assert_ne!(bench.controller.take_event(), None, "and the host receives the event");
        let kept: Vec<Fault> =
            core::iter::from_fn(|| bench.controller.machine().take_unsaved()).map(|r| r.fault).collect();
        assert_eq!(kept, [Fault::SetPointSilence, fault]);
    }
    // A broken load cell is held for, and lies before the pressure in the order of the watches.
    let mut blind = Bench::holding_for(Fault::SensorRange);
    blind.pass_with(500, |now, _| now.force_n = -1e6);
    assert!(!blind.is_vented());
    blind.pass_with(3, |now, _| (now.force_n, now.pressure_pa) = (-1e6, 900e3));
    assert!(blind.is_vented());
    let mut held = Bench::running(|settings| settings.hold_on = 1 << Fault::SensorRange.code());
    held.pass_with(5, |now, _| now.force_n = -1e6);
    assert_eq!((held.latched(), held.is_vented()), (Some(Fault::SensorRange), false));
    let mut both = Bench::running(|settings| settings.hold_on = 1 << Fault::SensorRange.code());
    both.pass_with(5, |now, _| (now.force_n, now.pressure_pa) = (-1e6, 900e3));
    assert_eq!((both.latched(), both.is_vented()), (Some(Fault::OverPressure), true));
}

#[test]
fn a_hold_ends_after_its_time_and_nothing_is_written_before() {
    let mut bench = Bench::holding();
    assert!(!bench.controller.is_vented());
    bench.pass(9_000);
    assert!(!bench.is_vented(), "after nine seconds of ten");
    bench.pass(1_100);
    assert!(bench.is_vented() && bench.controller.is_vented());
    let counts = bench.controller.faults().counts;
    assert_eq!(counts[usize::from(Fault::HoldEnded.code())], 1);
    let mut silent = Bench::holding();
    silent.hears_host = false;
    silent.pass(1_010);
    assert!(silent.is_vented(), "without a host no one could end the hold");
}

#[test]
fn pressure_that_stays_in_a_vented_muscle_is_a_fault_in_every_state() {
    let jammed = |bench: &mut Bench| (bench.regulator_works, bench.valve_works) = (false, false);
    let mut running = Bench::running(|_| ());
    jammed(&mut running);
    assert_eq!(running.controller.start(Mode::Vent, OWNER), Ok(()));
    running.pass(3_000);
    assert_eq!(running.latched(), Some(Fault::PressureNotFalling), "in a mode that vents");

    let mut armed = Bench::running(|_| ());
    jammed(&mut armed);
    assert_eq!(armed.controller.stop(), Ok(()));
    armed.pass(3_000);
    assert_eq!(armed.latched(), Some(Fault::PressureNotFalling), "while armed");

    let mut disarmed = Bench::running(|_| ());
    disarmed.pass(10);
    jammed(&mut disarmed);
    assert_eq!(disarmed.controller.disarm(), Ok(()));
    disarmed.pass(3_000);
    assert_eq!(disarmed.latched(), Some(Fault::PressureNotFalling), "while disarmed");
    assert_eq!(disarmed.controller.clear(), Err(Refusal::StillFaulty(Fault::NotVented)));

    // Too little for the watch that compares with the model.
    let mut little = Bench::new(|_| ());
    jammed(&mut little);
    little.pressure_pa = 60e3;
    little.pass(1_900);
    assert_eq!(little.latched(), None);
    little.pass(200);
    assert_eq!(little.latched(), Some(Fault::NotVented));

    // A fault that vents, and the vent that fails: counted beside the latched one.
    let mut faulty = Bench::running(|_| ());
    jammed(&mut faulty);
    faulty.pass_with(5, |now, _| now.force_n = -1e6);
    faulty.pass(3_000);
    assert_eq!(faulty.latched(), Some(Fault::SensorRange));
    assert!(faulty.controller.faults().counts[usize::from(Fault::NotVented.code())] > 0);
}

#[test]
fn only_an_empty_muscle_is_armed() {
    let mut bench = Bench::new(|_| ());
    bench.pressure_pa = 100e3;
    bench.pass(1);
    assert_eq!(bench.controller.arm(OWNER), Err(Refusal::StillFaulty(Fault::NotVented)));
    bench.pass(200);
    bench.pass_with(1, |now, _| now.pressure_pa = f32::NAN);
    assert_eq!(bench.controller.arm(OWNER), Err(Refusal::StillFaulty(Fault::NotVented)));
    bench.pass(1);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
}

#[test]
fn regulator_and_dump_valve_are_tried_before_arming() {
    let tested = |settings: &mut Settings| settings.watch.valve_test_pa = 40e3;
    let mut bench = Bench::new(tested);
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    assert_eq!(bench.controller.state(), State::Disarmed, "not yet");
    assert!(!bench.controller.is_vented(), "no flash is written meanwhile");
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Err(Refusal::WrongState(State::Disarmed)));
    bench.pass(20);
    assert!(bench.pressure_pa > 10e3, "the regulator is tried");
    bench.pass(180);
    assert_eq!((bench.controller.state(), bench.latched()), (State::Armed, None));
    assert!(bench.is_vented() && bench.last.sides[0].pressure_pa == 0.0);

    for (regulator_works, valve_works) in [(true, false), (false, true)] {
        let mut broken = Bench::new(tested);
        (broken.regulator_works, broken.valve_works) = (regulator_works, valve_works);
        broken.pass(10);
        assert_eq!(broken.controller.arm(OWNER), Ok(()));
        broken.pass(2_100);
        assert_eq!((broken.controller.state(), broken.latched()), (State::Fault, Some(Fault::ValveTest)));
        assert!(broken.is_vented());
    }
    let mut stopped = Bench::new(tested);
    stopped.pass(10);
    assert_eq!(stopped.controller.arm(OWNER), Ok(()));
    stopped.pass(5);
    assert_eq!(stopped.controller.disarm(), Ok(()));
    stopped.pass(300);
    assert_eq!(stopped.controller.state(), State::Disarmed, "disarming ends the test");
}

#[test]
fn a_command_that_is_no_number_is_never_sent() {
    // Such settings are refused; here they come into force all the same.
    for change in [
        (|settings: &mut Settings| settings.regulator.line_s = 1e30) as fn(&mut Settings),
        |settings| settings.regulator.lag_s = 3.4e38,
        |settings| settings.regulator.gain = f32::NAN,
    ] {
        let mut bench = Bench::new(change);
        bench.pass(10);
        assert_eq!(bench.controller.arm(OWNER), Ok(()));
        assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
        for set_point in [400e3, 0.0, 3e38, 100e3] {
            let _ = bench.controller.set_point(to_pressure(set_point));
            for _ in 0..100 {
                bench.pass(1);
                let sent = bench.last.sides[0];
                assert!(sent.pressure_pa.is_finite() && sent.pressure_pa <= 700e3, "{sent:?}");
            }
        }
    }
}

#[test]
fn nothing_is_armed_until_settings_that_could_not_be_trusted_are_confirmed() {
    let mut bench = Bench::new(|_| ());
    bench.controller.distrust_settings();
    bench.pass(10);
    let untrusted = Fault::SettingsInvalid;
    assert_eq!(bench.controller.arm(OWNER), Err(Refusal::Latched(untrusted)));
    assert_eq!(bench.controller.clear(), Err(Refusal::StillFaulty(untrusted)));
    bench.controller.confirm_settings();
    assert_eq!(bench.controller.clear(), Ok(()));
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
}

#[test]
fn a_fault_before_anything_runs_vents_even_where_the_settings_would_hold() {
    // The valve test is the only time before a run at which the command is not to vent.
    let mut bench = Bench::new(|settings| {
        settings.watch.valve_test_pa = 40e3;
        settings.hold_on = u32::MAX;
    });
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    bench.pass(5);
    assert!(!bench.is_vented());
    let finding = Finding { fault: Fault::SensorRange, sensor: None, value: 0.0, limit: 0.0 };
    bench.controller.raise(Side::Agonist, &finding);
    bench.pass(1);
    assert!(bench.is_vented() && bench.controller.is_vented());
    assert_eq!((bench.controller.state(), bench.latched()), (State::Fault, Some(Fault::SensorRange)));
}

#[test]
fn a_fault_that_is_not_held_for_vents_in_the_tick_in_which_it_is_found() {
    let mut bench = Bench::running(|_| ());
    let finding = Finding { fault: Fault::SensorRange, sensor: None, value: 0.0, limit: 0.0 };
    bench.controller.raise(Side::Agonist, &finding);
    assert!(bench.controller.is_vented());
    let mut never = Bench::running(|settings| {
        settings.hold_on = u32::MAX;
        settings.watch.hold_ticks = 0;
    });
    never.controller.raise(Side::Agonist, &finding);
    assert!(never.controller.is_vented(), "a hold of no time is none");
}

#[test]
fn settings_that_were_not_confirmed_are_refused_even_without_a_latched_fault() {
    let mut bench = Bench::new(|_| ());
    bench.pass(10);
    bench.controller.unconfirmed = true;
    assert_eq!(bench.controller.arm(OWNER), Err(Refusal::StillFaulty(Fault::SettingsInvalid)));
    assert_eq!(bench.controller.state(), State::Disarmed);
}
