//! Two programs on the line of one controller: what one has started obeys that one alone, and each may read and vent.

use std::net::SocketAddr;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use emulator_tests::machine::Folder;
use emulator_tests::{program, shared_line};
use firmware::board::{Inputs, Outputs, Readings};
use firmware::native::{Device, Options};
use model_core::link::endpoints::{GetStatus, StartMode};
use model_core::link::messages::{Mode, Reference, SetPoint, Start, State};
use pam_device::error::DeviceCode;
use pam_device::run::{arm, vent};
use pam_device::{Address, Client};

/// A controller whose muscle follows its command within 30 ms.
fn device() -> Device {
    let (mut pressure_pa, mut tick) = (0.0_f32, 0_u32);
    let plant = move |outputs: &Outputs| {
        let command = outputs.sides[0];
        let target = if command.vent { 0.0 } else { command.pressure_pa };
        pressure_pa += (target - pressure_pa) / 31.0;
        tick += 1;
        // Live sensors never read the same twice.
        let wiggle = (tick % 7) as f32 - 3.0;
        let now =
            Readings { pressure_pa: pressure_pa + wiggle, stroke_m: 1e-7 * wiggle, force_n: 1e-3 * wiggle };
        Inputs { sides: [Some(now.into()), None], ..Inputs::default() }
    };
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

#[test]
fn a_second_run_is_refused_and_the_first_one_is_recorded_whole() {
    let device = device();
    let line = shared_line::share(device.address()).expect("a line");
    let folder = Folder::new();
    let run = ["run", "--pressure", "250", "--seconds", "6", "-o", "first.csv"];
    let first = host(line, &folder, &run).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let first = first.expect("the program starts");
    let mut watch = open(line);
    let deadline = Instant::now() + Duration::from_secs(60);
    while watch.call::<GetStatus>(&()).expect("an answer").state != State::Running {
        assert!(Instant::now() < deadline, "the run does not start");
        std::thread::sleep(Duration::from_millis(20));
    }
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
