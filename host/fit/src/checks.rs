//! Checks of the bench: each instrument against a reference, and the muscle for a loss of air.
//!
//! ```text
//! dead weights      F_read = (1 + γ) (W + c P) + o        known weights W on the cell, line vented and under pressure P
//! rigid bar         x_read = x_bar − δ − F/K − b/2·sign F a bar in the muscle's place, pulled and pushed
//! reference gauge   P_read = (1 + ν) P + q                a better gauge beside the bench's own
//! weighing          F_read = a W + o                      the vented cell with (a = 1) and without (a = 0) muscle and fittings
//! closed valve      dP/dt = −r P                          the muscle under pressure, its valve closed: does it lose air?
//! ```
//! Loops of a muscle hardly separate a gain error of the load cell from that of the pressure sensor, or the frame's compliance from
//! that of the braid: the table absorbs more than nine tenths of such an error. A check of one minute with a weight measures it. The
//! recordings are corrected for measured faults before the fit.
//!
//! A check is a table like a recording, with the known quantity in a column whose name begins with `reference_`:
//!
//! | check | columns |
//! | --- | --- |
//! | dead weights | `time_`, `force_`, `reference_force_`; with `pressure_` the thrust of the line shows |
//! | rigid bar | `time_`, `displacement_`, `force_`, `reference_displacement_` |
//! | reference gauge | `time_`, `pressure_`, `reference_pressure_` |
//! | weighing | `time_`, `force_`, `attached`: 1 or 0 |
//! | closed valve | `time_`, `pressure_`, `valve_closed`: 1 or 0 |

mod closed_valve;
mod dead_weights;
mod gauge;
mod rigid_bar;
mod table;
mod weighing;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::bench::{BenchName, Candidate};
use crate::numerics::student::{effective_freedom, half_width};
use pam_data::error::Result;
use pam_data::recording::{Campaign, Quantity};

pub use closed_valve::Loss;
use table::Table;

/// A kind of check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Known weights on the load cell.
    DeadWeights,
    /// A rigid bar in the muscle's place.
    RigidBar,
    /// A better gauge beside the bench's own.
    ReferenceGauge,
    /// The load cell with and without muscle and fittings.
    Weighing,
    /// The muscle under pressure behind a closed valve.
    ClosedValve,
}

impl Kind {
    /// Every check of the bench.
    pub const ALL: [Self; 5] =
        [Self::DeadWeights, Self::RigidBar, Self::ReferenceGauge, Self::Weighing, Self::ClosedValve];

    /// Name of its file, without extension.
    #[must_use]
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::DeadWeights => "dead_weights",
            Self::RigidBar => "rigid_bar",
            Self::ReferenceGauge => "gauge_check",
            Self::Weighing => "weighing",
            Self::ClosedValve => "closed_valve",
        }
    }

    /// Whether the check measures an effect of the catalogue, so that recordings need not show it.
    #[must_use]
    pub fn settles(self, effect: Candidate) -> bool {
        let of_bench = |names: &[BenchName]| names.iter().any(|n| effect == Candidate::Bench(*n));
        match self {
            Self::DeadWeights => of_bench(&[BenchName::ForceGain, BenchName::CrossTalk]),
            Self::RigidBar => {
                of_bench(&[BenchName::RigCompliance, BenchName::Backlash, BenchName::DisplacementOffset])
            }
            Self::ReferenceGauge => of_bench(&[BenchName::GaugeGain]),
            Self::Weighing => of_bench(&[BenchName::Gravity]),
            Self::ClosedValve => effect.traits().loses_air,
        }
    }

    /// Which check a file is, by the column of its reference.
    ///
    /// # Errors
    /// A file that cannot be read, or a table without a reference.
    pub fn of(file: &Path) -> Result<Self> {
        Self::of_table(&Table::read(file)?)
    }

    fn of_table(table: &Table) -> Result<Self> {
        if table.attached().is_ok() {
            return Ok(Self::Weighing);
        }
        if table.valve_closed().is_ok() {
            return Ok(Self::ClosedValve);
        }
        let kinds = [
            (Quantity::Force, Self::DeadWeights),
            (Quantity::Displacement, Self::RigidBar),
            (Quantity::Pressure, Self::ReferenceGauge),
        ];
        let found = kinds.into_iter().find(|(quantity, _)| table.has_reference(*quantity));
        found.map(|f| f.1).ok_or_else(|| table.without_reference())
    }
}

/// A fault of the bench as measured by a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The law of the fault.
    pub fault: BenchName,
    /// Its parameters in the law's order, SI.
    pub parameters: Vec<f64>,
    /// Their standard deviations (1 σ), by whole stays or stretches; `None` for what the check does not vary.
    pub deviations: Vec<Option<f64>>,
    /// Degrees of freedom of the deviations.
    pub freedom: f64,
    /// The first parameter with its 95 % interval, as text with practical units.
    pub text: String,
    /// Which check measured it, as text.
    pub check: &'static str,
}

impl Measured {
    /// Whether the check shows the fault beyond its own uncertainty: the first number that it varied represents all.
    #[must_use]
    pub fn is_sure(&self) -> bool {
        self.exceeds(CHANCE)
    }

