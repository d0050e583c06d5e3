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
use crate::spline::{self, Cubic, MAX_NODES, MAX_PIECES, Nodes};
use crate::table::{Kind, MAX_ORDER, MuscleTable, TableError};
use crate::units::{Force, Length, Pressure};

mod at_stroke;

pub use at_stroke::{AtStroke, OperatingPoint, Parts, StrokeSlopes};

/// A muscle ready to be evaluated, built once from its [`MuscleTable`]. The long curves come last, so that an instruction reaches all
/// the rest.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Muscle<T> {
    pub(crate) braid: Braid<T>,
    pub(crate) nodes: Nodes<T>,
    pub(crate) order: usize,
    order_scalar: T,
    pub(crate) deadband: T,
    pub(crate) max_pressure: T,
    /// The least force that is exerted: zero for a muscle that goes slack.
    least_force: T,
    goes_slack: bool,
    kind: Kind,
    /// The curves, piece by piece of the line of pressures.
    pub(crate) pieces: [Piece<T>; MAX_PIECES],
}

/// All curves on one piece of the line of pressures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Piece<T> {
    /// The pressure that the cubics count from.
    pub(crate) origin: T,
    /// `E_1…E_M`, and zeros up to the largest order.
    pub(crate) elastic: [Cubic<T>; MAX_ORDER],
    /// Friction factor `k_F`.
    pub(crate) friction: Cubic<T>,
}

/// Up to this order the sums over `k` are written out without asking for the table's own: the coefficients beyond it are zero.
pub(crate) const COMMON_ORDER: usize = 4;

impl<T: Scalar> Piece<T> {
    const NONE: Self = Self { origin: T::ZERO, elastic: [[T::ZERO; 4]; MAX_ORDER], friction: [T::ZERO; 4] };
}

impl<T: Scalar> Muscle<T> {
    /// Turns a table into the form that is evaluated. Lossless except for rounding to `T`, in which all of it is computed: a controller
    /// has no double precision, and its software would cost more flash than all of the model's constants.
    ///
    /// # Errors
    /// The first number of the table that cannot be used.
    pub fn build(table: &MuscleTable) -> Result<Self, TableError> {
        let mut muscle = Self::blank();
        muscle.rebuild(table)?;
        Ok(muscle)
    }

    /// A place for [`Muscle::rebuild`]: no table yet, and no force.
    pub const fn blank() -> Self {
        Self {
            braid: Braid::NONE,
            nodes: Nodes::NONE,
            order: 0,
            order_scalar: T::ZERO,
            pieces: [Piece::NONE; MAX_PIECES],
            deadband: T::ZERO,
            max_pressure: T::ZERO,
            least_force: T::ZERO,
            goes_slack: false,
            kind: Kind::Contractile,
        }
    }

    /// As [`Muscle::build`], in a place that is there already: some 2 KiB that a controller keeps once and never moves. What
    /// was in it is lost when the table cannot be used.
    ///
    /// # Errors
    /// As [`Muscle::build`].
    #[inline(never)]
    pub fn rebuild(&mut self, table: &MuscleTable) -> Result<(), TableError> {
        table.check()?;
        self.braid = table.geometry.cast::<T>().build().map_err(TableError::Geometry)?;
        let in_full = |values: &[f32]| {
            let mut full = [T::ZERO; MAX_NODES];
            for (to, from) in full.iter_mut().zip(values) {
                *to = T::from_f32(*from);
            }
            full
        };
        let count = table.nodes.len();
        let nodes = in_full(&table.nodes);
        let nodes = &nodes[..count];
        self.nodes = Nodes::new(nodes);
        self.order = table.order();
        self.order_scalar = T::from_f32(table.order() as f32);
        self.deadband = T::from_f32(table.deadband.pascals());
        self.max_pressure = T::from_f32(table.max_pressure.pascals());
        self.least_force = if table.goes_slack { T::ZERO } else { T::from_f32(f32::MIN) };
        self.goes_slack = table.goes_slack;
        self.kind = table.kind;
        for (n, piece) in self.pieces.iter_mut().enumerate() {
            *piece = Piece { origin: self.nodes.origin(n), ..Piece::NONE };
        }
        let friction = table.elastic.len();
        for (k, values) in table.elastic.iter().chain([&table.friction]).enumerate() {
            let pieces = &mut self.pieces;
            spline::each_piece(nodes, &in_full(values)[..count], &mut |n, cubic| {
                let piece = &mut pieces[n];
                let to = if k == friction { &mut piece.friction } else { &mut piece.elastic[k] };
                *to = cubic;
            });
        }
        Ok(())
    }

