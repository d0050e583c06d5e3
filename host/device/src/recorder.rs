//! Telemetry to a recording: CSV that `host fit` and `host predict` read, or MCAP for the viewers of robotics, with a side
//! file about how it was made.
//!
//! Rows go to `NAME.part` while they arrive, piece by piece, and the file gets its name when it has ended. A program that is
//! stopped leaves the `.part` with every piece until then, and what was known at the start in `NAME.part.json`; a disk that is
//! full ends the file after the last piece that fitted. [`recover()`] makes a whole recording of a `.part`, and the next recording
//! of the same name does so before it begins.

mod about;
mod columns;
mod mcap;
mod part;
mod recover;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use model_core::link::messages::{Event, Telemetry};
use serde::Serialize;
use serde_json::Value;

pub use about::{About, Device, Ended, LinkedDevice, StoredTable, serial};
pub use recover::{Recovered, Tally, recover};

use self::mcap::Encoder;
use self::part::{Part, part_of};
use super::messages;
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::{json_of, write_whole};
use pam_data::pluralise::pluralise;

/// Time between two pieces: what a stopped program may lose.
const PIECE: Duration = Duration::from_millis(100);
/// Events that the side file lists; more are in the MCAP only.
const EVENTS: usize = 1_000;

/// How the side file of a growing recording says that it ended; the end replaces it.
const CUT_OFF: &str = "it was cut off: the program or its computer was stopped";

/// The side file of a recording that grows.
#[derive(Serialize)]
struct Growing<'a, A> {
    #[serde(flatten)]
    about: &'a A,
    ended_by: &'static str,
}

/// The side file of a recording that has ended.
#[derive(Serialize)]
struct Whole<'a, A> {
    #[serde(flatten)]
    about: &'a A,
    rows: u64,
    left_out: u64,
    events: &'a [Reported],
}

/// What a device reported without a request. The fields have the order in which viewers show them.
#[derive(Debug, Serialize)]
struct Reported {
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    remedy: Option<&'static str>,
    text: String,
    /// Time of the device; null before the first sample.
    time_s: Option<f64>,
}

impl Reported {
    /// An event, and the time of the last sample before it.
    fn of(event: &Event, last_time_us: Option<u64>) -> Self {
        let seconds = |time_us: u64| time_us as f64 * 1e-6;
        let time_s = last_time_us.map(seconds);
        match event {
            Event::Fault(report) => Self {
                event: "fault",
                remedy: Some(messages::fault(report.fault).remedy),
                text: messages::report(report),
                time_s: Some(seconds(report.time_us)),
            },
            Event::State(state) => {
                Self { event: "state", remedy: None, text: messages::state(*state).to_owned(), time_s }
            }
            Event::TraceFull => {
                Self { event: "trace-full", remedy: None, text: "the trace is full".to_owned(), time_s }
            }
        }
    }
}

/// One file of a recording.
#[derive(Debug)]
struct Stream {
    part: Part,
    form: Form,
}

#[derive(Debug)]
enum Form {
    /// Lines that are not in the file yet, and whether the header was written.
    Csv(String, bool),
    Mcap(Box<Encoder>),
}

impl Stream {
    /// Writes what is finished as one piece.
    fn flush(&mut self) -> Result<()> {
        let piece = match &mut self.form {
            Form::Csv(lines, _) => std::mem::take(lines).into_bytes(),
            Form::Mcap(encoder) => encoder.take().map_err(|e| encoding(self.part.path(), &e))?,
        };
        self.part.append(&piece).map_err(|e| full(self.part.path(), &e))
    }
}

/// A recording on its way to the disk.
#[derive(Debug)]
pub struct Recorder {
    streams: Vec<Stream>,
    side: PathBuf,
    events: Vec<Reported>,
    rows: u64,
    first_time_us: Option<u64>,
    last_time_us: Option<u64>,
    skipped: u64,
    flushed: Instant,
    recovered: Vec<Recovered>,
    failed: Option<Error>,
}

