//! A further law of the tip effect: what the slant of the fibres in the tapered ends costs.
//!
//! ```text
//! V = V_cylinder − k_s (R − R0)(πR² + g)          g = −dV_cylinder/dL = (3L² − B²)/(4πN²)
//! F_add = −P dV/dL = k_s P [(πR² + g) dR/dL + (R − R0)(2πR dR/dL + dg/dL)]
//! ```
//! Virtual work of a muscle with inextensible fibres, first order in the length of the tapers. A taper is as long as it is deep by a constant
//! factor, so that its fibres climb at a constant angle. The climb costs axial length in proportion to `R − R0`: the tapers enclose less air by
//! `πR²`, and the middle is longer by as much and encloses more by `g` less. Unlike the laws of the catalogue, which count the volume of the
//! tapers alone, this loss is largest near the rest length and falls with the pull, much like a gain of the load cell. `k_s` is dimensionless.

use std::f64::consts::PI;

use model_core::effects::{Context, FurtherLaw};

use crate::candidates::Candidate;
use crate::rows::Rows;

/// Name and unit of `k_s`.
pub(super) const PARAMETER: (&str, &str) = ("taper_slant", "");

/// Whether this law is one of the candidate's.
pub(super) fn belongs(candidate: &Candidate) -> bool {
    candidate.traits.changed.is_some_and(|c| c.further == Some(FurtherLaw::TaperSlant))
}

/// `F_add / k_s` in one moment, N.
fn force(c: &Context<f64>) -> f64 {
    let around = 4.0 * PI * c.turns * c.turns;
    let widening = -c.length / (PI * around * c.radius);
    let area_slope = 6.0 * c.length / around;
    let section = PI * c.radius * c.radius;
    let swollen = c.radius - c.rest_radius;
    let slope = (section + c.area) * widening + swollen * (2.0 * PI * c.radius * widening + area_slope);
    c.rubbed(c.corrected_pressure * slope)
}

/// The law over the rows, N per unit of `k_s`; nothing where the muscle is vented.
pub(super) fn column(rows: &Rows) -> Vec<f64> {
    let one = |(c, vented): (&Context<f64>, &bool)| if *vented { 0.0 } else { force(c) };
    rows.contexts().iter().zip(&rows.vented).map(one).map(|f| if f.is_finite() { f } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A muscle of 80 mm and 3 mm radius with fibres at 20° to the axis.
    fn at(contraction: f64) -> Context<f64> {
        let (rest, radius, angle) = (0.08, 3e-3, 20.0_f64.to_radians());
        let turns = rest * angle.tan() / (2.0 * PI * radius);
        let fibre = rest / angle.cos();
        let length = rest * (1.0 - contraction);
        let wide = (fibre * fibre - length * length).sqrt() / (2.0 * PI * turns);
        Context {
            length,
            turns,
            radius: wide,
            rest_radius: radius,
            area: (3.0 * length * length - fibre * fibre) / (4.0 * PI * turns * turns),
            corrected_pressure: 4e5,
            rest_length: rest,
            fibre_length: fibre,
            ..Context::NONE
        }
    }

    #[test]
    fn the_force_is_the_slope_of_the_lost_volume() {
        let volume = |c: &Context<f64>| (c.radius - c.rest_radius) * (PI * c.radius * c.radius + c.area);
        let h = 1e-5;
        let slope = (volume(&at(0.1 - h)) - volume(&at(0.1 + h))) / (2.0 * h * 0.08);
        let own = force(&at(0.1));
        assert!((own / (4e5 * slope) - 1.0).abs() < 1e-6, "{own}");
    }

    #[test]
    fn the_loss_is_largest_near_the_rest_length() {
        let [near, middle, far] = [0.01, 0.1, 0.2].map(|e| force(&at(e)));
        assert!(near < middle && middle < far && far < 0.0, "{near} {middle} {far}");
    }
}
