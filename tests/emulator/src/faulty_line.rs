//! A line for several programs, as behind a terminal server, that can be cut and disturbed. A program that does not read is dropped, so that
//! it does not hold up the others.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Time after which a program that takes nothing is dropped.
const PATIENCE: Duration = Duration::from_millis(200);
/// Bytes of which one is changed while the line is noisy.
const NOISE: u64 = 2_000;

#[derive(Debug, Default)]
struct State {
    programs: Mutex<Vec<TcpStream>>,
    cut: AtomicBool,
    noisy: AtomicBool,
    bytes: AtomicU64,
    dropped: AtomicU64,
}

impl State {
    fn disturb(&self, bytes: &mut [u8]) {
        let before = self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        if self.noisy.load(Ordering::Relaxed) {
            for (at, byte) in (before..).zip(bytes) {
                if at % NOISE == 0 {
                    *byte ^= 1 << (at / NOISE % 8);
                }
            }
        }
    }

    fn programs(&self) -> std::sync::MutexGuard<'_, Vec<TcpStream>> {
        self.programs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The line; it ends with the process.
#[derive(Debug)]
pub struct FaultyLine {
    address: SocketAddr,
    state: Arc<State>,
}

impl FaultyLine {
    /// Shares the line of a controller.
    ///
    /// # Errors
    /// The controller is not reached, or the system gives no port.
    pub fn share(controller: SocketAddr) -> io::Result<Self> {
        let line = TcpStream::connect(controller)?;
        line.set_nodelay(true)?;
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        let state = Arc::new(State::default());
        let (from_controller, to) = (line.try_clone()?, Arc::clone(&state));
        thread::spawn(move || to_programs(from_controller, &to));
        let (line, from) = (Arc::new(Mutex::new(line)), Arc::clone(&state));
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let Ok(reader) = stream.try_clone() else { continue };
                let _ = stream.set_nodelay(true);
                let _ = stream.set_write_timeout(Some(PATIENCE));
                if from.cut.load(Ordering::Relaxed) {
                    continue;
                }
                from.programs().push(stream);
                let (line, state) = (Arc::clone(&line), Arc::clone(&from));
                thread::spawn(move || to_controller(reader, &line, &state));
            }
        });
        Ok(Self { address, state })
    }

    /// Where programs connect.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Cuts the line for all programs, or lets new ones connect again.
    pub fn cut(&self, cut: bool) {
        self.state.cut.store(cut, Ordering::Relaxed);
        if cut {
            for program in self.state.programs().drain(..) {
                let _ = program.shutdown(Shutdown::Both);
            }
        }
    }

    /// Changes a bit of every two thousandth byte, or no longer.
    pub fn disturb(&self, noisy: bool) {
        self.state.noisy.store(noisy, Ordering::Relaxed);
    }

    /// Programs that were dropped because they did not read.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.state.dropped.load(Ordering::Relaxed)
    }
}

fn to_programs(mut line: TcpStream, state: &State) {
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = line.read(&mut bytes) {
        state.disturb(&mut bytes[..count]);
        state.programs().retain_mut(|program| match program.write_all(&bytes[..count]) {
            Ok(()) => true,
            Err(error) => {
                let slow = matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut);
                state.dropped.fetch_add(u64::from(slow), Ordering::Relaxed);
                let _ = program.shutdown(Shutdown::Both);
                false
            }
        });
    }
}

/// Passes on whole frames, so that those of two programs do not fall into each other.
fn to_controller(mut program: TcpStream, line: &Mutex<TcpStream>, state: &State) {
    let mut bytes = [0; 4096];
    let mut frame = Vec::new();
    while let Ok(count @ 1..) = program.read(&mut bytes) {
        for &byte in &bytes[..count] {
            frame.push(byte);
            if byte == 0 {
                state.disturb(&mut frame);
                let mut line = line.lock().unwrap_or_else(PoisonError::into_inner);
                if line.write_all(&frame).is_err() {
                    return;
                }
                frame.clear();
            }
        }
    }
}
