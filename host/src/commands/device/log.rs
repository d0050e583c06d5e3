//! `host device log`: the device's own reports, as they arrive.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use model_core::link::endpoints::GetStatus;
use model_core::link::messages::Event;

use crate::commands::port::PortOption;
use crate::console::Console;
use crate::documents::device::{LogLine, More};
use crate::documents::line;
use pam_data::error::{DataCode, Error, Result};
use pam_device::{Topic, log_table::LogTable, messages};

/// Arguments of `host device log`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// How long, s [default: until Ctrl-C].
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// The image that runs on the device, built with logs (firmware/build --log): its log lines are decoded.
    #[arg(long, value_name = "ELF")]
    elf: Option<PathBuf>,
    /// Print JSON, one object a line.
    #[arg(long)]
    json: bool,
}

/// A line: device time where it is known, what kind, text, and what else a program wants to know.
fn say(console: &Console, as_json: bool, time_s: Option<f64>, kind: &str, text: &str, more: More) {
    if as_json {
        let document = LogLine { schema: "pam-log/1", time_s, event: kind, text, more };
        // A document of words can always be written.
        console.result(line(&document).unwrap_or_default());
        return;
    }
    let time = time_s.map_or_else(|| " ".repeat(14), |t| format!("{t:12.3} s"));
    console.result(format!("{time}  {text}"));
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let table = arguments.elf.as_deref().map(LogTable::read).transpose()?;
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed))
        .map_err(|e| Error::new(DataCode::CallInvalid, format!("Ctrl-C cannot be handled: {e}")))?;
    let mut client = arguments.port.connect(console)?;
    let tell = |time_s, kind, text: &str, more| say(console, arguments.json, time_s, kind, text, more);
    let begin = Instant::now();
    let mut last = None;
    let mut state_requested = None::<Instant>;
    let mut unknown_lines = 0_u64;
    while !stop.load(Ordering::Relaxed) && arguments.seconds.is_none_or(|s| begin.elapsed().as_secs_f64() < s)
    {
        // Events arrive immediately; the query every second also notices a device that is gone.
        if state_requested.is_none_or(|at| at.elapsed() >= Duration::from_secs(1)) {
            let status = client.call::<GetStatus>(&())?;
            state_requested = Some(Instant::now());
            if last != Some((status.state, status.mode)) {
                last = Some((status.state, status.mode));
                let (state, mode) = (messages::state(status.state), messages::mode(status.mode));
                let text = format!("{state} in {mode} mode");
                let more = More { state: Some(state), mode: Some(mode), ..More::default() };
                tell(Some(status.time_us as f64 * 1e-6), "state", &text, more);
            }
        }
        match client.topic(Duration::from_millis(100))? {
            Some(Topic::Event(Event::Fault(report))) => {
                let fault = messages::fault(report.fault);
                let time = Some(report.time_us as f64 * 1e-6);
                let more = More { fault: Some(fault.name), remedy: Some(fault.remedy), ..More::default() };
                let mark = if arguments.json { "" } else { "FAULT " };
                tell(time, "fault", &format!("{mark}{}", messages::report(&report)), more);
                if !arguments.json {
                    tell(None, "remedy", &format!("what to do: {}", fault.remedy), More::default());
                }
            }
            Some(Topic::Event(Event::State(_))) => state_requested = None,
            Some(Topic::Event(Event::TraceFull)) => {
                tell(None, "trace-full", "trace full: host device trace --read", More::default());
            }
            Some(Topic::Log(frame)) => match &table {
                Some(table) => {
                    let line = table.decode(&frame)?;
                    tell(
                        line.time_s,
                        "log",
                        &format!("{} {}", line.level, line.text),
                        More { level: Some(line.level.clone()), ..More::default() },
                    );
                }
                None => unknown_lines += 1,
            },
            Some(Topic::Telemetry(_)) | None => {}
        }
    }
    if unknown_lines > 0 {
        console.note(format!(
            "the device also sent {unknown_lines} log lines; give its image with --elf to have them decoded"
        ));
    }
    Ok(())
}
