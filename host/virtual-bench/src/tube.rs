//! The bladder: a thick-walled incompressible tube, and the braid that gives its radius.
//!
//! A tube of rest length L0, outer radius R_b and inner radius R_b − t is stretched to length L and held at outer radius R.
//! Incompressibility places the ring that rested at ρ0 at `ρ² = R² − (R_b² − ρ0²)/λ_z` with `λ_z = L/L0`, so its stretches are
//! `λ_θ = ρ/ρ0`, `λ_z`, `λ_r = 1/(λ_θ λ_z)`, and the stored energy is
//!
//! `U(L, R) = L0 ∫ 2π ρ0 w(λ_r, λ_θ, λ_z) dρ0`,
//!
//! integrated by Gauss–Legendre. The braid of inextensible fibres (length B, turns N) gives
//! `R(L) = sqrt(B² − L²)/(2π N)` at its inside, which the bladder touches once it has crossed the gap R0 − R_b.

use crate::material::{Hyperelastic, invariants};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Nodes and weights of six-point Gauss–Legendre on 0..1.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// What a ruler and a protractor say about a muscle at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Active length L0, m.
    pub rest_length: f64,
    /// Braid angle α0 from the radial plane, rad.
    pub braid_angle: f64,
    /// Braid's inside radius at rest R0 (the nominal bladder outer radius), m.
    pub radius: f64,
    /// Bladder wall at rest t0, m.
    pub wall: f64,
}

impl Geometry {
    /// From millimetres and degrees, diameter instead of radius.
    pub(crate) fn from_mm_deg(length_mm: f64, angle_deg: f64, diameter_mm: f64, wall_mm: f64) -> Self {
        Self {
            rest_length: length_mm * 1e-3,
            braid_angle: angle_deg.to_radians(),
            radius: diameter_mm * 0.5e-3,
            wall: wall_mm * 1e-3,
        }
    }

    /// Length of one fibre B, m.
    pub fn fibre(&self) -> f64 {
        self.rest_length / self.braid_angle.sin()
    }

    /// Turns of a fibre N.
    pub fn turns(&self) -> f64 {
        self.fibre() * self.braid_angle.cos() / (2.0 * PI * self.radius)
    }

    /// Braid radius at active length `l`, m; zero when the fibres are straight.
    pub fn braid_radius(&self, l: f64) -> f64 {
        let b = self.fibre();
        (b * b - l * l).max(0.0).sqrt() / (2.0 * PI * self.turns())
    }

    /// Length at which the braid has radius `r` (m).
    pub(crate) fn length_at(&self, r: f64) -> f64 {
        let (b, around) = (self.fibre(), 2.0 * PI * self.turns() * r);
        (b * b - around * around).max(0.0).sqrt()
    }

    /// Its derivative by length.
    pub(crate) fn braid_radius_slope(&self, l: f64) -> f64 {
        let b = self.fibre();
        -l / ((b * b - l * l).max(1e-18).sqrt() * 2.0 * PI * self.turns())
    }

    /// `−d(π R² L)/dL`, the area on which a pressure pulls, m².
    pub fn pulling_area(&self, l: f64) -> f64 {
        let (b, n) = (self.fibre(), self.turns());
        (3.0 * l * l - b * b) / (4.0 * PI * n * n)
    }
}

/// The bladder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tube {
    /// Rest length, m.
    pub rest_length: f64,
    /// Outer radius at rest R_b, m.
    pub outer: f64,
    /// Wall at rest, m.
    pub wall: f64,
    /// What it is made of.
    pub material: Hyperelastic,
}

/// Stored energy and its slopes by length (radius held) and by radius (length held).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stored {
    /// U, J.
    pub energy: f64,
    /// ∂U/∂L, N.
    pub by_length: f64,
    /// ∂U/∂R, N.
    pub by_radius: f64,
    /// Mean of I1 − 3 over the wall.
    pub stretch: f64,
}

impl Tube {
    /// Material volume, m³.
    pub fn volume(&self) -> f64 {
        let inner = self.outer - self.wall;
        PI * (self.outer * self.outer - inner * inner) * self.rest_length
    }

    /// Stored energy at length `l` and outer radius `r`, both in m.
    pub fn stored(&self, l: f64, r: f64) -> Stored {
        let lz = l / self.rest_length;
        let mut s = Stored::default();
        let mut weights = 0.0;
        for (node, weight) in GAUSS {
            let rho0 = self.outer - self.wall * node;
            let shell = (self.outer * self.outer - rho0 * rho0) / lz;
            let rho = (r * r - shell).max(1e-4 * rho0 * rho0).sqrt();
            let (lt, volume) = (rho / rho0, 2.0 * PI * rho0 * self.wall * weight * self.rest_length);
            let lr = 1.0 / (lt * lz);
            let stretches = [lr, lt, lz];
            let g = self.material.gradient(stretches);
            // With λ_r = 1/(λ_θ λ_z), the slopes along the two free stretches.
            let hoop = g[1] - g[0] * lr / lt;
            let axial = g[2] - g[0] * lr / lz;
            s.energy += volume * self.material.energy(stretches);
            s.by_radius += volume * hoop * r / (rho * rho0);
            s.by_length += volume * (hoop * shell / (2.0 * rho * rho0 * lz) + axial) / self.rest_length;
            s.stretch += rho0 * weight * (invariants(stretches).0 - 3.0);
            weights += rho0 * weight;
        }
        s.stretch /= weights;
        s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tube() -> Tube {
        Tube { rest_length: 0.128, outer: 7.9e-3, wall: 1.6e-3, material: Hyperelastic::TRELOAR }
    }

    #[test]
    fn slopes_of_the_stored_energy_match_differences() {
        let t = tube();
        for (l, r) in [(0.126, 8.5e-3), (0.11, 12e-3), (0.1, 17e-3)] {
            let s = t.stored(l, r);
            let h = 1e-7;
            let by_l = (t.stored(l + h, r).energy - t.stored(l - h, r).energy) / (2.0 * h);
            let by_r = (t.stored(l, r + h).energy - t.stored(l, r - h).energy) / (2.0 * h);
            assert!((by_l - s.by_length).abs() < 1e-5 * s.by_length.abs().max(1.0), "{by_l} {}", s.by_length);
            assert!((by_r - s.by_radius).abs() < 1e-5 * s.by_radius.abs().max(1.0), "{by_r} {}", s.by_radius);
        }
    }

    #[test]
    fn at_rest_nothing_is_stored_and_nothing_pulls() {
        let t = tube();
        let s = t.stored(t.rest_length, t.outer);
        assert!(s.energy.abs() < 1e-12 && s.by_length.abs() < 1e-9 && s.by_radius.abs() < 1e-6, "{s:?}");
    }

    #[test]
    fn a_thin_balloon_obeys_laplace() {
        // A thin neo-Hookean tube at fixed length: P = (2 C t0 / R0) (1 − λ⁻⁴).
        let c10 = 0.2e6;
        let material = Hyperelastic::MooneyRivlin { c10, c01: 0.0 };
        let t = Tube { rest_length: 0.1, outer: 0.01, wall: 1e-5, material };
        let l = 1.5f64;
        let r = l * t.outer;
        let pressure = t.stored(0.1, r).by_radius / (2.0 * PI * r * 0.1);
        let laplace = 2.0 * c10 * t.wall / t.outer * (1.0 - l.powi(-4));
        assert!((pressure / laplace - 1.0).abs() < 5e-3, "{pressure} {laplace}");
    }
}
