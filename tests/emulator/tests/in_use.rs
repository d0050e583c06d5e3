//! Two programs on the line of one controller: what one has started obeys that one alone, and each may read and vent.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use emulator_tests::follower::Follower;
use emulator_tests::machine::Folder;
use emulator_tests::{patience, program, shared_line};
use firmware::board::Outputs;
use firmware::native::{Device, Options};
use model_core::link::endpoints::{GetStatus, StartMode};
use model_core::link::messages::{Mode, Reference, SetPoint, Start, State};
use pam_device::error::DeviceCode;
use pam_device::run::{arm, release, vent};
use pam_device::{Address, Client};

/// A controller whose muscle follows its command within 30 ms.
fn device() -> Device {
    let mut muscle = Follower::default();
    let plant = move |outputs: &Outputs| muscle.exchange(outputs);
    Device::start("127.0.0.1:0", Options::default(), plant).expect("a controller")
}

fn open(line: SocketAddr) -> Client {
    let address = Address::Tcp { host: line.ip().to_string(), port: line.port() };
    Client::open(&address).expect("a controller answers")
}

#[test]
fn a_second_client_reads_and_vents_and_gives_no_orders() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let (mut owner, mut other) = (open(line), open(line));
    arm(&mut owner).expect("it arms");
    let start = Start { mode: Mode::Pressure, session: owner.session() };
    owner.call::<StartMode>(&start).expect("it starts");
    owner.set_point(SetPoint::Pressure(300e3)).expect("a setpoint");

    let in_use = |outcome: Option<pam_data::error::Error>, what: &str| {
        let error = outcome.unwrap_or_else(|| panic!("{what} is obeyed"));
        assert_eq!(error.code(), DeviceCode::DeviceInUse, "{what}: {error}");
    };
    in_use(other.set_point(SetPoint::Pressure(500e3)).err(), "a setpoint");
    let wave = Reference::Sine { mean: 400e3, amplitude: 50e3, frequency_hz: 1.0 };
    in_use(other.reference(wave).err(), "a reference");
    owner.keep_alive().expect("it is the owner");
    for mode in [Mode::Vent, Mode::Pressure] {
        let start = Start { mode, session: other.session() };
        in_use(other.call::<StartMode>(&start).err(), "a start");
    }
    owner.set_point(SetPoint::Pressure(310e3)).expect("its own run obeys the owner");
    let status = other.call::<GetStatus>(&()).expect("each may read");
    assert_eq!((status.state, status.mode), (State::Running, Mode::Pressure));
    let status = vent(&mut other).expect("each may vent");
    assert_eq!(status.state, State::Disarmed);
    in_use_no_more(&mut other);
}

/// What was vented is free.
fn in_use_no_more(client: &mut Client) {
    arm(client).expect("it arms");
    let start = Start { mode: Mode::Pressure, session: client.session() };
    client.call::<StartMode>(&start).expect("it starts");
    vent(client).expect("it vents");
}

fn host(line: SocketAddr, folder: &Folder, arguments: &[&str]) -> Command {
    let mut command = Command::new(program::path());
    let port = format!("tcp:{line}");
    command.args(arguments).args(["--port", &port]).current_dir(folder.path()).stdin(Stdio::null());
    command
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A program whose run at 250 kPa is recorded in `first.csv`.
fn running(line: SocketAddr, folder: &Folder, seconds: &str) -> Child {
    let run = ["run", "--pressure", "250", "--seconds", seconds, "-o", "first.csv"];
    let first = host(line, folder, &run).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut watch = open(line);
    until("the run starts", || watch.call::<GetStatus>(&()).expect("an answer").state == State::Running);
    first.expect("the program starts")
}

fn until(what: &str, happens: impl FnMut() -> bool) {
    patience::until(Duration::from_secs(60), what, happens);
}

/// Ticks of the samples in a recording.
fn ticks(folder: &Folder, name: &str) -> Vec<u64> {
    let text = std::fs::read_to_string(folder.path().join(name)).expect("a recording");
    let mut rows = text.lines();
    let names: Vec<&str> = rows.next().expect("a header").split(',').collect();
    let at = names.iter().position(|name| *name == "time_s").expect("a time");
    rows.filter_map(|row| row.split(',').nth(at)?.parse::<f64>().ok())
        .map(|seconds| (seconds * 1e3).round() as u64)
        .collect()
}

#[test]
fn a_question_of_another_program_does_not_displace_the_owner() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let (mut owner, mut other) = (open(line), open(line));
    assert!(!other.is_owned_by_another().expect("an answer"), "a disarmed device has no owner");
    arm(&mut owner).expect("it arms");
    assert!(other.is_owned_by_another().expect("an answer"));
    assert!(!owner.is_owned_by_another().expect("an answer"));
    for _ in 0..20 {
        // The refusal to the other program passes on this line, too.
        let _ = owner.topic(Duration::from_millis(10)).expect("the line is there");
        owner.keep_alive().expect("it is still the owner");
    }
    assert!(owner.controls());
    assert_eq!(release(&mut other).expect("an answer").state, State::Armed, "it is not the other's to vent");
    assert_eq!(release(&mut owner).expect("an answer").state, State::Disarmed);
}

