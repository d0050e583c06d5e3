//! The dimensions of a muscle that can be fitted together with the table: the unknowns, their priors, their bounds.
//!
//! | unknown | prior (one standard deviation) | bounds |
//! | --- | --- | --- |
//! | braid angle | 2° | ± 8° |
//! | bladder diameter | 5 % | ± 25 % |
//! | bladder wall | 15 % | ± 50 % |
//! | length of a mounting (a stroke held through whole recordings) | 0.5 mm | ± 1 mm |
//!
//! The diameter scales the force and the angle bends it over contraction, so blocked forces at several lengths determine
//! both. The wall only scales the elastic part, which the `E_k` scale too: it stays near its prior, and is reported as undetermined.

use model_core::braid::Geometry;
use model_core::units::{Angle, Length};
use serde::Serialize;

use super::points::HeldMounting;

/// A dimension or a mounting length that was fitted together with the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Adjusted {
    /// The name of the dimension, as in the muscle description.
    pub name: String,
    /// The unit of the values.
    pub unit: &'static str,
    /// The value in the muscle description.
    pub nominal: f64,
    /// The fitted value.
    pub value: f64,
    /// Standard deviation (1 σ) of the fitted value.
    pub std: f64,
    /// Lower bound of the search.
    pub low: f64,
    /// Upper bound of the search.
    pub high: f64,
    /// Share of the prior's variance that the recordings removed: near 1 they determine the value, near 0 they do not.
    pub determined: f64,
    /// Whether the value is at a bound.
    pub at_bound: bool,
}

/// A stroke at which whole recordings were held, with its correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounting {
    /// What the file calls the mounting; empty where it has no label.
    pub label: String,
    /// The stroke as recorded, m.
    pub stroke: f64,
    /// The correction to add to it, m.
    pub offset: f64,
}

/// A dimension that can be fitted together with the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unknown {
    Angle,
    Diameter,
    Wall,
    /// The length of a mounting, by its number.
    Offset(usize),
}

impl Unknown {
    /// Prior standard deviation and bound, in the unknown's own scale (rad, logarithm, m).
    pub(super) fn prior(self) -> (f64, f64) {
        match self {
            Self::Angle => (2.0_f64.to_radians(), 8.0_f64.to_radians()),
            Self::Diameter => (0.05, 0.25),
            Self::Wall => (0.15, 0.5),
            Self::Offset(_) => (0.5e-3, 1.0e-3),
        }
    }

    /// Step of numerical differences.
    pub(super) fn step(self) -> f64 {
        match self {
            Self::Offset(_) => 1e-6,
            _ => 1e-5,
        }
    }
}

/// The muscle at rest with its dimensions moved by `at`.
pub(super) fn moved(nominal: &Geometry, unknowns: &[Unknown], at: &[f64]) -> Geometry {
    let mut g = *nominal;
    for (u, v) in unknowns.iter().zip(at) {
        match u {
            Unknown::Angle => {
                let angle = (g.braid_angle.radians() + v).clamp(0.62, 1.55);
                g.braid_angle = Angle::from_radians(angle);
            }
            Unknown::Diameter => g.outer_diameter = g.outer_diameter * v.exp(),
            Unknown::Wall => g.wall = g.wall * v.exp(),
            Unknown::Offset(_) => {}
        }
    }
    // A wall that fills the bore cannot be built.
    let most = g.outer_diameter * 0.49;
    g.wall = g.wall.min(Length::from_metres(most.metres()));
    g
}

/// An unknown at `value` with its standard deviation, both in the unknown's own scale, in the units of a data sheet.
pub(super) fn describe(
    nominal: &Geometry,
    unknown: Unknown,
    value: f64,
    std: f64,
    mountings: &[HeldMounting],
) -> Adjusted {
    let (sigma, bound) = unknown.prior();
    let scaled = |name: &str, unit, nominal: f64| Adjusted {
        name: name.into(),
        unit,
        nominal,
        value: nominal * value.exp(),
        std: nominal * value.exp() * std,
        low: nominal * (-bound).exp(),
        high: nominal * bound.exp(),
        determined: 0.0,
        at_bound: false,
    };
    let shifted = |name: String, unit, nominal: f64, per: f64| Adjusted {
        name,
        unit,
        nominal,
        value: nominal + value * per,
        std: std * per,
        low: nominal - bound * per,
        high: nominal + bound * per,
        determined: 0.0,
        at_bound: false,
    };
    let mut a = match unknown {
        Unknown::Angle => {
            shifted("braid_angle".into(), "deg", nominal.braid_angle.degrees(), 1.0_f64.to_degrees())
        }
        Unknown::Diameter => scaled("bladder_outer_diameter", "mm", nominal.outer_diameter.millimetres()),
        Unknown::Wall => scaled("bladder_wall", "mm", nominal.wall.millimetres()),
        Unknown::Offset(m) => {
            let held = &mountings[m];
            let name = if held.label.is_empty() {
                format!("stroke_of_mounting_{}", m + 1)
            } else {
                format!("stroke_of_mounting_{} ({})", m + 1, held.label)
            };
            shifted(name, "mm", held.stroke * 1e3, 1e3)
        }
    };
    a.determined = (1.0 - (std / sigma).powi(2)).clamp(0.0, 1.0);
    a.at_bound = value.abs() > 0.999 * bound;
    a
}
