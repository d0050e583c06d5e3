//! The control step: readings and what was asked for, to commands. One pure function of its state, each millisecond.
//!
//! ```text
//! set-point ─► mode ─► wanted force ─► inverse of the table ─► + trim ─► limits, slew ─► regulator ─► command
//!                          ▲                  ▲                   ▲
//!                       stroke            stroke, direction    load cell
//! ```
//! Watches look at every tick before the command is made, so a fault changes the command of the tick it is noticed in.

use model_core::link::messages::{
    Event, Fault, FaultReport, Field, Mode, Reference, Refusal, SetPoint, Side, State, Telemetry,
};
use model_core::link::settings::{FeedForward, Reaction, Settings};
use model_core::motion::{MotionSettings, MotionTracker};
use model_core::single;
use model_core::table::{MuscleTable, TableError};

use crate::board::{Command, Inputs, Outputs, Readings};
use crate::modes::{Model, Seat};
use crate::pair::{self, Arm, PairState};
use crate::reference::Generator;
use crate::regulator;
use crate::safety::{self, Cause, Machine};
use crate::tick::{TICK_S, TICK_US};
use crate::trace::Trace;
use crate::watch::{Finding, SideWatch};

mod actuator;
mod check;
mod drive;
mod look_out;
mod record;

pub use check::check_settings;

use actuator::Actuator;

fn motion_settings(settings: &Settings) -> MotionSettings<f32> {
    MotionSettings {
        stroke_threshold: settings.motion_band_m,
        pressure_threshold: settings.pressure_band_pa,
        ..MotionSettings::default()
    }
}

/// The whole controller but for its board, its link and its store.
#[derive(Debug)]
pub struct Controller {
    settings: Settings,
    machine: Machine,
    mode: Mode,
    generator: Generator,
    asked: f32,
    asked_second: f32,
    /// What will be asked when a command of this tick has come to act, as far as it is known, and how it came there in this tick.
    coming: f32,
    coming_step: f32,
    asked_age: u32,
    /// Ticks since a host's last frame.
    host_age: u32,
    sides: [Actuator; 2],
    pair: PairState,
    tick: u64,
    overruns: u32,
    missed_in_a_row: u16,
    saturated_ticks: u32,
    telemetry_every: u16,
    telemetry_countdown: u16,
    telemetry_number: u16,
    trace: Trace,
    /// A finding of the last tick: what would stand in the way of clearing.
    present: Option<Fault>,
    event: Option<Event>,
    step_us: f32,
}

/// What one step gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Stepped {
    /// Commands to the regulators.
    pub outputs: Outputs,
    /// A sample that is due, with its number.
    pub telemetry: Option<(u16, Telemetry)>,
    /// Something to tell the host.
    pub event: Option<Event>,
}

impl Controller {
    /// As after power-up: disarmed, vented, without tables; for two muscles.
    pub fn new(settings: Settings) -> Self {
        Self::seated(settings, Seat::pair())
    }

    /// The same with places for the tables of the muscles that a board drives.
    pub fn seated(settings: Settings, seats: [Seat; 2]) -> Self {
        Self {
            machine: Machine::default(),
            mode: Mode::Vent,
            generator: Generator::default(),
            asked: 0.0,
            asked_second: 0.0,
            coming: 0.0,
            coming_step: 0.0,
            asked_age: 0,
            host_age: 0,
            sides: seats.map(|seat| Actuator::new(&settings, seat)),
            settings,
            pair: PairState::default(),
            tick: 0,
            overruns: 0,
            missed_in_a_row: 0,
            saturated_ticks: 0,
            telemetry_every: 0,
            telemetry_countdown: 0,
            telemetry_number: 0,
            trace: Trace::default(),
            present: None,
            event: None,
            step_us: 0.0,
        }
    }

    /// State of safety.
    pub fn state(&self) -> State {
        self.machine.state()
    }

    /// States and faults.
    pub fn machine(&mut self) -> &mut Machine {
        &mut self.machine
    }

    /// Latch and counts.
    pub fn faults(&self) -> &model_core::link::messages::Faults {
        self.machine.faults()
    }

    /// Mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Ticks since the start.
    pub fn ticks(&self) -> u64 {
        self.tick
    }

