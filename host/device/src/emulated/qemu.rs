//! The board in QEMU: how it is started, and how its serial lines reach this process.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;

use firmware::native::Pace;
use virtual_bench::lockstep;

use super::Stand;
use super::guard::guarded;
use super::relay::Relay;
use super::wire::{Ends, Wire};
use crate::Address;

/// A serial line of the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Line {
    /// Nothing is plugged in.
    Open,
    /// QEMU connects to this port of this machine.
    Port(u16),
    /// Named pipes of this path: what the board receives is read from `PATH.in`, what it sends is written to `PATH.out`.
    Pipes(PathBuf),
}

/// QEMU with an image of the firmware on the emulated board, lines at its UARTs in their order, ready to be spawned; it ends with this
/// process, see [`end`].
///
/// # Errors
/// QEMU is not installed or cannot be run.
pub fn board(image: &Path, lines: &[Line]) -> io::Result<Command> {
    let mut command = guarded("qemu-system-arm")?;
    command
        .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        // The lines are multiplexers (below), which would take one character for commands to the emulator. No byte is this one.
        .args(["-echr", "256"]);
    for (number, line) in lines.iter().enumerate() {
        let place = match line {
            Line::Open => {
                command.args(["-serial", "null"]);
                continue;
            }
            Line::Port(port) => format!("socket,id=line{number},host=127.0.0.1,port={port},nodelay=on"),
            Line::Pipes(path) => format!("pipe,id=line{number},path={}", path.display()),
        };
        // The UART holds one byte. Each further byte would cost an iteration of the emulator's main loop after the processor has read
        // the one before: about twenty in each tick. A multiplexer with a single user buffers up to 32 bytes before the UART, and passes
        // on the next as soon as the last is read.
        command.args(["-chardev", &format!("{place},mux=on"), "-serial", &format!("chardev:line{number}")]);
    }
    Ok(command)
}

/// Ends a program made by [`board`].
pub fn end(child: &mut Child) {
    if cfg!(unix) {
        drop(child.stdin.take());
    } else {
        let _ = child.kill();
    }
    let _ = child.wait();
}

/// The bench's end of its line, which is not read before the next tick is due. What the board asks byte by byte has come by then, and
/// wakes no one eighteen times.
pub struct Paced {
    ends: Ends,
    pace: Pace,
}

impl Paced {
    /// N device seconds in a second at most; infinite: as fast as it goes.
    #[must_use]
    pub fn new(ends: Ends, speed: f64) -> Self {
        Self { ends, pace: Pace::new(speed) }
    }
}

impl Read for Paced {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.ends.read(bytes)
    }
}

impl Write for Paced {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.ends.write(bytes)
    }

    /// After an answer.
    fn flush(&mut self) -> io::Result<()> {
        self.ends.flush()?;
        self.pace.wait();
        Ok(())
    }
}

/// A board in QEMU whose bench is a [`Stand`] in this process.
#[derive(Debug)]
pub(super) struct Qemu {
    child: Child,
    folder: PathBuf,
    relay: Option<Relay>,
}

impl Drop for Qemu {
    fn drop(&mut self) {
        end(&mut self.child);
        drop(self.relay.take());
        // The rest of a temporary folder does no harm.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Qemu {
    /// Starts it, `speed` device seconds in a second at most, and gives its link's address; the reason as text where that cannot be.
    pub(super) fn start(mut stand: Stand, speed: f64) -> Result<(Self, Address), String> {
        let image = image().ok_or("the firmware's image is not built (firmware/build)")?;
        let relay = Relay::listen().map_err(|e| format!("no port can be opened ({e})"))?;
        let made = tempfile::Builder::new().prefix("pam-emulated-").tempdir();
        let folder = made.map_err(|e| format!("no temporary folder can be made ({e})"))?.keep();
        let no_wire = |e: io::Error| format!("no line to the board can be made ({e})");
        let link = Wire::new(&folder, "link").map_err(no_wire)?;
        let bench = Wire::new(&folder, "bench").map_err(no_wire)?;
        let started = std::fs::File::create(folder.join("qemu.log")).and_then(|log| {
            board(&image, &[link.line(), bench.line(), Line::Open])?
                // The store's file is made where the emulator runs.
                .current_dir(&folder)
                .stdout(log.try_clone()?)
                .stderr(log)
                .spawn()
        });
        let child = started.map_err(|e| match e.kind() {
            io::ErrorKind::NotFound => "QEMU is not installed".to_owned(),
            _ => format!("QEMU cannot be run ({e})"),
        })?;
        let mut qemu = Self { child, folder, relay: None };
        let link = link.open(&mut qemu.child).map_err(|why| format!("{why}: {}", qemu.log().trim()))?;
        let ends = bench.open(&mut qemu.child).map_err(|why| format!("{why}: {}", qemu.log().trim()))?;
        let address = Address::Tcp { host: "127.0.0.1".into(), port: relay.port() };
        qemu.relay = Some(relay.between(link));
        thread::spawn(move || {
            let mut line = Paced::new(ends, speed);
            // It ends with the emulator: then the line closes.
            let _ = lockstep::serve(&mut line, &mut stand);
        });
        Ok((qemu, address))
    }

    /// What QEMU and the firmware have said.
    pub(super) fn log(&self) -> String {
        std::fs::read_to_string(self.folder.join("qemu.log")).unwrap_or_default()
    }
}

/// The firmware's image: `PAM_FIRMWARE`, or where `firmware/build` puts it, seen from here or from this program.
#[must_use]
pub fn image() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("PAM_FIRMWARE") {
        return Some(PathBuf::from(path)).filter(|p| p.is_file());
    }
    let below = |top: &Path| Some(top.join("target/firmware/mps2-an386.elf")).filter(|p| p.is_file());
    let from = |start: Option<PathBuf>| start.and_then(|s| s.ancestors().find_map(below));
    from(std::env::current_dir().ok()).or_else(|| from(std::env::current_exe().ok()))
}
