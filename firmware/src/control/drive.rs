//! Commands: from the setpoint, by way of force and feed-forward, to what the regulators are reported.

use model_core::link::messages::{Fault, Mode, Side, State};
use model_core::link::settings::FeedForward;

use super::{Controller, in_register};
use crate::board::Command;
use crate::modes;
use crate::pair::{self, Posed, Pull};
use crate::regulator::Demand;
use crate::watch::Finding;

impl Controller {
    /// Makes the commands of the running mode.
    pub(super) fn drive(&mut self) {
        let mut demands = [(Demand::default(), true); 2];
        match self.mode {
            Mode::Vent => return self.rest(),
            Mode::Pressure => {
                demands[0] =
                    (Demand { pressure_pa: self.lookahead, lookahead_pa: self.lookahead_step }, true);
            }
            Mode::Force => {
                demands[0] = if let Some(pressure_pa) = self.slack_since_start() {
                    (Demand { pressure_pa, lookahead_pa: 0.0 }, true)
                } else {
                    self.demand_for_force(0, [self.setpoint, self.lookahead], self.lookahead_step)
                }
            }
            Mode::Stroke => {
                let side = &mut self.sides[0];
                let speed = side.motion.motion().speed;
                let force = modes::stroke_force(
                    &self.settings.stroke_loop,
                    &mut side.stroke_loop,
                    [self.setpoint, self.lookahead],
                    side.sample.stroke_m,
                    speed,
                    side.saturation,
                );
                let step = self.settings.stroke_loop.load_stiffness_n_per_m * self.lookahead_step;
                demands[0] = self.demand_for_force(0, [force; 2], step);
            }
            Mode::Pair => {
                let Pull { forces_n, reached } = self.pair_forces();
                for (at, demand) in demands.iter_mut().enumerate() {
                    let (pressure, force_reached) = self.demand_for_force(at, [forces_n[at]; 2], 0.0);
                    *demand = (pressure, force_reached && reached);
                }
            }
        }
        let [first, second] = demands;
        let mut bad = self.command(Side::Agonist, first).err().map(|value| (Side::Agonist, value));
        if self.uses(Side::Antagonist) {
            let other = self.command(Side::Antagonist, second).err();
            bad = other.map(|value| (Side::Antagonist, value)).or(bad);
        } else if pair::SUPPORTED {
            // Its regulator's model is kept up for the watch on what stays in it, where there is a second muscle at all.
            let Self { sides, law, .. } = self;
            sides[Side::Antagonist.index()].vent(law);
        }
        if let Some((side, value)) = bad {
            self.raise(side, &Finding { fault: Fault::NotANumber, sensor: None, value, limit: 0.0 });
        }
    }

    /// The pressure of a muscle that was slack when force mode was started, until there is an order. The table gives no force as the pressure
    /// at which the muscle would just be taut, and a start moves nothing.
    fn slack_since_start(&self) -> Option<f32> {
        let taut_n = self.sides[0].model.as_ref()?.taut_n();
        self.begun_pa.filter(|_| self.setpoint <= taut_n)
    }

    /// Makes the command of one muscle; fails with a demand or a command that cannot be sent.
    #[inline(never)]
    fn command(&mut self, side: Side, (demand, reached): (Demand, bool)) -> Result<(), f32> {
        if !demand.pressure_pa.is_finite() {
            return Err(demand.pressure_pa);
        }
        let settings = in_register(&self.settings);
        let actuator = &mut self.sides[side.index()];
        let ceiling_pa = self.hardware.command_ceiling_pa;
        let high = actuator.bounds.high_pa;
        // Without lead a command is the setpoint, as anyone who measures the regulator itself wants it. Valves are controlled on the
        // pressure itself: nothing drifts, and while they are as far open as they can be, the model runs ahead of them.
        if settings.pressure.fitted && settings.regulator.lead > 0.0 && !settings.valves.is_fitted() {
            actuator.regulator.observe(actuator.sample.pressure_pa, &self.law);
        }
        let air = actuator.air();
        let driven = actuator.regulator.step(demand, &actuator.bounds, &air, &self.law);
        actuator.saturation = if !reached {
            // The inverse has gone to the highest pressure, or to the lowest.
            demand.pressure_pa - 0.5 * high
        } else if driven.saturated {
            demand.pressure_pa - driven.pressure_demand_pa
        } else {
            // Zero where none are fitted, and where the valves do what is commanded.
            actuator.valves.limited_pa()
        };
        if !reached || driven.saturated {
            self.saturated_ticks = self.saturated_ticks.saturating_add(1);
        }
        // What is sent is judged, not only what was demanded for: the regulator's model comes between.
        let sent = driven.command_pa;
        if !(sent >= 0.0 && sent <= ceiling_pa && actuator.regulator.model_pa().is_finite()) {
            return Err(sent);
        }
        actuator.command = Command { pressure_pa: sent, vent: false };
        actuator.sample.pressure_demand_pa = driven.pressure_demand_pa;
        Ok(())
    }

