//! One emulated board.

use std::io::Read;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use object::{Object, ObjectSymbol};
use pam_device::emulated::qemu::{Line, Paced, board, end};
use pam_device::emulated::relay::Relay;
use pam_device::emulated::wire::{Wire, listener};
use pam_device::{Client, Patience, Port};
use virtual_bench::lockstep::{self, Station};

use crate::debugger::Debugger;

/// The emulator was left out on request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Skipped;

/// The project's top folder.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Builds an image by the project's script, once a process, and gives its path.
fn built(arguments: &'static [&'static str], file: &str, once: &OnceLock<Result<(), String>>) -> PathBuf {
    let outcome = once.get_or_init(|| {
        let run = Command::new(root().join("firmware/build")).args(arguments).output();
        match run {
            Ok(output) if output.status.success() => Ok(()),
            Ok(output) => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
            Err(error) => Err(format!("firmware/build cannot be run: {error}")),
        }
    });
    if let Err(why) = outcome {
        panic!("the image cannot be built (set PAM_SKIP_EMULATOR=1 to leave the emulator out):\n{why}");
    }
    root().join("target/firmware").join(file)
}

/// Whether the emulator is to be left out; fails where it cannot be used and was not left out.
///
/// # Errors
/// [`Skipped`] when `PAM_SKIP_EMULATOR=1` is set.
///
/// # Panics
/// Without QEMU.
fn available() -> Result<(), Skipped> {
    if std::env::var_os("PAM_SKIP_EMULATOR").is_some_and(|value| value == "1") {
        eprintln!("skipped: PAM_SKIP_EMULATOR=1 leaves the emulator out");
        return Err(Skipped);
    }
    let found = Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status();
    assert!(
        found.is_ok_and(|status| status.success()),
        "no emulator: run 'firmware/build --install', or install QEMU for ARM (Debian: apt-get install \
         qemu-system-arm), or set PAM_SKIP_EMULATOR=1 to leave these tests out"
    );
    Ok(())
}

/// The controller's image.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// With the reason when it cannot be built.
pub fn image() -> Result<PathBuf, Skipped> {
    static ONCE: OnceLock<Result<(), String>> = OnceLock::new();
    available()?;
    Ok(built(&["mps2-an386"], "mps2-an386.elf", &ONCE))
}

/// The image of the Nucleo board, which this emulator cannot run.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// With the reason when it cannot be built.
pub fn nucleo_image() -> Result<PathBuf, Skipped> {
    static ONCE: OnceLock<Result<(), String>> = OnceLock::new();
    available()?;
    Ok(built(&["nucleo-f446re"], "nucleo-f446re.elf", &ONCE))
}

/// The controller's image with its log.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// With the reason when it cannot be built.
pub fn log_image() -> Result<PathBuf, Skipped> {
    static ONCE: OnceLock<Result<(), String>> = OnceLock::new();
    available()?;
    Ok(built(&["--log", "mps2-an386"], "mps2-an386-log.elf", &ONCE))
}

/// The controller's image whose control loop interrupts the other tasks.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// With the reason when it cannot be built.
pub fn preempting_image() -> Result<PathBuf, Skipped> {
    static ONCE: OnceLock<Result<(), String>> = OnceLock::new();
    available()?;
    Ok(built(&["--preempting", "mps2-an386"], "mps2-an386-preempting.elf", &ONCE))
}

/// Where a static of an image lies.
///
/// # Panics
/// When it has none of that name.
pub fn address_of(image: &Path, name: &str) -> u32 {
    let bytes = std::fs::read(image).expect("an image");
    let elf = object::File::parse(&*bytes).expect("an image");
    let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name));
    u32::try_from(symbol.unwrap_or_else(|| panic!("no static is called {name}")).address()).expect("32 bits")
}

/// The image that counts instructions.
///
/// # Errors
/// [`Skipped`] when the emulator is left out.
///
/// # Panics
/// With the reason when it cannot be built.
pub fn instruction_counts_image() -> Result<PathBuf, Skipped> {
    static ONCE: OnceLock<Result<(), String>> = OnceLock::new();
    available()?;
    Ok(built(&["--figures", "mps2-an386"], "mps2-an386-figures.elf", &ONCE))
}

