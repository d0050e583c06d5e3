//! A serial line between QEMU and this process.
//!
//! The board sends byte by byte, and each byte is a system call. Into a named pipe it costs a tenth of what it costs into a TCP
//! connection. A pipe that is not read for a while holds a second of telemetry; a connection holds some tens of milliseconds, because
//! most of its buffer goes to the headers of one-byte packets. Systems other than Linux use a TCP connection.

use std::io::{self, Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::Child;
use std::thread;
use std::time::{Duration, Instant};

use super::qemu::Line;

/// This process's ends of an open line.
pub struct Ends {
    /// What the board sends.
    pub reader: Box<dyn Read + Send>,
    /// What the board receives.
    pub writer: Box<dyn Write + Send>,
}

impl Read for Ends {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.reader.read(bytes)
    }
}

impl Write for Ends {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Asks every two milliseconds until QEMU has come, and notices when it has ended instead.
fn until_there<T>(child: &mut Child, mut come: impl FnMut() -> io::Result<Option<T>>) -> Result<T, String> {
    let deadline = Instant::now() + Duration::from_secs(20);
    loop {
        if let Some(there) = come().map_err(|e| format!("QEMU cannot be reached ({e})"))? {
            return Ok(there);
        }
        if let Ok(Some(status)) = child.try_wait() {
            return Err(format!("QEMU ended immediately ({status})"));
        }
        if Instant::now() > deadline {
            return Err("QEMU does not connect within 20 s".to_owned());
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// A port of this machine that QEMU is to connect to.
///
/// # Errors
/// The system gives none.
pub fn listener() -> io::Result<(TcpListener, u16)> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let port = listener.local_addr()?.port();
    Ok((listener, port))
}

/// Waits for QEMU to connect.
///
/// # Errors
/// As text: it has ended, does not connect within 20 s, or the port is broken.
#[cfg(not(target_os = "linux"))]
fn accept(listener: &TcpListener, child: &mut Child) -> Result<std::net::TcpStream, String> {
    let stream = until_there(child, || {
        listener.set_nonblocking(true)?;
        match listener.accept() {
            Ok((stream, _)) => Ok(Some(stream)),
            Err(e) if e.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(e) => Err(e),
        }
    })?;
    stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_nodelay(true))
        .map_err(|e| format!("QEMU cannot be reached ({e})"))?;
    Ok(stream)
}

/// A line that QEMU has yet to open.
#[derive(Debug)]
pub struct Wire {
    #[cfg(target_os = "linux")]
    path: std::path::PathBuf,
    #[cfg(not(target_os = "linux"))]
    listener: (TcpListener, u16),
}

#[cfg(target_os = "linux")]
impl Wire {
    /// A line of a name; what it needs lies in a folder, and is removed with that.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn new(folder: &Path, name: &str) -> io::Result<Self> {
        use rustix::fs::{CWD, Mode, mkfifoat};
        let path = folder.join(name);
        for end in ["in", "out"] {
            mkfifoat(CWD, path.with_extension(end), Mode::RUSR | Mode::WUSR)?;
        }
        Ok(Self { path })
    }

    /// For QEMU.
    #[must_use]
    pub fn line(&self) -> Line {
        Line::Pipes(self.path.clone())
    }

    /// Waits for QEMU to open it.
    ///
    /// # Errors
    /// As text: QEMU has ended, does not open it within 20 s, or the pipes are broken.
    pub fn open(self, child: &mut Child) -> Result<Ends, String> {
        use std::fs::OpenOptions;
        use std::os::unix::fs::OpenOptionsExt;
        let writer = until_there(child, || {
            // Without waiting the writing end can only be opened once there is a reader.
            let nonblocking = rustix::fs::OFlags::NONBLOCK.bits() as i32;
            let opened =
                OpenOptions::new().write(true).custom_flags(nonblocking).open(self.path.with_extension("in"));
            match opened {
                Ok(file) => Ok(Some(file)),
                Err(e) if e.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) => Ok(None),
                Err(e) => Err(e),
            }
        })?;
        let broken = |e: io::Error| format!("QEMU cannot be reached ({e})");
        rustix::fs::fcntl_setfl(&writer, rustix::fs::OFlags::empty()).map_err(|e| broken(e.into()))?;
        // QEMU opens the one right after the other.
        let reader = std::fs::File::open(self.path.with_extension("out")).map_err(broken)?;
        Ok(Ends { reader: Box::new(reader), writer: Box::new(writer) })
    }
}

#[cfg(not(target_os = "linux"))]
impl Wire {
    /// A line; its folder and name are needed elsewhere only.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn new(_: &Path, _: &str) -> io::Result<Self> {
        Ok(Self { listener: listener()? })
    }

    /// For QEMU.
    #[must_use]
    pub fn line(&self) -> Line {
        Line::Port(self.listener.1)
    }

    /// Waits for QEMU to open it.
    ///
    /// # Errors
    /// As text: QEMU has ended, does not open it within 20 s, or the port is broken.
    pub fn open(self, child: &mut Child) -> Result<Ends, String> {
        let stream = accept(&self.listener.0, child)?;
        let reader = stream.try_clone().map_err(|e| format!("QEMU cannot be reached ({e})"))?;
        Ok(Ends { reader: Box::new(reader), writer: Box::new(stream) })
    }
}
