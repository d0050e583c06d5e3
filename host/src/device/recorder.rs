//! Telemetry to a recording that `host fit` and `host predict` read: CSV, with a side file about how it was made.
//!
//! Rows go to `NAME.part` while they arrive, and the file gets its name when it is whole. A program that is killed, a cable
//! that is pulled or a disk that fills leaves the `.part` with every row until then: rename it and it is a recording.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use model_core::link::hello::{Board, Hello};
use model_core::link::messages::{DeviceInfo, Telemetry};
use model_core::link::settings::Settings;
use serde_json::{Value, json};

use super::{Losses, words};
use crate::error::{Error, Result};
use crate::output::write_whole;

/// The header line. Measured columns are the recording's; the rest is what the controller thought.
pub const HEADER: &str =
    "time_s,pressure_Pa,displacement_m,force_N,pressure_command_Pa,wanted_Pa,table_N,asked,state,mode,tick";

/// Rows between two flushes to the disk: what a killed program may lose, 0.1 s at 1 kHz.
const FLUSH: u64 = 100;

/// A recording on its way to the disk.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    rows: u64,
    last_time_us: Option<u64>,
    skipped: u64,
}

impl Recorder {
    /// Begins a recording that will be called `path`.
    ///
    /// # Errors
    /// [`Code::FileUnwritable`](crate::error::Code::FileUnwritable).
    pub fn create(path: &Path) -> Result<Self> {
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let part = PathBuf::from(part);
        let mut file = File::create(&part).map(BufWriter::new).map_err(|e| {
            Error::unwritable(&part, &e).help("check that the folder exists and may be written to")
        })?;
        writeln!(file, "{HEADER}").map_err(|e| Error::unwritable(&part, &e))?;
        Ok(Self { path: path.to_owned(), part, file, rows: 0, last_time_us: None, skipped: 0 })
    }

