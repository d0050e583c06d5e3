//! Kinematics of the braided sleeve: from the muscle's length to its radius, wall and strains.
//!
//! Source: E. G. Hocking, thesis, University of Maryland (2012), chapter 2. Fibres of fixed length `B` wind `N` turns
//! about a cylinder; the bladder's material keeps its volume `V_B`.

use core::f64::consts::PI;

use crate::scalar::Scalar;
use crate::units::{Angle, Length};

mod geometry;

pub use geometry::{Geometry, GeometryError};

/// What the sleeve keeps of its radius where its fibres are straight, m²: a micrometre, squared. A constant that is known to be
/// positive, so that the compiler needs no way out of the square root.
const LEAST_RADIUS_SQUARED: f32 = 1.0e-12;

/// The sleeve's constants, ready for use at any length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Braid<T> {
    rest_length: T,
    inv_rest_length: T,
    rest_radius: T,
    inv_rest_radius: T,
    fibre_squared: T,
    /// `1/(2πN)²`: `R²` for each `B² − L²`.
    widening: T,
    /// `3/(4πN²)`: the part of the effective area for each `L²`.
    three_inv_four_pi_turns_squared: T,
    /// `B²/(4πN²)`, m²: the part of the effective area that does not depend on the length.
    fibre_area: T,
    /// `1/(2πN²)`: the hoop area for each `t L²/R`.
    inv_two_pi_turns_squared: T,
    bladder_volume: T,
    bladder_volume_over_pi: T,
    tip: T,
    /// `L0 + 2 (π/2 − 1) R0`, or `L0` without the tip correction.
    tip_length: T,
    fibre: T,
    turns: T,
}

/// The muscle's shape at one length, and what it does to pressure and stress. All in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture<T> {
    /// `L`, m.
    pub length: T,
    /// `L` or, with the tip correction, `L′ = L − 2 (π/2 − 1)(R − R0)`, m.
    pub load_length: T,
    /// `R`, outer radius of the bladder, m.
    pub radius: T,
    /// `t`, wall of the bladder, m.
    pub wall: T,
    /// `ε_z = L/L0 − 1`, negative in contraction (with the tip correction, of `L′`).
    pub axial_strain: T,
    /// `ε_x = R/R0 − 1`.
    pub radial_strain: T,
    /// `g = ∂F_G/∂P′ = (3 L² − B²) / (4 π N²)`, m²: the muscle's effective area.
    pub area: T,
    /// `V_B / L`, m²: what an axial stress in the wall pulls with.
    pub axial_area: T,
    /// `t L² / (2 π N² R)`, m²: what a hoop stress in the wall pushes with.
    pub hoop_area: T,
}

impl<T: Scalar> Posture<T> {
    /// All zeros: nothing has been posed yet.
    pub const NONE: Self = Self {
        length: T::ZERO,
        load_length: T::ZERO,
        radius: T::ZERO,
        wall: T::ZERO,
        axial_strain: T::ZERO,
        radial_strain: T::ZERO,
        area: T::ZERO,
        axial_area: T::ZERO,
        hoop_area: T::ZERO,
    };
}

impl<T: Scalar> Braid<T> {
    /// All zeros, for a place that is not filled yet.
    pub const NONE: Self = Self {
        rest_length: T::ZERO,
        inv_rest_length: T::ZERO,
        rest_radius: T::ZERO,
        inv_rest_radius: T::ZERO,
        fibre_squared: T::ZERO,
        widening: T::ZERO,
        three_inv_four_pi_turns_squared: T::ZERO,
        fibre_area: T::ZERO,
        inv_two_pi_turns_squared: T::ZERO,
        bladder_volume: T::ZERO,
        bladder_volume_over_pi: T::ZERO,
        tip: T::ZERO,
        tip_length: T::ZERO,
        fibre: T::ZERO,
        turns: T::ZERO,
    };

    /// The shape at contraction stroke `ΔL = L0 − L`.
    ///
    /// ```text
    /// R² = (B² − L²)/(2 π N)²      t = R − sqrt(R² − V_B/(π L))
    /// ```
    /// Beyond the fibre's length (`L ≥ B`, pulled straight) the radius is held at a micrometre, and where the bladder would fill the whole sleeve the wall is the radius: the result stays finite there, but has no physical
    /// meaning.
    #[inline(always)]
    pub fn posture(&self, stroke: Length<T>) -> Posture<T> {
        let length = self.rest_length - stroke.si();
        let radius_squared = ((self.fibre_squared - length * length) * self.widening)
            .at_least(T::from_f32(LEAST_RADIUS_SQUARED));
        let radius = radius_squared.sqrt();
        let bore = (radius_squared - self.bladder_volume_over_pi / length).at_least(T::ZERO).sqrt();
        let wall = radius - bore;
        let load_length = self.tip_length - stroke.si() - self.tip * radius;
        let squared = load_length * load_length;
        Posture {
            length,
            load_length,
            radius,
            wall,
            axial_strain: load_length * self.inv_rest_length - T::ONE,
            radial_strain: radius * self.inv_rest_radius - T::ONE,
            area: squared * self.three_inv_four_pi_turns_squared - self.fibre_area,
            axial_area: self.bladder_volume / load_length,
            hoop_area: wall * (squared * self.inv_two_pi_turns_squared) / radius,
        }
    }

