//! `host device`: ask a controller what it is, what it does, what went wrong, and how it is set.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Args, Subcommand, ValueEnum};
use model_core::link::endpoints::{
    ArmTrace, ClearFault, GetFaults, GetInfo, GetPastFault, GetSettings, GetStatus, GetTrace, ReadTrace,
    RollBackTable, SetSettings,
};
use model_core::link::hello::Board;
use model_core::link::messages::{
    Event, FAULT_LOG, Fault, PastFault, TraceArm, TraceInfo, TraceRead, Trigger, Variable,
};
use model_core::link::settings::Settings;
use model_core::link::{LINK_VERSION, SCHEMA_HASH};
use serde_json::json;

use super::port::{Muscle, PortOption};
use crate::console::Console;
use crate::device::{Client, Patience, Port, Topic, available, recorder, words};
use crate::error::{Code, Error, Result, nearest};
use crate::output::write_whole;

/// Arguments of `host device`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the serial devices, and which of them are controllers.
    #[command(after_help = "Example:\n  host device list")]
    List {
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Every version, what it is doing, its tables.
    #[command(
        after_help = "Examples:\n  host device info\n  host device info --port tcp:127.0.0.1:4321 --json"
    )]
    Info {
        #[command(flatten)]
        port: PortOption,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Follow what the device reports by itself: states and faults, in words.
    #[command(after_help = "Examples:\n  host device log\n  host device log --seconds 10")]
    Log {
        #[command(flatten)]
        port: PortOption,
        /// How long, s [default: until Ctrl-C].
        #[arg(long, value_name = "S")]
        seconds: Option<f64>,
        /// Print a line of JSON for each.
        #[arg(long)]
        json: bool,
    },
    /// Record variables of the control loop at every tick, in the device's own memory.
    #[command(after_help = "Examples:\n  \
        host device trace --variables pressure,force,command -o trace.csv\n  \
        host device trace --trigger until-fault --variables pressure,command\n  \
        host device trace --read -o before-the-fault.csv")]
    Trace(TraceArguments),
    /// Show, change, save or restore the settings.
    #[command(after_help = "Examples:\n  \
        host device settings > settings.toml\n  \
        host device settings --set limits.pressure_pa=500e3 --set watch.silence_ticks=200\n  \
        host device settings --from settings.toml")]
    Settings(SettingsArguments),
    /// The latched fault, counts, and past faults; in words, with the remedy.
    #[command(after_help = "Examples:\n  host device faults\n  host device faults --clear")]
    Faults {
        #[command(flatten)]
        port: PortOption,
        /// Forget the latched fault; refused while its cause is still there.
        #[arg(long)]
        clear: bool,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Go back to the table before.
    #[command(after_help = "Example:\n  host device rollback")]
    Rollback {
        #[command(flatten)]
        port: PortOption,
        #[command(flatten)]
        muscle: Muscle,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, Args)]
struct TraceArguments {
    #[command(flatten)]
    port: PortOption,
    /// What to record, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "pressure,force,asked,command")]
    variables: Vec<String>,
    /// One record every so many ticks.
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    every: u16,
    /// When to begin.
    #[arg(long, value_enum, value_name = "WHEN", default_value_t = Begin::Now)]
    trigger: Begin,
    /// Only read what an armed trace has recorded.
    #[arg(long, conflicts_with_all = ["variables", "every", "trigger"])]
    read: bool,
    /// How long to wait for the trace to end, s.
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    wait: f64,
    /// The file; `-` is standard output.
    #[arg(short, long, value_name = "OUT.csv", default_value = "-")]
    output: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Begin {
    /// At once.
    Now,
    /// With the next start of a mode or reference.
    Start,
    /// Round and round until a fault stops it; read it later with --read.
    UntilFault,
}

#[derive(Debug, Args)]
struct SettingsArguments {
    #[command(flatten)]
    port: PortOption,
    /// Change one setting; may be given again.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Take all settings from a file that `host device settings` printed.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "defaults")]
    from: Option<PathBuf>,
    /// Begin with the firmware's defaults.
    #[arg(long)]
    defaults: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Does what was asked.
    ///
    /// # Errors
    /// A device that is silent, foreign or refuses; a file that cannot be read or written.
    pub fn run(self, console: &Console) -> Result<()> {
        match self.action {
            Action::List { json } => list(json, console),
            Action::Info { port, json } => info(&port, json, console),
            Action::Log { port, seconds, json } => log(&port, seconds, json, console),
            Action::Trace(arguments) => trace(&arguments, console),
            Action::Settings(arguments) => settings(&arguments, console),
            Action::Faults { port, clear, json } => faults(&port, clear, json, console),
            Action::Rollback { port, muscle, json } => {
                let info = port.connect(console)?.call_once::<RollBackTable>(&muscle.side())?;
                console.result(if json {
                    json!({ "schema": "pam-rollback/1", "crc": format!("{:08x}", info.crc), "generation": info.generation }).to_string()
                } else {
                    format!("back to the table with check sum {:08x}", info.crc)
                });
                Ok(())
            }
        }
    }
}

fn list(json: bool, console: &Console) -> Result<()> {
    let patience = Patience { answer: Duration::from_millis(200), tries: 2, ..Patience::default() };
    let mut rows = Vec::new();
    for name in available() {
        let met = name.parse().and_then(|address| Client::greet(Port::open(&address)?, patience));
        rows.push(match met {
            Ok(client) => {
                let hello = client.hello();
                let (major, minor, patch) = hello.release;
                json!({
                    "port": name,
                    "controller": true,
                    "board": Board::from_code(hello.board).map_or("unknown", Board::name),
                    "serial": recorder::serial(hello),
                    "release": format!("{major}.{minor}.{patch}"),
                    "same_schema": hello.schema_hash == SCHEMA_HASH,
                })
            }
            Err(e) => json!({ "port": name, "controller": false, "why": e.cause() }),
        });
    }
    if json {
        console.result(format!("{:#}", json!(rows)));
    } else if rows.is_empty() {
        console.result("there is no serial device; an emulated one is named tcp:HOST:PORT");
    } else {
        for row in rows {
            let text = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
            console.result(if row["controller"] == true {
                let differs = if row["same_schema"] == true { "" } else { ", speaks another schema" };
                format!(
                    "{}: {}, release {}, serial {}{differs}",
                    text("port"),
                    text("board"),
                    text("release"),
                    text("serial")
                )
            } else {
                format!("{}: no controller ({})", text("port"), text("why"))
            });
        }
    }
    Ok(())
}

fn info(port: &PortOption, json: bool, console: &Console) -> Result<()> {
    // The versions are told even when they do not fit, and then the refusal.
    let greeted = Client::greet(Port::open(&port.address()?)?, Patience::default())?;
    let hello = *greeted.hello();
    drop(greeted);
    let (major, minor, patch) = hello.release;
    let board = Board::from_code(hello.board).map_or("unknown board", Board::name);
    if !json {
        console.result(format!(
            "{board}, release {major}.{minor}.{patch}, serial {}, {} starts\n\
             link version {} (this program {LINK_VERSION}), schema {:016x} (this program {SCHEMA_HASH:016x})\n\
             table format {}, store format {}, {} muscle{}",
            recorder::serial(&hello),
            hello.starts,
            hello.link_version,
            hello.schema_hash,
            hello.table_format,
            hello.store_format,
            hello.muscles,
            if hello.muscles == 1 { "" } else { "s" },
        ));
    }
    let mut client = port.connect(console)?;
    let info = client.call::<GetInfo>(&())?;
    let status = client.call::<GetStatus>(&())?;
    if json {
        let settings = client.call::<GetSettings>(&())?;
        let mut all = recorder::about_device(&hello, &info, &settings);
        all["schema"] = json!("pam-device/1");
        all["link_schema"] = json!(format!("{:016x}", hello.schema_hash));
        all["muscles"] = json!(info.muscles);
        all["table_capacity"] = json!(info.table_capacity);
        all["trace_capacity"] = json!(info.trace_capacity);
        all["reference_capacity"] = json!(info.reference_capacity);
        all["started_by"] = json!(words::started_by(info.started_by));
        all["status"] = json!({
            "state": words::state(status.state),
            "mode": words::mode(status.mode),
            "fault": status.fault.map(|f| words::fault(f).name),
            "time_s": status.time_us as f64 * 1e-6,
            "ticks": status.ticks,
            "overruns": status.overruns,
            "frames_good": status.frames_good,
            "frames_bad": status.frames_bad,
            "telemetry_dropped": status.telemetry_dropped,
            "saturated_ticks": status.saturated_ticks,
        });
        console.result(format!("{all:#}"));
        return Ok(());
    }
    console.result(format!(
        "{}{} in {} mode, {:.1} s and {} ticks at {} Hz since its start ({}), {} overruns",
        words::state(status.state),
        status.fault.map(|f| format!(" ({})", words::fault(f).cause)).unwrap_or_default(),
        words::mode(status.mode),
        status.time_us as f64 * 1e-6,
        status.ticks,
        info.ticks_per_s,
        words::started_by(info.started_by),
        status.overruns,
    ));
    for (number, table) in info.tables.iter().take(usize::from(info.muscles)).enumerate() {
        console.result(match table {
            Some(t) => format!(
                "muscle {}: table {:08x}, {} bytes, generation {}{}",
                number + 1,
                t.crc,
                t.length,
                t.generation,
                if t.has_previous { ", the one before is kept" } else { "" }
            ),
            None => format!("muscle {}: no table", number + 1),
        });
    }
    Ok(())
}

fn log(port: &PortOption, seconds: Option<f64>, json: bool, console: &Console) -> Result<()> {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed))
        .map_err(|e| Error::new(Code::CallInvalid, format!("Ctrl-C cannot be watched: {e}")))?;
    let say = |time_us: Option<u64>, event: &str, text: String, remedy: Option<&str>| {
        let time = time_us.map(|t| t as f64 * 1e-6);
        if json {
            console.result(json!({ "time_s": time, "event": event, "text": text, "remedy": remedy }));
            return;
        }
        let clock = time.map_or(String::new(), |t| format!("{t:12.3} s"));
        console.result(format!("{clock:14}  {}{text}", if event == "fault" { "FAULT " } else { "" }));
        if let Some(remedy) = remedy {
            console.result(format!("{:15}what to do: {remedy}", ""));
        }
    };
    let mut client = port.connect(console)?;
    let begin = Instant::now();
    let mut last = None;
    let mut asked = None::<Instant>;
    while !stop.load(Ordering::Relaxed) && seconds.is_none_or(|s| begin.elapsed().as_secs_f64() < s) {
        // Events tell at once; the question every second also notices a device that is gone.
        if asked.is_none_or(|at| at.elapsed() >= Duration::from_secs(1)) {
            let status = client.call::<GetStatus>(&())?;
            asked = Some(Instant::now());
            if last != Some((status.state, status.mode)) {
                last = Some((status.state, status.mode));
                let text = format!("{} in {} mode", words::state(status.state), words::mode(status.mode));
                say(Some(status.time_us), "state", text, None);
            }
        }
        match client.topic(Duration::from_millis(100))? {
            Some(Topic::Event(Event::Fault(report))) => {
                let remedy = words::fault(report.fault).remedy;
                say(Some(report.time_us), "fault", words::report(&report), Some(remedy));
            }
            Some(Topic::Event(Event::State(_))) => asked = None,
            Some(Topic::Event(Event::TraceFull)) => {
                say(None, "trace-full", "trace full: host device trace --read".to_owned(), None);
            }
            Some(Topic::Telemetry(_)) | None => {}
        }
    }
    Ok(())
}

