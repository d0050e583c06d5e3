//! A run belongs to the program that started it: another program on the same line does not keep the muscle under pressure.

use std::process::Child;

use emulator_tests::line::{self, Line};
use emulator_tests::machine::Folder;
use emulator_tests::{Machine, Options, Watched, program};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::{Motion, PlantStation};
use virtual_bench::presets;

type Station = Watched<PlantStation>;

/// Ticks of `watch.host_silence_ticks` by default.
const SILENCE: usize = 1_000;
/// Ticks that a busy machine may need to end one program and start the next.
const CHANGE: usize = 1_500;

fn station() -> Station {
    let bench = BenchSpec::laboratory(presets::miniature(), 3);
    Watched::new(PlantStation::new(bench, vec![Motion::Held { stroke_mm: 0.8 }], 1e-3))
}

fn command(station: &Station) -> f32 {
    station.periods().checked_sub(1).map_or(0.0, |last| station.since(last)[0].command)
}

/// Starts a run, ends it without a last message, and starts `watcher` on the same line.
fn killed_and_watched(watcher: &[&str]) {
    let folder = Folder::new();
    let station = station();
    // No faster than a real board: the silence is counted in its ticks.
    let options = Options { first: Some(Box::new(station.clone())), speed: Some(1.0), ..Options::default() };
    let Ok(machine) = Machine::start(folder.path(), options) else { return };
    let line = Line::tcp(&machine, line::clean(), line::clean());
    let wave = ["run", "--pressure", "sine mean=250 amplitude=50 frequency=1"];
    let mut owner: Child = program::start(&line, folder.path(), &wave);
    station.until("the wave", |_| command(&station) > 150e3);
    let begun = station.periods();
    station.until("the wave continues", |now| now > begun + 1_500);
    owner.kill().expect("it is killed");
    owner.wait().expect("it has ended");
    let killed = station.periods();
    let mut other = program::start(&line, folder.path(), watcher);
    station.until("the vent", |now| command(&station) == 0.0 || now > killed + SILENCE + CHANGE + 2_000);
    let vented = station.periods() - killed;
    station.until("it stays vented", |now| now > killed + vented + 500);
    let after = station.since(killed + vented);
    assert!(other.try_wait().is_ok_and(|ended| ended.is_none()), "`host {watcher:?}` still watches");
    other.kill().expect("it is killed");
    other.wait().expect("it has ended");
    assert!(vented <= SILENCE + CHANGE, "under pressure {vented} ticks after the end of its owner");
    assert!(after.iter().all(|exchange| exchange.command == 0.0), "and stays vented");
    let said = program::done(&line, folder.path(), &["device", "faults"]);
    assert!(said.contains("the host was silent while the controller was running"), "{said}");
}

#[test]
fn a_recorder_does_not_keep_the_run_of_a_killed_program_alive() {
    killed_and_watched(&["record", "--seconds", "60", "-o", "watched.csv"]);
}

#[test]
fn a_log_reader_does_not_keep_the_run_of_a_killed_program_alive() {
    killed_and_watched(&["device", "log"]);
}
