//! `host run` and `host vent`: let a controller follow a setpoint profile and record it; make it safe.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, ValueEnum};
use model_core::link::endpoints::{GetInfo, GetSettings, GetStatus, SetSettings};
use model_core::link::settings::{FeedForward, Joint};
use serde_json::{Value, json};

use super::port::PortOption;
use crate::change_watch::{self, ReferenceOptions};
use crate::console::Console;
use crate::documents::{device, line};
use pam_data::error::{DataCode, Error, Result};
use pam_data::pluralise::pluralise;
use pam_data::progress::Progress;
use pam_device::error::DeviceCode;
use pam_device::reachability::Reachability;
use pam_device::recorder::{Recorder, about_losses, about_start};
use pam_device::run::{Ending, Plan, run, vent};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_device::{Client, Losses, messages};

use crate::progress::ProgressLine;

/// Arguments of `host run`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Examples:\n  \
    host run --pressure 200 --seconds 5\n  \
    host run --port /dev/ttyACM0 --seconds 10 -o run.csv \\\n      \
        --force 'sine mean=60 amplitude=20 frequency=0.5'\n  \
    host run --force 'steps 40 60 80 hold=2' --seconds 12 -o steps.mcap\n  \
    host run --stroke @profile.csv --seconds 30 -o stroke.csv\n  \
    host run --force 'sine mean=60 amplitude=20' --reference reference.csv\n  \
    host run --angle 'sine mean=0 amplitude=5 frequency=0.5' --stiffness 12\n\n\
    Setpoint profiles (frequencies in Hz, times in s):\n  \
    VALUE\n  \
    sine mean= amplitude= frequency=\n  \
    steps V1 V2 … hold=\n  \
    trapezoid low= high= ramp= hold=\n  \
    chirp mean= amplitude= from= to= duration=\n  \
    @FILE.csv    two columns: time in s, value\n\n\
    The recording is read back by `host fit` and `host predict`. At the end, on any error and on Ctrl-C the muscle is vented.")]
pub struct Arguments {
    #[command(flatten)]
    port: PortOption,
    #[command(flatten)]
    quantity: Asked,
    /// Stiffness of the joint, N·m/rad.
    #[arg(long, value_name = "NM_PER_RAD", requires = "angle")]
    stiffness: Option<f32>,
    /// How long, s of device time [default: until Ctrl-C].
    #[arg(short, long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// The recording, as CSV or (by the ending .mcap) MCAP; may be given again for both. OUT.json says how it was made.
    #[arg(short, long, value_name = "OUT")]
    output: Vec<PathBuf>,
    /// Replace a recording that is there.
    #[arg(long)]
    replace: bool,
    /// Samples per second, at most the controller's own rate [default: its own rate].
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Where the pressure for a force comes from; stays in force afterwards.
    #[arg(long, value_enum, value_name = "SOURCE")]
    feed_forward: Option<Source>,
    /// Print how it went as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    changed: ReferenceOptions,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Asked {
    /// Force to follow, N.
    #[arg(long, value_name = "PROFILE", allow_hyphen_values = true)]
    force: Option<String>,
    /// Pressure to follow, kPa.
    #[arg(long, value_name = "PROFILE", allow_hyphen_values = true)]
    pressure: Option<String>,
    /// Stroke to follow, mm.
    #[arg(long, value_name = "PROFILE", allow_hyphen_values = true)]
    stroke: Option<String>,
    /// Angle of a joint to follow, degrees: two muscles on one pulley (the settings' `joint`).
    #[arg(long, value_name = "PROFILE", allow_hyphen_values = true, requires = "stiffness")]
    angle: Option<String>,
}

impl Asked {
    fn text(&self) -> Option<&str> {
        [&self.force, &self.pressure, &self.stroke, &self.angle].into_iter().find_map(|text| text.as_deref())
    }

