//! The thread that owns the connection to the controller: orders in, telemetry and states out, and safety when nobody looks.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use model_core::check;
use model_core::image;
use model_core::link::endpoints::{
    ClearFault, GetFaults, GetSettings, GetStatus, SetSettings, SetTelemetry, StartMode, Stop,
};
use model_core::link::hello::Board;
use model_core::link::messages::{Event, Side, Start, State, Status, Telemetry, TelemetryRate};
use model_core::link::settings::Settings;
use serde_json::{Value, json};
use tokio::sync::{broadcast, oneshot};

use crate::demo::campaign::muscle;
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::json_of;
use pam_device::course::{Course, Quantity};
use pam_device::emulated::{Emulated, Kind, Stand};
use pam_device::error::DeviceCode;
use pam_device::recorder::{Recorder, about_losses, about_start, serial};
use pam_device::run::{Plan, Steps, arm, vent};
use pam_device::{Client, Topic, difference, tables, words};
use pam_fit::table_file::TableFile;

use super::told::{batch, credible, tell};

/// What the page may ask of the controller.
#[derive(Debug)]
pub enum Order {
    /// Connect to a port.
    Connect(String),
    /// Start an emulated controller with a muscle of the bench, and connect to it.
    Emulate(String),
    /// Vent and let go.
    Disconnect,
    /// Arm.
    Arm,
    /// Vent and disarm: always allowed.
    Vent,
    /// Follow a course.
    Follow(Quantity, String),
    /// Faults in words.
    Faults,
    /// Forget the latched fault.
    Clear,
    /// Change settings, each `KEY=VALUE`; the answer is all of them.
    Settings(Vec<String>),
    /// Let something go wrong on the emulated bench.
    Mishap(u8),
    /// What would change if this table were sent.
    Difference(PathBuf),
    /// Send this table.
    Flash(PathBuf),
    /// Begin a recording.
    Record(PathBuf),
    /// End it.
    EndRecord,
}

/// An order and where its answer goes.
pub type Asked = (Order, oneshot::Sender<Result<Value>>);

/// How long nobody may look at an armed controller.
const UNWATCHED: Duration = Duration::from_millis(1_500);
/// Time between two batches of telemetry to the page.
const BATCH: Duration = Duration::from_millis(16);
/// Time between two reports of the state.
const REPORT: Duration = Duration::from_millis(400);

struct Connected {
    client: Client,
    status: Status,
    settings: Settings,
    emulated: Option<(Emulated, Arc<AtomicU8>)>,
    running: Option<(Quantity, Steps, Option<u64>)>,
    recorder: Option<(Recorder, Value)>,
    fault: Option<String>,
    batch: Vec<Telemetry>,
    sent: Instant,
    reported: Instant,
}

