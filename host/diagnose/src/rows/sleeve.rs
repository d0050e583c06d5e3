//! The sleeve at a row's length.

use model_core::braid::Braid;
use model_core::units::Length;

pub(crate) use crate::criteria::baseline::{ORDERS, YEOH};

/// What a force of the model is made of at a row's length, and how it changes with the stroke.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shape {
    /// `g = ∂F_G/∂P`, m².
    pub area: f64,
    /// `∂g/∂(ΔL)`, m.
    pub area_slope: f64,
    /// `c_k`, m².
    pub elastic: [f64; ORDERS],
    /// `∂c_k/∂(ΔL)`, m.
    pub elastic_slope: [f64; ORDERS],
    /// The same of a Yeoh wall at its middle surface, m².
    pub yeoh: [f64; YEOH],
    /// `∂/∂(ΔL)` of these, m.
    pub yeoh_slope: [f64; YEOH],
}

/// The sleeve at one stroke.
pub(super) fn shape(braid: &Braid<f64>, stroke: f64) -> Shape {
    let h = braid.rest_length() * 1e-4;
    let at = |x: f64| {
        let p = braid.posture(Length::from_metres(x));
        (p.area, p.elastic_columns::<ORDERS>(), yeoh(braid, x))
    };
    let (area, elastic, yeoh_here) = at(stroke);
    let (a0, e0, y0) = at(stroke - h);
    let (a1, e1, y1) = at(stroke + h);
    Shape {
        area,
        area_slope: (a1 - a0) / (2.0 * h),
        elastic,
        elastic_slope: std::array::from_fn(|k| (e1[k] - e0[k]) / (2.0 * h)),
        yeoh: yeoh_here,
        yeoh_slope: std::array::from_fn(|k| (y1[k] - y0[k]) / (2.0 * h)),
    }
}

/// Force per coefficient of a Yeoh wall, `−V_B d/dL (I1 − 3)^i`, with the stretches at the middle of the wall
/// (O. H. Yeoh, Rubber Chemistry and Technology 66 (1993) 754–771).
fn yeoh(braid: &Braid<f64>, stroke: f64) -> [f64; YEOH] {
    let invariant = |x: f64| {
        let p = braid.posture(Length::from_metres(x));
        let rest = braid.posture(Length::from_metres(0.0));
        let axial = (p.length / rest.length).max(1e-3);
        let hoop = ((p.radius - p.wall / 2.0) / (rest.radius - rest.wall / 2.0)).max(1e-3);
        axial * axial + hoop * hoop + 1.0 / (axial * axial * hoop * hoop) - 3.0
    };
    let h = braid.rest_length() * 1e-4;
    let i = invariant(stroke);
    // d/dL = −d/d(ΔL).
    let slope = -(invariant(stroke + h) - invariant(stroke - h)) / (2.0 * h);
    std::array::from_fn(|k| -braid.bladder_volume() * (k as f64 + 1.0) * i.max(0.0).powi(k as i32) * slope)
}
