//! What breaks beside the readings: the host, the air, the supply, the program itself; through the real image, link and plant.

use std::process::Child;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use emulator_tests::line::{self, Line};
use emulator_tests::machine::{Folder, HOPELESS};
use emulator_tests::{Machine, Options, Watched, program, tracking, upload};
use model_core::link::endpoints::{Arm, ClearFault, GetFaults, GetInfo, GetStatus, StartMode};
use model_core::link::messages::{Fault, Mode, Refusal, SetPoint, Side, Start, StartedBy, State};
use model_core::table;
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::pneumatics::Pneumatics;
use virtual_bench::presets;

type Station = Watched<PlantStation>;

fn station() -> Station {
    let bench = BenchSpec::laboratory(presets::miniature(), 3);
    Watched::new(PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.8 }], 1e-3))
}

fn board(folder: &Folder, station: &Station, debugged: bool) -> Option<Machine> {
    // No faster than a real board: silence is counted in its ticks, and a program that has to wait for a busy machine is not silent.
    let options =
        Options { first: Some(Box::new(station.clone())), debugged, speed: Some(1.0), ..Options::default() };
    Machine::start(folder.path(), options).ok()
}

fn command(station: &Station) -> f32 {
    station.periods().checked_sub(1).map_or(0.0, |last| station.since(last)[0].command)
}

/// A program that lets the device make a wave, stopped without a word after some hundred ticks of it.
fn killed_in_a_wave(station: &Station, line: &Line, folder: &Folder) {
    let wave = ["run", "--pressure", "sine mean=250 amplitude=50 frequency=1"];
    let mut child: Child = program::start(line, folder.path(), &wave);
    station.until("the wave", |_| command(station) > 150e3);
    let begun = station.periods();
    // It lasts as long as the program, even without messages.
    station.until("the wave continues", |now| now > begun + 1_500);
    assert!(command(station) > 150e3, "the wave was stopped while its host was alive");
    // SIGKILL: nothing of the program runs any more.
    child.kill().expect("it is killed");
    child.wait().expect("it is gone");
}

#[test]
fn a_host_that_is_killed_during_a_wave_of_the_devices_own_stops_it() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station, false) else { return };
    let received = Arc::new(AtomicUsize::new(0));
    let (note, clock) = (received.clone(), station.clone());
    let counted = Box::new(move |_: &mut Vec<u8>| note.store(clock.periods(), Ordering::Relaxed));
    let line = Line::tcp(&machine, counted, line::clean());
    killed_in_a_wave(&station, &line, &folder);
    let killed = station.periods();
    station.until("the vent", |now| command(&station) == 0.0 || now > killed + 5_000);
    let vented = station.periods();
    station.until("it stays vented", |now| now > vented + 200);
    let last_received = received.load(Ordering::Relaxed);
    let after = station.since(last_received);
    let vented = after.iter().position(|exchange| exchange.command == 0.0);
    // The board's own count, which is reported below, begins when the frame is there: a busy machine takes its time to bring it.
    assert!(
        vented.is_some_and(|n| (1_000..2_000).contains(&n)),
        "vents {vented:?} ticks after the last frame"
    );
    assert!(after[vented.unwrap_or(0)..].iter().all(|exchange| exchange.command == 0.0), "and stays vented");
    let said = program::done(&line, folder.path(), &["device", "faults", "--clear"]);
    assert!(said.contains("latched: the host was silent while the controller was running"), "{said}");
    assert!(
        said.contains("1001 ticks against 1000 ticks") && said.contains("while running in pressure mode"),
        "{said}"
    );
    assert!(said.contains("what to do: check that the program is running"), "{said}");
    let said = program::done(&line, folder.path(), &["device", "info", "--json"]);
    assert!(said.contains("\"state\": \"disarmed\""), "{said}");
}

#[test]
fn an_autonomous_device_continues_and_holds_where_a_hold_is_set() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station, false) else { return };
    let line = Line::tcp(&machine, line::clean(), line::clean());
    let set = |settings: &[&str]| {
        let mut arguments = vec!["device", "settings"];
        for one in settings {
            arguments.extend(["--set", one]);
        }
        program::done(&line, folder.path(), &arguments)
    };
    set(&["watch.autonomous=true"]);
    killed_in_a_wave(&station, &line, &folder);
    let killed = station.periods();
    station.until("it continues", |now| now > killed + 3_000);
    assert!(
        station.since(killed + 100).iter().all(|exchange| exchange.command > 100e3),
        "it continued without a host"
    );
    program::done(&line, folder.path(), &["vent"]);
    let hold = format!("hold_on={}", 1_u32 << Fault::HostSilence.code());
    set(&["watch.autonomous=false", "watch.host_silence_ticks=1200", &hold]);
    killed_in_a_wave(&station, &line, &folder);
    let killed = station.periods();
    // A wave never requests the same three hundred times.
    let still = |now: usize| {
        let last = station.since(now.saturating_sub(300));
        last.iter().all(|exchange| exchange.command == last[0].command)
    };
    station.until("it holds", |now| now > killed + 300 && (still(now) || now > killed + 10_000));
    let held = station.periods();
    assert!(held > killed + 1_200, "it holds {} ticks after the end of its host", held - killed);
    assert!(still(held) && command(&station) > 190e3, "it holds {} Pa", command(&station));
    program::done(&line, folder.path(), &["vent"]);
    let vented = station.periods();
    station.until("it vents", |now| now > vented + 50);
    assert_eq!(command(&station), 0.0);
}

