//! `host device trace`: variables of the control loop at every tick, recorded in the device's own memory.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use model_core::link::endpoints::{ArmTrace, GetInfo, GetTrace, ReadTrace};
use model_core::link::messages::{TraceArm, TraceInfo, TraceRead, Trigger, Variable};

use crate::commands::port::PortOption;
use crate::console::Console;
use crate::documents::{device as document, text};
use pam_data::error::{DataCode, Error, Result, nearest};
use pam_data::output::write_whole;
use pam_data::pluralise::pluralise;
use pam_device::Client;
use pam_device::error::DeviceCode;

/// Arguments of `host device trace`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// What to record, separated by commas.
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        default_value = "pressure,force,setpoint,command"
    )]
    variables: Vec<String>,
    /// Ticks from one record to the next.
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    every: u16,
    /// When to begin.
    #[arg(long, value_enum, value_name = "WHEN", default_value_t = Begin::Now)]
    trigger: Begin,
    /// Only read what an armed trace has recorded; flashing a table before that takes its room.
    #[arg(long, conflicts_with_all = ["variables", "every", "trigger"])]
    read: bool,
    /// How long to wait for the trace to end, s.
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    wait: f64,
    /// The file; `-` is standard output.
    #[arg(short, long, value_name = "OUT.csv", default_value = "-")]
    output: PathBuf,
    /// Print the trace as JSON, one list for each variable, instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Begin {
    /// Immediately.
    Now,
    /// With the next start of a mode or reference.
    Start,
    /// Round and round until a fault stops it; read it later with --read.
    UntilFault,
}

/// Variables by the names people write.
const VARIABLES: [(&str, Variable, &str); 19] = [
    ("pressure", Variable::Pressure, "Pa"),
    ("stroke", Variable::Stroke, "m"),
    ("force", Variable::Force, "N"),
    ("speed", Variable::Speed, "m_per_s"),
    ("direction", Variable::Direction, ""),
    ("setpoint", Variable::Setpoint, ""),
    ("force-demand", Variable::ForceDemand, "N"),
    ("feed-forward", Variable::FeedForward, "Pa"),
    ("trim", Variable::Trim, "Pa"),
    ("pressure-demand", Variable::PressureDemand, "Pa"),
    ("command", Variable::Command, "Pa"),
    ("model-pressure", Variable::ModelPressure, "Pa"),
    ("model-force", Variable::ModelForce, "N"),
    ("state", Variable::State, ""),
    ("step-time", Variable::StepTime, "us"),
    ("second-pressure", Variable::SecondPressure, "Pa"),
    ("second-stroke", Variable::SecondStroke, "m"),
    ("second-force", Variable::SecondForce, "N"),
    ("second-command", Variable::SecondCommand, "Pa"),
];

fn variable(name: &str) -> Result<Variable> {
    let known = VARIABLES.iter().find(|(n, _, _)| *n == name.trim());
    known.map(|(_, v, _)| *v).ok_or_else(|| {
        let names: Vec<&str> = VARIABLES.iter().map(|(n, _, _)| *n).collect();
        let near =
            nearest(name, names.iter().copied()).map(|n| format!("did you mean {n}? ")).unwrap_or_default();
        Error::new(DataCode::CallInvalid, "the control loop has no variable of this name")
            .value(name)
            .help(format!("{near}there are: {}", names.join(", ")))
    })
}

