//! The controller with its muscle, the line, and the programs on it.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use emulator_tests::faulty_line::FaultyLine;
use emulator_tests::follower::Follower;
use emulator_tests::machine::Folder;
use emulator_tests::{patience, program};
use firmware::board::Outputs;
use firmware::native::{Device, Options};
use model_core::link::endpoints::{ClearFault, GetStatus};
use model_core::link::messages::State;
use pam_device::{Address, Client};
use rustix::process::{Pid, Signal, kill_process};

use super::recording::{Recorded, recorded};

/// A machine with many other tasks needs some time; who waits longer waits for nothing.
const HOPELESS: Duration = Duration::from_secs(120);

pub fn until(what: &str, happens: impl FnMut() -> bool) {
    patience::until(HOPELESS, what, happens);
}

pub fn signal(program: &Child, signal: Signal) {
    // A program that has ended needs no signal.
    let _ = kill_process(Pid::from_child(program), signal);
}

/// What a program needs of the machine.
#[derive(Clone, Copy, Debug)]
pub struct Needs {
    /// Bytes in memory.
    pub memory: u64,
    pub files: usize,
    pub threads: usize,
}

fn needs(program: &Child) -> Needs {
    let of = |name: &str| format!("/proc/{}/{name}", program.id());
    let count = |name: &str| std::fs::read_dir(of(name)).map_or(0, Iterator::count);
    let status = std::fs::read_to_string(of("status")).unwrap_or_default();
    let kib = |line: &str| line.strip_prefix("VmRSS:")?.trim().split(' ').next()?.parse::<u64>().ok();
    let memory = status.lines().find_map(kib).unwrap_or(0) << 10;
    Needs { memory, files: count("fd"), threads: count("task") }
}

/// What the muscle is doing, as one sees it beside it.
#[derive(Debug, Default)]
pub struct Plant {
    ticks: AtomicU64,
    /// Tick in which the present vent began; none: `u64::MAX`.
    vented: AtomicU64,
    pascals: AtomicU64,
}

impl Plant {
    pub fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::SeqCst)
    }

    pub fn is_vented(&self) -> bool {
        self.vented.load(Ordering::SeqCst) != u64::MAX
    }

    pub fn pressure_pa(&self) -> f64 {
        self.pascals.load(Ordering::SeqCst) as f64
    }

    fn device(self: &Arc<Self>) -> Device {
        let plant = Arc::clone(self);
        let mut muscle = Follower::default();
        let exchange = move |outputs: &Outputs| {
            let tick = plant.ticks.fetch_add(1, Ordering::SeqCst) + 1;
            let command = outputs.sides[0];
            if !command.vent {
                plant.vented.store(u64::MAX, Ordering::SeqCst);
            } else if !plant.is_vented() {
                plant.vented.store(tick, Ordering::SeqCst);
            }
            let inputs = muscle.exchange(outputs);
            plant.pascals.store(muscle.pressure_pa() as u64, Ordering::SeqCst);
            inputs
        };
        Device::start("127.0.0.1:0", Options::default(), exchange).expect("a controller")
    }
}

