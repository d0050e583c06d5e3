//! `host demo`: the whole workflow on this machine, without hardware.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use model_core::image;
use model_core::link::endpoints::{GetSettings, SetSettings};
use model_core::link::messages::Side;
use virtual_bench::plant::Motion;

use crate::console::Console;
use crate::demo::campaign::{Made, record};
use crate::demo::page::{Story, page, rms};
use crate::demo::tracking::{Law, Task, Track, choose, track};
use crate::documents::recording::Run;
use crate::documents::{bench, text};
use crate::program_name::in_page;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::progress::Progress;
use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::recorder::{About, Ended, Recorder};
use pam_device::run::Ending;
use pam_device::{Client, regulator, tables};
use pam_fit::Fit;
use pam_fit::predict::predict;
use pam_fit::{Options, fit};

use crate::progress::ProgressLine;
use pam_data::recording::{Campaign, Reader};
use pam_fit::table_file::{self, TableFile};

/// Device seconds in a second: faster than a real controller, to shorten the demonstration.
const SPEED: u32 = 4;

/// Arguments of `host demo`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  host demo\n  host demo --muscle contractile -o /tmp/demo --json\n\n\
    A muscle is recorded on the virtual bench and fitted; its table goes over the link into the controller (in QEMU where that \
    is installed, else in this process); the controller follows a force while the bench moves the muscle, with the fitted table, \
    with the plain Gaylord formula and without feed-forward. Everything stays in the folder, the page with the pictures too.")]
pub struct Arguments {
    /// The muscle of the bench: mini, contractile, push or random:SEED.
    #[arg(long, value_name = "MUSCLE", default_value = "mini")]
    muscle: String,
    /// Seed of the bench's noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The folder for all files.
    #[arg(short, long, value_name = "FOLDER", default_value = "pam-demo")]
    output: PathBuf,
    /// Run the firmware in this process, or insist on QEMU.
    #[arg(long, value_name = "WHERE", value_parser = ["native", "qemu"])]
    on: Option<String>,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Runs the demonstration.
    ///
    /// # Errors
    /// What went wrong in any of its steps.
    pub fn run(self, console: &Console) -> Result<()> {
        let began = Instant::now();
        let step = |number: u32, text: String| {
            console.note(format!("[{number}/6 {:5.1} s] {text}", began.elapsed().as_secs_f64()))
        };
        let made = record(&self.muscle, self.seed, &self.output)?;
        step(
            1,
            format!(
                "recorded `{}` on the virtual bench: {} files, {} rows in {}",
                made.bench.muscle.name,
                made.recordings.len(),
                made.rows,
                self.output.display()
            ),
        );

        let (muscle, campaign, fitted, table) = fit_campaign(&made, &self.output)?;
        let summary = &fitted.summary;
        let blocked = f64::from(table.table.blocked_force.newtons());
        step(
            2,
            format!(
                "fitted: P0 {:.1} kPa, blocked force {blocked:.1} N, mean error {:.2} % and at most {:.2} % of it; table in {}",
                summary.deadband_kPa,
                summary.mean_error_pct,
                summary.max_error_pct,
                self.output.join("muscle.pam").display()
            ),
        );

        let motion = motion(&made);
        let stand = Stand::new(made.bench.clone(), motion);
        let only = match self.on.as_deref() {
            Some("native") => Some(Kind::Native),
            Some("qemu") => Some(Kind::Qemu),
            _ => None,
        };
        let emulated = Emulated::start(stand, only, f64::from(SPEED))?;
        step(3, format!("controller started: {}", emulated.description()));
        let run =
            self.control(&emulated, &table, &made, step, console).map_err(|e| with_log(e, &emulated))?;
        drop(emulated);

        let telemetry = read_back(&run, &table, &muscle)?;
        step(
            6,
            format!(
                "read back: on {} rows of telemetry inside its tested range the error of the table is {:.2} N rms ({:.2} % of blocked force)",
                telemetry.1,
                telemetry.0,
                100.0 * telemetry.0 / blocked
            ),
        );
        let story = Story {
            muscle: &made.bench.muscle.name,
            campaign: &campaign,
            fit: &fitted,
            controller: &run.controller,
            device: run.device.clone(),
            tracks: &run.tracks,
            blocked_force: blocked,
            telemetry,
            seconds: began.elapsed().as_secs_f64(),
        };
        let report = self.output.join("demo.html");
        write_whole(&report, in_page(page(&story)?.html()).as_bytes())?;
        let figures = figures(&story);
        write_whole(&self.output.join("demo.json"), (text(&figures)? + "\n").as_bytes())?;
        if self.json {
            console.result(text(&figures)?);
        } else {
            console.result(terminal_table(&story));
            console.result(format!("page with pictures: {}", report.display()));
        }
        Ok(())
    }

