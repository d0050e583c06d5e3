//! Every fault that a plant or a host can cause, through the real link and the real image: noticed in time, vented or held,
//! latched, counted, reported, and left only by being cleared.

use std::time::Duration;

use emulator_tests::machine::Folder;
use emulator_tests::{Machine, Options, Watched, tracking, upload};
use model_core::link::endpoints::{
    Arm, ClearFault, GetFaults, GetPastFault, GetSettings, GetStatus, SetSettings, SetTelemetry, SetTo,
    StartMode, Stop,
};
use model_core::link::messages::{
    Fault, Field, Mode, PastFault, Reference, Refusal, SetPoint, SetPointOrder, Side, Start, State,
    TelemetryRate,
};
use model_core::link::settings::Settings;
use model_core::table;
use virtual_bench::bench::BenchSpec;
use virtual_bench::lockstep::Answer;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

/// How a fault is caused: what happens to the readings from a period on (counted from the first).
type Cause = fn(u64, &mut Answer);

struct Case {
    fault: Fault,
    /// Periods from the cause to the vent.
    within: usize,
    /// Settings that the case needs in addition to the defaults.
    settings: fn(&mut Settings),
    cause: Cause,
}

const NONE: fn(&mut Settings) = |_| ();

const CASES: &[Case] = &[
    // A broken wire vents within 3 ms.
    Case { fault: Fault::SensorRange, within: 3, settings: NONE, cause: |_, a| a.force = -1.0e6 },
    Case { fault: Fault::SensorRange, within: 3, settings: NONE, cause: |_, a| a.pressure = f32::NAN },
    Case { fault: Fault::SensorRange, within: 3, settings: NONE, cause: |_, a| a.stroke = f32::NAN },
    Case { fault: Fault::OverPressure, within: 3, settings: NONE, cause: |_, a| a.pressure = 720e3 },
    Case { fault: Fault::OverStroke, within: 3, settings: NONE, cause: |_, a| a.stroke = 0.085 },
    Case {
        fault: Fault::OverForce,
        within: 3,
        settings: |s| s.limits.force_n = 150.0,
        cause: |_, a| a.force = 160.0,
    },
    Case {
        fault: Fault::OverSpeed,
        within: 60,
        settings: |s| s.limits.speed_m_per_s = 0.05,
        cause: |n, a| a.stroke += 1.0e-4 * n as f32,
    },
    Case {
        fault: Fault::SensorNoisy,
        within: 20,
        settings: NONE,
        cause: |n, a| a.pressure += if n % 2 == 0 { 100e3 } else { -100e3 },
    },
    Case {
        fault: Fault::PressureNotRising,
        within: 260,
        settings: |s| s.watch.follow_pa = 60e3,
        cause: |_, a| a.pressure *= 0.5,
    },
    Case {
        fault: Fault::PressureNotFalling,
        within: 260,
        settings: |s| s.watch.follow_pa = 60e3,
        cause: |_, a| a.pressure *= 1.5,
    },
    Case {
        fault: Fault::SensorsDisagree,
        within: 260,
        settings: |s| s.watch.disagree_n = 40.0,
        cause: |_, a| a.force += 80.0,
    },
    Case { fault: Fault::BrownOut, within: 3, settings: NONE, cause: |_, a| a.status |= Answer::SUPPLY_LOW },
    // Three ticks of two missed ones each are more than five.
    Case { fault: Fault::LoopOverrun, within: 4, settings: NONE, cause: |_, a| a.status |= Answer::late(2) },
    Case {
        fault: Fault::SensorStuck,
        // Counted from the change of the command, without which no reading need change.
        within: 260,
        settings: |s| s.watch.follow_pa = 1e6,
        cause: |_, a| a.pressure = 200e3,
    },
];

fn station() -> Watched<PlantStation> {
    let bench = BenchSpec::laboratory(presets::miniature(), 3);
    Watched::new(PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.8 }], 1e-3))
}

fn board(folder: &Folder, station: &Watched<PlantStation>) -> Option<Machine> {
    let options = Options { first: Some(Box::new(station.clone())), ..Options::default() };
    Machine::start(folder.path(), options).ok()
}

