//! The whole for a long time: a controller, a studio that watches, a program that records and one that runs, and faults from a list at
//! random. Every fault ends vented within its ticks, no sample is missing beyond what the recording says, and nothing leaks.
//!
//! ```text
//! cargo test -p emulator-tests --test soak                              45 s
//! PAM_LONG=1 PAM_SOAK_PAGE=write cargo test -p emulator-tests --test soak    an hour; then docs/src/soak.md is written
//! ```
//! `PAM_SOAK_SECONDS` and `PAM_SOAK_SEED` give another time and another order of faults.
#![cfg(target_os = "linux")]

mod soak {
    pub mod page;
    pub mod recording;
    pub mod rig;
}

use std::collections::BTreeMap;
use std::io::Read;
use std::net::TcpStream;
use std::process::Child;
use std::time::{Duration, Instant};

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rustix::process::Signal;

use soak::page::{Figures, Row};
use soak::recording::{Recorded, recorded};
use soak::rig::{Rig, signal, until};

/// Ticks from the last keep-alive request until the device vents (`watch.host_silence_ticks`), the time between two of these
/// requests, and as much again for what is on its way.
const SILENCE: u64 = 1_000 + 100 + 100;
/// Ticks for a vent that a program requests: the program starts, connects and says hello.
const REQUESTED: u64 = 1_000;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    Killed,
    Suspended,
    Cable,
    FullDisk,
    TwoHosts,
    Deaf,
    Noise,
    Starved,
    Vent,
    Nothing,
}

const FAULTS: [Fault; 10] = [
    Fault::Killed,
    Fault::Suspended,
    Fault::Cable,
    Fault::FullDisk,
    Fault::TwoHosts,
    Fault::Deaf,
    Fault::Noise,
    Fault::Starved,
    Fault::Vent,
    Fault::Nothing,
];

impl Fault {
    fn description(self) -> &'static str {
        match self {
            Self::Killed => "the program of the run is stopped by force",
            Self::Suspended => "the computer sleeps for 3 s: all programs stop, then the clock jumps",
            Self::Cable => "the cable is pulled for 2 s",
            Self::FullDisk => "the disk is full",
            Self::TwoHosts => "a second program tries to run",
            Self::Deaf => "programs that do not read, at the line and at the page",
            Self::Noise => "bits change on the line for 2 s",
            Self::Starved => "a slow disk: the program pauses for 0.1 s ten times",
            Self::Vent => "another program vents",
            Self::Nothing => "none: Ctrl-C",
        }
    }

    /// Ticks within which the muscle is vented.
    fn within(self) -> u64 {
        match self {
            Self::Killed | Self::Suspended | Self::Cable | Self::FullDisk => SILENCE,
            _ => REQUESTED,
        }
    }
}

/// Ends a run by Ctrl-C, in tick `.0`; gives until when it vented.
fn interrupted(rig: &Rig, run: &Child) -> u64 {
    let begun = rig.plant.ticks();
    signal(run, Signal::INT);
    rig.vented_after(begun)
}

