//! How well a controller's force follows the setpoint while the muscle moves, under one control law after another.

use model_core::link::endpoints::{GetSettings, SetSettings};
use model_core::link::messages::{Reference, Telemetry};
use model_core::link::settings::{FeedForward, ForceLoop, Settings};

use pam_data::error::{Error, Result};
use pam_device::Client;
use pam_device::error::DeviceCode;
use pam_device::run::{Ending, Plan, run};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};

/// Where a controller's pressure comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// The inverse of the fitted table, nothing else.
    Table,
    /// The ideal braid alone, nothing else.
    Gaylord,
    /// No feed-forward: proportional and integral feedback of the load cell.
    Feedback,
}

impl Law {
    /// All of them, the best first.
    pub const ALL: [Self; 3] = [Self::Table, Self::Gaylord, Self::Feedback];

    /// The name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Table => "fitted table",
            Self::Gaylord => "plain Gaylord",
            Self::Feedback => "no feed-forward (PI)",
        }
    }

    /// The name for scripts.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Gaylord => "gaylord",
            Self::Feedback => "none",
        }
    }

    /// The settings that make it, from those in force.
    ///
    /// `gain` is the muscle's own, N/Pa. The feedback crosses over at 10 rad/s: with the bench's regulator (some 30 ms of lag
    /// and line) it keeps about 60° of phase.
    #[must_use]
    pub fn settings(self, base: Settings, gain: f64) -> Settings {
        let none = ForceLoop { proportional_pa_per_n: 0.0, integral_pa_per_n_s: 0.0, trim_limit_pa: 0.0 };
        let (feed_forward, force_loop) = match self {
            Self::Table => (FeedForward::Table, none),
            Self::Gaylord => (FeedForward::Gaylord, none),
            Self::Feedback => (
                FeedForward::Off,
                ForceLoop {
                    proportional_pa_per_n: (0.3 / gain) as f32,
                    integral_pa_per_n_s: (10.0 / gain) as f32,
                    trim_limit_pa: base.regulator.command_max_pa,
                },
            ),
        };
        Settings { feed_forward, force_loop, ..base }
    }
}

/// The force setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// A sine of 0.5 Hz.
    Sine,
    /// Steps up and down.
    Steps,
}

impl Task {
    /// Both setpoint profiles.
    pub const ALL: [Self; 2] = [Self::Sine, Self::Steps];

    /// The name for people and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::Steps => "steps",
        }
    }

    /// The plan of its run, for a muscle whose forces lie around `mean` (N).
    #[must_use]
    pub fn plan(self, mean: f64) -> Plan {
        let part = |share: f64| (share * mean) as f32;
        let (profile, seconds) = match self {
            Self::Sine => {
                let reference = Reference::Sine { mean: part(1.0), amplitude: part(0.5), frequency_hz: 0.5 };
                (SetpointProfile::Wave(reference), 5.0)
            }
            Self::Steps => (
                SetpointProfile::Steps {
                    values: vec![part(0.8), part(1.2), part(1.0), part(1.3)],
                    hold_s: 1.0,
                },
                4.0,
            ),
        };
        Plan { quantity: Quantity::Force, profile, seconds: Some(seconds), every_ticks: 1 }
    }
}

/// Seconds at the beginning of a run that are not judged: the muscle fills.
pub const SETTLE: f64 = 1.0;

/// One run under one law.
#[derive(Debug, Clone)]
pub struct Track {
    /// The law.
    pub law: Law,
    /// The task.
    pub task: Task,
    /// Every sample of the run.
    pub samples: Vec<Telemetry>,
    /// Root mean square of measured less asked force after [`SETTLE`], N.
    pub rms: f64,
    /// The largest difference there, N.
    pub largest: f64,
}

/// Chooses a law on a device and has it confirmed.
///
/// # Errors
/// Refusals, silence, or [`DeviceCode::DeviceVerify`].
pub fn choose(client: &mut Client, law: Law, gain: f64) -> Result<()> {
    let wanted = law.settings(client.call::<GetSettings>(&())?, gain);
    if client.call_once::<SetSettings>(&wanted)? != wanted {
        return Err(Error::new(
            DeviceCode::DeviceVerify,
            "the settings read back from the device differ from those sent",
        ));
    }
    Ok(())
}

/// Lets a device follow a task and judges it.
///
/// # Errors
/// As [`run`]; [`DeviceCode::DeviceSilent`] when too little came back.
pub fn track(
    client: &mut Client,
    law: Law,
    task: Task,
    mean: f64,
    mut progress: impl FnMut(f64),
) -> Result<Track> {
    let mut samples = Vec::new();
    let plan = task.plan(mean);
    let total = plan.seconds.unwrap_or(1.0);
    let ending = run(
        client,
        &plan,
        |sample| {
            samples.push(sample.clone());
            let since = samples[0].time_us;
            progress((sample.time_us.saturating_sub(since)) as f64 * 1e-6 / total);
            Ok(())
        },
        || false,
    )?;
    debug_assert_eq!(ending, Ending::Done);
    let start = samples.first().map_or(0, |s| s.time_us);
    let errors: Vec<f64> = samples
        .iter()
        .filter(|s| s.time_us.saturating_sub(start) as f64 * 1e-6 >= SETTLE)
        .filter_map(|s| Some(f64::from(s.sides.first()?.force_n) - f64::from(s.setpoint)))
        .collect();
    if errors.len() < 100 {
        return Err(Error::new(DeviceCode::DeviceSilent, format!("only {} samples came back", errors.len())));
    }
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let largest = errors.iter().fold(0.0_f64, |a, e| a.max(e.abs()));
    Ok(Track { law, task, samples, rms, largest })
}
