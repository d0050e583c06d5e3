//! The link to a controller: one conversation, and at most one run or recording in progress, in a thread of its own.
//!
//! The thread keeps the controller's session alive and vents at the end of a run whatever ended it. A run ends, too, when Python does not
//! take its samples: a program that hangs must not keep a muscle under pressure.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use model_core::image;
use model_core::link::endpoints::{ClearFault, GetFaults, GetInfo, GetSettings, GetStatus, SetSettings};
use model_core::link::messages::{Side, Telemetry};
use model_core::link::settings::Settings;
use pam_data::error::{DataCode, Error, Result};
use pam_data::output::json_of;
use pam_device::error::DeviceCode;
use pam_device::reachability::Reachability;
use pam_device::recorder::LinkedDevice;
use pam_device::run::{Plan, arm, run, vent};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_device::watch::{Happened, watch};
use pam_device::{Address, Client, Losses, VentLine, available, messages, tables};
use pyo3::prelude::*;
use serde::Serialize;

use crate::arrays::loads;
use crate::error::{raised, wrong};
use crate::table::Table;
use crate::warnings::warn;

/// How long a run continues while Python takes no samples. The studio allows a page that does not respond the same time.
const UNATTENDED: Duration = Duration::from_secs(2);
/// Samples of a recording that Python may leave waiting: a minute at 1 kHz.
const BACKLOG: usize = 60_000;

/// A controller as Python gets it.
#[derive(Serialize)]
struct Info {
    #[serde(flatten)]
    device: LinkedDevice,
    state: &'static str,
    mode: &'static str,
    time_s: f64,
    fault: Option<String>,
    losses: Losses,
}

/// One sample as Python gets it: time, pressure, stroke, force, pressure command, setpoint, force of the table, state, mode.
type Row = (f64, f64, f64, f64, f64, f64, f64, &'static str, &'static str);

fn row(sample: &Telemetry) -> Option<Row> {
    let side = sample.sides.first()?;
    Some((
        sample.time_us as f64 * 1e-6,
        f64::from(side.pressure_pa),
        f64::from(side.stroke_m),
        f64::from(side.force_n),
        f64::from(side.command_pa),
        f64::from(sample.setpoint),
        f64::from(side.model_n),
        messages::state(sample.state),
        messages::mode(sample.mode),
    ))
}

/// Samples between the thread that reads them and Python.
#[derive(Default)]
struct Queue {
    rows: VecDeque<Row>,
    /// When Python took samples last; `None` while none wait.
    waiting: Option<Instant>,
    done: bool,
}

#[derive(Default)]
struct Exchange {
    queue: Mutex<Queue>,
    news: Condvar,
    stop: AtomicBool,
}

impl Exchange {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a sample; an error where Python has not taken any for too long.
    fn push(&self, sample: &Telemetry, moves: bool) -> Result<()> {
        let mut queue = self.lock();
        let waiting = *queue.waiting.get_or_insert_with(Instant::now);
        if moves && waiting.elapsed() > UNATTENDED {
            return Err(Error::new(
                DataCode::CallInvalid,
                format!(
                    "the program took no samples for {:.0} s, so the muscle was vented",
                    UNATTENDED.as_secs_f64()
                ),
            )
            .help("take the samples in a loop without long pauses, or use run(), which takes them itself"));
        }
        if queue.rows.len() >= BACKLOG {
            return Err(Error::new(DataCode::CallInvalid, format!("{BACKLOG} samples were not taken"))
                .help("take the samples in a loop, or request fewer per second"));
        }
        queue.rows.extend(row(sample));
        drop(queue);
        self.news.notify_all();
        Ok(())
    }

    fn finish(&self) {
        self.lock().done = true;
        self.news.notify_all();
    }
}

/// The connection to a controller. Every lock is taken without the interpreter, so that a vent from another thread is never held up
/// by it.
#[pyclass(frozen, module = "pamtools._native")]
pub(crate) struct Link {
    talk: Mutex<Talk>,
    /// The exchange of the job in progress, beside `talk`.
    exchange: Mutex<Option<Arc<Exchange>>>,
    vent_line: Mutex<Option<VentLine>>,
    port: String,
}

/// Either the conversation itself, or the thread that has it.
#[derive(Default)]
struct Talk {
    client: Option<Client>,
    job: Option<JoinHandle<(Client, Result<()>)>>,
}

impl Talk {
    fn client(&mut self) -> Result<&mut Client> {
        if self.job.is_some() {
            return Err(Error::new(DataCode::CallInvalid, "a run or a recording is in progress")
                .help("take its samples to the end, or stop it"));
        }
        self.client.as_mut().ok_or_else(closed)
    }

