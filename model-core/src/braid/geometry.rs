//! Dimensions of a muscle measured with ruler and protractor, and the constants of the sleeve that follow.

use core::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::Braid;
use crate::fields::fields;
use crate::scalar::Scalar;
use crate::units::{Angle, Length};

/// What one measures on a muscle at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Geometry<T = f64> {
    /// `L0`: active length between the end fittings, unpressurised.
    pub rest_length: Length<T>,
    /// `α0`: angle of the fibres from the radial plane (77° is nearly axial).
    pub braid_angle: Angle<T>,
    /// `D0`: outer diameter of the bladder.
    pub outer_diameter: Length<T>,
    /// `t0`: wall thickness of the bladder.
    pub wall: Length<T>,
    /// Whether the load-bearing length is shortened by the rounded ends (`L′` in place of `L`).
    pub tip_correction: bool,
}

fields!(Geometry<f32> { rest_length, braid_angle, outer_diameter, wall, tip_correction });

/// Which dimension of a muscle cannot be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GeometryError {
    /// The rest length is not a positive number of metres up to 100.
    RestLength,
    /// The braid angle is not between 0° and 90° from the radial plane.
    BraidAngle,
    /// The outer diameter is not a positive number of metres up to 100, or gives constants that are not finite.
    OuterDiameter,
    /// The wall is not positive or not thinner than the radius.
    Wall,
}

impl core::fmt::Display for GeometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::RestLength => "the rest length must be a positive length",
            Self::BraidAngle => "the braid angle must lie between 0° and 90°, measured from the radial plane",
            Self::OuterDiameter => "the bladder's outer diameter must be a positive length",
            Self::Wall => "the bladder's wall must be positive and thinner than its radius",
        })
    }
}

impl core::error::Error for GeometryError {}

/// Longest muscle and widest bladder, m: more than any, and little enough that no constant of the sleeve leaves the range of single precision.
const LONGEST_M: f32 = 100.0;

/// Sine and cosine of an angle between 0° and 90°, by their Taylor series about the nearer end: to the precision of `T`, in a
/// tenth of the code that reduces any angle.
#[inline]
fn sine_and_cosine<T: Scalar>(angle: T) -> (T, T) {
    let right = T::from_f64(PI / 2.0);
    let series = |x: T, first: T, mut n: T| {
        let (mut term, mut sum) = (first, first);
        // Below 45° the term after the twelfth is less than 10⁻²⁴.
        for _ in 0..12 {
            term = -term * x * x / (n * (n + T::ONE));
            sum += term;
            n += T::ONE + T::ONE;
        }
        sum
    };
    let two = T::ONE + T::ONE;
    if angle + angle <= right {
        (series(angle, angle, two), series(angle, T::ONE, T::ONE))
    } else {
        let rest = right - angle;
        (series(rest, T::ONE, T::ONE), series(rest, rest, two))
    }
}

impl<T: Scalar> Geometry<T> {
    /// The same dimensions in another number type.
    pub fn cast<U: Scalar>(&self) -> Geometry<U> {
        Geometry {
            rest_length: self.rest_length.cast(),
            braid_angle: self.braid_angle.cast(),
            outer_diameter: self.outer_diameter.cast(),
            wall: self.wall.cast(),
            tip_correction: self.tip_correction,
        }
    }

    /// The constants that the kinematics need at run time.
    ///
    /// # Errors
    /// The dimension that cannot be right.
    pub fn build(&self) -> Result<Braid<T>, GeometryError> {
        let l0 = self.rest_length.si();
        let alpha = self.braid_angle.si();
        let d0 = self.outer_diameter.si();
        let t0 = self.wall.si();
        let (pi, right) = (T::from_f64(PI), T::from_f64(PI / 2.0));
        let two = T::ONE + T::ONE;
        let longest = T::from_f32(LONGEST_M);
        if !(l0 <= longest && l0 > T::ZERO) {
            return Err(GeometryError::RestLength);
        }
        if !(alpha > T::ZERO && alpha < right) {
            return Err(GeometryError::BraidAngle);
        }
        if !(d0 <= longest && d0 > T::ZERO) {
            return Err(GeometryError::OuterDiameter);
        }
        if !(t0 > T::ZERO && t0 + t0 < d0) {
            return Err(GeometryError::Wall);
        }
        let (sine, cosine) = sine_and_cosine(alpha);
        let fibre = l0 / sine;
        let turns = fibre * cosine / (pi * d0);
        // D0² − D_i² = 4 t0 (D0 − t0), without the difference of two squares.
        let volume_over_pi = l0 * t0 * (d0 - t0);
        let pi_n2 = pi * turns * turns;
        let four_pi_n2 = (two + two) * pi_n2;
        let tip = if self.tip_correction { T::from_f64(2.0 * (PI / 2.0 - 1.0)) } else { T::ZERO };
        let braid = Braid {
            rest_length: l0,
            inv_rest_length: T::ONE / l0,
            inv_rest_radius: two / d0,
            rest_radius: d0 / two,
            fibre_squared: fibre * fibre,
            widening: T::ONE / (pi * four_pi_n2),
            three_inv_four_pi_turns_squared: T::from_f32(3.0) / four_pi_n2,
            fibre_area: fibre * fibre / four_pi_n2,
            inv_two_pi_turns_squared: two / four_pi_n2,
            bladder_volume: pi * volume_over_pi,
            bladder_volume_over_pi: volume_over_pi,
            tip,
            tip_length: l0 + tip * (d0 / two),
            fibre,
            turns,
        };
        // A diameter that is nothing beside the length, or the length beside it, gives constants that are not finite.
        let all = [
            braid.inv_rest_length,
            braid.inv_rest_radius,
            braid.fibre_squared,
            braid.widening,
            braid.three_inv_four_pi_turns_squared,
            braid.fibre_area,
            braid.inv_two_pi_turns_squared,
            braid.turns,
        ];
        if all.iter().all(|constant| constant.is_finite() && *constant > T::ZERO) {
            Ok(braid)
        } else {
            Err(GeometryError::OuterDiameter)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::braid::miniature;

    #[test]
    fn sine_and_cosine_are_those_of_the_library() {
        for n in 1..9000_i32 {
            let angle = f64::from(n) * PI / 18_000.0;
            let (sine, cosine) = sine_and_cosine(angle);
            assert!((sine - angle.sin()).abs() < 5e-16, "sine of {angle}");
            assert!((cosine - angle.cos()).abs() < 5e-16, "cosine of {angle}");
        }
    }

    #[test]
    fn impossible_dimensions_are_named() {
        let good = miniature();
        let with = |f: &dyn Fn(&mut Geometry)| {
            let mut g = good;
            f(&mut g);
            g.build().map(|_| ())
        };
        assert_eq!(with(&|g| g.rest_length = Length::ZERO), Err(GeometryError::RestLength));
        assert_eq!(with(&|g| g.rest_length = Length::from_metres(f64::NAN)), Err(GeometryError::RestLength));
        assert_eq!(with(&|g| g.braid_angle = Angle::from_degrees(90.0)), Err(GeometryError::BraidAngle));
        assert_eq!(with(&|g| g.wall = Length::from_millimetres(1.5)), Err(GeometryError::Wall));
        assert_eq!(
            with(&|g| g.outer_diameter = Length::from_metres(-1.0)),
            Err(GeometryError::OuterDiameter)
        );
    }
}
