//! How an effect shows that has changed between two campaigns of one actuator.

use serde::Serialize;

/// Changes that recordings often cannot distinguish; a class is right where the name may not be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// The load cell's zero.
    Zero,
    /// What grows with force or pressure.
    Gain,
    /// The gauge's zero, or the deadband.
    GaugeOffset,
    /// The gap between the directions.
    Friction,
    /// A step of the length within the later campaign.
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
    pub const fn name(self) -> &'static str {
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
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

/// How an effect shows that has changed between two campaigns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Changed {
    /// What it is often mistaken for.
    pub class: Class,
    /// Whose it is.
    pub owner: Owner,
    /// Its law, in a few words.
    pub law: &'static str,
    /// Name and SI unit of its size.
    pub size: (&'static str, &'static str),
    /// Whether the law depends on what happened before: then the change has no moment at which it began.
    pub remembers: bool,
}

impl Changed {
    /// A change by a law without memory.
    #[must_use]
    pub const fn new(class: Class, owner: Owner, law: &'static str) -> Self {
        Self { class, owner, law, size: ("size", ""), remembers: false }
    }
    /// The same with a size of its own.
    #[must_use]
    pub const fn sized(self, name: &'static str, unit: &'static str) -> Self {
        Self { size: (name, unit), ..self }
    }
    /// The same by a law with memory.
    #[must_use]
    pub const fn remembering(self) -> Self {
        Self { remembers: true, ..self }
    }
}
