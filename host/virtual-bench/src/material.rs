//! Strain energy of incompressible rubber in principal stretches.
//!
//! - Mooney–Rivlin: `w = C10 (I1 − 3) + C01 (I2 − 3)` (R. S. Rivlin, doi 10.1098/rsta.1948.0024)
//! - Yeoh: `w = Σ_{i=1..3} C_i0 (I1 − 3)^i` (O. H. Yeoh, doi 10.5254/1.3538343)
//! - Ogden: `w = Σ_p μ_p/α_p (λ1^α_p + λ2^α_p + λ3^α_p − 3)` (R. W. Ogden, doi 10.1098/rspa.1972.0026)
//!
//! `I1 = Σ λ_i²`, `I2 = Σ_{i<j} λ_i² λ_j²`. The stretches come with `λ1 λ2 λ3 = 1` from the kinematics, so the gradient is taken
//! of the expression as it stands and the pressure of incompressibility never appears.

use serde::{Deserialize, Serialize};

/// A rubber's strain energy law; constants in Pa.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum Hyperelastic {
    /// Two constants, linear in I1 and I2.
    MooneyRivlin {
        /// Coefficient of I1 − 3, Pa.
        c10: f64,
        /// Coefficient of I2 − 3, Pa.
        c01: f64,
    },
    /// Cubic in I1 − 3.
    Yeoh {
        /// Coefficient of (I1 − 3), Pa.
        c10: f64,
        /// Coefficient of (I1 − 3)², Pa.
        c20: f64,
        /// Coefficient of (I1 − 3)³, Pa.
        c30: f64,
    },
    /// Sum of three powers of the stretches.
    Ogden {
        /// Moduli μ_p, Pa.
        mu: [f64; 3],
        /// Exponents α_p.
        alpha: [f64; 3],
    },
}

impl Hyperelastic {
    /// Treloar's vulcanised natural rubber in Ogden's constants (1972).
    pub(crate) const TRELOAR: Self = Self::Ogden { mu: [0.618e6, 1.18e3, -9.81e3], alpha: [1.3, 5.0, -2.0] };

    /// Energy density, J/m³, at principal stretches `l`.
    pub fn energy(&self, l: [f64; 3]) -> f64 {
        match *self {
            Self::MooneyRivlin { c10, c01 } => {
                let (i1, i2) = invariants(l);
                c10 * (i1 - 3.0) + c01 * (i2 - 3.0)
            }
            Self::Yeoh { c10, c20, c30 } => {
                let j = invariants(l).0 - 3.0;
                j * (c10 + j * (c20 + j * c30))
            }
            Self::Ogden { mu, alpha } => {
                let power = |a: f64| l.iter().map(|x| x.powf(a)).sum::<f64>() - 3.0;
                mu.iter().zip(alpha).map(|(m, a)| m / a * power(a)).sum()
            }
        }
    }

    /// Derivative of the energy density by each stretch, Pa.
    pub fn gradient(&self, l: [f64; 3]) -> [f64; 3] {
        match *self {
            Self::MooneyRivlin { c10, c01 } => {
                let i1 = invariants(l).0;
                l.map(|x| 2.0 * x * (c10 + c01 * (i1 - x * x)))
            }
            Self::Yeoh { c10, c20, c30 } => {
                let j = invariants(l).0 - 3.0;
                let slope = c10 + j * (2.0 * c20 + j * 3.0 * c30);
                l.map(|x| 2.0 * x * slope)
            }
            Self::Ogden { mu, alpha } => {
                l.map(|x| mu.iter().zip(alpha).map(|(m, a)| m * x.powf(a - 1.0)).sum())
            }
        }
    }

    /// Young's modulus at small strain, Pa.
    pub(crate) fn young(&self) -> f64 {
        match *self {
            Self::MooneyRivlin { c10, c01 } => 6.0 * (c10 + c01),
            Self::Yeoh { c10, .. } => 6.0 * c10,
            Self::Ogden { mu, alpha } => 1.5 * mu.iter().zip(alpha).map(|(m, a)| m * a).sum::<f64>(),
        }
    }

    /// The same law, `factor` times as stiff.
    pub fn scaled(&self, factor: f64) -> Self {
        match *self {
            Self::MooneyRivlin { c10, c01 } => Self::MooneyRivlin { c10: c10 * factor, c01: c01 * factor },
            Self::Yeoh { c10, c20, c30 } => {
                Self::Yeoh { c10: c10 * factor, c20: c20 * factor, c30: c30 * factor }
            }
            Self::Ogden { mu, alpha } => Self::Ogden { mu: mu.map(|m| m * factor), alpha },
        }
    }
}

/// I1 and I2 of principal stretches.
pub(crate) fn invariants(l: [f64; 3]) -> (f64, f64) {
    let s = l.map(|x| x * x);
    (s[0] + s[1] + s[2], s[0] * s[1] + s[1] * s[2] + s[2] * s[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [Hyperelastic; 3] = [
        Hyperelastic::MooneyRivlin { c10: 0.3e6, c01: 0.05e6 },
        Hyperelastic::Yeoh { c10: 0.35e6, c20: -0.02e6, c30: 0.01e6 },
        Hyperelastic::TRELOAR,
    ];

    #[test]
    fn the_gradient_is_that_of_the_energy() {
        for law in LAWS {
            let l = [1.7, 0.8, 0.75];
            for i in 0..3 {
                let h = 1e-5;
                let (mut up, mut down) = (l, l);
                up[i] += h;
                down[i] -= h;
                let numeric = (law.energy(up) - law.energy(down)) / (2.0 * h);
                let analytic = law.gradient(l)[i];
                assert!((numeric - analytic).abs() < 1e-6 * analytic.abs().max(1e5), "{law:?} {i}");
            }
        }
    }

    #[test]
    fn a_bar_pulled_a_little_shows_youngs_modulus() {
        for law in LAWS {
            let e = 1e-4f64;
            let side = (1.0 + e).powf(-0.5);
            let w = law.energy([1.0 + e, side, side]);
            assert!((2.0 * w / (e * e) / law.young() - 1.0).abs() < 1e-3, "{law:?}");
            assert!(law.energy([1.0; 3]).abs() < 1e-9);
        }
    }
}
