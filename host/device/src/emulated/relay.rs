//! The link's line as a port of this machine that any program may connect to, one at a time.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::wire::{Ends, listener};

/// Bytes of the board come one at a time; those of so long are passed on together, in one call and with one waking of the program
/// that reads them. A request is answered later by as much.
const TOGETHER: Duration = Duration::from_micros(500);

/// The connection that is there, if one is.
#[derive(Debug, Default)]
struct Connection {
    stream: Mutex<Option<TcpStream>>,
    ended: AtomicBool,
}

impl Connection {
    fn put(&self, stream: Option<TcpStream>) {
        *self.stream.lock().unwrap_or_else(PoisonError::into_inner) = stream;
    }

    fn now(&self) -> Option<TcpStream> {
        let stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        stream.as_ref().and_then(|stream| stream.try_clone().ok())
    }

    /// Ends it, so that anyone who reads from it or writes to it continues.
    fn close(&self) {
        if let Some(stream) = self.now() {
            // It may have ended without a request.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

/// A port, and the line behind it; the port closes when this is dropped or the line ends.
#[derive(Debug)]
pub struct Relay {
    port: u16,
    waiting: Option<TcpListener>,
    connection: Arc<Connection>,
}

impl Relay {
    /// A port without a line yet: who connects waits.
    ///
    /// # Errors
    /// The system gives no port.
    pub fn listen() -> io::Result<Self> {
        let (listener, port) = listener()?;
        Ok(Self { port, waiting: Some(listener), connection: Arc::default() })
    }

    /// Its port.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Puts the line behind it.
    #[must_use]
    pub fn between(mut self, line: Ends) -> Self {
        let Ends { reader, writer } = line;
        let port = self.port;
        let connection = Arc::clone(&self.connection);
        thread::spawn(move || {
            from_board(reader, &connection);
            end(&connection, port);
        });
        if let Some(listener) = self.waiting.take() {
            let connection = Arc::clone(&self.connection);
            thread::spawn(move || to_board(&listener, writer, &connection));
        }
        self
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        end(&self.connection, self.port);
    }
}

fn end(connection: &Connection, port: u16) {
    if !connection.ended.swap(true, Ordering::Relaxed) {
        connection.close();
        // Wakes who waits for the next connection.
        let _ = TcpStream::connect(("127.0.0.1", port));
    }
}

/// Until the line ends. What comes while no one is connected is lost, as on a wire.
fn from_board(mut line: impl Read, connection: &Connection) {
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = line.read(&mut bytes) {
        if let Some(mut stream) = connection.now()
            && stream.write_all(&bytes[..count]).is_err()
        {
            connection.close();
        }
        thread::sleep(TOGETHER);
    }
}

fn to_board(listener: &TcpListener, mut line: impl Write, connection: &Connection) {
    let mut bytes = [0; 4096];
    for stream in listener.incoming() {
        if connection.ended.load(Ordering::Relaxed) {
            return;
        }
        let Ok(mut stream) = stream else { continue };
        let passed_on = stream.set_nodelay(true).and_then(|()| stream.try_clone());
        connection.put(passed_on.ok());
        while let Ok(count @ 1..) = stream.read(&mut bytes) {
            if line.write_all(&bytes[..count]).is_err() {
                return;
            }
        }
        connection.put(None);
    }
}