/// A folder of its own in the system's place for temporary files, removed with the value.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// A new one.
    ///
    /// # Panics
    /// When it cannot be made.
    #[expect(clippy::new_without_default, reason = "it makes a folder on disk")]
    pub fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("pam-emulator-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // The rest of a temporary folder does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// What to plug into a board.
#[derive(Default)]
pub struct Options {
    /// The bench of the first muscle; none: its UART is silent.
    pub first: Option<Box<dyn Station + Send>>,
    /// The bench of the second.
    pub second: Option<Box<dyn Station + Send>>,
    /// Whether a debugger may be attached.
    pub debugged: bool,
    /// Device seconds in a second at most; none: as fast as it goes.
    pub speed: Option<f64>,
}

/// How long a test waits for an answer: a machine that is busy may take longer than a user would wait, and a board that is dead never
/// answers.
pub const PATIENCE: Patience = Patience {
    answer: Duration::from_secs(5),
    slow_answer: Duration::from_secs(60),
    tries: 12,
    noisy_tries: 60,
};

/// How long a test waits for what must happen: only so long that what has not happened by then never will, however busy the machine is.
pub const HOPELESS: Duration = Duration::from_secs(120);

/// A running board.
#[derive(Debug)]
pub struct Machine {
    child: Child,
    link: TcpStream,
    /// What the board says goes through a pipe, which holds a second of telemetry while this process waits for its turn.
    _relay: Relay,
    debugger: Option<u16>,
    benches: Vec<JoinHandle<()>>,
}

/// A line that QEMU has opened, or what QEMU said instead.
fn opened<T>(child: &mut Child, open: impl FnOnce(&mut Child) -> Result<T, String>) -> T {
    open(child).unwrap_or_else(|why| {
        let mut text = String::new();
        if let (Ok(Some(_)), Some(stderr)) = (child.try_wait(), child.stderr.as_mut()) {
            let _ = stderr.read_to_string(&mut text);
        }
        panic!("{why} {text}");
    })
}

impl Machine {
    /// Starts a board whose store is the file `pam-store.bin` in `folder`.
    ///
    /// # Errors
    /// [`Skipped`] when the emulator is left out.
    ///
    /// # Panics
    /// With the reason when the board cannot be started.
    pub fn start(folder: &Path, options: Options) -> Result<Self, Skipped> {
        Ok(Self::start_image(&image()?, folder, options))
    }

    /// The same with the image that logs.
    ///
    /// # Errors
    /// [`Skipped`] when the emulator is left out.
    ///
    /// # Panics
    /// With the reason when the board cannot be started.
    pub fn start_with_log(folder: &Path, options: Options) -> Result<Self, Skipped> {
        Ok(Self::start_image(&log_image()?, folder, options))
    }

    /// The same with the image whose control loop interrupts the other tasks.
    ///
    /// # Errors
    /// [`Skipped`] when the emulator is left out.
    ///
    /// # Panics
    /// With the reason when the board cannot be started.
    pub fn start_preempting(folder: &Path, options: Options) -> Result<Self, Skipped> {
        Ok(Self::start_image(&preempting_image()?, folder, options))
    }

    fn start_image(image: &Path, folder: &Path, options: Options) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        // A board may be started again in the same folder.
        let wire = |what: &str| {
            let name = format!("{what}{}", NUMBER.fetch_add(1, Ordering::Relaxed));
            Wire::new(folder, &name).expect("a line")
        };
        let link = wire("link");
        let mut lines = vec![link.line()];
        let mut plugged = Vec::new();
        for station in [options.first, options.second] {
            match station {
                Some(station) => {
                    let bench = wire("bench");
                    lines.push(bench.line());
                    plugged.push((bench, station));
                }
                None => lines.push(Line::Open),
            }
        }
        let mut command = board(image, &lines).expect("QEMU starts");
        // QEMU opens this port itself; it was free a moment ago.
        let debugger = options.debugged.then(|| listener().expect("a port of this machine").1);
        if let Some(port) = debugger {
            command.args(["-gdb", &format!("tcp:127.0.0.1:{port},server=on,wait=off")]);
        }
        let mut child = command
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("QEMU starts");
        let link = opened(&mut child, |child| link.open(child));
        let relay = Relay::listen().expect("a port of this machine").between(link);
        let link = TcpStream::connect(("127.0.0.1", relay.port())).expect("the relay listens");
        link.set_nodelay(true).expect("a stream");
        let benches = plugged
            .into_iter()
            .map(|(bench, mut station)| {
                let ends = opened(&mut child, |child| bench.open(child));
                let mut line = Paced::new(ends, options.speed.unwrap_or(f64::INFINITY));
                thread::spawn(move || {
                    // The emulator's end is the end of the bench; how it ended is the test's to judge.
                    let _ = lockstep::serve(&mut line, station.as_mut());
                })
            })
            .collect();
        Self { child, link, _relay: relay, debugger, benches }
    }

    /// The raw link. Every value is the same line: one reads what another did not.
    ///
    /// # Panics
    /// When the system gives no further handle.
    pub fn link(&self) -> TcpStream {
        self.link.try_clone().expect("a handle")
    }

    /// The host's own client on the link.
    ///
    /// # Panics
    /// When the board does not say hello.
    pub fn client(&self) -> Client {
        let port = Port::from_tcp(self.link()).expect("a handle");
        Client::connect(port, PATIENCE).expect("the board says hello")
    }

    /// The host's own client on the link of a board that has restarted since it had started so often.
    ///
    /// # Panics
    /// When it does not restart.
    pub fn client_after(&mut self, starts: u32) -> Client {
        let deadline = Instant::now() + HOPELESS;
        loop {
            assert!(self.is_running(), "the firmware has ended");
            assert!(Instant::now() < deadline, "the board does not restart");
            let client = self.client();
            if client.hello().starts != starts {
                return client;
            }
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Stops the processor for a debugger.
    ///
    /// # Panics
    /// Without [`Options::debugged`].
    pub fn debugger(&self) -> Debugger {
        Debugger::attach(self.debugger.expect("a board that may be debugged"))
    }

    /// Interrupts the power.
    pub fn kill(mut self) {
        self.end();
    }

    fn end(&mut self) {
        end(&mut self.child);
        for bench in self.benches.drain(..) {
            let _ = bench.join();
        }
    }

    /// Whether the board is still there; a panic of the firmware ends QEMU.
    pub fn is_running(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        self.end();
    }
}
