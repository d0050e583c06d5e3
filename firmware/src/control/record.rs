//! What a tick leaves behind: outputs, trace, telemetry.

use model_core::link::messages::{Event, Mode, Side, State, Variable};

use super::actuator::Actuator;
use super::{Controller, Notice};
use crate::board::{Command, Outputs};
use crate::outbox::{SIDES, Sample};
use crate::pair;
use crate::valves::Valves;

impl Controller {
    pub(super) fn record(&mut self) -> Outputs {
        for side in &mut self.sides {
            side.sample.command_pa = if side.command.vent { 0.0 } else { side.command.pressure_pa };
        }
        let settings = &self.settings;
        let [first, second] = &mut self.sides;
        // A board for one muscle has no second output.
        let second = if pair::SUPPORTED { second.pulse(settings) } else { Valves::Absent };
        let valves = [first.pulse(settings), second];
        let Self { trace, sides, machine, tick, setpoint, step_us, .. } = self;
        let state = machine.state();
        // An output whose place the valves have taken fills nothing.
        let level = |command: &Command| match self.settings.valves.is_fitted() {
            true => 0.0,
            false => self.settings.command.part(command.pressure_pa),
        };
        let full = trace.sample(*tick, |variable| value_of(variable, sides, state, *setpoint, *step_us));
        if full {
            self.notice = self.notice.or(Some(Notice::TraceFull));
        }
        Outputs {
            sides: [self.sides[0].command, self.sides[1].command],
            levels: [
                level(&self.sides[0].command),
                // A board for one muscle has no second output.
                if pair::SUPPORTED { level(&self.sides[1].command) } else { 0.0 },
            ],
            valves,
            state,
            setpoint: if self.mode == Mode::Force { self.setpoint } else { self.sides[0].force_demand_n },
        }
    }

    /// Something to report the host, once.
    #[inline(never)]
    pub fn take_event(&mut self) -> Option<Event> {
        match self.notice.take()? {
            Notice::Fault => self.faults().latched.map(Event::Fault),
            Notice::State(state) => Some(Event::State(state)),
            Notice::TraceFull => Some(Event::TraceFull),
        }
    }

    /// The sample of this tick, if one is due; to be setpoint for once in each.
    #[inline(never)]
    pub fn take_sample(&mut self) -> Option<Sample> {
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
        let used = if self.uses(Side::Antagonist) { SIDES as u8 } else { 1 };
        Some(Sample {
            number,
            tick: self.tick,
            state: self.machine.state(),
            mode: self.mode,
            setpoint: self.setpoint,
            setpoint_second: self.setpoint_second,
            used,
            all: core::array::from_fn(|at| self.sides[at].sample),
        })
    }
}

fn value_of(variable: Variable, sides: &[Actuator; 2], state: State, setpoint: f32, step_us: f32) -> f32 {
    let [first, second] = sides;
    match variable {
        Variable::Pressure => first.sample.pressure_pa,
        Variable::Stroke => first.sample.stroke_m,
        Variable::Force => first.sample.force_n,
        Variable::Speed => first.motion.motion().speed,
        Variable::Direction => first.motion.motion().direction,
        Variable::Setpoint => setpoint,
        Variable::ForceDemand => first.force_demand_n,
        Variable::FeedForward => first.forward_pa,
        Variable::Trim => first.trim_pa,
        Variable::PressureDemand => first.sample.pressure_demand_pa,
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