fn heading(variable: Variable) -> String {
    match VARIABLES.iter().find(|(_, v, _)| *v == variable) {
        Some((name, _, "")) => name.replace('-', "_"),
        Some((name, _, unit)) => format!("{}_{unit}", name.replace('-', "_")),
        None => "unknown".to_owned(),
    }
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let mut variables = heapless::Vec::new();
    for name in &arguments.variables {
        variables.push(variable(name)?).map_err(|_| {
            Error::new(
                DataCode::CallInvalid,
                format!("a trace records at most {} variables", variables.capacity()),
            )
        })?;
    }
    let mut client = arguments.port.connect(console)?;
    let trace = if arguments.read {
        client.call::<GetTrace>(&())?
    } else {
        let trigger = match arguments.trigger {
            Begin::Now => Trigger::Now,
            Begin::Start => Trigger::Start,
            Begin::UntilFault => Trigger::UntilFault,
        };
        client.call_once::<ArmTrace>(&TraceArm { variables, every_ticks: arguments.every, trigger })?;
        if trigger == Trigger::UntilFault {
            console.result("armed; after a fault read it with: host device trace --read -o FILE.csv");
            return Ok(());
        }
        finished(&mut client, arguments.wait)?
    };
    if trace.records == 0 {
        return Err(Error::new(DeviceCode::DeviceRefused, "the trace is empty")
            .help("arm one first, without --read; putting a table to use discards the trace"));
    }
    let ticks_per_s = client.call::<GetInfo>(&())?.ticks_per_s;
    let columns = read_columns(&mut client, &trace, ticks_per_s)?;
    let text = if arguments.json { as_json(&trace, &columns)? } else { as_csv(&columns) };
    write_whole(&arguments.output, text.as_bytes())?;
    console.note(format!(
        "{} of {}",
        pluralise(trace.records, "record"),
        pluralise(trace.variables.len(), "variable")
    ));
    Ok(())
}

fn finished(client: &mut Client, wait: f64) -> Result<TraceInfo> {
    let begin = Instant::now();
    loop {
        let trace = client.call::<GetTrace>(&())?;
        if trace.complete {
            return Ok(trace);
        }
        if !(begin.elapsed().as_secs_f64() < wait) {
            return Err(Error::new(
                DeviceCode::DeviceSilent,
                format!("the trace has not ended within {wait} s; it has {} records", trace.records),
            )
            .help("wait longer with --wait, or read it later with --read"));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Columns by their headings, time first.
type Columns = Vec<(String, Vec<f64>)>;

fn read_columns(client: &mut Client, trace: &TraceInfo, ticks_per_s: u32) -> Result<Columns> {
    let mut columns: Columns = vec![("time_s".to_owned(), Vec::new())];
    columns.extend(trace.variables.iter().map(|v| (heading(*v), Vec::new())));
    let width = trace.variables.len().max(1);
    let mut record = 0;
    while record < trace.records {
        let piece = client.call::<ReadTrace>(&TraceRead { record })?;
        if piece.values.len() < width {
            return Err(Error::new(DeviceCode::DeviceVerify, "the trace ends before its announced end")
                .help("it was armed again while it was read; try again"));
        }
        for values in piece.values.chunks_exact(width).take((trace.records - record) as usize) {
            let tick = trace.first_tick + u64::from(record) * u64::from(trace.every_ticks);
            let time = tick as f64 / f64::from(ticks_per_s.max(1));
            let cells = std::iter::once(time).chain(values.iter().map(|value| f64::from(*value)));
            for ((_, column), cell) in columns.iter_mut().zip(cells) {
                column.push(cell);
            }
            record += 1;
        }
    }
    Ok(columns)
}

fn as_csv(columns: &Columns) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..columns.first().map_or(0, |(_, time)| time.len()) {
        for (at, (_, column)) in columns.iter().enumerate() {
            // Values came as binary32: the fewest digits that read back as the same.
            text += &if at == 0 { format!("{:.6}", column[row]) } else { format!(",{}", column[row] as f32) };
        }
        text.push('\n');
    }
    text
}

fn as_json(trace: &TraceInfo, columns: &Columns) -> Result<String> {
    let document = document::Trace {
        schema: "pam-trace/1",
        records: trace.records,
        every_ticks: trace.every_ticks,
        first_tick: trace.first_tick,
        columns: columns.iter().map(|(name, c)| (name.as_str(), c.as_slice())).collect(),
    };
    Ok(text(&document)? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variable_of_the_loop_has_a_name() {
        for (name, v, _) in VARIABLES {
            assert_eq!(variable(name).unwrap(), v);
            assert_ne!(heading(v), "unknown");
        }
        assert!(variable("forse").unwrap_err().advice().is_some_and(|h| h.contains("did you mean force?")));
    }
}
