//! `host record` and `host recover`: what a controller measures, to a recording that survives failures.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use model_core::link::endpoints::GetInfo;

use super::interrupt::interrupts;
use super::port::PortOption;
use super::recording_files::{begin, end, positive, refuse_existing, warn_of_losses};
use crate::change_watch::{self, ReferenceOptions};
use crate::console::Console;
use crate::documents::recording::{Record, RecordEnd, Recorded};
use crate::documents::{bench, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::json_of;
use pam_data::pluralise::pluralise;
use pam_data::progress::Progress;
use pam_device::recorder::{About, Ended, recover};
use pam_device::watch::{Happened, watch};

use crate::progress::ProgressLine;
use pam_data::date::now_utc;

/// Arguments of `host record`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host record --port /dev/ttyACM0\n  \
    host record --seconds 60 -o run.csv -o run.mcap\n  \
    host record --rate 100 --folder campaign\n  \
    host record --reference commissioning.csv\n\n\
    It only watches: it does not keep the run of another program alive, and leaves that program's telemetry as it is. Every 0.1 s goes to the disk; a program that is killed, a cable \
    that is pulled or a disk that fills leaves everything until then. CSV and MCAP are read by `host fit` and all others; \
    MCAP opens in the viewers of robotics. OUT.json says which versions, table and settings the controller had.")]
pub struct Arguments {
    #[command(flatten)]
    port: PortOption,
    /// The recording, as CSV or (by the ending .mcap) MCAP; may be given again for both [default: FOLDER/DATE.csv].
    #[arg(short, long, value_name = "OUT")]
    output: Vec<PathBuf>,
    /// The folder for recordings that are not named.
    #[arg(long, value_name = "FOLDER", default_value = ".", conflicts_with = "output")]
    folder: PathBuf,
    /// How long, s of device time [default: until Ctrl-C].
    #[arg(short, long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Samples per second, at most the controller's own rate [default: its own rate].
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Replace recordings of the same name.
    #[arg(long, alias = "force")]
    replace: bool,
    /// Print what was recorded as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    changed: ReferenceOptions,
}

impl Arguments {
    /// Records until the time is over, Ctrl-C, or the device is gone.
    ///
    /// # Errors
    /// A device that is silent or refuses, a file that cannot be written; what was recorded until then is kept.
    pub fn run(self, console: &Console) -> Result<()> {
        positive([("--seconds", self.seconds), ("--rate", self.rate)])?;
        let output = if self.output.is_empty() {
            std::fs::create_dir_all(&self.folder).map_err(|e| Error::unwritable(&self.folder, &e))?;
            vec![self.folder.join(format!("{}.csv", now_utc().replace(':', "-")))]
        } else {
            self.output.clone()
        };
        refuse_existing(&output, self.replace)?;
        let mut changed = self.changed.start(console)?;
        let mut said = String::new();
        let interrupted = interrupts()?;
        let mut client = self.port.connect(console)?;
        let ticks = f64::from(client.call::<GetInfo>(&())?.ticks_per_s);
        let every_ticks = self.rate.map_or(1.0, |rate| (ticks / rate).round()).clamp(1.0, 60_000.0) as u16;
        let about = About::of("pam-record/1", &mut client)?;
        let mut about = Record { about, samples_per_s: ticks / f64::from(every_ticks), end: None };
        let Some(mut recorder) = begin(&output, &about, console)? else {
            return Err(Error::new(DataCode::CallInvalid, "a recording needs a file"));
        };
        let names = output.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(" and ");
        console.note(format!("recording to {names}; Ctrl-C ends it"));
        let progress = ProgressLine::new(console, "record");
        progress.total(self.seconds.map_or(0, |s| (s * 1e3) as u64));
        let before = client.losses();
        let watched = watch(
            &mut client,
            every_ticks,
            self.seconds,
            |happened| match happened {
                Happened::Sample(sample, elapsed) => {
                    if let Some(changed) = &mut changed {
                        changed.push(sample);
                    }
                    change_watch::tell(changed.as_ref(), &mut said, console);
                    progress.set(elapsed);
                    recorder.push(sample)
                }
                Happened::Event(event) => recorder.event(event),
            },
            || interrupted.load(Ordering::Relaxed),
        );
        drop(progress);
        let losses = client.losses().since(before);
        let changed = change_watch::finish(changed);
        about.end = Some(RecordEnd {
            ended: Ended::of(&watched, losses),
            changed: changed.as_ref().map(|c| c.1.clone()),
            files: output.iter().map(|f| f.display().to_string()).collect(),
        });
        let rows = recorder.rows();
        let kept = end(recorder, &about, console);
        if let Err(error) = &watched
            && kept.is_ok()
        {
            console.note(format!(
                "{} until then in {names}, {} missing",
                pluralise(rows, "sample"),
                losses.samples
            ));
            console.detail(error.to_string());
        }
        watched?;
        kept?;
        warn_of_losses(losses, console);
        console.result(if self.json {
            format!("{:#}", json_of(&Recorded { record: &about, rows }))
        } else {
            format!("{} in {names}, {} missing", pluralise(rows, "sample"), losses.samples)
        });
        if let Some((text, _)) = changed.filter(|_| !self.json) {
            console.result(text.trim_end());
        }
        Ok(())
    }
}

/// Arguments of `host recover`.
#[derive(Debug, Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Example:\n  host recover run.csv.part run.mcap.part\n\n\
    A recording is named NAME.part while it grows. Intact data, also after the damage, go to a new file. The program \
    prints the missing bytes and samples, and keeps the original as NAME.part.original. The next recording of the same \
    name recovers it automatically. A damaged recording of another name stays, and its intact data go to NAME.rescued-N."
)]
pub struct RecoverArguments {
    /// Recordings that were cut off or damaged.
    #[arg(required = true, value_name = "NAME.part")]
    files: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl RecoverArguments {
    /// Makes whole recordings.
    ///
    /// # Errors
    /// Files in which nothing is whole, or that cannot be read or written.
    pub fn run(self, console: &Console) -> Result<()> {
        let mut done = Vec::new();
        for file in &self.files {
            let found = recover(file)?;
            if !self.json {
                console.result(match &found.recording {
                    Some(name) => format!("{} is now {}", file.display(), name.display()),
                    None => format!("{} was empty and is removed", file.display()),
                });
            }
            if let Some(loss) = found.loss() {
                console.warning(loss);
            }
            let text = |path: &Option<PathBuf>| path.as_ref().map(|p| p.display().to_string());
            done.push(bench::Recovered {
                part: file.display().to_string(),
                recording: text(&found.recording),
                original: text(&found.original),
                samples: found.tally.samples,
                samples_lost: found.tally.samples_lost,
                bytes_lost: found.tally.bytes_lost,
                gaps: found.tally.gaps,
            });
        }
        if self.json {
            console.result(text(&bench::Recover { schema: "pam-recover/1", recovered: done })?);
        }
        Ok(())
    }
}
