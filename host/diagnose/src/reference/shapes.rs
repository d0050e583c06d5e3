//! The changes that can be named, and what each settled change does to the force. Class, owner and law of a change are in the file of its
//! effect.

use model_core::effects::{Changed, EffectName, Info, Traits};
use pam_fit::bench::{BenchName, Candidate};

use super::cells::Means;

pub use model_core::effects::{Class, Owner};

/// A change that can be named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "each is named after its effect")]
pub enum Change {
    ForceOffset,
    ForceDrift,
    ForceGain,
    GaugeGain,
    CrossTalk,
    DisplacementOffset,
    RigCompliance,
    /// All `E_k` of the table.
    ElasticStiffening,
    GaugeOffset,
    CoulombFriction,
    PressureFriction,
    /// `k_F` of the table.
    FrictionFactor,
    EndSlip,
    SensorDelay,
    PressureSensorLag,
    /// Another effect of the catalogue, tested for strokes of a described muscle.
    Effect(&'static str),
}

/// What to report of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Its name, as in the catalogue of effects where it is listed.
    pub name: &'static str,
    /// Class, owner, law and size.
    pub changed: Changed,
}

/// Every change that settled cells show by a fixed shape or a time course, in the order in which they are tested.
pub(crate) const CHANGES: [Change; 15] = [
    Change::ForceOffset,
    Change::ForceGain,
    Change::GaugeGain,
    Change::GaugeOffset,
    Change::CrossTalk,
    Change::DisplacementOffset,
    Change::CoulombFriction,
    Change::PressureFriction,
    Change::FrictionFactor,
    Change::ElasticStiffening,
    Change::ForceDrift,
    Change::RigCompliance,
    Change::EndSlip,
    Change::SensorDelay,
    Change::PressureSensorLag,
];

/// What no effect is, but a coefficient of the base model: its friction.
const FRICTION_FACTOR: About = About {
    name: "friction-factor",
    changed: Changed::new(Class::Friction, Owner::Muscle, "ΔF = −k·F·sgn v").sized("factor", ""),
};

/// The same for its elasticity.
const ELASTIC_STIFFENING: About = About {
    name: "elastic-stiffening",
    changed: Changed::new(Class::Gain, Owner::Muscle, "ΔF = η·(F − P·∂F/∂P)").sized("stiffening", ""),
};

/// An effect whose file does not describe a change; [`Change::from_name`] gives none.
const UNLISTED: About = About {
    name: "unlisted",
    changed: Changed::new(Class::Alone("unlisted"), Owner::RigOrMuscle, "not known"),
};

/// What an effect's own file says of its change; `None` for one that no comparison looks for.
pub(crate) fn of_file(info: &Info, traits: &Traits) -> Option<About> {
    traits.changed.map(|changed| About { name: info.name, changed })
}

fn of_effect(effect: Candidate) -> Option<About> {
    of_file(effect.info(), effect.traits())
}

impl Change {
    /// Whether it is a lag between channels, which rows in motion show.
    pub(super) fn is_lag(self) -> bool {
        matches!(self, Self::SensorDelay | Self::PressureSensorLag)
    }

    /// The effect that has changed; `None` for a coefficient of the base model.
    #[must_use]
    pub fn effect(self) -> Option<Candidate> {
        Some(match self {
            Self::ForceOffset => Candidate::Bench(BenchName::ForceOffset),
            Self::ForceDrift => Candidate::Bench(BenchName::ForceDrift),
            Self::ForceGain => Candidate::Bench(BenchName::ForceGain),
            Self::GaugeGain => Candidate::Bench(BenchName::GaugeGain),
            Self::CrossTalk => Candidate::Bench(BenchName::CrossTalk),
            Self::DisplacementOffset => Candidate::Bench(BenchName::DisplacementOffset),
            Self::RigCompliance => Candidate::Bench(BenchName::RigCompliance),
            Self::GaugeOffset => Candidate::Bench(BenchName::GaugeOffset),
            Self::SensorDelay => Candidate::Bench(BenchName::SensorDelay),
            Self::PressureSensorLag => Candidate::Bench(BenchName::PressureSensorLag),
            Self::CoulombFriction => Candidate::Muscle(EffectName::CoulombFriction),
            Self::PressureFriction => Candidate::Muscle(EffectName::PressureFriction),
            Self::EndSlip => Candidate::Muscle(EffectName::EndSlip),
            Self::Effect(name) => return Candidate::from_name(name),
            Self::FrictionFactor | Self::ElasticStiffening => return None,
        })
    }

    /// What to report of it.
    #[must_use]
    pub fn about(self) -> About {
        match self {
            Self::FrictionFactor => FRICTION_FACTOR,
            Self::ElasticStiffening => ELASTIC_STIFFENING,
            other => other.effect().and_then(of_effect).unwrap_or(UNLISTED),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// The change of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        CHANGES.into_iter().find(|c| c.name() == name).or_else(|| {
            let about = Candidate::from_name(name).and_then(of_effect)?;
            Some(Self::Effect(about.name))
        })
    }

    /// Its class.
    #[must_use]
    pub fn class(self) -> Class {
        self.about().changed.class
    }

    /// Its class among strokes, where a late channel and a force that grows with speed have the same shape.
    #[must_use]
    pub(crate) fn stroke_class(self) -> Class {
        match self {
            Self::SensorDelay => Class::RateOrPhase,
            _ => self.class(),
        }
    }

    /// Whether its law depends on what happened before: then it has no moment at which it began.
    pub(super) fn remembers(self) -> bool {
        self.about().changed.remembers
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
        matches!(self.about().changed.owner, Owner::Sensor | Owner::Rig)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_is_found_by_the_name_of_its_effect() {
        for change in CHANGES {
            assert_eq!(Change::from_name(change.name()), Some(change));
            assert!(change.effect().is_none_or(|e| e.traits().changed == Some(change.about().changed)));
        }
        for effect in Candidate::all() {
            let found = Change::from_name(effect.name());
            assert_eq!(found.and_then(Change::effect), effect.traits().changed.map(|_| effect), "{effect:?}");
        }
        assert_eq!(Change::from_name("none"), None);
    }
}