    fn parse(&self, stiffness: Option<f32>) -> Result<(Quantity, SetpointProfile)> {
        let quantity = match (&self.force, &self.pressure, &self.stroke, stiffness) {
            (Some(_), ..) => Quantity::Force,
            (_, Some(_), ..) => Quantity::Pressure,
            (_, _, Some(_), _) => Quantity::Stroke,
            (.., Some(stiffness_nm_per_rad)) => Quantity::Angle { stiffness_nm_per_rad },
            _ => return Err(Error::new(DataCode::CallInvalid, "no setpoint profile is given")),
        };
        let text = self.text().unwrap_or_default();
        Ok((quantity, SetpointProfile::parse(text, quantity)?))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Source {
    /// The inverse of the muscle's table.
    Table,
    /// The ideal braid alone.
    Gaylord,
    /// None: feedback does everything.
    Off,
}

impl Arguments {
    /// Does what was requested.
    ///
    /// # Errors
    /// A wrong setpoint profile, a device that is silent or refuses, the fault that stopped it, a recording that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        let (quantity, profile) = self.quantity.parse(self.stiffness)?;
        positive([("--seconds", self.seconds), ("--rate", self.rate)])?;
        if self.stiffness.is_some_and(|s| !(s >= 0.0 && s.is_finite())) {
            return Err(Error::new(DataCode::CallInvalid, "--stiffness must be zero or more"));
        }
        not_there(&self.output, self.replace)?;
        let mut changed = self.changed.start(console)?;
        let mut said = String::new();
        let interrupted = interrupts()?;
        let mut client = self.port.connect(console)?;
        if let Some(source) = self.feed_forward {
            choose_feed_forward(&mut client, source)?;
        }
        let ticks = f64::from(client.call::<GetInfo>(&())?.ticks_per_s);
        let every_ticks = self.rate.map_or(1.0, |rate| (ticks / rate).round()).clamp(1.0, 60_000.0) as u16;
        let mut about = about_start("pam-run/1", &mut client)?;
        about["mode"] = json!(messages::mode(quantity.mode()));
        about["setpoint_profile"] = json!(self.quantity.text());
        about["stiffness_Nm_per_rad"] = json!(self.stiffness);
        about["unit"] = json!(quantity.unit());
        let mut recorder = begin(&self.output, &about, console)?;
        let plan = Plan { quantity, profile, seconds: self.seconds, every_ticks };
        let mut errors = Errors::new(client.call::<GetSettings>(&())?.joint);
        let saturated_before = client.call::<GetStatus>(&())?.saturated_ticks;
        let progress = ProgressLine::new(console, "run");
        progress.total(self.seconds.map_or(0, |s| (s * 1e3) as u64));
        let reachable = Reachability::of(&mut client)?;
        // Before anything moves, not after ten seconds at the highest pressure.
        if let Some(words) = reachable.as_ref().and_then(|r| r.beyond(quantity, &plan.profile)) {
            console.warning(words);
        }
        let mut reached = reachable.filter(|_| quantity != Quantity::Pressure);
        let mut start = None;
        let outcome = run(
            &mut client,
            &plan,
            |sample| {
                errors.add(quantity, sample);
                if let Some(changed) = &mut changed {
                    changed.push(sample);
                }
                change_watch::tell(changed.as_ref(), &mut said, console);
                if let Some(reached) = &mut reached {
                    reached.add(quantity, sample);
                }
                progress.set((sample.time_us - *start.get_or_insert(sample.time_us)) / 1000);
                match &mut recorder {
                    Some(recorder) => recorder.push(sample),
                    None => Ok(()),
                }
            },
            || interrupted.load(Ordering::Relaxed),
        );
        drop(progress);
        let losses = client.losses();
        about["samples"] = json!(errors.all.samples);
        about["tracking_rms"] = json!(errors.all.rms(quantity));
        about["tracking_rms_after_1_s"] = json!(errors.settled.rms(quantity));
        about["losses"] = about_losses(losses);
        let saturated = match &outcome {
            Ok(_) => client.call::<GetStatus>(&()).ok(),
            Err(_) => None,
        }
        .map(|status| status.saturated_ticks.wrapping_sub(saturated_before));
        about["saturated_ticks"] = json!(saturated);
        let per_s = ticks / f64::from(every_ticks);
        about["reach"] = json!(reached.as_ref().map(|reached| reached.to_json(per_s)));
        let changed = change_watch::finish(changed);
        about["changed"] = json!(changed.as_ref().map(|c| &c.1));
        about["ended_by"] = json!(match &outcome {
            Ok(Ending::Done) => "time".to_owned(),
            Ok(Ending::Stopped) => "interrupt".to_owned(),
            Err(e) => e.to_string(),
        });
        // What led to a fault is worth keeping: the recording is whole up to there.
        let kept = recorder.map(|recorder| end(recorder, &about, console)).transpose();
        let ending = outcome?;
        let kept = kept?;
        warn_of(losses, console);
        let lasted = errors.all.samples as f64 * f64::from(every_ticks);
        // A step asks for more than can be had for a moment, and is none the worse for it.
        if let Some(saturated) = saturated.map(f64::from).filter(|&saturated| saturated > 0.1 * lasted) {
            let why = reached.as_ref().and_then(Reachability::why).unwrap_or(
                "more than the muscle can do there at the highest pressure allowed, or less than at none",
            );
            console.warning(format!(
                "for {:.2} of {:.2} s the setpoint could not be reached: {why}",
                saturated.min(lasted) / ticks,
                lasted / ticks
            ));
        }
        if let Some(words) = reached.and_then(|reached| reached.extrapolated(per_s)) {
            console.warning(words);
        }
        if ending == Ending::Stopped {
            console.note("interrupted; the muscle is vented");
        }
        if self.json {
            console.result(format!("{about:#}"));
        } else {
            let name = kept.map(|p| format!(" in {}", p.display())).unwrap_or_default();
            let rms = errors.to_text(quantity);
            console.result(format!("{}{name}{rms}; vented", pluralise(errors.all.samples, "sample")));
            if let Some((words, _)) = changed {
                console.result(words.trim_end());
            }
        }
        Ok(())
    }
}

/// In its first second a vented muscle fills, at any setpoint, µs.
const FILLING: u64 = 1_000_000;

/// Errors squared and summed.
#[derive(Debug, Default)]
struct Squares {
    samples: u64,
    sum: f64,
}

impl Squares {
    fn add(&mut self, error: f64) {
        self.samples += 1;
        self.sum += error * error;
    }