impl Recorder {
    /// Begins a recording in all `paths`: a name that ends in `.mcap` becomes MCAP, any other CSV. `about` is what is known
    /// now, and all that a program which is stopped leaves of it: a document of named fields.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`], [`DataCode::CallInvalid`] without a path or with one given twice.
    pub fn create(paths: &[PathBuf], about: &impl Serialize) -> Result<Self> {
        let first =
            paths.first().ok_or_else(|| Error::new(DataCode::CallInvalid, "a recording needs a file"))?;
        let begun_ns = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_nanos() as u64);
        let known = json_of(about);
        let (mut streams, mut recovered) = (Vec::new(), Vec::new());
        for (number, path) in paths.iter().enumerate() {
            if paths[..number].contains(path) {
                return Err(Error::new(DataCode::CallInvalid, "this file is given twice").file(path));
            }
            let (part, kept) = Part::create(path)?;
            recovered.extend(kept);
            let form = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
                Form::Mcap(Box::new(Encoder::new(&known, begun_ns).map_err(|e| encoding(path, &e))?))
            } else {
                Form::Csv(String::new(), false)
            };
            streams.push(Stream { part, form });
        }
        write_side(&side_file(&part_of(first)), &json_of(&Growing { about, ended_by: CUT_OFF }))?;
        let mut begun = Self {
            streams,
            side: side_file(first),
            events: Vec::new(),
            rows: 0,
            first_time_us: None,
            last_time_us: None,
            skipped: 0,
            flushed: Instant::now(),
            recovered,
            failed: None,
        };
        begun.flush()?;
        Ok(begun)
    }

    /// Adds one sample. Samples that are not later than the one before, and readings of the first muscle that are not numbers,
    /// are counted and left out: a recording has neither.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`], for instance when the disk is full; the rows until then stay in the file.
    pub fn push(&mut self, sample: &Telemetry) -> Result<()> {
        let Some(side) = sample.sides.first() else { return Ok(()) };
        let measured = [side.pressure_pa, side.stroke_m, side.force_n, side.command_pa];
        if self.last_time_us.is_some_and(|last| sample.time_us <= last)
            || measured.iter().any(|v| !v.is_finite())
        {
            self.skipped += 1;
            return Ok(());
        }
        let since = sample.time_us - *self.first_time_us.get_or_insert(sample.time_us);
        self.last_time_us = Some(sample.time_us);
        self.rows += 1;
        for stream in &mut self.streams {
            match &mut stream.form {
                Form::Csv(lines, headed) => {
                    if !std::mem::replace(headed, true) {
                        lines.push_str(&columns::header(sample));
                    }
                    columns::write_csv(lines, sample);
                }
                Form::Mcap(encoder) => encoder
                    .sample(since, &columns::json(sample))
                    .map_err(|e| encoding(stream.part.path(), &e))?,
            }
        }
        if self.flushed.elapsed() >= PIECE { self.flush() } else { Ok(()) }
    }

    /// Adds something that the device reported without a request.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn event(&mut self, event: &Event) -> Result<()> {
        let reported = Reported::of(event, self.last_time_us);
        let since = self.last_time_us.unwrap_or(0) - self.first_time_us.unwrap_or(0);
        let message = json_of(&reported).to_string();
        for stream in &mut self.streams {
            if let Form::Mcap(encoder) = &mut stream.form {
                encoder.event(since, &message).map_err(|e| encoding(stream.part.path(), &e))?;
            }
        }
        if self.events.len() < EVENTS {
            self.events.push(reported);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        self.flushed = Instant::now();
        for stream in &mut self.streams {
            if let Err(error) = stream.flush() {
                let paths = stream.part.path().display().to_string();
                let error =
                    error.help(format!("free disk space; the recording up to this point is in {paths}"));
                self.failed = Some(Error::new(error.code(), error.cause()).file(&paths));
                return Err(error);
            }
        }
        Ok(())
    }

    /// Rows so far.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Samples that were left out.
    #[must_use]
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Recordings that an earlier program left cut off under the same name, and what became of them.
    #[must_use]
    pub fn recovered(&self) -> &[Recovered] {
        &self.recovered
    }

    /// Ends the recording: every file gets its name, and `NAME.json` beside the first says how it was made. Also after an
    /// error of [`Self::push`]: then the files end with the last piece that fitted.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`] when something could not be written, now or before.
    pub fn finish(mut self, about: &impl Serialize) -> Result<PathBuf> {
        let about = json_of(&Whole { about, rows: self.rows, left_out: self.skipped, events: &self.events });
        let mut trouble = self.failed.take();
        let mut paths = Vec::new();
        for mut stream in std::mem::take(&mut self.streams) {
            let path = stream.part.path().to_owned();
            let ended = if trouble.is_none() { stream.end(&about) } else { stream.cut_off() };
            trouble = trouble.or(ended.err());
            match stream.part.finish() {
                Ok(path) => paths.push(path),
                Err(e) => trouble = trouble.or(Some(e.file(path))),
            }
        }
        // What was known at the start is in for what cannot be written at the end.
        let early = paths.first().map(|p| side_file(&part_of(p)));
        match write_side(&self.side, &about) {
            Ok(()) => early.map(std::fs::remove_file),
            Err(e) => {
                trouble = trouble.or(Some(e));
                early.map(|early| std::fs::rename(early, &self.side))
            }
        };
        match (trouble, paths.into_iter().next()) {
            (None, Some(first)) => Ok(first),
            (Some(error), _) => Err(error.help(format!(
                "it holds {} up to this point; free disk space and continue",
                pluralise(self.rows, "row")
            ))),
            (None, None) => {
                Err(Error::new(DataCode::FileUnwritable, "the recording has no file").file(&self.side))
            }
        }
    }
}

