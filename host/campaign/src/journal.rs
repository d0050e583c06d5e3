//! The log of a campaign: what was chosen, what was recorded, what was learnt. Written before anything depends on it, and read again when
//! a campaign is resumed.
//!
//! `journal.jsonl` has one event per line and is synchronised with the disk after each. Rows go to `NN_NAME.csv.part`, synchronised piece by
//! piece; the file gets its name when the step is complete. After an interruption the whole rows of a `.part` become `NN_NAME_cut.csv`.
//! A spoiled recording is named `NN_NAME.csv.spoiled`: `*.csv` names what a fit or a diagnosis may read.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use pam_data::error::{DataCode, Error, Result};
use pam_fit::checks;

pub use self::event::{Chosen, Event};
use crate::actuation::Reading;

mod event;

/// Name of the log in the campaign's folder.
pub(crate) const JOURNAL: &str = "journal.jsonl";
/// Time between two pieces of rows on the disk.
const PIECE: Duration = Duration::from_millis(200);
/// Columns of every recording.
const HEADER: &str = "time_s,pressure_kPa,displacement_mm,force_N,pressure_command_kPa\n";

/// End of the name of a spoiled recording.
const SPOILED: &str = ".csv.spoiled";

/// How the recording of a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Completion {
    /// As planned.
    Whole,
    /// Interrupted: its rows are fitted like others.
    Cut,
    /// Spoiled: it is kept and not fitted.
    Spoiled,
}

/// The open log of a campaign.
#[derive(Debug)]
pub struct Journal {
    folder: PathBuf,
    log: File,
    events: Vec<Event>,
    part: Option<Part>,
}

#[derive(Debug)]
struct Part {
    name: String,
    path: PathBuf,
    file: File,
    waiting: String,
    rows: u64,
    synced: Instant,
}

fn unwritable(path: &Path) -> impl Fn(std::io::Error) -> Error + '_ {
    move |e| Error::unwritable(path, &e)
}

impl Journal {
    /// Opens the log of a folder, or begins one. What an interrupted program left is made whole.
    ///
    /// # Errors
    /// A folder that cannot be written, or a log that is none.
    pub fn open(folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(unwritable(folder))?;
        let path = folder.join(JOURNAL);
        let mut log =
            OpenOptions::new().create(true).read(true).append(true).open(&path).map_err(unwritable(&path))?;
        // Two programs must not run one campaign.
        log.try_lock().map_err(|_| {
            Error::new(DataCode::CallInvalid, "another program runs a campaign in this folder")
                .file(&path)
                .help("choose another folder with -o, or end the other program")
        })?;
        let mut text = String::new();
        log.read_to_string(&mut text).map_err(|e| Error::unreadable(&path, &e))?;
        let whole = text.rfind('\n').map_or(0, |i| i + 1);
        // The end of a line that was being written when the program was stopped.
        log.set_len(whole as u64).and_then(|()| log.seek(SeekFrom::End(0))).map_err(unwritable(&path))?;
        let mut events = Vec::new();
        for (i, line) in text[..whole].lines().enumerate() {
            let event = serde_json::from_str(line).map_err(|e| {
                Error::new(DataCode::FileUnreadable, format!("not a log of a campaign: {e}"))
                    .file(&path)
                    .line(i as u64 + 1)
                    .help("choose an empty folder with -o")
            })?;
            events.push(event);
        }
        let mut journal = Self { folder: folder.to_owned(), log, events, part: None };
        journal.rescue()?;
        Ok(journal)
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// All events so far.
    #[must_use]
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Writes an event and waits until the disk has it.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`].
    pub fn write(&mut self, event: Event) -> Result<()> {
        let path = self.folder.join(JOURNAL);
        let line = serde_json::to_string(&event)
            .map_err(|e| Error::new(DataCode::FileUnwritable, e.to_string()).file(&path))?;
        self.log
            .write_all(format!("{line}\n").as_bytes())
            .and_then(|()| self.log.sync_data())
            .map_err(unwritable(&path))?;
        self.events.push(event);
        Ok(())
    }

    /// Begins the recording of a step.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`].
    pub fn begin(&mut self, number: u32, name: &str) -> Result<()> {
        let name = format!("{number:02}_{name}");
        let path = self.folder.join(format!("{name}.csv.part"));
        let mut file = File::create(&path).map_err(unwritable(&path))?;
        file.write_all(HEADER.as_bytes()).and_then(|()| file.sync_data()).map_err(unwritable(&path))?;
        self.part = Some(Part { name, path, file, waiting: String::new(), rows: 0, synced: Instant::now() });
        Ok(())
    }

