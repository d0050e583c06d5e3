//! A run: start, follow a setpoint profile, pass on every sample, and leave the muscle vented in all cases.

use std::time::{Duration, Instant};

use model_core::link::Endpoint;
use model_core::link::endpoints::{
    Arm, Disarm, GetFaults, GetSettings, GetStatus, SetReferencePoints, StartMode, Stop,
};
use model_core::link::messages::{
    Event, Fault, REFERENCE_PIECE, Reference, ReferencePoints, Refusal, Start, State, Status, Telemetry,
};

use super::setpoint_profile::{Quantity, SetpointProfile};
use super::{Client, Subscription, Topic, messages};
use crate::error::DeviceCode;
use pam_data::error::{DataCode, Error, Result};

/// What a run is.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What is controlled.
    pub quantity: Quantity,
    /// The setpoint over time.
    pub profile: SetpointProfile,
    /// Device time from the start until the end, s; `None` until `stop` says so.
    pub seconds: Option<f64>,
    /// One sample every n ticks.
    pub every_ticks: u16,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The time elapsed.
    Done,
    /// `stop` reported it.
    Stopped,
}

/// Silence of the telemetry after which the device counts as gone.
const SILENCE: Duration = Duration::from_secs(5);

/// Another session may arm a device whose owner has sent no keep-alive request for `watch.host_silence_ticks`; this margin is added.
const OWNER_MARGIN: Duration = Duration::from_millis(500);

/// How long arming may take: the air of the run before leaves in two seconds, the test of the dump valve takes as long at most.
const ARMING: Duration = Duration::from_secs(8);

/// Vents and disarms: allowed in every state, repeated until it is confirmed.
///
/// # Errors
/// When the device does not answer; then it must be vented by hand.
pub fn vent(client: &mut Client) -> Result<Status> {
    let stopped = client.try_call::<Stop>(&());
    let disarmed = client.try_call::<Disarm>(&());
    match disarmed.and(stopped) {
        Ok(_) => client.call::<GetStatus>(&()),
        Err(e) => Err(Error::new(e.code(), format!("the device may not have vented: {}", e.cause()))
            .help("shut off the air supply of the muscle by hand")),
    }
}

/// Vents and disarms for a program that ends, unless another session owns the device: what that has started is its own to end.
///
/// # Errors
/// As [`vent`].
pub fn release(client: &mut Client) -> Result<Status> {
    // A device that does not answer may be this session's.
    if !client.controls() && client.is_owned_by_another().unwrap_or(false) {
        return client.call::<GetStatus>(&());
    }
    vent(client)
}

/// Carries out a plan. `sample` is handed every sample from the start on; `stop` is queried between samples.
///
/// Regardless of the outcome, the device is vented and disarmed at the end, unless another session has taken it over, and its telemetry
/// is left as it was.
///
/// # Errors
/// Refusals, silence, the fault that stopped the device as text, or what `sample` returns.
pub fn run(
    client: &mut Client,
    plan: &Plan,
    sample: impl FnMut(&Telemetry) -> Result<()>,
    stop: impl Fn() -> bool,
) -> Result<Ending> {
    run_asking(client, plan, sample, stop, |_| None)
}

/// The same; `next` is queried after each sample, with the time since the start in s, whether another value is demanded from
/// now on.
///
/// # Errors
/// As [`run`].
pub fn run_asking(
    client: &mut Client,
    plan: &Plan,
    sample: impl FnMut(&Telemetry) -> Result<()>,
    stop: impl Fn() -> bool,
    next: impl FnMut(f64) -> Option<f32>,
) -> Result<Ending> {
    // What belongs to another program is neither vented nor made silent.
    claim(client)?;
    let mut subscription = None;
    let outcome = follow(client, plan, &mut subscription, sample, stop, next);
    let taken_over = outcome.as_ref().is_err_and(|error| error.code() == DeviceCode::DeviceInUse);
    let vented = if taken_over { Ok(()) } else { vent(client).map(drop) };
    let quiet = subscription.map_or(Ok(()), |subscription| subscription.end(client));
    let ending = outcome?;
    vented?;
    quiet?;
    Ok(ending)
}

