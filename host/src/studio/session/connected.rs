//! One connected controller: its requests, its telemetry to the page and to a recording.

mod set_up;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

use model_core::check;
use model_core::image;
use model_core::link::endpoints::{ClearFault, GetFaults, GetSettings, GetStatus, StartMode, Stop};
use model_core::link::hello::Board;
use model_core::link::messages::{Event, Side, Start, State, Status, Telemetry};
use model_core::link::settings::Settings;
use tokio::sync::broadcast;

use super::super::answers::{Answer, Difference, Ended, Faults, Flashed};
use super::super::events::{Controller, batch, compared, credible, tell};
use super::{Order, no_controller, report};
use crate::change_watch::ChangeWatch;
use crate::demo::campaign::muscle;
use crate::documents::recording::Run;
use pam_data::error::{DataCode, Error, Result};
use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::error::DeviceCode;
use pam_device::reachability::Reachability;
use pam_device::recorder::{self, About, Recorder, serial};
use pam_device::regulator;
use pam_device::run::{Plan, Steps, arm, release, vent};
use pam_device::setpoint_profile::Quantity;
use pam_device::{Address, Client, Losses, Subscription, Topic, VentLine, messages, table_diff, tables};
use pam_diagnose::reference::Mounted;
use pam_fit::table_file::TableFile;

/// Time between two batches of telemetry to the page.
const BATCH: Duration = Duration::from_millis(16);
/// Time between two reports of the state.
const REPORT: Duration = Duration::from_millis(400);

/// A controller that has said hello, and what the page does with it.
pub struct Connected {
    address: Address,
    client: Client,
    /// The telemetry, until this controller is left.
    stream: Option<Subscription>,
    status: Status,
    settings: Settings,
    emulated: Option<(Emulated, Arc<AtomicU8>)>,
    running: Option<(Quantity, Steps, Option<u64>)>,
    /// A recording, what it says of itself, and what was lost before it began.
    recorder: Option<(Recorder, Run, Losses)>,
    /// The regulator that was found last, as long as it is not kept.
    identified: Option<regulator::Found>,
    fault: Option<String>,
    changed: Option<ChangeWatch>,
    batch: Vec<Telemetry>,
    sent: Instant,
    reported: Instant,
}

impl std::fmt::Debug for Connected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Connected").field("client", &self.client).finish_non_exhaustive()
    }
}

impl Connected {
    /// Opens a port and reads what the page shows first.
    ///
    /// # Errors
    /// As [`Client::open`].
    pub fn open(address: Address) -> Result<Self> {
        Self::new(address.clone(), Client::open(&address)?, None)
    }

    /// Starts an emulated controller with a muscle of the bench, and connects to it. Also returns a description of what it runs on.
    ///
    /// # Errors
    /// A muscle that the bench does not know, or as [`Emulated::start`] and [`Client::open`].
    pub fn emulate(name: &str) -> Result<(Self, String)> {
        let stand = Stand::swinging(muscle(name)?);
        let mishap = stand.mishap();
        let emulated = Emulated::start(stand, None, 1.0)?;
        let address = emulated.address().clone();
        let client = Client::open(&address)?;
        let description = emulated.description();
        Ok((Self::new(address, client, Some((emulated, mishap)))?, description))
    }

    /// Where it is connected.
    pub(super) fn address(&self) -> &Address {
        &self.address
    }

    pub(super) fn vent_line(&self) -> Result<VentLine> {
        self.client.vent_line()
    }

    pub(super) fn state(&self) -> State {
        self.status.state
    }

    /// Vents and disarms, confirmed by the controller.
    pub(super) fn vent(&mut self) -> Result<()> {
        self.running = None;
        self.status = vent(&mut self.client)?;
        Ok(())
    }

    /// The same for a page that is gone, or leaves this controller: what another program has started continues.
    pub(super) fn release(&mut self) -> Result<()> {
        self.running = None;
        self.status = release(&mut self.client)?;
        Ok(())
    }

    /// Leaves the telemetry as it was before.
    pub(super) fn end_telemetry(&mut self) -> Result<()> {
        self.stream.take().map_or(Ok(()), |stream| stream.end(&mut self.client))
    }

    pub(crate) fn new(
        address: Address,
        mut client: Client,
        emulated: Option<(Emulated, Arc<AtomicU8>)>,
    ) -> Result<Self> {
        let stream = Some(Subscription::begin(&mut client, 1)?);
        let status = client.call::<GetStatus>(&())?;
        let settings = client.call::<GetSettings>(&())?;
        let mut now = Self {
            address,
            client,
            stream,
            status,
            settings,
            emulated,
            running: None,
            recorder: None,
            identified: None,
            fault: None,
            changed: None,
            batch: Vec::new(),
            sent: Instant::now(),
            reported: Instant::now(),
        };
        now.note_fault()?;
        Ok(now)
    }

