//! The controller in a host's own process: the same control step, server and store as on a board, behind a TCP port, with a
//! plant that is a function.
//!
//! ```
//! use firmware::board::{Inputs, Outputs, Readings};
//! use firmware::native::{Device, Options};
//! use std::io::{Read, Write};
//!
//! // A plant that follows its command immediately.
//! let plant = |outputs: &Outputs| {
//!     let pressure_pa = outputs.sides[0].pressure_pa;
//!     let readings = Readings { pressure_pa, ..Readings::default() };
//!     Inputs { sides: [Some(readings.into()), None], ..Inputs::default() }
//! };
//! let device = Device::start("127.0.0.1:0", Options::default(), plant)?;
//! let mut port = std::net::TcpStream::connect(device.address())?;
//! // `hello`: COBS(request, endpoint 0, sequence 0, CRC-32) 0x00.
//! let mut frame = [0; 32];
//! let header = model_core::link::Header { kind: model_core::link::Kind::Request, id: 0, sequence: 0 };
//! let length = model_core::link::frame::encode_bytes(header, &[], &mut frame).expect("it fits");
//! port.write_all(&frame[..length])?;
//! let mut answer = [0; 16];
//! port.read_exact(&mut answer)?;
//! assert!(answer.windows(4).any(|four| four == b"PAM!"));
//! # Ok::<(), std::io::Error>(())
//! ```

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use model_core::link::frame::{Accumulator, MAX_TOPIC};
use model_core::link::hello::Board;
use model_core::link::messages::StartedBy;
use model_core::link::settings::Settings;

use crate::board::{Identity, Inputs, Outputs};
use crate::control::Controller;
use crate::server::{Line, Server};
use crate::shared::Shared;
use crate::update::{Key, Updater};

mod memory_flash;
mod memory_slots;
mod pace;

pub use memory_flash::{MemoryError, MemoryFlash};
pub use memory_slots::MemorySlots;
pub use pace::Pace;

/// How a native device runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Device seconds in a second; infinite: as fast as the plant and the link go.
    pub speed: f64,
    /// File that the store is kept in; without one it is forgotten with the device.
    pub store: Option<PathBuf>,
    /// Muscles that the plant gives readings of.
    pub muscles: u8,
    /// Public key of who may send firmware; without one, the device takes none.
    pub update_key: Option<Key>,
}

impl Default for Options {
    fn default() -> Self {
        Self { speed: 1.0, store: None, muscles: 1, update_key: None }
    }
}

/// A running device; it stops when this is dropped.
#[derive(Debug)]
pub struct Device {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Device {
    /// Starts a device that listens on an address (port 0: any) and drives a plant: commands in, readings of the next
    /// tick out.
    ///
    /// # Errors
    /// The address cannot be listened on, or the store's file cannot be read.
    pub fn start(
        address: impl ToSocketAddrs,
        options: Options,
        mut plant: impl FnMut(&Outputs) -> Inputs + Send + 'static,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let flash = MemoryFlash::open(options.store.clone())?;
        let shared = Arc::new(Shared::new(Settings::default()));
        let identity = Identity {
            board: Board::Native,
            muscles: options.muscles,
            serial: *b"native\0\0\0\0\0\0",
            started_by: StartedBy::Power,
            fault: None,
        };
        let mut server = Server::start(identity, flash, &shared)
            .map_err(|fault| io::Error::other(format!("the store cannot be opened: {fault:?}")))?;
        if let Some(key) = options.update_key {
            server.take_updates(Box::new(Updater::new(MemorySlots::probed(), key)));
        }
        let stop = Arc::new(AtomicBool::new(false));
        let connected = Arc::new(AtomicBool::new(false));
        let link = {
            let (shared, stop, connected) = (shared.clone(), stop.clone(), connected.clone());
            thread::Builder::new()
                .name("link".into())
                .spawn(move || serve(&listener, server, &shared, &stop, &connected))?
        };
        let control = {
            let stop = stop.clone();
            let pace = Pace::new(options.speed);
            thread::Builder::new()
                .name("control".into())
                .spawn(move || run(&mut plant, &shared, &stop, &connected, pace))?
        };
        Ok(Self { address, stop, threads: vec![link, control] })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that panicked has reported it itself.
            let _ = thread.join();
        }
    }
}

fn run(
    plant: &mut impl FnMut(&Outputs) -> Inputs,
    shared: &Shared,
    stop: &AtomicBool,
    connected: &AtomicBool,
    mut pace: Pace,
) {
    let mut outputs = Outputs::VENT;
    while !stop.load(Ordering::Relaxed) {
        pace.wait();
        // Nothing here runs in hard time, so the loop may wait for the link instead of dropping samples.
        let waited = Instant::now();
        while !shared.has_room() && connected.load(Ordering::Relaxed) && !stop.load(Ordering::Relaxed) {
            if waited.elapsed() > Duration::from_millis(500) {
                break;
            }
            thread::sleep(Duration::from_micros(50));
        }
        outputs = shared.step(&plant(&outputs));
    }
}

fn serve(
    listener: &TcpListener,
    mut server: Server<MemoryFlash>,
    shared: &Shared,
    stop: &AtomicBool,
    connected: &AtomicBool,
) {
    let mut frame = [0; MAX_TOPIC];
    while !stop.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((stream, _)) => {
                connected.store(true, Ordering::Relaxed);
                // A connection that breaks is the peer's affair; the device continues and waits for the next.
                let _ = talk(stream, &mut server, shared, stop);
                connected.store(false, Ordering::Relaxed);
            }
            Err(_) => {
                while shared.next_outgoing(&mut frame).is_some() {}
                thread::sleep(Duration::from_millis(2));
            }
        }
        if server.wants_restart() {
            shared.with(|controller| *controller = Controller::new(&Settings::default()));
            server.boot();
            match server.restarted(shared) {
                Ok(again) => server = again,
                Err(_) => return,
            }
        }
    }
}

fn talk(
    mut stream: TcpStream,
    server: &mut Server<MemoryFlash>,
    shared: &Shared,
    stop: &AtomicBool,
) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(Duration::from_millis(1)))?;
    stream.set_write_timeout(Some(Duration::from_secs(2)))?;
    let mut accumulator = Accumulator::new();
    let mut bytes = [0; 1024];
    let mut out = [0; MAX_TOPIC];
    while !stop.load(Ordering::Relaxed) {
        while let Some(length) = shared.next_outgoing(&mut out) {
            stream.write_all(&out[..length])?;
        }
        let count = match stream.read(&mut bytes) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                if shared.has_changed() {
                    server.keep(shared);
                }
                continue;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        for &byte in &bytes[..count] {
            server.note_counts(Line::Serial, accumulator.counts());
            let Some(Ok(request)) = accumulator.push_to_answer(byte) else { continue };
            stream.write_all(server.handle(request, shared))?;
            if server.wants_restart() {
                return Ok(());
            }
        }
    }
    Ok(())
}
