//! An operator as the axis: sets the stroke when prompted, and presses Enter.

use std::io::{BufRead, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use pam_data::error::{Error, Result};
use pam_device::error::DeviceCode;

use crate::stroke_axis::StrokeAxis;

/// The operator sets the stroke when prompted, and presses Enter.
pub struct Prompt<W> {
    answers: Receiver<std::io::Result<usize>>,
    output: W,
    now: f64,
    interrupted: Arc<AtomicBool>,
}

impl<W> std::fmt::Debug for Prompt<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prompt").field("now", &self.now).finish_non_exhaustive()
    }
}

/// Time between two checks of Ctrl-C while the program waits for the operator.
const LOOK: Duration = Duration::from_millis(50);
/// Strokes closer than this are the same, m: a hundredth of a millimetre is finer than an operator sets one.
const SAME: f64 = 1e-5;

impl<W: Write> Prompt<W> {
    /// Asks on `output` and reads lines from `input`, which waits in a thread of its own, so that Ctrl-C ends the request. The muscle is
    /// at rest length.
    pub fn new(mut input: impl BufRead + Send + 'static, output: W, interrupted: Arc<AtomicBool>) -> Self {
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            loop {
                let mut line = String::new();
                let read = input.read_line(&mut line);
                let more = matches!(read, Ok(1..));
                if sender.send(read).is_err() || !more {
                    return;
                }
            }
        });
        Self { answers, output, now: 0.0, interrupted }
    }

    /// Asks, and waits for a line; false where Ctrl-C came first.
    fn ask(&mut self, instruction: &str) -> Result<bool> {
        write!(self.output, "{instruction}, then press Enter: ").and_then(|()| self.output.flush()).map_err(
            |e| {
                Error::new(
                    DeviceCode::DeviceSilent,
                    format!("the operator cannot be prompted for a stroke: {e}"),
                )
            },
        )?;
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                return Ok(false);
            }
            match self.answers.recv_timeout(LOOK) {
                Ok(Ok(1..)) => return Ok(true),
                Err(RecvTimeoutError::Timeout) => {}
                Ok(Ok(0)) | Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => {
                    return Err(Error::new(
                        DeviceCode::DeviceSilent,
                        "no answer to the request to set the stroke",
                    )
                    .help("run the command on a terminal; the same call continues the campaign"));
                }
            }
        }
    }
}

impl<W: Write> StrokeAxis for Prompt<W> {
    fn prepare(&mut self, stroke: f64) -> Result<bool> {
        if (stroke - self.now).abs() > SAME {
            let instruction = format!("The muscle is vented. Move to a stroke of {:.2} mm", stroke * 1e3);
            if !self.ask(&instruction)? {
                return Ok(false);
            }
            self.now = stroke;
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operator_is_prompted_once_for_each_stroke() {
        let mut output = Vec::new();
        let mut prompt = Prompt::new(std::io::Cursor::new("\n\n"), &mut output, Arc::default());
        for stroke in [0.0, 12.5e-3, 12.5e-3, 0.0] {
            assert!(prompt.prepare(stroke).unwrap());
        }
        assert!(prompt.prepare(1e-3).is_err(), "the input has ended");
        drop(prompt);
        let said = String::from_utf8(output).unwrap();
        assert_eq!(said.matches("press Enter").count(), 3, "{said}");
        assert!(said.contains("12.50 mm"), "{said}");
    }

    #[test]
    fn an_interruption_ends_the_request_without_an_answer() {
        let (reader, _writer) = std::io::pipe().unwrap();
        let interrupted = Arc::new(AtomicBool::new(false));
        let mut prompt =
            Prompt::new(std::io::BufReader::new(reader), std::io::sink(), Arc::clone(&interrupted));
        let flag = Arc::clone(&interrupted);
        let later = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            flag.store(true, Ordering::Relaxed);
        });
        assert!(!prompt.prepare(1e-3).unwrap());
        later.join().unwrap();
    }
}
