//! A controller over its link as the actuation of a campaign.

use std::cell::{Cell, RefCell};

use model_core::link::messages::Telemetry;
use pam_data::error::Result;
use pam_device::Client;
use pam_device::run::{Plan, run_asking};
use pam_device::setpoint_profile::{Quantity, SetpointProfile};
use pam_fit::checks;

use crate::actuation::{Actuation, Ending, Reading};
use crate::criteria::SAMPLE_HZ;
use crate::step_profile::{Segment, StepProfile, duration};
use crate::stroke_axis::StrokeAxis;

/// Telemetry in a second of device time: twice the recording's rate, so that a stroke ends soon after the muscle is free.
const TELEMETRY_HZ: f64 = 2.0 * SAMPLE_HZ;
/// Ticks of a controller in a second.
const TICKS_HZ: f64 = 1000.0;
/// Time in which an axis comes to rest after its way, s.
const AXIS_RESTS_S: f64 = 0.1;
/// Time in which the axis returns to rest length, s.
const RETURN_S: f64 = 5.0;

/// Makes the table of a check at a force (N), a pressure (Pa) and a clock (s); `None` where it cannot be made.
pub type MakeCheck = Box<dyn FnMut(checks::Kind, f64, f64, f64) -> Result<Option<String>>>;

/// A controller, what moves the free end, and who makes checks of the bench.
pub struct Controller {
    client: Client,
    axis: Box<dyn StrokeAxis>,
    checks: MakeCheck,
    /// Clock of the campaign less the time of the device; unknown until the device has sent its time.
    ahead: Option<f64>,
    /// Clock of the last reading.
    clock: f64,
}

impl std::fmt::Debug for Controller {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Controller").field("client", &self.client).finish_non_exhaustive()
    }
}

impl Controller {
    /// A connected controller.
    #[must_use]
    pub fn new(client: Client, axis: Box<dyn StrokeAxis>, checks: MakeCheck) -> Self {
        Self { client, axis, checks, ahead: None, clock: 0.0 }
    }

    /// The conversation with it.
    pub fn client(&mut self) -> &mut Client {
        &mut self.client
    }
}

/// Where a profile stands.
struct Player<'a> {
    profile: &'a StepProfile,
    at: usize,
    begun: f64,
    /// Pressure and stroke at the beginning of the segment.
    from: (f64, f64),
    command: f64,
    started: bool,
}

/// What the last reading showed.
#[derive(Clone, Copy, Default)]
struct Shown {
    stroke: f64,
    /// Mean of the last readings of the force, N.
    force: f64,
}

impl<'a> Player<'a> {
    fn new(profile: &'a StepProfile) -> Self {
        Self { profile, at: 0, begun: 0.0, from: (0.0, 0.0), command: 0.0, started: false }
    }

    fn finished(&self) -> bool {
        self.at >= self.profile.segments.len()
    }

    fn recorded(&self) -> bool {
        self.profile.segments.get(self.at).is_some_and(|s| s.1)
    }

    /// Advances to a time; returns the pressure to command.
    fn advance(&mut self, elapsed: f64, shown: Shown, axis: &mut dyn StrokeAxis) -> Result<f64> {
        while let Some((segment, _)) = self.profile.segments.get(self.at) {
            if !self.started {
                self.started = true;
                self.from = (self.command, shown.stroke);
                match *segment {
                    Segment::Travel { to, speed, .. } => axis.go(to, speed)?,
                    Segment::Vented { .. } => axis.go(0.0, (shown.stroke.abs() / RETURN_S).max(1e-4))?,
                    _ => {}
                }
            }
            let since = elapsed - self.begun;
            let mut whole = duration(segment, self.from.0, self.from.1);
            let mut done = false;
            match *segment {
                Segment::Travel { until_force, .. } => {
                    whole += AXIS_RESTS_S;
                    let free = until_force.is_some_and(|least| shown.force <= least);
                    if free && shown.stroke > 0.0 && since > AXIS_RESTS_S && axis.moves() {
                        axis.stop()?;
                        done = true;
                    }
                    done |= !axis.moves();
                }
                Segment::Ramp { to, rate } => {
                    let way = (to - self.from.0).clamp(-rate * since, rate * since);
                    self.command = self.from.0 + way;
                }
                Segment::Hold { .. } => {}
                Segment::Vented { .. } => {
                    self.command = 0.0;
                    whole += if self.from.1.abs() > 1e-5 && axis.moves() { RETURN_S } else { 0.0 };
                }
            }
            if !done && since < whole {
                return Ok(self.command);
            }
            if let Segment::Ramp { to, .. } = *segment {
                self.command = to;
            }
            self.at += 1;
            self.begun = elapsed;
            self.started = false;
        }
        Ok(self.command)
    }
}

