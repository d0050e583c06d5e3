//! A line that several programs use at the same time, as behind a terminal server: each receives what the controller sends, and the
//! controller receives the frames of all.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

type Programs = Arc<Mutex<Vec<TcpStream>>>;

/// Shares the line of a controller; gives the address for the programs. It ends with the process.
///
/// # Errors
/// The controller is not reached, or the system gives no port.
pub fn share(controller: SocketAddr) -> io::Result<SocketAddr> {
    let line = TcpStream::connect(controller)?;
    line.set_nodelay(true)?;
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    let programs = Programs::default();
    let (from_controller, to) = (line.try_clone()?, Arc::clone(&programs));
    thread::spawn(move || pass_to_all(from_controller, &to));
    let line = Arc::new(Mutex::new(line));
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let Ok(reader) = stream.try_clone() else { continue };
            let _ = stream.set_nodelay(true);
            programs.lock().unwrap_or_else(PoisonError::into_inner).push(stream);
            let line = Arc::clone(&line);
            thread::spawn(move || pass_frames(reader, &line));
        }
    });
    Ok(address)
}

fn pass_to_all(mut line: TcpStream, programs: &Programs) {
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = line.read(&mut bytes) {
        let mut programs = programs.lock().unwrap_or_else(PoisonError::into_inner);
        programs.retain_mut(|program| program.write_all(&bytes[..count]).is_ok());
    }
}

/// Passes on whole frames, so that those of two programs do not fall into each other.
fn pass_frames(mut program: TcpStream, line: &Mutex<TcpStream>) {
    let mut bytes = [0; 4096];
    let mut frame = Vec::new();
    while let Ok(count @ 1..) = program.read(&mut bytes) {
        for &byte in &bytes[..count] {
            frame.push(byte);
            if byte == 0 {
                let mut line = line.lock().unwrap_or_else(PoisonError::into_inner);
                if line.write_all(&frame).is_err() {
                    return;
                }
                frame.clear();
            }
        }
    }
}