    /// Adds a row to the recording of the step.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`], for instance when the disk is full.
    pub fn row(&mut self, r: &Reading) -> Result<()> {
        let Some(part) = &mut self.part else { return Ok(()) };
        // Writing to a string cannot fail.
        let _ = writeln!(
            part.waiting,
            "{:.4},{:.4},{:.6},{:.5},{:.3}",
            r.time,
            r.pressure * 1e-3,
            r.stroke * 1e3,
            r.force,
            r.command * 1e-3
        );
        part.rows += 1;
        if part.synced.elapsed() >= PIECE { part.sync() } else { Ok(()) }
    }

    /// Ends the recording of a step. Returns the file's name and its rows.
    ///
    /// # Errors
    /// [`DataCode::FileUnwritable`].
    pub(crate) fn finish(&mut self, completion: Completion) -> Result<(String, u64)> {
        let Some(mut part) = self.part.take() else { return Ok((String::new(), 0)) };
        part.sync()?;
        let file = free_name(&self.folder, &part.name, completion);
        let to = self.folder.join(&file);
        std::fs::rename(&part.path, &to).map_err(unwritable(&to))?;
        Ok((file, part.rows))
    }

    /// Clock at which the campaign stood when the last row was written, s, and when that was, in seconds since 1970.
    #[must_use]
    pub fn clock(&self) -> Option<f64> {
        let recorded = self.events.iter().rev().find_map(|e| match e {
            Event::Recorded { end_s, .. } | Event::Spoiled { end_s, .. } | Event::Checked { end_s, .. } => {
                Some(*end_s)
            }
            Event::Ended { clock_s, .. } | Event::Begin { clock_s, .. } => Some(*clock_s),
            _ => None,
        });
        // The rows of an interrupted step, however few, are later than every time in the log.
        let cut = self.events.iter().rev().find_map(|e| match e {
            Event::Cut { file, .. } if !file.is_empty() => last_time(&self.folder.join(file)),
            _ => None,
        });
        recorded.into_iter().chain(cut).reduce(f64::max)
    }

    /// Recordings that the fit reads, in order.
    #[must_use]
    pub fn recordings(&self) -> Vec<PathBuf> {
        let files = self.events.iter().filter_map(|e| match e {
            Event::Recorded { file, .. } | Event::Cut { file, .. } if !file.is_empty() => {
                Some(self.folder.join(file))
            }
            _ => None,
        });
        files.collect()
    }

    /// Checks of the bench that were made.
    #[must_use]
    pub fn checks(&self) -> Vec<(checks::Kind, PathBuf)> {
        let made = self.events.iter().filter_map(|e| match e {
            Event::Checked { check, file, .. } => Some((*check, self.folder.join(file))),
            _ => None,
        });
        made.collect()
    }

    /// Makes recordings of what an interrupted program left. A rename whose event was not written yet is found by its file.
    fn rescue(&mut self) -> Result<()> {
        let folder = self.folder.clone();
        let mut left: Vec<PathBuf> = std::fs::read_dir(&folder)
            .map_err(|e| Error::unreadable(&folder, &e))?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        left.sort();
        for path in left {
            let Some(name) = path.file_name().and_then(|n| n.to_str()).map(str::to_owned) else { continue };
            let number: Option<u32> = name.split('_').next().and_then(|n| n.parse().ok());
            let Some(number) = number else { continue };
            let spoiled = name.strip_suffix(SPOILED).filter(|_| !self.names(&name));
            if let Some(base) = name.strip_suffix(".csv.part").or(spoiled) {
                let text = std::fs::read_to_string(&path).map_err(|e| Error::unreadable(&path, &e))?;
                let whole = text.rfind('\n').map_or("", |i| &text[..=i]);
                let rows = whole.lines().count().saturating_sub(1) as u64;
                let file = free_name(&folder, base, Completion::Cut);
                let to = folder.join(&file);
                std::fs::write(&path, whole)
                    .and_then(|()| std::fs::rename(&path, &to))
                    .map_err(unwritable(&to))?;
                self.write(Event::Cut { number, file, rows })?;
            } else if name.ends_with(".csv") && !self.names(&name) {
                let text = std::fs::read_to_string(&path).map_err(|e| Error::unreadable(&path, &e))?;
                let rows = text.lines().count().saturating_sub(1) as u64;
                self.write(Event::Cut { number, file: name, rows })?;
            }
        }
        Ok(())
    }