impl Stream {
    fn end(&mut self, about: &Value) -> Result<()> {
        let last = match &mut self.form {
            Form::Csv(lines, headed) => {
                if !*headed {
                    lines.push_str(&columns::plain_header());
                }
                std::mem::take(lines).into_bytes()
            }
            Form::Mcap(encoder) => encoder.end(about).map_err(|e| encoding(self.part.path(), &e))?,
        };
        let written = self.part.append(&last).map_err(|e| full(self.part.path(), &e));
        if written.is_err() { written.and(self.cut_off()) } else { Ok(()) }
    }

    /// The end of a file that must end here.
    fn cut_off(&mut self) -> Result<()> {
        match self.form {
            Form::Csv(..) => Ok(()),
            Form::Mcap(_) => self.part.append_end(&mcap::END).map_err(|e| full(self.part.path(), &e)),
        }
    }
}

fn full(path: &Path, reason: &std::io::Error) -> Error {
    Error::unwritable(path, reason)
}

fn encoding(path: &Path, reason: &::mcap::McapError) -> Error {
    Error::new(DataCode::FileUnwritable, format!("cannot be written as MCAP: {reason}")).file(path)
}

fn write_side(path: &Path, about: &Value) -> Result<()> {
    write_whole(path, format!("{about:#}\n").as_bytes())
}

/// The name of a recording's side file.
#[must_use]
pub fn side_file(recording: &Path) -> PathBuf {
    let mut name = recording.as_os_str().to_owned();
    name.push(".json");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::{Mode, SideSample, State};
    use serde_json::json;

    fn sample(time_us: u64, force_n: f32) -> Telemetry {
        let side = SideSample { force_n, pressure_pa: 1e5 / 3.0, ..SideSample::default() };
        Telemetry {
            time_us,
            tick: time_us / 1000,
            state: State::Running,
            mode: Mode::Force,
            setpoint: 1.0,
            setpoint_second: 0.0,
            sides: [side].into_iter().collect(),
        }
    }

    #[test]
    fn the_files_have_their_names_only_when_they_are_whole() {
        let folder = tempfile::tempdir().unwrap();
        let (csv, mcap) = (folder.path().join("run.csv"), folder.path().join("run.mcap"));
        let mut recorder =
            Recorder::create(&[csv.clone(), mcap.clone()], &json!({"host": "1", "device": {"board": "b"}}))
                .unwrap();
        recorder.push(&sample(1_000_500, 1.5)).unwrap();
        recorder.push(&sample(1_000_500, 2.0)).unwrap();
        recorder.push(&sample(1_002_000, f32::NAN)).unwrap();
        recorder.event(&Event::State(State::Running)).unwrap();
        recorder.push(&sample(1_003_000, -2.0)).unwrap();
        assert_eq!((recorder.rows(), recorder.skipped()), (2, 2));
        assert!(!csv.exists() && !mcap.exists());
        recorder.finish(&json!({"a": 1})).unwrap();
        let text = std::fs::read_to_string(&csv).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(
            lines[0],
            "time_s,pressure_Pa,displacement_m,force_N,pressure_command_Pa,pressure_demand_Pa,table_N,setpoint,state,mode,tick"
        );
        assert_eq!(lines[1], "1.000500,33333.332,0,1.5,0,0,0,1,running,force,1000");
        assert_eq!(lines.len(), 3);
        let about: Value = serde_json::from_slice(&std::fs::read(side_file(&csv)).unwrap()).unwrap();
        assert_eq!((about["rows"].as_u64(), about["events"][0]["text"].as_str()), (Some(2), Some("running")));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
        let bytes = std::fs::read(&mcap).unwrap();
        let messages: Vec<_> = ::mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap()).collect();
        assert_eq!(
            messages.iter().map(|m| m.channel.topic.as_str()).collect::<Vec<_>>(),
            ["/telemetry", "/events", "/telemetry"]
        );
        assert_eq!(messages[2].log_time - messages[0].log_time, 2_500_000);
        let value: Value = serde_json::from_slice(&messages[2].data).unwrap();
        assert_eq!((value["force_N"].as_f64(), value["tick"].as_u64()), (Some(-2.0), Some(1003)));
        let error = Recorder::create(&[folder.path().join("no/such/run.csv")], &json!({})).unwrap_err();
        assert_eq!(error.exit_status(), 1);
        assert_eq!(Recorder::create(&[csv.clone(), csv], &json!({})).unwrap_err().exit_status(), 2);
    }
}
