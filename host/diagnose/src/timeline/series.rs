//! A quantity over the campaigns.

use pam_data::statistics::NORMAL_95;

/// Where a quantity is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A change against the reference campaign.
    Effect,
    /// Read from the recordings, without any model.
    Measured,
    /// Of a table fitted to the campaign.
    Fitted,
}

/// A quantity that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Force at the shortest stroke and the highest pressure that all campaigns share, N.
    LargestForce,
    /// Half the force between emptying and filling, or lengthening and shortening, N.
    Hysteresis,
    /// Pressure at which the actuator begins to pull, Pa.
    Threshold,
    /// Slope of the force over pressure, m².
    Area,
    /// `P0` of the table, Pa.
    Deadband,
    /// `k_F` of the table, mean over the tested pressures.
    FrictionFactor,
    /// Force of the table at rest length, N.
    BlockedForce,
    /// Force of the table at half of the contraction that all campaigns reach, N.
    MiddleForce,
}

/// The value in one campaign, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The value.
    pub value: f64,
    /// Standard error; absent where nothing was recorded twice.
    pub std: Option<f64>,
    /// For an effect: whether it is named in this campaign.
    pub named: bool,
}

impl Point {
    /// A value with a standard error.
    #[must_use]
    pub fn new(value: f64, std: Option<f64>) -> Self {
        Self { value, std: std.filter(|s| s.is_finite()), named: false }
    }

    /// Ends of the 95 % interval; `None` without a standard error.
    #[must_use]
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.std.map(|s| (self.value - NORMAL_95 * s, self.value + NORMAL_95 * s))
    }
}

/// What is followed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum What {
    /// A quantity.
    Quantity(Quantity),
    /// An effect by its name.
    Effect {
        /// Its name.
        name: String,
        /// Name of its parameter.
        parameter: String,
    },
}

/// A quantity over the campaigns, in their order; `None` where it could not be determined.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What it is.
    pub what: What,
    /// Where it is from.
    pub kind: Kind,
    /// SI unit.
    pub unit: String,
    /// One per campaign.
    pub points: Vec<Option<Point>>,
}

impl Series {
    /// Of a quantity.
    #[must_use]
    pub fn of(quantity: Quantity, kind: Kind, unit: &str, points: Vec<Option<Point>>) -> Self {
        let finite = |p: Option<Point>| p.filter(|p| p.value.is_finite());
        Self {
            what: What::Quantity(quantity),
            kind,
            unit: unit.to_owned(),
            points: points.into_iter().map(finite).collect(),
        }
    }

    /// Campaigns in which it is known.
    #[must_use]
    pub fn count(&self) -> usize {
        self.points.iter().flatten().count()
    }
}