#[test]
fn a_second_program_that_records_leaves_the_stream_of_the_first_one_as_it_is() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let folder = Folder::new();
    let first = running(line, &folder, "5");
    let slow = ["record", "--seconds", "1", "--rate", "10", "-o", "second.csv"];
    let second = host(line, &folder, &slow).output().expect("the program starts");
    assert!(second.status.success(), "{}", error_of(&second));
    let first = first.wait_with_output().expect("it ends");
    assert!(first.status.success(), "{}", error_of(&first));
    let steps: Vec<u64> = ticks(&folder, "first.csv").windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(steps.len() > 4_500, "{} samples of 5 s", steps.len());
    assert!(steps.iter().all(|step| *step == 1), "the second program has changed the rate of the first one");
    let slow = ticks(&folder, "second.csv");
    assert!((9..=11).contains(&slow.len()), "{} samples of 1 s at 10 Hz", slow.len());
    assert!(slow.windows(2).all(|pair| pair[1] - pair[0] == 100), "{slow:?}");
}

#[test]
fn a_run_that_ends_leaves_the_stream_of_a_recording_that_began_before() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let folder = Folder::new();
    let watch = ["record", "--seconds", "6", "-o", "watched.csv"];
    let watching = host(line, &folder, &watch).stderr(Stdio::piped()).spawn().expect("the program starts");
    until("the recording begins", || {
        std::fs::metadata(folder.path().join("watched.csv.part")).is_ok_and(|file| file.len() > 10_000)
    });
    let run = ["run", "--pressure", "250", "--seconds", "1", "--rate", "100", "-o", "run.csv"];
    let run = host(line, &folder, &run).output().expect("the program starts");
    assert!(run.status.success(), "{}", error_of(&run));
    let watching = watching.wait_with_output().expect("it ends");
    assert!(watching.status.success(), "{}", error_of(&watching));
    let ticks = ticks(&folder, "watched.csv");
    assert!(ticks.windows(2).all(|pair| pair[1] - pair[0] == 1), "samples are missing");
}

#[test]
fn a_run_that_another_program_vents_ends_with_an_error() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let folder = Folder::new();
    let first = running(line, &folder, "60");
    let vent = host(line, &folder, &["vent"]).output().expect("the program starts");
    assert!(vent.status.success(), "{}", error_of(&vent));
    let first = first.wait_with_output().expect("it ends");
    assert_eq!(first.status.code(), Some(1));
    assert!(error_of(&first).contains("another program has vented"), "{}", error_of(&first));
}

#[cfg(unix)]
#[test]
fn a_studio_that_only_watches_ends_without_venting_the_run_of_another_program() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let folder = Folder::new();
    let first = running(line, &folder, "5");
    let studio = host(line, &folder, &["studio", "-o", "page"]).stdout(Stdio::piped()).spawn();
    let mut studio = studio.expect("the program starts");
    let mut ready = String::new();
    let answers = studio.stdout.take().expect("its answers");
    BufReader::new(answers).read_line(&mut ready).expect("its address");
    assert!(ready.contains("http://127.0.0.1"), "{ready}");
    // Without a page for longer than an armed controller may be.
    std::thread::sleep(Duration::from_millis(1_800));
    let id = rustix::process::Pid::from_child(&studio);
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("it is interrupted");
    assert!(studio.wait().expect("it ends").success());
    let first = first.wait_with_output().expect("it ends");
    assert!(first.status.success(), "the run of another program is vented: {}", error_of(&first));
    assert!(ticks(&folder, "first.csv").len() > 4_500);
}

#[test]
fn a_second_run_is_refused_and_the_first_one_is_recorded_whole() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let folder = Folder::new();
    let first = running(line, &folder, "6");
    let second = ["run", "--pressure", "400", "--seconds", "1", "-o", "second.csv"];
    let refused = host(line, &folder, &second).output().expect("the program starts");
    assert_eq!(refused.status.code(), Some(1), "{}", error_of(&refused));
    assert!(error_of(&refused).contains("error[device::in-use]"), "{}", error_of(&refused));
    let first = first.wait_with_output().expect("it ends");
    assert!(first.status.success(), "{}", error_of(&first));
    let text = std::fs::read_to_string(folder.path().join("first.csv")).expect("its recording");
    let mut rows = text.lines();
    let names: Vec<&str> = rows.next().expect("a header").split(',').collect();
    let column = names.iter().position(|name| name.starts_with("pressure_")).expect("a pressure");
    assert_eq!(names[column], "pressure_Pa");
    let values: Vec<f64> = rows
        .filter_map(|row| row.split(',').nth(column)?.parse().ok())
        .map(|pascals: f64| pascals / 1e3)
        .collect();
    assert!(values.len() > 5_500, "{} samples of 6 s", values.len());
    let largest = values.iter().copied().fold(0.0, f64::max);
    let settled = &values[values.len() / 2..];
    assert!(largest < 300.0, "{largest} kPa: the second program has had its way");
    assert!(settled.iter().all(|pressure| *pressure > 240.0), "the first run ends early");
}