    /// Device time, µs.
    pub fn time_us(&self) -> u64 {
        self.tick * TICK_US
    }

    /// Ticks that were missed.
    pub fn overruns(&self) -> u32 {
        self.overruns
    }

    /// Ticks in which a wish was out of reach.
    pub fn saturated_ticks(&self) -> u32 {
        self.saturated_ticks
    }

    /// The trace.
    pub fn trace(&mut self) -> &mut Trace {
        &mut self.trace
    }

    /// The generator.
    pub fn generator(&mut self) -> &mut Generator {
        &mut self.generator
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Uses other settings, which must have passed [`check_settings`].
    pub fn use_settings(&mut self, settings: Settings) {
        self.settings = settings;
        for side in &mut self.sides {
            side.motion = MotionTracker::new(motion_settings(&settings));
            side.watch = SideWatch::default();
        }
    }

    /// A muscle's table in use.
    pub fn model(&self, side: Side) -> Option<&Model> {
        self.sides[side.index()].model.as_ref()
    }

    /// The same, to put memories back.
    pub fn model_mut(&mut self, side: Side) -> Option<&mut Model> {
        self.sides[side.index()].model.as_mut()
    }

    /// Uses another table from now on.
    ///
    /// # Errors
    /// The number of the table that cannot be used; there is none in use then.
    pub fn use_table(&mut self, side: Side, table: &MuscleTable) -> Result<(), TableError> {
        self.sides[side.index()].model.fill(table)
    }

    /// Uses no table.
    pub fn forget_table(&mut self, side: Side) {
        self.sides[side.index()].model.clear();
    }

    /// A whole frame of a host has come.
    pub fn heard(&mut self) {
        self.host_age = 0;
    }

    /// One telemetry sample every so many ticks, 0 for none.
    pub fn set_telemetry(&mut self, every_ticks: u16) {
        self.telemetry_every = every_ticks;
        self.telemetry_countdown = 0;
    }

    fn uses(&self, side: Side) -> bool {
        side == Side::Agonist || self.mode == Mode::Pair
    }

    /// Arms.
    ///
    /// # Errors
    /// As [`Machine::request`].
    pub fn arm(&mut self) -> Result<(), Refusal> {
        self.change(Cause::Arm)?;
        for side in &mut self.sides {
            side.watch = SideWatch::default();
        }
        Ok(())
    }

    fn change(&mut self, cause: Cause) -> Result<(), Refusal> {
        let before = self.machine.state();
        let state = self.machine.request(cause)?;
        if state != before {
            self.event = Some(Event::State(state));
        }
        if state != State::Running {
            self.mode = Mode::Vent;
            self.generator.begin(Reference::SetPoint)?;
        }
        Ok(())
    }

    /// Starts a mode at what is measured now.
    ///
    /// # Errors
    /// As [`Machine::request`]; [`Refusal::NoTable`], with the fault latched, where the mode needs a table.
    pub fn start(&mut self, mode: Mode) -> Result<(), Refusal> {
        self.machine.allows(Cause::Start)?;
        let needs: &[Side] = match mode {
            Mode::Vent | Mode::Pressure => &[],
            Mode::Force if self.settings.feed_forward == FeedForward::Off => &[],
            Mode::Force | Mode::Stroke => &[Side::Agonist],
            Mode::Pair => &Side::ALL,
        };
        if let Some(side) = needs.iter().copied().find(|side| self.model(*side).is_none()) {
            let none = Finding { fault: Fault::TableMissing, sensor: None, value: 0.0, limit: 1.0 };
            self.raise(side, &none);
            return Err(Refusal::NoTable(side));
        }
        self.change(Cause::Start)?;
        self.mode = mode;
        self.generator.begin(Reference::SetPoint)?;
        let first = self.sides[0].sample;
        let joint = self.settings.joint;
        self.asked_second = 0.0;
        self.asked = match mode {
            Mode::Vent => 0.0,
            Mode::Pressure => first.pressure_pa.max(0.0),
            Mode::Force => first.force_n.max(0.0),
            Mode::Stroke => first.stroke_m,
            Mode::Pair => (first.stroke_m - self.sides[1].sample.stroke_m) / (2.0 * joint.radius_m),
        };
        self.asked_age = 0;
        for side in &mut self.sides {
            side.regulator.begin(side.sample.pressure_pa);
            side.trim.reset();
            side.stroke_loop.reset();
            side.guess_pa = side.sample.pressure_pa;
            side.cut = 0.0;
            side.watch = SideWatch::default();
        }
        if mode == Mode::Pair
            && let Some(arms) = self.arms()
        {
            let mut pair = self.pair;
            pair.begin(arms);
            self.pair = pair;
        }
        self.trace.on_start();
        Ok(())
    }

    /// Vents, and stays ready.
    ///
    /// # Errors
    /// As [`Machine::request`].
    pub fn stop(&mut self) -> Result<(), Refusal> {
        self.vent_now();
        self.change(Cause::Stop)
    }

    /// Vents, and is no longer ready.
    ///
    /// # Errors
    /// As [`Machine::request`].
    pub fn disarm(&mut self) -> Result<(), Refusal> {
        self.vent_now();
        self.change(Cause::Disarm)
    }

    fn vent_now(&mut self) {
        // In `Fault` with a held command this is the way to let go of it.
        for side in &mut self.sides {
            side.command = Command { pressure_pa: 0.0, vent: true };
        }
    }

    /// Forgets the latched fault.
    ///
    /// # Errors
    /// [`Refusal::StillFaulty`] while what caused a fault is still there.
    pub fn clear(&mut self) -> Result<(), Refusal> {
        if self.machine.state() == State::Fault
            && let Some(fault) = self.present
        {
            return Err(Refusal::StillFaulty(fault));
        }
        self.vent_now();
        self.change(Cause::Clear)
    }

    /// A new set-point; ends a reference.
    ///
    /// # Errors
    /// [`Refusal::WrongMode`] where it is not the running mode's, [`Refusal::Value`] where it is no finite number,
    /// [`Refusal::Angle`] or [`Refusal::Stiffness`] where a joint cannot have it.
    pub fn set_point(&mut self, set_point: SetPoint) -> Result<(), Refusal> {
        let (mode, asked, second) = match set_point {
            SetPoint::Pressure(pascals) => (Mode::Pressure, pascals, 0.0),
            SetPoint::Force(newtons) => (Mode::Force, newtons, 0.0),
            SetPoint::Stroke(metres) => (Mode::Stroke, metres, 0.0),
            SetPoint::Pair { angle_rad, stiffness_nm_per_rad } => {
                (Mode::Pair, angle_rad, stiffness_nm_per_rad)
            }
        };
        self.running()?;
        if mode != self.mode {
            return Err(Refusal::WrongMode(self.mode));
        }
        if !(asked.is_finite() && second.is_finite()) || second < 0.0 {
            return Err(Refusal::Value(Field::SetPoint));
        }
        if mode == Mode::Pair {
            self.can_pose(asked, second)?;
        }
        self.generator.begin(Reference::SetPoint)?;
        (self.asked, self.asked_second) = (asked, second);
        self.asked_age = 0;
        Ok(())
    }

    /// Both muscles of a joint, if both have tables.
    fn arms(&self) -> Option<[Arm<'_>; 2]> {
        if !pair::SUPPORTED {
            return None;
        }
        let [first, second] = &self.sides;
        Some([self.arm_of(first)?, self.arm_of(second)?])
    }

    fn arm_of<'a>(&self, side: &'a Actuator) -> Option<Arm<'a>> {
        let model = side.model.as_ref()?;
        let Settings { regulator, limits, .. } = &self.settings;
        let reached_pa = regulator.gain * (regulator.command_max_pa + regulator.offset_pa);
        let high_pa = model.muscle.max_pressure().pascals().min(limits.pressure_pa).min(reached_pa);
        Some(Arm { model, pressure_pa: side.guess_pa, high_pa })
    }

    /// Whether a joint can have an angle and a stiffness.
    fn can_pose(&self, angle_rad: f32, stiffness_nm_per_rad: f32) -> Result<(), Refusal> {
        let arms = self.arms().ok_or(Refusal::WrongMode(self.mode))?;
        pair::check(&self.settings.joint, arms, angle_rad, stiffness_nm_per_rad)
    }

    /// A wave of the device's own.
    ///
    /// # Errors
    /// As [`Generator::begin`]; [`Refusal::WrongMode`] while venting; [`Refusal::Angle`] or [`Refusal::Stiffness`] where a joint
    /// cannot have an end of the wave.
    pub fn reference(&mut self, reference: Reference) -> Result<(), Refusal> {
        self.running()?;
        if self.mode == Mode::Vent {
            return Err(Refusal::WrongMode(Mode::Vent));
        }
        if self.mode == Mode::Pair {
            let (low, high) = self.generator.range(reference);
            self.can_pose(low, self.asked_second)?;
            self.can_pose(high, self.asked_second)?;
        }
        self.generator.begin(reference)?;
        // Here, so that no tick has all of it to do.
        self.generator.look_ahead(regulator::ahead(&self.settings.regulator));
        self.asked_age = 0;
        self.trace.on_start();
        Ok(())
    }

    fn running(&self) -> Result<(), Refusal> {
        match (self.machine.state(), self.machine.latched()) {
            (State::Running, _) => Ok(()),
            (_, Some(fault)) => Err(Refusal::Latched(fault)),
            (state, None) => Err(Refusal::WrongState(state)),
        }
    }

    /// Latches a fault.
    pub fn raise(&mut self, side: Side, finding: &Finding) {
        let report = FaultReport {
            fault: finding.fault,
            side,
            sensor: finding.sensor,
            from: self.machine.state(),
            mode: self.mode,
            time_us: self.time_us(),
            value: finding.value,
            limit: finding.limit,
            last: self.sides[side.index()].sample,
        };
        if !self.machine.fault(report) {
            return;
        }
        self.event = Some(Event::Fault(report));
        self.trace.on_fault();
        if safety::reaction(finding.fault, self.settings.hold_on) == Reaction::Vent {
            self.vent_now();
        }
        // A fault of a start that never ran leaves nothing pressurised.
        if report.from != State::Running {
            self.vent_now();
        }
    }

    /// One millisecond.
    pub fn step(&mut self, inputs: &Inputs) -> Stepped {
        self.tick += 1;
        self.step_us = inputs.step_us;
        for side in Side::ALL {
            let model_n = self.look(side, inputs);
            self.sides[side.index()].model_n = model_n;
        }
        let finding = self.watch(inputs);
        self.present = finding.map(|(_, finding)| finding.fault);
        if let Some((side, finding)) = finding {
            let state = self.machine.state();
            let watched = match state {
                State::Running => true,
                State::Armed => safety::rule_of(finding.fault).while_armed,
                State::Disarmed | State::Fault => false,
            };
            if watched {
                self.raise(side, &finding);
            }
        }
        if self.machine.state() == State::Running {
            self.ask();
            self.drive();
        } else {
            self.rest();
        }
        self.record()
    }

    /// Brings what is asked to this tick. A wave of the device's own is known ahead of its time, a host's set-points are not.
    fn ask(&mut self) {
        match self.generator.step_ahead(regulator::ahead(&self.settings.regulator)) {
            Some((now, coming)) => {
                self.asked = now;
                self.coming_step = coming - self.coming;
                self.coming = coming;
            }
            None => (self.coming, self.coming_step) = (self.asked, 0.0),
        }
    }

    /// Takes one muscle's readings; the force that its table gives at them.
    fn look(&mut self, side: Side, inputs: &Inputs) -> Option<f32> {
        let actuator = &mut self.sides[side.index()];
        let Readings { pressure_pa, stroke_m, force_n } = inputs.sides[side.index()]?;
        actuator.sample.pressure_pa = pressure_pa;
        actuator.sample.stroke_m = stroke_m;
        actuator.sample.force_n = force_n;
        actuator.sample.model_n = 0.0;
        // A reading that is no number must not get into what is remembered.
        if !(pressure_pa.is_finite() && stroke_m.is_finite()) {
            return None;
        }
        let motion = single::follow(&mut actuator.motion, TICK_S, stroke_m, pressure_pa);
        let model_n = actuator.model.as_mut()?.tick(motion, pressure_pa);
        actuator.sample.model_n = model_n;
        Some(model_n)
    }
}
