//! The muscle at one stroke and at one operating point.

use crate::braid::Posture;
use crate::effects::Context;
use crate::scalar::Scalar;
use crate::table::MAX_ORDER;

/// The muscle held at one stroke: its force is a function of pressure alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtStroke<T> {
    /// The shape at this stroke.
    pub posture: Posture<T>,
    /// `c_k`, m².
    pub columns: [T; MAX_ORDER],
}

/// How a [`AtStroke`] muscle's coefficients change with stroke `x`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrokeSlopes<T> {
    /// `dg/dx`, m.
    pub area: T,
    /// `dc_k/dx`, m.
    pub columns: [T; MAX_ORDER],
}

/// The operating point of a muscle with effects: stroke, pressure and motion; kept from tick to tick so that what never changes is written once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OperatingPoint<T> {
    /// The muscle at the measured stroke.
    pub at_stroke: AtStroke<T>,
    /// How that changes with stroke.
    pub slopes: StrokeSlopes<T>,
    /// What effects look at.
    pub context: Context<T>,
}

impl<T: Scalar> AtStroke<T> {
    /// All zeros, for a place that is not filled yet.
    pub const NONE: Self = Self { posture: Posture::NONE, columns: [T::ZERO; MAX_ORDER] };
}

impl<T: Scalar> OperatingPoint<T> {
    /// All zeros, for a place that is not filled yet.
    pub const NONE: Self = Self {
        at_stroke: AtStroke::NONE,
        slopes: StrokeSlopes { area: T::ZERO, columns: [T::ZERO; MAX_ORDER] },
        context: Context::NONE,
    };
}

/// The parts of the base model's force at one operating point, N and N/Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts<T> {
    /// `F_G(P′, L)`.
    pub gaylord: T,
    /// `F_NLFB(P, L)`.
    pub elastic: T,
    /// Friction factor `k_F(P)`, a fraction of the force without friction.
    pub friction: T,
    /// `∂(F_G + F_NLFB)/∂P`.
    pub pressure_slope: T,
    /// `∂k_F/∂P`, 1/Pa.
    pub friction_slope: T,
}

impl<T: Scalar> Parts<T> {
    /// `F_G + F_NLFB`, N.
    #[inline]
    pub fn quasi(&self) -> T {
        self.gaylord + self.elastic
    }
    /// The force for a direction of motion, N.
    #[inline]
    pub fn force(&self, direction: T) -> T {
        self.quasi() * (T::ONE - self.friction * direction)
    }
    /// Its slope in pressure, N/Pa.
    #[inline]
    pub fn slope(&self, direction: T) -> T {
        self.pressure_slope * (T::ONE - self.friction * direction)
            - self.quasi() * self.friction_slope * direction
    }
}