    fn note_fault(&mut self) -> Result<()> {
        self.fault = None;
        if self.status.state == State::Fault
            && let Some(latched) = self.client.call::<GetFaults>(&())?.latched
        {
            self.fault = Some(format!(
                "{}. What to do: {}.",
                messages::report(&latched),
                messages::fault(latched.fault).remedy
            ));
        }
        Ok(())
    }

    /// The state for the page.
    pub(super) fn report(&mut self) -> Controller {
        self.reported = Instant::now();
        let hello = self.client.hello();
        let (major, minor, patch) = hello.release;
        let losses = self.client.losses();
        let place = |e: &(Emulated, _)| if e.0.kind() == Kind::Qemu { "QEMU" } else { "in this process" };
        Controller {
            port: self.client.port().to_owned(),
            board: Board::from_code(hello.board).map_or("unknown", Board::name),
            serial: serial(hello),
            release: format!("{major}.{minor}.{patch}"),
            emulated: self.emulated.as_ref().map(place),
            state: messages::state(self.status.state),
            mode: messages::mode(self.status.mode),
            fault: self.fault.clone(),
            lost: losses.samples,
            bad_frames: losses.bad_frames,
            recording: self.recorder.as_ref().map(|r| r.0.rows()),
            credible: credible(&self.settings),
        }
    }

    /// Takes what the controller sends for some milliseconds.
    pub(super) fn listen(&mut self, say: &broadcast::Sender<String>) -> Result<()> {
        match self.client.keep_alive() {
            // Another program has started a mode; the page continues to show what the controller does.
            Err(error) if error.code() == DeviceCode::DeviceInUse => {
                self.running = None;
                tell(say, "bad", &error);
            }
            other => other?,
        }
        if let Some(stream) = &mut self.stream {
            stream.renew(&mut self.client)?;
        }
        let until = Instant::now() + Duration::from_millis(8);
        while let Some(topic) = self.client.topic(until.saturating_duration_since(Instant::now()))? {
            match topic {
                Topic::Telemetry(sample) => self.take(sample, say)?,
                Topic::Event(event @ (Event::Fault(_) | Event::State(_))) => {
                    if let Some((recorder, ..)) = &mut self.recorder {
                        recorder.event(&event)?;
                    }
                    self.status = self.client.call::<GetStatus>(&())?;
                    self.note_fault()?;
                    report(Some(self), say);
                }
                Topic::Event(Event::TraceFull) | Topic::Log(_) => {}
            }
        }
        if self.sent.elapsed() >= BATCH && !self.batch.is_empty() {
            self.sent = Instant::now();
            let _ = say.send(batch(&self.batch));
            self.batch.clear();
        }
        if let Some(update) = self.changed.as_ref().and_then(ChangeWatch::news) {
            // Without a page nothing receives it.
            let _ = say.send(compared(&update));
        }
        if self.reported.elapsed() >= REPORT {
            report(Some(self), say);
        }
        Ok(())
    }

    fn take(&mut self, sample: Telemetry, say: &broadcast::Sender<String>) -> Result<()> {
        if let Some(stream) = &mut self.stream {
            // At the device's own rate it takes every one.
            let _ = stream.takes(&mut self.client, &sample);
        }
        if (sample.state, sample.mode) != (self.status.state, self.status.mode) {
            (self.status.state, self.status.mode) = (sample.state, sample.mode);
            self.note_fault()?;
            report(Some(self), say);
        }
        if let Some((recorder, ..)) = &mut self.recorder
            && let Err(error) = recorder.push(&sample)
        {
            // A full disk must not take the controller out of sight.
            tell(say, "bad", &error);
            let _ = self.end_recording();
        }
        if let Some(changed) = &mut self.changed {
            changed.push(&sample);
        }
        if sample.state == State::Running {
            if let Some((quantity, steps, start)) = &mut self.running {
                let begin = *start.get_or_insert(sample.time_us);
                let elapsed = sample.time_us.saturating_sub(begin) as f64 * 1e-6;
                match steps.advance(&mut self.client, *quantity, elapsed) {
                    // A controller that was vented beside this conversation refuses setpoints; it is still connected.
                    Err(error)
                        if [DeviceCode::DeviceRefused, DeviceCode::DeviceInUse]
                            .iter()
                            .any(|c| error.code() == *c) =>
                    {
                        self.running = None;
                        self.status = self.client.call::<GetStatus>(&())?;
                        if self.status.state == State::Running {
                            tell(say, "bad", &error);
                        }
                    }
                    other => other?,
                }
            }
        } else if sample.state == State::Fault {
            self.running = None;
        }
        self.batch.push(sample);
        Ok(())
    }

