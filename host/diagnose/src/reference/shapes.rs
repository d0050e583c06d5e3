//! The changes that can be named, and what each adds to the force. A change of an effect is described in the file of the effect.

use std::cmp::Ordering;

use model_core::effects::{Changed, Info, Traits};
use pam_fit::bench::Candidate;

use super::cells::Means;

pub use model_core::effects::{Class, Course, ForceShape, Inspect, Owner};

/// A coefficient of the base model. It is fitted with every table and is not an effect of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coefficient {
    /// `k_F` of the table.
    FrictionFactor,
    /// All `E_k` of the table, by one factor.
    ElasticStiffening,
}

/// A change that can be named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// Of an effect of the catalogue.
    Effect(Candidate),
    /// Of a coefficient of the base model.
    Coefficient(Coefficient),
    /// Of an effect that a test adds.
    #[cfg(test)]
    Added(crate::tests::added::AddedName),
}

/// What to report of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Its name, as in the catalogue of effects where it is listed.
    pub name: &'static str,
    /// Class, owner, law, size, and shape.
    pub changed: Changed,
}

/// An effect whose file does not describe a change; [`Change::from_name`] gives none.
const UNLISTED: About = About {
    name: "unlisted",
    changed: Changed::new(Class::Alone("unlisted"), Owner::RigOrMuscle, "not known"),
};

/// What the file of an effect says of its change; `None` for one that no comparison looks for.
fn of_file(info: &Info, traits: &Traits) -> Option<About> {
    traits.changed.map(|changed| About { name: info.name, changed })
}

impl Coefficient {
    /// Both.
    const ALL: [Self; 2] = [Self::FrictionFactor, Self::ElasticStiffening];

    /// What to report of it.
    const fn about(self) -> About {
        match self {
            Self::FrictionFactor => About {
                name: "friction-factor",
                changed: Changed::new(Class::Friction, Owner::Muscle, "ΔF = −k·F·sgn v")
                    .sized("factor", "")
                    .takes(ForceShape::DirectionTimesForce)
                    .inspect(Inspect::Braid),
            },
            Self::ElasticStiffening => About {
                name: "elastic-stiffening",
                changed: Changed::new(Class::Gain, Owner::Muscle, "ΔF = η·(F − P·∂F/∂P)")
                    .sized("stiffening", "")
                    .adds(ForceShape::Elastic)
                    .inspect(Inspect::Bladder),
            },
        }
    }
}

/// Every change that the catalogue and the base model describe.
fn all() -> impl Iterator<Item = Change> {
    let effects = Candidate::all().filter(|e| e.traits().changed.is_some()).map(Change::Effect);
    effects.chain(Coefficient::ALL.map(Change::Coefficient))
}

/// Of several changes, those that readings at held lengths show, in the order in which they are tested: that of their shapes.
pub(super) fn in_order(changes: impl Iterator<Item = Change>) -> Vec<Change> {
    let mut shown: Vec<Change> = changes.filter(|c| c.shape().is_some()).collect();
    shown.sort_by_key(|c| c.shape());
    shown
}

/// The changes that readings at held lengths show, with some beyond the catalogue.
pub(super) fn tested(added: impl IntoIterator<Item = Change>) -> Vec<Change> {
    in_order(all().chain(added))
}

impl Change {
    /// The effect of the catalogue that has changed; `None` for a coefficient of the base model.
    #[must_use]
    pub fn effect(self) -> Option<Candidate> {
        match self {
            Self::Effect(effect) => Some(effect),
            _ => None,
        }
    }

    /// What to report of it.
    #[must_use]
    pub fn about(self) -> About {
        let listed = match self {
            Self::Effect(effect) => of_file(effect.info(), effect.traits()),
            Self::Coefficient(coefficient) => Some(coefficient.about()),
            #[cfg(test)]
            Self::Added(effect) => of_file(effect.info(), effect.traits()),
        };
        listed.unwrap_or(UNLISTED)
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// The change of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        all().find(|c| c.name() == name)
    }

    /// The first change of this shape.
    pub(crate) fn of_shape(shape: ForceShape) -> Option<Self> {
        all().find(|c| c.shape() == Some(shape))
    }

    /// What it adds to the force of a settled muscle; `None` where only strokes of a described muscle show it.
    #[must_use]
    pub fn shape(self) -> Option<ForceShape> {
        self.about().changed.shape
    }

    /// Its class.
    #[must_use]
    pub fn class(self) -> Class {
        self.about().changed.class
    }

