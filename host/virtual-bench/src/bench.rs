//! The bench at work: a protocol carried out on a muscle, with its air, its rig and its instruments.

use crate::muscle::{Muscle, MuscleSpec};
use crate::pneumatics::{Air, Pneumatics};
use crate::protocol::{Place, Protocol, ProtocolError, Step};
use crate::recording::{Recording, Row};
use crate::rig::{Rig, RigState};
use crate::sensors::{Channel, Instruments};
use serde::{Deserialize, Serialize};

/// A muscle on a bench; everything that a recording depends on, except the protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BenchSpec {
    /// The muscle.
    pub muscle: MuscleSpec,
    /// Regulator and line.
    pub pneumatics: Pneumatics,
    /// Frame, joints and moving mass.
    #[serde(default)]
    pub rig: Rig,
    /// Sensors of pressure, stroke, and force, with their errors.
    pub instruments: Instruments,
    /// Seed of all noise.
    pub seed: u64,
}

impl BenchSpec {
    /// A good laboratory bench for a muscle: default regulator, stiff rig, instruments ranged for the muscle.
    pub fn laboratory(muscle: MuscleSpec, seed: u64) -> Self {
        let m = Muscle::new(muscle);
        let top = m.spec().max_pressure;
        let instruments =
            Instruments::laboratory(m.quasi_static(top, 0.0).max(1.0), m.free_stroke(top).max(1e-4), top);
        Self {
            muscle: m.spec().clone(),
            pneumatics: Pneumatics::default(),
            rig: Rig::default(),
            instruments,
            seed,
        }
    }
}

/// Slowest rate at which the physics is advanced, Hz.
const SLOWEST: f64 = 100.0;
/// The crosshead's lag, s: it does not turn in an instant.
const CROSSHEAD: f64 = 0.01;

/// A bench with everything mounted.
#[derive(Debug, Clone)]
pub struct Bench {
    muscle: Muscle,
    air: Air,
    rig: RigState,
    channels: [Channel; 3],
    ambient: f64,
    clock: f64,
    command: f64,
    aim: f64,
    crosshead: f64,
    rounded: f64,
    cycle: u32,
    temperature: f64,
    files: Vec<Recording>,
    open: bool,
}

/// Where one stretch of a protocol leads.
#[derive(Clone, Copy)]
enum Path {
    /// Straight to a crosshead position (m) and pressure command (Pa).
    Straight(f64, f64),
    /// Sine of an amplitude (m) and a frequency (Hz) about the present position.
    Sine(f64, f64),
}

impl Bench {
    /// Mount the muscle, vented, at rest length.
    pub fn new(spec: &BenchSpec) -> Self {
        let muscle = Muscle::new(spec.muscle.clone());
        let air = Air::new(spec.pneumatics, muscle.volume(0.0), spec.seed);
        let i = &spec.instruments;
        let channels = [
            Channel::new(i.pressure, spec.seed, "pressure"),
            Channel::new(i.stroke, spec.seed, "stroke"),
            Channel::new(i.force, spec.seed, "force"),
        ];
        Self {
            muscle,
            air,
            rig: RigState::new(spec.rig),
            channels,
            ambient: 22.0,
            clock: 0.0,
            command: 0.0,
            aim: 0.0,
            crosshead: 0.0,
            rounded: 0.0,
            cycle: 0,
            temperature: 22.0,
            files: Vec::new(),
            open: false,
        }
    }

    /// The muscle as mounted.
    pub fn muscle(&self) -> &Muscle {
        &self.muscle
    }

    /// Seconds since the bench was switched on.
    pub fn clock(&self) -> f64 {
        self.clock
    }

    /// Carry out a protocol and give its files. The muscle keeps what happened to it: a second protocol continues from there.
    pub fn run(&mut self, protocol: &Protocol) -> Result<Vec<Recording>, ProtocolError> {
        protocol.check()?;
        self.files = Vec::new();
        self.open = false;
        if !protocol.step.iter().any(|s| matches!(s, Step::File { .. })) {
            self.files.push(Recording { name: protocol.name.clone(), rows: Vec::new() });
            self.open = true;
        }
        for step in &protocol.step {
            self.step(step, protocol.sample_hz);
        }
        self.open = false;
        let mut files = std::mem::take(&mut self.files);
        files.retain(|f| !f.rows.is_empty());
        Ok(files)
    }

    fn stroke_of(&self, to: &Place) -> f64 {
        if let Some(mm) = to.mm {
            mm * 1e-3
        } else if let Some(c) = to.contraction {
            c * self.muscle.spec().geometry.rest_length
        } else {
            to.free.unwrap_or(0.0) * self.muscle.free_stroke(self.command)
        }
    }

