//! `host run` and `host vent`: let a controller follow a course and record it; make it safe.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, ValueEnum};
use model_core::link::endpoints::{GetInfo, GetSettings, GetStatus, SetSettings};
use model_core::link::settings::{FeedForward, Joint};
use serde_json::{Value, json};

use super::port::PortOption;
use crate::console::Console;
use crate::counted::counted;
use crate::device::course::{Course, Quantity};
use crate::device::reach::Reached;
use crate::device::recorder::{Recorder, about_losses, about_start};
use crate::device::run::{Ending, Plan, run, vent};
use crate::device::{Client, words};
use crate::error::{Code, Error, Result};
use crate::progress::Progress;

/// Arguments of `host run`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
#[command(after_help = "Examples:\n  \
    host run --port /dev/ttyACM0 --force 'sine mean=60 amplitude=20 frequency=0.5' --seconds 10 -o run.csv\n  \
    host run --port tcp:127.0.0.1:4321 --force 'steps 40 60 80 hold=2' --seconds 12 -o steps.csv\n  \
    host run --port /dev/ttyACM0 --pressure 200 --seconds 5\n  \
    host run --port /dev/ttyACM0 --stroke @course.csv --seconds 30 -o stroke.csv\n  \
    host run --port /dev/ttyACM0 --angle 'sine mean=0 amplitude=5 frequency=0.5' --stiffness 12 --seconds 10\n\n\
    Courses: VALUE | sine mean= amplitude= frequency= | steps V V … hold= | trapezoid low= high= ramp= hold= |\n  \
    chirp mean= amplitude= from= to= duration= | @FILE.csv (time in s, value); frequencies in Hz, times in s.\n\
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
    /// Samples per second, at most the controller's own rate [default: its own rate].
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Where the pressure for a force comes from; stays in force afterwards.
    #[arg(long, value_enum, value_name = "SOURCE")]
    feed_forward: Option<Source>,
    /// Print how it went as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Asked {
    /// Force to follow, N.
    #[arg(long, value_name = "COURSE", allow_hyphen_values = true)]
    force: Option<String>,
    /// Pressure to follow, kPa.
    #[arg(long, value_name = "COURSE", allow_hyphen_values = true)]
    pressure: Option<String>,
    /// Stroke to follow, mm.
    #[arg(long, value_name = "COURSE", allow_hyphen_values = true)]
    stroke: Option<String>,
    /// Angle of a joint to follow, degrees: two muscles on one pulley (the settings' `joint`).
    #[arg(long, value_name = "COURSE", allow_hyphen_values = true, requires = "stiffness")]
    angle: Option<String>,
}

impl Asked {
    fn text(&self) -> Option<&str> {
        [&self.force, &self.pressure, &self.stroke, &self.angle].into_iter().find_map(|text| text.as_deref())
    }

