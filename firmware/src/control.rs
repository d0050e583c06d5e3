//! The control step: readings and what was asked for, to commands. One pure function of its state, each millisecond.
//!
//! ```text
//! set-point ─► mode ─► wanted force ─► inverse of the table ─► + trim ─► limits, slew ─► regulator ─► command
//!                          ▲                  ▲                   ▲
//!                       stroke            stroke, direction    load cell
//! ```
//! Watches look at every tick before the command is made, so a fault changes the command of the tick it is noticed in.

use heapless::Vec;
use model_core::link::messages::{
    Event, Fault, FaultReport, Field, Mode, Reference, Refusal, SetPoint, Side, SideSample, State, Telemetry,
    Variable,
};
use model_core::link::settings::{FeedForward, Reaction, Settings};
use model_core::motion::{MotionSettings, MotionTracker};

use crate::board::{Command, Inputs, Outputs, Readings};
use crate::modes::{self, Integral, Model, PairState, Posed};
use crate::reference::Generator;
use crate::regulator::RegulatorState;
use crate::safety::{self, Cause, Machine};
use crate::trace::Trace;
use crate::watch::{Finding, Seen, SideWatch};

/// Control ticks in a second.
pub const TICKS_PER_S: u32 = 1000;
/// Length of a tick, s.
pub const TICK_S: f32 = 1.0e-3;
/// Length of a tick, µs.
pub const TICK_US: u64 = 1000;

/// One muscle at work.
#[derive(Clone, Debug)]
struct Actuator {
    model: Option<Model>,
    motion: MotionTracker<f32>,
    watch: SideWatch,
    regulator: RegulatorState,
    trim: Integral,
    stroke_loop: Integral,
    guess_pa: f32,
    /// Sign of what the limits took from the last wish.
    cut: f32,
    sample: SideSample,
    command: Command,
    wanted_n: f32,
    forward_pa: f32,
    trim_pa: f32,
    /// Force by the table at this tick's readings, N; none without a table or without readings that are numbers.
    model_n: Option<f32>,
}

impl Actuator {
    fn new(settings: &Settings) -> Self {
        Self {
            model: None,
            motion: MotionTracker::new(motion_settings(settings)),
            watch: SideWatch::default(),
            regulator: RegulatorState::default(),
            trim: Integral::default(),
            stroke_loop: Integral::default(),
            guess_pa: 0.0,
            cut: 0.0,
            sample: SideSample::default(),
            command: Command { pressure_pa: 0.0, vent: true },
            wanted_n: 0.0,
            forward_pa: 0.0,
            trim_pa: 0.0,
            model_n: None,
        }
    }

    /// The table, if it has been brought to this tick.
    fn present(&self) -> Option<&Model> {
        self.model.as_ref().filter(|_| self.model_n.is_some())
    }
}

fn motion_settings(settings: &Settings) -> MotionSettings<f32> {
    MotionSettings {
        stroke_threshold: settings.motion_band_m,
        pressure_threshold: settings.pressure_band_pa,
        ..MotionSettings::default()
    }
}

