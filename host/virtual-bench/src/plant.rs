//! The muscle as a plant for a control loop: pressure command in, sensor readings out, one control period a call.
//!
//! ```
//! use virtual_bench::{bench::BenchSpec, plant::{Motion, Plant}, presets};
//! let bench = BenchSpec::laboratory(presets::miniature(), 7);
//! let mut plant = Plant::new(&bench, &Motion::Held { stroke_mm: 0.5 });
//! let mut readings = plant.readings();
//! for _ in 0..1000 {
//!     readings = plant.step(1e-3, 400e3);
//! }
//! assert!((readings.pressure - 400e3).abs() < 5e3 && readings.force > 40.0);
//! ```

use crate::bench::BenchSpec;
use crate::muscle::Muscle;
use crate::pneumatics::{Air, Pneumatics};
use crate::rig::RigState;
use crate::sensors::Channel;
use crate::valves::{Open, ValvePair, Valves};

mod motion;
mod station;

pub use motion::{Motion, Scripts};
pub use station::{LogRow, PlantStation};

/// What the controller's sensors read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Readings {
    /// Pa gauge.
    pub pressure: f64,
    /// Contraction stroke, m.
    pub stroke: f64,
    /// Reading of the load cell, N.
    pub force: f64,
    /// Bladder temperature, °C.
    pub temperature: f64,
}

/// Temperature of the room, °C.
const AMBIENT: f64 = 22.0;
/// Longest step of the physics, s.
const LONGEST: f64 = 0.25e-3;
/// The same with valves, by which the length of a pulse is resolved.
const SHORTEST_PULSE: f64 = 0.05e-3;

/// A muscle with air, load and sensors under a controller.
#[derive(Debug, Clone)]
pub struct Plant {
    motion: Motion,
    muscle: Muscle,
    air: Air,
    rig: RigState,
    channels: [Channel; 3],
    time: f64,
    stroke: f64,
    speed: f64,
    force: f64,
    temperature: f64,
    readings: Readings,
    done: bool,
    valves: Option<Valves>,
}

/// What gives the muscle its air.
#[derive(Debug, Clone, Copy)]
enum Supply {
    /// The regulator, under a command, Pa.
    Regulator(f64),
    /// The pair of valves, under signals.
    Valves(Open),
}

impl Plant {
    /// A vented muscle at the start of a motion.
    pub fn new(bench: &BenchSpec, motion: &Motion) -> Self {
        Self::with_muscle(Muscle::new(bench.muscle.clone()), bench, motion)
    }

    /// The same with a muscle whose tables are built already.
    pub fn with_muscle(mut muscle: Muscle, bench: &BenchSpec, motion: &Motion) -> Self {
        muscle.reset();
        let (stroke, done) = motion.stroke(0.0);
        let i = &bench.instruments;
        let mut plant = Self {
            air: Air::new(bench.pneumatics, muscle.volume(0.0), bench.seed),
            rig: RigState::new(bench.rig),
            channels: [
                Channel::new(i.pressure, bench.seed, "pressure"),
                Channel::new(i.stroke, bench.seed, "stroke"),
                Channel::new(i.force, bench.seed, "force"),
            ],
            muscle,
            motion: motion.clone(),
            time: 0.0,
            stroke,
            speed: 0.0,
            force: 0.0,
            temperature: AMBIENT,
            readings: Readings::default(),
            done,
            valves: None,
        };
        plant.advance(LONGEST, Supply::Regulator(0.0));
        plant.time = 0.0;
        plant.sample(1e-3);
        plant
    }

    /// Advance by one control period `dt` (s) under a pressure command (Pa); gives the readings at its end.
    pub fn step(&mut self, dt: f64, command: f64) -> Readings {
        let parts = (dt / LONGEST).ceil().clamp(1.0, 1e6) as u32;
        let h = dt / f64::from(parts);
        for _ in 0..parts {
            self.advance(h, Supply::Regulator(command));
        }
        self.sample(dt);
        self.readings
    }

    /// Replaces the regulator by a pair of on/off valves.
    pub fn fit_valves(&mut self, pair: ValvePair) {
        self.valves = Some(Valves::new(pair));
    }

    /// The pair of valves, if one is fitted.
    pub fn valves(&mut self) -> Option<&mut Valves> {
        self.valves.as_mut()
    }

    /// Advance by one control period `dt` (s) under the valves' signals at each time (s) in it; gives the readings at its end.
    pub fn step_valves(&mut self, dt: f64, signals: &dyn Fn(f64) -> Open) -> Readings {
        let parts = (dt / SHORTEST_PULSE).ceil().clamp(1.0, 1e6) as u32;
        let h = dt / f64::from(parts);
        for part in 0..parts {
            self.advance(h, Supply::Valves(signals((f64::from(part) + 0.5) * h)));
        }
        self.sample(dt);
        self.readings
    }

