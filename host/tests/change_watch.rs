//! `host run --reference` and `host record --reference` on an emulated controller: a wrong gain of the bench's load cell is named while
//! the muscle works, and nothing is where nothing is wrong.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::Path;
use std::process::{Command, Output};

use host::demo::campaign::record;
use model_core::link::endpoints::StartMode;
use model_core::link::messages::Start;
use pam_device::Client;
use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::run::{Plan, Steps, arm};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use serde_json::Value;
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::Motion;
use virtual_bench::presets;

/// Ordinary motion: the load swings, and the pressure goes up and down more slowly.
const PRESSURE: &str = "sine mean=300 amplitude=150 frequency=0.11";

/// A controller whose load cell is wrong by `gain`; it runs on without a program, three times as fast as the clock.
fn controller(seed: u64, gain: f64) -> Emulated {
    let mut spec = BenchSpec::laboratory(presets::miniature(), seed);
    spec.instruments.force.gain += gain;
    let motion = Motion::Sine { mean_mm: 0.6, amplitude_mm: 0.4, frequency_hz: 0.5 };
    let emulated = Emulated::start(Stand::new(spec, motion), Some(Kind::Native), 3.0).unwrap();
    let port = emulated.address().to_string();
    let set =
        host(Path::new("."), &["device", "settings", "--port", &port, "--set", "watch.autonomous=true"]);
    assert!(set.status.success(), "{}", said(&set));
    emulated
}

fn host(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host"));
    command.args(arguments).current_dir(folder).env("PAM_SETTINGS", "").output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

/// A run of 40 s; the document that it prints and what it said meanwhile.
fn run(folder: &Path, seed: u64, gain: f64, more: &[&str]) -> (Value, String) {
    let controller = controller(seed, gain);
    let port = controller.address().to_string();
    let line = ["run", "--port", &port, "--pressure", PRESSURE, "--seconds", "40", "--rate", "200", "--json"];
    let output = host(folder, &[&line[..], more].concat());
    assert!(output.status.success(), "{}", said(&output));
    (serde_json::from_slice(&output.stdout).unwrap(), said(&output))
}

#[test]
fn a_wrong_gain_is_named_while_the_muscle_works_and_nothing_is_where_nothing_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let commissioning = folder.path().join("commissioning");
    std::fs::create_dir(&commissioning).unwrap();
    run(folder.path(), 3, 0.0, &["-o", "commissioning/first.csv"]);

    let (about, said) = run(folder.path(), 4, 0.06, &["--reference", "commissioning"]);
    let changed = &about["changed"];
    assert_eq!(changed["missing"][0]["effect"], "force-gain", "{changed:#}\n{said}");
    let gain = &changed["missing"][0]["parameters"][0];
    let (low, high) = (gain["low"].as_f64().unwrap(), gain["high"].as_f64().unwrap());
    assert!(low < 0.06 && high > 0.06 && low > 0.02, "{gain}");
    // Not only at the end: the comparison is printed while the muscle moves, with its size.
    assert!(said.contains("What changed: force-gain"), "{said}");

    let (about, said) = run(folder.path(), 5, 0.0, &["--reference", "commissioning/first.csv"]);
    let changed = &about["changed"];
    assert_eq!(changed["verdict"], "consistent", "{changed:#}\n{said}");
    assert_eq!(changed["missing"].as_array().unwrap().len(), 0, "{changed:#}");

    // A recording of a controller that works alone.
    let controller = controller(6, 0.06);
    works(&controller);
    let port = controller.address().to_string();
    let line = ["record", "--port", &port, "--seconds", "40", "--rate", "200", "-o", "later.csv"];
    let output = host(folder.path(), &[&line[..], &["--reference", "commissioning/first.csv"]].concat());
    assert!(output.status.success(), "{}", self::said(&output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(words.contains("What changed: force-gain") && words.contains("later.csv"), "{words}");
}

/// Starts a motion and leaves the controller alone with it.
fn works(controller: &Emulated) {
    let mut client = Client::open(controller.address()).unwrap();
    arm(&mut client).unwrap();
    let session = client.session();
    client.call::<StartMode>(&Start { mode: Quantity::Pressure.mode(), session }).unwrap();
    let profile = SetpointProfile::parse(PRESSURE, Quantity::Pressure).unwrap();
    let plan = Plan { quantity: Quantity::Pressure, profile, seconds: None, every_ticks: 1 };
    Steps::begin(&mut client, &plan).unwrap();
}

#[test]
fn beside_the_table_of_the_controller_a_gain_is_named_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let made = record("mini", 1, &folder.path().join("bench")).unwrap();
    let mut line = vec!["fit".to_owned(), "--muscle".into(), made.muscle.display().to_string()];
    line.extend(made.recordings.iter().map(|r| r.display().to_string()));
    line.extend(["-o".to_owned(), "own.pam".into()]);
    let fitted = host(folder.path(), &line.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(fitted.status.success(), "{}", said(&fitted));

    let (about, words) = run(folder.path(), 8, 0.0, &["--reference", "own.pam"]);
    let changed = &about["changed"];
    assert_eq!(changed["missing"].as_array().unwrap().len(), 0, "{changed:#}\n{words}");

    let (about, words) = run(folder.path(), 9, 0.1, &["--reference", "own.pam"]);
    let changed = &about["changed"];
    assert_eq!(changed["missing"][0]["effect"], "force-gain", "{changed:#}\n{words}");
}

#[test]
fn a_reference_that_cannot_be_read_is_refused_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let line = ["record", "--port", "tcp:127.0.0.1:1", "--reference", "empty"];
    let output = host(folder.path(), &line);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("no recordings"), "{}", said(&output));
}