    /// The muscle at one contraction stroke.
    #[inline(always)]
    pub fn at_stroke(&self, stroke: Length<T>) -> AtStroke<T> {
        let posture = self.braid.posture(stroke);
        let (z, x) = (posture.axial_strain, posture.radial_strain);
        let (a1, h1) = (posture.axial_area * z, posture.hoop_area * x);
        let (a2, h2) = (a1 * z, h1 * x);
        let (a3, h3) = (a2 * z, h2 * x);
        let (a4, h4) = (a3 * z, h3 * x);
        let mut columns = [a1 - h1, a2 - h2, a3 - h3, a4 - h4, T::ZERO, T::ZERO];
        if self.order > COMMON_ORDER {
            let (a5, h5) = (a4 * z, h4 * x);
            columns[4] = a5 - h5;
            columns[5] = a5 * z - h5 * x;
        }
        AtStroke { posture, columns }
    }

    /// The curves around a pressure, and the pressure above the one that they count from.
    #[inline(always)]
    fn around(&self, pressure: T) -> (&Piece<T>, T) {
        let piece = self.nodes.choose(pressure, &self.pieces);
        (piece, pressure - piece.origin)
    }

    /// The parts of the force at a held stroke and a pressure.
    #[inline]
    pub fn parts(&self, at_stroke: &AtStroke<T>, pressure: Pressure<T>) -> Parts<T> {
        self.parts_and_stiffness(at_stroke, &StrokeSlopes::default(), pressure).0
    }

    /// The same, and `∂F_quasi/∂x`, N/m, from how the coefficients change with stroke.
    #[inline(always)]
    pub(crate) fn parts_and_stiffness(
        &self,
        at_stroke: &AtStroke<T>,
        slopes: &StrokeSlopes<T>,
        pressure: Pressure<T>,
    ) -> (Parts<T>, T) {
        let p = pressure.si();
        let (piece, u) = self.around(p);
        let corrected = p - self.deadband;
        let area = at_stroke.posture.area;
        let (mut elastic, mut pressure_slope) = (T::ZERO, area);
        let mut stiffness = corrected * slopes.area;
        let mut add = |k: usize| {
            let (value, slope) = spline::value_and_slope(&piece.elastic[k], u);
            elastic += at_stroke.columns[k] * value;
            pressure_slope += at_stroke.columns[k] * slope;
            stiffness += slopes.columns[k] * value;
        };
        add(0);
        add(1);
        add(2);
        add(3);
        if self.order > COMMON_ORDER {
            add(4);
            add(5);
        }
        let (friction, friction_slope) = spline::value_and_slope(&piece.friction, u);
        let gaylord = corrected * area;
        (Parts { gaylord, elastic, friction, pressure_slope, friction_slope }, stiffness)
    }