    /// Whether it is a lag between channels, which rows in motion show.
    pub(super) fn is_lag(self) -> bool {
        matches!(self.shape(), Some(ForceShape::LateForce | ForceShape::LatePressure))
    }

    /// The sign with which its size multiplies its shape.
    pub(crate) fn sign(self) -> f64 {
        if self.about().changed.negative { -1.0 } else { 1.0 }
    }

    /// What it adds to the force of a cell of AFTER per unit of its size, once it is there in full; `None` for a change that settled cells do
    /// not show.
    pub(super) fn in_full(self, m: &Means, direction: f64) -> Option<f64> {
        let changed = self.about().changed;
        let value = match changed.shape? {
            ForceShape::Constant | ForceShape::Time => 1.0,
            ForceShape::Force => m.force,
            ForceShape::PressureTimesSlope => m.pressure_by_pressure,
            ForceShape::PressureSlope => m.by_pressure,
            ForceShape::Pressure => m.pressure,
            ForceShape::StrokeSlope => m.by_stroke,
            ForceShape::Direction => direction,
            ForceShape::DirectionTimesPressure => direction * m.pressure,
            ForceShape::DirectionTimesForce => direction * m.force,
            ForceShape::Elastic => m.elastic,
            ForceShape::ForceTimesStrokeSlope => m.force_by_stroke,
            ForceShape::StrokeStep => m.step_by_stroke,
            ForceShape::LateForce | ForceShape::LatePressure => return None,
        };
        Some(if changed.negative { -value } else { value })
    }

    /// The same if it was there, or grew, from the beginning of AFTER; `None` for one that only begins later.
    pub(super) fn throughout(self, m: &Means, direction: f64) -> Option<f64> {
        let courses = self.about().changed.courses;
        let full = self.in_full(m, direction)?;
        if courses.contains(&Course::Whole) {
            return Some(full);
        }
        courses.contains(&Course::Ramp).then_some(full * m.clock)
    }

    /// Whether it is an error of the bench that the host corrects, and no physics of the actuator.
    #[must_use]
    pub fn is_bench(self) -> bool {
        matches!(self.about().changed.owner, Owner::Sensor | Owner::Rig)
    }

    /// By class, effects before coefficients of the base model, and then by shape; changes without a shape come last, by name. Equally
    /// probable changes are listed in this order.
    fn place(self) -> (bool, Option<(Class, bool, ForceShape)>, &'static str) {
        let About { name, changed } = self.about();
        let of = |shape| (changed.class, matches!(self, Self::Coefficient(_)), shape);
        (changed.shape.is_none(), changed.shape.map(of), name)
    }
}

impl Ord for Change {
    fn cmp(&self, other: &Self) -> Ordering {
        self.place().cmp(&other.place())
    }
}

impl PartialOrd for Change {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_is_found_by_the_name_of_its_effect() {
        for change in all() {
            assert_eq!(Change::from_name(change.name()), Some(change));
        }
        for effect in Candidate::all() {
            let found = Change::from_name(effect.name());
            assert_eq!(found.and_then(Change::effect), effect.traits().changed.map(|_| effect), "{effect:?}");
        }
        assert_eq!(Change::from_name("none"), None);
    }

    #[test]
    fn changes_are_tested_in_the_order_of_their_shapes() {
        let names: Vec<&str> = tested([]).into_iter().map(Change::name).collect();
        assert_eq!(
            names,
            [
                "force-offset",
                "force-gain",
                "gauge-gain",
                "gauge-offset",
                "cross-talk",
                "displacement-offset",
                "coulomb-friction",
                "pressure-friction",
                "friction-factor",
                "elastic-stiffening",
                "force-drift",
                "rig-compliance",
                "end-slip",
                "sensor-delay",
                "pressure-sensor-lag",
            ]
        );
    }

    #[test]
    fn equally_probable_changes_are_listed_by_class() {
        let mut all: Vec<Change> = all().collect();
        all.sort();
        let names: Vec<&str> = all.into_iter().map(Change::name).collect();
        let shown = [
            "force-offset",
            "force-drift",
            "force-gain",
            "gauge-gain",
            "cross-talk",
            "displacement-offset",
            "rig-compliance",
            "elastic-stiffening",
            "gauge-offset",
            "coulomb-friction",
            "pressure-friction",
            "friction-factor",
            "end-slip",
            "sensor-delay",
            "pressure-sensor-lag",
        ];
        assert_eq!(names[..shown.len()], shown);
        assert!(names[shown.len()..].is_sorted(), "{names:?}");
    }
}
