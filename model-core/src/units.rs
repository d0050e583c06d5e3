//! Quantities with their unit in the type: only the arithmetic that is legal compiles.
//!
//! Each is a newtype over a [`Scalar`] in its SI unit, with a constructor and a getter per unit in use. Raw numbers
//! appear only inside numerical kernels, where the SI unit is understood.

use crate::fields::{Fields, Walk};
use crate::scalar::Scalar;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use serde::{Deserialize, Serialize};

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $si:literal; $($(#[$udoc:meta])* $from:ident, $get:ident, $scale:expr;)+) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name<T = f64>(T);

        impl<T: Scalar> $name<T> {
            #[doc = concat!("Zero ", $si, ".")]
            pub const ZERO: Self = Self(T::ZERO);

            $(
                $(#[$udoc])*
                #[inline]
                pub fn $from(value: T) -> Self {
                    if $scale == 1.0 { Self(value) } else { Self(value * T::from_f64($scale)) }
                }
                $(#[$udoc])*
                #[inline]
                pub fn $get(self) -> T {
                    if $scale == 1.0 { self.0 } else { self.0 / T::from_f64($scale) }
                }
            )+

            #[doc = concat!("The number of ", $si, ".")]
            #[inline]
            pub fn si(self) -> T {
                self.0
            }
            /// The same quantity in another number type.
            #[inline]
            pub fn cast<U: Scalar>(self) -> $name<U> {
                $name(U::from_f64(self.0.to_f64()))
            }
            /// Absolute value.
            #[inline]
            pub fn abs(self) -> Self {
                Self(self.0.abs())
            }
            /// The larger of two.
            #[inline]
            pub fn max(self, other: Self) -> Self {
                Self(self.0.max(other.0))
            }
            /// The smaller of two.
            #[inline]
            pub fn min(self, other: Self) -> Self {
                Self(self.0.min(other.0))
            }
            /// Moved into `low..=high`.
            #[inline]
            pub fn clamp(self, low: Self, high: Self) -> Self {
                Self(self.0.clamp(low.0, high.0))
            }
            /// Whether the number is neither infinite nor NaN.
            #[inline]
            pub fn is_finite(self) -> bool {
                self.0.is_finite()
            }
        }

        impl<T: Fields> Fields for $name<T> {
            fn walk(&mut self, walk: &mut Walk<'_>) {
                self.0.walk(walk);
            }
        }

        impl<T: Scalar> Add for $name<T> {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }
        impl<T: Scalar> AddAssign for $name<T> {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                self.0 += other.0;
            }
        }
        impl<T: Scalar> Sub for $name<T> {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }
        impl<T: Scalar> SubAssign for $name<T> {
            #[inline]
            fn sub_assign(&mut self, other: Self) {
                self.0 -= other.0;
            }
        }
        impl<T: Scalar> Neg for $name<T> {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
        impl<T: Scalar> Mul<T> for $name<T> {
            type Output = Self;
            #[inline]
            fn mul(self, factor: T) -> Self {
                Self(self.0 * factor)
            }
        }
        impl<T: Scalar> Div<T> for $name<T> {
            type Output = Self;
            #[inline]
            fn div(self, divisor: T) -> Self {
                Self(self.0 / divisor)
            }
        }
        impl<T: Scalar> Div for $name<T> {
            type Output = T;
            #[inline]
            fn div(self, other: Self) -> T {
                self.0 / other.0
            }
        }
    };
}

quantity! {
    /// Gauge pressure, or an elastic modulus.
    Pressure, "pascals";
    /// In pascals.
    from_pascals, pascals, 1.0;
    /// In kilopascals.
    from_kilopascals, kilopascals, 1.0e3;
    /// In megapascals.
    from_megapascals, megapascals, 1.0e6;
    /// In bar.
    from_bar, bar, 1.0e5;
    /// In pounds-force per square inch.
    from_psi, psi, 6_894.757_293_168_361;
}

quantity! {
    /// Force, positive as the muscle pulls (a push-PAM pushes).
    Force, "newtons";
    /// In newtons.
    from_newtons, newtons, 1.0;
    /// In kilonewtons.
    from_kilonewtons, kilonewtons, 1.0e3;
    /// In pounds-force.
    from_pounds_force, pounds_force, 4.448_221_615_260_5;
}

quantity! {
    /// Length, or contraction stroke ΔL (positive when the muscle shortens).
    Length, "metres";
    /// In metres.
    from_metres, metres, 1.0;
    /// In millimetres.
    from_millimetres, millimetres, 1.0e-3;
    /// In inches.
    from_inches, inches, 0.0254;
}

quantity! {
    /// Contraction speed, positive while shortening.
    Speed, "metres per second";
    /// In metres per second.
    from_metres_per_second, metres_per_second, 1.0;
    /// In millimetres per second.
    from_millimetres_per_second, millimetres_per_second, 1.0e-3;
}

quantity! {
    /// A span of time.
    Time, "seconds";
    /// In seconds.
    from_seconds, seconds, 1.0;
    /// In milliseconds.
    from_milliseconds, milliseconds, 1.0e-3;
}

quantity! {
    /// Plane angle.
    Angle, "radians";
    /// In radians.
    from_radians, radians, 1.0;
    /// In degrees.
    from_degrees, degrees, 0.017_453_292_519_943_295;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_convert_by_their_definitions() {
        assert_eq!(Pressure::<f64>::from_kilopascals(2.0).pascals(), 2000.0);
        assert!((Pressure::<f64>::from_psi(29.7).kilopascals() - 204.774).abs() < 1e-3);
        assert!((Force::<f64>::from_pounds_force(508.41).newtons() - 2261.52).abs() < 0.01);
        assert_eq!(Length::<f64>::from_inches(2.0).millimetres(), 50.8);
        assert!((Angle::<f64>::from_degrees(180.0).radians() - core::f64::consts::PI).abs() < 1e-15);
    }
}
