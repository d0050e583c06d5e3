//! The changes that can be named: what each does to the force, and whose it is.

use serde::Serialize;

use super::cells::Means;

/// Changes that recordings often cannot distinguish; a class is right where the name may not be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
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

impl Change {
    /// Its line of the table.
    #[must_use]
    pub fn about(self) -> &'static About {
        CHANGES.iter().find(|a| a.change == self).unwrap_or(&CHANGES[0])
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// The change of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        CHANGES.iter().find(|a| a.name == name).map(|a| a.change)
    }

    /// Its class.
    #[must_use]
    pub fn class(self) -> Class {
        self.about().class
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
            Self::EndSlip | Self::SensorDelay | Self::PressureSensorLag => return None,
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
        for a in CHANGES {
            assert_eq!(a.change.about().name, a.name);
            assert_eq!(Change::from_name(a.name), Some(a.change));
        }
        assert_eq!(Change::from_name("none"), None);
    }
}