    /// Adds one sample of the first muscle. Samples that are not later than the one before, and readings that are no
    /// numbers, are counted and left out: a recording has neither.
    ///
    /// # Errors
    /// [`Code::FileUnwritable`](crate::error::Code::FileUnwritable), for instance when the disk is full; the rows until then
    /// stay in the `.part`.
    pub fn push(&mut self, sample: &Telemetry) -> Result<()> {
        let Some(side) = sample.sides.first() else { return Ok(()) };
        let measured = [side.pressure_pa, side.stroke_m, side.force_n, side.command_pa];
        if self.last_time_us.is_some_and(|last| sample.time_us <= last)
            || measured.iter().any(|v| !v.is_finite())
        {
            self.skipped += 1;
            return Ok(());
        }
        self.last_time_us = Some(sample.time_us);
        self.rows += 1;
        let seconds = sample.time_us / 1_000_000;
        let micros = sample.time_us % 1_000_000;
        // Floats are written in the fewest digits that read back as the same bits.
        let written = writeln!(
            self.file,
            "{seconds}.{micros:06},{},{},{},{},{},{},{},{},{},{}",
            side.pressure_pa,
            side.stroke_m,
            side.force_n,
            side.command_pa,
            side.wanted_pa,
            side.model_n,
            sample.asked,
            words::state(sample.state),
            words::mode(sample.mode),
            sample.tick
        );
        let flushed = if self.rows.is_multiple_of(FLUSH) { self.file.flush() } else { Ok(()) };
        written.and(flushed).map_err(|e| self.failed(&e))
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

    /// Gives the recording its name and writes the side file `NAME.json`.
    ///
    /// # Errors
    /// [`Code::FileUnwritable`](crate::error::Code::FileUnwritable).
    pub fn finish(mut self, about: &Value) -> Result<PathBuf> {
        let synced = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        synced.map_err(|e| self.failed(&e))?;
        let side_file = side_file(&self.path);
        let text = serde_json::to_string_pretty(about).unwrap_or_default();
        write_whole(&side_file, text.as_bytes())?;
        std::fs::rename(&self.part, &self.path).map_err(|e| self.failed(&e))?;
        Ok(self.path)
    }

    fn failed(&self, reason: &std::io::Error) -> Error {
        Error::unwritable(&self.path, reason).help(format!(
            "{} rows until then are in {}",
            self.rows,
            self.part.display()
        ))
    }
}

/// The name of a recording's side file.
#[must_use]
pub fn side_file(recording: &Path) -> PathBuf {
    let mut name = recording.as_os_str().to_owned();
    name.push(".json");
    PathBuf::from(name)
}

/// What a side file says about a device: every version, its table, its settings.
#[must_use]
pub fn about_device(hello: &Hello, info: &DeviceInfo, settings: &Settings) -> Value {
    let (major, minor, patch) = hello.release;
    json!({
        "board": Board::from_code(hello.board).map_or("unknown", Board::name),
        "serial": serial(hello),
        "release": format!("{major}.{minor}.{patch}"),
        "link_version": hello.link_version,
        "table_format": hello.table_format,
        "store_format": hello.store_format,
        "schema": format!("{:016x}", hello.schema_hash),
        "starts": hello.starts,
        "ticks_per_s": info.ticks_per_s,
        "tables": info.tables.iter().map(|t| t.map(|t| json!({
            "crc": format!("{:08x}", t.crc), "bytes": t.length, "generation": t.generation,
        }))).collect::<Vec<_>>(),
        "settings": settings,
    })
}

/// What a side file says about losses on the way.
#[must_use]
pub fn about_losses(losses: Losses) -> Value {
    json!({
        "samples": losses.samples,
        "gaps": losses.gaps,
        "bad_frames": losses.bad_frames,
        "repeated_requests": losses.repeats,
        "unread": losses.unread,
    })
}

/// The chip's serial number: as text where it is text, else in hexadecimal.
#[must_use]
pub fn serial(hello: &Hello) -> String {
    let bytes = &hello.serial;
    if bytes.iter().all(|b| *b == 0) {
        return "none".to_owned();
    }
    let text: Vec<u8> = bytes.iter().copied().take_while(|b| *b != 0).collect();
    if text.iter().all(|b| b.is_ascii_graphic() || *b == b' ') {
        return String::from_utf8_lossy(&text).into_owned();
    }
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::link::messages::{Mode, SideSample, State};

    fn sample(time_us: u64, force_n: f32) -> Telemetry {
        let side = SideSample { force_n, pressure_pa: 1e5 / 3.0, ..SideSample::default() };
        Telemetry {
            time_us,
            tick: time_us / 1000,
            state: State::Running,
            mode: Mode::Force,
            asked: 1.0,
            asked_second: 0.0,
            sides: [side].into_iter().collect(),
        }
    }

    #[test]
    fn the_file_has_its_name_only_when_it_is_whole() {
        let folder = std::env::temp_dir().join(format!("pam-recorder-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("run.csv");
        let mut recorder = Recorder::create(&path).unwrap();
        recorder.push(&sample(1_000_500, 1.5)).unwrap();
        recorder.push(&sample(1_000_500, 2.0)).unwrap();
        recorder.push(&sample(1_002_000, f32::NAN)).unwrap();
        recorder.push(&sample(1_003_000, -2.0)).unwrap();
        assert_eq!((recorder.rows(), recorder.skipped()), (2, 2));
        assert!(!path.exists());
        recorder.finish(&json!({"a": 1})).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines[0], HEADER);
        assert_eq!(lines[1], "1.000500,33333.332,0,1.5,0,0,0,1,running,force,1000");
        assert_eq!(lines.len(), 3);
        assert!(side_file(&path).exists());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        std::fs::remove_dir_all(&folder).unwrap();
        let error = Recorder::create(&folder.join("run.csv")).unwrap_err();
        assert_eq!(error.exit_status(), 1);
    }
}
