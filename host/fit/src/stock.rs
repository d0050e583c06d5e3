//! Muscles of one stock, fitted together: what they share, and what each has of its own.
//!
//! ```text
//! F = e^a_i (1 − η_i) f(P, ε, s) + b_m          ε = (x + c_i + d_m + F/K) / L0_i
//! f(P, ε, s) = f_0(P, ε) + s f_1(P, ε)          η_i = (λ + κ ε) (1/L0_i − mean 1/L0)
//! ```
//! By the model, muscles of one stock have the same force `f` at equal pressure `P` (Pa) and contraction `ε`, whatever their rest length
//! `L0` (m); `s` is the direction. Bladder and braid of the stock are in `f`, a tensor product of cubic splines. Ends that do not pull
//! shorten the pull by `λ/L0` (`λ`, m: the total length of both ends) or, where tapers grow with contraction, by `κ ε/L0` (`κ`, m). Own to a
//! muscle `i` are its scale `a_i` and an error `c_i` of its rest length (m); own to a mounting `m`, the errors `d_m` of the mounted length (m) and
//! `b_m` of the load cell's zero (N). These are random effects: normal with zero mean, and variances that are estimated with them.
//!
//! | step | file |
//! | --- | --- |
//! | recordings to mean forces by muscle, mounting, direction, pressure and stroke | `cells` |
//! | the shared force | `surface` |
//! | Gauss–Newton steps, and the variances of the random effects | `mixed_model` |
//! | each muscle predicted from the others; intervals over muscles | `between` |
//! | each held mounting predicted from all others, and what it has of its own | `unseen_mountings` |
//! | constants | `criteria` |
//!
//! Linear mixed model and its equations: C. R. Henderson, Biometrics 31 (1975) 423, doi 10.2307/2529430; variances by expectation and maximisation:
//! N. M. Laird, J. H. Ware, Biometrics 38 (1982) 963, doi 10.2307/2529876.

use self::criteria::SLOPE_STEP;

mod between;
mod cells;
mod criteria;
mod mixed_model;
mod surface;
#[cfg(test)]
mod tests;
mod unseen_mountings;

pub use between::{LawError, Stock, stock};
pub use cells::{Cell, Mounted, StockCells, stock_cells};
pub use criteria::{FEWEST_MUSCLES, MEAN_SIZE};
pub use mixed_model::fit;
pub use unseen_mountings::{MountingCause, UnseenMounting, unseen_mountings};

use self::surface::Surface;

/// What may differ systematically between muscles of different length: the shared parameters beside the force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Law {
    /// `λ`: both ends together have a length that does not pull.
    Ends,
    /// `κ`: tapers at the ends that grow with contraction.
    Taper,
    /// `1/K`: the frame yields in proportion to the force.
    Compliance,
}

impl Law {
    /// All of them, in the order of their parameters.
    pub const ALL: [Self; 3] = [Self::Ends, Self::Taper, Self::Compliance];

    /// The effect of the catalogue.
    #[must_use]
    pub fn effect(self) -> &'static str {
        match self {
            Self::Ends | Self::Taper => "tip-effect",
            Self::Compliance => "rig-compliance",
        }
    }
}

/// A muscle of the stock, as the joint fit needs it.
#[derive(Debug, Clone, Copy)]
pub struct Member<'a> {
    /// Its description.
    pub muscle: &'a pam_data::muscle_description::MuscleDescription,
    /// Its recordings.
    pub campaign: &'a pam_data::recording::Campaign,
}

/// A value with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Value {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub std: f64,
}

/// What a muscle has of its own.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Own {
    /// `a_i`: the logarithm of its force beside that of the stock.
    pub scale: Value,
    /// `c_i`: by how much it is more contracted than its rest length says, m.
    pub length: Value,
    /// `d_m` of each mounting, m.
    pub mounted: Vec<Value>,
    /// `b_m` of each mounting, N.
    pub zero: Vec<Value>,
}

/// Standard deviations of the random effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviations {
    /// Of the logarithm of the force between muscles.
    pub scale: f64,
    /// Of the rest length, m.
    pub length: f64,
    /// Of the mounted length, m.
    pub mounted: f64,
    /// Of the load cell's zero, N.
    pub zero: f64,
    /// Of the residuals, N.
    pub residual: f64,
}

