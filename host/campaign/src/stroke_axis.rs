//! What moves the free end of the muscle: an emulated axis, a machine with a line protocol, the operator, or nothing.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::Duration;

use pam_data::error::{Error, Result};
use pam_device::error::DeviceCode;

/// Moves the free end.
pub trait StrokeAxis {
    /// Whether it moves while a course runs.
    fn moves(&self) -> bool {
        false
    }

    /// Before a course that holds a stroke (m), the muscle being vented.
    ///
    /// # Errors
    /// An axis that does not answer.
    fn prepare(&mut self, _stroke: f64) -> Result<()> {
        Ok(())
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

    /// Returns to rest length after a course, the muscle being vented.
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

/// Speed at which an axis returns after a course that did not end itself, m/s.
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

/// The operator sets the stroke when prompted, and presses Enter.
pub struct Prompt<R, W> {
    input: R,
    output: W,
    now: f64,
}

impl<R, W> std::fmt::Debug for Prompt<R, W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prompt").field("now", &self.now).finish_non_exhaustive()
    }
}

impl<R: BufRead, W: Write> Prompt<R, W> {
    /// Asks on `output` and reads from `input`; the muscle is at rest length.
    pub fn new(input: R, output: W) -> Self {
        Self { input, output, now: 0.0 }
    }

    fn ask(&mut self, words: &str) -> Result<()> {
        let lost = |e: std::io::Error| {
            Error::new(
                DeviceCode::DeviceSilent,
                format!("no terminal to request a stroke from the operator: {e}"),
            )
        };
        write!(self.output, "{words}, then press Enter: ")
            .and_then(|()| self.output.flush())
            .map_err(lost)?;
        let mut line = String::new();
        if self.input.read_line(&mut line).map_err(lost)? == 0 {
            return Err(Error::new(DeviceCode::DeviceSilent, "no answer to the request to set the stroke")
                .help("run the command on a terminal; the same call continues the campaign"));
        }
        Ok(())
    }
}

impl<R: BufRead, W: Write> StrokeAxis for Prompt<R, W> {
    fn prepare(&mut self, stroke: f64) -> Result<()> {
        // A hundredth of a millimetre is finer than an operator sets a stroke.
        if (stroke - self.now).abs() > 1e-5 {
            self.ask(&format!("The muscle is vented. Move to a stroke of {:.2} mm", stroke * 1e3))?;
            self.now = stroke;
        }
        Ok(())
    }
}

/// A machine that takes one command per line over TCP and answers each with `ok`:
///
/// ```text
/// move STROKE_mm SPEED_mm_s
/// stop
/// ```
#[derive(Debug)]
pub struct Line {
    stream: BufReader<TcpStream>,
}

/// How long a machine may take to answer.
const ANSWER: Duration = Duration::from_secs(2);

impl Line {
    /// Connects to `tcp:HOST:PORT`.
    ///
    /// # Errors
    /// [`DeviceCode::DevicePort`].
    pub fn open(address: &str) -> Result<Self> {
        let place = address.strip_prefix("tcp:").unwrap_or(address);
        let stream = TcpStream::connect(place)
            .and_then(|s| s.set_read_timeout(Some(ANSWER)).and_then(|()| s.set_nodelay(true)).map(|()| s))
            .map_err(|e| {
                Error::new(DeviceCode::DevicePort, format!("the axis cannot be reached: {e}"))
                    .value(address)
                    .help("check axis_address in rig.toml, and that the machine listens there")
            })?;
        Ok(Self { stream: BufReader::new(stream) })
    }

    fn order(&mut self, line: &str) -> Result<()> {
        let lost = |e: std::io::Error| Error::new(DeviceCode::DeviceSilent, format!("the axis is gone: {e}"));
        self.stream.get_mut().write_all(format!("{line}\n").as_bytes()).map_err(lost)?;
        let mut answer = String::new();
        self.stream.read_line(&mut answer).map_err(lost)?;
        if answer.trim() == "ok" {
            return Ok(());
        }
        Err(Error::new(DeviceCode::DeviceRefused, format!("the axis refuses `{line}`")).value(answer.trim()))
    }
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

    #[test]
    fn a_person_is_asked_once_for_each_stroke() {
        let mut output = Vec::new();
        let mut prompt = Prompt::new(std::io::Cursor::new("\n\n"), &mut output);
        for stroke in [0.0, 12.5e-3, 12.5e-3, 0.0] {
            prompt.prepare(stroke).unwrap();
        }
        assert!(prompt.prepare(1e-3).is_err(), "the input has ended");
        let said = String::from_utf8(output).unwrap();
        assert_eq!(said.matches("press Enter").count(), 3, "{said}");
        assert!(said.contains("12.50 mm"), "{said}");
    }

    #[test]
    fn a_machine_takes_lines_and_may_refuse() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("tcp:{}", listener.local_addr().unwrap());
        let machine = std::thread::spawn(move || {
            let (stream, _) = listener.accept().unwrap();
            let mut lines = BufReader::new(stream);
            let mut heard = Vec::new();
            for answer in ["ok\n", "limit\n"] {
                let mut line = String::new();
                lines.read_line(&mut line).unwrap();
                heard.push(line);
                lines.get_mut().write_all(answer.as_bytes()).unwrap();
            }
            heard
        });
        let mut axis = Line::open(&address).unwrap();
        axis.go(1.5e-3, 2e-3).unwrap();
        assert!(axis.stop().is_err());
        assert_eq!(machine.join().unwrap(), ["move 1.50000 2.00000\n", "stop\n"]);
    }
}
