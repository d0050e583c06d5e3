//! The muscle model in the form that is evaluated: force, and its slope in pressure.
//!
//! ```text
//! F_G(P′, L)   = P′ (3 L² − B²) / (4 π N²)                    P′ = P − P0
//! F_NLFB(P, L) = Σ_k E_k(P) [ (V_B/L) ε_z^k − t L² ε_x^k / (2 π N² R) ]
//! F            = (F_G + F_NLFB) (1 − k_F(P) s) + effects
//! ```
//! Source: E. G. Hocking, thesis, University of Maryland (2012), chapter 3.

use crate::braid::{Braid, Posture};
use crate::effects::{Chain, Context};
use crate::motion::Motion;
use crate::scalar::Scalar;
use crate::spline::{self, Cubic, MAX_NODES, Nodes};
use crate::table::{Kind, MAX_ORDER, MuscleTable, TableError};
use crate::units::{Force, Length, Pressure};

const SEGMENTS: usize = MAX_NODES - 1;

/// A muscle ready to be evaluated, built once from its [`MuscleTable`].
#[derive(Clone, Debug, PartialEq)]
pub struct Muscle<T> {
    pub(crate) braid: Braid<T>,
    pub(crate) nodes: Nodes<T>,
    pub(crate) order: usize,
    order_scalar: T,
    /// Per segment: `E_1…E_M` and, in the last place, `k_F`.
    pub(crate) segments: [[Cubic<T>; MAX_ORDER + 1]; SEGMENTS],
    pub(crate) deadband: T,
    pub(crate) max_pressure: T,
    goes_slack: bool,
    kind: Kind,
}

/// The friction curve's place among a segment's cubics.
pub(crate) const FRICTION: usize = MAX_ORDER;

/// The muscle held at one stroke: what remains is a function of pressure alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held<T> {
    /// The shape at this stroke.
    pub posture: Posture<T>,
    /// `c_k`, m².
    pub columns: [T; MAX_ORDER],
}

/// How a [`Held`] muscle's coefficients change with stroke `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldSlopes<T> {
    /// `dg/dx`, m.
    pub area: T,
    /// `dc_k/dx`, m.
    pub columns: [T; MAX_ORDER],
}

/// The parts of the base model's force at one moment, N and N/Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts<T> {
    /// `F_G(P′, L)`.
    pub gaylord: T,
    /// `F_NLFB(P, L)`.
    pub elastic: T,
    /// `k_F(P)`.
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

impl<T: Scalar> Muscle<T> {
    /// Turns a table into the form that is evaluated. Lossless but for rounding to `T`.
    ///
    /// # Errors
    /// The first number of the table that cannot be used.
    pub fn build(table: &MuscleTable) -> Result<Self, TableError> {
        table.check()?;
        let braid64 = table.geometry.cast::<f64>().build().map_err(TableError::Geometry)?;
        let count = table.nodes.len();
        let mut nodes = [0.0_f64; MAX_NODES];
        for (to, from) in nodes.iter_mut().zip(&table.nodes) {
            *to = f64::from(*from);
        }
        let nodes = &nodes[..count];
        let mut muscle = Self {
            braid: braid64.cast(),
            nodes: Nodes::new(nodes),
            order: table.order(),
            order_scalar: T::from_f32(table.order() as f32),
            segments: [[[T::ZERO; 4]; MAX_ORDER + 1]; SEGMENTS],
            deadband: T::from_f32(table.deadband.pascals()),
            max_pressure: T::from_f32(table.max_pressure.pascals()),
            goes_slack: table.goes_slack,
            kind: table.kind,
        };
        let curves = table.elastic.iter().enumerate().chain(core::iter::once((FRICTION, &table.friction)));
        for (curve, values) in curves {
            let mut value = [0.0_f64; MAX_NODES];
            for (to, from) in value.iter_mut().zip(values) {
                *to = f64::from(*from);
            }
            let mut cubics = [[0.0_f64; 4]; SEGMENTS];
            cubics[0][0] = value[0];
            spline::natural_cubic(nodes, &value[..count], &mut cubics);
            for (to, from) in muscle.segments.iter_mut().zip(cubics) {
                to[curve] = from.map(T::from_f64);
            }
        }
        Ok(muscle)
    }

