//! What to record or to measure next, as values.

/// A recording of the menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Loops at four speeds, at two pressures.
    Speeds,
    /// Rests of 1, 10 and 100 s reached from both sides, at two pressures.
    Dwells,
    /// Nested small loops at two speeds, at two pressures.
    NestedLoops,
    /// Slow pressure ramps at three held lengths.
    PressureRamps,
    /// The same loops before and after half an hour of vented rest.
    Rest,
}

/// A measurement on the bench, apart from any motion of the muscle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchCheck {
    /// A rigid bar in the muscle's place, loaded once.
    RigidBar,
    /// Dead weights on the load cell.
    DeadWeights,
    /// The gauge against a reference, and the valve closed for a minute.
    ReferenceGauge,
    /// The vented length before and after.
    VentedLength,
    /// The muscle's weight, and the vented load cell.
    Weight,
    /// Photographs of the ends, the diameter at three pressures.
    Photographs,
}

/// Why an experiment is proposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Proposal {
    /// The recording.
    pub motion: Motion,
    /// A check of the bench that separates the same effects.
    pub check: Option<BenchCheck>,
    /// Whether the recording separates them; otherwise the check alone does.
    pub motion_separates: bool,
}

/// What would show an effect that recordings like these conceal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Measure {
    /// The vented load cell before, between and after.
    VentedCell,
    /// Weights of muscle and fittings, or the bench turned.
    Weigh,
    /// The gauge against a reference.
    ReferenceGauge,
    /// Dead weights.
    DeadWeights,
    /// A rigid bar.
    RigidBar,
    /// A calliper on the vented length.
    VentedLength,
    /// Photographs of the ends, or two lengths of the same stock.
    Photographs,
    /// Pressure ramps at held lengths from zero.
    PressureRamps,
    /// Rests, sampled fast.
    FastRests,
    /// Nested loops.
    NestedLoops,
    /// Loops at four speeds.
    FourSpeeds,
    /// Loops at four pressures and pressure ramps.
    FourPressures,
    /// Rests reached from both sides.
    RestBothSides,
    /// Long holds.
    LongHolds,
    /// The first strokes of a new specimen.
    FirstStrokes,
    /// The first loops again at the end.
    RepeatFirst,
    /// The end of the free stroke.
    FreeStrokeEnd,
    /// A little of everything.
    Varied,
}

/// What to do so that an effect would show which recordings like these conceal.
#[must_use]
pub fn what_would_show(effect: &str) -> Measure {
    match effect {
        "force-offset" | "force-drift" => Measure::VentedCell,
        "gravity" => Measure::Weigh,
        "gauge-offset" | "gauge-gain" | "leak" => Measure::ReferenceGauge,
        "force-gain" | "cross-talk" | "misalignment" => Measure::DeadWeights,
        "rig-compliance" | "backlash" => Measure::RigidBar,
        "displacement-offset" | "permanent-set" | "end-slip" => Measure::VentedLength,
        "tip-effect" | "braid-elasticity" => Measure::Photographs,
        "contact-loss" | "pressure-sensor-lag" => Measure::PressureRamps,
        "breakaway-friction" => Measure::FastRests,
        "presliding-hysteresis" | "minor-loop-memory" => Measure::NestedLoops,
        "viscous-damping" | "rate-power" | "stribeck-friction" | "sensor-delay" | "pressure-lag"
        | "inertia" => Measure::FourSpeeds,
        "coulomb-friction" | "pressure-friction" | "seal-friction" => Measure::FourPressures,
        "friction-asymmetry" => Measure::RestBothSides,
        "stress-relaxation" | "log-creep" => Measure::LongHolds,
        "mullins-softening" => Measure::FirstStrokes,
        "cyclic-softening" | "thermal-softening" => Measure::RepeatFirst,
        "strand-jamming" => Measure::FreeStrokeEnd,
        _ => Measure::Varied,
    }
}

/// The check of the bench that separates effects which no motion can.
pub(crate) fn bench_check(names: &[String]) -> Option<BenchCheck> {
    const CHECKS: [(&[&str], BenchCheck); 6] = [
        (&["rig-compliance", "backlash"], BenchCheck::RigidBar),
        (&["force-gain", "cross-talk", "misalignment"], BenchCheck::DeadWeights),
        (&["gauge-gain", "leak"], BenchCheck::ReferenceGauge),
        (&["displacement-offset", "permanent-set", "end-slip"], BenchCheck::VentedLength),
        (&["gravity", "force-offset"], BenchCheck::Weight),
        (&["tip-effect", "braid-elasticity"], BenchCheck::Photographs),
    ];
    let of = |(effects, _): &&(&[&str], BenchCheck)| names.iter().any(|n| effects.contains(&n.as_str()));
    CHECKS.iter().find(of).map(|(_, check)| *check)
}
