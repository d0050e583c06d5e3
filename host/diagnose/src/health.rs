//! Names what has changed from the sums that a controller keeps of its load cell against its table: least squares on the shapes of
//! the [changes](crate::reference::shapes::Change), without a recording.
//!
//! ```
//! use model_core::link::messages::HealthSums;
//! use pam_diagnose::health::{Verdict, assess};
//!
//! // A controller that has just been given a table.
//! assert_eq!(assess(&HealthSums::default()).verdict, Verdict::Unknown);
//! ```

use model_core::link::messages::{COLUMNS, HealthSums, LAGGED, SHAPES, SUMS, Shape, TableHealth, WATCHED};
use nalgebra::{DMatrix, DVector};

use crate::criteria::table_health::{
    DISTINCT_CHANGES, HEALTH_CORRELATION, HEALTH_DISTINCT, HEALTH_PAIRS, HEALTH_SHOWN, SECOND_CHANGE,
};
use crate::reference::shapes::{Change, ForceShape};
use pam_data::statistics::NORMAL_95;

/// What is known of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Too few independent blocks, no load cell or no table.
    Unknown,
    /// No change beyond the tolerance is significant.
    Describes,
    /// The table no longer describes this muscle.
    Changed,
}

/// A change that explains the residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Which one.
    pub change: Change,
    /// Its size in the unit of the change (drift: N/h).
    pub size: f64,
    /// The 95 % interval.
    pub interval: (f64, f64),
    /// Part of the residual's mean square that it explains.
    pub share: f64,
    /// Changes that these sums do not distinguish from it.
    pub confusable_with: Vec<Change>,
}

/// What the sums say.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Whether the table still describes the muscle.
    pub verdict: Verdict,
    /// Blocks since the sums began.
    pub blocks: u32,
    /// Independent observations among those that are not forgotten.
    pub independent: f64,
    /// Root mean square of the residual, N.
    pub residual_n: f64,
    /// The part of it that a change may explain, N.
    pub tolerance_n: f64,
    /// What has changed, the most important first; empty unless the verdict is [`Verdict::Changed`].
    pub findings: Vec<Finding>,
}

/// Which change a shape of the sums is of, and the size of a coefficient of one; `None` for a shape that no effect has.
fn meaning(shape: Shape, sums: &HealthSums) -> Option<(Change, f64)> {
    let (force, pressure, stroke) =
        (f64::from(sums.force_n), f64::from(sums.pressure_pa), f64::from(sums.stroke_m));
    let window_h = f64::from(sums.window_blocks) * f64::from(sums.block_ticks) * 1e-3 / 3600.0;
    let (of_force, unit) = match shape {
        Shape::ForceOffset => (ForceShape::Constant, force),
        Shape::ForceGain => (ForceShape::Force, 1.0),
        Shape::PressureGain => (ForceShape::PressureTimesSlope, 1.0),
        Shape::CrossTalk => (ForceShape::Pressure, force / pressure),
        Shape::PressureOffset => (ForceShape::PressureSlope, pressure),
        Shape::Length => (ForceShape::StrokeSlope, stroke),
        Shape::Compliance => (ForceShape::ForceTimesStrokeSlope, stroke / force),
        Shape::Friction => (ForceShape::Direction, force),
        // A late force lacks dF/dt times its delay.
        Shape::Lag => (ForceShape::LateForce, -1.0),
        Shape::Drift => (ForceShape::Time, force / window_h),
    };
    let change = Change::of_shape(of_force)?;
    Some((change, change.sign() * unit))
}

/// The unit of a finding's size.
#[must_use]
pub fn unit(change: Change) -> &'static str {
    match change.shape() {
        Some(ForceShape::Time) => "N/h",
        _ => change.about().changed.size.1,
    }
}

struct Equations<'a> {
    sums: &'a HealthSums,
    matrix: DMatrix<f64>,
    weight: f64,
}

impl<'a> Equations<'a> {
    /// None where the device has sent too little, or numbers that are none.
    fn new(sums: &'a HealthSums) -> Option<Self> {
        let whole = sums.sums.len() == SUMS && sums.lagged.len() == LAGGED;
        let finite = sums.sums.iter().chain(&sums.lagged).all(|value| value.is_finite());
        let scaled = [sums.force_n, sums.pressure_pa, sums.stroke_m, sums.weight]
            .iter()
            .all(|value| value.is_finite() && *value > 0.0);
        if !(whole && finite && scaled) {
            return None;
        }
        let mut matrix = DMatrix::zeros(COLUMNS, COLUMNS);
        let mut values = sums.sums.iter();
        for row in 0..COLUMNS {
            for column in row..COLUMNS {
                let value = f64::from(*values.next()?);
                matrix[(row, column)] = value;
                matrix[(column, row)] = value;
            }
        }
        Some(Self { sums, matrix, weight: f64::from(sums.weight) })
    }

    fn residual(&self) -> f64 {
        self.matrix[(SHAPES, SHAPES)]
    }

