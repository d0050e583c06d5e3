//! A controller on a CAN bus behind a serial adapter: the firmware's server and control loop, the codec of both ends, an adapter that
//! keeps to the slcan protocol, and adapters that do not.
#![cfg(unix)]

use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use emulator_tests::follower::Follower;
use emulator_tests::program;
use firmware::board::Outputs;
use firmware::native::{Device, Options};
use model_core::image;
use model_core::link::can::{Address as Place, Format, Receiver, Route, Sender, VENT};
use model_core::link::endpoints::{Disarm, Endpoint, GetSettings, GetStatus, SetTelemetry, StartMode, Stop};
use model_core::link::frame::{Header, Kind, MAX_WIRE, encode};
use model_core::link::messages::{Mode, SetPoint, Side, Start, State, TelemetryRate};
use pam_device::error::DeviceCode;
use pam_device::run::{arm, vent};
use pam_device::slcan::{Parser, Received, transmit};
use pam_device::{Address, Client, Port, Topic, tables};

/// What an adapter does wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Vice {
    None,
    /// It never answers a line.
    Mute,
    /// Every n-th message of the device is lost.
    Loses(u32),
    /// Between the lines there are others that mean nothing, of every kind.
    Chatters,
    /// It takes no message: the bus has no other node.
    RefusesMessages,
    RefusesTheRate,
    /// It is something else.
    Login,
}

/// A controller whose muscle follows its command within 30 ms, at an address of the bus.
struct Node {
    place: Place,
    stream: TcpStream,
    /// Vents as the firmware's interrupt does, by the requests that it replaces.
    to: Receiver,
    from: Sender,
}

impl Node {
    fn new(place: Place, device: &Device) -> Self {
        let stream = TcpStream::connect(device.address()).expect("a controller");
        stream.set_read_timeout(Some(Duration::from_millis(1))).expect("a time-out");
        Self { place, stream, to: Receiver::new(Format::Classic), from: Sender::new(Format::Classic) }
    }

    fn take(&mut self, identifier: u16, data: &[u8]) {
        let mut bytes: Vec<u8> = Vec::new();
        match Route::of(identifier) {
            Some(Route::To(place)) if place == self.place => bytes.extend(self.to.take(data)),
            Some(Route::ToAll) if data == VENT => {
                for id in [Stop::ID, Disarm::ID] {
                    let mut wire = [0; MAX_WIRE];
                    let header = Header { kind: Kind::Request, id, sequence: 0 };
                    let length = encode(header, &(), &mut wire).expect("a frame");
                    bytes.extend_from_slice(&wire[..length]);
                }
            }
            _ => return,
        }
        self.stream.write_all(&bytes).expect("the controller takes it");
    }

    fn give(&mut self) -> Vec<String> {
        let mut bytes = [0; 4096];
        let count = self.stream.read(&mut bytes).unwrap_or(0);
        let mut lines = Vec::new();
        let identifier = Route::From(self.place).identifier();
        self.from.send(&bytes[..count], |message| lines.push(transmit(identifier, message)));
        lines
    }
}

struct Adapter {
    near: File,
    nodes: Vec<Node>,
    vice: Vice,
    parser: Parser,
    sent: u32,
    is_open: bool,
}

const NOISE: [&str; 8] = [
    "t2019AA\r",
    "T000002018AABB\r",
    "t201\r",
    "\x07",
    "r2010\r",
    "F00\r",
    "\u{fffd}\u{1}t201811\r",
    "V1013\r",
];

impl Adapter {
    fn answer(&mut self, text: &str) {
        if self.vice != Vice::Mute {
            let _ = self.near.write_all(text.as_bytes());
        }
    }