/// Variables by the names people write.
const VARIABLES: [(&str, Variable, &str); 19] = [
    ("pressure", Variable::Pressure, "Pa"),
    ("stroke", Variable::Stroke, "m"),
    ("force", Variable::Force, "N"),
    ("speed", Variable::Speed, "m_per_s"),
    ("direction", Variable::Direction, ""),
    ("asked", Variable::Asked, ""),
    ("wanted-force", Variable::WantedForce, "N"),
    ("feed-forward", Variable::FeedForward, "Pa"),
    ("trim", Variable::Trim, "Pa"),
    ("wanted-pressure", Variable::WantedPressure, "Pa"),
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
        Error::new(Code::CallInvalid, "no variable of the loop has this name")
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

fn trace(arguments: &TraceArguments, console: &Console) -> Result<()> {
    let mut variables = heapless::Vec::new();
    for name in &arguments.variables {
        variables.push(variable(name)?).map_err(|_| {
            Error::new(
                Code::CallInvalid,
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
        return Err(
            Error::new(Code::DeviceRefused, "the trace is empty").help("arm one first, without --read")
        );
    }
    let ticks_per_s = client.call::<GetInfo>(&())?.ticks_per_s;
    let text = read_trace(&mut client, &trace, ticks_per_s)?;
    write_whole(&arguments.output, text.as_bytes())?;
    console.note(format!("{} records of {} variables", trace.records, trace.variables.len()));
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
                Code::DeviceSilent,
                format!("the trace has not ended within {wait} s; it has {} records", trace.records),
            )
            .help("wait longer with --wait, or read it later with --read"));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn read_trace(client: &mut Client, trace: &TraceInfo, ticks_per_s: u32) -> Result<String> {
    let headings: Vec<String> = trace.variables.iter().map(|v| heading(*v)).collect();
    let mut text = format!("time_s,{}\n", headings.join(","));
    let width = trace.variables.len().max(1);
    let mut record = 0;
    while record < trace.records {
        let piece = client.call::<ReadTrace>(&TraceRead { record })?;
        if piece.values.len() < width {
            return Err(Error::new(Code::DeviceVerify, "the trace ends before its announced end")
                .help("it was armed again while it was read; try again"));
        }
        for values in piece.values.chunks_exact(width).take((trace.records - record) as usize) {
            let tick = trace.first_tick + u64::from(record) * u64::from(trace.every_ticks);
            let cells: Vec<String> = values.iter().map(f32::to_string).collect();
            text += &format!("{:.6},{}\n", tick as f64 / f64::from(ticks_per_s.max(1)), cells.join(","));
            record += 1;
        }
    }
    Ok(text)
}

fn settings(arguments: &SettingsArguments, console: &Console) -> Result<()> {
    let mut wanted = match &arguments.from {
        Some(path) => {
            let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, &e))?;
            Some(toml::from_str::<Settings>(&text).map_err(|e| {
                crate::muscle_description::toml_error(Code::CallInvalid, &text, &e)
                    .file(path)
                    .help("the file must hold all settings, as `host device settings` prints them")
            })?)
        }
        None => arguments.defaults.then(Settings::default),
    };
    let mut client = arguments.port.connect(console)?;
    let before = client.call::<GetSettings>(&())?;
    for assignment in &arguments.set {
        wanted = Some(changed(wanted.unwrap_or(before), assignment)?);
    }
    let mut now = before;
    if let Some(wanted) = wanted {
        // The answer says what is in force, and asking again says what is kept: both must be what was sent.
        let answered = client.call_once::<SetSettings>(&wanted)?;
        now = client.call::<GetSettings>(&())?;
        if answered != wanted || now != wanted {
            return Err(Error::new(Code::DeviceVerify, "the device keeps other settings than it was sent")
                .help("look at them with `host device settings`"));
        }
        console.note("written and read back");
    }
    if arguments.json {
        console.result(format!("{:#}", json!(now)));
    } else {
        let text = toml::to_string(&now)
            .map_err(|e| Error::new(Code::DeviceVerify, format!("the settings cannot be printed: {e}")))?;
        console.result(text.trim_end());
    }
    Ok(())
}

/// The settings with one of them changed, by its dotted name.
pub(crate) fn changed(settings: Settings, assignment: &str) -> Result<Settings> {
    let wrong = |cause: String| {
        Error::new(Code::CallInvalid, cause)
            .value(assignment)
            .help("write KEY=VALUE with a key as `host device settings` prints it, such as limits.pressure_pa=500e3")
    };
    let (key, value) = assignment.split_once('=').ok_or_else(|| wrong("a setting needs a value".into()))?;
    let mut all =
        toml::Value::try_from(settings).map_err(|e| wrong(format!("the settings cannot be changed: {e}")))?;
    let mut place = &mut all;
    for part in key.trim().split('.') {
        let table = place.as_table_mut().ok_or_else(|| wrong(format!("`{key}` names no setting")))?;
        let names: Vec<String> = table.keys().cloned().collect();
        place = table.get_mut(part).ok_or_else(|| {
            let near = nearest(part, names.iter().map(String::as_str))
                .map(|n| format!("; did you mean `{n}`?"))
                .unwrap_or_default();
            wrong(format!("`{key}` names no setting{near}"))
        })?;
    }
    let value = value.trim();
    *place = match place {
        toml::Value::Float(_) => {
            value.parse().map(toml::Value::Float).map_err(|_| wrong("not a number".into()))?
        }
        toml::Value::Integer(_) => {
            value.parse().map(toml::Value::Integer).map_err(|_| wrong("not a whole number".into()))?
        }
        toml::Value::Boolean(_) => {
            value.parse().map(toml::Value::Boolean).map_err(|_| wrong("neither true nor false".into()))?
        }
        toml::Value::String(_) => toml::Value::String(value.to_owned()),
        _ => return Err(wrong(format!("`{key}` is a group of settings, not one"))),
    };
    all.try_into().map_err(|e: toml::de::Error| wrong(e.message().to_owned()))
}

fn faults(port: &PortOption, clear: bool, json: bool, console: &Console) -> Result<()> {
    let mut client = port.connect(console)?;
    let faults = client.call::<GetFaults>(&())?;
    let mut past = Vec::new();
    for back in 0..FAULT_LOG as u8 {
        match client.call::<GetPastFault>(&PastFault { back })? {
            Some(report) => past.push(report),
            None => break,
        }
    }
    if json {
        let one = |r: &model_core::link::messages::FaultReport| {
            let w = words::fault(r.fault);
            json!({ "fault": w.name, "cause": w.cause, "remedy": w.remedy, "time_s": r.time_us as f64 * 1e-6,
                "value": r.value, "limit": r.limit, "muscle": words::side(r.side), "mode": words::mode(r.mode),
                "last": { "pressure_Pa": r.last.pressure_pa, "stroke_m": r.last.stroke_m, "force_N": r.last.force_n } })
        };
        let counts: serde_json::Map<String, serde_json::Value> = Fault::ALL
            .iter()
            .zip(faults.counts)
            .filter(|(_, n)| *n > 0)
            .map(|(f, n)| (words::fault(*f).name.to_owned(), json!(n)))
            .collect();
        console.result(format!(
            "{:#}",
            json!({ "schema": "pam-faults/1", "latched": faults.latched.as_ref().map(one), "counts": counts,
                "past": past.iter().map(one).collect::<Vec<_>>() })
        ));
    } else {
        match &faults.latched {
            Some(report) => {
                console.result(format!("latched: {}", words::report(report)));
                console.result(format!("what to do: {}", words::fault(report.fault).remedy));
            }
            None => console.result("no fault is latched"),
        }
        for (fault, count) in Fault::ALL.iter().zip(faults.counts).filter(|(_, n)| *n > 0) {
            console.result(format!("since the start: {} × {}", count, words::fault(*fault).cause));
        }
        for report in &past {
            console.result(format!("past: {}", words::report(report)));
        }
    }
    if clear {
        let status = client.call_once::<ClearFault>(&())?;
        console.note(format!("cleared; the device is {}", words::state(status.state)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_setting_is_changed_by_its_name_and_wrong_names_are_met_with_the_nearest() {
        let all = Settings::default();
        let now = changed(all, "limits.pressure_pa=500e3").unwrap();
        assert_eq!(now.limits.pressure_pa, 500e3);
        assert_eq!(Settings { limits: all.limits, ..now }, all);
        assert_eq!(changed(all, "watch.silence_ticks = 200").unwrap().watch.silence_ticks, 200);
        assert!(matches!(
            changed(all, "feed_forward=Gaylord").unwrap().feed_forward,
            model_core::link::settings::FeedForward::Gaylord
        ));
        for (wrong, hint) in [
            ("limits.presure_pa=1", "did you mean `pressure_pa`"),
            ("limits=1", "group"),
            ("limits.pressure_pa=much", "not a number"),
            ("watch.silence_ticks=-1", "invalid"),
            ("feed_forward=Best", "unknown variant"),
            ("limits.pressure_pa", "needs a value"),
        ] {
            let error = changed(all, wrong).unwrap_err();
            assert!(error.to_string().contains(hint), "{wrong}: {error}");
            assert_eq!(error.exit_status(), 2);
        }
    }

    #[test]
    fn every_variable_of_the_loop_has_a_name() {
        for (name, v, _) in VARIABLES {
            assert_eq!(variable(name).unwrap(), v);
            assert_ne!(heading(v), "unknown");
        }
        assert!(variable("forse").unwrap_err().advice().is_some_and(|h| h.contains("did you mean force?")));
    }
}