/// Lets one fault happen to a run; gives the ticks until the vent, and whether the run ends as a success.
fn happens(fault: Fault, rig: &mut Rig, run: &mut Child) -> (u64, bool) {
    let begun = rig.plant.ticks();
    match fault {
        Fault::Killed => {
            run.kill().expect("it is killed");
            (rig.vented_after(begun), false)
        }
        Fault::Suspended => {
            let programs = [&*run, rig.studio.process(), rig.recorder.process()];
            programs.iter().for_each(|program| signal(program, Signal::STOP));
            std::thread::sleep(Duration::from_secs(3));
            let vented = rig.vented_after(begun);
            let programs = [&*run, rig.studio.process(), rig.recorder.process()];
            programs.iter().for_each(|program| signal(program, Signal::CONT));
            (vented, false)
        }
        Fault::Cable => {
            rig.line.cut(true);
            let vented = rig.vented_after(begun);
            std::thread::sleep(Duration::from_secs(2));
            rig.line.cut(false);
            (vented, false)
        }
        // The run was started with a bound on its files and ends on its own.
        Fault::FullDisk => {
            until("the run ends", || run.try_wait().is_ok_and(|ended| ended.is_some()));
            (rig.vented_after(rig.plant.ticks()), false)
        }
        Fault::TwoHosts => {
            let second = rig
                .host(&["run", "--pressure", "300", "--seconds", "1", "-o", "second.csv", "--replace"], None);
            let refused = second.wait_with_output().expect("it ends");
            let said = String::from_utf8_lossy(&refused.stderr);
            assert!(said.contains("device::in-use"), "a second run: {said}");
            assert!(!rig.plant.is_vented(), "the first run continues");
            (interrupted(rig, run), true)
        }
        Fault::Deaf => {
            let at_line = TcpStream::connect(rig.line.address()).expect("the line");
            let at_page = rig.studio.watched_by_no_one();
            std::thread::sleep(Duration::from_secs(2));
            assert!(!rig.plant.is_vented(), "the run continues");
            let vented = interrupted(rig, run);
            drop((at_line, at_page));
            (vented, true)
        }
        Fault::Noise => {
            rig.line.disturb(true);
            std::thread::sleep(Duration::from_secs(2));
            rig.line.disturb(false);
            // A run that met a damaged frame asked again.
            if rig.plant.is_vented() { (0, false) } else { (interrupted(rig, run), true) }
        }
        Fault::Starved => {
            for _ in 0..10 {
                signal(run, Signal::STOP);
                std::thread::sleep(Duration::from_millis(100));
                signal(run, Signal::CONT);
                std::thread::sleep(Duration::from_millis(100));
            }
            assert!(!rig.plant.is_vented(), "the run continues");
            (interrupted(rig, run), true)
        }
        Fault::Vent => {
            let vent = rig.host(&["vent"], None);
            let vented = rig.vented_after(begun);
            let said = vent.wait_with_output().expect("it ends");
            assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
            (vented, false)
        }
        Fault::Nothing => (interrupted(rig, run), true),
    }
}

/// One run with one fault; says whether the run lasted until the fault.
fn round(number: u32, fault: Fault, rig: &mut Rig, row: &mut Row) -> bool {
    let name = format!("run-{number}.csv");
    let wave = format!("sine mean=250 amplitude=60 frequency={}", 0.2 + 0.1 * f64::from(number % 5));
    let arguments = ["run", "--pressure", &wave, "--seconds", "900", "-o", &name];
    // As much as the samples of some seconds need.
    let limit = (fault == Fault::FullDisk).then_some(512 << 10);
    let mut run = rig.host(&arguments, limit);
    until(&format!("{fault:?}: the run starts"), || {
        let ended = run.try_wait().is_ok_and(|ended| ended.is_some());
        assert!(!ended, "{fault:?}: the run does not start: {}", said(&mut run));
        !rig.plant.is_vented() && rig.plant.pressure_pa() > 150e3
    });
    // Some thousand samples are on the disk.
    let part = rig.folder().join(format!("{name}.part"));
    let mut ended = false;
    until(&format!("{fault:?}: samples are recorded"), || {
        // One on a full disk ends on its own, but later.
        ended = fault != Fault::FullDisk && run.try_wait().is_ok_and(|ended| ended.is_some());
        ended || std::fs::metadata(&part).is_ok_and(|file| file.len() > 100_000)
    });
    if ended {
        // A machine with too many other tasks let the program wait for longer than the controller does.
        let why = said(&mut run);
        assert!(
            why.contains("host-silence") || why.contains("the host was silent"),
            "{fault:?}: the run ends: {why}"
        );
        assert!(rig.plant.is_vented());
        rig.revive();
        rig.clear();
        return false;
    }
    let (ticks, succeeds) = happens(fault, rig, &mut run);
    assert!(ticks <= fault.within(), "{fault:?}: vented after {ticks} ticks");
    let ended = run.wait().expect("it ends");
    assert_eq!(ended.success(), succeeds, "{fault:?}: {}", said(&mut run));
    let path = rig.folder().join(&name);
    let whole = path.exists();
    let Recorded { samples, missing, reported } = if whole { recorded(&path) } else { rig.recovered(&name) };
    assert!(samples > 300, "{fault:?}: {samples} samples");
    // A recording that was cut off has no report of the line; its ticks show what is missing.
    // A full disk may end it before a row that was counted.
    let right = if fault == Fault::FullDisk { missing <= reported } else { missing == reported };
    assert!(!whole || right, "{fault:?}: {missing} samples are missing, the recording reports {reported}");
    row.add(ticks, samples, missing);
    // The recorder ends with the cable, and where it stood still for long: the next one begins.
    rig.revive();
    rig.clear();
    true
}