    /// Feed-forward for the force that will be demanded when a command acts, and trim for the one that is demanded now. `foreseen_n` of
    /// the last change of the former was known ahead of time.
    fn demand_for_force(
        &mut self,
        at: usize,
        [force_n, coming_n]: [f32; 2],
        foreseen_n: f32,
    ) -> (Demand, bool) {
        // Limits and inverse would make a pressure of it.
        if !(force_n.is_finite() && coming_n.is_finite()) {
            return (Demand { pressure_pa: f32::NAN, lookahead_pa: 0.0 }, false);
        }
        let settings = in_register(&self.settings);
        let actuator = &mut self.sides[at];
        actuator.force_demand_n = force_n;
        let model_n = actuator.model_n;
        let model = actuator.model.as_mut().filter(|_| model_n.is_some());
        let (forward, reached) = modes::feed_forward(settings, self.mode, model, coming_n, actuator.guess_pa);
        actuator.guess_pa = forward;
        actuator.forward_pa = forward;
        let measures = settings.force.fitted && actuator.sample.force_n.is_finite();
        actuator.trim_pa = if measures {
            let expected_n = match (settings.feed_forward, model_n, actuator.model.as_ref()) {
                (FeedForward::Table, Some(model_n), Some(model)) => {
                    model_n - model.slope() * actuator.trim_pa
                }
                _ => force_n,
            };
            let error = expected_n - actuator.sample.force_n;
            modes::trim(&settings.force_loop, &mut actuator.trim, error, actuator.saturation)
        } else {
            0.0
        };
        let slope = match (settings.feed_forward, actuator.model.as_ref()) {
            (FeedForward::Table, Some(model)) => model.slope(),
            (FeedForward::Gaylord, Some(model)) => model.at_stroke().posture.area,
            _ => 0.0,
        };
        let lookahead_pa = if slope > 0.0 { foreseen_n / slope } else { 0.0 };
        (Demand { pressure_pa: forward + actuator.trim_pa, lookahead_pa }, reached)
    }

    // Apart from the rest of a step, so that the stack does not hold a joint's forces while an inverse is looked for.
    #[inline(never)]
    fn pair_forces(&mut self) -> Pull {
        let joint = self.settings.joint;
        let [first, second] = &self.sides;
        let present = first.present().is_some() && second.present().is_some();
        let Some(arms) = self.arms().filter(|_| present) else {
            return Pull { forces_n: [0.0; 2], reached: false };
        };
        let speeds = first.motion.motion().speed - second.motion.motion().speed;
        let posed = Posed {
            angle_rad: self.setpoint,
            stiffness_nm_per_rad: self.setpoint_second,
            measured_rad: (first.sample.stroke_m - second.sample.stroke_m) / (2.0 * joint.radius_m),
            rate_rad_per_s: speeds / (2.0 * joint.radius_m),
        };
        let mut pair = self.pair;
        let pull = pair.forces(&joint, &posed, arms, first.saturation - second.saturation);
        self.pair = pair;
        pull
    }

    /// Keeps the commands of a state or mode that does not control: vented, or held by a fault.
    pub(super) fn rest(&mut self) {
        let Self { sides, law, machine, .. } = self;
        for side in sides {
            if machine.state() == State::Fault && !side.command.vent {
                let air = side.air();
                side.regulator.hold(&air, law);
            } else {
                side.vent(law);
            }
        }
    }
}