impl Actuation for Controller {
    fn clock(&self) -> f64 {
        self.clock
    }

    fn set_clock(&mut self, seconds: f64) {
        // The next reading comes at this time. The device's own clock may show any other.
        (self.clock, self.ahead) = (seconds, None);
    }

    fn perform(
        &mut self,
        profile: &StepProfile,
        each: &mut dyn FnMut(&Reading) -> Result<bool>,
    ) -> Result<Ending> {
        let held = profile.segments.iter().find_map(|(s, _)| match s {
            Segment::Travel { to, .. } if *to > 0.0 => Some(*to),
            _ => None,
        });
        if !self.axis.prepare(held.unwrap_or(0.0))? {
            return Ok(Ending::Ended);
        }
        let every = (TICKS_HZ / TELEMETRY_HZ) as u16;
        let plan = Plan {
            quantity: Quantity::Pressure,
            profile: SetpointProfile::Constant(0.0),
            seconds: None,
            every_ticks: every,
        };
        let player = RefCell::new(Player::new(profile));
        let shown = Cell::new(Shown::default());
        let (ended, failed) = (Cell::new(false), RefCell::new(None));
        let (ahead, clock) = (Cell::new(self.ahead), Cell::new(self.clock));
        let mut forces = [0.0; 4];
        let mut count = 0_usize;
        let axis = &mut self.axis;
        let outcome = run_asking(
            &mut self.client,
            &plan,
            |sample: &Telemetry| {
                let Some(side) = sample.sides.first() else { return Ok(()) };
                forces[count % forces.len()] = f64::from(side.force_n);
                count += 1;
                let known = count.min(forces.len());
                let force = forces[..known].iter().sum::<f64>() / known as f64;
                shown.set(Shown { stroke: f64::from(side.stroke_m), force });
                let device = sample.time_us as f64 * 1e-6;
                let ahead = ahead.get().unwrap_or_else(|| {
                    let ahead_now = clock.get() - device;
                    ahead.set(Some(ahead_now));
                    ahead_now
                });
                clock.set(device + ahead);
                // Every second sample is a row: the recording's rate is half the telemetry's.
                let recorded = player.borrow().recorded() && count.is_multiple_of(2);
                let reading = Reading {
                    time: clock.get(),
                    pressure: f64::from(side.pressure_pa),
                    command: player.borrow().command,
                    stroke: f64::from(side.stroke_m),
                    force: f64::from(side.force_n),
                    recorded,
                };
                if !each(&reading)? {
                    ended.set(true);
                }
                Ok(())
            },
            || ended.get() || failed.borrow().is_some() || player.borrow().finished(),
            |elapsed| match player.borrow_mut().advance(elapsed, shown.get(), axis.as_mut()) {
                // Every time: a controller that is emulated faster than real time must receive messages from its host as often.
                Ok(command) => Some(command as f32),
                Err(e) => {
                    *failed.borrow_mut() = Some(e);
                    None
                }
            },
        );
        (self.ahead, self.clock) = (ahead.get(), clock.get());
        // The muscle is vented; the free end moves back after failures, too.
        let back = self.axis.rest();
        // An axis that fails is the cause of what the controller then reports, such as a host that was silent meanwhile.
        if let Some(error) = failed.into_inner() {
            return Err(error);
        }
        outcome?;
        back?;
        Ok(if ended.get() { Ending::Ended } else { Ending::Whole })
    }

    fn check(&mut self, check: checks::Kind, force: f64, pressure: f64) -> Result<Option<String>> {
        let clock = self.clock();
        let table = (self.checks)(check, force, pressure, clock)?;
        if table.is_some() {
            let seconds = crate::step::check_seconds(check);
            self.clock += seconds;
            self.ahead = self.ahead.map(|ahead| ahead + seconds);
        }
        Ok(table)
    }

    fn compute(&mut self, computing: bool) {
        self.axis.compute(computing);
    }
}
