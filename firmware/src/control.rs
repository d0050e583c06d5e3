//! The control step: readings and the setpoint, to commands. One pure function of its state, each millisecond.
//!
//! ```text
//! setpoint ─► mode ─► demanded force ─► inverse of the table ─► + trim ─► limits, slew ─► regulator ─► command
//!                          ▲                  ▲                   ▲
//!                       stroke            stroke, direction    load cell
//! ```
//! Watches look at every tick before the command is made, so a fault changes the command of the tick it is noticed in.

use model_core::link::messages::{Fault, MeanSignals, Mode, Session, Side, State};
use model_core::link::settings::Settings;
use model_core::motion::{MotionSettings, MotionTracker};
use model_core::scalar::Scalar;
use model_core::single_precision;
use model_core::table::{MuscleTable, TableError};

use crate::board::{Hardware, Inputs, Outputs, Readings};
use crate::health::{Health, Scales};
use crate::modes::{Model, Seat};
use crate::pair::PairState;
use crate::reference::Generator;
use crate::regulator::Law;
use crate::safety::Machine;
use crate::signals::{self, Filters, Speed};
use crate::tick::{TICK_S, TICK_US};
use crate::trace::Trace;
use crate::watch::{Finding, InARow};

mod actuator;
mod arming;
mod check;
mod drive;
mod latch;
mod monitor;
mod record;
mod requests;
mod standing;

pub use check::{check_settings, repair_settings};

use actuator::Actuator;
use arming::Arming;

/// Something whose address is kept in a register. There is one controller, at an address that the compiler knows: it would add up the
/// address of each number again.
#[inline(always)]
fn in_register<T>(of: &T) -> &T {
    core::hint::black_box(of)
}

fn motion_settings(settings: &Settings) -> MotionSettings<f32> {
    MotionSettings {
        stroke_threshold: settings.motion_band_m,
        pressure_threshold: settings.pressure_band_pa,
        ..MotionSettings::default()
    }
}

/// What the host is to receive; the report of a fault is the latched one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Notice {
    Fault,
    State(State),
    TraceFull,
}

/// The whole controller without its board, its link and its store.
#[derive(Debug)]
pub struct Controller {
    settings: Settings,
    /// What follows from the settings of the regulator.
    law: Law,
    hardware: &'static Hardware,
    machine: Machine,
    arming: Arming,
    /// The muscles whose valves the test before arming tries.
    tested: [bool; 2],
    /// Whether someone has to send settings before the device can be armed.
    unconfirmed: bool,
    mode: Mode,
    generator: Generator,
    setpoint: f32,
    setpoint_second: f32,
    /// What will be queried when a command of this tick has come to act, as far as it is known, and how it came there in this tick.
    lookahead: f32,
    lookahead_step: f32,
    setpoint_age: u32,
    /// Pressure at which the mode was started, until there is an order: a start moves nothing.
    begun_pa: Option<f32>,
    /// The session that armed the device or started its mode.
    owner: Session,
    /// Ticks since the owner's last keep-alive request.
    owner_age: u32,
    /// Ticks for which a fault has held the last command.
    held_ticks: u32,
    sides: [Actuator; 2],
    pair: PairState,
    tick: u64,
    overruns: u32,
    missed_in_a_row: u16,
    /// Ticks in a row of too little supply air, and of an open enable input.
    supply_low: InARow,
    enable_open: InARow,
    saturated_ticks: u32,
    telemetry_every: u16,
    telemetry_countdown: u16,
    telemetry_number: u16,
    trace: Trace,
    /// A finding of the last tick: what would be in the way of clearing.
    present: Option<Fault>,
    notice: Option<Notice>,
    step_us: f32,
}

impl Controller {
    /// As after power-up: disarmed, vented, without tables; for two muscles.
    pub fn new(settings: &Settings) -> Self {
        Self::seated(settings, &Hardware::SIMULATED, Seat::pair())
    }

