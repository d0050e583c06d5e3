//! The cable between programs and an emulated board: a TCP port or a serial device at the program's end, the board's UART at
//! the other, and what happens to bytes on the way.
//!
//! As on a real cable, what the board says while no one listens is lost, and a program that is stopped leaves it open.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::machine::Machine;

/// What happens to bytes that pass; it may change, drop or add some.
pub type Passage = Box<dyn FnMut(&mut Vec<u8>) + Send>;

/// Nothing happens.
pub fn clean() -> Passage {
    Box::new(|_| ())
}

/// Each bit flips with a probability of its own, independently of the others.
pub fn noisy(bit_error_rate: f64, seed: u64) -> Passage {
    let mut random = StdRng::seed_from_u64(seed);
    Box::new(move |bytes| {
        for byte in bytes {
            for bit in 0..8 {
                if random.random_bool(bit_error_rate) {
                    *byte ^= 1 << bit;
                }
            }
        }
    })
}

/// A pseudo-terminal without echo or line editing: its near end, and the path of its far end.
///
/// # Panics
/// When the system gives none.
#[cfg(unix)]
pub fn open_pty() -> (File, PathBuf) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&master).and_then(|()| unlockpt(&master)).expect("a pseudo-terminal");
    let path = ptsname(&master, Vec::new()).expect("its name").into_string().expect("its name").into();
    let mut raw = rustix::termios::tcgetattr(&master).expect("its modes");
    raw.make_raw();
    rustix::termios::tcsetattr(&master, rustix::termios::OptionalActions::Now, &raw).expect("raw mode");
    (File::from(master), path)
}

/// What joins a program's end: replaced with every connection.
type Near = Arc<Mutex<Option<Box<dyn Write + Send>>>>;

/// A cable; it is pulled when this is dropped.
pub struct Line {
    address: String,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
    /// The far end of a pseudo-terminal stays open, or reads fail until a program has opened it.
    _kept: Option<File>,
}

const POLL: Duration = Duration::from_millis(5);

fn waits(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

impl Line {
    /// A TCP port; one program at a time.
    ///
    /// # Panics
    /// When the system gives no port.
    pub fn tcp(machine: &Machine, to_board: Passage, from_board: Passage) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port of this machine");
        listener.set_nonblocking(true).expect("a listener");
        let address = format!("tcp:{}", listener.local_addr().expect("its address"));
        let mut line = Self::begin(machine, address, from_board);
        let (near, stop, board) = (line.1, Arc::clone(&line.0.stop), machine.link());
        line.0.threads.push(thread::spawn(move || {
            let mut passage = to_board;
            while !stop.load(Ordering::Relaxed) {
                let Ok((stream, _)) = listener.accept() else {
                    thread::sleep(POLL);
                    continue;
                };
                stream.set_nonblocking(false).expect("a stream");
                stream.set_nodelay(true).expect("a stream");
                stream.set_read_timeout(Some(POLL)).expect("a stream");
                let writer = stream.try_clone().expect("a handle");
                *near.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(writer));
                carry(stream, &board, &mut passage, &stop);
                *near.lock().unwrap_or_else(PoisonError::into_inner) = None;
            }
        }));
        line.0
    }

    /// A serial device: a pseudo-terminal, without echo or line editing.
    ///
    /// # Panics
    /// When the system gives none.
    #[cfg(unix)]
    pub fn serial(machine: &Machine, to_board: Passage, from_board: Passage) -> Self {
        let (master, path) = open_pty();
        let kept = File::options().read(true).write(true).open(&path).expect("its far end");
        let mut line = Self::begin(machine, path.display().to_string(), from_board);
        line.0._kept = Some(kept);
        *line.1.lock().unwrap_or_else(PoisonError::into_inner) =
            Some(Box::new(master.try_clone().expect("a handle")));
        let (stop, board) = (Arc::clone(&line.0.stop), machine.link());
        // Its reader blocks in the system until something is written, so it is not waited for at the end.
        thread::spawn(move || {
            let mut passage = to_board;
            carry(master, &board, &mut passage, &stop);
        });
        line.0
    }

    /// A line to a board that has started: a program does not wait as long for its hello as a busy machine may take to start it.
    fn begin(machine: &Machine, address: String, from_board: Passage) -> (Self, Near) {
        drop(machine.client());
        let near: Near = Arc::default();
        let stop = Arc::new(AtomicBool::new(false));
        let board = machine.link();
        board.set_read_timeout(Some(POLL)).expect("a stream");
        let (to, ended, mut passage) = (Arc::clone(&near), Arc::clone(&stop), from_board);
        let reader = thread::spawn(move || {
            let mut board = board;
            let mut bytes = [0; 4096];
            while !ended.load(Ordering::Relaxed) {
                let count = match board.read(&mut bytes) {
                    Ok(0) => return,
                    Ok(count) => count,
                    Err(error) if waits(&error) => continue,
                    Err(_) => return,
                };
                let mut passed = bytes[..count].to_vec();
                passage(&mut passed);
                if let Some(near) = to.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
                    // A program that is gone receives nothing more.
                    let _ = near.write_all(&passed);
                }
            }
        });
        (Self { address, stop, threads: vec![reader], _kept: None }, near)
    }

    /// Pulls the cable.
    pub fn pull(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }

    /// What `--port` takes.
    pub fn address(&self) -> &str {
        &self.address
    }
}

fn carry(mut from: impl Read, board: &TcpStream, passage: &mut Passage, stop: &AtomicBool) {
    let mut board = board;
    let mut bytes = [0; 4096];
    while !stop.load(Ordering::Relaxed) {
        match from.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => {
                let mut passed = bytes[..count].to_vec();
                passage(&mut passed);
                if board.write_all(&passed).is_err() {
                    return;
                }
            }
            Err(error) if waits(&error) => {}
            Err(_) => return,
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.pull();
    }
}