    fn names(&self, name: &str) -> bool {
        self.events.iter().any(|e| match e {
            Event::Recorded { file, .. }
            | Event::Spoiled { file, .. }
            | Event::Cut { file, .. }
            | Event::Checked { file, .. } => file == name,
            _ => false,
        })
    }
}

impl Part {
    fn sync(&mut self) -> Result<()> {
        self.synced = Instant::now();
        let piece = std::mem::take(&mut self.waiting);
        self.file
            .write_all(piece.as_bytes())
            .and_then(|()| self.file.sync_data())
            .map_err(unwritable(&self.path))
    }
}

/// A name in the folder that no file has.
fn free_name(folder: &Path, name: &str, completion: Completion) -> String {
    let (mark, extension) = match completion {
        Completion::Whole => ("", ".csv"),
        Completion::Cut => ("_cut", ".csv"),
        Completion::Spoiled => ("", SPOILED),
    };
    let plain = format!("{name}{mark}{extension}");
    if !folder.join(&plain).exists() {
        return plain;
    }
    (2..).map(|n| format!("{name}{mark}_{n}{extension}")).find(|n| !folder.join(n).exists()).unwrap_or(plain)
}

/// Seconds since 1970.
#[must_use]
pub(crate) fn unix_seconds() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs())
}

/// The time of the last row of a recording of this log, s.
fn last_time(path: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(path).ok()?;
    text.lines().last()?.split(',').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(time: f64) -> Reading {
        Reading { time, pressure: 1e5, force: 10.0, recorded: true, ..Reading::default() }
    }

    #[test]
    fn an_interrupted_step_loses_no_whole_row_and_the_log_continues() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(folder.path()).unwrap();
        journal.begin(1, "tare").unwrap();
        for i in 0..5 {
            journal.row(&reading(f64::from(i))).unwrap();
        }
        assert!(Journal::open(folder.path()).is_err(), "two programs in one folder");
        journal.part.as_mut().unwrap().sync().unwrap();
        journal.part.as_mut().unwrap().file.write_all(b"5.0,1").unwrap();
        drop(journal);
        std::fs::OpenOptions::new()
            .append(true)
            .open(folder.path().join(JOURNAL))
            .unwrap()
            .write_all(b"{\"ev")
            .unwrap();
        let mut journal = Journal::open(folder.path()).unwrap();
        assert_eq!(journal.events(), [Event::Cut { number: 1, file: "01_tare_cut.csv".into(), rows: 5 }]);
        let text = std::fs::read_to_string(folder.path().join("01_tare_cut.csv")).unwrap();
        assert_eq!(text.lines().count(), 6);
        assert_eq!(journal.clock(), Some(4.0), "what follows comes after the rows of the interrupted step");
        journal.begin(1, "tare").unwrap();
        journal.row(&reading(9.0)).unwrap();
        let (file, rows) = journal.finish(Completion::Whole).unwrap();
        assert_eq!((file.as_str(), rows), ("01_tare.csv", 1));
        drop(journal);
        // Named, and not in the log yet: the next program finds it.
        let journal = Journal::open(folder.path()).unwrap();
        assert_eq!(journal.recordings().len(), 2);
        assert_eq!(journal.events().len(), 2);
    }

    /// `*.csv` in the folder names what a fit may read.
    #[test]
    fn a_spoiled_recording_is_no_csv_file_and_its_rows_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(folder.path()).unwrap();
        let spoil = |journal: &mut Journal, time| {
            journal.begin(1, "tare").unwrap();
            journal.row(&reading(time)).unwrap();
            journal.finish(Completion::Spoiled).unwrap().0
        };
        let (reason, end_s) = (crate::watch::Spoiled::Slack, 1.0);
        let file = spoil(&mut journal, 0.0);
        assert_eq!(file, "01_tare.csv.spoiled");
        journal.write(Event::Spoiled { number: 1, file, rows: 1, reason, end_s }).unwrap();
        assert_eq!(spoil(&mut journal, 2.0), "01_tare_2.csv.spoiled");
        drop(journal);
        // The second one is not in the log: its rows are those of an interrupted step.
        let journal = Journal::open(folder.path()).unwrap();
        assert_eq!(journal.recordings().len(), 1);
        assert!(
            folder.path().join("01_tare_2_cut.csv").exists()
                && folder.path().join("01_tare.csv.spoiled").exists()
        );
        assert!(!folder.path().join("01_tare_2.csv.spoiled").exists());
    }

    #[test]
    fn a_foreign_log_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(JOURNAL), "hello\n").unwrap();
        let error = Journal::open(folder.path()).unwrap_err();
        assert!(error.place().to_string().contains(JOURNAL));
    }
}
