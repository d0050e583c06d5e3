//! A number in three bytes: single precision without its last eight bits.

/// Sign, eight bits of exponent, fifteen of mantissa: off by at most 2⁻¹⁶ of the value, a tenth of what a converter of twelve bits
/// resolves at full scale; whole numbers up to 65,536 are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompactFloat([u8; 3]);

impl CompactFloat {
    /// The nearest.
    pub fn of(value: f32) -> Self {
        // What is not a number stays none: rounding could carry it into the sign.
        let nearest = if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() + 0x80 };
        let [_, low, middle, high] = nearest.to_le_bytes();
        Self([low, middle, high])
    }

    /// As a number.
    pub fn value(self) -> f32 {
        let [low, middle, high] = self.0;
        f32::from_le_bytes([0, low, middle, high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn whole_numbers_and_the_ends_are_exact() {
        for n in 0..=65_536_u32 {
            assert_eq!(CompactFloat::of(n as f32).value(), n as f32);
        }
        for value in [0.0, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE] {
            assert_eq!(CompactFloat::of(value).value(), value);
        }
        assert!(CompactFloat::of(f32::NAN).value().is_nan() && CompactFloat::of(-f32::NAN).value().is_nan());
        assert_eq!(size_of::<[CompactFloat; 10]>(), 30);
    }

    proptest! {
        #[test]
        fn nothing_is_off_by_more_than_it_says(value in -1e30_f32..1e30) {
            let off = (CompactFloat::of(value).value() - value).abs();
            prop_assert!(off <= value.abs() / 65_536.0 + f32::MIN_POSITIVE);
        }
    }
}
