//! The effects by name, whose they are, and which of them are of one class.
//!
//! Classes are those that the catalogue computed before any trial (|cos| > 0.9 after the base is refitted), fixed here before
//! the seed of a final set is drawn. A name that is in no class stands alone.

/// Where an effect belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// Part of the muscle: goes into the model.
    Muscle,
    /// Part of the bench: corrects the data.
    Bench,
}

/// Every name that is injected as a single effect.
pub const SINGLES: [(&str, Owner); 36] = [
    ("gauge-gain", Owner::Bench),
    ("pressure-lag", Owner::Muscle),
    ("pressure-sensor-lag", Owner::Bench),
    ("leak", Owner::Muscle),
    ("tip-effect", Owner::Muscle),
    ("braid-elasticity", Owner::Muscle),
    ("contact-loss", Owner::Muscle),
    ("strand-jamming", Owner::Muscle),
    ("end-slip", Owner::Muscle),
    ("permanent-set", Owner::Muscle),
    ("mullins-softening", Owner::Muscle),
    ("cyclic-softening", Owner::Muscle),
    ("thermal-softening", Owner::Muscle),
    ("stress-relaxation", Owner::Muscle),
    ("log-creep", Owner::Muscle),
    ("coulomb-friction", Owner::Muscle),
    ("pressure-friction", Owner::Muscle),
    ("friction-asymmetry", Owner::Muscle),
    ("seal-friction", Owner::Muscle),
    ("breakaway-friction", Owner::Muscle),
    ("stribeck-friction", Owner::Muscle),
    ("presliding-hysteresis", Owner::Muscle),
    ("minor-loop-memory", Owner::Muscle),
    ("viscous-damping", Owner::Muscle),
    ("rate-power", Owner::Muscle),
    ("inertia", Owner::Bench),
    ("gravity", Owner::Bench),
    ("misalignment", Owner::Bench),
    ("rig-compliance", Owner::Bench),
    ("backlash", Owner::Bench),
    ("force-offset", Owner::Bench),
    ("force-drift", Owner::Bench),
    ("force-gain", Owner::Bench),
    ("cross-talk", Owner::Bench),
    ("sensor-delay", Owner::Bench),
    ("displacement-offset", Owner::Bench),
];

/// Mechanisms that no name of the catalogue describes.
pub const OUTSIDE: [&str; 9] = [
    "hose-spring",
    "bladder-fold",
    "breathing-room",
    "stick-slip-mounts",
    "mains-beat",
    "clipped-cell",
    "coarse-converter",
    "bristle-damping",
    "room-swing",
];

/// The classes, K1 to K7 of the catalogue and the two families that share a trace by construction (hysteresis with memory;
/// relaxation over decades, which the bench makes from one spectrum).
pub const CLASSES: [(&str, &[&str]); 9] = [
    ("dry-friction-law", &["coulomb-friction", "pressure-friction", "seal-friction", "misalignment"]),
    (
        "static-gain",
        &[
            "friction-asymmetry",
            "force-gain",
            "gauge-gain",
            "leak",
            "cross-talk",
            "displacement-offset",
            "rig-compliance",
            "braid-elasticity",
        ],
    ),
    ("slow-speed-law", &["stribeck-friction", "rate-power"]),
    ("rate-or-phase", &["viscous-damping", "sensor-delay", "pressure-lag"]),
    ("slow-softening", &["cyclic-softening", "thermal-softening"]),
    ("zero", &["force-offset", "gravity", "force-drift"]),
    ("concealed-static", &["tip-effect"]),
    ("turning-memory", &["presliding-hysteresis", "minor-loop-memory"]),
    ("relaxation", &["stress-relaxation", "log-creep"]),
];

/// The class of a name; the name itself when it stands alone.
pub fn class(name: &str) -> &str {
    CLASSES.iter().find(|(_, members)| members.contains(&name)).map_or(name, |(c, _)| c)
}

/// Whose an effect is, where the catalogue knows it.
pub fn owner(name: &str) -> Option<Owner> {
    SINGLES.iter().find(|(n, _)| *n == name).map(|(_, o)| *o)
}
