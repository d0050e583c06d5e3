//! The changes that can be named: what each does to the force, and whose it is.

use serde::Serialize;

use super::cells::Means;

/// Changes that recordings often cannot distinguish; a class is right where the name may not be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// The load cell's zero.
    Zero,
    /// What grows with force or pressure.
    Gain,
    /// The gauge's zero, or the deadband.
    GaugeOffset,
    /// The gap between the directions.
    Friction,
    /// A step of the length within AFTER.
    EndSlip,
    /// The force is late.
    SensorDelay,
    /// The pressure reading is late.
    PressureSensorLag,
    /// Friction that falls or grows slowly with speed.
    SlowSpeed,
    /// What grows with speed, or comes late.
    RateOrPhase,
    /// The actuator softens with cycles or warmth.
    Softening,
    /// Stress that relaxes, or creep.
    Relaxation,
    /// Friction that remembers reversals.
    TurningMemory,
    /// An effect that no other is often mistaken for.
    Alone(&'static str),
}

impl Class {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Gain => "gain",
            Self::GaugeOffset => "gauge-offset",
            Self::Friction => "friction",
            Self::EndSlip => "end-slip",
            Self::SensorDelay => "sensor-delay",
            Self::PressureSensorLag => "pressure-sensor-lag",
            Self::SlowSpeed => "slow-speed",
            Self::RateOrPhase => "rate-or-phase",
            Self::Softening => "softening",
            Self::Relaxation => "relaxation",
            Self::TurningMemory => "turning-memory",
            Self::Alone(name) => name,
        }
    }
}

impl Serialize for Class {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

/// Whose a change is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Owner {
    /// A sensor or its wiring.
    Sensor,
    /// Frame, clamps, hoses.
    Rig,
    /// The actuator itself.
    Muscle,
    /// Sensor or actuator: force and pressure alone cannot say which.
    SensorOrMuscle,
    /// Rig or actuator.
    RigOrMuscle,
}

/// A change that can be named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)] // The table below says what each is.
pub enum Change {
    ForceOffset,
    ForceDrift,
    ForceGain,
    GaugeGain,
    CrossTalk,
    DisplacementOffset,
    RigCompliance,
    ElasticStiffening,
    GaugeOffset,
    CoulombFriction,
    PressureFriction,
    FrictionFactor,
    EndSlip,
    SensorDelay,
    PressureSensorLag,
    /// Another effect of the catalogue, tested for strokes of a described muscle.
    Effect(&'static str),
}

/// One line of the table of changes.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Which one.
    pub change: Change,
    /// Its name, as in the catalogue of effects where it is listed.
    pub name: &'static str,
    /// Its class.
    pub class: Class,
    /// Whose it is.
    pub owner: Owner,
    /// Name and SI unit of its size.
    pub parameter: (&'static str, &'static str),
    /// Its law.
    pub law: &'static str,
}

const fn about(
    change: Change,
    name: &'static str,
    class: Class,
    owner: Owner,
    parameter: (&'static str, &'static str),
    law: &'static str,
) -> About {
    About { change, name, class, owner, parameter, law }
}