/// Arms, once the last run's air has left the muscle, and waits for the device's own test of its dump valve. Where another session has
/// armed the device, waits until that has been silent for long enough to have ended.
///
/// # Errors
/// As the device refuses, or the fault that the test ended in.
pub fn arm(client: &mut Client) -> Result<()> {
    let mut deadline = Instant::now() + ARMING;
    let mut silent = None;
    let empty = Refusal::StillFaulty(Fault::NotVented);
    loop {
        let now = match client.try_call::<Arm>(&client.session())? {
            Ok(status) => status.state,
            Err(refusal) if refusal == empty && Instant::now() < deadline => State::Disarmed,
            Err(Refusal::OtherSession) if Instant::now() < owner_ends(client, &mut silent)? => {
                std::thread::sleep(Duration::from_millis(20));
                deadline = Instant::now() + ARMING;
                continue;
            }
            Err(refusal) => return Err(messages::refused(Arm::NAME, refusal)),
        };
        match now {
            State::Armed | State::Running => return Ok(()),
            State::Fault => return Err(fault(client)?),
            State::Disarmed if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(20)),
            State::Disarmed => {
                return Err(Error::new(DeviceCode::DeviceSilent, "the test of the dump valve does not end")
                    .help("look at `host device info`"));
            }
        }
    }
}

/// When an owner that is silent from now on gives up the device, by its settings.
fn owner_ends(client: &mut Client, known: &mut Option<Instant>) -> Result<Instant> {
    if let Some(end) = *known {
        return Ok(end);
    }
    let ticks = client.call::<GetSettings>(&())?.watch.host_silence_ticks;
    // A tick is a millisecond.
    Ok(*known.insert(Instant::now() + Duration::from_millis(ticks.into()) + OWNER_MARGIN))
}

/// Makes the device this session's, armed.
fn claim(client: &mut Client) -> Result<()> {
    let status = client.call::<GetStatus>(&())?;
    match status.state {
        State::Fault => return Err(fault(client)?),
        State::Running if !client.controls() => return Err(messages::in_use(StartMode::NAME)),
        State::Running => {
            client.call::<Stop>(&())?;
        }
        State::Disarmed | State::Armed => {}
    }
    arm(client)
}

fn follow(
    client: &mut Client,
    plan: &Plan,
    subscription: &mut Option<Subscription>,
    mut sample: impl FnMut(&Telemetry) -> Result<()>,
    stop: impl Fn() -> bool,
    mut next: impl FnMut(f64) -> Option<f32>,
) -> Result<Ending> {
    let status = client.call::<GetStatus>(&())?;
    if let SetpointProfile::Points { values, .. } = &plan.profile {
        send_points(client, values)?;
    }
    let stream = subscription.insert(Subscription::begin(client, plan.every_ticks)?);
    let silence = stream.silence(SILENCE);
    let started =
        client.call::<StartMode>(&Start { mode: plan.quantity.mode(), session: client.session() })?;
    let mut steps = Steps::begin(client, plan)?;
    let mut begun = None;
    let mut last_received = Instant::now();
    let mut waits_since = last_received;
    loop {
        if stop() {
            return Ok(Ending::Stopped);
        }
        client.keep_alive()?;
        match client.topic(Duration::from_millis(50))? {
            Some(Topic::Telemetry(s)) => {
                last_received = Instant::now();
                // Samples from before the start may still be on the line, those of an earlier run too.
                let early = s.state != State::Running || s.time_us <= status.time_us;
                if early && begun.is_none() {
                    stream.mark_alive();
                    // One from after the start: something else has ended the run. So it has where no sample of the run comes, as after
                    // a restart, whose clock begins again.
                    let ended = s.state != State::Running && s.time_us > started.time_us;
                    if ended || waits_since.elapsed() > silence {
                        still_runs(client)?;
                        waits_since = Instant::now();
                    }
                    continue;
                }
                let start = *begun.get_or_insert(s.time_us);
                let elapsed = s.time_us.saturating_sub(start) as f64 * 1e-6;
                if plan.seconds.is_some_and(|end| elapsed >= end) {
                    return Ok(Ending::Done);
                }
                if stream.takes(client, &s) {
                    sample(&s)?;
                }
                match s.state {
                    State::Running => {}
                    State::Fault => return Err(fault(client)?),
                    State::Armed | State::Disarmed => return Err(ended_by_another()),
                }
                steps.advance(client, plan.quantity, elapsed)?;
                if let Some(value) = next(elapsed) {
                    client.set_point(plan.quantity.set_point(value))?;
                }
            }
            // One from before the start, which was cleared since, may still be in the queue.
            Some(Topic::Event(Event::Fault(report))) if report.time_us >= status.time_us => {
                return Err(messages::stopped(&report));
            }
            Some(Topic::Event(_) | Topic::Log(_)) => {}
            None if last_received.elapsed() > silence => {
                let status = client.call::<GetStatus>(&())?;
                if status.state == State::Fault {
                    return Err(fault(client)?);
                }
                return Err(Error::new(
                    DeviceCode::DeviceSilent,
                    format!("the device answers, but sends no telemetry; it is {}", messages::state(status.state)),
                )
                .help("its control loop may be waiting for sensors: `host device info` shows whether ticks advance"));
            }
            None => stream.renew(client)?,
        }
    }
}

