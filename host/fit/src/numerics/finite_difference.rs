//! Derivatives of functions that have no convenient closed form.

/// The derivative of `f` at `x` by central differences: `(f(x + h) − f(x − h)) / 2h`.
///
/// The error is `h² f‴/6` of the method plus about `ε |f| / h` of rounding, with `ε` = 2.2·10⁻¹⁶. A step `h` of 10⁻⁵ of the scale
/// over which `f` bends keeps nine to ten digits.
///
/// ```
/// use pam_fit::numerics::finite_difference::central;
/// assert!((central(f64::sin, 1.0, 1e-5) - 1.0_f64.cos()).abs() < 1e-10);
/// ```
#[must_use]
pub fn central(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    (f(x + h) - f(x - h)) / (2.0 * h)
}

/// [`central`] for a function with several values.
#[must_use]
pub fn central_each<const N: usize>(f: impl Fn(f64) -> [f64; N], x: f64, h: f64) -> [f64; N] {
    let (after, before) = (f(x + h), f(x - h));
    std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * h))
}
