//! What effects look at.

use crate::scalar::Scalar;

/// All that an effect may look at in one moment, in SI units. A plain value: anyone who calls decides how speed and
/// direction were found (causally on the controller, from both sides on the host).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Context<T> {
    /// Time since the last step, s; zero on the first.
    ///
    /// Over a pause between recordings it is the pause: any `dt ≥ 0` is stepped over exactly, half an hour or a month. A pause of
    /// unknown length is the caller's to assume: zero ("nothing was forgotten") and infinity ("all that can fade has faded")
    /// are both legal and bound what is possible.
    pub dt: T,
    /// Time since the start of the campaign or since power-up, s.
    pub time: T,
    /// `P`, gauge, Pa.
    pub pressure: T,
    /// `P′ = P − P0`, Pa.
    pub corrected_pressure: T,
    /// `dP/dt`, Pa/s.
    pub pressure_rate: T,
    /// `ΔL`, m.
    pub stroke: T,
    /// Contraction `ΔL/L0`, a fraction; 0 at rest length.
    pub contraction: T,
    /// `L`, m.
    pub length: T,
    /// `v = d(ΔL)/dt`, m/s, positive while shortening.
    pub speed: T,
    /// `dv/dt`, m/s².
    pub acceleration: T,
    /// `s`: +1 shortening, −1 lengthening, 0 unknown.
    pub direction: T,
    /// Travel since the last reversal, m, ≥ 0.
    pub travel: T,
    /// Time since the last reversal, s.
    pub since_reversal: T,
    /// How long the muscle rested before its present motion, or has been resting, s.
    pub hold_time: T,
    /// 1 while the muscle rests, 0 while it moves. A caller that leaves it at 0 shows a rest by a growing hold time.
    pub resting: T,
    /// Strokes back and forth so far, in full cycles.
    pub cycles: T,
    /// Absolute temperature, K, or 0 where it is not measured.
    pub temperature: T,
    /// `L0`, m.
    pub rest_length: T,
    /// `B`, length of one braid fibre, m.
    pub fibre_length: T,
    /// `N`, turns of a fibre about the bladder.
    pub turns: T,
    /// `R`, m.
    pub radius: T,
    /// `R0`, m.
    pub rest_radius: T,
    /// `ε_x`, radial strain.
    pub radial_strain: T,
    /// `ε_z`, axial strain, negative in contraction.
    pub axial_strain: T,
    /// `V_B/L`, m²: what an axial stress in the wall pulls with.
    pub axial_area: T,
    /// `t L²/(2πN²R)`, m²: what a hoop stress in the wall pushes with.
    pub hoop_area: T,
    /// `g = ∂F_G/∂P`, m².
    pub area: T,
    /// `F_G(P′, L)`, N.
    pub gaylord: T,
    /// Elastic part of the base model, N (negative as the bladder resists contraction).
    pub elastic: T,
    /// Friction-free force of the base model, N.
    pub quasi: T,
    /// Friction factor `k_F(P)`, a fraction of the force without friction.
    pub friction: T,
    /// `M`, the order of the base model's elastic polynomial.
    pub order: T,
    /// `∂F_quasi/∂(ΔL)`, N/m (negative: the muscle pulls less as it shortens).
    pub stiffness: T,
    /// `∂F_quasi/∂P`, N/Pa.
    pub pressure_slope: T,
}

impl<T: Scalar> Context<T> {
    /// All zeros.
    pub const NONE: Self = Self {
        dt: T::ZERO,
        time: T::ZERO,
        pressure: T::ZERO,
        corrected_pressure: T::ZERO,
        pressure_rate: T::ZERO,
        stroke: T::ZERO,
        contraction: T::ZERO,
        length: T::ZERO,
        speed: T::ZERO,
        acceleration: T::ZERO,
        direction: T::ZERO,
        travel: T::ZERO,
        since_reversal: T::ZERO,
        hold_time: T::ZERO,
        resting: T::ZERO,
        cycles: T::ZERO,
        temperature: T::ZERO,
        rest_length: T::ZERO,
        fibre_length: T::ZERO,
        turns: T::ZERO,
        radius: T::ZERO,
        rest_radius: T::ZERO,
        radial_strain: T::ZERO,
        axial_strain: T::ZERO,
        axial_area: T::ZERO,
        hoop_area: T::ZERO,
        area: T::ZERO,
        gaylord: T::ZERO,
        elastic: T::ZERO,
        quasi: T::ZERO,
        friction: T::ZERO,
        order: T::ZERO,
        stiffness: T::ZERO,
        pressure_slope: T::ZERO,
    };

