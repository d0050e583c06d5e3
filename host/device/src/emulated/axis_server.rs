//! The axis of the virtual bench as a machine with a line protocol: one command per line, each answered by one line.
//!
//! ```text
//! move STROKE_mm SPEED_mm_s   ok
//! stop                        ok
//! state                       ok STROKE_mm PRESSURE_kPa TIME_s     true values of the bench, its time since the start
//! ```

use std::io::{self, BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

use super::Axis;

/// Longest line that is read, bytes.
const LONGEST: u64 = 256;

/// Serves an axis at a port of this machine until the process ends; gives its address, `tcp:HOST:PORT`.
///
/// # Errors
/// The system gives no port.
pub fn serve(axis: Axis) -> io::Result<String> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = format!("tcp:{}", listener.local_addr()?);
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let axis = axis.clone();
            // A connection that ends takes nothing with it.
            thread::spawn(move || {
                let _ = converse(stream, &axis);
            });
        }
    });
    Ok(address)
}

fn converse(stream: TcpStream, axis: &Axis) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let mut lines = BufReader::new(stream);
    loop {
        let mut line = String::new();
        if io::Read::take(&mut lines, LONGEST).read_line(&mut line)? == 0 {
            return Ok(());
        }
        let mut answer = answer(&line, axis);
        answer.push('\n');
        lines.get_mut().write_all(answer.as_bytes())?;
    }
}

/// Carries out a line and gives its answer.
fn answer(line: &str, axis: &Axis) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words.as_slice() {
        ["move", stroke, speed] => match (stroke.parse::<f64>(), speed.parse::<f64>()) {
            (Ok(stroke), Ok(speed)) if stroke.is_finite() && speed > 0.0 && speed.is_finite() => {
                axis.go(stroke * 1e-3, speed * 1e-3);
                "ok".to_owned()
            }
            _ => "error: move takes a stroke in mm and a speed above zero in mm/s".to_owned(),
        },
        ["stop"] => {
            axis.stop();
            "ok".to_owned()
        }
        ["state"] => {
            let (pressure, time) = axis.seen();
            format!("ok {:.5} {:.4} {time:.3}", axis.now() * 1e3, pressure * 1e-3)
        }
        _ => "error: the commands are move, stop and state".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_move_the_axis_and_others_are_refused() {
        let axis = Axis::default();
        assert_eq!(answer("move 2.0 4.0\n", &axis), "ok");
        axis.advance(0.25);
        axis.notes(150e3);
        assert_eq!(answer("stop\n", &axis), "ok");
        axis.advance(1.0);
        assert_eq!(answer("state\r\n", &axis), "ok 1.00000 150.0000 1.250");
        for bad in ["", "move 1", "move nan 1", "move 1 0", "move 1 inf", "jump 3 4", "stop now"] {
            assert!(answer(bad, &axis).starts_with("error"), "{bad}");
        }
        assert!((axis.now() - 1e-3).abs() < 1e-12);
    }
}
