//! From an effect's name to physics of the bench, with one strength that is tuned until the effect has the requested size.

use serde::{Deserialize, Serialize};
use virtual_bench::bench::BenchSpec;
use virtual_bench::muscle::Muscle;
use virtual_bench::physics::{
    Activated, Ageing, BristleDamping, Fold, Heat, Jam, Mullins, Relaxation, Relays, Seal, Set, Slip, Slow,
    StrandContact, Viscous, Wear,
};
use virtual_bench::rng::Rng;

/// Sizes of a muscle and its campaign by which strengths are scaled.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// Blocked force at the highest level, N.
    pub force: f64,
    /// Free stroke at the highest level, m.
    pub stroke: f64,
    /// Highest level, Pa.
    pub pressure: f64,
    /// Slow speed of the protocol, m/s.
    pub speed: f64,
    /// Duration of the campaign, s.
    pub duration: f64,
    /// Mean I1 − 3 of the rubber at the free stroke.
    pub stretch: f64,
    /// Mean friction factor.
    pub factor: f64,
}

impl Scale {
    /// Of a muscle at its levels (Pa).
    pub fn new(muscle: &Muscle, levels: &[f64], speed: f64, duration: f64) -> Self {
        let pressure = levels.iter().copied().fold(0.0, f64::max);
        let stroke = muscle.free_stroke(pressure);
        let f = &muscle.spec().friction;
        let factor = levels.iter().map(|&p| f.factor(p)).sum::<f64>() / levels.len().max(1) as f64;
        Self {
            force: muscle.quasi_static(pressure, 0.0),
            stroke,
            pressure,
            speed,
            duration,
            stretch: muscle.stretch(stroke),
            factor,
        }
    }
}

/// A true parameter of an injected effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// What it is.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// Width of a play of strength 1, in parts of the free stroke.
const PLAY: f64 = 0.008;

/// An effect whose shape is drawn and whose strength is still open.
#[derive(Debug, Clone)]
pub struct Injection {
    /// Name in the catalogue, or of a mechanism outside it.
    pub name: &'static str,
    /// Random numbers that fix the shape: always the same for one trial, regardless of the strength.
    seed: u64,
}

impl Injection {
    /// Draw the shape of an effect.
    pub fn new(name: &'static str, seed: u64) -> Self {
        Self { name, seed }
    }

    /// Largest strength that is still the effect and not nonsense.
    pub fn strongest(&self) -> f64 {
        match self.name {
            "tip-effect" => 0.6,
            "pressure-sensor-lag" => 5.0,
            "misalignment" => 3.4,
            "presliding-hysteresis" => 1.0,
            "friction-asymmetry" => 6.0,
            "contact-loss" => 4.0,
            "mullins-softening" => 4.0,
            "cyclic-softening" => 8.0,
            "breakaway-friction" => 8.0,
            "clipped-cell" => 1.0,
            _ => 60.0,
        }
    }

    /// Of a play at strength 1: its width in parts of the free stroke.
    pub const fn share_of_stroke(&self) -> f64 {
        PLAY
    }