    /// Carries out an order to a connected controller.
    pub(super) fn obey(&mut self, order: Order) -> Result<Answer> {
        match order {
            Order::Replace(_) | Order::IsConnected(_) | Order::Disconnect | Order::Identify(..) => {
                return Err(no_controller());
            }
            Order::Signals => return self.signals(),
            Order::Calibrate(sensor, pairs, keep) => return self.calibrate(sensor, &pairs, keep),
            Order::KeepRegulator => return self.keep_regulator(),
            Order::Arm => {
                arm(&mut self.client)?;
                self.status = self.client.call::<GetStatus>(&())?;
            }
            Order::Follow(quantity, profile) => {
                // Samples from before the last order may still be on their way, and say what was then.
                self.status = self.client.call::<GetStatus>(&())?;
                if self.status.state == State::Disarmed {
                    return Err(Error::new(DeviceCode::DeviceRefused, "the controller is disarmed")
                        .help("arm it first"));
                }
                let reachable = Reachability::of(&mut self.client)?;
                if let Some(reason) = reachable.and_then(|r| r.beyond(quantity, &profile)) {
                    return Err(Error::new(DataCode::CallInvalid, reason).help("request less"));
                }
                if self.status.state == State::Running && !self.client.controls() {
                    return Err(messages::in_use("start"));
                }
                if self.status.state == State::Running && self.status.mode != quantity.mode() {
                    self.client.call::<Stop>(&())?;
                }
                let session = self.client.session();
                self.status = self.client.call::<StartMode>(&Start { mode: quantity.mode(), session })?;
                let plan = Plan { quantity, profile, seconds: None, every_ticks: 1 };
                self.running = Some((quantity, Steps::begin(&mut self.client, &plan)?, None));
            }
            Order::Faults => {
                let faults = self.client.call::<GetFaults>(&())?;
                return Ok(Answer::Faults(Faults { latched: faults.latched.as_ref().map(messages::report) }));
            }
            Order::Clear => {
                let cleared = self.client.call_once::<ClearFault>(&());
                self.status = self.client.call::<GetStatus>(&())?;
                self.note_fault()?;
                // The purpose is that none is latched: one that is gone already is not a failure.
                if self.status.state == State::Fault {
                    cleared?;
                }
            }
            Order::Settings(changes) => return self.settings(&changes),
            Order::Mishap(code) => match &self.emulated {
                Some((_, mishap)) => mishap.store(code, Ordering::Relaxed),
                None => {
                    return Err(Error::new(DataCode::CallInvalid, "mishaps are for emulated benches"));
                }
            },
            Order::Difference(path) => return self.difference(&path),
            Order::Flash(path) => return self.flash(&path),
            Order::Record(path) => {
                self.end_recording()?;
                let about = Run::watched(About::of("pam-run/1", &mut self.client)?);
                let recorder = Recorder::create(std::slice::from_ref(&path), &about)?;
                self.recorder = Some((recorder, about, self.client.losses()));
            }
            Order::Watch(reference) => {
                self.changed =
                    reference.map(|reference| ChangeWatch::start(reference, Mounted::Same)).transpose()?;
            }
            Order::EndRecord => {
                return Ok(Answer::Ended(Ended { path: self.end_recording()? }));
            }
        }
        Ok(Answer::Done)
    }

    fn difference(&mut self, path: &std::path::Path) -> Result<Answer> {
        let new = TableFile::read(path)?;
        let before = tables::read(&mut self.client, Side::Agonist)?;
        let text = match before {
            Some(before) => {
                let old =
                    image::read(&before).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
                table_diff::between(&old, &new.table).to_text()
            }
            None => "the device has no table yet".to_owned(),
        };
        Ok(Answer::Difference(Difference { text, table: path.display().to_string() }))
    }

    fn flash(&mut self, path: &std::path::Path) -> Result<Answer> {
        let file = TableFile::read(path)?;
        let mut buffer = [0; image::MAX_LEN];
        let image = image::write(&file.table, &mut buffer)
            .map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()).file(path))?;
        if let Some(before) = tables::read(&mut self.client, Side::Agonist)?
            && before != image
        {
            pam_data::output::write_whole(
                &path.with_extension(format!("{:08x}.image", check::of_image(&before))),
                &before,
            )?;
        }
        let kept = tables::write(&mut self.client, Side::Agonist, image, |_| ())?;
        Ok(Answer::Flashed(Flashed {
            crc: format!("{:08x}", kept.crc),
            bytes: kept.length,
            generation: kept.generation,
        }))
    }

    /// Ends the recording, if there is one.
    pub(super) fn end_recording(&mut self) -> Result<Option<PathBuf>> {
        let Some((recorder, mut about, before)) = self.recorder.take() else { return Ok(None) };
        let losses = self.client.losses().since(before);
        about.ended = Some(recorder::Ended { losses, ended_by: "the page".to_owned() });
        recorder.finish(&about).map(Some)
    }
}
