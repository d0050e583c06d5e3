//! One run: what is known before it, while the controller follows the setpoint, and at its end.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use model_core::link::endpoints::{GetInfo, GetSettings, GetStatus};
use pam_data::error::Result;
use pam_data::output::json_of;
use pam_data::pluralise::pluralise;
use pam_data::progress::Progress;
use pam_device::reachability::Reachability;
use pam_device::recorder::{About, Ended, Recorder};
use pam_device::run::{Ending, Plan, run};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_device::{Client, Losses, messages};

use super::Arguments;
use super::tracking_error::TrackingError;
use crate::change_watch::{self, ChangeWatch};
use crate::commands::recording_files::{begin, end, warn_of_losses};
use crate::console::Console;
use crate::documents::recording::{Run, RunOutcome, RunRequest};
use crate::progress::ProgressLine;

/// Share of a run in saturation from which it is reported: a step exceeds the limits for a moment without harm.
const SATURATION_REPORTED: f64 = 0.1;

/// A run that has begun.
pub(super) struct Session {
    quantity: Quantity,
    seconds: Option<f64>,
    /// Control ticks per second.
    ticks: f64,
    /// Control ticks between two samples.
    every_ticks: u16,
    /// What had been lost before the run.
    lost_before: Losses,
    saturated_before: u32,
    tracking: TrackingError,
    reachability: Option<Reachability>,
    changed: Option<ChangeWatch>,
    recorder: Option<Recorder>,
    /// How the run was made, for the recording and for `--json`.
    about: Run,
}

/// What is printed at the end of a run.
pub(super) struct Report {
    about: Run,
    summary: String,
    changed: Option<String>,
}

impl Report {
    /// Prints it.
    pub(super) fn print(self, json: bool, console: &Console) {
        if json {
            console.result(format!("{:#}", json_of(&self.about)));
            return;
        }
        console.result(self.summary);
        if let Some(changed) = self.changed {
            console.result(changed.trim_end());
        }
    }
}

impl Session {
    /// Reads what the controller is and begins the recording; nothing moves yet.
    pub(super) fn begin(
        arguments: &Arguments,
        quantity: Quantity,
        profile: &SetpointProfile,
        changed: Option<ChangeWatch>,
        client: &mut Client,
        console: &Console,
    ) -> Result<Self> {
        let ticks = f64::from(client.call::<GetInfo>(&())?.ticks_per_s);
        let every_ticks =
            arguments.rate.map_or(1.0, |rate| (ticks / rate).round()).clamp(1.0, 60_000.0) as u16;
        let mut about = Run::watched(About::of("pam-run/1", client)?);
        about.request = Some(RunRequest {
            mode: messages::mode(quantity.mode()),
            setpoint_profile: arguments.quantity.text().map(str::to_owned),
            stiffness_Nm_per_rad: arguments.stiffness.map(f64::from),
            unit: quantity.unit(),
        });
        let recorder = begin(&arguments.output, &about, console)?;
        let tracking = TrackingError::new(client.call::<GetSettings>(&())?.joint);
        let saturated_before = client.call::<GetStatus>(&())?.saturated_ticks;
        let reachability = Reachability::of(client)?;
        // Before anything moves, not after ten seconds at the highest pressure.
        if let Some(warning) = reachability.as_ref().and_then(|r| r.beyond(quantity, profile)) {
            console.warning(warning);
        }
        Ok(Self {
            quantity,
            seconds: arguments.seconds,
            ticks,
            every_ticks,
            lost_before: client.losses(),
            saturated_before,
            tracking,
            reachability: reachability.filter(|_| quantity != Quantity::Pressure),
            changed,
            recorder,
            about,
        })
    }