    /// The same sleeve in another number type.
    pub fn cast<U: Scalar>(&self) -> Braid<U> {
        let to = |x: T| U::from_f64(x.to_f64());
        Braid {
            rest_length: to(self.rest_length),
            inv_rest_length: to(self.inv_rest_length),
            rest_radius: to(self.rest_radius),
            inv_rest_radius: to(self.inv_rest_radius),
            fibre_squared: to(self.fibre_squared),
            widening: to(self.widening),
            three_inv_four_pi_turns_squared: to(self.three_inv_four_pi_turns_squared),
            fibre_area: to(self.fibre_area),
            inv_two_pi_turns_squared: to(self.inv_two_pi_turns_squared),
            bladder_volume: to(self.bladder_volume),
            bladder_volume_over_pi: to(self.bladder_volume_over_pi),
            tip: to(self.tip),
            tip_length: to(self.tip_length),
            fibre: to(self.fibre),
            turns: to(self.turns),
        }
    }

    /// `L0`, m.
    pub fn rest_length(&self) -> T {
        self.rest_length
    }
    /// `1/L0`, 1/m.
    pub fn inv_rest_length(&self) -> T {
        self.inv_rest_length
    }
    /// `R0`, m.
    pub fn rest_radius(&self) -> T {
        self.rest_radius
    }
    /// `B`, length of one fibre, m.
    pub fn fibre_length(&self) -> T {
        self.fibre
    }
    /// `N`, turns of a fibre about the bladder.
    pub fn turns(&self) -> T {
        self.turns
    }
    /// `V_B`, volume of the bladder's material, m³.
    pub fn bladder_volume(&self) -> T {
        self.bladder_volume
    }
    /// The contraction at which pressure no longer pulls: `1 − B / (√3 L0)`.
    pub fn neutral_contraction(&self) -> T {
        T::ONE - self.fibre / (T::from_f64(1.732_050_807_568_877_2) * self.rest_length)
    }
    /// The gas volume inside the bladder at a posture, m³: `π R² L − V_B`.
    pub fn gas_volume(&self, posture: &Posture<T>) -> T {
        T::from_f64(PI) * posture.radius * posture.radius * posture.length - self.bladder_volume
    }
}

impl<T: Scalar> Posture<T> {
    /// The coefficient of `E_k` in the elastic force, for `k = 1…M` (m²):
    /// `c_k = (V_B/L) ε_z^k − t L² ε_x^k / (2 π N² R)`.
    #[inline]
    pub fn elastic_columns<const M: usize>(&self) -> [T; M] {
        let mut axial = self.axial_area;
        let mut hoop = self.hoop_area;
        core::array::from_fn(|_| {
            axial *= self.axial_strain;
            hoop *= self.radial_strain;
            axial - hoop
        })
    }
}

/// How the shape changes with contraction stroke `x`: derivatives by `x` of what [`Posture`] holds under the same names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PostureSlopes<T> {
    /// `dg/dx`, m.
    pub area: T,
    /// `d(V_B/L)/dx`, m.
    pub axial_area: T,
    /// `d(t L²/(2πN²R))/dx`, m.
    pub hoop_area: T,
    /// `dε_z/dx`, 1/m.
    pub axial_strain: T,
    /// `dε_x/dx`, 1/m.
    pub radial_strain: T,
}

