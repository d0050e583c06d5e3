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

/// What a change adds to the force while the muscle is settled, per unit of its size. `F` is the force of before, `P` the pressure, `x` the
/// stroke, `v` its speed, and `t/T` the time as a share of the later campaign. Changes are tested in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ForceShape {
    /// 1.
    Constant,
    /// F.
    Force,
    /// P ∂F/∂P.
    PressureTimesSlope,
    /// ∂F/∂P.
    PressureSlope,
    /// P.
    Pressure,
    /// ∂F/∂x.
    StrokeSlope,
    /// sgn v.
    Direction,
    /// P sgn v.
    DirectionTimesPressure,
    /// F sgn v.
    DirectionTimesForce,
    /// F − P ∂F/∂P: the elastic part of the force.
    Elastic,
    /// t/T.
    Time,
    /// F ∂F/∂x.
    ForceTimesStrokeSlope,
    /// ∂F/∂x from one moment on.
    StrokeStep,
    /// The force is late against the pressure. Only readings in motion show it.
    LateForce,
    /// The pressure reading is late against the force. Only readings in motion show it.
    LatePressure,
}

/// How a change develops through the later campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Course {
    /// It is there from the beginning to the end.
    Whole,
    /// It begins suddenly, at one moment.
    Step,
    /// It begins at one moment and grows to the end.
    Ramp,
}

/// A law that a comparison of strokes fits beside those of the effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FurtherLaw {
    /// What the slant of the fibres in tapered ends costs.
    TaperSlant,
}

/// What to inspect or to do about a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inspect {
    /// Tare the load cell without a load.
    LoadCellZero,
    /// Load the cell with a known weight.
    LoadCellScale,
    /// Let the load cell warm up.
    LoadCellWarmUp,
    /// Compare the gauge with another one at a high pressure.
    GaugeScale,
    /// Read the gauge while the muscle is vented.
    GaugeZero,
    /// Look for pressure that acts on the load cell.
    PressureOnLoadCell,
    /// Look at filter and sampling of the force channel.
    ForceChannel,
    /// Look at the line between the muscle and the pressure sensor.
    PressureLine,
    /// Measure the mounted length.
    MountedLength,
    /// Tighten bolts and clamps of the frame.
    Frame,
    /// Clamp the ends of the muscle again.
    EndFittings,
    /// Look at guides and their alignment.
    Guides,
    /// Look at the seal, or at the braid.
    SealOrBraid,
    /// Look at wear and lubrication of the braid.
    Braid,
    /// Refit the table to the bladder as it is.
    Bladder,
    /// Look for leaks.
    Leaks,
    /// Look at the load path between muscle and load cell.
    LoadPath,
    /// Look at hoses, valves, and filters.
    Hoses,
    /// Let the muscle rest.
    Rest,
    /// Look at the muscle and its end fittings.
    Muscle,
}

impl Inspect {
    /// What to inspect for a class of changes if the effect does not name anything more definite.
    const fn usual(class: Class, owner: Owner) -> Self {
        match (owner, class) {
            (Owner::Rig, _) => Self::LoadPath,
            (_, Class::RateOrPhase) => Self::Hoses,
            (_, Class::Softening | Class::Relaxation) => Self::Rest,
            _ => Self::Muscle,
        }
    }
}

/// How an effect shows that has changed between two campaigns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Changed {
    /// What it is often mistaken for.
    pub class: Class,
    /// The class among strokes, where a late channel and a force that grows with speed have the same shape.
    pub class_in_strokes: Class,
    /// Whose it is.
    pub owner: Owner,
    /// Its law, in a few words.
    pub law: &'static str,
    /// Name and SI unit of its size.
    pub size: (&'static str, &'static str),
    /// Whether the law depends on what happened before: then the change has no moment at which it began.
    pub remembers: bool,
    /// What it adds to the force of a settled muscle, or which channel is late; `None` where only strokes of a described muscle show it.
    pub shape: Option<ForceShape>,
    /// Whether a positive size adds the negative of the shape.
    pub negative: bool,
    /// The time courses that it may have.
    pub courses: &'static [Course],
    /// Whether its size corrects the readings of later campaigns. It is then the first parameter of the effect, with the sign of the shape.
    pub correctable: bool,
    /// A further law in a comparison of strokes.
    pub further: Option<FurtherLaw>,
    /// What to inspect.
    pub inspect: Inspect,
}

impl Changed {
    /// A change by a law without memory, which only strokes of a described muscle show.
    #[must_use]
    pub const fn new(class: Class, owner: Owner, law: &'static str) -> Self {
        Self {
            class,
            class_in_strokes: class,
            owner,
            law,
            size: ("size", ""),
            remembers: false,
            shape: None,
            negative: false,
            courses: &[Course::Whole, Course::Step, Course::Ramp],
            correctable: false,
            further: None,
            inspect: Inspect::usual(class, owner),
        }
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
    /// The same that adds a shape to the force.
    #[must_use]
    pub const fn adds(self, shape: ForceShape) -> Self {
        Self { shape: Some(shape), negative: false, ..self }
    }
    /// The same that takes a shape from the force.
    #[must_use]
    pub const fn takes(self, shape: ForceShape) -> Self {
        Self { shape: Some(shape), negative: true, ..self }
    }
    /// The same with some time courses only.
    #[must_use]
    pub const fn courses(self, courses: &'static [Course]) -> Self {
        Self { courses, ..self }
    }
    /// The same with another class among strokes.
    #[must_use]
    pub const fn class_in_strokes(self, class: Class) -> Self {
        Self { class_in_strokes: class, ..self }
    }
    /// The same with a size that corrects the readings of later campaigns.
    #[must_use]
    pub const fn correctable(self) -> Self {
        Self { correctable: true, ..self }
    }
    /// The same with a further law in a comparison of strokes.
    #[must_use]
    pub const fn further(self, law: FurtherLaw) -> Self {
        Self { further: Some(law), ..self }
    }
    /// The same with something to inspect.
    #[must_use]
    pub const fn inspect(self, inspect: Inspect) -> Self {
        Self { inspect, ..self }
    }
}
