//! A testing machine on a serial line, as a process of its own: `line-machine AXIS` prints the device at which it takes one command per
//! line, and moves the emulated muscle at AXIS (`tcp:HOST:PORT`).

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::process::ExitCode;

/// Largest stroke of the machine, mm.
const STROKE_MAX_MM: f64 = 50.0;

fn main() -> ExitCode {
    let Some(axis) = std::env::args().nth(1) else {
        eprintln!("usage: line-machine tcp:HOST:PORT");
        return ExitCode::from(2);
    };
    match serve(&axis) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("line-machine: {e}");
            ExitCode::FAILURE
        }
    }
}

fn serve(axis: &str) -> std::io::Result<()> {
    let mut bench = BufReader::new(TcpStream::connect(axis.trim_start_matches("tcp:"))?);
    bench.get_ref().set_nodelay(true)?;
    let (near, far) = emulator_tests::line::open_pty();
    // Until a program has opened the far end, reads of the near one would fail.
    let _keep = std::fs::File::options().read(true).write(true).open(&far)?;
    println!("{}", far.display());
    std::io::stdout().flush()?;
    let mut lines = BufReader::new(near);
    loop {
        let mut line = String::new();
        if lines.read_line(&mut line)? == 0 {
            return Ok(());
        }
        let answer = if beyond(&line) {
            "error: beyond the stroke of the machine\n".to_owned()
        } else {
            bench.get_mut().write_all(line.as_bytes())?;
            let mut answer = String::new();
            bench.read_line(&mut answer)?;
            answer
        };
        lines.get_mut().write_all(answer.as_bytes())?;
    }
}

fn beyond(line: &str) -> bool {
    let stroke = line.strip_prefix("move ").and_then(|l| l.split_whitespace().next());
    stroke.is_some_and(|s| !s.parse::<f64>().is_ok_and(|mm| (-1.0..=STROKE_MAX_MM).contains(&mm)))
}