/// Muscles fitted together.
#[derive(Debug, Clone)]
pub struct StockFit {
    pub(crate) surface: Surface,
    /// Coefficients of `f_0`, then of `f_1`, N.
    pub(crate) coefficients: Vec<f64>,
    /// `λ` (m), `κ` (m), `1/K` (m/N); zero with a standard error of zero where the law is not among those that were fitted.
    pub shared: [Value; 3],
    /// By muscle, in the order of the members.
    pub own: Vec<Own>,
    /// Standard deviations.
    pub deviations: Deviations,
    /// `mean 1/L0`, 1/m.
    pub(crate) inverse_length: f64,
    /// All unknowns, from which a similar fit starts.
    pub(crate) unknowns: Vec<f64>,
    /// Root mean square of the residuals of the cells, N.
    pub rms: f64,
}

/// Where a force is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Gauge pressure, Pa.
    pub pressure: f64,
    /// Stroke, m.
    pub stroke: f64,
    /// Rest length, m.
    pub rest_length: f64,
    /// +1 shortening or filling, −1 lengthening or emptying, 0 the mid-line.
    pub direction: f64,
    /// The muscle, by its number among the members; `None` for one that was not fitted.
    pub member: Option<usize>,
    /// Its mounting, by its number; `None` for one that was not fitted.
    pub mounting: Option<usize>,
}

impl StockFit {
    /// The force at a place, N. What is not known of a muscle or a mounting is at its mean.
    #[must_use]
    pub fn force(&self, at: &Place) -> f64 {
        let own = at.member.and_then(|m| self.own.get(m));
        let of = |list: fn(&Own) -> &Vec<Value>| {
            own.zip(at.mounting).and_then(|(o, k)| list(o).get(k)).map_or(0.0, |v| v.value)
        };
        let (mounted, zero) = (of(|o| &o.mounted), of(|o| &o.zero));
        let (scale, length) = own.map_or((0.0, 0.0), |o| (o.scale.value, o.length.value));
        let compliance = self.shared[2].value;
        let mut force = 0.0;
        // The stroke depends on the force where the frame yields; a few steps settle it.
        for _ in 0..if compliance == 0.0 { 1 } else { 30 } {
            let contraction = (at.stroke + length + mounted + compliance * force) / at.rest_length;
            let next = scale.exp()
                * self.pull(contraction, at.rest_length)
                * self.shared_force(at.pressure, contraction, at.direction)
                + zero;
            force += 0.5 * (next - force) * if compliance == 0.0 { 2.0 } else { 1.0 };
        }
        force
    }

    /// Standard deviation of the force at a place from what is not known there, N: length and zero of the mounting, and those of a muscle that was
    /// not fitted.
    #[must_use]
    pub fn unknown_deviation(&self, at: &Place) -> f64 {
        let beside = |by: f64| self.force(&Place { stroke: at.stroke + by, ..*at });
        let slope = (beside(SLOPE_STEP) - beside(-SLOPE_STEP)) / (2.0 * SLOPE_STEP);
        let d = &self.deviations;
        let mounting = if at.mounting.is_none() { (slope * d.mounted).hypot(d.zero) } else { 0.0 };
        let muscle =
            if at.member.is_none() { (slope * d.length).hypot(d.scale * self.force(at)) } else { 0.0 };
        mounting.hypot(muscle)
    }

    /// The shared force of the stock at a pressure (Pa), contraction and direction, N.
    #[must_use]
    pub fn shared_force(&self, pressure: f64, contraction: f64, direction: f64) -> f64 {
        let (basis, _) = self.surface.at(pressure, contraction);
        let count = self.surface.len();
        basis
            .iter()
            .map(|(k, v)| v * (self.coefficients[*k] + direction * self.coefficients[count + k]))
            .sum()
    }

    /// `1 − η`.
    #[must_use]
    pub fn pull(&self, contraction: f64, rest_length: f64) -> f64 {
        let [ends, taper, _] = self.shared;
        1.0 - (ends.value + taper.value * contraction) * (1.0 / rest_length - self.inverse_length)
    }

    /// The same for a muscle without end effect, of the mean inverse length: 1 by definition.
    #[must_use]
    pub fn mean_inverse_length(&self) -> f64 {
        self.inverse_length
    }
}