    /// Coefficients of some shapes, their covariance for a variance of one, and the sum of squares that is left.
    fn fit(&self, shapes: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
        let count = shapes.len();
        let normal = DMatrix::from_fn(count, count, |r, c| self.matrix[(shapes[r], shapes[c])]);
        // Scaled to a unit diagonal, so that shapes of different size are compared.
        let scale: Vec<f64> = (0..count).map(|at| normal[(at, at)].sqrt()).collect();
        if scale.iter().any(|s| !(*s > HEALTH_SHOWN * self.weight.sqrt())) {
            return None;
        }
        let unit = DMatrix::from_fn(count, count, |r, c| normal[(r, c)] / (scale[r] * scale[c]));
        // Shapes that differ by less than single precision resolves cannot be fitted together.
        if unit.clone().symmetric_eigen().eigenvalues.min() < HEALTH_DISTINCT {
            return None;
        }
        let inverse = unit.cholesky()?.inverse();
        let covariance = DMatrix::from_fn(count, count, |r, c| inverse[(r, c)] / (scale[r] * scale[c]));
        let right = DVector::from_fn(count, |r, _| self.matrix[(shapes[r], SHAPES)]);
        let beta = &covariance * &right;
        let left = (self.residual() - right.dot(&beta)).max(1e-9 * self.weight);
        Some((beta, covariance, left))
    }

    /// How many times the serial correlation of what a shape leaves over widens a variance; infinite where nothing is known of it.
    fn inflation(&self, shape: usize) -> Option<f64> {
        let (beta, _, left) = self.fit(&[shape])?;
        if shape >= WATCHED {
            // That of a constant, which is the drift's own mean.
            return self.inflation(Shape::ForceOffset as usize);
        }
        let at = |place: usize| f64::from(self.sums.lagged[place]);
        let pairs = at(LAGGED - 1);
        if !(pairs >= HEALTH_PAIRS * self.weight) {
            return None;
        }
        let (own, cross) = (at(3 * shape), at(3 * shape + 1) + at(3 * shape + 2));
        let covariance = (at(LAGGED - 2) - beta[0] * cross + beta[0] * beta[0] * own) / pairs;
        let rho = (covariance / (left / self.weight)).clamp(0.0, HEALTH_CORRELATION);
        Some((1.0 + rho) / (1.0 - rho))
    }

    /// The shapes by what each explains alone.
    fn ranking(&self) -> Vec<(usize, f64)> {
        let mut ranking: Vec<_> =
            (0..SHAPES).filter_map(|shape| Some((shape, self.residual() - self.fit(&[shape])?.2))).collect();
        ranking.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranking
    }

    fn findings(&self) -> Vec<Finding> {
        let ranking = self.ranking();
        let Some(&(first, explained)) = ranking.first() else { return Vec::new() };
        let Some(inflation) = self.inflation(first) else { return Vec::new() };
        let Some((_, _, left)) = self.fit(&[first]) else { return Vec::new() };
        let noise = left / self.weight * inflation;
        let alike = |k: &&(usize, f64)| k.0 != first && (explained - k.1) / noise < DISTINCT_CHANGES;
        let confusable: Vec<usize> = ranking.iter().filter(alike).map(|k| k.0).collect();
        let mut chosen = vec![first];
        let second = (0..SHAPES)
            .filter(|shape| *shape != first && !confusable.contains(shape))
            .filter_map(|shape| Some((shape, left - self.fit(&[first, shape])?.2)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let tolerance = f64::from(self.sums.tolerance);
        if let Some((shape, gain)) = second
            && gain / noise > SECOND_CHANGE
            && (gain / self.weight).sqrt() > tolerance
        {
            chosen.push(shape);
        }
        let Some((beta, covariance, left)) = self.fit(&chosen) else { return Vec::new() };
        let variance = left / self.weight * inflation;
        let change_of = |shape: &usize| meaning(Shape::ALL[*shape], self.sums).map(|m| m.0);
        chosen
            .iter()
            .enumerate()
            .filter_map(|(at, shape)| {
                let (change, scale) = meaning(Shape::ALL[*shape], self.sums)?;
                let (size, half) =
                    (scale * beta[at], NORMAL_95 * scale.abs() * (variance * covariance[(at, at)]).sqrt());
                let energy = beta[at] * beta[at] * self.matrix[(*shape, *shape)];
                Some(Finding {
                    change,
                    size,
                    interval: (size - half, size + half),
                    share: (energy / self.residual()).min(1.0),
                    confusable_with: if at == 0 {
                        confusable.iter().filter_map(change_of).collect()
                    } else {
                        Vec::new()
                    },
                })
            })
            .collect()
    }
}

/// What the sums of a controller say. The verdict is the controller's own.
#[must_use]
pub fn assess(sums: &HealthSums) -> Assessment {
    let force = f64::from(sums.force_n);
    let none = Assessment {
        verdict: Verdict::Unknown,
        blocks: sums.blocks,
        independent: 0.0,
        residual_n: 0.0,
        tolerance_n: f64::from(sums.tolerance) * force,
        findings: Vec::new(),
    };
    let Some(equations) = Equations::new(sums) else { return none };
    let best = equations.ranking().first().and_then(|(shape, _)| equations.inflation(*shape));
    let verdict = match sums.table {
        TableHealth::Unknown => Verdict::Unknown,
        TableHealth::Describes => Verdict::Describes,
        TableHealth::Changed => Verdict::Changed,
    };
    Assessment {
        verdict,
        independent: best.map_or(0.0, |inflation| equations.weight / inflation),
        residual_n: force * (equations.residual().max(0.0) / equations.weight).sqrt(),
        findings: if verdict == Verdict::Changed { equations.findings() } else { Vec::new() },
        ..none
    }
}
