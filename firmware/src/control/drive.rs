//! Commands: from what is asked, by way of force and feed-forward, to what the regulators are told.

use model_core::link::messages::{Fault, Mode, Side, State};
use model_core::link::settings::FeedForward;

use super::Controller;
use crate::board::Command;
use crate::modes::{self, Posed};
use crate::tick::TICK_S;
use crate::watch::Finding;

impl Controller {
    /// Makes the commands of the running mode.
    pub(super) fn drive(&mut self) {
        let mut wishes = [(0.0, true); 2];
        match self.mode {
            Mode::Vent => {}
            Mode::Pressure => wishes[0] = (self.asked, true),
            Mode::Force => wishes[0] = self.force_wish(0, self.asked),
            Mode::Stroke => {
                let side = &mut self.sides[0];
                let speed = side.motion.motion().speed;
                let force = modes::stroke_force(
                    &self.settings.stroke_loop,
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
            let Self { settings, sides, .. } = self;
            let actuator = &mut sides[side.index()];
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
    pub(super) fn rest(&mut self) {
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
}