    /// A line that is none of a message: the commands of the channel.
    fn command(&mut self, line: &[u8]) {
        match (self.vice, line) {
            (Vice::Login, _) => self.answer("login: \r"),
            (Vice::RefusesTheRate, [b'S', ..]) => self.answer("\x07"),
            (_, [b'C']) if !self.is_open => self.answer("\x07"),
            (_, [b'O' | b'C' | b'S', ..]) => {
                self.is_open = line[0] == b'O';
                self.answer("\r");
            }
            (_, [b't', ..]) => {
                let mut said = line.iter().chain(b"\r").filter_map(|byte| self.parser.push(*byte));
                let Some(Received::Message(identifier, data)) = said.next() else {
                    panic!("a message: {line:?}")
                };
                drop(said);
                assert!(self.is_open, "the channel is open");
                if self.vice == Vice::RefusesMessages {
                    return self.answer("\x07");
                }
                self.nodes.iter_mut().for_each(|node| node.take(identifier, &data));
                self.answer("z\r");
            }
            _ => self.answer("\r"),
        }
    }

    fn run(mut self, ends: &AtomicBool) {
        let mut line = Vec::new();
        while !ends.load(Ordering::Relaxed) {
            let mut bytes = [0; 1024];
            let count = self.near.read(&mut bytes).unwrap_or(0);
            for byte in &bytes[..count] {
                if *byte == b'\r' {
                    self.command(&std::mem::take(&mut line));
                } else {
                    line.push(*byte);
                }
            }
            let given: Vec<String> = self.nodes.iter_mut().flat_map(Node::give).collect();
            for one in given {
                self.sent += 1;
                let lost = matches!(self.vice, Vice::Loses(every) if self.sent.is_multiple_of(every));
                if self.vice == Vice::Chatters {
                    self.answer(NOISE[self.sent as usize % NOISE.len()]);
                }
                if self.is_open && !lost {
                    let _ = self.near.write_all(one.as_bytes());
                }
            }
            if count == 0 {
                thread::sleep(Duration::from_millis(1));
            }
        }
    }
}

/// Controllers at the first addresses of a bus, and the adapter's serial device.
struct Bus {
    path: String,
    ends: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
    _devices: Vec<Device>,
    /// Keeps the far end open, or reads of the near end fail until the host has opened it.
    _far: File,
}

impl Bus {
    fn new(count: usize, vice: Vice) -> Self {
        let devices: Vec<Device> = (0..count)
            .map(|_| {
                let mut muscle = Follower::default();
                let plant = move |outputs: &Outputs| muscle.exchange(outputs);
                Device::start("127.0.0.1:0", Options::default(), plant).expect("a controller")
            })
            .collect();
        let nodes = Place::all().zip(&devices).map(|(place, device)| Node::new(place, device)).collect();
        let (near, path) = open_pty();
        let far = File::options().read(true).write(true).open(&path).expect("the far end");
        let ends = Arc::new(AtomicBool::new(false));
        let adapter = Adapter { near, nodes, vice, parser: Parser::default(), sent: 0, is_open: false };
        let until = Arc::clone(&ends);
        let thread = Some(thread::spawn(move || adapter.run(&until)));
        Self { path, ends, thread, _devices: devices, _far: far }
    }

    fn address(&self, device: &str) -> Address {
        format!("slcan:{},address={device}", self.path).parse().expect("an address")
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
            && !thread::panicking()
        {
            panic!("the adapter stopped");
        }
    }
}

fn open_pty() -> (File, String) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&near).and_then(|()| unlockpt(&near)).expect("its far end");
    let path = ptsname(&near, Vec::new()).expect("its path").into_string().expect("text");
    let mut raw = rustix::termios::tcgetattr(&near).expect("its settings");
    raw.make_raw();
    rustix::termios::tcsetattr(&near, rustix::termios::OptionalActions::Now, &raw).expect("raw");
    rustix::io::ioctl_fionbio(&near, true).expect("it does not wait");
    (File::from(near), path)
}

fn run_at(client: &mut Client, pascals: f32) {
    arm(client).expect("it arms");
    let start = Start { mode: Mode::Pressure, session: client.session() };
    client.call::<StartMode>(&start).expect("it starts");
    client.set_point(SetPoint::Pressure(pascals)).expect("a setpoint");
}

