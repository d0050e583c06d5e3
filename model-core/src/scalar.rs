//! The number type of the model: `f32` on the controller, `f64` on the host, the same source for both.
//!
//! Only operations that IEEE 754 defines exactly (`+ − × ÷ √`) and software routines of [`libm`] are used, never a
//! fused multiply-add, so that an `f32` evaluation gives the same bits on every machine.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number that the model can be evaluated in.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Send
    + Sync
    + 'static
{
    /// The number 0.
    const ZERO: Self;
    /// The number 1.
    const ONE: Self;
    /// The distance from 1 to the next number.
    const EPSILON: Self;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// The nearest number of this type.
    fn from_f32(value: f32) -> Self;
    /// The value as `f64`.
    fn to_f64(self) -> f64;
    /// Square root, correctly rounded (one `vsqrt.f32` on a Cortex-M4F); NaN below zero.
    fn sqrt(self) -> Self;
    /// e to this power.
    fn exp(self) -> Self;
    /// e to this power, less one; keeps its digits near zero.
    fn exp_m1(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Natural logarithm of one more than this; keeps its digits near zero.
    fn ln_1p(self) -> Self;
    /// Whether this is neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// Absolute value.
    fn abs(self) -> Self;

    // `clamp`, `max` and `min` of `f32` are calls in an image that is built for size, and the core has no instruction for them:
    // the next three are a comparison each, which a tick can afford.

    /// This, or `bound` where it is less or NaN: one comparison, for bounds that are numbers.
    #[inline(always)]
    fn at_least(self, bound: Self) -> Self {
        if self > bound { self } else { bound }
    }
    /// This, or `bound` where it is more or NaN: one comparison, for bounds that are numbers.
    #[inline(always)]
    fn at_most(self, bound: Self) -> Self {
        if self < bound { self } else { bound }
    }
    /// This, or the bound that it is beyond; NaN stays so. For bounds that are numbers.
    #[inline(always)]
    fn within(self, low: Self, high: Self) -> Self {
        if self < low {
            low
        } else if self > high {
            high
        } else {
            self
        }
    }
    /// The larger of two; the other one where one is NaN.
    #[inline]
    fn max(self, other: Self) -> Self {
        if self > other || other != other { self } else { other }
    }
    /// The smaller of two; the other one where one is NaN.
    #[inline]
    fn min(self, other: Self) -> Self {
        if self < other || other != other { self } else { other }
    }
    /// This, moved into `low..=high`.
    #[inline]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// −1, 0 or +1.
    #[inline]
    fn sign(self) -> Self {
        if self > Self::ZERO {
            Self::ONE
        } else if self < Self::ZERO {
            -Self::ONE
        } else {
            Self::ZERO
        }
    }
}

macro_rules! scalar {
    ($t:ident, $sqrt:expr, $exp:ident, $expm1:ident, $ln:ident, $ln1p:ident) => {
        impl Scalar for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $t::EPSILON;
            #[inline]
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            #[inline]
            fn from_f32(value: f32) -> Self {
                value as $t
            }
            #[inline]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            fn exp_m1(self) -> Self {
                libm::$expm1(self)
            }
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            fn ln_1p(self) -> Self {
                libm::$ln1p(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                $t::is_finite(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $t::abs(self)
            }
        }
    };
}

scalar!(f32, sqrt_f32, expf, expm1f, logf, log1pf);
scalar!(f64, libm::sqrt, exp, expm1, log, log1p);

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
core::arch::global_asm!(
    ".syntax unified",
    ".fpu fpv4-sp-d16",
    ".section .text.sqrtf,\"ax\",%progbits",
    ".global sqrtf",
    ".type sqrtf,%function",
    ".thumb_func",
    "sqrtf:",
    "vsqrt.f32 s0, s0",
    "bx lr",
    ".size sqrtf, . - sqrtf",
    ".text",
);

/// The square root of the floating-point unit. Stable Rust has no name for that instruction without `std`, and refuses
/// single-precision registers in inline assembly on this target; a two-instruction function is the way left. Under the C
/// library's name the compiler knows it, and puts the instruction in its place wherever the argument is not negative.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
fn sqrt_f32(value: f32) -> f32 {
    unsafe extern "C" {
        fn sqrtf(value: f32) -> f32;
    }
    // SAFETY: the function above reads and writes one floating-point register, by the hard-float calling convention.
    unsafe { sqrtf(value) }
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
#[inline]
fn sqrt_f32(value: f32) -> f32 {
    libm::sqrtf(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_and_the_larger_ignore_a_nan() {
        assert_eq!(Scalar::max(f32::NAN, 2.0), 2.0);
        assert_eq!(Scalar::max(2.0, f32::NAN), 2.0);
        assert_eq!(Scalar::min(f32::NAN, 2.0), 2.0);
        assert_eq!(Scalar::min(2.0, f32::NAN), 2.0);
        assert_eq!(Scalar::clamp(5.0_f64, 0.0, 1.0), 1.0);
    }

    #[test]
    fn they_bound_and_treat_what_is_no_number_as_they_say() {
        for (value, low, high) in
            [(-2.0_f32, -1.0, 1.0), (0.5, -1.0, 1.0), (3.0, -1.0, 1.0), (-0.0, 0.0, 0.0)]
        {
            assert_eq!(value.within(low, high), f32::clamp(value, low, high));
            assert_eq!(value.at_least(low), f32::max(value, low));
            assert_eq!(value.at_most(high), f32::min(value, high));
        }
        assert!(f32::NAN.within(0.0, 1.0).is_nan());
        assert_eq!((f32::NAN.at_least(2.0), f32::NAN.at_most(2.0)), (2.0, 2.0));
    }

    #[test]
    fn square_roots_agree_with_the_standard_library_to_the_bit() {
        for i in 0..10_000_u32 {
            let x = f32::from_bits(0x3000_0000 + i * 40_009);
            assert_eq!(Scalar::sqrt(x).to_bits(), x.sqrt().to_bits());
        }
    }
}
