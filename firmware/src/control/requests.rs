//! Requests of a host to the controller: states, modes, setpoints, references.

use model_core::link::messages::{
    Fault, Field, Mode, Reference, ReferenceOrder, ReferencePoints, Refusal, Session, SetPoint,
    SetPointOrder, Side, State,
};
use model_core::link::settings::{FeedForward, Settings};

use super::actuator::Actuator;
use super::arming::Arming;
use super::standing::Standing;
use super::{Controller, Notice};
use crate::board::Command;
use crate::pair::{self, Arm};
use crate::safety::Cause;
use crate::watch::Finding;

impl Controller {
    pub(super) fn change(&mut self, cause: Cause) -> Result<(), Refusal> {
        let before = self.machine.state();
        let state = self.machine.request(cause)?;
        if state != before {
            self.notice = Some(Notice::State(state));
        }
        self.arming = Arming::Idle;
        if state != State::Running {
            self.mode = Mode::Vent;
            self.generator.begin(Reference::SetPoint)?;
        }
        Ok(())
    }

    /// Starts a mode at what is measured now, for a session that has to keep it alive. While one runs, the watches and the regulator's
    /// model continue: a start that is repeated must not give a burst more time.
    ///
    /// # Errors
    /// As [`Machine::request`](crate::safety::Machine::request); [`Refusal::OtherSession`] where another session owns the device and
    /// is not silent; [`Refusal::NoTable`], with the fault latched, where the mode needs a table; [`Refusal::Value`] where it needs a
    /// stroke sensor and the settings have none.
    pub fn start(&mut self, mode: Mode, session: Session) -> Result<(), Refusal> {
        self.machine.allows(Cause::Start)?;
        self.may_take(session)?;
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
        // A loop of the stroke over a sensor that is not there would fill the muscle until something else stops it.
        if matches!(mode, Mode::Stroke | Mode::Pair) && !self.settings.stroke.fitted {
            return Err(Refusal::Value(Field::SensorWatch));
        }
        let continues = self.machine.state() == State::Running;
        self.change(Cause::Start)?;
        self.own(session);
        self.mode = mode;
        self.generator.begin(Reference::SetPoint)?;
        let first = self.sides[0].sample;
        let joint = self.settings.joint;
        self.setpoint_second = 0.0;
        self.setpoint = match mode {
            Mode::Vent => 0.0,
            Mode::Pressure => first.pressure_pa.max(0.0),
            Mode::Force => first.force_n.max(0.0),
            Mode::Stroke => first.stroke_m,
            Mode::Pair => (first.stroke_m - self.sides[1].sample.stroke_m) / (2.0 * joint.radius_m),
        };
        self.setpoint_age = 0;
        self.begun_pa = Some(first.pressure_pa.max(0.0));
        for side in &mut self.sides {
            match (continues, side.command.vent) {
                (true, false) => {}
                (true, true) => side.regulator.demand_from(side.sample.pressure_pa),
                (false, _) => {
                    side.regulator.begin(side.sample.pressure_pa);
                    side.watch.restart();
                }
            }
            side.trim.reset();
            side.stroke_loop.reset();
            side.guess_pa = side.sample.pressure_pa;
            side.saturation = 0.0;
            side.standing = Standing::default();
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
    /// As [`Machine::request`](crate::safety::Machine::request).
    pub fn stop(&mut self) -> Result<(), Refusal> {
        self.vent_now();
        self.change(Cause::Stop)
    }

    /// Vents, and is no longer ready.
    ///
    /// # Errors
    /// As [`Machine::request`](crate::safety::Machine::request).
    pub fn disarm(&mut self) -> Result<(), Refusal> {
        self.vent_now();
        self.change(Cause::Disarm)
    }

    /// The session that asks is the one that owns the device from now on.
    pub(super) fn own(&mut self, session: Session) {
        self.owner = session;
        self.owner_age = 0;
    }

    /// Whether a session owns the device. One that is neither armed nor running, and holds nothing, has no owner.
    fn is_owned(&self) -> bool {
        self.arming != Arming::Idle
            || matches!(self.machine.state(), State::Armed | State::Running)
            || !self.is_vented()
    }

    /// Whether a session may give orders to what another one has started.
    ///
    /// # Errors
    /// [`Refusal::OtherSession`] where another session owns the device.
    fn obeys(&self, session: Session) -> Result<(), Refusal> {
        if session == self.owner || !self.is_owned() { Ok(()) } else { Err(Refusal::OtherSession) }
    }

    /// Whether a session may arm or start: as [`Controller::obeys`], or in the place of an owner that has been silent for as long as
    /// a run may continue without it.
    ///
    /// # Errors
    /// [`Refusal::OtherSession`] where another session owns the device and is not silent.
    pub(super) fn may_take(&self, session: Session) -> Result<(), Refusal> {
        if self.owner_age > self.settings.watch.host_silence_ticks { Ok(()) } else { self.obeys(session) }
    }

    /// The owner's program is alive.
    ///
    /// # Errors
    /// [`Refusal::OtherSession`] where another session owns the device.
    pub fn keep_alive(&mut self, session: Session) -> Result<(), Refusal> {
        self.obeys(session)?;
        if session == self.owner {
            self.owner_age = 0;
        }
        Ok(())
    }

    pub(super) fn vent_now(&mut self) {
        self.arming = Arming::Idle;
        // In `Fault` with a held command this is the way to release it.
        for side in &mut self.sides {
            side.command = Command::VENT;
        }
    }

    /// Forgets the latched fault.
    ///
    /// # Errors
    /// [`Refusal::StillFaulty`] while what caused a fault is still there, or settings have not been confirmed.
    pub fn clear(&mut self) -> Result<(), Refusal> {
        if self.machine.state() == State::Fault && self.unconfirmed {
            return Err(Refusal::StillFaulty(Fault::SettingsInvalid));
        }
        if self.machine.state() == State::Fault
            && let Some(fault) = self.present
        {
            return Err(Refusal::StillFaulty(fault));
        }
        self.vent_now();
        self.change(Cause::Clear)
    }

    /// A new setpoint; ends a reference.
    ///
    /// # Errors
    /// [`Refusal::OtherSession`] where another session started the mode, [`Refusal::WrongMode`] where it is not the running mode's,
    /// [`Refusal::Value`] where it is not a finite number, [`Refusal::Angle`] or [`Refusal::Stiffness`] where a joint cannot have it.
    pub fn set_point(&mut self, order: SetPointOrder) -> Result<(), Refusal> {
        let (mode, asked, second) = match order.set_point {
            SetPoint::Pressure(pascals) => (Mode::Pressure, pascals, 0.0),
            SetPoint::Force(newtons) => (Mode::Force, newtons, 0.0),
            SetPoint::Stroke(metres) => (Mode::Stroke, metres, 0.0),
            SetPoint::Pair { angle_rad, stiffness_nm_per_rad } => {
                (Mode::Pair, angle_rad, stiffness_nm_per_rad)
            }
        };
        self.running()?;
        self.obeys(order.session)?;
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
        (self.setpoint, self.setpoint_second) = (asked, second);
        self.setpoint_age = 0;
        self.begun_pa = None;
        Ok(())
    }

    /// Both muscles of a joint, if both have tables.
    pub(super) fn arms(&self) -> Option<[Arm<'_>; 2]> {
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
    /// As [`Generator::begin`](crate::reference::Generator::begin); [`Refusal::WrongMode`] while venting; [`Refusal::Angle`] or
    /// [`Refusal::Stiffness`] where a joint cannot have an end of the wave; [`Refusal::OtherSession`] where another session started the
    /// mode.
    pub fn reference(&mut self, order: ReferenceOrder) -> Result<(), Refusal> {
        let ReferenceOrder { reference, session } = order;
        self.running()?;
        self.obeys(session)?;
        if self.mode == Mode::Vent {
            return Err(Refusal::WrongMode(Mode::Vent));
        }
        if self.mode == Mode::Pair {
            let (low, high) = self.generator.range(reference);
            self.can_pose(low, self.setpoint_second)?;
            self.can_pose(high, self.setpoint_second)?;
        }
        self.generator.begin(reference)?;
        // Here, so that no tick has all of it to do.
        self.generator.look_ahead(self.law.ahead());
        self.setpoint_age = 0;
        self.begun_pa = None;
        self.trace.on_start();
        Ok(())
    }

    /// Points for the reference table.
    ///
    /// # Errors
    /// As [`Generator::take_points`](crate::reference::Generator::take_points); [`Refusal::OtherSession`] where another session owns
    /// the device.
    pub fn reference_points(&mut self, piece: &ReferencePoints) -> Result<u16, Refusal> {
        self.obeys(piece.session)?;
        self.generator.take_points(piece)
    }

    fn running(&self) -> Result<(), Refusal> {
        match (self.machine.state(), self.machine.latched()) {
            (State::Running, _) => Ok(()),
            (_, Some(fault)) => Err(Refusal::Latched(fault)),
            (state, None) => Err(Refusal::WrongState(state)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Inputs, Readings};

    /// N ticks of a muscle that follows its command within 30 ms.
    fn run(controller: &mut Controller, pressure_pa: &mut f32, ticks: u32) {
        for tick in 0..ticks {
            // Live sensors never read the same twice.
            let wiggle = (tick % 7) as f32 - 3.0;
            let now = Readings {
                pressure_pa: *pressure_pa + wiggle,
                stroke_m: 1e-3 + 1e-7 * wiggle,
                force_n: 1e-3 * wiggle,
            };
            let command =
                controller.step(&Inputs { sides: [Some(now.into()), None], ..Inputs::default() }).sides[0];
            let target = if command.vent { 0.0 } else { command.pressure_pa };
            *pressure_pa += (target - *pressure_pa) / 31.0;
            assert_eq!(controller.keep_alive(Session::default()), Ok(()));
        }
    }

    #[test]
    fn a_change_over_to_vent_lets_the_pressure_fall_and_no_watch_misses_it() {
        let mut settings = Settings::default();
        settings.watch.follow_pa = 60e3;
        let mut controller = Controller::new(&settings);
        let mut pressure = 0.0;
        run(&mut controller, &mut pressure, 10);
        assert_eq!(controller.arm(Session::default()), Ok(()));
        assert_eq!(controller.start(Mode::Pressure, Session::default()), Ok(()));
        let order = SetPointOrder { set_point: SetPoint::Pressure(300e3), ..SetPointOrder::default() };
        assert_eq!(controller.set_point(order), Ok(()));
        run(&mut controller, &mut pressure, 1000);
        assert!((pressure - 300e3).abs() < 1e3, "{pressure}");
        assert_eq!(controller.start(Mode::Vent, Session::default()), Ok(()));
        run(&mut controller, &mut pressure, 1000);
        assert_eq!((controller.state(), controller.faults().latched), (State::Running, None));
        assert!(pressure < 1e3, "{pressure}");
    }
}
