//! What moves the free end of the muscle: an emulated axis, a machine with a line protocol, the operator, or nothing.

use std::time::{Duration, Instant};

use pam_data::error::{Error, Result};
use pam_device::error::DeviceCode;
use pam_device::{Address, Port};

/// Moves the free end.
pub trait StrokeAxis {
    /// Whether it moves while a profile runs.
    fn moves(&self) -> bool {
        false
    }

    /// Before a profile that holds a stroke (m), the muscle being vented; false where the operator ends the campaign instead.
    ///
    /// # Errors
    /// An axis that does not answer.
    fn prepare(&mut self, _stroke: f64) -> Result<bool> {
        Ok(true)
    }

    /// Moves to a stroke (m) at a speed (m/s).
    ///
    /// # Errors
    /// As [`Self::prepare`].
    fn go(&mut self, _to: f64, _speed: f64) -> Result<()> {
        Ok(())
    }

    /// Stops where it is.
    ///
    /// # Errors
    /// As [`Self::prepare`].
    fn stop(&mut self) -> Result<()> {
        Ok(())
    }

    /// Returns to rest length after a profile, the muscle being vented.
    ///
    /// # Errors
    /// As [`Self::prepare`].
    fn rest(&mut self) -> Result<()> {
        Ok(())
    }

    /// Whether the clock can pause.
    fn compute(&mut self, _computing: bool) {}
}

/// Nothing moves the free end by command: it is held, or a weight or a second muscle pulls it.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoAxis;

impl StrokeAxis for NoAxis {}

/// Speed at which an axis returns after a profile that did not end itself, m/s.
const RETURN_SPEED: f64 = 2e-3;

#[cfg(feature = "emulated")]
impl StrokeAxis for pam_device::emulated::Axis {
    fn moves(&self) -> bool {
        true
    }

    fn go(&mut self, to: f64, speed: f64) -> Result<()> {
        pam_device::emulated::Axis::go(self, to, speed);
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        pam_device::emulated::Axis::stop(self);
        Ok(())
    }

    fn rest(&mut self) -> Result<()> {
        pam_device::emulated::Axis::go(self, 0.0, RETURN_SPEED);
        Ok(())
    }

    fn compute(&mut self, computing: bool) {
        self.wait(computing);
    }
}

/// A machine that takes one command per line, over TCP or a serial line, and answers each with `ok`:
///
/// ```text
/// move STROKE_mm SPEED_mm_s
/// stop
/// ```
#[derive(Debug)]
pub struct Line {
    port: Port,
    received: Vec<u8>,
}

/// How long a machine may take to answer.
const ANSWER: Duration = Duration::from_secs(2);
/// Longest answer of a machine, bytes; more is not an answer.
const LONGEST_ANSWER: usize = 1024;
/// Speed of a serial line where the rig does not say, baud.
pub const BAUD: u32 = 115_200;

impl Line {
    /// Connects to `tcp:HOST:PORT`, or opens a serial device at a speed, baud.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`].
    pub fn open(address: &str, baud: u32) -> Result<Self> {
        let port = address.parse::<Address>().and_then(|a| Port::open_at(&a, baud)).map_err(|e| {
            Error::new(DeviceCode::DevicePort, format!("the axis cannot be reached: {}", e.cause()))
                .value(address)
                .help("check axis_address in rig.toml, and that the machine listens there")
        })?;
        Ok(Self { port, received: Vec::new() })
    }

    fn order(&mut self, line: &str) -> Result<()> {
        // What the machine said without being asked is not an answer to this.
        self.received.clear();
        self.port.write_all(format!("{line}\n").as_bytes()).map_err(|e| lost(&e))?;
        let answer = self.answer()?;
        if answer.split_whitespace().next() == Some("ok") {
            return Ok(());
        }
        Err(Error::new(DeviceCode::DeviceRefused, format!("the axis refuses `{line}`"))
            .value(answer.trim())
            .help("check the limits of the machine, and stroke_max_mm and speed_max_mm_s in rig.toml"))
    }

    fn answer(&mut self) -> Result<String> {
        let deadline = Instant::now() + ANSWER;
        loop {
            if let Some(end) = self.received.iter().position(|b| *b == b'\n') {
                let line: Vec<u8> = self.received.drain(..=end).collect();
                return Ok(String::from_utf8_lossy(&line).trim().to_owned());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || self.received.len() > LONGEST_ANSWER {
                return Err(Error::new(DeviceCode::DeviceSilent, "the axis does not answer")
                    .help("check the machine and its line; the same call continues the campaign"));
            }
            let mut bytes = [0; 256];
            let count = self.port.read(&mut bytes, left).map_err(|e| lost(&e))?;
            self.received.extend_from_slice(&bytes[..count]);
        }
    }
}

fn lost(e: &std::io::Error) -> Error {
    Error::new(DeviceCode::DeviceSilent, format!("the connection to the axis is lost: {e}"))
        .help("check the machine and its line; the same call continues the campaign")
}

impl StrokeAxis for Line {
    fn moves(&self) -> bool {
        true
    }

    fn go(&mut self, to: f64, speed: f64) -> Result<()> {
        self.order(&format!("move {:.5} {:.5}", to * 1e3, speed * 1e3))
    }

    fn stop(&mut self) -> Result<()> {
        self.order("stop")
    }

    fn rest(&mut self) -> Result<()> {
        self.go(0.0, RETURN_SPEED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader, Write};

    #[test]
    fn a_machine_takes_lines_and_may_refuse() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("tcp:{}", listener.local_addr().unwrap());
        let machine = std::thread::spawn(move || {
            let (stream, _) = listener.accept().unwrap();
            let mut lines = BufReader::new(stream);
            let mut lines_received = Vec::new();
            // The last answer comes in two pieces.
            for answer in [vec!["ok\n"], vec!["limit\n"], vec!["o", "k\r\n"]] {
                let mut line = String::new();
                lines.read_line(&mut line).unwrap();
                lines_received.push(line);
                for piece in answer {
                    lines.get_mut().write_all(piece.as_bytes()).unwrap();
                    std::thread::sleep(Duration::from_millis(20));
                }
            }
            lines_received
        });
        let mut axis = Line::open(&address, BAUD).unwrap();
        axis.go(1.5e-3, 2e-3).unwrap();
        let refused = axis.stop().unwrap_err();
        assert!(refused.to_string().contains("limit"), "{refused}");
        axis.stop().unwrap();
        assert_eq!(machine.join().unwrap(), ["move 1.50000 2.00000\n", "stop\n", "stop\n"]);
        assert!(axis.go(0.0, 1e-3).is_err(), "the machine is gone");
    }
}