    fn parse(&self, stiffness: Option<f32>) -> Result<(Quantity, Course)> {
        let quantity = match (&self.force, &self.pressure, &self.stroke, stiffness) {
            (Some(_), ..) => Quantity::Force,
            (_, Some(_), ..) => Quantity::Pressure,
            (_, _, Some(_), _) => Quantity::Stroke,
            (.., Some(stiffness_nm_per_rad)) => Quantity::Angle { stiffness_nm_per_rad },
            _ => return Err(Error::new(Code::CallInvalid, "nothing is asked for")),
        };
        let text = self.text().unwrap_or_default();
        Ok((quantity, Course::parse(text, quantity)?))
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
    /// Does what was asked.
    ///
    /// # Errors
    /// A wrong course, a device that is silent or refuses, the fault that stopped it, a recording that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        let (quantity, course) = self.quantity.parse(self.stiffness)?;
        positive([("--seconds", self.seconds), ("--rate", self.rate)])?;
        if self.stiffness.is_some_and(|s| !(s >= 0.0 && s.is_finite())) {
            return Err(Error::new(Code::CallInvalid, "--stiffness must be zero or more"));
        }
        let interrupted = interrupts()?;
        let mut client = self.port.connect(console)?;
        if let Some(source) = self.feed_forward {
            choose_feed_forward(&mut client, source)?;
        }
        let ticks = f64::from(client.call::<GetInfo>(&())?.ticks_per_s);
        let every_ticks = self.rate.map_or(1.0, |rate| (ticks / rate).round()).clamp(1.0, 60_000.0) as u16;
        let mut about = about_start("pam-run/1", &mut client)?;
        about["mode"] = json!(words::mode(quantity.mode()));
        about["course"] = json!(self.quantity.text());
        about["stiffness_Nm_per_rad"] = json!(self.stiffness);
        about["unit"] = json!(quantity.unit());
        let mut recorder = begin(&self.output, &about, console)?;
        let plan = Plan { quantity, course, seconds: self.seconds, every_ticks };
        let mut errors = Errors::new(client.call::<GetSettings>(&())?.joint);
        let saturated_before = client.call::<GetStatus>(&())?.saturated_ticks;
        let progress = Progress::new(console, "run");
        progress.total(self.seconds.map_or(0, |s| (s * 1e3) as u64));
        let mut reached = if quantity == Quantity::Pressure { None } else { Reached::of(&mut client)? };
        let mut start = None;
        let outcome = run(
            &mut client,
            &plan,
            |sample| {
                errors.add(quantity, sample);
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
        about["samples"] = json!(errors.samples);
        about["tracking_rms"] = json!(errors.rms(quantity));
        about["losses"] = about_losses(losses);
        let saturated = match &outcome {
            Ok(_) => client.call::<GetStatus>(&()).ok(),
            Err(_) => None,
        }
        .map(|status| status.saturated_ticks.wrapping_sub(saturated_before));
        about["saturated_ticks"] = json!(saturated);
        let per_s = ticks / f64::from(every_ticks);
        about["reach"] = json!(reached.as_ref().map(|reached| reached.to_json(per_s)));
        about["ended_by"] = json!(match &outcome {
            Ok(Ending::Done) => "time".to_owned(),
            Ok(Ending::Stopped) => "interrupt".to_owned(),
            Err(e) => e.to_string(),
        });
        // What led to a fault is worth keeping: the recording is whole up to there.
        let kept = recorder.map(|recorder| end(recorder, &about, console)).transpose();
        let ending = outcome?;
        let kept = kept?;
        if losses.samples > 0 {
            console.warning(format!(
                "{} lost on the way, in {}",
                counted(losses.samples, "sample"),
                counted(losses.gaps, "gap")
            ));
        }
        let lasted = errors.samples as f64 * f64::from(every_ticks);
        // A step asks for more than can be had for a moment, and is none the worse for it.
        if let Some(saturated) = saturated.map(f64::from).filter(|&saturated| saturated > 0.1 * lasted) {
            let why = reached.as_ref().and_then(Reached::why).unwrap_or(
                "more than the muscle can do there at the highest pressure allowed, or less than at none",
            );
            console.warning(format!(
                "for {:.2} of {:.2} s what was asked was out of reach: {why}",
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
            let rms = errors
                .rms(quantity)
                .map_or(String::new(), |r| format!(", tracking error {r:.3} {} rms", quantity.unit()));
            console.result(format!("{}{name}{rms}; vented", counted(errors.samples, "sample")));
        }
        Ok(())
    }
}

/// How far what was measured stayed from what was asked.
#[derive(Debug)]
struct Errors {
    joint: Joint,
    samples: u64,
    squares: f64,
}

impl Errors {
    fn new(joint: Joint) -> Self {
        Self { joint, samples: 0, squares: 0.0 }
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
        let error = f64::from(measured - sample.asked);
        if error.is_finite() {
            self.samples += 1;
            self.squares += error * error;
        }
    }

    fn rms(&self, quantity: Quantity) -> Option<f64> {
        (self.samples > 0).then(|| (self.squares / self.samples as f64).sqrt() / quantity.scale())
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
        return Err(Error::new(Code::DeviceVerify, "the device keeps other settings than it was sent")
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
            return Err(Error::new(Code::CallInvalid, format!("{option} must be above zero"))
                .value(value.to_string())
                .help("leave the option out to go on at the controller's own rate until Ctrl-C"));
        }
    }
    Ok(())
}

/// Begins a recording in the files that are named, if any are.
pub(super) fn begin(files: &[PathBuf], about: &Value, console: &Console) -> Result<Option<Recorder>> {
    if files.is_empty() {
        return Ok(None);
    }
    let recorder = Recorder::create(files, about)?;
    for file in recorder.rescued() {
        console.note(format!("a recording that was cut off under this name is now {}", file.display()));
    }
    Ok(Some(recorder))
}

/// Ends it.
pub(super) fn end(recorder: Recorder, about: &Value, console: &Console) -> Result<PathBuf> {
    if recorder.skipped() > 0 {
        console.warning(format!("{} without numbers left out", counted(recorder.skipped(), "sample")));
    }
    recorder.finish(about)
}

/// A flag that Ctrl-C and a request to end set.
pub(super) fn interrupts() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&flag);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed))
        .map_err(|e| Error::new(Code::CallInvalid, format!("Ctrl-C cannot be watched: {e}")))?;
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
        let state = words::state(status.state);
        console.result(if self.json {
            json!({ "schema": "pam-vent/1", "vented": true, "state": state }).to_string()
        } else {
            format!("vented; the device is {state}")
        });
        Ok(())
    }
}