    /// `∂F_quasi/∂x` at a held stroke and a pressure, N/m; below zero, since a muscle pulls less the shorter it is.
    pub fn stroke_slope(
        &self,
        at_stroke: &AtStroke<T>,
        slopes: &StrokeSlopes<T>,
        pressure: Pressure<T>,
    ) -> T {
        self.parts_and_stiffness(at_stroke, slopes, pressure).1
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
    #[inline(always)]
    pub fn force(&self, pressure: Pressure<T>, stroke: Length<T>, direction: T) -> Force<T> {
        if self.order > COMMON_ORDER {
            return self.force_of_high_order(pressure, stroke, direction);
        }
        self.pull(self.force_posed::<false>(&self.braid.posture(stroke), pressure, direction))
    }

    /// The same for a table of an order above [`COMMON_ORDER`].
    #[inline(never)]
    fn force_of_high_order(&self, pressure: Pressure<T>, stroke: Length<T>, direction: T) -> Force<T> {
        self.pull(self.force_posed::<true>(&self.braid.posture(stroke), pressure, direction))
    }

    /// The same at a posture, N, and below zero where the muscle would have to push.
    ///
    /// `Σ E_k c_k = (V_B/L) ε_z Σ E_k ε_z^(k−1) − (t L²/2πN²R) ε_x Σ E_k ε_x^(k−1)`: the curves once, and two polynomials.
    #[inline(always)]
    fn force_posed<const HIGH: bool>(&self, posture: &Posture<T>, pressure: Pressure<T>, direction: T) -> T {
        let p = pressure.si();
        let (z, x) = (posture.axial_strain, posture.radial_strain);
        // Before the curves, so that fewer numbers wait in registers while they are evaluated.
        let gaylord = (p - self.deadband) * posture.area;
        let (axial_part, hoop_part) = (posture.axial_area * z, posture.hoop_area * x);
        let piece = self.nodes.choose(p, &self.pieces);
        let u = p - piece.origin;
        let e = |k: usize| spline::value(&piece.elastic[k], u);
        let (mut axial, mut hoop) = (e(3), e(3));
        if HIGH {
            axial += z * (e(4) + z * e(5));
            hoop += x * (e(4) + x * e(5));
        }
        let (e1, e2, e3) = (e(0), e(1), e(2));
        axial = e1 + z * (e2 + z * (e3 + z * axial));
        hoop = e1 + x * (e2 + x * (e3 + x * hoop));
        let quasi = gaylord + axial_part * axial - hoop_part * hoop;
        quasi * (T::ONE - spline::value(&piece.friction, u) * direction)
    }

    /// The same at a held stroke, whose coefficients are there already: `Σ E_k c_k` as it is written.
    #[inline(always)]
    pub(crate) fn force_held(&self, at_stroke: &AtStroke<T>, pressure: Pressure<T>, direction: T) -> T {
        let p = pressure.si();
        let (piece, u) = self.around(p);
        let c = &at_stroke.columns;
        let e = |k: usize| spline::value(&piece.elastic[k], u);
        let mut quasi = (p - self.deadband) * at_stroke.posture.area
            + c[0] * e(0)
            + c[1] * e(1)
            + c[2] * e(2)
            + c[3] * e(3);
        if self.order > COMMON_ORDER {
            quasi += c[4] * e(4) + c[5] * e(5);
        }
        quasi * (T::ONE - spline::value(&piece.friction, u) * direction)
    }

    /// A computed force as the muscle can exert it: a slack one does not push.
    #[inline(always)]
    pub fn pull(&self, newtons: T) -> Force<T> {
        Force::from_newtons(if newtons < self.least_force { self.least_force } else { newtons })
    }

    /// All that an effect may look at, from a motion and a pressure.
    pub fn context(&self, motion: &Motion<T>, pressure: Pressure<T>) -> Context<T> {
        let mut point = self.operating_point();
        self.update(&mut point, motion, pressure);
        point.context
    }

    /// The operating point at rest length without pressure, to begin with.
    pub fn operating_point(&self) -> OperatingPoint<T> {
        let mut point = OperatingPoint::NONE;
        self.begin(&mut point);
        point.at_stroke = self.at_stroke(Length::ZERO);
        point.slopes = self.slopes(&point.at_stroke);
        point
    }

    /// Puts into an operating point what stays the same in all of this muscle; the rest comes with [`Muscle::update`].
    pub fn begin(&self, point: &mut OperatingPoint<T>) {
        *point = OperatingPoint::NONE;
        let context = &mut point.context;
        context.rest_length = self.braid.rest_length();
        context.fibre_length = self.braid.fibre_length();
        context.turns = self.braid.turns();
        context.rest_radius = self.braid.rest_radius();
        context.order = self.order_scalar;
    }

    /// Moves an operating point to a motion and a pressure.
    #[inline]
    pub fn update(&self, point: &mut OperatingPoint<T>, motion: &Motion<T>, pressure: Pressure<T>) {
        point.at_stroke = self.at_stroke(Length::from_metres(motion.stroke));
        point.slopes = self.slopes(&point.at_stroke);
        self.fill_context(point, motion, pressure);
    }

    /// The rest of [`Muscle::update`]: what effects look at, at an operating point that has its shape and slopes already.
    #[inline]
    pub(crate) fn fill_context(
        &self,
        point: &mut OperatingPoint<T>,
        motion: &Motion<T>,
        pressure: Pressure<T>,
    ) {
        let OperatingPoint { at_stroke, slopes, context } = point;
        let posture = &at_stroke.posture;
        context.dt = motion.dt;
        context.time = motion.time;
        context.pressure_rate = motion.pressure_rate;
        context.stroke = motion.stroke;
        context.contraction = motion.stroke * self.braid.inv_rest_length();
        context.length = posture.length;
        context.speed = motion.speed;
        context.acceleration = motion.acceleration;
        context.direction = motion.direction;
        context.travel = motion.travel;
        context.since_reversal = motion.since_reversal;
        context.hold_time = motion.hold_time;
        context.resting = motion.resting;
        context.cycles = motion.cycles;
        context.temperature = motion.temperature;
        context.radius = posture.radius;
        context.radial_strain = posture.radial_strain;
        context.axial_strain = posture.axial_strain;
        context.axial_area = posture.axial_area;
        context.hoop_area = posture.hoop_area;
        context.area = posture.area;
        self.move_to(context, at_stroke, slopes, pressure);
    }

    /// Moves a context to another pressure than the measured one: what the force there would be.
    #[inline(always)]
    pub fn move_to(
        &self,
        context: &mut Context<T>,
        at_stroke: &AtStroke<T>,
        slopes: &StrokeSlopes<T>,
        pressure: Pressure<T>,
    ) -> Parts<T> {
        let (parts, stiffness) = self.parts_and_stiffness(at_stroke, slopes, pressure);
        context.pressure = pressure.si();
        context.corrected_pressure = pressure.si() - self.deadband;
        context.gaylord = parts.gaylord;
        context.elastic = parts.elastic;
        context.quasi = parts.quasi();
        context.friction = parts.friction;
        context.stiffness = stiffness;
        context.pressure_slope = parts.pressure_slope;
        parts
    }

    /// How the coefficients of pressure and of the `E_k` change with stroke.
    #[inline(always)]
    pub fn slopes(&self, at_stroke: &AtStroke<T>) -> StrokeSlopes<T> {
        let posture = &at_stroke.posture;
        let slopes = self.braid.slopes(posture);
        let mut columns = [T::ZERO; MAX_ORDER];
        // c_k = A ε_z^k − H ε_x^k, so c_k′ = (A′ ε_z + k A ε_z′) ε_z^(k−1) − (H′ ε_x + k H ε_x′) ε_x^(k−1).
        let (mut axial_power, mut hoop_power) = (T::ONE, T::ONE);
        let mut axial = slopes.axial_area * posture.axial_strain;
        let mut hoop = slopes.hoop_area * posture.radial_strain;
        let by_strain = (posture.axial_area * slopes.axial_strain, posture.hoop_area * slopes.radial_strain);
        let mut next = |k: usize| {
            axial += by_strain.0;
            hoop += by_strain.1;
            columns[k] = axial * axial_power - hoop * hoop_power;
            axial_power *= posture.axial_strain;
            hoop_power *= posture.radial_strain;
        };
        next(0);
        next(1);
        next(2);
        next(3);
        if self.order > COMMON_ORDER {
            next(4);
            next(5);
        }
        StrokeSlopes { area: slopes.area, columns }
    }

    /// The force with the effects of `chain` at an operating point to which the chain has been stepped.
    pub fn force_with(&self, chain: &Chain<T>, context: &Context<T>) -> Force<T> {
        self.pull(context.force() + chain.force(context))
    }

    /// The sleeve's kinematics.
    pub fn braid(&self) -> &Braid<T> {
        &self.braid
    }
    /// Deadband `P0`: the gauge pressure at which the muscle begins to contract.
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