    fn rms(&self, quantity: Quantity) -> Option<f64> {
        (self.samples > 0).then(|| (self.sum / self.samples as f64).sqrt() / quantity.scale())
    }
}

/// Deviation of the measurement from the setpoint: over all the time, and after the muscle had filled.
#[derive(Debug)]
struct Errors {
    joint: Joint,
    begun: Option<u64>,
    all: Squares,
    settled: Squares,
}

impl Errors {
    fn new(joint: Joint) -> Self {
        Self { joint, begun: None, all: Squares::default(), settled: Squares::default() }
    }

    fn add(&mut self, quantity: Quantity, sample: &model_core::link::messages::Telemetry) {
        let Some(side) = sample.sides.first() else { return };
        let measured = match quantity {
            Quantity::Force => side.force_n,
            Quantity::Pressure => side.pressure_pa,
            Quantity::Stroke => side.stroke_m,
            Quantity::Angle { .. } => match sample.sides.get(1) {
                Some(other) => (side.stroke_m - other.stroke_m) / (2.0 * self.joint.radius_m),
                None => return,
            },
        };
        let error = f64::from(measured - sample.setpoint);
        if error.is_finite() {
            let begun = *self.begun.get_or_insert(sample.time_us);
            self.all.add(error);
            if sample.time_us.saturating_sub(begun) >= FILLING {
                self.settled.add(error);
            }
        }
    }