/// A way for the air to break, and the pressure requested after it broke.
struct Break {
    name: &'static str,
    fault: Fault,
    how: fn(&mut Pneumatics),
    then_asked: Option<f32>,
}

/// A regulator that no longer moves.
fn stands_still(air: &mut Pneumatics) {
    air.rate = 0.0;
}

const BREAKS: [Break; 4] = [
    Break { name: "burst", fault: Fault::PressureNotRising, how: |air| air.leak = 5.0, then_asked: None },
    Break {
        name: "leak",
        fault: Fault::PressureNotRising,
        how: |air| air.leak = 1.0,
        then_asked: Some(400e3),
    },
    Break { name: "no supply", fault: Fault::PressureNotRising, how: stands_still, then_asked: Some(500e3) },
    Break {
        name: "jammed valve",
        fault: Fault::PressureNotFalling,
        how: stands_still,
        then_asked: Some(20e3),
    },
];

#[test]
fn a_burst_a_leak_a_closed_supply_and_a_jammed_valve_are_noticed_on_the_plant_itself() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station, false) else { return };
    let mut client = machine.client();
    upload(&mut client, Side::Agonist, &table::example());
    for Break { name, fault, how, then_asked } in BREAKS {
        tracking::start(&mut client, Mode::Pressure);
        client.set_point(SetPoint::Pressure(250e3)).expect("a set-point");
        let begun = station.periods();
        station.until(name, |now| now > begun + 400);
        let whole = station.with(|bench| *bench.plant().pneumatics());
        station.with(|bench| how(bench.plant().pneumatics()));
        let broken = station.periods();
        if let Some(pascals) = then_asked {
            client.set_point(SetPoint::Pressure(pascals)).expect("a set-point");
        }
        let report = tracking::stopped(&mut client);
        let before = station.periods();
        station.until(name, |now| now > before + 5);
        let after = station.since(broken);
        // Blocked air shows only after a change of the command; on a busy machine this change comes late.
        let changed = after.iter().position(|exchange| (exchange.command - 250e3).abs() > 50e3);
        let began = then_asked.map_or(0, |_| changed.expect("the command follows the setpoint"));
        // The regulator's lead may command zero for a moment on the way down; venting stays.
        let vented = after[began..].iter().rposition(|exchange| exchange.command > 0.0);
        assert_eq!(report.fault, fault, "{name}: {report:?}");
        // 200 ticks of `follow_ticks`, and the time in which air and model part.
        assert!(vented.is_some_and(|n| (200..400).contains(&n)), "{name}: vents after {vented:?} ticks");
        station.with(|bench| *bench.plant().pneumatics() = whole);
        station.until(name, |now| now > before + 300);
        client.call::<ClearFault>(&()).expect("it clears when the air is whole");
    }
}

/// The vector of the interrupt that runs the tasks: the eleventh behind the sixteen of the core.
const TASKS_VECTOR: u32 = (16 + 10) * 4;
/// `b .`: without end here.
const HANG: u16 = 0xE7FE;

#[test]
fn a_program_that_hangs_is_restarted_vented_and_reports_it() {
    let folder = Folder::new();
    let station = station();
    let Some(machine) = board(&folder, &station, true) else { return };
    let mut client = machine.client();
    assert_eq!(client.call::<GetInfo>(&()).expect("its limits").started_by, StartedBy::Power);
    tracking::start(&mut client, Mode::Pressure);
    client.set_point(SetPoint::Pressure(250e3)).expect("a set-point");
    station.until("it runs", |_| command(&station) > 200e3);
    drop(client);
    let mut debugger = machine.debugger();
    let tasks = debugger.word(TASKS_VECTOR) & !1;
    debugger.patch(tasks, HANG);
    debugger.detach();
    // The bench is restarted by a board that starts, and so its record.
    let deadline = Instant::now() + HOPELESS;
    while command(&station) > 0.0 {
        assert!(Instant::now() < deadline, "the watchdog does not bite");
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut client = machine.client();
    assert_eq!(client.call::<GetInfo>(&()).expect("its limits").started_by, StartedBy::Watchdog);
    let faults = client.call::<GetFaults>(&()).expect("its faults");
    assert_eq!(faults.latched.map(|report| report.fault), Some(Fault::Watchdog));
    assert_eq!(faults.counts[usize::from(Fault::Watchdog.code())], 1);
    // Nothing starts without a request, and nothing can be started before someone has looked.
    assert_eq!(
        client.try_call::<Arm>(&client.session()).expect("an answer"),
        Err(Refusal::Latched(Fault::Watchdog))
    );
    let begun = station.periods();
    station.until("it stays vented", |now| now > begun + 500);
    assert!(station.since(0).iter().all(|exchange| exchange.command == 0.0));
    client.call::<ClearFault>(&()).expect("it clears");
    client.call::<Arm>(&client.session()).expect("it arms");
    client
        .call::<StartMode>(&Start { mode: Mode::Pressure, session: client.session() })
        .expect("it runs again");
    assert_eq!(client.call::<GetStatus>(&()).expect("a status").state, State::Running);
}