#[test]
fn every_fault_of_the_plant_is_noticed_in_time_and_latched() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &table::example());
    for (number, case) in CASES.iter().enumerate() {
        let fault = case.fault;
        tracking::set(&mut client, |settings| {
            *settings = Settings::default();
            (case.settings)(settings);
        });
        tracking::start(&mut client, Mode::Pressure);
        client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
        client.set_point(SetPoint::Pressure(250e3)).expect("a set-point");
        station.pass(400);
        let mut began = None;
        let cause = case.cause;
        let at = std::sync::Arc::new(std::sync::atomic::AtomicU64::new(u64::MAX));
        let seen = at.clone();
        station.disturb(move |period, answer| {
            let first = *began.get_or_insert(period);
            seen.store(first, std::sync::atomic::Ordering::Relaxed);
            cause(period - first, answer);
        });
        if fault == Fault::SensorStuck {
            station.pass(20);
            client.set_point(SetPoint::Pressure(400e3)).expect("a set-point");
        }
        let report = tracking::stopped(&mut client);
        station.pass(5);
        let first = at.load(std::sync::atomic::Ordering::Relaxed) as usize;
        let mut after = station.since(first);
        if fault == Fault::SensorStuck {
            let before = after[0].command;
            let moved = after.iter().position(|exchange| exchange.command > before + 20e3);
            after.drain(..moved.expect("the command follows the setpoint"));
        }
        let vented = after.iter().position(|exchange| exchange.command == 0.0);
        station.heal();
        assert_eq!(report.fault, fault, "case {number}: {report:?}");
        assert_eq!((report.from, report.mode), (State::Running, Mode::Pressure));
        assert!(
            vented.is_some_and(|n| n <= case.within),
            "{fault:?} (case {number}) vents after {vented:?} periods"
        );
        // It stays vented and says no to everything but being cleared.
        assert_eq!(
            client.try_call::<Arm>(&client.session()).expect("an answer"),
            Err(Refusal::Latched(fault))
        );
        assert_eq!(client.call::<GetStatus>(&()).expect("a status").state, State::Fault);
        let faults = client.call::<GetFaults>(&()).expect("its faults");
        // Compared as text: a reading that is not a number is not equal to itself.
        assert_eq!(format!("{:?}", faults.latched), format!("{:?}", Some(report)));
        assert!(faults.counts[usize::from(fault.code())] >= 1);
        let past = client.call::<GetPastFault>(&PastFault { back: 0 }).expect("the log");
        assert_eq!(format!("{past:?}"), format!("{:?}", Some(report)), "it is kept");
        // The air takes some of the regulator's lags of 30 ms to leave, and the filters of the watches as long again.
        let cleared = (0..10).any(|_| {
            station.pass(100);
            client.try_call::<ClearFault>(&()).is_ok_and(|answer| answer.is_ok())
        });
        assert!(cleared, "{fault:?} (case {number}) clears within a second when the cause is gone");
        assert_eq!(client.call::<GetStatus>(&()).expect("a status").state, State::Disarmed);
    }
}

#[test]
fn a_fault_whose_cause_is_still_there_is_not_cleared() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    tracking::start(&mut client, Mode::Pressure);
    station.disturb(|_, answer| answer.force = 9e9);
    tracking::stopped(&mut client);
    station.pass(10);
    let refused = client.try_call::<ClearFault>(&()).expect("an answer");
    assert_eq!(refused, Err(Refusal::StillFaulty(Fault::SensorRange)));
    station.heal();
    station.pass(10);
    client.call::<ClearFault>(&()).expect("now it clears");
}

#[test]
fn a_host_that_falls_silent_and_a_hold_that_was_requested() {
    let folder = Folder::new();
    let station = station();
    // No faster than a real board: the first setpoint must come before its silence is noticed.
    let options = Options { first: Some(Box::new(station.clone())), speed: Some(1.0), ..Options::default() };
    let Ok(machine) = Machine::start(folder.path(), options) else { return };
    let mut client = machine.client();
    tracking::set(&mut client, |settings| {
        settings.watch.silence_ticks = 2_000;
        settings.hold_on = 1 << Fault::SetPointSilence.code();
    });
    tracking::start(&mut client, Mode::Pressure);
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
    client.set_point(SetPoint::Pressure(300e3)).expect("a set-point");
    let report = tracking::stopped(&mut client);
    assert_eq!((report.fault, report.value, report.limit), (Fault::SetPointSilence, 2_001.0, 2_000.0));
    station.pass(100);
    let held = station.since(station.periods() - 50);
    // The command is the demand and what the drift of this regulator requires; held, it no longer moves.
    let first = held[0].command;
    assert!((first - 300e3).abs() < 10e3, "it holds {first} Pa");
    assert!(held.iter().all(|exchange| exchange.command == first), "it stays at {first} Pa");
    // AtStroke pressure can still be released without leaving the fault.
    assert_eq!(client.call::<Stop>(&()).expect("it vents").state, State::Fault);
    station.pass(5);
    assert_eq!(station.since(station.periods() - 1)[0].command, 0.0);
}