    /// Sends the table, lets the controller track, and keeps its telemetry.
    fn control(
        &self,
        emulated: &Emulated,
        table: &TableFile,
        made: &Made,
        step: impl Fn(u32, String),
        console: &Console,
    ) -> Result<ControllerRun> {
        let mut client = Client::open(emulated.address())?;
        // The watch counts device time, which goes so much faster, and twice as fast again after a pause of a busy machine.
        let mut settings = client.call::<GetSettings>(&())?;
        settings.watch.host_silence_ticks *= 2 * SPEED;
        client.call_once::<SetSettings>(&settings)?;
        let mut buffer = [0; image::MAX_LEN];
        let image = image::write(&table.table, &mut buffer)
            .map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
        let kept = tables::write(&mut client, Side::Agonist, image, |_| ())?;
        let (major, minor, patch) = client.hello().release;
        let device =
            format!("release {major}.{minor}.{patch}, table {:08x}, {} bytes", kept.crc, kept.length);
        step(4, format!("flashed and read back: {} bytes, check sum {:08x}", kept.length, kept.crc));

        let tested = &table.table.tested;
        let found = regulator::identify(
            &mut client,
            f64::from(tested.pressure_low.pascals()),
            f64::from(
                tested.pressure_low.pascals()
                    + 0.3 * (tested.pressure_high.pascals() - tested.pressure_low.pascals()),
            ),
        )?;
        found.keep(&mut client)?;
        console.note(format!(
            "              found the regulator: gain {:.3}, time constant {:.0} ms, line {:.1} ms, {} {:.1} MPa/s; the controller compensates both from here on",
            found.gain,
            found.lag_s * 1e3,
            found.line_s * 1e3,
            if found.rate_limited { "at most" } else { "seen at up to" },
            found.rate_pa_per_s * 1e-6
        ));

        // The middle of what the muscle can pull where the bench moves it.
        let mean = 0.35 * made.blocked_force;
        let span =
            f64::from(table.table.tested.pressure_high.pascals()) - f64::from(table.table.deadband.pascals());
        let gain = made.blocked_force / span.max(1.0);
        let mut tracks = Vec::new();
        let mut recordings = Vec::new();
        let progress = ProgressLine::new(console, "tracking");
        progress.total(1000 * (Law::ALL.len() * Task::ALL.len()) as u64);
        for law in Law::ALL {
            choose(&mut client, law, gain)?;
            for task in Task::ALL {
                let before = tracks.len() as f64;
                let tracked = track(&mut client, law, task, mean, |share| {
                    progress.set((1000.0 * (before + share)) as u64)
                })?;
                recordings.push(self.keep(&mut client, &tracked)?);
                tracks.push(tracked);
            }
        }
        drop(progress);
        let losses = client.losses();
        step(
            5,
            format!(
                "tracked a sine and steps with {} controllers, {} samples, {} lost",
                Law::ALL.len(),
                tracks.iter().map(|t: &Track| t.samples.len()).sum::<usize>(),
                losses.samples
            ),
        );
        Ok(ControllerRun { controller: emulated.description(), device, tracks, recordings })
    }

    fn keep(&self, client: &mut Client, track: &Track) -> Result<PathBuf> {
        let path = self.output.join(format!("run-{}-{}.csv", track.law.key(), track.task.name()));
        let mut about = Run::watched(About::of("pam-run/1", client)?);
        let mut recorder = Recorder::create(std::slice::from_ref(&path), &about)?;
        for sample in &track.samples {
            recorder.push(sample)?;
        }
        about.ended = Some(Ended::of(&Ok(Ending::Done), client.losses()));
        recorder.finish(&about)
    }
}

/// What the controller did.
struct ControllerRun {
    controller: String,
    device: String,
    tracks: Vec<Track>,
    recordings: Vec<PathBuf>,
}

fn with_log(error: Error, emulated: &Emulated) -> Error {
    let log = emulated.log();
    let said = log.trim();
    if said.is_empty() {
        error
    } else {
        Error::new(error.code(), format!("{}; the emulator said: {said}", error.cause()))
    }
}