    /// The muscle at one contraction stroke.
    #[inline(always)]
    pub fn held(&self, stroke: Length<T>) -> Held<T> {
        let posture = self.braid.posture(stroke);
        let mut columns = [T::ZERO; MAX_ORDER];
        let mut axial = posture.axial_area;
        let mut hoop = posture.hoop_area;
        for column in columns.iter_mut().take(self.order) {
            axial *= posture.axial_strain;
            hoop *= posture.radial_strain;
            *column = axial - hoop;
        }
        Held { posture, columns }
    }

    /// The parts of the force at a held stroke and a pressure.
    #[inline]
    pub fn parts(&self, held: &Held<T>, pressure: Pressure<T>) -> Parts<T> {
        let p = pressure.si();
        let place = self.nodes.place(p);
        let segment = &self.segments[place.index];
        let u = place.offset;
        let mut elastic = T::ZERO;
        let mut elastic_slope = T::ZERO;
        for (column, cubic) in held.columns.iter().zip(segment.iter()).take(self.order) {
            elastic += *column * spline::value(cubic, u);
            elastic_slope += *column * spline::slope(cubic, u);
        }
        let within = !place.clamped;
        let area = held.posture.area;
        Parts {
            gaylord: (p - self.deadband) * area,
            elastic,
            friction: spline::value(&segment[FRICTION], u),
            pressure_slope: if within { area + elastic_slope } else { area },
            friction_slope: if within { spline::slope(&segment[FRICTION], u) } else { T::ZERO },
        }
    }

    /// The force of the base model, without effects. `direction` is +1 while shortening, −1 while lengthening, 0 for the
    /// mid-line.
    ///
    /// ```
    /// # use model_core::{muscle::Muscle, table, units::*};
    /// let muscle = Muscle::<f64>::build(&table::example()).unwrap();
    /// let blocked = muscle.force(Pressure::from_kilopascals(500.0), Length::ZERO, 0.0);
    /// let deadband = 76.5e3;
    /// let area = muscle.braid().posture(Length::ZERO).area;
    /// assert!((blocked.newtons() - (500.0e3 - deadband) * area).abs() < 1e-3, "no elastic force at rest length");
    /// ```
    #[inline]
    pub fn force(&self, pressure: Pressure<T>, stroke: Length<T>, direction: T) -> Force<T> {
        let held = self.held(stroke);
        let place = self.nodes.place(pressure.si());
        let segment = &self.segments[place.index];
        let mut quasi = (pressure.si() - self.deadband) * held.posture.area;
        for (column, cubic) in held.columns.iter().zip(segment.iter()).take(self.order) {
            quasi += *column * spline::value(cubic, place.offset);
        }
        let friction = spline::value(&segment[FRICTION], place.offset);
        self.pull(quasi * (T::ONE - friction * direction))
    }

    /// A computed force as the muscle can exert it: a slack one does not push.
    #[inline]
    pub fn pull(&self, newtons: T) -> Force<T> {
        Force::from_newtons(if self.goes_slack { newtons.max(T::ZERO) } else { newtons })
    }

    /// All that an effect may look at, from a motion and a pressure.
    pub fn context(&self, motion: &Motion<T>, pressure: Pressure<T>) -> Context<T> {
        let held = self.held(Length::from_metres(motion.stroke));
        self.context_held(&held, motion, pressure)
    }