/// Every change, in the order in which they are weighed.
pub const CHANGES: [About; 15] = [
    about(Change::ForceOffset, "force-offset", Class::Zero, Owner::Sensor, ("offset", "N"), "ΔF = b"),
    about(Change::ForceGain, "force-gain", Class::Gain, Owner::Sensor, ("gain", ""), "ΔF = γ·F"),
    about(Change::GaugeGain, "gauge-gain", Class::Gain, Owner::Sensor, ("gain", ""), "ΔF = −γ·P·∂F/∂P"),
    about(
        Change::GaugeOffset,
        "gauge-offset",
        Class::GaugeOffset,
        Owner::SensorOrMuscle,
        ("offset", "Pa"),
        "ΔF = −δ·∂F/∂P",
    ),
    about(Change::CrossTalk, "cross-talk", Class::Gain, Owner::Rig, ("thrust_area", "m²"), "ΔF = c·P"),
    about(
        Change::DisplacementOffset,
        "displacement-offset",
        Class::Gain,
        Owner::Rig,
        ("offset", "m"),
        "ΔF = δ·∂F/∂x",
    ),
    about(
        Change::CoulombFriction,
        "coulomb-friction",
        Class::Friction,
        Owner::RigOrMuscle,
        ("force", "N"),
        "ΔF = −f·sgn v",
    ),
    about(
        Change::PressureFriction,
        "pressure-friction",
        Class::Friction,
        Owner::RigOrMuscle,
        ("force_per_pressure", "m²"),
        "ΔF = −μ·P·sgn v",
    ),
    about(
        Change::FrictionFactor,
        "friction-factor",
        Class::Friction,
        Owner::Muscle,
        ("factor", ""),
        "ΔF = −k·F·sgn v",
    ),
    about(
        Change::ElasticStiffening,
        "elastic-stiffening",
        Class::Gain,
        Owner::Muscle,
        ("stiffening", ""),
        "ΔF = η·(F − P·∂F/∂P)",
    ),
    about(Change::ForceDrift, "force-drift", Class::Zero, Owner::Sensor, ("drift_to_end", "N"), "ΔF = δ·t/T"),
    about(
        Change::RigCompliance,
        "rig-compliance",
        Class::Gain,
        Owner::Rig,
        ("compliance", "m/N"),
        "ΔF = c·F·∂F/∂x",
    ),
    about(
        Change::EndSlip,
        "end-slip",
        Class::EndSlip,
        Owner::RigOrMuscle,
        ("slip", "m"),
        "ΔF = δ·∂F/∂x from one moment on",
    ),
    about(
        Change::SensorDelay,
        "sensor-delay",
        Class::SensorDelay,
        Owner::Sensor,
        ("delay", "s"),
        "F(t) = S(P(t − τ))",
    ),
    about(
        Change::PressureSensorLag,
        "pressure-sensor-lag",
        Class::PressureSensorLag,
        Owner::Sensor,
        ("time_constant", "s"),
        "P reads late by a first-order lag τ",
    ),
];

const fn effect(name: &'static str, class: Class, owner: Owner, law: &'static str) -> About {
    about(Change::Effect(name), name, class, owner, ("size", ""), law)
}

/// The catalogue's further effects, which strokes of a described muscle can show. Classes as the catalogue computed them.
pub const EFFECTS: [About; 24] = [
    effect("pressure-lag", Class::RateOrPhase, Owner::RigOrMuscle, "pressure at the muscle lags"),
    effect("leak", Class::Gain, Owner::RigOrMuscle, "air lost on the way costs pressure"),
    effect("tip-effect", Class::Alone("tip-effect"), Owner::Muscle, "the ends are no cylinders"),
    effect("braid-elasticity", Class::Gain, Owner::Muscle, "the braid's fibres stretch"),
    effect(
        "contact-loss",
        Class::Alone("contact-loss"),
        Owner::Muscle,
        "the bladder does not touch the braid yet",
    ),
    effect(
        "strand-jamming",
        Class::Alone("strand-jamming"),
        Owner::Muscle,
        "strands lock at the stroke's end",
    ),
    effect(
        "permanent-set",
        Class::Alone("permanent-set"),
        Owner::Muscle,
        "the muscle stays longer with every cycle",
    ),
    effect(
        "mullins-softening",
        Class::Alone("mullins-softening"),
        Owner::Muscle,
        "the first stretch softens the bladder",
    ),
    effect("cyclic-softening", Class::Softening, Owner::Muscle, "the bladder softens with cycles"),
    effect("thermal-softening", Class::Softening, Owner::Muscle, "the bladder softens as it warms"),
    effect("stress-relaxation", Class::Relaxation, Owner::Muscle, "part of the bladder's stress relaxes"),
    effect("log-creep", Class::Relaxation, Owner::Muscle, "force creeps with the logarithm of time"),
    effect("friction-asymmetry", Class::Gain, Owner::Muscle, "friction differs between the directions"),
    effect("seal-friction", Class::Friction, Owner::Muscle, "a rod's seal rubs"),
    effect(
        "breakaway-friction",
        Class::Alone("breakaway-friction"),
        Owner::Muscle,
        "friction is higher after a rest",
    ),
    effect("stribeck-friction", Class::SlowSpeed, Owner::Muscle, "friction falls with speed"),
    effect(
        "presliding-hysteresis",
        Class::TurningMemory,
        Owner::Muscle,
        "friction builds up after a reversal",
    ),
    effect("minor-loop-memory", Class::TurningMemory, Owner::Muscle, "small loops remember at the reversal"),
    effect("viscous-damping", Class::RateOrPhase, Owner::Muscle, "friction proportional to speed"),
    effect("rate-power", Class::SlowSpeed, Owner::Muscle, "friction by a power of speed"),
    effect("inertia", Class::Alone("inertia"), Owner::Rig, "moving masses"),
    effect("gravity", Class::Zero, Owner::Rig, "weight in the load path"),
    effect("misalignment", Class::Friction, Owner::Rig, "muscle and cell out of line"),
    effect("backlash", Class::Alone("backlash"), Owner::Rig, "a loose joint"),
];