    fn to_text(&self, quantity: Quantity) -> String {
        let unit = quantity.unit();
        match (self.all.rms(quantity), self.settled.rms(quantity)) {
            (Some(all), Some(settled)) => {
                format!(
                    ", tracking error {settled:.3} {unit} rms after the first second, {all:.3} {unit} with it"
                )
            }
            (Some(all), None) => format!(", tracking error {all:.3} {unit} rms"),
            (None, _) => String::new(),
        }
    }
}

fn choose_feed_forward(client: &mut Client, source: Source) -> Result<()> {
    let mut settings = client.call::<GetSettings>(&())?;
    settings.feed_forward = match source {
        Source::Table => FeedForward::Table,
        Source::Gaylord => FeedForward::Gaylord,
        Source::Off => FeedForward::Off,
    };
    let kept = client.call_once::<SetSettings>(&settings)?;
    if kept != settings {
        return Err(Error::new(
            DeviceCode::DeviceVerify,
            "the settings read back from the device differ from those sent",
        )
        .help("see `host device settings`"));
    }
    Ok(())
}

/// Options that are times or rates.
pub(super) fn positive<const N: usize>(options: [(&str, Option<f64>); N]) -> Result<()> {
    for (option, value) in options {
        if let Some(value) = value
            && !(value > 0.0 && value.is_finite())
        {
            return Err(Error::new(DataCode::CallInvalid, format!("{option} must be above zero"))
                .value(value.to_string())
                .help("omit the option to record at the rate of the controller until Ctrl-C"));
        }
    }
    Ok(())
}

/// Refuses to record over what is there, unless that is meant.
pub(super) fn not_there(files: &[PathBuf], replace: bool) -> Result<()> {
    // A device such as /dev/null takes any number of recordings.
    match files.iter().find(|f| f.is_file()) {
        Some(there) if !replace => Err(Error::new(DataCode::CallInvalid, "the recording already exists")
            .file(there)
            .help("choose another name with -o, or replace it with --replace")),
        _ => Ok(()),
    }
}

/// Begins a recording in the files that are named, if any are.
pub(super) fn begin(files: &[PathBuf], about: &Value, console: &Console) -> Result<Option<Recorder>> {
    if files.is_empty() {
        return Ok(None);
    }
    let recorder = Recorder::create(files, about)?;
    for file in recorder.recovered() {
        if let Some(recording) = &file.recording {
            console
                .note(format!("a recording that was cut off under this name is now {}", recording.display()));
        }
        if let Some(loss) = file.loss() {
            console.warning(loss);
        }
    }
    Ok(Some(recorder))
}

/// Ends it.
pub(super) fn end(recorder: Recorder, about: &Value, console: &Console) -> Result<PathBuf> {
    if recorder.skipped() > 0 {
        console.warning(format!(
            "{} left out: not finite, or not later than the one before",
            pluralise(recorder.skipped(), "sample")
        ));
    }
    recorder.finish(about)
}

/// Warns of samples that were lost.
pub(super) fn warn_of(losses: Losses, console: &Console) {
    if losses.samples > 0 {
        console.warning(format!(
            "{} lost on the line, in {}",
            pluralise(losses.samples, "sample"),
            pluralise(losses.gaps, "gap")
        ));
    }
}

/// A flag that Ctrl-C and a request to end set.
pub(super) fn interrupts() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed))
        .map_err(|e| Error::new(DataCode::CallInvalid, format!("Ctrl-C cannot be handled: {e}")))?;
    Ok(flag)
}

/// Arguments of `host vent`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  host vent --port /dev/ttyACM0\n  host vent --json")]
pub struct VentArguments {
    #[command(flatten)]
    port: PortOption,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl VentArguments {
    /// Vents and disarms.
    ///
    /// # Errors
    /// A device that does not answer; then it must be vented by hand.
    pub fn run(self, console: &Console) -> Result<()> {
        let status = vent(&mut self.port.connect(console)?)?;
        let state = messages::state(status.state);
        console.result(if self.json {
            line(&device::Vent { schema: "pam-vent/1", vented: true, state })?
        } else {
            format!("vented; the device is {state}")
        });
        Ok(())
    }
}
