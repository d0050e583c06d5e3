//! The static model of M. Martens and I. Boblan for fluidic muscles (Actuators 6 (2017) 33, doi 10.3390/act6040033), as the comparison script
//! of another laboratory writes it.
//!
//! ```text
//! F   = −P dV/dL + σ_p h0 π L dD/dL − σ_L h0 π D        dV/dL = (B² − 3 L²) / (4 π n²)
//! D   = sqrt(B² − L²) / (n π)      B = L0 / cos θ       n = L0 tan θ / (π D0)
//! σ_p = E(L) (D − D0)/D0           σ_L = E(L) (L − L0)/L0       E(L) = c0 + c1 L + c2 L² + c3 L³
//! ```
//! `P` Pa; `L`, `D`, `h0`, m; `θ`: angle of the fibres from the axis, 28.6° and a correction; `h0`: wall, 1.8 mm. Forces below zero count as zero.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// Angle of the fibres from the axis, degrees.
const ANGLE: f64 = 28.6;
/// Wall, m.
const WALL: f64 = 1.8e-3;
/// Diameters that are tried, from the nominal inner one in steps of this share.
const STEP: f64 = 0.01;
/// How many.
const STEPS: usize = 45;

/// The model with its numbers.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    modulus: [f64; 4],
    angle: f64,
    diameter: f64,
    rest: f64,
}

impl Form {
    /// With quoted coefficients.
    pub fn quoted(modulus: [f64; 4], correction: f64, diameter: f64, rest: f64) -> Self {
        Self { modulus, angle: (ANGLE + correction).to_radians(), diameter, rest }
    }

    /// Force without the bladder, and that of the bladder per unit of its modulus, at a pressure (Pa) and a length (m).
    fn parts(&self, pressure: f64, length: f64) -> (f64, f64) {
        let fibre = self.rest / self.angle.cos();
        let turns = self.rest * self.angle.tan() / (PI * self.diameter);
        let root = (fibre * fibre - length * length).max(0.0).sqrt();
        let diameter = root / (turns * PI);
        let volume = (fibre * fibre - 3.0 * length * length) / (4.0 * PI * turns * turns);
        let slope = -length / root.max(1e-9) / (turns * PI);
        let perimeter = (diameter - self.diameter) / self.diameter * WALL * length * PI * slope;
        let axial = (length - self.rest) / self.rest * WALL * PI * diameter;
        (-pressure * volume, perimeter - axial)
    }

    /// Force, N.
    pub fn force(&self, pressure: f64, length: f64) -> f64 {
        let (pull, bladder) = self.parts(pressure, length);
        let modulus = self.modulus.iter().rev().fold(0.0, |sum, c| sum * length + c);
        (pull + modulus * bladder).max(0.0)
    }

    /// Fitted to cells (pressure, length, force): modulus by linear least squares over the cells with a force, diameter by search.
    pub fn fit(cells: &[(f64, f64, f64)], rest: f64, nominal: f64) -> Option<Self> {
        let error = |form: &Self| cells.iter().map(|c| (c.2 - form.force(c.0, c.1)).powi(2)).sum::<f64>();
        (0..STEPS)
            .filter_map(|k| Self::at_diameter(cells, rest, nominal * (1.0 + STEP * k as f64)))
            .min_by(|a, b| error(a).total_cmp(&error(b)))
    }

    fn at_diameter(cells: &[(f64, f64, f64)], rest: f64, diameter: f64) -> Option<Self> {
        let form = Self::quoted([0.0; 4], 0.0, diameter, rest);
        let pulling: Vec<_> = cells.iter().filter(|c| c.2 > 0.0).collect();
        // Lengths about their middle and in its units: powers of metres are nearly collinear.
        let scaled = |length: f64| length / rest;
        let rows = DMatrix::from_fn(pulling.len(), 4, |i, k| {
            form.parts(pulling[i].0, pulling[i].1).1 * 1e6 * scaled(pulling[i].1).powi(k as i32)
        });
        let right =
            DVector::from_fn(pulling.len(), |i, _| pulling[i].2 - form.parts(pulling[i].0, pulling[i].1).0);
        let found = rows.svd(true, true).solve(&right, 1e-9).ok()?;
        let mut modulus = [0.0; 4];
        for (k, m) in modulus.iter_mut().enumerate() {
            *m = 1e6 * found[k] / rest.powi(k as i32);
        }
        Some(Self { modulus, ..form })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_length_the_bladder_does_nothing_and_the_pressure_pulls_by_gaylord() {
        let form = Form::quoted([74.085e6, -689.2e6, 1.837e9, -848.79e6], 0.0, 10e-3, 0.25);
        // P π D0²/4 (3 cos² θ − 1)/sin² θ
        let theta = ANGLE.to_radians();
        let expected = 6e5 * PI * 1e-4 / 4.0 * (3.0 * theta.cos().powi(2) - 1.0) / theta.sin().powi(2);
        assert!((form.force(6e5, 0.25) / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_map_of_the_form_gives_its_numbers_back() {
        let truth = Form { modulus: [9e6, -3e7, 0.0, 0.0], ..Form::quoted([0.0; 4], 0.0, 11e-3, 0.25) };
        let cells: Vec<(f64, f64, f64)> = (1..14)
            .flat_map(|p| [0.25, 0.24, 0.23, 0.22, 0.21, 0.2].map(|l| (5e4 * f64::from(p), l)))
            .map(|(p, l)| (p, l, truth.force(p, l)))
            .collect();
        let found = Form::fit(&cells, 0.25, 10e-3).expect("a fit");
        assert!((found.diameter - 11e-3).abs() < 0.06e-3, "{found:?}");
        let worst = cells.iter().map(|c| (c.2 - found.force(c.0, c.1)).abs()).fold(0.0, f64::max);
        assert!(worst < 1.5, "{worst}");
    }
}
