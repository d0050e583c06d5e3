//! A rig for `host campaign --port`: an emulated controller as a process of its own, a serial cable to it that can be pulled, and a
//! testing machine on a serial line, a process too.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::line::open_pty;
use crate::{patience, program};

/// How long the test waits for what must happen on any machine.
pub const PATIENCE: Duration = Duration::from_secs(300);
/// Pressure below which a muscle counts as vented, kPa.
pub const VENTED_KPA: f64 = 5.0;

/// What the bench shows from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Stroke, mm.
    pub stroke_mm: f64,
    /// True pressure, kPa.
    pub pressure_kpa: f64,
    /// Time of the bench, s.
    pub time_s: f64,
}

/// Waits until a condition holds.
///
/// # Panics
/// When it does not within the patience.
pub fn until(what: &str, holds: impl FnMut() -> bool) {
    patience::until(PATIENCE, what, holds);
}

fn first_line(child: &mut Child) -> (String, BufReader<std::process::ChildStdout>) {
    let mut lines = BufReader::new(child.stdout.take().expect("its output"));
    let mut line = String::new();
    lines.read_line(&mut line).expect("a line");
    (line.trim().to_owned(), lines)
}

/// A process that ends with this.
#[derive(Debug)]
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An emulated controller on a muscle that an axis holds.
#[derive(Debug)]
pub struct Bench {
    process: Process,
    /// Where the controller listens, `tcp:HOST:PORT`.
    pub port: String,
    /// Where the axis listens.
    pub axis: String,
}

impl Bench {
    /// Starts it with a number of device seconds in a second.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start(folder: &Path, speed: u32) -> Self {
        let speed = speed.to_string();
        let mut child = Command::new(program::path())
            .args(["emulate", "mini", "--on", "native", "--axis", "--speed", &speed, "--quiet"])
            .current_dir(folder)
            .env("XDG_CONFIG_HOME", folder)
            .env_remove("PAM_SETTINGS")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let (port, mut lines) = first_line(&mut child);
        let mut axis = String::new();
        lines.read_line(&mut axis).expect("a second line");
        assert!(port.starts_with("tcp:") && axis.starts_with("tcp:"), "{port} {axis}");
        Self { process: Process(child), port, axis: axis.trim().to_owned() }
    }

    /// One line to the axis, and its answer.
    ///
    /// # Errors
    /// The bench is gone.
    pub fn order(&self, line: &str) -> std::io::Result<String> {
        let mut stream = BufReader::new(TcpStream::connect(self.axis.trim_start_matches("tcp:"))?);
        stream.get_mut().write_all(format!("{line}\n").as_bytes())?;
        let mut answer = String::new();
        stream.read_line(&mut answer)?;
        Ok(answer.trim().to_owned())
    }

    /// What it shows.
    ///
    /// # Panics
    /// When it is gone.
    pub fn state(&self) -> State {
        let answer = self.order("state").expect("the bench answers");
        let numbers: Vec<f64> = answer.split_whitespace().skip(1).filter_map(|w| w.parse().ok()).collect();
        let [stroke_mm, pressure_kpa, time_s] = numbers[..] else { panic!("no state: {answer}") };
        State { stroke_mm, pressure_kpa, time_s }
    }

    /// Waits until the muscle is vented; gives the device time that it took, s.
    ///
    /// # Panics
    /// When it stays under pressure.
    pub fn until_vented(&self) -> f64 {
        let begin = self.state().time_s;
        let mut last = begin;
        until("the muscle vents", || {
            let state = self.state();
            last = state.time_s;
            state.pressure_kpa < VENTED_KPA
        });
        last - begin
    }

    /// Ends it as a failing board does.
    ///
    /// # Panics
    /// When it cannot be ended.
    pub fn kill(mut self) {
        self.process.0.kill().expect("it runs");
        self.process.0.wait().expect("it ends");
    }
}

/// A serial cable to a controller, at a path that stays the same for every cable.
#[derive(Debug)]
pub struct Cable {
    far: TcpStream,
    keep: Option<File>,
}