/// The muscle swings slowly around a quarter of its free stroke.
fn motion(made: &Made) -> Motion {
    let free_mm = made.free_stroke * 1e3;
    Motion::Sine { mean_mm: 0.2 * free_mm, amplitude_mm: 0.1 * free_mm, frequency_hz: 0.4 }
}

fn fit_campaign(made: &Made, folder: &Path) -> Result<(MuscleDescription, Campaign, Fit, TableFile)> {
    let muscle = MuscleDescription::read(&made.muscle)?;
    let campaign = Reader::of(&muscle).campaign(&made.recordings)?;
    let fitted = fit(&campaign, &muscle, &Options::default())?;
    let hashes = made.recordings.iter().map(table_file::sha256).collect::<Result<Vec<_>>>()?;
    let mut table = fitted.table_file(format!("host {} demo", env!("CARGO_PKG_VERSION")));
    table.about.date = date::now_utc();
    table.about.sources = table_file::sources(&campaign, &made.recordings, hashes);
    table.write(folder.join("muscle.pam"))?;
    Ok((muscle, campaign, fitted, table))
}

/// Reads the telemetry as recordings: the table's error on it, N, and over how many rows.
///
/// No table is fitted to it: the few millimetres that the bench moves the muscle determine neither P0 nor elasticity.
fn read_back(run: &ControllerRun, table: &TableFile, muscle: &MuscleDescription) -> Result<(f64, usize)> {
    let campaign = Reader::of(muscle).campaign(&run.recordings)?;
    let prediction = predict(table, &campaign)?;
    let tested = &table.table.tested;
    let inside = f64::from(tested.pressure_low.pascals())..=f64::from(tested.pressure_high.pascals());
    let (mut squares, mut rows) = (0.0, 0_u32);
    for (recording, predicted) in campaign.recordings.iter().zip(&prediction.recordings) {
        let measured = recording.require_force()?;
        for ((pressure, force), model) in recording.pressure.iter().zip(measured).zip(&predicted.force) {
            // Where the muscle fills and where it goes slack the table was never fitted.
            if inside.contains(pressure) {
                squares += (force - model).powi(2);
                rows += 1;
            }
        }
    }
    if rows == 0 {
        return Err(Error::new(
            DataCode::RecordingTooShort,
            "no telemetry lies inside the table's tested range",
        ));
    }
    Ok(((squares / f64::from(rows)).sqrt(), rows as usize))
}

fn figures<'a>(story: &Story<'a>) -> bench::Demo<'a> {
    let percent = |newtons: f64| 100.0 * newtons / story.blocked_force;
    let tracking = Law::ALL
        .iter()
        .map(|law| {
            let of = |task| rms(story.tracks, |t| t.law == *law && t.task == task);
            bench::Tracking {
                feed_forward: law.key(),
                sine_rms_N: of(Task::Sine),
                sine_rms_pct: percent(of(Task::Sine)),
                steps_rms_N: of(Task::Steps),
                steps_rms_pct: percent(of(Task::Steps)),
                rms_pct: percent(rms(story.tracks, |t| t.law == *law)),
            }
        })
        .collect();
    bench::Demo {
        schema: "pam-demo/1",
        muscle: story.muscle,
        controller: story.controller,
        fit_mean_error_pct: story.fit.summary.mean_error_pct,
        deadband_kPa: story.fit.summary.deadband_kPa,
        blocked_force_N: story.blocked_force,
        tracking,
        telemetry_rows: story.telemetry.1,
        telemetry_rms_N: story.telemetry.0,
        seconds: story.seconds,
    }
}

fn terminal_table(story: &Story<'_>) -> String {
    let percent = |newtons: f64| 100.0 * newtons / story.blocked_force;
    let mut text = String::from("\nforce tracking, rms error in % of blocked force, muscle moving\n");
    text += &format!("{:<24}{:>12}{:>10}{:>10}\n", "feed-forward", "sine 0.5 Hz", "steps", "both");
    for law in Law::ALL {
        let of = |task| rms(story.tracks, |t| t.law == law && t.task == task);
        text += &format!(
            "{:<24}{:>12.2}{:>10.2}{:>10.2}\n",
            law.name(),
            percent(of(Task::Sine)),
            percent(of(Task::Steps)),
            percent(rms(story.tracks, |t| t.law == law))
        );
    }
    text += &format!("\n{:.1} s altogether; {}", story.seconds, story.controller);
    text
}