    /// The same with places for the tables of the muscles that a board drives.
    #[inline(always)]
    pub fn seated(settings: &Settings, hardware: &'static Hardware, [first, second]: [Seat; 2]) -> Self {
        let law = Law::of(&settings.regulator, &settings.limits);
        // Without a table.
        let bounds = law.bounds(settings.limits.pressure_pa.at_most(hardware.command_ceiling_pa));
        Self {
            law,
            hardware,
            arming: Arming::Idle,
            tested: [false; 2],
            unconfirmed: false,
            held_ticks: 0,
            machine: Machine::default(),
            mode: Mode::Vent,
            generator: Generator::default(),
            setpoint: 0.0,
            setpoint_second: 0.0,
            lookahead: 0.0,
            lookahead_step: 0.0,
            setpoint_age: 0,
            begun_pa: None,
            owner: Session::default(),
            owner_age: 0,
            sides: [Actuator::new(settings, first, bounds), Actuator::new(settings, second, bounds)],
            settings: *settings,
            pair: PairState::default(),
            tick: 0,
            overruns: 0,
            missed_in_a_row: 0,
            supply_low: InARow::default(),
            enable_open: InARow::default(),
            saturated_ticks: 0,
            telemetry_every: 0,
            telemetry_countdown: 0,
            telemetry_number: 0,
            trace: Trace::default(),
            present: None,
            notice: None,
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

    /// What the controller controls.
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

    /// Ticks in which a demand was saturated.
    pub fn saturated_ticks(&self) -> u32 {
        self.saturated_ticks
    }

    /// The trace.
    pub fn trace(&mut self) -> &mut Trace {
        &mut self.trace
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What the board can do.
    pub fn hardware(&self) -> &'static Hardware {
        self.hardware
    }

    /// Uses other settings, which must have passed [`check_settings`].
    pub fn use_settings(&mut self, settings: &Settings) {
        self.settings = *settings;
        self.law = Law::of(&settings.regulator, &settings.limits);
        for side in &mut self.sides {
            side.bound(settings, self.hardware, &self.law);
            side.motion = MotionTracker::new(motion_settings(settings));
            side.filters = Filters::new(&settings.scales);
            side.unfiltered = Speed::default();
            side.watch.restart();
        }
    }

    /// The kept settings could not be trusted: nothing can be armed until someone has sent settings.
    pub fn distrust_settings(&mut self) {
        self.unconfirmed = true;
        let finding = Finding { fault: Fault::SettingsInvalid, sensor: None, value: 0.0, limit: 0.0 };
        self.raise(Side::Agonist, &finding);
    }

    /// Settings were sent by someone who has seen them.
    pub fn confirm_settings(&mut self) {
        self.unconfirmed = false;
    }

    /// Whether every muscle is vented and stays so: the flash, which stops the processor, may be written.
    pub fn is_vented(&self) -> bool {
        self.machine.state() != State::Running
            && self.arming == Arming::Idle
            && self.sides.iter().all(|side| side.command.vent)
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
    /// The part of the table that cannot be used; the muscle then has no table.
    pub fn use_table(&mut self, side: Side, table: &MuscleTable) -> Result<(), TableError> {
        let actuator = &mut self.sides[side.index()];
        actuator.health = Health::new(Scales::of(table));
        let filled = actuator.model.fill(table);
        actuator.bound(&self.settings, self.hardware, &self.law);
        filled
    }

    /// Means of a muscle's signals since they were last taken.
    pub fn take_signals(&mut self, side: Side, answer: &mut MeanSignals) {
        self.sides[side.index()].sums.take(answer);
        answer.enabled = !self.enable_open.is_counting();
    }

    /// Whether a muscle's table still describes it.
    pub fn health(&self, side: Side) -> &Health {
        &self.sides[side.index()].health
    }

    /// Uses no table.
    pub fn forget_table(&mut self, side: Side) {
        let actuator = &mut self.sides[side.index()];
        actuator.health = Health::default();
        actuator.model.clear();
        actuator.bound(&self.settings, self.hardware, &self.law);
    }

    /// One telemetry sample every n ticks, 0 for none.
    pub fn set_telemetry(&mut self, every_ticks: u16) {
        self.telemetry_every = every_ticks;
        self.telemetry_countdown = 0;
    }

    fn uses(&self, side: Side) -> bool {
        side == Side::Agonist || self.mode == Mode::Pair
    }

    /// One millisecond. What it says to the host is left for [`Controller::take_event`] and [`Controller::take_sample`].
    pub fn step(&mut self, inputs: &Inputs) -> Outputs {
        self.tick += 1;
        self.step_us = inputs.step_us;
        for side in Side::ALL {
            let model_n = self.take_readings(side, inputs);
            self.sides[side.index()].model_n = model_n;
        }
        let found = self.watch(inputs);
        if let Some((side, finding)) = found.gravest() {
            if self.machine.state() == State::Fault {
                self.raise_while_latched(side, &finding, found.venting().is_some());
            } else {
                self.raise(side, &finding);
            }
        }
        self.present = found.gravest().map(|(_, finding)| finding.fault);
        self.disarm_when_silent();
        match (self.machine.state(), self.arming) {
            (State::Running, _) => {
                self.ask();
                self.drive();
            }
            (State::Disarmed, Arming::Filling(_) | Arming::Dumping(_)) => self.test_valves(),
            _ => self.rest(),
        }
        for side in Side::ALL {
            // Without a table there is nothing to compare, and never was.
            if self.sides[side.index()].model.as_ref().is_none() {
                continue;
            }
            let runs = self.machine.state() == State::Running && self.mode != Mode::Vent && self.uses(side);
            let counts = runs && self.settings.force.fitted;
            self.sides[side.index()].compare(counts);
        }
        self.record()
    }

    /// Brings the setpoint to this tick. A wave of the device's own is known ahead of its time, a host's setpoints are not.
    fn ask(&mut self) {
        match self.generator.step_ahead(self.law.ahead()) {
            Some((now, coming)) => {
                self.setpoint = now;
                self.lookahead_step = coming - self.lookahead;
                self.lookahead = coming;
            }
            None => (self.lookahead, self.lookahead_step) = (self.setpoint, 0.0),
        }
    }

    /// Takes one muscle's readings; the force that its table gives at them.
    fn take_readings(&mut self, side: Side, inputs: &Inputs) -> Option<f32> {
        let actuator = &mut self.sides[side.index()];
        let scales = &self.settings.scales;
        actuator.readings = None;
        actuator.second_pa = None;
        let now = inputs.sides[side.index()].as_ref()?;
        actuator.sums.add(now, inputs.supply_air);
        let readings = signals::readings(now, scales);
        actuator.readings = Some(readings);
        actuator.second_pa = now.second_pressure.map(|signal| scales.second_pressure.reading(signal));
        let Readings { pressure_pa, stroke_m, force_n } = actuator.filters.next(&readings, scales);
        actuator.sample.pressure_pa = pressure_pa;
        actuator.sample.stroke_m = stroke_m;
        actuator.sample.force_n = force_n;
        actuator.sample.model_n = 0.0;
        // A reading that is not a number must not get into what is remembered.
        if !(pressure_pa.is_finite() && stroke_m.is_finite()) {
            return None;
        }
        if scales.stroke.filter_s > 0.0 {
            actuator.unfiltered.next(readings.stroke_m);
        }
        // Only effects remember.
        let remembers = actuator.model.as_ref().is_some_and(|model| !model.chain.is_empty());
        let trusted = !remembers || actuator.trusts(&readings, &self.settings);
        let motion = single_precision::follow(&mut actuator.motion, TICK_S, stroke_m, pressure_pa);
        let model_n = actuator.model.as_mut()?.tick_trusted(motion, pressure_pa, trusted);
        actuator.sample.model_n = model_n;
        Some(model_n)
    }
}

#[cfg(test)]
mod tests;