fn command(line: &FaultyLine, folder: &Path, arguments: &[&str], file_bytes: Option<u64>) -> Command {
    let port = format!("tcp:{}", line.address());
    let program = program::path();
    let mut command = match file_bytes {
        None => Command::new(&program),
        Some(bytes) => {
            // A write beyond the bound fails as on a full disk, instead of ending the program.
            let mut shell = Command::new("bash");
            shell
                .args(["-c", &format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", bytes >> 10)])
                .arg(&program);
            shell
        }
    };
    command.args(arguments).args(["--port", &port]).current_dir(folder).stdin(Stdio::null());
    command
}

/// A studio whose page is open in a browser that only watches.
pub struct Studio {
    program: Child,
    address: String,
    token: String,
    restarts: u32,
    reads: Arc<AtomicBool>,
}

impl Studio {
    fn start(line: &FaultyLine, folder: &Path) -> Self {
        let (program, address, token) = Self::program(line, folder);
        let studio = Self { program, address, token, restarts: 0, reads: Arc::new(AtomicBool::new(true)) };
        studio.read();
        studio
    }

    fn program(line: &FaultyLine, folder: &Path) -> (Child, String, String) {
        let studio = command(line, folder, &["studio", "-o", "page"], None)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut studio = studio.expect("the program starts");
        let mut ready = String::new();
        let answers = studio.stdout.take().expect("its answers");
        BufReader::new(answers).read_line(&mut ready).expect("its address");
        let (address, token) = ready
            .trim()
            .split_once("http://")
            .and_then(|(_, rest)| rest.split_once("token="))
            .unwrap_or_else(|| panic!("no address: {ready}"));
        let address = address.split(['/', '?', '#']).next().unwrap_or_default().to_owned();
        (studio, address, token.to_owned())
    }

    fn stream(&self) -> Option<TcpStream> {
        let mut stream = TcpStream::connect(&self.address).ok()?;
        let (host, token) = (&self.address, &self.token);
        write!(stream, "GET /api/stream HTTP/1.1\r\nHost: {host}\r\nX-Studio-Token: {token}\r\n\r\n").ok()?;
        Some(stream)
    }

    /// A page that takes what it is sent.
    fn read(&self) {
        let stream = self.stream();
        let reads = Arc::clone(&self.reads);
        std::thread::spawn(move || {
            let Some(stream) = stream else { return };
            let mut lines = BufReader::new(stream);
            let mut line = Vec::new();
            while reads.load(Ordering::Relaxed)
                && lines.read_until(b'\n', &mut line).is_ok_and(|count| count > 0)
            {
                line.clear();
            }
        });
    }

    /// A page that takes nothing of what it is sent.
    pub fn watched_by_no_one(&self) -> Option<TcpStream> {
        self.stream()
    }

    pub fn process(&self) -> &Child {
        &self.program
    }

    pub fn needs(&self) -> Needs {
        needs(&self.program)
    }

    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Has the page connect again to the port that it was started with.
    fn connect(&mut self, line: &FaultyLine) {
        if self.program.try_wait().is_ok_and(|ended| ended.is_some()) {
            self.restarts += 1;
        }
        let body = format!("{{\"do\":\"connect\",\"port\":\"tcp:{}\"}}", line.address());
        let Ok(mut stream) = TcpStream::connect(&self.address) else { return };
        let (host, token, length) = (&self.address, &self.token, body.len());
        let _ = stream.set_read_timeout(Some(HOPELESS));
        let _ = write!(
            stream,
            "POST /api/order HTTP/1.1\r\nHost: {host}\r\nX-Studio-Token: {token}\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        );
        let mut answer = String::new();
        let _ = BufReader::new(stream).read_line(&mut answer);
        assert!(answer.is_empty() || answer.contains("200"), "the page does not connect again: {answer}");
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        self.reads.store(false, Ordering::Relaxed);
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// A program that records all the time.
pub struct Recorder {
    program: Child,
    number: u32,
}

impl Recorder {
    fn start(line: &FaultyLine, folder: &Path, number: u32) -> Self {
        let name = format!("watched-{number}.csv");
        let program = command(line, folder, &["record", "-o", &name], None)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        Self { program, number }
    }

    pub fn process(&self) -> &Child {
        &self.program
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// All of it.
pub struct Rig {
    pub plant: Arc<Plant>,
    pub line: FaultyLine,
    pub studio: Studio,
    pub recorder: Recorder,
    watched: Recorded,
    folder: Folder,
    _device: Device,
}

impl Rig {
    pub fn start() -> Self {
        let plant = Arc::new(Plant::default());
        let device = plant.device();
        let line = FaultyLine::share(device.address()).expect("a line");
        let folder = Folder::new();
        let studio = Studio::start(&line, folder.path());
        let recorder = Recorder::start(&line, folder.path(), 0);
        Self { plant, line, studio, recorder, watched: Recorded::default(), folder, _device: device }
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Starts a program; its files may grow to a number of bytes.
    pub fn host(&self, arguments: &[&str], file_bytes: Option<u64>) -> Child {
        command(&self.line, self.folder.path(), arguments, file_bytes)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts")
    }

    /// Waits for the vent; gives the ticks from `begun` until then.
    pub fn vented_after(&self, begun: u64) -> u64 {
        until("the vent", || self.plant.is_vented());
        self.plant.vented.load(Ordering::SeqCst).saturating_sub(begun)
    }

    /// What is whole of a recording that was cut off.
    pub fn recovered(&self, name: &str) -> Recorded {
        let part = format!("{name}.part");
        let mut recover = Command::new(program::path());
        recover.args(["recover", &part, "--json"]).current_dir(self.folder.path());
        let output = recover.output().expect("the program starts");
        assert!(output.status.success(), "{part}: {}", String::from_utf8_lossy(&output.stderr));
        let reported: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let reported = &reported["recovered"][0];
        let recording = reported["recording"].as_str().expect("a recording");
        let found = recorded(&self.folder.path().join(recording));
        Recorded { reported: reported["samples_lost"].as_u64().unwrap_or(0), ..found }
    }

    /// Starts a new recorder where the last one has ended, and connects the page where its line was cut.
    pub fn revive(&mut self) {
        self.studio.connect(&self.line);
        if self.recorder.program.try_wait().is_ok_and(|ended| ended.is_some()) {
            self.judge();
            self.recorder = Recorder::start(&self.line, self.folder.path(), self.recorder.number + 1);
        }
    }

    /// Ends the recorder and looks at what all of them recorded.
    pub fn recordings(&mut self) -> Recorded {
        signal(&self.recorder.program, Signal::INT);
        let _ = self.recorder.program.wait();
        self.judge();
        self.watched
    }

    fn judge(&mut self) {
        let path = self.folder.path().join(format!("watched-{}.csv", self.recorder.number));
        let Recorded { samples, missing, reported } = if path.exists() { recorded(&path) } else { return };
        assert_eq!(missing, reported, "{}: missing samples, and those that it reports", path.display());
        self.watched.samples += samples;
        self.watched.missing += missing;
        self.watched.reported += reported;
    }

    /// Forgets the latched fault, once its cause has gone.
    pub fn clear(&mut self) {
        let line = self.line.address();
        let address = Address::Tcp { host: line.ip().to_string(), port: line.port() };
        let mut client = Client::open(&address).expect("a controller answers");
        until("the fault is cleared", || {
            let state = client.call::<GetStatus>(&()).expect("an answer").state;
            if state == State::Fault {
                // Refused while the cause is present.
                let _ = client.try_call::<ClearFault>(&()).expect("an answer");
            }
            state != State::Fault
        });
    }
}
