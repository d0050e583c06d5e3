//! A plant behind the lock-step wire, with a log of its own.

use super::{Motion, Plant, Readings};
use crate::bench::BenchSpec;
use crate::lockstep::{Answer, Station};

/// A line of the bench's own log of a lock-step run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LogRow {
    /// Time in the run, s.
    pub time: f64,
    /// Number of the script.
    pub script: u16,
    /// What the board commanded, Pa.
    pub command: f64,
    /// The board's reported setpoint, N.
    pub setpoint: f64,
    /// What was true.
    pub truth: Readings,
}

/// A plant behind the lock-step wire.
#[derive(Debug)]
pub struct PlantStation {
    bench: BenchSpec,
    scripts: Vec<Motion>,
    period: f64,
    plant: Plant,
    script: u16,
    time: f64,
    log: Vec<LogRow>,
}

impl PlantStation {
    /// A bench with motion scripts and a control period (s). Without scripts the muscle is held at rest length.
    pub fn new(bench: BenchSpec, scripts: Vec<Motion>, period: f64) -> Self {
        let scripts = if scripts.is_empty() { vec![Motion::Held { stroke_mm: 0.0 }] } else { scripts };
        let plant = Plant::new(&bench, &scripts[0]);
        Self { bench, scripts, period, plant, script: 0, time: 0.0, log: Vec::new() }
    }

    /// The plant.
    pub fn plant(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// What happened, one row per period.
    pub fn log(&self) -> &[LogRow] {
        &self.log
    }

    fn answer(&self) -> Answer {
        let r = self.plant.readings();
        let mut status = 0;
        if self.plant.done() {
            status |= Answer::SCRIPT_DONE;
        }
        if self.plant.truth().pressure > 1.25 * self.bench.muscle.max_pressure {
            status |= Answer::BURST;
        }
        Answer {
            status,
            temperature_centi: (r.temperature * 100.0).round() as i16,
            tick: 0,
            pressure: r.pressure as f32,
            stroke: r.stroke as f32,
            force: r.force as f32,
        }
    }
}

impl Station for PlantStation {
    fn reset(&mut self, script: u16) -> Answer {
        let motion = self.scripts.get(usize::from(script)).unwrap_or(&self.scripts[0]);
        self.plant = Plant::with_muscle(self.plant.muscle.clone(), &self.bench, motion);
        self.script = script;
        self.time = 0.0;
        self.answer()
    }

    fn step(&mut self, pressure_command: f32, setpoint: f32) -> Answer {
        self.plant.step(self.period, f64::from(pressure_command));
        self.time += self.period;
        self.log.push(LogRow {
            time: self.time,
            script: self.script,
            command: f64::from(pressure_command),
            setpoint: f64::from(setpoint),
            truth: self.plant.truth(),
        });
        self.answer()
    }
}