    /// Follows the setpoint until the time is over, Ctrl-C, or a fault.
    pub(super) fn follow(
        &mut self,
        profile: SetpointProfile,
        client: &mut Client,
        interrupted: &AtomicBool,
        console: &Console,
    ) -> Result<Ending> {
        let quantity = self.quantity;
        let plan = Plan { quantity, profile, seconds: self.seconds, every_ticks: self.every_ticks };
        let progress = ProgressLine::new(console, "run");
        progress.total(self.seconds.map_or(0, |s| (s * 1e3) as u64));
        let mut start = None;
        let mut last_change = String::new();
        run(
            client,
            &plan,
            |sample| {
                self.tracking.add(quantity, sample);
                if let Some(changed) = &mut self.changed {
                    changed.push(sample);
                }
                change_watch::tell(self.changed.as_ref(), &mut last_change, console);
                if let Some(reachability) = &mut self.reachability {
                    reachability.add(quantity, sample);
                }
                progress.set((sample.time_us - *start.get_or_insert(sample.time_us)) / 1000);
                self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.push(sample))
            },
            || interrupted.load(Ordering::Relaxed),
        )
    }

    /// Ends the recording, also after a fault, and collects what is reported.
    pub(super) fn end(
        mut self,
        outcome: Result<Ending>,
        client: &mut Client,
        console: &Console,
    ) -> Result<Report> {
        let losses = client.losses().since(self.lost_before);
        let status = outcome.as_ref().ok().and_then(|_| client.call::<GetStatus>(&()).ok());
        let saturated = status.map(|status| status.saturated_ticks.wrapping_sub(self.saturated_before));
        let samples_per_s = self.ticks / f64::from(self.every_ticks);
        let changed = change_watch::finish(self.changed.take());
        self.about.ended = Some(Ended::of(&outcome, losses));
        self.about.outcome = Some(RunOutcome {
            samples: self.tracking.all.samples,
            tracking_rms: self.tracking.all.rms(self.quantity),
            tracking_rms_after_1_s: self.tracking.settled.rms(self.quantity),
            saturated_ticks: saturated,
            reach: self.reachability.as_ref().map(|r| r.times(samples_per_s)),
            changed: changed.as_ref().map(|c| c.1.clone()),
        });
        // The recording is complete up to a fault, and is kept: it shows what led to the fault.
        let kept = self.recorder.take().map(|recorder| end(recorder, &self.about, console)).transpose();
        let ending = outcome?;
        let kept = kept?;
        warn_of_losses(losses, console);
        self.warn_of_limits(saturated, samples_per_s, console);
        if ending == Ending::Stopped {
            console.note("interrupted; the muscle is vented");
        }
        Ok(Report { summary: self.summary(kept, losses), about: self.about, changed: changed.map(|c| c.0) })
    }

    /// Warns where the setpoint was saturated for long, and where the run left the tested range.
    fn warn_of_limits(&self, saturated: Option<u32>, samples_per_s: f64, console: &Console) {
        let lasted = self.tracking.all.samples as f64 * f64::from(self.every_ticks);
        if let Some(saturated) = saturated.map(f64::from).filter(|s| *s > SATURATION_REPORTED * lasted) {
            let why = self.reachability.as_ref().and_then(Reachability::why).unwrap_or(
                "more than the muscle can do there at the highest pressure allowed, or less than at none",
            );
            console.warning(format!(
                "for {:.2} of {:.2} s the setpoint could not be reached: {why}",
                saturated.min(lasted) / self.ticks,
                lasted / self.ticks
            ));
        }
        if let Some(warning) = self.reachability.as_ref().and_then(|r| r.extrapolated(samples_per_s)) {
            console.warning(warning);
        }
    }

    fn summary(&self, recording: Option<PathBuf>, losses: Losses) -> String {
        let missing =
            if losses.samples > 0 { format!(", {} missing", losses.samples) } else { String::new() };
        let name = recording.map(|p| format!(" in {}", p.display())).unwrap_or_default();
        let samples = pluralise(self.tracking.all.samples, "sample");
        format!("{samples}{name}{missing}{}; vented", self.tracking.to_text(self.quantity))
    }
}
