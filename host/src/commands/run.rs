//! `host run`: let a controller follow a setpoint profile and record it.

mod session;
mod tracking_error;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use model_core::link::endpoints::{GetSettings, SetSettings};
use model_core::link::settings::FeedForward;

use self::session::Session;
use super::interrupt::interrupts;
use super::port::PortOption;
use super::recording_files::{positive, refuse_existing};
use crate::change_watch::ReferenceOptions;
use crate::console::Console;
use pam_data::error::{DataCode, Error, Result};
use pam_device::Client;
use pam_device::error::DeviceCode;
use pam_device::setpoint_profile::{Quantity, SetpointProfile};

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
    quantity: Setpoint,
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
    /// Where the pressure for a force comes from; remains set afterwards.
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
struct Setpoint {
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

impl Setpoint {
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
        refuse_existing(&self.output, self.replace)?;
        let changed = self.changed.start(console)?;
        let interrupted = interrupts()?;
        let mut client = self.port.connect(console)?;
        if let Some(source) = self.feed_forward {
            choose_feed_forward(&mut client, source)?;
        }
        let mut session = Session::begin(&self, quantity, &profile, changed, &mut client, console)?;
        let outcome = session.follow(profile, &mut client, &interrupted, console);
        session.end(outcome, &mut client, console)?.print(self.json, console);
        Ok(())
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
