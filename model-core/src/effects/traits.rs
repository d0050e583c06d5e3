//! What a diagnosis has to know of an effect beside its equations. A controller never needs it, so its image carries none of it.

use super::change::Changed;

/// The experiment that shows an effect where recordings conceal it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// The vented load cell before, between and after.
    VentedReadings,
    /// The weight of muscle and fittings.
    Weighing,
    /// A reference gauge, vented and at three pressures.
    ReferenceGauge,
    /// A closed valve between supply and muscle.
    ClosedValve,
    /// Dead weights on the load cell, with and without pressure in the line.
    DeadWeights,
    /// A rigid bar in the muscle's place.
    RigidBar,
    /// The vented length before and after.
    VentedLength,
    /// The shape of the ends, and the diameter at three pressures.
    EndsAndDiameter,
    /// Slow ramps of pressure from zero at three held lengths.
    PressureRamps,
    /// Rests of 1, 10 and 100 s at one place, sampled fast.
    Rests,
    /// Nested small loops at two speeds.
    NestedLoops,
    /// Loops at four speeds over two decades.
    Speeds,
    /// Loops at four pressures, and ramps of pressure at held lengths.
    PressuresAndRamps,
    /// Rests at one place, reached from both sides.
    RestsFromBothSides,
    /// Holds of 100 s at two pressures, reached from both sides.
    LongHolds,
    /// The first strokes of a new specimen, and the same after a day.
    FirstStrokes,
    /// The first loops once more at the end, and after a vented rest.
    RepeatsAfterRest,
    /// The very end of the free stroke.
    EndOfStroke,
    /// Several speeds, with rests, and the first pressure once more at the end.
    Varied,
}

/// The check of the bench that separates effects which no motion of the muscle can; the first of several is the one to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BenchCheck {
    /// A rigid bar in the muscle's place, loaded once.
    RigidBar,
    /// Dead weights on the load cell.
    DeadWeights,
    /// A reference gauge beside that of the bench.
    ReferenceGauge,
    /// A closed valve between supply and muscle.
    ClosedValve,
    /// The vented length by a calliper.
    VentedLength,
    /// The muscle's weight, and the vented load cell.
    Weighing,
    /// The shape of the ends, and the diameter.
    EndsAndDiameter,
}

/// What an effect adds to the reading while the muscle is vented and slack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vented {
    /// Nothing: it acts on a pull, or on strands that only pressure holds together.
    Nothing,
    /// The law of its first amplitude alone.
    FirstLaw,
    /// What it adds at any time.
    Everything,
    /// A constant, so that a tare shows the effect without a request.
    Constant,
}

/// What else than another effect an effect is mistaken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Imitates {
    /// A wrong description of the muscle: diameter, braid angle, rest length, wall.
    Description,
    /// The base model's deadband, of which it is a part.
    Deadband,
    /// The base model's elastic orders, of which it is one more.
    ElasticOrders,
}

/// What a diagnosis has to know of an effect beside its equations.
#[derive(Clone, Copy, Debug)]
pub struct Traits {
    /// What shows it where recordings conceal it.
    pub shown_by: Experiment,
    /// The check of the bench that separates it from others, where there is one.
    pub check: Option<BenchCheck>,
    /// What it adds to the reading of a vented muscle.
    pub vented: Vented,
    /// Whether it is little more than a slow trend, which the drift of a reading imitates best.
    pub slow: bool,
    /// What else it is mistaken for.
    pub imitates: Option<Imitates>,
    /// Whether it is looked for in the differences between recordings of one mounting only, where no static model hides it, and not in the
    /// search through the rows.
    pub between_recordings: bool,
    /// Whether closed valves show it: their pressure falls.
    pub loses_air: bool,
    /// Whether it delays each reversal: a reading cannot be freed of it, since the delay is in the motion, not in the reading.
    pub delays_reversals: bool,
    /// Whether it adds a stroke that follows the force, so that a corrected stroke differs between the directions.
    pub stroke_follows_force: bool,
    /// Whether its law is made from the slope and friction of the base model, which a base that was fitted without it has partly taken up:
    /// it is then seen from a base that was fitted beside it.
    pub made_from_base: bool,
    /// How a change of it shows between two campaigns; `None` for what no comparison looks for.
    pub changed: Option<Changed>,
    /// Whether amplitudes and shapes that were fitted freely can belong to the same cause.
    pub consistent: fn(amplitudes: &[f64], shapes: &[f64]) -> bool,
}

fn always(_amplitudes: &[f64], _shapes: &[f64]) -> bool {
    true
}

impl Traits {
    /// Of an effect of which nothing more is known than what shows it.
    pub const fn shown_by(experiment: Experiment) -> Self {
        Self {
            shown_by: experiment,
            check: None,
            vented: Vented::Nothing,
            slow: false,
            imitates: None,
            between_recordings: false,
            loses_air: false,
            delays_reversals: false,
            stroke_follows_force: false,
            made_from_base: false,
            changed: None,
            consistent: always,
        }
    }
    /// The same with a check of the bench that separates it.
    #[must_use]
    pub const fn check(self, check: BenchCheck) -> Self {
        Self { check: Some(check), ..self }
    }
    /// The same that a vented muscle shows.
    #[must_use]
    pub const fn vented(self, vented: Vented) -> Self {
        Self { vented, ..self }
    }
    /// The same as a slow trend.
    #[must_use]
    pub const fn slow(self) -> Self {
        Self { slow: true, ..self }
    }
    /// The same that is looked for between recordings only.
    #[must_use]
    pub const fn between_recordings(self) -> Self {
        Self { between_recordings: true, ..self }
    }
    /// The same that closed valves show by a falling pressure.
    #[must_use]
    pub const fn loses_air(self) -> Self {
        Self { loses_air: true, ..self }
    }
    /// The same that delays each reversal.
    #[must_use]
    pub const fn delays_reversals(self) -> Self {
        Self { delays_reversals: true, ..self }
    }
    /// The same with a stroke that follows the force.
    #[must_use]
    pub const fn stroke_follows_force(self) -> Self {
        Self { stroke_follows_force: true, ..self }
    }
    /// The same, made from the slope and friction of the base model.
    #[must_use]
    pub const fn made_from_base(self) -> Self {
        Self { made_from_base: true, ..self }
    }
    /// The same, mistaken for something that is not an effect.
    #[must_use]
    pub const fn imitates(self, what: Imitates) -> Self {
        Self { imitates: Some(what), ..self }
    }
    /// The same that shows in this way between two campaigns.
    #[must_use]
    pub const fn changed(self, changed: Changed) -> Self {
        Self { changed: Some(changed), ..self }
    }
    /// The same with a rule that its parameters have to keep.
    #[must_use]
    pub const fn consistent(self, rule: fn(&[f64], &[f64]) -> bool) -> Self {
        Self { consistent: rule, ..self }
    }
}