#[test]
fn a_table_is_sent_over_the_bus_and_a_run_is_controlled_and_vented_there() {
    for vice in [Vice::None, Vice::Mute, Vice::Chatters] {
        let bus = Bus::new(1, vice);
        let mut client = Client::open(&bus.address("1")).unwrap_or_else(|e| panic!("{vice:?}: {e}"));
        let mut image = [0; image::MAX_LEN];
        let table = image::write(&model_core::table::example(), &mut image).expect("an image").to_vec();
        let kept = tables::write(&mut client, Side::Agonist, &table, |_| {}).expect("a table");
        assert_eq!(kept.length as usize, table.len());
        assert_eq!(tables::read(&mut client, Side::Agonist).expect("it reads"), Some(table));
        run_at(&mut client, 200e3);
        client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 20 }).expect("a rate");
        let mut samples = 0;
        while samples < 10 {
            client.keep_alive().expect("it is the owner");
            let topic = client.topic(Duration::from_secs(2)).expect("the line").expect("a topic");
            samples += u32::from(matches!(topic, Topic::Telemetry(_)));
        }
        assert_eq!(client.losses().bad_frames, 0, "{vice:?}");
        let mut beside = client.vent_line().expect("a second handle");
        beside.send().expect("it vents");
        let deadline = std::time::Instant::now() + Duration::from_secs(5);
        while client.call::<GetStatus>(&()).expect("a status").state != State::Disarmed {
            assert!(std::time::Instant::now() < deadline, "{vice:?}: not vented");
        }
    }
}

#[test]
fn lost_messages_cost_repeats_and_nothing_else() {
    let bus = Bus::new(1, Vice::Loses(90));
    let mut client = Client::open(&bus.address("1")).expect("a controller answers");
    // An answer has 53 messages: of some, one is lost.
    for _ in 0..10 {
        client.call::<GetSettings>(&()).expect("settings");
    }
    assert!(client.losses().repeats > 0, "{:?}", client.losses());
    vent(&mut client).expect("it vents");
}

#[test]
fn each_address_is_a_controller_and_one_command_vents_all() {
    let bus = Bus::new(2, Vice::None);
    {
        let mut client = Client::open(&bus.address("2")).expect("a controller answers");
        run_at(&mut client, 200e3);
        assert_eq!(client.call::<GetStatus>(&()).expect("a status").state, State::Running);
    }
    let error = Client::open(&bus.address("all")).expect_err("none of them");
    assert_eq!(error.exit_status(), 2, "{error}");
    let port = bus.address("all").to_string();
    let output = Command::new(program::path()).args(["vent", "--port", &port]).output().expect("the program");
    assert!(output.status.success(), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("these addresses answer: 1, 2"), "{output:?}");
    let mut client = Client::open(&bus.address("2")).expect("a controller answers");
    assert_eq!(client.call::<GetStatus>(&()).expect("a status").state, State::Disarmed);
}

#[test]
fn an_address_without_a_device_and_an_adapter_that_refuses_are_reported() {
    let error_of = |bus: &Bus, device: &str| Client::open(&bus.address(device)).expect_err("nobody answers");
    let bus = Bus::new(1, Vice::None);
    let error = error_of(&bus, "3");
    assert_eq!(error.code(), DeviceCode::DeviceSilent);
    assert!(error.cause().contains("this address of the CAN bus"), "{error}");
    assert!(error.advice().is_some_and(|help| help.contains("can.address")));
    let error = error_of(&Bus::new(1, Vice::RefusesMessages), "1");
    assert_eq!(error.code(), DeviceCode::DeviceSilent);
    assert!(error.cause().contains("the CAN adapter refuses"), "{error}");
    let error = error_of(&Bus::new(1, Vice::RefusesTheRate), "1");
    assert_eq!(error.code(), DeviceCode::DevicePort);
    assert!(error.cause().contains("refuses 500 kbit/s"), "{error}");
    let error = error_of(&Bus::new(1, Vice::Login), "1");
    assert_eq!(error.code(), DeviceCode::DeviceForeign);
    assert!(error.cause().contains("not a CAN adapter"), "{error}");
    let error =
        Port::open(&"slcan:/dev/no-such-device,address=1".parse().expect("an address")).expect_err("no port");
    assert_eq!(error.code(), DeviceCode::DevicePort);
}