    /// Whether the 99 % interval of the fault excludes none.
    #[must_use]
    pub fn is_likely(&self) -> bool {
        self.exceeds(LIKELY_CHANCE)
    }

    /// Whether chance alone makes so large a value with less than a probability.
    fn exceeds(&self, chance: f64) -> bool {
        let mut varied =
            self.parameters.iter().zip(&self.deviations).filter_map(|(v, std)| Some((v, (*std)?)));
        varied.next().is_some_and(|(value, std)| value.abs() > half_width(chance, self.freedom) * std)
    }

    /// The largest and smallest value of a parameter that the check allows, as a distance from its value (95 %).
    #[must_use]
    pub fn half_width(&self, at: usize) -> f64 {
        self.deviations
            .get(at)
            .copied()
            .flatten()
            .map_or(0.0, |std| half_width(CONFIDENCE_MISS, self.freedom) * std)
    }
}

/// The probability that chance alone makes a fault that counts as real; a bench has few checks. Student's t by the number of stays:
/// four standard deviations are enough only where there are very many, six where there are ten more stays than unknowns.
const CHANCE: f64 = 6.3e-5;
/// The same where the recordings have to support the fault, too: one false one in about fifteen benches, each with seven faults.
const LIKELY_CHANCE: f64 = 0.01;
/// The probability that an interval misses the truth.
const CONFIDENCE_MISS: f64 = 0.05;

/// Checks of one bench.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checks {
    measured: Vec<Measured>,
    loss: Option<Loss>,
}

impl Checks {
    /// Reads checks; of two of the same kind the later one counts.
    ///
    /// # Errors
    /// Files that cannot be read, tables without a reference, or too short to be of use.
    pub fn read(files: &[impl AsRef<Path>]) -> Result<Self> {
        let mut checks = Self::default();
        for file in files {
            let file = file.as_ref();
            let table = Table::read(file)?;
            let measured = match Kind::of_table(&table)? {
                Kind::DeadWeights => dead_weights::measure(&table)?,
                Kind::RigidBar => rigid_bar::measure(&table)?,
                Kind::ReferenceGauge => gauge::measure(&table)?,
                Kind::Weighing => weighing::measure(&table)?,
                Kind::ClosedValve => {
                    checks.loss = Some(closed_valve::measure(&table)?);
                    continue;
                }
            };
            for m in measured {
                checks.measured.retain(|old| old.fault != m.fault);
                checks.measured.push(m);
            }
        }
        Ok(checks)
    }

    /// All measured faults.
    #[must_use]
    pub fn measured(&self) -> &[Measured] {
        &self.measured
    }

    /// What a closed valve showed.
    #[must_use]
    pub fn loss(&self) -> Option<&Loss> {
        self.loss.as_ref()
    }

    /// Whether there are no checks.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty() && self.loss.is_none()
    }
}

/// The recordings as a bench without these faults would have read them: the exact inverse of the equations above. Backlash is not
/// corrected: its effect depends on when the joint unloads.
#[must_use]
pub fn freed(campaign: &Campaign, faults: &[Measured]) -> Campaign {
    let of = |name: BenchName, at: usize| -> f64 {
        faults.iter().find(|m| m.fault == name).map_or(0.0, |m| m.parameters[at])
    };
    let (gain, thrust) = (of(BenchName::ForceGain, 0), of(BenchName::CrossTalk, 0));
    let (scale, give) = (of(BenchName::GaugeGain, 0), of(BenchName::RigCompliance, 0));
    let (offset, mass) = (of(BenchName::DisplacementOffset, 0), of(BenchName::Gravity, 0));
    let mut freed = campaign.clone();
    for recording in &mut freed.recordings {
        for p in &mut recording.pressure {
            *p *= 1.0 + scale;
        }
        if let Some(force) = &mut recording.force {
            for (f, p) in force.iter_mut().zip(&recording.pressure) {
                *f = *f / (1.0 + gain) - thrust * p + weighing::GRAVITY * mass;
            }
            for (x, f) in recording.stroke.iter_mut().zip(force.iter()) {
                // A pulling muscle draws the frame along.
                *x += offset + give * f;
            }
        }
    }
    freed
}

/// The standard deviation of a measurement, with its degrees of freedom.
#[derive(Clone, Copy)]
struct Uncertainty {
    deviation: f64,
    freedom: f64,
}

impl Uncertainty {
    /// Of repeated readings, whose reference may be off by up to `limit`, every error within it being equally likely
    /// (JCGM 100:2008, 4.3.7).
    fn with_reference(deviation: f64, freedom: f64, limit: f64) -> Self {
        let reference = limit / 3.0_f64.sqrt();
        let variances = [(deviation * deviation, freedom), (reference * reference, f64::INFINITY)];
        Self { deviation: deviation.hypot(reference), freedom: effective_freedom(&variances) }
    }

    /// Of repeated readings alone.
    fn of(deviation: f64, freedom: f64) -> Self {
        Self { deviation, freedom }
    }

    fn scaled(self, factor: f64) -> Self {
        Self { deviation: self.deviation * factor.abs(), ..self }
    }

    /// Half of the 95 % interval.
    fn half_width(self) -> f64 {
        half_width(CONFIDENCE_MISS, self.freedom) * self.deviation
    }
}
