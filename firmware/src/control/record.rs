//! What a tick leaves behind: outputs, trace, telemetry.

use heapless::Vec;
use model_core::link::messages::{Event, Mode, Side, SideSample, State, Telemetry, Variable};

use super::actuator::Actuator;
use super::{Controller, Stepped};
use crate::board::Outputs;

impl Controller {
    pub(super) fn record(&mut self) -> Stepped {
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