impl<T: Scalar> Braid<T> {
    /// The derivatives by stroke at a posture, from those of [`Braid::posture`]'s equations:
    ///
    /// ```text
    /// dR/dx = L/((2πN)² R)      dt/dx = dR/dx − (R dR/dx − V_B/(2π L²))/(R − t)
    /// ```
    /// Finite everywhere; without meaning where the posture has none.
    #[inline]
    pub fn slopes(&self, posture: &Posture<T>) -> PostureSlopes<T> {
        let small = self.rest_radius * T::from_f32(1.0e-3);
        let radius = posture.radius.at_least(small);
        let inv_length = T::ONE / posture.length;
        let widening = posture.length * self.widening / radius;
        let bore = posture.radius - posture.wall;
        let squeezed = T::from_f32(0.5) * self.bladder_volume_over_pi * inv_length * inv_length;
        // Where the bladder fills the sleeve the posture holds the bore at zero, and the wall is the radius.
        let thinning = if bore > small { widening - (radius * widening - squeezed) / bore } else { widening };
        let shortening = -T::ONE - self.tip * widening;
        let per_length = shortening / posture.load_length;
        let area = self.three_inv_four_pi_turns_squared * posture.load_length * shortening;
        let thin = thinning / posture.wall.at_least(small);
        PostureSlopes {
            area: area + area,
            axial_area: -posture.axial_area * per_length,
            hoop_area: posture.hoop_area * (thin + per_length + per_length - widening / radius),
            axial_strain: shortening * self.inv_rest_length,
            radial_strain: widening * self.inv_rest_radius,
        }
    }
}

/// The thesis's miniature muscle, for examples and tests.
pub fn miniature() -> Geometry {
    Geometry {
        rest_length: Length::from_millimetres(39.16),
        braid_angle: Angle::from_degrees(77.4),
        outer_diameter: Length::from_millimetres(3.0),
        wall: Length::from_millimetres(0.5),
        tip_correction: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_the_shape_is_the_measured_one_and_nothing_is_strained() {
        let braid = miniature().build().expect("a valid geometry");
        let p = braid.posture(Length::ZERO);
        assert!((p.radius - 1.5e-3).abs() < 1e-12);
        assert!((p.wall - 0.5e-3).abs() < 1e-12);
        assert!(p.radial_strain.abs() < 1e-12 && p.axial_strain.abs() < 1e-12);
        for c in p.elastic_columns::<4>() {
            assert!(c.abs() < 1e-15);
        }
    }

    #[test]
    fn the_effective_area_is_the_rate_of_volume_against_length() {
        // Virtual work: F_G = −P dV/dL with the outer volume π R² L.
        let braid = miniature().build().expect("a valid geometry");
        let volume = |x: f64| {
            let p = braid.posture(Length::from_metres(x));
            PI * p.radius * p.radius * p.length
        };
        let h = 1e-6;
        for x in [0.0, 0.5e-3, 1.5e-3, 3.0e-3] {
            let dv_dx = (volume(x + h) - volume(x - h)) / (2.0 * h);
            let area = braid.posture(Length::from_metres(x)).area;
            assert!((dv_dx - area).abs() < 1e-6 * area, "at {x} m: {dv_dx} and {area}");
        }
    }

    #[test]
    fn slopes_agree_with_differences() {
        for tip_correction in [false, true] {
            let braid = Geometry { tip_correction, ..miniature() }.build().expect("a valid geometry");
            let h = 1e-7;
            for x in [-0.2e-3, 0.0, 1.0e-3, 3.0e-3] {
                let at = |x: f64| braid.posture(Length::from_metres(x));
                let slopes = braid.slopes(&at(x));
                let (up, down) = (at(x + h), at(x - h));
                let check = |name: &str, of: fn(&Posture<f64>) -> f64, slope: f64| {
                    let difference = (of(&up) - of(&down)) / (2.0 * h);
                    assert!(
                        (slope - difference).abs() < 1e-6 * difference.abs(),
                        "{name} at {x}: {slope} {difference}"
                    );
                };
                check("area", |p| p.area, slopes.area);
                check("axial area", |p| p.axial_area, slopes.axial_area);
                check("hoop area", |p| p.hoop_area, slopes.hoop_area);
                check("axial strain", |p| p.axial_strain, slopes.axial_strain);
                check("radial strain", |p| p.radial_strain, slopes.radial_strain);
            }
        }
    }

    #[test]
    fn blocked_force_of_the_thesis_muscle() {
        // 552 kPa with P0 = 76.5 kPa gives 135.7 N in the thesis; its angle and diameters are rounded.
        let braid = miniature().build().expect("a valid geometry");
        let force = (552.0e3 - 76.5e3) * braid.posture(Length::ZERO).area;
        assert!((force - 135.7).abs() < 0.05 * 135.7, "{force} N");
    }

    #[test]
    fn far_outside_the_working_range_everything_stays_finite() {
        let braid = miniature().cast::<f32>().build().expect("a valid geometry");
        for mm in [-5.0_f32, -1.0, 20.0, 35.0] {
            let p = braid.posture(Length::from_millimetres(mm));
            assert!(p.area.is_finite() && p.axial_area.is_finite() && p.hoop_area.is_finite());
        }
    }
}