    /// Waits for the thread to end, and takes the conversation back.
    fn end(&mut self) -> Result<()> {
        let Some(job) = self.job.take() else { return Ok(()) };
        match job.join() {
            Ok((client, outcome)) => {
                self.client = Some(client);
                outcome
            }
            Err(_) => Err(Error::new(DeviceCode::DeviceSilent, "the thread of the run ended unexpectedly")
                .help("connect again; this is a defect of the package: report it")),
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Link {
    /// Works with the conversation.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Client) -> Result<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| work(locked(&self.talk).client()?)).map_err(raised)
    }

    /// Starts a thread with the conversation.
    fn begin(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Client, &Exchange) -> Result<()> + Send + 'static,
    ) -> PyResult<()> {
        let begun = py.detach(|| {
            let mut talk = locked(&self.talk);
            talk.client()?;
            let mut client = talk.client.take().ok_or_else(closed)?;
            let exchange = Arc::new(Exchange::default());
            let own = Arc::clone(&exchange);
            *locked(&self.exchange) = Some(exchange);
            talk.job = Some(std::thread::spawn(move || {
                let outcome = work(&mut client, &own);
                own.finish();
                (client, outcome)
            }));
            Ok(())
        });
        begun.map_err(raised)
    }

    /// Has the thread end, and waits for it.
    fn halt(&self) -> Result<()> {
        if let Some(exchange) = locked(&self.exchange).take() {
            exchange.stop.store(true, Ordering::Relaxed);
        }
        locked(&self.talk).end()
    }
}

fn closed() -> Error {
    Error::new(DeviceCode::DeviceSilent, "the connection is closed").help("call pamtools.connect again")
}

/// One sample every n ticks for a rate in Hz.
fn every(client: &mut Client, rate: Option<f64>) -> Result<u16> {
    let ticks = f64::from(client.call::<GetInfo>(&())?.ticks_per_s);
    match rate {
        None => Ok(1),
        Some(rate) if rate > 0.0 && rate.is_finite() => {
            Ok((ticks / rate).round().clamp(1.0, 60_000.0) as u16)
        }
        Some(rate) => Err(Error::new(DataCode::CallInvalid, format!("`rate` is {rate}"))
            .help("give samples per second, above 0")),
    }
}

fn checked_seconds(seconds: Option<f64>) -> PyResult<Option<f64>> {
    match seconds {
        Some(s) if !(s > 0.0 && s.is_finite()) => Err(wrong(format!("`seconds` is {s}; it must be above 0"))),
        other => Ok(other),
    }
}

#[pymethods]
impl Link {
    /// Opens a port (a serial device, or tcp:HOST:PORT) and says hello.
    #[new]
    fn new(py: Python<'_>, port: &str) -> PyResult<Self> {
        let address: Address = port.parse().map_err(raised)?;
        let client = py.detach(|| Client::open(&address)).map_err(raised)?;
        let vent_line = Mutex::new(client.vent_line().ok());
        let port = client.port().to_owned();
        let talk = Mutex::new(Talk { client: Some(client), job: None });
        Ok(Self { talk, exchange: Mutex::default(), vent_line, port })
    }

    /// The serial ports of this computer.
    #[staticmethod]
    fn ports() -> Vec<String> {
        available()
    }

    /// The address of the port.
    #[getter]
    fn port(&self) -> &str {
        &self.port
    }

