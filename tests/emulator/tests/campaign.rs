//! `host campaign` on a serial port: a testing machine with a line protocol, an operator who is prompted, and interruptions of the process,
//! the cable and the controller.
//!
//! ```text
//! cargo test -p emulator-tests --test campaign
//! PAM_LONG=1 PAM_INTERRUPTIONS_PAGE=write cargo test --release -p emulator-tests --test campaign interruptions   200 interruptions;
//!                                                                             writes docs/src/interruptions.md
//! ```
#![cfg(target_os = "linux")]

mod campaign {
    pub mod page;
}

use std::collections::HashSet;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use emulator_tests::campaign_rig::{
    Bench, Cable, LineMachine, VENTED_KPA, campaign, messages, rows, times, until,
};
use emulator_tests::program::interrupt;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use virtual_bench::presets;

use campaign::page::{Figures, Kind};

/// Device seconds in a second.
const SPEED: u32 = 8;

fn folder(rig: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("muscle.toml"), presets::miniature().description()).expect("written");
    std::fs::write(folder.path().join("rig.toml"), rig).expect("written");
    folder
}

fn line_rig(machine: &LineMachine) -> String {
    format!("axis = 'line'\naxis_address = '{}'\nspeed_max_mm_s = 10.0\n", machine.device.display())
}

fn document(folder: &Path) -> Value {
    let text = std::fs::read(folder.join("c/campaign.json")).expect("campaign.json");
    serde_json::from_slice(&text).expect("JSON")
}

fn until_rows(folder: &Path, child: &mut Child, more_than: usize) {
    until("rows come", || {
        let ended = child.try_wait().expect("a process");
        assert!(ended.is_none(), "the campaign ended early: {ended:?}");
        rows(&folder.join("c")).len() > more_than
    });
}

#[test]
fn a_campaign_with_a_testing_machine_on_serial_lines_is_killed_continues_and_vents_on_ctrl_c() {
    let folder = folder("");
    let folder = folder.path();
    let bench = Bench::start(folder, SPEED);
    let machine = LineMachine::start(&bench);
    std::fs::write(folder.join("rig.toml"), line_rig(&machine)).expect("written");
    let port = folder.join("tty");
    let _cable = Cable::plug(&port, &bench);

    until("the controller has been on for a minute", || bench.state().time_s > 60.0);
    let mut child = campaign(folder, &port, "6").spawn().expect("it starts");
    until_rows(folder, &mut child, 130);
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let before = rows(&folder.join("c"));
    assert!(times(&before)[0] < 60.0, "the clock of a campaign begins with it, not with the controller");
    bench.until_vented();

    // The controller is held by the fault of a silent host; the same call continues.
    let mut child = campaign(folder, &port, "6").spawn().expect("it starts");
    until_rows(folder, &mut child, before.len() + 60);
    interrupt(&child);
    assert!(child.wait().expect("it ends").success(), "an interruption is not a failure");
    bench.until_vented();
    let after: HashSet<String> = rows(&folder.join("c")).into_iter().collect();
    assert!(before.iter().all(|row| after.contains(row)), "a row is gone");
    assert_eq!(document(folder)["complete"], false);

    let status = campaign(folder, &port, "6").status().expect("it starts");
    assert!(status.success());
    let all = rows(&folder.join("c"));
    times(&all);
    let document = document(folder);
    assert_eq!(document["complete"], true, "{document:#}");
    let largest = all.iter().filter_map(|r| r.split(',').nth(2)?.parse::<f64>().ok()).fold(0.0, f64::max);
    assert!(largest > 1.0, "the machine moved the muscle: {largest} mm");
    assert!(folder.join("c/table.pam").exists() && folder.join("c/report.html").exists());
    assert!(bench.state().pressure_kpa < VENTED_KPA);
}

/// What the operator reads and does: moves the free end where the program says, then presses Enter.
fn operate(child: &mut Child, bench: &Bench, said: &Arc<Mutex<String>>, most: usize) -> Vec<f64> {
    let mut input =
        child.stdin.as_ref().and_then(|i| rustix::io::dup(i).ok()).map(File::from).expect("its input");
    let mut strokes = Vec::new();
    let mut answered = 0;
    until("the campaign ends", || {
        let text = said.lock().expect("text").clone();
        if let Some(at) = text.get(answered..).and_then(|t| t.find("press Enter: ")).map(|i| answered + i) {
            let words = &text[answered..at];
            let stroke = words.rfind("stroke of ").and_then(|i| words[i + 10..].split(' ').next());
            let stroke: f64 = stroke.and_then(|s| s.parse().ok()).expect("a stroke in the prompt");
            assert!(bench.state().pressure_kpa < VENTED_KPA, "the operator is at a muscle under pressure");
            if strokes.len() == most {
                return true;
            }
            assert_eq!(bench.order(&format!("move {stroke} 20")).expect("the bench"), "ok");
            until("the operator moves", || (bench.state().stroke_mm - stroke).abs() < 0.01);
            input.write_all(b"\n").expect("it reads");
            strokes.push(stroke);
            answered = at + 12;
        }
        child.try_wait().expect("a process").is_some()
    });
    strokes
}

fn prompted(folder: &Path, bench: &Bench) -> (Child, Arc<Mutex<String>>) {
    let port = bench.port.clone();
    let mut child = campaign(folder, Path::new(&port), "8")
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut errors = child.stderr.take().expect("its messages");
    let said = Arc::new(Mutex::new(String::new()));
    let shared = Arc::clone(&said);
    std::thread::spawn(move || {
        let mut bytes = [0; 1024];
        while let Ok(count @ 1..) = errors.read(&mut bytes) {
            shared.lock().expect("text").push_str(&String::from_utf8_lossy(&bytes[..count]));
        }
    });
    (child, said)
}