#[test]
fn a_mode_without_its_table_is_a_fault_and_nothing_starts_by_itself() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    station.pass(50);
    client.call::<Arm>(&client.session()).expect("it arms");
    let refused = client
        .try_call::<StartMode>(&Start { mode: Mode::Force, session: client.session() })
        .expect("an answer");
    assert_eq!(refused, Err(Refusal::NoTable(Side::Agonist)));
    let latched = client.call::<GetFaults>(&()).expect("its faults").latched.map(|report| report.fault);
    assert_eq!(latched, Some(Fault::TableMissing));
    client.call::<ClearFault>(&()).expect("it clears");
    // A setpoint to a device that does not run moves nothing.
    let order = SetPointOrder { set_point: SetPoint::Pressure(300e3), session: client.session() };
    let refused = client.try_call::<SetTo>(&order).expect("an answer");
    assert_eq!(refused, Err(Refusal::WrongState(State::Disarmed)));
    station.pass(50);
    assert!(station.since(0).iter().all(|exchange| exchange.command == 0.0));
}

#[test]
fn a_calculation_that_fails_vents_and_is_reported_with_its_result() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    tracking::start(&mut client, Mode::Pressure);
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
    // Both are numbers, and their sum is none.
    let wave = Reference::Sine { mean: 3.0e38, amplitude: 3.0e38, frequency_hz: 1.0 };
    client.reference(wave).expect("a wave");
    let report = tracking::stopped(&mut client);
    assert!(report.fault == Fault::NotANumber && report.value == f32::INFINITY, "{report:?}");
    station.pass(5);
    let commands = station.since(0);
    assert!(commands.iter().all(|exchange| exchange.command.is_finite()));
    assert_eq!(commands.last().map(|exchange| exchange.command), Some(0.0));
    let latched = client.try_call::<Arm>(&client.session()).expect("an answer");
    assert_eq!(latched, Err(Refusal::Latched(Fault::NotANumber)));
    // The air takes some lags of the regulator to leave.
    station.pass(300);
    client.call::<ClearFault>(&()).expect("it clears");
    assert_eq!(client.call::<GetStatus>(&()).expect("a status").state, State::Disarmed);
}

#[test]
fn a_damaged_store_latches_a_fault_at_the_next_start() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &table::example());
    machine.kill();
    let path = folder.path().join("pam-store.bin");
    let mut bytes = std::fs::read(&path).expect("the store's file");
    let place = bytes.windows(4).position(|four| four == b"PAMT").expect("the table is in it");
    bytes[place + 60] ^= 4;
    std::fs::write(&path, bytes).expect("the file");
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    let latched = client.call::<GetFaults>(&()).expect("its faults").latched.map(|report| report.fault);
    assert_eq!(latched, Some(Fault::TableInvalid));
}

#[test]
fn settings_of_which_a_bit_is_wrong_stop_the_device_until_they_are_confirmed() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    tracking::set(&mut client, |settings| settings.limits.pressure_pa = 250e3);
    machine.kill();
    let path = folder.path().join("pam-store.bin");
    let mut bytes = std::fs::read(&path).expect("the store's file");
    let limit = 250e3_f32.to_le_bytes();
    let place = bytes.windows(4).position(|four| four == limit).expect("the limit is in it");
    bytes[place + 1] ^= 4;
    std::fs::write(&path, bytes).expect("the file");
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    let untrusted = Fault::SettingsInvalid;
    let latched = client.call::<GetFaults>(&()).expect("its faults").latched.map(|report| report.fault);
    assert_eq!(latched, Some(untrusted));
    station.pass(10);
    assert_eq!(
        client.try_call::<Arm>(&client.session()).expect("an answer"),
        Err(Refusal::Latched(untrusted))
    );
    let refused = client.try_call::<ClearFault>(&()).expect("an answer");
    assert_eq!(refused, Err(Refusal::StillFaulty(untrusted)));
    tracking::set(&mut client, |settings| settings.limits.pressure_pa = 250e3);
    client.call::<ClearFault>(&()).expect("they are confirmed");
    client.call::<Arm>(&client.session()).expect("it arms");
}

#[test]
fn settings_without_bounds_are_refused_and_change_nothing() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    let before = client.call::<GetSettings>(&()).expect("its settings");
    type Change = fn(&mut Settings);
    let blind: [(Field, Change); 4] = [
        (Field::Regulator, |s| s.regulator.line_s = 1e30),
        (Field::Regulator, |s| s.regulator.lag_s = 3.4e38),
        (Field::Watch, |s| s.watch.debounce_ticks = 65_535),
        (Field::Watch, |s| s.watch.host_silence_ticks = u32::MAX),
    ];
    for (field, change) in blind {
        let mut settings = before;
        change(&mut settings);
        let refused = client.try_call::<SetSettings>(&settings).expect("an answer");
        assert_eq!(refused, Err(Refusal::Value(field)));
    }
    assert_eq!(client.call::<GetSettings>(&()).expect("its settings"), before);
}

#[test]
fn a_bench_that_is_gone_stops_the_device() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station) else { return };
    let mut client = machine.client();
    tracking::start(&mut client, Mode::Pressure);
    client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 0 }).expect("quiet");
    station.disturb(|_, _| std::thread::sleep(Duration::from_secs(10)));
    assert_eq!(tracking::stopped(&mut client).fault, Fault::SensorsSilent);
}
