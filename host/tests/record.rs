//! Recordings outlive what goes wrong: a program that is stopped, a device that is gone, a disk that is full.

#![cfg(unix)]
#![allow(clippy::unwrap_used)] // what fails here fails the test

#[path = "../device/tests/common/line.rs"]
mod line;

use std::io::Write;
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use model_core::link::endpoints::{Endpoint, SetTelemetry};
use model_core::link::frame::{self, Header, MAX_WIRE, encode};
use model_core::link::messages::TelemetryRate;
use pam_data::recording::{Reader, Recording};
use pam_device::Address;
use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::recorder::side_file;
use rustix::process::{Pid, Signal, kill_process};
use virtual_bench::bench::BenchSpec;
use virtual_bench::plant::Motion;
use virtual_bench::presets;

fn controller() -> Emulated {
    let spec = BenchSpec::laboratory(presets::miniature(), 3);
    let motion = Motion::Sine { mean_mm: 0.6, amplitude_mm: 0.2, frequency_hz: 0.5 };
    Emulated::start(Stand::new(spec, motion), Some(Kind::Native), 1.0).unwrap()
}

fn host(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host"));
    command.args(arguments).current_dir(folder).env("PAM_SETTINGS", "");
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

fn read(file: &Path) -> Recording {
    Reader::new().file(file).unwrap_or_else(|e| panic!("{}: {e}", file.display())).remove(0)
}

/// How long to wait for what must happen: what has not by then never will.
const HOPELESS: Duration = Duration::from_secs(120);

/// Rows that a file has.
fn rows(file: &Path) -> usize {
    std::fs::read(file).unwrap().iter().filter(|byte| **byte == b'\n').count()
}

/// Rows that are written together as a file grows, in the middle of some pieces.
fn piece(file: &Path) -> usize {
    let end = Instant::now() + HOPELESS;
    let (mut pieces, mut last) = (Vec::new(), rows(file));
    while pieces.len() < 15 {
        assert!(Instant::now() < end, "{} does not grow", file.display());
        let now = rows(file);
        if now > last {
            pieces.push(now - last);
            last = now;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    pieces.sort_unstable();
    pieces[pieces.len() / 2]
}

/// Waits until a file has this size, bytes.
fn grown(file: &Path, bytes: u64) {
    let end = Instant::now() + HOPELESS;
    while std::fs::metadata(file).map_or(0, |m| m.len()) < bytes {
        assert!(Instant::now() < end, "{} does not grow", file.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn start(folder: &Path, port: &str, more: &[&str]) -> Child {
    let line = [&["record", "--port", port, "-o", "run.csv", "-o", "run.mcap"], more].concat();
    host(folder, &line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn both_forms_hold_the_same_samples_and_their_origin() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    let port = controller.address().to_string();
    let output = start(folder.path(), &port, &["--seconds", "1"]).wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let (csv, mcap) = (folder.path().join("run.csv"), folder.path().join("run.mcap"));
    let (a, b) = (read(&csv), read(&mcap));
    assert!((995..=1000).contains(&a.len()), "{} samples of a second at 1 kHz", a.len());
    assert_eq!((&a.time, &a.pressure, &a.stroke), (&b.time, &b.pressure, &b.stroke));
    assert_eq!((&a.force, &a.pressure_command), (&b.force, &b.pressure_command));
    let about: serde_json::Value = serde_json::from_slice(&std::fs::read(side_file(&csv)).unwrap()).unwrap();
    assert_eq!(about["schema"], "pam-record/1");
    assert_eq!(about["host"], env!("CARGO_PKG_VERSION"));
    assert_eq!(about["rows"], a.len());
    assert!(about["device"]["settings"]["limits"].is_object() && about["device"]["schema"].is_string());
    assert!(about["device"]["tables"].is_array() && about["losses"]["samples"] == 0);
    // The same is in the MCAP itself.
    let bytes = std::fs::read(&mcap).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    for word in
        ["device.release", "device.schema", "device.tables", "device.settings", "pam.Telemetry", "about.json"]
    {
        assert!(text.contains(word), "{word}");
    }
    // A second one of the same name is refused, and nothing happens to the first.
    let again = host(folder.path(), &["record", "--port", &port, "-o", "run.csv"]).output().unwrap();
    assert!(again.status.code() == Some(2) && said(&again).contains("--replace"), "{}", said(&again));
    assert_eq!(read(&csv).len(), a.len());
}

#[test]
fn a_program_that_is_killed_leaves_all_but_the_last_moment() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    let mut child = start(folder.path(), &controller.address().to_string(), &[]);
    let (csv, mcap) = (folder.path().join("run.csv.part"), folder.path().join("run.mcap.part"));
    grown(&csv, 60_000);
    // What was collected since the last piece is lost: a tenth of a second, a hundred rows of a machine that keeps up.
    let (lost, seen) = (piece(&csv), rows(&csv));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(lost < 350, "{lost} rows are written together");
    assert!(rows(&csv) >= seen, "{seen} rows were there");
    let output = host(folder.path(), &["recover", "run.csv.part", "run.mcap.part"]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let (a, b) = (read(&folder.path().join("run.csv")), read(&folder.path().join("run.mcap")));
    assert!(!csv.exists() && !mcap.exists());
    // The one form is written right after the other.
    assert!(a.len().abs_diff(b.len()) <= 1_000, "{} rows of CSV and {} of MCAP", a.len(), b.len());
    let about = std::fs::read_to_string(side_file(&folder.path().join("run.csv"))).unwrap();
    assert!(about.contains("it was cut off") && about.contains("link_version"), "{about}");
}

#[test]
fn a_device_that_is_gone_ends_the_recording_and_keeps_it() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    let child = start(folder.path(), &controller.address().to_string(), &[]);
    grown(&folder.path().join("run.csv.part"), 40_000);
    drop(controller);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("error[device::silent]") && said(&output).contains("run.csv"),
        "{}",
        said(&output)
    );
    let (a, b) = (read(&folder.path().join("run.csv")), read(&folder.path().join("run.mcap")));
    assert!(a.len() > 100 && a.len() == b.len(), "{} and {}", a.len(), b.len());
    let about = std::fs::read_to_string(side_file(&folder.path().join("run.csv"))).unwrap();
    assert!(about.contains("connection"), "{about}");
}

/// A serial cable to a controller: a real pseudo-terminal, and what pulls it.
fn cable(controller: &Emulated) -> (std::path::PathBuf, TcpStream, std::fs::File) {
    let Address::Tcp { host, port } = controller.address() else {
        panic!("an emulated controller has a TCP port")
    };
    let far = TcpStream::connect((host.as_str(), *port)).unwrap();
    let (master, path) = line::open_pty();
    // Until the host has opened the far end, reads of the near one would fail.
    let keep = std::fs::OpenOptions::new().read(true).write(true).open(&path).unwrap();
    let (mut from_host, mut to_host) = (master.try_clone().unwrap(), master);
    let (mut to_controller, mut from_controller) = (far.try_clone().unwrap(), far.try_clone().unwrap());
    // Both ends of the line close when both threads have ended, as when a cable is pulled.
    std::thread::spawn(move || std::io::copy(&mut from_host, &mut to_controller));
    std::thread::spawn(move || std::io::copy(&mut from_controller, &mut to_host));
    (path, far, keep)
}

#[test]
fn a_cable_that_is_pulled_ends_the_recording_at_a_whole_row() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    let (path, line, _keep) = cable(&controller);
    let child = start(folder.path(), path.to_str().unwrap(), &[]);
    grown(&folder.path().join("run.csv.part"), 40_000);
    line.shutdown(Shutdown::Both).unwrap();
    let output = child.wait_with_output().unwrap();
    let message = said(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("error[device::") && message.contains(" until then in run.csv"), "{message}");
    let (a, b) = (read(&folder.path().join("run.csv")), read(&folder.path().join("run.mcap")));
    assert!(a.len() > 100 && a.len() == b.len(), "{} and {}", a.len(), b.len());
    let text = std::fs::read_to_string(folder.path().join("run.csv")).unwrap();
    assert!(text.ends_with('\n'), "the last row is whole");
    assert!(!folder.path().join("run.csv.part").exists());
}

/// Has the controller send one sample in `every_ticks` ticks, as another program on the line may.
fn stream(mut line: &TcpStream, every_ticks: u16) {
    let header = Header { kind: frame::Kind::Request, id: SetTelemetry::ID, sequence: 7 };
    // The zero ends a frame of the recording program.
    let mut wire = [0; MAX_WIRE];
    let length = encode(header, &TelemetryRate { every_ticks }, &mut wire[1..]).unwrap();
    line.write_all(&wire[..=length]).unwrap();
}

/// Waits until a file has this many bytes more than now.
fn grows(file: &Path, bytes: u64) {
    grown(file, std::fs::metadata(file).unwrap().len() + bytes);
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

#[test]
fn every_tick_that_the_rows_miss_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    let (path, line, _keep) = cable(&controller);
    let child = start(folder.path(), path.to_str().unwrap(), &["--json"]);
    let part = folder.path().join("run.csv.part");
    grown(&part, 20_000);
    // Another program makes the stream coarser, and ends it: the recorder requests it again.
    stream(&line, 20);
    grows(&part, 2_000);
    stream(&line, 0);
    grows(&part, 20_000);
    // The program does not run: the queues of the line and of the controller overflow.
    signal(&child, Signal::STOP);
    std::thread::sleep(Duration::from_secs(3));
    signal(&child, Signal::CONT);
    grows(&part, 20_000);
    signal(&child, Signal::INT);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let text = std::fs::read_to_string(folder.path().join("run.csv")).unwrap();
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|name| name == "tick").unwrap();
    let ticks: Vec<u64> = lines.map(|row| row.split(',').nth(at).unwrap().parse().unwrap()).collect();
    let missing: u64 = ticks.windows(2).map(|pair| pair[1] - pair[0] - 1).sum();
    // Half a second without a stream, at least.
    assert!(missing > 400, "{missing}");
    let json = |text: &[u8]| serde_json::from_slice::<serde_json::Value>(text).unwrap();
    let side = json(&std::fs::read(side_file(&folder.path().join("run.csv"))).unwrap());
    assert_eq!(side["losses"]["samples"], missing, "{}", side["losses"]);
    let answer = published_schemas::valid(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!(answer["losses"], side["losses"]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains(&format!("{missing} samples missing in ")), "{message}");
    let mcap = String::from_utf8_lossy(&std::fs::read(folder.path().join("run.mcap")).unwrap()).into_owned();
    assert!(
        mcap.contains(&format!("\"samples\": {missing}")) || mcap.contains(&format!("\"samples\":{missing}"))
    );
}

/// A file system of one megabyte, whose end no limit of the system imitates: then even the side file has no room.
#[test]
fn a_disk_without_room_keeps_every_row_that_fitted() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    let script = format!(
        "mkdir small && mount -t tmpfs -o size=1m none small || exit 77
         cd small && '{}' record --port {} -o run.csv -o run.mcap; ended=$?
         cd .. && cp -a small kept && exit $ended",
        env!("CARGO_BIN_EXE_host"),
        controller.address()
    );
    // A mount of one's own needs no rights where namespaces are allowed.
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &script])
        .current_dir(folder.path())
        .env("PAM_SETTINGS", "")
        .output()
        .unwrap();
    let message = said(&output);
    if output.status.code() == Some(77) || message.starts_with("unshare:") {
        eprintln!("skipped: no file system can be mounted here: {message}");
        return;
    }
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("error[file::unwritable]") && message.contains("No space left"), "{message}");
    let kept = folder.path().join("kept");
    let (a, b) = (read(&kept.join("run.csv")), read(&kept.join("run.mcap")));
    // One megabyte holds some thousand samples in both forms; both end within a few pieces of one another.
    assert!(a.len() > 1000 && a.len().abs_diff(b.len()) <= 600, "{} and {}", a.len(), b.len());
    let text = std::fs::read_to_string(kept.join("run.csv")).unwrap();
    assert!(text.ends_with('\n') && !kept.join("run.csv.part").exists());
    // What was known at the start is beside it.
    let about = std::fs::read_to_string(side_file(&kept.join("run.csv"))).unwrap();
    assert!(about.contains("link_version"), "{about}");
}

#[test]
fn a_full_disk_ends_the_files_at_a_whole_sample_with_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let controller = controller();
    // A limit of the system replaces a full disk: writes beyond it fail half-way.
    let script = format!(
        "trap '' XFSZ; ulimit -f 100; exec '{}' record --port {} -o run.csv -o run.mcap",
        env!("CARGO_BIN_EXE_host"),
        controller.address()
    );
    let output = Command::new("bash")
        .args(["-c", &script])
        .current_dir(folder.path())
        .env("PAM_SETTINGS", "")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("error[file::unwritable]") && said(&output).contains("run."),
        "{}",
        said(&output)
    );
    let (a, b) = (read(&folder.path().join("run.csv")), read(&folder.path().join("run.mcap")));
    assert!(a.len() > 100 && b.len() > 100, "{} and {}", a.len(), b.len());
    // The table of what a disk holds ends there, too: nothing was taken of a device such as /dev/full.
    let full = host(
        folder.path(),
        &["record", "--port", &controller.address().to_string(), "--folder", "/dev/full"],
    )
    .output()
    .unwrap();
    assert_eq!(full.status.code(), Some(1), "{}", said(&full));
}
