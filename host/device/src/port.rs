//! Bytes to and from a device, with time-outs: a serial line, TCP, or anything that reads and writes.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use model_core::link::can;

use super::Address;
use super::can_line::CanLine;
use crate::error::DeviceCode;
use pam_data::error::{Error, Result};

/// Speed of the serial line, baud. Boards whose line is a USB bridge ignore it.
pub const BAUD: u32 = 1_000_000;

/// How long a TCP connection may take.
const CONNECT: Duration = Duration::from_secs(3);

/// An open line to a device.
pub struct Port {
    line: Line,
    name: String,
}

enum Line {
    Serial(Box<dyn serialport::SerialPort>),
    Tcp(TcpStream),
    Can(Box<CanLine>),
}

impl std::fmt::Debug for Port {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Port({})", self.name)
    }
}

impl Port {
    /// Opens what an address names.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`] with the system's reason, and what to do about the usual ones.
    pub fn open(address: &Address) -> Result<Self> {
        Self::open_at(address, BAUD)
    }

    /// Opens what an address names, a serial line at a speed of its own.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_at(address: &Address, baud: u32) -> Result<Self> {
        let name = address.to_string();
        let line = match address {
            Address::Serial(path) => {
                let opened = serialport::new(path.to_string_lossy(), baud)
                    .timeout(Duration::from_millis(100))
                    .flow_control(serialport::FlowControl::None)
                    .open();
                Line::Serial(opened.map_err(|e| serial_error(&name, &e))?)
            }
            Address::Tcp { host, port } => Line::Tcp(connect(host, *port, &name)?),
            Address::Can { adapter, device, kbit_per_s, baud } => {
                // A port of the whole bus turns to each device in turn.
                let device = device.unwrap_or(can::Address::FIRST);
                Line::Can(Box::new(CanLine::open(Self::open_at(adapter, *baud)?, device, *kbit_per_s)?))
            }
        };
        Ok(Self { line, name })
    }

    /// A line over an open TCP connection.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`] when the connection is already gone.
    pub fn from_tcp(stream: TcpStream) -> Result<Self> {
        let name = stream.peer_addr().map_or_else(|_| "tcp".to_owned(), |a| format!("tcp:{a}"));
        stream.set_nodelay(true).map_err(|e| {
            Error::new(DeviceCode::DevicePort, format!("the connection cannot be used: {e}")).value(&name)
        })?;
        Ok(Self { line: Line::Tcp(stream), name })
    }

    /// Another handle of the same line.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`] when the system gives none.
    pub(super) fn second_handle(&self) -> Result<Self> {
        let refused = |reason: String| {
            Error::new(DeviceCode::DevicePort, format!("the port cannot be opened a second time: {reason}"))
                .value(&self.name)
        };
        let line = match &self.line {
            Line::Serial(line) => Line::Serial(line.try_clone().map_err(|e| refused(e.to_string()))?),
            Line::Tcp(stream) => Line::Tcp(stream.try_clone().map_err(|e| refused(e.to_string()))?),
            Line::Can(line) => Line::Can(Box::new(line.second_handle()?)),
        };
        Ok(Self { line, name: self.name.clone() })
    }

    /// The address as the user wrote it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reads what is there, waiting at most `patience` for the first byte; 0 when nothing came.
    ///
    /// # Errors
    /// When the line is gone; the end of a TCP stream is [`io::ErrorKind::UnexpectedEof`].
    pub fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        // A time-out of zero means "without end" to TCP and "invalid" to some serial drivers.
        let patience = patience.max(Duration::from_millis(1));
        let outcome = match &mut self.line {
            Line::Serial(line) => {
                if line.timeout() != patience {
                    line.set_timeout(patience)?;
                }
                line.read(buffer)
            }
            Line::Tcp(stream) => {
                stream.set_read_timeout(Some(patience))?;
                match stream.read(buffer) {
                    Ok(0) => {
                        Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the peer closed the connection"))
                    }
                    other => other,
                }
            }
            Line::Can(line) => line.read(buffer, patience),
        };
        match outcome {
            Err(e) if is_time_out(&e) => Ok(0),
            other => other,
        }
    }

    /// Writes all bytes.
    ///
    /// # Errors
    /// When the line is gone, or takes nothing for a second.
    pub fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        let deadline = Instant::now() + Duration::from_secs(1);
        match &mut self.line {
            Line::Serial(line) => {
                let mut rest = bytes;
                while !rest.is_empty() {
                    match line.write(rest) {
                        Ok(n) => rest = &rest[n..],
                        Err(e) if is_time_out(&e) && Instant::now() < deadline => {}
                        Err(e) => return Err(e),
                    }
                }
                Ok(())
            }
            Line::Tcp(stream) => {
                stream.set_write_timeout(Some(Duration::from_secs(1)))?;
                stream.write_all(bytes)
            }
            Line::Can(line) => line.write_all(bytes),
        }
    }

    /// Turns the line to another device on the same CAN bus.
    pub(super) fn turn_to(&mut self, device: can::Address) {
        if let Line::Can(line) = &mut self.line {
            line.turn_to(device);
        }
    }

    /// Sends the message that vents every device on a CAN bus.
    pub(super) fn vent_all(&mut self) -> io::Result<()> {
        match &mut self.line {
            Line::Can(line) => line.vent_all(),
            Line::Serial(_) | Line::Tcp(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    /// On a CAN bus: messages that the adapter has refused, and lines of it that say nothing.
    pub(super) fn troubles(&self) -> Option<(u64, u64)> {
        match &self.line {
            Line::Can(line) => Some(line.troubles()),
            Line::Serial(_) | Line::Tcp(_) => None,
        }
    }
}

fn is_time_out(e: &io::Error) -> bool {
    matches!(e.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

fn connect(host: &str, port: u16, name: &str) -> Result<TcpStream> {
    let failed = |reason: String| {
        Error::new(DeviceCode::DevicePort, reason)
            .value(name)
            .help("check that the emulator is running and that this is its port")
    };
    let addresses = (host, port)
        .to_socket_addrs()
        .map_err(|e| failed(format!("the host of the port cannot be found: {e}")))?;
    let mut last = None;
    for address in addresses {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => {
                stream
                    .set_nodelay(true)
                    .map_err(|e| failed(format!("the connection cannot be used: {e}")))?;
                return Ok(stream);
            }
            Err(e) => last = Some(e),
        }
    }
    Err(failed(match last {
        Some(e) => format!("nothing accepts a connection there: {e}"),
        None => "the host of the port has no address".to_owned(),
    }))
}

fn serial_error(name: &str, error: &serialport::Error) -> Error {
    use serialport::ErrorKind;
    let help = match error.kind {
        ErrorKind::NoDevice | ErrorKind::Io(io::ErrorKind::NotFound) => {
            let others = available();
            if others.is_empty() {
                "no serial device is connected; the port of an emulated device is tcp:HOST:PORT".to_owned()
            } else {
                format!("serial devices here: {}", others.join(", "))
            }
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
            "this user may not open serial devices; on Linux add it to the group `dialout` and log in again"
                .to_owned()
        }
        _ => "is it a serial device, and is no other program using it?".to_owned(),
    };
    Error::new(DeviceCode::DevicePort, format!("the port cannot be opened: {error}")).value(name).help(help)
}

fn is_usb(port: &serialport::SerialPortInfo) -> bool {
    matches!(port.port_type, serialport::SerialPortType::UsbPort(_))
}

/// Serial devices, USB ones first.
#[must_use]
pub fn available() -> Vec<String> {
    let mut ports = serialport::available_ports().unwrap_or_default();
    ports.sort_by(|a, b| is_usb(b).cmp(&is_usb(a)).then_with(|| a.port_name.cmp(&b.port_name)));
    ports.into_iter().map(|p| p.port_name).collect()
}

/// Serial devices on USB: what a controller's board is. A computer's own serial line is nothing that was plugged in.
#[must_use]
pub fn plugged_in() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().filter(is_usb).map(|p| p.port_name).collect()
}