#[test]
fn an_operator_is_prompted_and_may_end_the_campaign_there() {
    let folder = folder("axis = 'prompt'\nstroke_max_mm = 12.0\n");
    let folder = folder.path();
    let bench = Bench::start(folder, SPEED);
    // Ctrl-C at the first prompt.
    let (mut child, said) = prompted(folder, &bench);
    assert!(operate(&mut child, &bench, &said, 0).is_empty());
    interrupt(&child);
    // Waiting would close its input, which is an answer, too.
    until("it ends", || child.try_wait().expect("a process").is_some());
    let ended = child.wait().expect("it ends");
    assert!(ended.success(), "an interruption is not a failure: {}", said.lock().expect("text"));
    let before = rows(&folder.join("c"));
    assert!(!before.is_empty() && said.lock().expect("text").contains("interrupted"));

    let (mut child, said) = prompted(folder, &bench);
    let strokes = operate(&mut child, &bench, &said, usize::MAX);
    assert!(child.wait().expect("it ends").success(), "{}", said.lock().expect("text"));
    let distinct: HashSet<String> = strokes.iter().map(|s| format!("{s:.2}")).collect();
    assert!(distinct.len() >= 3, "three strokes at least: {strokes:?}");
    let said = said.lock().expect("text").clone();
    assert!(said.contains("The muscle is vented. Move to a stroke of"), "{said}");
    let bars = said.chars().filter(|c| ('▁'..='█').contains(c)).count();
    assert!(said.contains("force ") && bars > 100, "what was recorded is shown: {said}");
    let all: HashSet<String> = rows(&folder.join("c")).into_iter().collect();
    assert!(before.iter().all(|row| all.contains(row)), "a row is gone");
    assert_eq!(document(folder)["complete"], true);
    assert!(folder.join("c/table.pam").exists(), "{said}");
}

/// Interrupts campaigns in every way, and looks at rows and pressure after each.
#[test]
fn interruptions_lose_no_row_and_leave_no_muscle_under_pressure() {
    let count = if std::env::var_os("PAM_LONG").is_some() { 200 } else { 6 };
    let write = std::env::var("PAM_INTERRUPTIONS_PAGE").is_ok_and(|wish| wish == "write");
    let folder = folder("");
    let folder = folder.path();
    let port = folder.join("tty");
    let mut random = StdRng::seed_from_u64(20);
    let mut figures = Figures::default();
    let mut bench = Bench::start(folder, SPEED);
    let mut machine = LineMachine::start(&bench);
    let mut cable = Some(Cable::plug(&port, &bench));
    let mut known: Vec<String> = Vec::new();
    let mut done = 0;
    while done < count {
        std::fs::write(folder.join("rig.toml"), line_rig(&machine)).expect("written");
        let mut child = campaign(folder, &port, "30").spawn().expect("it starts");
        let more = random.random_range(1..150);
        let mut ended = false;
        until("rows come", || {
            ended = child.try_wait().expect("a process").is_some();
            ended || rows(&folder.join("c")).len() > known.len() + more
        });
        if ended {
            // Complete; the next one begins in a new folder.
            assert!(child.wait().expect("it ends").success(), "the campaign failed: {}", messages(folder));
            assert_eq!(document(folder)["complete"], true);
            figures.campaigns += 1;
            std::fs::remove_dir_all(folder.join("c")).expect("a folder");
            known.clear();
            continue;
        }
        // At any moment between two samples.
        std::thread::sleep(Duration::from_millis(random.random_range(0..200)));
        let kind = Kind::ALL[done % Kind::ALL.len()];
        let under_pressure = bench.state().pressure_kpa > VENTED_KPA;
        let at_risk = rows(&folder.join("c"));
        let vented_s = match kind {
            Kind::Process => {
                child.kill().expect("it runs");
                child.wait().expect("it ends");
                bench.until_vented()
            }
            Kind::Cable => {
                cable.take().expect("a cable").pull();
                let vented = bench.until_vented();
                assert!(!child.wait().expect("it ends").success(), "a pulled cable is a failure");
                cable = Some(Cable::plug(&port, &bench));
                vented
            }
            Kind::Controller => {
                bench.kill();
                assert!(!child.wait().expect("it ends").success(), "a dead controller is a failure");
                bench = Bench::start(folder, SPEED);
                machine = LineMachine::start(&bench);
                cable = Some(Cable::plug(&port, &bench));
                // A controller that starts holds the muscle vented until it is armed.
                assert!(bench.state().pressure_kpa < VENTED_KPA, "pressure after a start");
                0.0
            }
        };
        done += 1;
        assert!(bench.state().pressure_kpa < VENTED_KPA, "pressure without a program");
        let now = rows(&folder.join("c"));
        times(&now);
        let all: HashSet<&String> = now.iter().collect();
        let lost = known.iter().chain(&at_risk).filter(|row| !all.contains(*row)).count();
        figures.add(kind, under_pressure, lost, now.len() - known.len(), vented_s);
        assert_eq!(lost, 0, "rows are gone after {kind:?}");
        known = now;
        // After each, so that a test that is ended leaves what it has seen.
        if write {
            figures.write();
        }
    }
    eprintln!("{figures:?}");
    assert!(figures.under_pressure() > 0, "the muscle was under pressure at some of the interruptions");
}