/// Whether the device runs.
fn still_runs(client: &mut Client) -> Result<()> {
    match client.call::<GetStatus>(&())?.state {
        State::Running => Ok(()),
        State::Fault => Err(fault(client)?),
        State::Armed | State::Disarmed => Err(ended_by_another()),
    }
}

/// The error where the device no longer runs, without a fault and without this program's doing.
fn ended_by_another() -> Error {
    Error::new(DeviceCode::DeviceRefused, "another program has vented the controller during the run")
        .help("start the run again when the muscle may move")
}

/// The fault that holds a device, as an error.
fn fault(client: &mut Client) -> Result<Error> {
    let faults = client.call::<GetFaults>(&())?;
    Ok(match faults.latched {
        Some(report) => messages::stopped(&report),
        None => {
            Error::new(DeviceCode::DeviceFault, "the device is stopped by a fault that it no longer reports")
                .help("clear it with `host device faults --clear`")
        }
    })
}

fn send_points(client: &mut Client, values: &[f32]) -> Result<()> {
    for (piece, points) in values.chunks(REFERENCE_PIECE).enumerate() {
        let offset = u16::try_from(piece * REFERENCE_PIECE).map_err(|_| too_long())?;
        let points = heapless::Vec::from_slice(points).map_err(|_| too_long())?;
        client.call::<SetReferencePoints>(&ReferencePoints { offset, points, session: client.session() })?;
    }
    Ok(())
}

fn too_long() -> Error {
    Error::new(DataCode::CallInvalid, "the setpoint profile has more points than the device holds")
        .help("use fewer points")
}

/// The first value of a profile.
fn begins_at(profile: &SetpointProfile) -> f32 {
    match profile {
        SetpointProfile::Constant(value) => *value,
        SetpointProfile::Steps { values, .. } | SetpointProfile::Points { values, .. } => {
            values.first().copied().unwrap_or(0.0)
        }
        SetpointProfile::Wave(wave) => match *wave {
            Reference::Sine { mean, .. } | Reference::Chirp { mean, .. } => mean,
            Reference::Trapezoid { low, .. } => low,
            Reference::SetPoint | Reference::Table { .. } => 0.0,
        },
    }
}

/// Steps that the host sends at their times.
#[derive(Debug)]
pub struct Steps {
    values: Vec<f32>,
    hold_s: f64,
    sent: usize,
}

impl Steps {
    /// Sends what the profile needs at its start.
    ///
    /// # Errors
    /// What the device refuses, or silence.
    pub fn begin(client: &mut Client, plan: &Plan) -> Result<Self> {
        if let (Quantity::Angle { .. }, SetpointProfile::Wave(_) | SetpointProfile::Points { .. }) =
            (plan.quantity, &plan.profile)
        {
            // A wave has one value; the stiffness is the last setpoint's.
            let angle = begins_at(&plan.profile);
            client.set_point(plan.quantity.set_point(angle))?;
        }
        let (values, hold_s) = match &plan.profile {
            SetpointProfile::Constant(value) => (vec![*value], f64::INFINITY),
            SetpointProfile::Steps { values, hold_s } => (values.clone(), *hold_s),
            SetpointProfile::Wave(reference) => {
                client.reference(*reference)?;
                (Vec::new(), f64::INFINITY)
            }
            SetpointProfile::Points { step_s, .. } => {
                client.reference(Reference::Table { step_s: *step_s, repeat: true })?;
                (Vec::new(), f64::INFINITY)
            }
        };
        if let Some(first) = values.first() {
            client.set_point(plan.quantity.set_point(*first))?;
        }
        Ok(Self { values, hold_s, sent: 0 })
    }

    /// Sends the step that is due after `elapsed` seconds.
    ///
    /// # Errors
    /// What the device refuses, or silence.
    pub fn advance(&mut self, client: &mut Client, quantity: Quantity, elapsed: f64) -> Result<()> {
        let due = (elapsed / self.hold_s) as usize;
        if due > self.sent && !self.values.is_empty() {
            self.sent = due;
            client.set_point(quantity.set_point(self.values[due % self.values.len()]))?;
        }
        Ok(())
    }
}