    /// Identity, tables, settings, and state, as a dict.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = self.with(py, |client| {
            let device = LinkedDevice::of(client)?;
            let status = client.call::<GetStatus>(&())?;
            let faults = client.call::<GetFaults>(&())?;
            let info = Info {
                device,
                state: messages::state(status.state),
                mode: messages::mode(status.mode),
                time_s: status.time_us as f64 * 1e-6,
                fault: faults.latched.as_ref().map(messages::report),
                losses: client.losses(),
            };
            Ok(json_of(&info).to_string())
        })?;
        loads(py, &text)
    }

    /// The settings as a dict.
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let settings = self.with(py, |client| client.call::<GetSettings>(&()))?;
        loads(py, &json_of(&settings).to_string())
    }

    /// Writes settings, given whole as JSON, and reads them back.
    fn write_settings(&self, py: Python<'_>, text: &str) -> PyResult<()> {
        let settings: Settings =
            serde_json::from_str(text).map_err(|e| wrong(format!("the settings are invalid: {e}")))?;
        self.with(py, |client| {
            let kept = client.call_once::<SetSettings>(&settings)?;
            let read = client.call::<GetSettings>(&())?;
            if kept == settings && read == settings {
                return Ok(());
            }
            Err(Error::new(
                DeviceCode::DeviceVerify,
                "the settings read back from the device differ from those sent",
            )
            .help("read them again"))
        })
    }

    /// Sends a table, reads it back, and compares every byte. Returns its check sum.
    fn flash(&self, py: Python<'_>, table: PyRef<'_, Table>) -> PyResult<String> {
        let mut buffer = [0; image::MAX_LEN];
        let image = image::write(&table.0.table, &mut buffer)
            .map_err(|e| raised(Error::new(DataCode::TableInvalid, e.to_string())))?
            .to_vec();
        let kept = self.with(py, |client| tables::write(client, Side::Agonist, &image, |_| ()))?;
        Ok(format!("{:08x}", kept.crc))
    }

    /// Forgets the latched fault.
    fn clear(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |client| client.call_once::<ClearFault>(&()).map(drop))
    }

    /// Arms the controller.
    fn arm(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, arm)
    }

    /// Vents immediately, also during a run and from another thread, ends the run, and confirms it.
    fn vent(&self, py: Python<'_>) -> PyResult<()> {
        let vented = py.detach(|| {
            if let Some(exchange) = locked(&self.exchange).take() {
                exchange.stop.store(true, Ordering::Relaxed);
                if let Some(line) = locked(&self.vent_line).as_mut() {
                    // The run vents and confirms it at its end; this only comes first.
                    let _ = line.send();
                }
            }
            let mut talk = locked(&self.talk);
            // How the run ended does not matter: the caller ended it.
            let _ = talk.end();
            vent(talk.client()?)
        });
        vented.map(drop).map_err(raised)
    }

    /// Arms and follows a setpoint profile in a thread; `next_rows` gives its samples. The muscle is vented at the end.
    #[pyo3(signature = (quantity, profile, seconds = None, rate = None, stiffness = None, beyond = false))]
    #[allow(clippy::too_many_arguments)] // They are the options of `host run`.
    fn follow(
        &self,
        py: Python<'_>,
        quantity: &str,
        profile: &str,
        seconds: Option<f64>,
        rate: Option<f64>,
        stiffness: Option<f32>,
        beyond: bool,
    ) -> PyResult<()> {
        let quantity = match (quantity, stiffness) {
            ("force", _) => Quantity::Force,
            ("pressure", _) => Quantity::Pressure,
            ("stroke", _) => Quantity::Stroke,
            ("angle", Some(s)) if s >= 0.0 && s.is_finite() => Quantity::Angle { stiffness_nm_per_rad: s },
            ("angle", _) => return Err(wrong("an angle needs `stiffness`, N·m/rad, zero or more")),
            (other, _) => {
                return Err(wrong(format!("`{other}` is none of force, pressure, stroke and angle")));
            }
        };
        let profile = SetpointProfile::parse(profile, quantity).map_err(raised)?;
        let seconds = checked_seconds(seconds)?;
        let (every_ticks, reachability) =
            self.with(py, |client| Ok((every(client, rate)?, Reachability::of(client)?)))?;
        if let Some(reason) = reachability.and_then(|r| r.beyond(quantity, &profile)) {
            if !beyond {
                return Err(raised(
                    Error::new(DataCode::CallInvalid, reason).help("request less, or pass beyond=True"),
                ));
            }
            warn(py, &[reason])?;
        }
        let plan = Plan { quantity, profile, seconds, every_ticks };
        self.begin(py, move |client, exchange| {
            let push = |sample: &Telemetry| exchange.push(sample, true);
            run(client, &plan, push, || exchange.stop.load(Ordering::Relaxed)).map(drop)
        })
    }

    /// Watches the controller in a thread, without changing what it does; `next_rows` gives its samples.
    #[pyo3(signature = (seconds = None, rate = None))]
    fn watch(&self, py: Python<'_>, seconds: Option<f64>, rate: Option<f64>) -> PyResult<()> {
        let seconds = checked_seconds(seconds)?;
        let every_ticks = self.with(py, |client| every(client, rate))?;
        self.begin(py, move |client, exchange| {
            let take = |happened: Happened<'_>| match happened {
                Happened::Sample(sample, _) => exchange.push(sample, false),
                Happened::Event(_) => Ok(()),
            };
            watch(client, every_ticks, seconds, take, || exchange.stop.load(Ordering::Relaxed)).map(drop)
        })
    }

    /// The samples that came, waiting for one at most 0.1 s; None at the end. Raises what ended the run.
    fn next_rows(&self, py: Python<'_>) -> PyResult<Option<Vec<Row>>> {
        let taken = py.detach(|| {
            let Some(exchange) = locked(&self.exchange).clone() else { return Ok(None) };
            let empty = |queue: &mut Queue| queue.rows.is_empty() && !queue.done;
            let (mut queue, _) = exchange
                .news
                .wait_timeout_while(exchange.lock(), Duration::from_millis(100), empty)
                .unwrap_or_else(PoisonError::into_inner);
            queue.waiting = None;
            let rows: Vec<Row> = queue.rows.drain(..).collect();
            if !queue.done || !rows.is_empty() {
                return Ok(Some(rows));
            }
            drop(queue);
            self.halt().map(|()| None)
        });
        taken.map_err(raised)
    }

    /// Ends the run or recording in progress; a run vents.
    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.halt()).map_err(raised)
    }

    /// Ends a run or recording in progress, vents if this session armed the controller, and closes the port.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let ended = py.detach(|| {
            let halted = self.halt();
            *locked(&self.vent_line) = None;
            let Some(mut client) = locked(&self.talk).client.take() else { return halted };
            if client.controls() {
                vent(&mut client)?;
            }
            halted
        });
        ended.map_err(raised)
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Nothing is left that could take an error.
        let _ = self.halt();
        if let Some(client) = locked(&self.talk).client.as_mut().filter(|client| client.controls()) {
            let _ = vent(client);
        }
    }
}