/// What a program that has ended printed.
fn said(run: &mut Child) -> String {
    let mut text = String::new();
    let ended = run.try_wait().is_ok_and(|ended| ended.is_some());
    if let Some(stderr) = run.stderr.as_mut().filter(|_| ended) {
        let _ = stderr.read_to_string(&mut text);
    }
    text
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
fn every_fault_ends_vented_no_sample_is_missing_unreported_and_nothing_leaks() {
    let long = std::env::var_os("PAM_LONG").is_some();
    let seconds = number("PAM_SOAK_SECONDS").unwrap_or(if long { 3_600 } else { 45 });
    let seed = number("PAM_SOAK_SEED").unwrap_or(1);
    let mut rig = Rig::start();
    let mut rows: BTreeMap<Fault, Row> = FAULTS.into_iter().map(|fault| (fault, Row::default())).collect();
    let mut random = StdRng::seed_from_u64(seed);
    let begun = Instant::now();
    let (mut count, mut stalls, mut first) = (0_u32, 0_u32, None);
    let mut left: Vec<Fault> = Vec::new();
    while begun.elapsed() < Duration::from_secs(seconds) {
        // Each fault once before any of them a second time.
        if left.is_empty() {
            left = FAULTS.to_vec();
        }
        let fault = left.swap_remove(random.random_range(0..left.len()));
        if let Some(row) = rows.get_mut(&fault)
            && !round(count, fault, &mut rig, row)
        {
            left.push(fault);
            stalls += 1;
            eprintln!("the machine was too busy for a run");
            assert!(stalls <= 1 + count / 20, "the machine is too busy for this test");
        }
        count += 1;
        // What a program needs once is not a leak.
        if count == 5 {
            first = Some(rig.studio.needs());
        }
        eprintln!("{:5} s  {count:4}  {fault:?}", begun.elapsed().as_secs());
    }
    let last = rig.studio.needs();
    let first = first.unwrap_or(last);
    assert!(last.files <= first.files + 8, "the studio holds {} files, {} at first", last.files, first.files);
    assert!(last.threads <= first.threads + 4, "{} threads, {} at first", last.threads, first.threads);
    let grown = last.memory.saturating_sub(first.memory);
    assert!(grown < 48 << 20, "the studio has grown by {} MiB", grown >> 20);
    assert_eq!(rig.studio.restarts(), 0, "the studio ran all the time");
    let figures = Figures {
        seconds: begun.elapsed().as_secs(),
        seed,
        ticks: rig.plant.ticks(),
        dropped: rig.line.dropped(),
        recordings: rig.recordings(),
        needs: [first, last],
        rows: rows.into_iter().map(|(fault, row)| (fault.description(), fault.within(), row)).collect(),
    };
    eprintln!("{}", figures.table());
    if std::env::var("PAM_SOAK_PAGE").is_ok_and(|wish| wish == "write") {
        figures.write();
    }
}