/// Serves orders until the page's server ends; then vents.
pub fn keep(orders: &Receiver<Asked>, say: &broadcast::Sender<String>) {
    let mut connected: Option<Connected> = None;
    let mut watched = Instant::now();
    loop {
        let wait = if connected.is_some() { Duration::from_millis(1) } else { Duration::from_millis(200) };
        match orders.recv_timeout(wait) {
            Ok((order, answer)) => {
                let outcome = obey(order, &mut connected);
                // A page that is gone does not wait for its answer.
                let _ = answer.send(outcome);
                report(connected.as_mut(), say);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if say.receiver_count() > 0 {
            watched = Instant::now();
        }
        let Some(now) = connected.as_mut() else {
            continue;
        };
        if let Err(error) = now.listen(say) {
            tell(say, "bad", &error);
            // What was recorded until the cable was pulled is kept.
            if let Err(error) = now.end_recording() {
                tell(say, "bad", &error);
            }
            connected = None;
            report(None, say);
            continue;
        }
        if watched.elapsed() > UNWATCHED && matches!(now.status.state, State::Armed | State::Running) {
            now.running = None;
            // Nobody looks: what fails here is told by the next page through the state itself.
            if let Ok(status) = vent(&mut now.client) {
                now.status = status;
            }
        }
    }
    if let Some(mut now) = connected {
        let _ = vent(&mut now.client);
        let _ = now.end_recording();
    }
}

fn report(connected: Option<&mut Connected>, say: &broadcast::Sender<String>) {
    let text = match connected {
        Some(now) => {
            now.reported = Instant::now();
            now.state().to_string()
        }
        None => json!({ "k": "s", "connected": false }).to_string(),
    };
    // Without a page nobody listens.
    let _ = say.send(text);
}

fn none() -> Error {
    Error::new(DataCode::CallInvalid, "no controller is connected")
        .help("connect to a port, or start an emulated one")
}

fn obey(order: Order, connected: &mut Option<Connected>) -> Result<Value> {
    match order {
        Order::Connect(port) => {
            let client = Client::open(&port.parse()?)?;
            *connected = Some(Connected::new(client, None)?);
            Ok(Value::Null)
        }
        Order::Emulate(name) => {
            // The old one ends before a new one begins.
            *connected = None;
            let stand = Stand::swinging(muscle(&name)?);
            let mishap = stand.mishap();
            let emulated = Emulated::start(stand, None, 1.0)?;
            let client = Client::open(emulated.address())?;
            let words = emulated.words();
            *connected = Some(Connected::new(client, Some((emulated, mishap)))?);
            Ok(json!({ "controller": words }))
        }
        Order::Disconnect => {
            if let Some(mut now) = connected.take() {
                vent(&mut now.client)?;
                now.end_recording()?;
            }
            Ok(Value::Null)
        }
        other => connected.as_mut().ok_or_else(none)?.obey(other),
    }
}

impl Connected {
    fn new(mut client: Client, emulated: Option<(Emulated, Arc<AtomicU8>)>) -> Result<Self> {
        client.call::<SetTelemetry>(&TelemetryRate { every_ticks: 1 })?;
        let status = client.call::<GetStatus>(&())?;
        let settings = client.call::<GetSettings>(&())?;
        let mut now = Self {
            client,
            status,
            settings,
            emulated,
            running: None,
            recorder: None,
            fault: None,
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
                words::report(&latched),
                words::fault(latched.fault).remedy
            ));
        }
        Ok(())
    }

    fn state(&self) -> Value {
        let hello = self.client.hello();
        let (major, minor, patch) = hello.release;
        let losses = self.client.losses();
        json!({
            "k": "s", "connected": true,
            "port": self.client.port(),
            "board": Board::from_code(hello.board).map_or("unknown", Board::name),
            "serial": serial(hello),
            "release": format!("{major}.{minor}.{patch}"),
            "emulated": self.emulated.as_ref().map(|e| if e.0.kind() == Kind::Qemu { "QEMU" } else { "in this process" }),
            "state": words::state(self.status.state),
            "mode": words::mode(self.status.mode),
            "fault": self.fault,
            "lost": losses.samples, "bad_frames": losses.bad_frames,
            "recording": self.recorder.as_ref().map(|r| r.0.rows()),
            "credible": credible(&self.settings),
        })
    }

    fn listen(&mut self, say: &broadcast::Sender<String>) -> Result<()> {
        self.client.keep_alive()?;
        let until = Instant::now() + Duration::from_millis(8);
        while let Some(topic) = self.client.topic(until.saturating_duration_since(Instant::now()))? {
            match topic {
                Topic::Telemetry(sample) => self.take(sample, say)?,
                Topic::Event(event @ (Event::Fault(_) | Event::State(_))) => {
                    if let Some((recorder, _)) = &mut self.recorder {
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
        if self.reported.elapsed() >= REPORT {
            report(Some(self), say);
        }
        Ok(())
    }

    fn take(&mut self, sample: Telemetry, say: &broadcast::Sender<String>) -> Result<()> {
        if (sample.state, sample.mode) != (self.status.state, self.status.mode) {
            (self.status.state, self.status.mode) = (sample.state, sample.mode);
            self.note_fault()?;
            report(Some(self), say);
        }
        if let Some((recorder, _)) = &mut self.recorder
            && let Err(error) = recorder.push(&sample)
        {
            // A full disk must not take the controller out of sight.
            tell(say, "bad", &error);
            let _ = self.end_recording();
        }
        if sample.state == State::Running {
            if let Some((quantity, steps, start)) = &mut self.running {
                let begin = *start.get_or_insert(sample.time_us);
                steps.advance(
                    &mut self.client,
                    *quantity,
                    sample.time_us.saturating_sub(begin) as f64 * 1e-6,
                )?;
            }
        } else if sample.state == State::Fault {
            self.running = None;
        }
        self.batch.push(sample);
        Ok(())
    }

    fn obey(&mut self, order: Order) -> Result<Value> {
        match order {
            Order::Connect(_) | Order::Emulate(_) | Order::Disconnect => return Err(none()),
            Order::Arm => {
                arm(&mut self.client)?;
                self.status = self.client.call::<GetStatus>(&())?;
            }
            Order::Vent => {
                self.running = None;
                self.status = vent(&mut self.client)?;
            }
            Order::Follow(quantity, text) => {
                let course = Course::parse(&text, quantity)?;
                if self.status.state == State::Disarmed {
                    return Err(Error::new(DeviceCode::DeviceRefused, "the controller is disarmed")
                        .help("arm it first"));
                }
                if self.status.state == State::Running && self.status.mode != quantity.mode() {
                    self.client.call::<Stop>(&())?;
                }
                self.status = self.client.call::<StartMode>(&Start { mode: quantity.mode() })?;
                let plan = Plan { quantity, course, seconds: None, every_ticks: 1 };
                self.running = Some((quantity, Steps::begin(&mut self.client, &plan)?, None));
            }
            Order::Faults => {
                let faults = self.client.call::<GetFaults>(&())?;
                return Ok(json!({ "latched": faults.latched.as_ref().map(words::report) }));
            }
            Order::Clear => {
                let cleared = self.client.call_once::<ClearFault>(&());
                self.status = self.client.call::<GetStatus>(&())?;
                self.note_fault()?;
                // What is wanted is that none is latched: one that is gone already is no failure.
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
                let about = about_start("pam-run/1", &mut self.client)?;
                self.recorder = Some((Recorder::create(std::slice::from_ref(&path), &about)?, about));
            }
            Order::EndRecord => {
                let path = self.end_recording()?;
                return Ok(json!({ "path": path.map(|p| p.display().to_string()) }));
            }
        }
        Ok(Value::Null)
    }

    fn settings(&mut self, changes: &[String]) -> Result<Value> {
        let mut settings = self.client.call::<GetSettings>(&())?;
        if !changes.is_empty() {
            for change in changes {
                settings = crate::commands::device::changed(settings, change)?;
            }
            let kept = self.client.call_once::<SetSettings>(&settings)?;
            let read = self.client.call::<GetSettings>(&())?;
            if kept != settings || read != settings {
                return Err(Error::new(
                    DeviceCode::DeviceVerify,
                    "the device keeps other settings than it was sent",
                ));
            }
        }
        self.settings = settings;
        Ok(json_of(&settings))
    }

    fn difference(&mut self, path: &std::path::Path) -> Result<Value> {
        let new = TableFile::read(path)?;
        let before = tables::read(&mut self.client, Side::Agonist)?;
        let Some(before) = before else { return Ok(json!({ "text": "the device has no table yet" })) };
        let old = image::read(&before).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
        Ok(json!({ "text": difference::between(&old, &new.table).to_text() }))
    }

    fn flash(&mut self, path: &std::path::Path) -> Result<Value> {
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
        Ok(json!({ "crc": format!("{:08x}", kept.crc), "bytes": kept.length, "generation": kept.generation }))
    }

    fn end_recording(&mut self) -> Result<Option<PathBuf>> {
        let Some((recorder, mut about)) = self.recorder.take() else { return Ok(None) };
        about["losses"] = about_losses(self.client.losses());
        about["ended_by"] = json!("the page");
        recorder.finish(&about).map(Some)
    }
}