    fn advance(&mut self, h: f64, supply: Supply) {
        self.time += h;
        if let Motion::Load { mass, spring, preload, damper } = self.motion {
            let limit = 0.45 * self.muscle.spec().geometry.rest_length;
            let against = preload + spring * 1e3 * self.stroke;
            // Semi-implicit in the damper; the stops take the speed away.
            self.speed = (self.speed + h * (self.force - against) / mass) / (1.0 + h * damper * 1e3 / mass);
            self.stroke += h * self.speed;
            if self.stroke < 0.0 || self.stroke > limit {
                self.stroke = self.stroke.clamp(0.0, limit);
                self.speed = 0.0;
            }
        } else {
            (self.stroke, self.done) = self.motion.stroke(self.time);
        }
        let (muscle, before) = (&self.muscle, self.air.in_muscle());
        let stroke = self.rig.stroke(self.stroke, |x| muscle.force_after(h, x, before, AMBIENT));
        let volume = self.muscle.volume(stroke);
        let pressure = match (supply, &mut self.valves) {
            (Supply::Valves(signals), Some(valves)) => self.air.advance_valves(h, valves, signals, volume),
            (Supply::Valves(_), None) => self.air.advance(h, 0.0, volume),
            (Supply::Regulator(command), _) => self.air.advance(h, command.max(0.0), volume),
        };
        let drive = self.muscle.advance(h, stroke, pressure, AMBIENT);
        self.force = drive.force;
        self.temperature = drive.temperature;
        self.channels[0].follow(h, self.air.seen());
        self.channels[1].follow(h, self.stroke);
        let at_cell = self.rig.at_cell(drive.force, pressure, stroke, h);
        self.channels[2].follow(h, at_cell);
    }

    fn sample(&mut self, dt: f64) {
        let [pressure, stroke, force] = [0, 1, 2].map(|i| self.channels[i].sample(dt));
        self.readings = Readings { pressure, stroke, force, temperature: self.temperature };
    }

    /// Moves the free end to a stroke (m) within the next `dt` (s), at equal speed; it stays there. For a bench that works
    /// out itself how the muscle moves.
    pub fn drive_to(&mut self, stroke: f64, dt: f64) {
        let points = vec![(self.time, self.stroke * 1e3), (self.time + dt, stroke * 1e3)];
        self.motion = Motion::Path { points };
    }

    /// The air supply, to break it while it runs.
    pub fn pneumatics(&mut self) -> &mut Pneumatics {
        self.air.pneumatics()
    }

    /// The last readings.
    pub fn readings(&self) -> Readings {
        self.readings
    }

    /// True pressure (Pa), stroke (m) and force (N), for the judge.
    pub fn truth(&self) -> Readings {
        Readings {
            pressure: self.air.in_muscle(),
            stroke: self.stroke,
            force: self.force,
            temperature: self.temperature,
        }
    }

    /// Whether the motion script has ended.
    pub fn done(&self) -> bool {
        self.done
    }

    /// The muscle.
    pub fn muscle(&self) -> &Muscle {
        &self.muscle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets;

    #[test]
    fn the_same_seed_gives_the_same_readings_bit_for_bit() {
        let run = |seed| {
            let bench = BenchSpec::laboratory(presets::miniature(), seed);
            let motion = Motion::Sine { mean_mm: 1.0, amplitude_mm: 0.8, frequency_hz: 0.5 };
            let mut plant = Plant::new(&bench, &motion);
            (0..500)
                .map(|i| plant.step(1e-3, 300e3 + 100.0 * f64::from(i)).force.to_bits())
                .collect::<Vec<_>>()
        };
        assert_eq!(run(3), run(3));
        assert_ne!(run(3), run(4));
    }

    #[test]
    fn a_hanging_mass_comes_to_rest_where_the_forces_balance() {
        let mut bench = BenchSpec::laboratory(presets::miniature(), 1);
        bench.instruments = crate::sensors::Instruments::ideal();
        let motion = Motion::Load { mass: 2.0, spring: 0.0, preload: 19.6, damper: 0.2 };
        let mut plant = Plant::new(&bench, &motion);
        for _ in 0..4000 {
            plant.step(1e-3, 500e3);
        }
        let end = plant.truth();
        assert!((end.force - 19.6).abs() < 1.0, "{end:?}");
        assert!(end.stroke > 1e-3, "{end:?}");
    }

    #[test]
    fn a_tick_costs_little_more_than_the_forces_in_it() {
        let bench = BenchSpec::laboratory(presets::contractile(), 1);
        let motion = Motion::Sine { mean_mm: 10.0, amplitude_mm: 5.0, frequency_hz: 0.5 };
        let mut plant = Plant::new(&bench, &motion);
        let muscle = Muscle::new(presets::contractile());
        let seconds = |work: &mut dyn FnMut(usize) -> f64| {
            let start = std::time::Instant::now();
            std::hint::black_box((0..2_000).map(work).sum::<f64>());
            start.elapsed().as_secs_f64()
        };
        // A ratio, and the best of many rounds of each: other programs of the machine lengthen single ones.
        let (mut tick, mut force) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..30 {
            tick = tick.min(seconds(&mut |_| plant.step(1e-3, 400e3).force));
            force = force.min(seconds(&mut |n| muscle.quasi_static(400e3, 1e-6 * n as f64)));
        }
        eprintln!("a tick takes as long as {:.1} quasi-static forces", tick / force);
        assert!(tick < 40.0 * force, "{tick} s and {force} s for two thousand");
    }
}