    /// What a part of the friction-free balance comes to at the muscle's ends: `(1 − s k_F)` of it, as the braid rubs in proportion
    /// to the whole. Whatever changes that balance (its gas, its shape, its bladder) changes the friction with it.
    #[inline]
    pub fn rubbed(&self, part: T) -> T {
        part * (T::ONE - self.friction * self.direction)
    }

    /// Force of the base model with its friction, N.
    #[inline]
    pub fn force(&self) -> T {
        self.rubbed(self.quasi)
    }

    /// `∂F/∂x = ∂F_quasi/∂x (1 − s k_F)`, N/m: how much less the muscle pulls per metre of shortening, its friction with it.
    #[inline]
    pub fn slope(&self) -> T {
        self.rubbed(self.stiffness)
    }

    /// `g (1 − s k_F)`, m²: how much harder the muscle pulls per pascal at its gas. Not the slope of the table: `E_k` that change
    /// from one test pressure to the next say how a fit took up other errors, not what a change of pressure does.
    #[inline]
    pub fn pull_per_pressure(&self) -> T {
        self.rubbed(self.area)
    }

    /// What the bladder's stress takes from the pull of its gas, N, negative: the elastic polynomial and the deadband's `−P0 g`, as
    /// `P0` is what stretches the bladder out to its braid. How a fit shares it between the two does not matter here.
    #[inline]
    pub fn bladder(&self) -> T {
        self.quasi - self.pressure * self.area
    }

    /// What the memories of load are driven by, N: the bladder's and Gaylord's, of a muscle that pulls. A slack one carries
    /// neither: its bladder does not press on the braid, and the braid buckles instead of straining it.
    #[inline]
    pub fn loads(&self) -> (T, T) {
        let gas = (self.pressure * self.area).max(T::ZERO);
        (self.bladder().max(-gas), self.gaylord.max(T::ZERO))
    }

    /// `c_1`, m²: the elastic force per pascal of a linear wall, `(V_B/L) ε_z − t L² ε_x/(2πN²R)`; negative in contraction.
    #[inline]
    pub fn unit_elastic(&self) -> T {
        self.axial_area * self.axial_strain - self.hoop_area * self.radial_strain
    }

    /// The same moment in another number type.
    pub fn cast<U: Scalar>(&self) -> Context<U> {
        let to = |x: T| U::from_f64(x.to_f64());
        Context {
            dt: to(self.dt),
            time: to(self.time),
            pressure: to(self.pressure),
            corrected_pressure: to(self.corrected_pressure),
            pressure_rate: to(self.pressure_rate),
            stroke: to(self.stroke),
            contraction: to(self.contraction),
            length: to(self.length),
            speed: to(self.speed),
            acceleration: to(self.acceleration),
            direction: to(self.direction),
            travel: to(self.travel),
            since_reversal: to(self.since_reversal),
            hold_time: to(self.hold_time),
            resting: to(self.resting),
            cycles: to(self.cycles),
            temperature: to(self.temperature),
            rest_length: to(self.rest_length),
            fibre_length: to(self.fibre_length),
            turns: to(self.turns),
            radius: to(self.radius),
            rest_radius: to(self.rest_radius),
            radial_strain: to(self.radial_strain),
            axial_strain: to(self.axial_strain),
            axial_area: to(self.axial_area),
            hoop_area: to(self.hoop_area),
            area: to(self.area),
            gaylord: to(self.gaylord),
            elastic: to(self.elastic),
            quasi: to(self.quasi),
            friction: to(self.friction),
            order: to(self.order),
            stiffness: to(self.stiffness),
            pressure_slope: to(self.pressure_slope),
        }
    }
}