impl Change {
    /// Whether it is a lag between channels, which rows in motion show.
    pub(super) fn is_lag(self) -> bool {
        matches!(self, Self::SensorDelay | Self::PressureSensorLag)
    }

    /// Its line of the table.
    #[must_use]
    pub fn about(self) -> &'static About {
        let all = CHANGES.iter().chain(&EFFECTS);
        all.into_iter().find(|a| a.change == self).unwrap_or(&CHANGES[0])
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// The change of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        CHANGES.iter().chain(&EFFECTS).find(|a| a.name == name).map(|a| a.change)
    }

    /// Its class.
    #[must_use]
    pub fn class(self) -> Class {
        self.about().class
    }

    /// Its class among strokes, where a late channel and a force that grows with speed have the same shape.
    #[must_use]
    pub fn stroke_class(self) -> Class {
        match self {
            Self::SensorDelay => Class::RateOrPhase,
            _ => self.class(),
        }
    }

    /// Whether its law depends on what happened before: then it has no moment at which it began.
    pub(super) fn remembers(self) -> bool {
        matches!(
            self.class(),
            Class::Softening
                | Class::Relaxation
                | Class::TurningMemory
                | Class::Alone("permanent-set" | "mullins-softening" | "breakaway-friction" | "backlash")
        )
    }

    /// What it adds to the force of an AFTER cell per unit of its size; `None` for those that no settled cell shows by a fixed shape.
    pub(super) fn shape(self, m: &Means, direction: f64) -> Option<f64> {
        Some(match self {
            Self::ForceOffset => 1.0,
            Self::ForceDrift => m.clock,
            Self::ForceGain => m.force,
            Self::GaugeGain => -m.pressure_by_pressure,
            Self::CrossTalk => m.pressure,
            Self::DisplacementOffset => m.by_stroke,
            Self::RigCompliance => m.force_by_stroke,
            Self::ElasticStiffening => m.elastic,
            Self::GaugeOffset => -m.by_pressure,
            Self::CoulombFriction => -direction,
            Self::PressureFriction => -direction * m.pressure,
            Self::FrictionFactor => -direction * m.force,
            Self::EndSlip | Self::SensorDelay | Self::PressureSensorLag | Self::Effect(_) => return None,
        })
    }

    /// Whether it is an error of the bench that the host corrects, and no physics of the actuator.
    #[must_use]
    pub fn is_bench(self) -> bool {
        matches!(self.about().owner, Owner::Sensor | Owner::Rig)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_has_its_own_line_and_name() {
        for a in CHANGES.into_iter().chain(EFFECTS) {
            assert_eq!(a.change.about().name, a.name);
            assert_eq!(Change::from_name(a.name), Some(a.change));
        }
        assert_eq!(Change::from_name("none"), None);
    }
}