impl Cable {
    /// Plugs a cable in between a path and a controller.
    ///
    /// # Panics
    /// When the controller is not there.
    pub fn plug(path: &Path, bench: &Bench) -> Self {
        let far = TcpStream::connect(bench.port.trim_start_matches("tcp:")).expect("the controller");
        far.set_nodelay(true).expect("a stream");
        let (near, device) = open_pty();
        let keep = File::options().read(true).write(true).open(&device).expect("its far end");
        // It may be the first.
        let _ = std::fs::remove_file(path);
        std::os::unix::fs::symlink(&device, path).expect("a name for the device");
        let (from_host, to_host) = (near.try_clone().expect("a handle"), near);
        let (to_board, from_board) = (far.try_clone().expect("a handle"), far.try_clone().expect("a handle"));
        // The device closes when both threads have ended, as when a cable is pulled.
        thread::spawn(move || carry(from_host, to_board));
        thread::spawn(move || carry(from_board, to_host));
        Self { far, keep: Some(keep) }
    }

    /// Pulls it.
    pub fn pull(mut self) {
        self.keep = None;
        // The controller may have closed it.
        let _ = self.far.shutdown(Shutdown::Both);
    }
}

fn carry(mut from: impl Read, mut to: impl Write) {
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        if to.write_all(&bytes[..count]).is_err() {
            return;
        }
    }
}

/// A testing machine on a serial line.
#[derive(Debug)]
pub struct LineMachine {
    _process: Process,
    /// Its device.
    pub device: PathBuf,
}

impl LineMachine {
    /// Starts one that moves the muscle of a bench.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start(bench: &Bench) -> Self {
        let program = program::path().with_file_name("line-machine");
        let mut child = Command::new(program)
            .arg(&bench.axis)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("cargo builds it before the tests");
        let (device, lines) = first_line(&mut child);
        // Its output stays open.
        std::mem::forget(lines);
        Self { _process: Process(child), device: device.into() }
    }
}

/// `host campaign` on a port, in a folder with `muscle.toml` and `rig.toml`.
///
/// # Panics
/// When the folder cannot be written.
pub fn campaign(folder: &Path, port: &Path, minutes: &str) -> Command {
    let messages = File::options().create(true).append(true).open(folder.join(MESSAGES)).expect("a file");
    let mut command = Command::new(program::path());
    command
        .args(["campaign", "--muscle", "muscle.toml", "--rig", "rig.toml", "-o", "c", "--for", "fit"])
        .args(["--minutes", minutes, "--port"])
        .arg(port)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(messages);
    command
}

/// Messages of all calls of a folder.
const MESSAGES: &str = "messages.txt";

/// The last messages of the campaigns of a folder, for a test that fails.
#[must_use]
pub fn messages(folder: &Path) -> String {
    let text = std::fs::read_to_string(folder.join(MESSAGES)).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(20)..].join("\n")
}

/// Rows of every recording of a campaign, also of unfinished ones: whole lines below the header.
///
/// # Panics
/// When a file cannot be read.
pub fn rows(campaign: &Path) -> Vec<String> {
    let Ok(there) = std::fs::read_dir(campaign) else { return Vec::new() };
    let mut files: Vec<PathBuf> = there
        .filter_map(|f| Some(f.ok()?.path()))
        .filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().contains(".csv")))
        .collect();
    files.sort();
    let mut all = Vec::new();
    for file in files {
        // A file that is renamed meanwhile is read at the next look.
        let text = std::fs::read_to_string(file).unwrap_or_default();
        let whole = text.rfind('\n').map_or("", |i| &text[..i]);
        all.extend(whole.lines().skip(1).map(str::to_owned));
    }
    all
}

/// Times of rows, in order; every one comes once.
///
/// # Panics
/// When a time comes twice, or a row has none.
pub fn times(rows: &[String]) -> Vec<f64> {
    let time = |r: &String| r.split(',').next().and_then(|t| t.parse::<f64>().ok()).expect("a time");
    let mut times: Vec<f64> = rows.iter().map(time).collect();
    times.sort_by(f64::total_cmp);
    assert!(times.windows(2).all(|w| w[1] > w[0]), "a time comes twice");
    times
}