/// The whole controller but for its board, its link and its store.
#[derive(Clone, Debug)]
pub struct Controller {
    settings: Settings,
    machine: Machine,
    mode: Mode,
    generator: Generator,
    asked: f32,
    asked_second: f32,
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
    /// As after power-up: disarmed, vented, without tables.
    pub fn new(settings: Settings) -> Self {
        Self {
            machine: Machine::default(),
            mode: Mode::Vent,
            generator: Generator::default(),
            asked: 0.0,
            asked_second: 0.0,
            asked_age: 0,
            host_age: 0,
            sides: [Actuator::new(&settings), Actuator::new(&settings)],
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

    /// Uses another table, or none.
    pub fn use_model(&mut self, side: Side, model: Option<Model>) {
        self.sides[side.index()].model = model;
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
        self.pair.begin(first.pressure_pa.min(self.sides[1].sample.pressure_pa));
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
    /// [`Refusal::WrongMode`] where it is not the running mode's, [`Refusal::Value`] where it is no finite number.
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
        self.generator.begin(Reference::SetPoint)?;
        (self.asked, self.asked_second) = (asked, second);
        self.asked_age = 0;
        Ok(())
    }

    /// A wave of the device's own.
    ///
    /// # Errors
    /// As [`Generator::begin`]; [`Refusal::WrongMode`] while venting.
    pub fn reference(&mut self, reference: Reference) -> Result<(), Refusal> {
        self.running()?;
        if self.mode == Mode::Vent {
            return Err(Refusal::WrongMode(Mode::Vent));
        }
        self.generator.begin(reference)?;
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
            if let Some(value) = self.generator.step() {
                self.asked = value;
            }
            self.drive();
        } else {
            self.rest();
        }
        self.record()
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
        let motion = actuator.motion.step(TICK_S, stroke_m, pressure_pa);
        let model_n = actuator.model.as_mut()?.tick(motion, pressure_pa);
        actuator.sample.model_n = model_n;
        Some(model_n)
    }

    fn watch(&mut self, inputs: &Inputs) -> Option<(Side, Finding)> {
        let settings = &self.settings;
        self.overruns = self.overruns.saturating_add(u32::from(inputs.missed_ticks));
        self.missed_in_a_row = if inputs.missed_ticks > 0 {
            self.missed_in_a_row.saturating_add(inputs.missed_ticks)
        } else {
            0
        };
        let mut found = None;
        for side in Side::ALL {
            if !(side == Side::Agonist || self.mode == Mode::Pair) {
                continue;
            }
            let actuator = &mut self.sides[side.index()];
            let seen = Seen {
                readings: inputs.sides[side.index()],
                speed_m_per_s: actuator.motion.motion().speed,
                command: actuator.command,
                expected_pa: actuator.regulator.model_pa(),
                model_n: actuator.model_n,
            };
            let finding = actuator.watch.check(&seen, settings);
            found = found.or(finding.map(|finding| (side, finding)));
        }
        let plain =
            |fault, value, limit| Some((Side::Agonist, Finding { fault, sensor: None, value, limit }));
        if found.is_some() {
            return found;
        }
        if inputs.supply_low {
            return plain(Fault::BrownOut, 0.0, 0.0);
        }
        if self.missed_in_a_row >= settings.watch.overrun_ticks.max(1) {
            return plain(
                Fault::LoopOverrun,
                f32::from(self.missed_in_a_row),
                f32::from(settings.watch.overrun_ticks),
            );
        }
        self.host_age = self.host_age.saturating_add(1);
        let silence = settings.watch.host_silence_ticks;
        let controls = self.machine.state() == State::Running && self.mode != Mode::Vent;
        if controls && !settings.watch.autonomous && self.host_age > silence {
            return plain(Fault::HostSilence, self.host_age as f32, silence as f32);
        }
        self.asked_age = self.asked_age.saturating_add(1);
        let silence = settings.watch.silence_ticks;
        if controls && silence > 0 && self.generator.is_set_point() && self.asked_age > silence {
            return plain(Fault::SetPointSilence, self.asked_age as f32, silence as f32);
        }
        None
    }

    /// Makes the commands of the running mode.
    fn drive(&mut self) {
        let settings = self.settings;
        let mut wishes = [(0.0, true); 2];
        match self.mode {
            Mode::Vent => {}
            Mode::Pressure => wishes[0] = (self.asked, true),
            Mode::Force => wishes[0] = self.force_wish(0, self.asked),
            Mode::Stroke => {
                let side = &mut self.sides[0];
                let speed = side.motion.motion().speed;
                let force = modes::stroke_force(
                    &settings.stroke_loop,
                    &mut side.stroke_loop,
                    self.asked,
                    side.sample.stroke_m,
                    speed,
                    side.cut,
                );
                wishes[0] = self.force_wish(0, force);
            }
            Mode::Pair => {
                let forces = self.pair_forces();
                wishes[0] = self.force_wish(0, forces[0]);
                wishes[1] = self.force_wish(1, forces[1]);
            }
        }
        let mut bad = None;
        for side in Side::ALL {
            let used = self.uses(side) && self.mode != Mode::Vent;
            let actuator = &mut self.sides[side.index()];
            let (wish, reached) = wishes[side.index()];
            if !used {
                actuator.regulator.vent(TICK_S, &settings.regulator);
                actuator.command = Command { pressure_pa: 0.0, vent: true };
                continue;
            }
            if !wish.is_finite() {
                bad = Some((side, wish));
                continue;
            }
            let most =
                actuator.model.as_ref().map_or(f32::MAX, |model| model.muscle.max_pressure().pascals());
            let high = most.min(settings.limits.pressure_pa);
            if settings.pressure.fitted {
                actuator.regulator.observe(TICK_S, actuator.sample.pressure_pa, &settings.regulator);
            }
            let driven = actuator.regulator.step(TICK_S, wish, high, &settings.regulator, &settings.limits);
            actuator.cut = if driven.saturated { wish - driven.wanted_pa } else { 0.0 };
            if !reached || driven.saturated {
                self.saturated_ticks = self.saturated_ticks.saturating_add(1);
            }
            actuator.command = Command { pressure_pa: driven.command_pa, vent: false };
            actuator.sample.wanted_pa = driven.wanted_pa;
        }
        if let Some((side, value)) = bad {
            self.raise(side, &Finding { fault: Fault::NotANumber, sensor: None, value, limit: 0.0 });
        }
    }

    /// Feed-forward and trim for a wanted force.
    fn force_wish(&mut self, at: usize, force_n: f32) -> (f32, bool) {
        let settings = &self.settings;
        let actuator = &mut self.sides[at];
        actuator.wanted_n = force_n;
        let model_n = actuator.model_n;
        let model = actuator.model.as_mut().filter(|_| model_n.is_some());
        let (forward, reached) = modes::feed_forward(settings, model, force_n, actuator.guess_pa);
        actuator.guess_pa = forward;
        actuator.forward_pa = forward;
        let measures = settings.force.fitted && actuator.sample.force_n.is_finite();
        actuator.trim_pa = if measures {
            let expected_n = match (settings.feed_forward, model_n, &actuator.model) {
                (FeedForward::Table, Some(model_n), Some(model)) => {
                    model_n - model.slope() * actuator.trim_pa
                }
                _ => force_n,
            };
            let error = expected_n - actuator.sample.force_n;
            modes::trim(&settings.force_loop, &mut actuator.trim, error, actuator.cut)
        } else {
            0.0
        };
        (forward + actuator.trim_pa, reached)
    }

    fn pair_forces(&mut self) -> [f32; 2] {
        let joint = self.settings.joint;
        let [first, second] = &self.sides;
        let (Some(a), Some(b)) = (first.present(), second.present()) else {
            return [0.0; 2];
        };
        let speeds = first.motion.motion().speed - second.motion.motion().speed;
        let posed = Posed {
            angle_rad: self.asked,
            stiffness_nm_per_rad: self.asked_second,
            measured_rad: (first.sample.stroke_m - second.sample.stroke_m) / (2.0 * joint.radius_m),
            rate_rad_per_s: speeds / (2.0 * joint.radius_m),
        };
        let sides = [(a, first.sample.stroke_m), (b, second.sample.stroke_m)];
        self.pair.forces(&joint, &posed, sides, first.cut - second.cut)
    }

    /// Keeps the commands of a state that does not control: vented, or held by a fault.
    fn rest(&mut self) {
        let regulator = self.settings.regulator;
        for side in &mut self.sides {
            if self.machine.state() == State::Fault && !side.command.vent {
                side.regulator.hold(TICK_S, &regulator);
            } else {
                side.regulator.vent(TICK_S, &regulator);
                side.command = Command { pressure_pa: 0.0, vent: true };
                side.sample.wanted_pa = 0.0;
            }
        }
    }

    fn record(&mut self) -> Stepped {
        for side in &mut self.sides {
            side.sample.command_pa = if side.command.vent { 0.0 } else { side.command.pressure_pa };
        }
        let outputs = Outputs {
            sides: [self.sides[0].command, self.sides[1].command],
            asked: if self.mode == Mode::Force { self.asked } else { self.sides[0].wanted_n },
        };
        let Self { trace, sides, machine, tick, asked, step_us, .. } = self;
        let state = machine.state();
        let full = trace.sample(*tick, |variable| value_of(variable, sides, state, *asked, *step_us));
        if full {
            self.event = self.event.or(Some(Event::TraceFull));
        }
        Stepped { outputs, telemetry: self.telemetry(), event: self.event.take() }
    }

    fn telemetry(&mut self) -> Option<(u16, Telemetry)> {
        if self.telemetry_every == 0 {
            return None;
        }
        if self.telemetry_countdown > 0 {
            self.telemetry_countdown -= 1;
            return None;
        }
        self.telemetry_countdown = self.telemetry_every - 1;
        let number = self.telemetry_number;
        self.telemetry_number = number.wrapping_add(1);
        let used = if self.uses(Side::Antagonist) { 2 } else { 1 };
        let sides: Vec<SideSample, 2> = self.sides.iter().take(used).map(|side| side.sample).collect();
        let sample = Telemetry {
            time_us: self.time_us(),
            tick: self.tick,
            state: self.machine.state(),
            mode: self.mode,
            asked: self.asked,
            asked_second: self.asked_second,
            sides,
        };
        Some((number, sample))
    }
}

fn value_of(variable: Variable, sides: &[Actuator; 2], state: State, asked: f32, step_us: f32) -> f32 {
    let [first, second] = sides;
    match variable {
        Variable::Pressure => first.sample.pressure_pa,
        Variable::Stroke => first.sample.stroke_m,
        Variable::Force => first.sample.force_n,
        Variable::Speed => first.motion.motion().speed,
        Variable::Direction => first.motion.motion().direction,
        Variable::Asked => asked,
        Variable::WantedForce => first.wanted_n,
        Variable::FeedForward => first.forward_pa,
        Variable::Trim => first.trim_pa,
        Variable::WantedPressure => first.sample.wanted_pa,
        Variable::Command => first.sample.command_pa,
        Variable::ModelPressure => first.regulator.model_pa(),
        Variable::ModelForce => first.sample.model_n,
        Variable::State => f32::from(state as u8),
        Variable::StepTime => step_us,
        Variable::SecondPressure => second.sample.pressure_pa,
        Variable::SecondStroke => second.sample.stroke_m,
        Variable::SecondForce => second.sample.force_n,
        Variable::SecondCommand => second.sample.command_pa,
    }
}

/// Looks at every number of new settings.
///
/// # Errors
/// [`Refusal::Value`] with the group that a wrong number is in.
pub fn check_settings(settings: &Settings) -> Result<(), Refusal> {
    let positive = |value: f32| value > 0.0 && value.is_finite();
    let not_negative = |value: f32| value >= 0.0 && value.is_finite();
    let f = &settings.force_loop;
    let s = &settings.stroke_loop;
    let j = &settings.joint;
    let r = &settings.regulator;
    let l = &settings.limits;
    let watched = |w: &model_core::link::settings::SensorWatch| {
        w.low.is_finite() && w.high.is_finite() && w.low < w.high && positive(w.jump)
    };
    let groups = [
        (
            Field::ForceLoop,
            [f.proportional_pa_per_n, f.integral_pa_per_n_s, f.trim_limit_pa].into_iter().all(not_negative),
        ),
        (
            Field::StrokeLoop,
            [s.proportional_n_per_m, s.integral_n_per_m_s, s.damping_n_s_per_m].into_iter().all(not_negative)
                && s.load_n.is_finite()
                && s.load_stiffness_n_per_m.is_finite()
                && positive(s.force_limit_n),
        ),
        (
            Field::Joint,
            [j.proportional_nm_per_rad, j.integral_nm_per_rad_s, j.damping_nm_s_per_rad]
                .into_iter()
                .all(not_negative)
                && positive(j.radius_m)
                && j.rest_stroke_m.is_finite()
                && positive(j.torque_limit_nm),
        ),
        (
            Field::Regulator,
            positive(r.gain)
                && r.offset_pa.is_finite()
                && not_negative(r.lag_s)
                && positive(r.rate_pa_per_s)
                && not_negative(r.deadband_pa)
                && positive(r.command_max_pa)
                && (0.0..=1.0).contains(&r.lead),
        ),
        (
            Field::Limits,
            positive(l.pressure_pa)
                && l.stroke_min_m.is_finite()
                && l.stroke_max_m.is_finite()
                && l.stroke_min_m < l.stroke_max_m
                && positive(l.speed_m_per_s)
                && positive(l.force_n)
                && positive(l.slew_pa_per_s),
        ),
        (
            Field::SensorWatch,
            watched(&settings.pressure) && watched(&settings.stroke) && watched(&settings.force),
        ),
        (
            Field::Watch,
            not_negative(settings.watch.disagree_n)
                && positive(settings.watch.follow_pa)
                && settings.watch.host_silence_ticks > 0,
        ),
        (Field::Bands, positive(settings.motion_band_m) && positive(settings.pressure_band_pa)),
    ];
    match groups.into_iter().find(|(_, good)| !good) {
        Some((field, _)) => Err(Refusal::Value(field)),
        None => Ok(()),
    }
}