    /// Put the effect on a bench at strength `s` (about 1 for an effect of 1 to 2 % of the blocked force); gives its
    /// true parameters.
    pub fn apply(&self, bench: &mut BenchSpec, scale: &Scale, s: f64) -> Vec<Parameter> {
        let mut r = Rng::stream(self.seed, self.name);
        let Scale { force: f, stroke: x, pressure: p, speed: v, duration, stretch, factor } = *scale;
        let sign = if r.chance(0.5) { 1.0 } else { -1.0 };
        let physics = &mut bench.muscle.physics;
        let rig = &mut bench.rig;
        let sensors = &mut bench.instruments;
        let mut said = Vec::new();
        let mut say = |name: &str, value: f64, unit: &str| {
            said.push(Parameter { name: name.into(), value, unit: unit.into() });
        };
        match self.name {
            "coulomb-friction" => {
                let dry = 0.01 * f * s;
                physics.seal =
                    Some(Seal { dry, per_pressure: 0.0, travel: 2e-4 * x, slow: 0.0, slow_speed: 0.0 });
                say("force", dry, "N");
            }
            "seal-friction" => {
                let (dry, per_pressure) = (0.005 * f * s, 0.01 * f * s / p);
                let seal = Seal {
                    dry,
                    per_pressure,
                    travel: 5e-4 * x,
                    slow: r.range(0.0, 0.4),
                    slow_speed: 2.0 * v,
                };
                physics.seal = Some(seal);
                say("force", dry, "N");
                say("per_pressure", per_pressure, "N/Pa");
            }
            "pressure-friction" => {
                physics.strands = Some(StrandContact { area: 0.01 * f * s / p });
                say("area", 0.01 * f * s / p, "m2");
            }
            "friction-asymmetry" => {
                bench.muscle.friction.asymmetry = sign * 0.1 * s;
                say("asymmetry", sign * 0.1 * s, "");
            }
            "breakaway-friction" => {
                let law = Ageing {
                    strength: 0.06 * s,
                    time: r.log_range(0.3, 3.0),
                    travel: x * r.log_range(4e-3, 2e-2),
                };
                physics.ageing = Some(law);
                say("travel", law.travel, "m");
            }
            "stribeck-friction" => {
                let law = Slow { strength: 0.1 * s / factor * 0.1, speed: v * r.log_range(0.5, 6.0) };
                physics.slow = Some(law);
                say("speed", law.speed, "m/s");
            }
            "presliding-hysteresis" => {
                let mean = x * r.log_range(0.01, 0.08);
                let short = bench.muscle.friction.bristles.clone();
                let mut bristles: Vec<(f64, f64)> = short.iter().map(|b| (b.0 * (1.0 - s), b.1)).collect();
                bristles.extend([(0.4, 0.4), (0.35, 1.0), (0.25, 2.2)].map(|(a, d)| (a * s, d * mean)));
                bench.muscle.friction.bristles = bristles;
                say("travel", mean, "m");
            }
            "minor-loop-memory" => {
                let law = Relays { area: 0.03 * f * s / p, span: 1.1 * x, widest: r.range(0.2, 0.7) };
                physics.relays = Some(law);
                say("widest", law.widest * law.span, "m");
            }
            "viscous-damping" => {
                let law = Viscous { drag: 0.005 * f / v * s, per_pressure: 0.0 };
                physics.viscous = Some(law);
                say("damping", law.drag, "N·s/m");
            }
            "rate-power" => {
                physics.activated =
                    Some(Activated { strength: 0.02 * s / factor, speed: v * r.log_range(0.01, 0.3) });
            }
            "stress-relaxation" => {
                let branches = 1 + r.index(3);
                let fastest = r.log_range(2.0, 40.0);
                let law = Relaxation { strength: 0.05 * s, fastest, branches, exponent: r.range(0.1, 0.6) };
                physics.relaxation = Some(law);
                say("time", law.fastest, "s");
            }
            "log-creep" => {
                physics.creep =
                    Some(Relaxation { strength: 0.004 * s, fastest: 0.5, branches: 9, exponent: 0.0 });
                say("per_decade", 0.008 * s, "");
            }
            "mullins-softening" => {
                let law = Mullins {
                    loss: 0.15 * s.min(4.0),
                    width: r.range(0.3, 0.9),
                    conditioned: stretch * r.range(0.0, 0.15),
                };
                physics.mullins = Some(law);
                say("loss", law.loss, "");
            }
            "cyclic-softening" => {
                physics.wear = Some(Wear { loss: 0.08 * s, path: 2.0 * stretch * r.range(3.0, 12.0) });
                say("loss", 0.08 * s, "");
            }
            "thermal-softening" => {
                let power = 2.0 * factor * 0.4 * f * x / 54.0 * 27.0 * v / x.max(1e-9);
                let rise = r.range(4.0, 15.0);
                let cooling = power.max(1e-9) / rise;
                let law = Heat {
                    capacity: cooling * r.range(200.0, 900.0),
                    to_fittings: cooling * 2.0,
                    fittings: cooling * r.range(200.0, 900.0),
                    to_room: cooling * 2.0,
                    stiffness: 0.0034 * s,
                    friction: -0.004 * s,
                    hysteresis: 0.05,
                };
                physics.heat = Some(law);
                say("stiffness", law.stiffness, "1/K");
            }
            "permanent-set" => {
                let law = Set { travel: 0.015 * x * s, force: f, time: duration * r.log_range(0.05, 0.4) };
                physics.set = Some(law);
                say("travel", law.travel, "m");
            }
            "end-slip" => {
                let law = Slip { time: duration * r.range(0.25, 0.75), travel: 0.015 * x * s };
                physics.slip = Some(law);
                say("time", law.time, "s");
                say("travel", law.travel, "m");
            }
            "tip-effect" => bench.muscle.shape.ends = s.min(0.6),
            "braid-elasticity" => {
                let stiffness = 60.0 * f / s.max(1e-3);
                bench.muscle.shape.fibre_stiffness = Some(stiffness);
                say("stiffness", stiffness, "N");
            }
            "contact-loss" => {
                physics.uneven_contact = Some(0.05 * p * s);
                say("pressure", 0.05 * p * s, "Pa");
            }
            "strand-jamming" => {
                let law = Jam { force: 0.004 * f * s, stroke: 0.85 * x, width: x * r.range(0.05, 0.1) };
                physics.jam = Some(law);
                say("stroke", law.stroke, "m");
            }
            "gauge-gain" => {
                sensors.pressure.gain = sign * 0.01 * s;
                say("gain", sign * 0.01 * s, "");
            }
            "pressure-lag" => {
                bench.pneumatics.sensor_at_regulator = true;
                bench.pneumatics.line = 0.06 * s;
                say("time", 0.06 * s, "s");
            }
            "pressure-sensor-lag" => {
                sensors.pressure.lag = 0.1 * s;
                say("time", 0.1 * s, "s");
            }
            "leak" => {
                bench.pneumatics.sensor_at_regulator = true;
                bench.pneumatics.leak = 0.01 * s;
                say("share", 0.01 * s, "");
            }
            "inertia" => {
                rig.mass = 0.2 * s;
                say("mass", rig.mass, "kg");
            }
            "gravity" => {
                rig.weight = sign * 0.01 * f * s;
                say("force", rig.weight, "N");
            }
            "misalignment" => {
                (rig.misalignment, rig.guide) = ((0.03 * s).min(0.5), r.range(0.2, 0.5));
                say("angle", rig.misalignment, "rad");
            }
            "rig-compliance" => {
                rig.stiffness = f / (0.01 * x * s);
                say("stiffness", rig.stiffness, "N/m");
            }
            "backlash" => {
                rig.play = PLAY * x * s;
                say("width", rig.play, "m");
            }
            "force-offset" => {
                sensors.force.offset = sign * 0.01 * f * s;
                say("force", sensors.force.offset, "N");
            }
            "force-drift" => rig.warm_up = (sign * 0.01 * f * s, duration * r.log_range(0.2, 2.0)),
            "force-gain" => {
                sensors.force.gain = sign * 0.012 * s;
                say("gain", sensors.force.gain, "");
            }
            "cross-talk" => {
                rig.hose = sign * 0.01 * f * s / p;
                say("area", rig.hose, "N/Pa");
            }
            "sensor-delay" => {
                (sensors.force.delay, sensors.force.lag) = (0.05 * s, 0.02 * s);
                say("time", 0.07 * s, "s");
            }
            "displacement-offset" => {
                rig.offset = sign * 0.006 * x * s;
                say("travel", rig.offset, "m");
            }
            "hose-spring" => physics.hose_spring = Some(0.02 * f * s / x),
            "bladder-fold" => {
                let fold = Fold { force: 0.01 * f * s, stroke: x * r.range(0.25, 0.7), width: 0.05 * x };
                physics.fold = Some(fold);
            }
            "bristle-damping" => {
                let travel = x * r.log_range(0.02, 0.08);
                physics.bristle_damping =
                    Some(BristleDamping { damping: 0.01 * f * s * travel / (2.0 * v), travel });
            }
            "room-swing" => physics.room_swing = Some((0.03 * s, r.range(250.0, 900.0))),
            "breathing-room" => rig.room = (0.01 * f * s, r.range(90.0, 400.0)),
            "stick-slip-mounts" => rig.stick_slip = (0.01 * f * s, x * r.range(0.02, 0.08)),
            "mains-beat" => rig.hum = (0.01 * f * s, r.range(0.3, 1.7)),
            "clipped-cell" => sensors.force.full_scale = f * (1.0 - 0.3 * s.min(1.0)),
            "coarse-converter" => sensors.force.quantum = 0.02 * f * s,
            _ => {}
        }
        said
    }
}
