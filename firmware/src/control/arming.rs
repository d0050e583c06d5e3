//! Arming: only an empty muscle is armed, and where the settings require it only behind a dump valve that has been tried.
//!
//! ```text
//! filling    dump valve closed, regulator at the test's pressure     until the pressure stands, above half of it and below twice
//! dumping    dump valve open, regulator still at that pressure       until less than half is: the valve alone lets it out
//! ```
//! The test is best made below the deadband, where the muscle does not move. The device is disarmed while it lasts.

use model_core::link::messages::{Fault, Mode, Refusal, Session, Side, State};
use model_core::scalar::Scalar;

use super::Controller;
use super::actuator::Actuator;
use crate::board::Command;
use crate::safety::Cause;
use crate::tick::TICK_S;
use crate::watch::Finding;

/// Where the way from disarmed to armed is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Arming {
    /// Nothing is on its way.
    #[default]
    Idle,
    /// The muscles are being filled; ticks so far.
    Filling(u16),
    /// They are being emptied; ticks so far.
    Dumping(u16),
}

/// The most that either half of the test may take, ticks: a line of 0.5 s lets a half through in 0.35 s.
const PATIENCE_TICKS: u16 = 1_000;
/// Part of the test's pressure that must come, and go again.
const PART: f32 = 0.5;
/// Time constants of regulator and line after which the pressure stands: it lacks 2 % then. At most half of the patience.
const SETTLED: f32 = 4.0;
/// Pressure at which the test ends with a fault, as a multiple of the test's pressure: more than a regulator overshoots.
const MOST: f32 = 2.0;

impl Controller {
    /// Arms for a session, or begins the test that arms when it has passed.
    ///
    /// # Errors
    /// As [`Machine::request`](crate::safety::Machine::request); [`Refusal::OtherSession`] where another session owns the device and
    /// is not silent; [`Refusal::StillFaulty`] where a muscle is not empty or the settings have not been confirmed.
    pub fn arm(&mut self, session: Session) -> Result<(), Refusal> {
        self.machine.allows(Cause::Arm)?;
        self.may_take(session)?;
        if self.machine.state() == State::Disarmed {
            if self.unconfirmed {
                return Err(Refusal::StillFaulty(Fault::SettingsInvalid));
            }
            let watch = &self.settings.watch;
            if watch.enable_input && self.enable_open.is_counting() {
                return Err(Refusal::StillFaulty(Fault::EnableOpen));
            }
            // With `!(…)`, a pressure that is not a number counts as pressure in the muscle.
            let pressurised = |pressure_pa: f32| !(pressure_pa <= watch.vented_pa);
            // The reading of this tick counts as well as the filtered one.
            let stands = |side: &Actuator| {
                pressurised(side.sample.pressure_pa)
                    || side.readings.is_some_and(|now| pressurised(now.pressure_pa))
            };
            if self.settings.pressure.fitted && self.sides.iter().any(stands) {
                return Err(Refusal::StillFaulty(Fault::NotVented));
            }
            if self.settings.pressure.fitted && watch.valve_test_pa > 0.0 {
                if self.arming == Arming::Idle {
                    self.arming = Arming::Filling(0);
                    self.tested = [true, self.sides[1].readings.is_some()];
                }
                self.own(session);
                return Ok(());
            }
        }
        self.arm_now()?;
        self.own(session);
        Ok(())
    }

    /// Disarms a device whose owner has been silent: the program that armed it has ended, and no other may find it ready. One that runs
    /// in the mode that vents is as ready as an armed one.
    pub(super) fn disarm_when_silent(&mut self) {
        let is_ready = match self.machine.state() {
            State::Armed => true,
            State::Running => self.mode == Mode::Vent,
            State::Disarmed | State::Fault => false,
        };
        if is_ready && self.owner_age > self.settings.watch.armed_silence_ticks {
            // Allowed from `Armed` and `Running`.
            let _ = self.disarm();
        }
    }

    fn arm_now(&mut self) -> Result<(), Refusal> {
        let continues = self.machine.state() == State::Armed;
        self.change(Cause::Arm)?;
        if !continues {
            for side in &mut self.sides {
                side.watch.restart();
            }
        }
        Ok(())
    }

    /// One tick of the test, on the first muscle and on every other that has had readings since it began.
    pub(super) fn test_valves(&mut self) {
        let regulator = self.settings.regulator;
        let pressure_pa = self.settings.watch.valve_test_pa;
        let enough_pa = PART * pressure_pa;
        let filling = matches!(self.arming, Arming::Filling(_));
        // The regulator has time to go where its command is, so that one that goes too far is noticed.
        let settled_s = SETTLED * (regulator.lag_s + regulator.line_s);
        let early = match self.arming {
            Arming::Filling(ticks) => ticks < PATIENCE_TICKS / 2 && f32::from(ticks) * TICK_S < settled_s,
            _ => false,
        };
        let mut waits_for = None;
        for side in Side::ALL {
            let Some(now) = self.sides[side.index()].readings else {
                // What is not read in this tick decides nothing, and the time continues.
                if self.tested[side.index()] {
                    waits_for = waits_for.or(Some((side, self.sides[side.index()].sample.pressure_pa)));
                }
                continue;
            };
            self.tested[side.index()] = true;
            // More than twice the commanded pressure: the scale of the sensor or of the command is wrong.
            let most_pa = MOST * pressure_pa;
            if !(now.pressure_pa <= most_pa) {
                let (fault, value) = (Fault::ValveTest, now.pressure_pa);
                return self.raise(side, &Finding { fault, sensor: None, value, limit: most_pa });
            }
            // A pair of valves fills, and no pressure answers.
            if let Some(finding) = self.sides[side.index()].unanswered() {
                return self.raise(side, &Finding { fault: Fault::ValveTest, ..finding });
            }
            let filled = now.pressure_pa >= enough_pa && !(filling && early);
            if filled != filling {
                waits_for = waits_for.or(Some((side, now.pressure_pa)));
            }
            let most = regulator.command_max_pa.at_most(self.hardware.command_ceiling_pa);
            let command = (pressure_pa / regulator.gain - regulator.offset_pa).within(0.0, most);
            let actuator = &mut self.sides[side.index()];
            actuator.regulator.expect(if filling { command } else { 0.0 }, &self.law);
            actuator.command = Command { pressure_pa: command, vent: !filling };
        }
        self.arming = match (self.arming, waits_for) {
            (Arming::Filling(_), None) => Arming::Dumping(0),
            (Arming::Filling(ticks), Some(_)) if ticks < PATIENCE_TICKS => Arming::Filling(ticks + 1),
            (Arming::Dumping(ticks), Some(_)) if ticks < PATIENCE_TICKS => Arming::Dumping(ticks + 1),
            (_, Some((side, value))) => {
                let finding = Finding { fault: Fault::ValveTest, sensor: None, value, limit: enough_pa };
                return self.raise(side, &finding);
            }
            (_, None) => {
                self.vent_now();
                // The state has not changed since the test began, so this is allowed.
                let _ = self.arm_now();
                Arming::Idle
            }
        };
    }
}