    fn step(&mut self, step: &Step, hz: f64) {
        match step {
            Step::File { name } => {
                self.files.push(Recording { name: name.clone(), rows: Vec::new() });
                self.open = true;
            }
            Step::EndFile => self.open = false,
            Step::Tare { seconds } => {
                let open = std::mem::replace(&mut self.open, false);
                self.vent(hz);
                self.open = open;
                self.go(Path::Straight(0.0, 0.0), *seconds, hz);
            }
            Step::Rest { seconds } => {
                let open = std::mem::replace(&mut self.open, false);
                self.vent(hz);
                self.go(Path::Straight(0.0, 0.0), *seconds, hz.min(1.0));
                self.open = open;
            }
            Step::Pressure { to_kpa, rate_kpa_s, settle_s } => {
                let to = to_kpa * 1e3;
                if let Some(rate) = rate_kpa_s {
                    let seconds = (to - self.command).abs() / (rate * 1e3);
                    self.go(Path::Straight(self.aim, to), seconds, hz);
                }
                self.command = to;
                self.go(Path::Straight(self.aim, to), *settle_s, hz);
            }
            Step::Move { to, speed_mm_s } => {
                let to = self.stroke_of(to);
                self.go(Path::Straight(to, self.command), (to - self.aim).abs() / (speed_mm_s * 1e-3), hz);
            }
            Step::Cycles { to, speed_mm_s, count } => {
                let (from, to) = (self.aim, self.stroke_of(to));
                let seconds = (to - from).abs() / (speed_mm_s * 1e-3);
                for _ in 0..*count {
                    self.cycle += 1;
                    self.go(Path::Straight(to, self.command), seconds, hz);
                    self.go(Path::Straight(from, self.command), seconds, hz);
                }
            }
            Step::Hold { seconds } => self.go(Path::Straight(self.aim, self.command), *seconds, hz),
            Step::Sine { amplitude_mm, frequency_hz, seconds } => {
                self.go(Path::Sine(amplitude_mm * 1e-3, *frequency_hz), *seconds, hz);
            }
        }
        if matches!(step, Step::File { .. }) {
            self.cycle = 0;
        }
    }

    fn vent(&mut self, hz: f64) {
        let speed = 0.05 * self.muscle.spec().geometry.rest_length;
        self.go(Path::Straight(0.0, self.command), self.aim.abs() / speed, hz);
        self.command = 0.0;
        self.go(Path::Straight(0.0, 0.0), 2.0, hz);
    }

    /// Follow a path for some seconds, sampling at `hz`.
    fn go(&mut self, path: Path, seconds: f64, hz: f64) {
        let samples = (seconds * hz).round() as u64;
        let within = (SLOWEST / hz).ceil().max(1.0) as u64;
        let dt = 1.0 / (hz * within as f64);
        let (x0, p0) = (self.aim, self.command);
        let total = (samples * within).max(1) as f64;
        for i in 0..samples {
            for j in 0..within {
                let part = (i * within + j + 1) as f64 / total;
                match path {
                    Path::Straight(x, p) => {
                        self.aim = x0 + (x - x0) * part;
                        self.command = p0 + (p - p0) * part;
                    }
                    Path::Sine(amplitude, frequency) => {
                        let t = part * total * dt;
                        self.aim = x0 + amplitude * (std::f64::consts::TAU * frequency * t).sin();
                    }
                }
                self.advance(dt);
            }
            self.sample(1.0 / hz);
        }
        if let Path::Straight(x, p) = path {
            (self.aim, self.command) = (x, p);
        }
    }

    fn advance(&mut self, dt: f64) {
        self.clock += dt;
        // Two lags in a row: position and speed of the crosshead are both continuous.
        let blend = 1.0 - (-dt / CROSSHEAD).exp();
        self.rounded += (self.aim - self.rounded) * blend;
        self.crosshead += (self.rounded - self.crosshead) * blend;
        let (muscle, before, ambient) = (&self.muscle, self.air.in_muscle(), self.ambient);
        let stroke = self.rig.stroke(self.crosshead, |x| muscle.force_after(dt, x, before, ambient));
        let pressure = self.air.advance(dt, self.command, self.muscle.volume(stroke));
        let drive = self.muscle.advance(dt, stroke, pressure, self.ambient);
        self.temperature = drive.temperature;
        let at_cell = self.rig.at_cell(drive.force, pressure, stroke, dt);
        self.channels[0].follow(dt, self.air.seen());
        self.channels[1].follow(dt, self.crosshead);
        self.channels[2].follow(dt, at_cell);
    }

    fn sample(&mut self, dt: f64) {
        let reading = [0, 1, 2].map(|i| self.channels[i].sample(dt));
        if self.open
            && let Some(file) = self.files.last_mut()
        {
            file.rows.push(Row {
                time: self.clock,
                command: self.command,
                pressure: reading[0],
                stroke: reading[1],
                force: reading[2],
                temperature: self.temperature,
                cycle: self.cycle,
            });
        }
    }
}