    /// The same where the stroke's part is known already.
    pub fn context_held(&self, held: &Held<T>, motion: &Motion<T>, pressure: Pressure<T>) -> Context<T> {
        let parts = self.parts(held, pressure);
        let stiffness = self.stiffness_at(pressure.si(), &self.slopes(held));
        Context {
            dt: motion.dt,
            time: motion.time,
            pressure: pressure.si(),
            corrected_pressure: pressure.si() - self.deadband,
            pressure_rate: motion.pressure_rate,
            stroke: motion.stroke,
            contraction: motion.stroke / self.braid.rest_length(),
            length: held.posture.length,
            speed: motion.speed,
            acceleration: motion.acceleration,
            direction: motion.direction,
            travel: motion.travel,
            since_reversal: motion.since_reversal,
            hold_time: motion.hold_time,
            resting: motion.resting,
            cycles: motion.cycles,
            temperature: motion.temperature,
            rest_length: self.braid.rest_length(),
            fibre_length: self.braid.fibre_length(),
            turns: self.braid.turns(),
            radius: held.posture.radius,
            rest_radius: self.braid.rest_radius(),
            radial_strain: held.posture.radial_strain,
            axial_strain: held.posture.axial_strain,
            axial_area: held.posture.axial_area,
            hoop_area: held.posture.hoop_area,
            area: held.posture.area,
            gaylord: parts.gaylord,
            elastic: parts.elastic,
            quasi: parts.quasi(),
            friction: parts.friction,
            order: self.order_scalar,
            stiffness,
            pressure_slope: parts.pressure_slope,
        }
    }

    /// How the coefficients of pressure and of the `E_k` change with stroke.
    #[inline]
    pub fn slopes(&self, held: &Held<T>) -> HeldSlopes<T> {
        let posture = &held.posture;
        let slopes = self.braid.slopes(posture);
        let mut columns = [T::ZERO; MAX_ORDER];
        // c_k = A ε_z^k − H ε_x^k, so c_k′ = (A′ ε_z + k A ε_z′) ε_z^(k−1) − (H′ ε_x + k H ε_x′) ε_x^(k−1).
        let (mut axial_power, mut hoop_power) = (T::ONE, T::ONE);
        let mut axial = slopes.axial_area * posture.axial_strain;
        let mut hoop = slopes.hoop_area * posture.radial_strain;
        for column in columns.iter_mut().take(self.order) {
            axial += posture.axial_area * slopes.axial_strain;
            hoop += posture.hoop_area * slopes.radial_strain;
            *column = axial * axial_power - hoop * hoop_power;
            axial_power *= posture.axial_strain;
            hoop_power *= posture.radial_strain;
        }
        HeldSlopes { area: slopes.area, columns }
    }

    /// The moment with another pressure in place of the measured one: what the force there would be.
    #[inline]
    pub fn at_pressure(
        &self,
        context: &Context<T>,
        held: &Held<T>,
        slopes: &HeldSlopes<T>,
        pressure: Pressure<T>,
    ) -> (Context<T>, Parts<T>) {
        let parts = self.parts(held, pressure);
        let moved = Context {
            pressure: pressure.si(),
            corrected_pressure: pressure.si() - self.deadband,
            gaylord: parts.gaylord,
            elastic: parts.elastic,
            quasi: parts.quasi(),
            friction: parts.friction,
            stiffness: self.stiffness_at(pressure.si(), slopes),
            pressure_slope: parts.pressure_slope,
            ..*context
        };
        (moved, parts)
    }

    /// `∂F_quasi/∂x` at a pressure, N/m.
    #[inline]
    fn stiffness_at(&self, pressure: T, slopes: &HeldSlopes<T>) -> T {
        let place = self.nodes.place(pressure);
        let segment = &self.segments[place.index];
        let mut sum = (pressure - self.deadband) * slopes.area;
        for (column, cubic) in slopes.columns.iter().zip(segment.iter()).take(self.order) {
            sum += *column * spline::value(cubic, place.offset);
        }
        sum
    }

    /// The force with the effects of `chain` at a moment that the chain has been stepped to.
    pub fn force_with(&self, chain: &Chain<T>, context: &Context<T>) -> Force<T> {
        self.pull(context.force() + chain.force(context))
    }

    /// The sleeve's kinematics.
    pub fn braid(&self) -> &Braid<T> {
        &self.braid
    }
    /// `P0`.
    pub fn deadband(&self) -> Pressure<T> {
        Pressure::from_pascals(self.deadband)
    }
    /// The highest pressure that may be commanded.
    pub fn max_pressure(&self) -> Pressure<T> {
        Pressure::from_pascals(self.max_pressure)
    }
    /// Pulling or pushing.
    pub fn kind(&self) -> Kind {
        self.kind
    }
    /// Whether the force stops at zero.
    pub fn goes_slack(&self) -> bool {
        self.goes_slack
    }
}
