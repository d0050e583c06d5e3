//! The table of one muscle: what a fit finds, a file keeps and a controller is sent.
//!
//! It holds values at pressures (nodes), not run-time coefficients; [`crate::muscle::Muscle::build`] turns it into the form that is evaluated.
//! Every number is an `f32`, so host and controller start from the same bits.

use crate::braid::{self, Braid, Geometry, GeometryError};
use crate::effects::{FittedEffect, MAX_EFFECTS};
use crate::fields::{codes, fields};
use crate::spline::{self, MAX_NODES};
use crate::units::{Force, Length, Pressure};
use serde::{Deserialize, Serialize};

/// The largest order `M` of the elastic polynomial.
pub const MAX_ORDER: usize = 6;

codes! {
    /// Whether the muscle pulls, or its motion is reversed by a push-rod.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Kind {
        /// It shortens and pulls.
        Contractile,
        /// It extends a rod and pushes; stroke and force count positive outward.
        Push,
    }
}

/// The range that the recordings behind a table covered. Beyond it the table is an extrapolation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tested {
    /// Lowest pressure.
    pub pressure_low: Pressure<f32>,
    /// Highest pressure.
    pub pressure_high: Pressure<f32>,
    /// Smallest contraction `ΔL/L0`.
    pub contraction_low: f32,
    /// Largest contraction `ΔL/L0`.
    pub contraction_high: f32,
}

/// A muscle's geometry, deadband, `E_k(P)`, `k_F(P)` and left-out effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MuscleTable {
    /// Pulling or pushing.
    pub kind: Kind,
    /// The muscle at rest.
    pub geometry: Geometry<f32>,
    /// `P0`: the pressure at which contraction begins.
    pub deadband: Pressure<f32>,
    /// Whether the force stops at zero (a muscle that goes slack does not push).
    pub goes_slack: bool,
    /// The pressures that the curves are given at, increasing, Pa.
    pub nodes: heapless::Vec<f32, MAX_NODES>,
    /// `E_1…E_M` at the nodes, Pa; one curve after another.
    pub elastic: heapless::Vec<heapless::Vec<f32, MAX_NODES>, MAX_ORDER>,
    /// `k_F` at the nodes.
    pub friction: heapless::Vec<f32, MAX_NODES>,
    /// What the recordings covered.
    pub tested: Tested,
    /// The highest pressure that may be commanded.
    pub max_pressure: Pressure<f32>,
    /// Force at rest length and the highest tested pressure: the scale of this muscle's forces.
    pub blocked_force: Force<f32>,
    /// Physics beyond the base model.
    pub effects: heapless::Vec<FittedEffect, MAX_EFFECTS>,
}
fields!(Tested { pressure_low, pressure_high, contraction_low, contraction_high });
fields!(MuscleTable {
    kind,
    geometry,
    deadband,
    goes_slack,
    nodes,
    elastic,
    friction,
    tested,
    max_pressure,
    blocked_force,
    effects,
});

/// Why a table cannot be used. Every variant names the number at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TableError {
    /// A dimension of the muscle.
    Geometry(GeometryError),
    /// The deadband is not a finite pressure between −100 kPa and 1 MPa.
    Deadband,
    /// No nodes.
    NoNodes,
    /// This node is not finite, or not above the one before by 0.5 % of the range of all.
    Node(u8),
    /// No elastic curve.
    NoOrder,
    /// Curve `k` (from 1) has not one finite value per node, below 10 TPa in size.
    Elastic(u8),
    /// The friction curve has not one value per node, each between −0.5 and 0.95, or leaves these limits between two nodes.
    Friction,
    /// The tested range is not finite, is turned round, or has a contraction at which the sleeve has no shape.
    Tested,
    /// The greatest pressure is not positive, or above 1 GPa.
    MaxPressure,
    /// The blocked force is not a finite number.
    BlockedForce,
    /// The effect at this position has the wrong number of parameters, or a parameter or memory that is not finite.
    Effect(u8),
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Geometry(e) => write!(f, "{e}"),
            Self::Deadband => f.write_str("the deadband P0 is not a pressure between −100 kPa and 1 MPa"),
            Self::NoNodes => f.write_str("the table has no pressure node"),
            Self::Node(i) => write!(f, "pressure node {} is not finite, or not above the one before by 0.5 % of their range", i + 1),
            Self::NoOrder => f.write_str("the table has no elastic coefficient"),
            Self::Elastic(k) => write!(f, "E_{k} does not have one finite value per pressure node"),
            Self::Friction => {
                f.write_str("k_F does not have one value between −0.5 and 0.95 per pressure node, or leaves these limits between two nodes")
            }
            Self::Tested => f.write_str("the tested range is not finite, is turned round, or has a contraction that the muscle cannot have"),
            Self::MaxPressure => f.write_str("the greatest pressure is not positive, or above 1 GPa"),
            Self::BlockedForce => f.write_str("the blocked force is not a finite number"),
            Self::Effect(i) => {
                write!(f, "effect {} has a wrong number of parameters or one that is not finite", i + 1)
            }
        }
    }
}

impl core::error::Error for TableError {}

impl MuscleTable {
    /// Nothing in it yet; it does not pass [`MuscleTable::check`].
    #[inline(always)]
    pub fn empty() -> Self {
        Self {
            kind: Kind::Contractile,
            geometry: Geometry::default(),
            deadband: Pressure::ZERO,
            goes_slack: false,
            nodes: heapless::Vec::new(),
            elastic: heapless::Vec::new(),
            friction: heapless::Vec::new(),
            tested: Tested::default(),
            max_pressure: Pressure::ZERO,
            blocked_force: Force::ZERO,
            effects: heapless::Vec::new(),
        }
    }

    /// `M`, the order of the elastic polynomial.
    pub fn order(&self) -> usize {
        self.elastic.len()
    }

    /// Looks at every number. Nothing that passes can make the model's evaluation fail.
    ///
    /// # Errors
    /// The first number at fault.
    #[inline]
    pub fn check(&self) -> Result<(), TableError> {
        let braid = self.geometry.build().map_err(TableError::Geometry)?;
        let deadband = self.deadband.pascals();
        if !(-1.0e5..=1.0e6).contains(&deadband) {
            return Err(TableError::Deadband);
        }
        if self.nodes.is_empty() {
            return Err(TableError::NoNodes);
        }
        // Written so that a number that is none is in no range.
        let wrong = |gap: f32| {
            let apart = |i: usize| i == 0 || self.nodes[i] - self.nodes[i - 1] >= gap;
            (0..self.nodes.len()).find(|i| !(self.nodes[*i].abs() <= HIGHEST && apart(*i)))
        };
        let span = self.nodes[self.nodes.len() - 1] - self.nodes[0];
        if let Some(i) = wrong(f32::MIN_POSITIVE).or_else(|| wrong(CLOSEST * span)) {
            return Err(TableError::Node(i as u8));
        }
        if self.elastic.is_empty() {
            return Err(TableError::NoOrder);
        }
        let count = self.nodes.len();
        for (k, curve) in self.elastic.iter().enumerate() {
            if !is_curve(curve, count, -STIFFEST, STIFFEST) {
                return Err(TableError::Elastic(k as u8 + 1));
            }
        }
        let (least, most) = FRICTION_LIMITS;
        let within = is_curve(&self.friction, count, least, most);
        if !within || !stays(&self.nodes, &self.friction, FRICTION_LIMITS) {
            return Err(TableError::Friction);
        }
        let t = &self.tested;
        let (low, high) = (t.pressure_low.pascals(), t.pressure_high.pascals());
        if !all_finite(&[low, high, t.contraction_low, t.contraction_high])
            || low > high
            || t.contraction_low > t.contraction_high
            || !([0.0, t.contraction_low, t.contraction_high].iter().all(|c| evaluates(&braid, *c)))
        {
            return Err(TableError::Tested);
        }
        let max_pressure = self.max_pressure.pascals();
        if !(max_pressure > 0.0 && max_pressure <= HIGHEST) {
            return Err(TableError::MaxPressure);
        }
        if !self.blocked_force.is_finite() {
            return Err(TableError::BlockedForce);
        }
        for (i, e) in self.effects.iter().enumerate() {
            if e.parameters.len() != e.effect.parameter_count()
                || !all_finite(&e.parameters)
                || !all_finite(&e.remembered)
            {
                return Err(TableError::Effect(i as u8));
            }
        }
        Ok(())
    }
}

/// The largest elastic coefficient that is taken for one, Pa.
const STIFFEST: f32 = 1.0e13_f32.next_down();

/// Limits of `k_F`, at the nodes of a table and between them.
pub const FRICTION_LIMITS: (f32, f32) = (-0.5, 0.95);

/// Highest pressure that any number of a table may be, Pa: a thousand times what a muscle bears.
const HIGHEST: f32 = 1.0e9;

/// Least distance of nodes, as a part of their range. Between two that are closer, the noise of a fit is a slope that carries the curve far
/// beyond its values on both sides: 1 kPa apart in 345 kPa, a `k_F` of 0.14 and 0.12 goes down to −0.33. Levels of a fit are 1 % apart.
const CLOSEST: f32 = 5.0e-3;

/// Largest area, m², and strain at a contraction of the tested range: a thousand times and a hundred times those of any muscle. With them, with
/// [`STIFFEST`] and [`HIGHEST`] every term of the force is below 10³², which leaves room for curves that go beyond their values.
const WIDEST: f32 = 1.0e6;
const MOST_STRAINED: f32 = 100.0;

/// Whether the sleeve at a contraction has a shape, and with it forces that are numbers: for a contraction of the tested range.
#[inline(never)]
fn evaluates(braid: &Braid<f32>, contraction: f32) -> bool {
    let posture = braid.posture(Length::from_metres(contraction * braid.rest_length()));
    let areas = [posture.area, posture.axial_area, posture.hoop_area];
    let strains = [posture.axial_strain, posture.radial_strain];
    contraction >= -1.0
        && posture.length > 0.0
        && posture.load_length > 0.0
        && areas.iter().all(|area| area.abs() <= WIDEST)
        && strains.iter().all(|strain| strain.abs() <= MOST_STRAINED)
}

/// Whether a curve stays between two limits from each node to the next, where its values at the nodes do.
#[inline(never)]
fn stays(nodes: &[f32], values: &[f32], (low, high): (f32, f32)) -> bool {
    let mut stays = true;
    spline::natural_cubic(nodes, values, &mut |n, cubic| {
        let end = nodes[n + 1] - nodes[n];
        for turn in spline::turns(&cubic) {
            if turn > 0.0 && turn < end {
                let value = spline::value(&cubic, turn);
                stays &= value >= low && value <= high;
            }
        }
    });
    stays
}

fn all_finite(values: &[f32]) -> bool {
    is_curve(values, values.len(), f32::MIN, f32::MAX)
}

/// Whether there are n values, all between two limits.
#[inline]
fn is_curve(values: &[f32], count: usize, low: f32, high: f32) -> bool {
    values.len() == count && values.iter().all(|value| *value >= low && *value <= high)
}

/// A table in the manner of the thesis's miniature muscle, for examples and tests: six pressures, `M = 4`.
pub fn example() -> MuscleTable {
    let nodes = [207.0e3_f32, 276.0e3, 345.0e3, 414.0e3, 483.0e3, 552.0e3];
    let curve = |at_low: f32, at_high: f32| {
        let per_pascal = (at_high - at_low) / (552.0e3 - 207.0e3);
        nodes.iter().map(|p| at_low + per_pascal * (p - 207.0e3)).collect()
    };
    MuscleTable {
        kind: Kind::Contractile,
        geometry: braid::miniature().cast(),
        deadband: Pressure::from_kilopascals(76.5),
        goes_slack: false,
        nodes: nodes.iter().copied().collect(),
        elastic: [curve(2.1e6, 2.6e6), curve(-1.5e6, -2.2e6), curve(1.1e6, 1.6e6), curve(-0.2e6, -0.4e6)]
            .into_iter()
            .collect(),
        friction: [0.14, 0.12, 0.10, 0.08, 0.06, 0.047].into_iter().collect(),
        tested: Tested {
            pressure_low: Pressure::from_kilopascals(207.0),
            pressure_high: Pressure::from_kilopascals(552.0),
            contraction_low: 0.0,
            contraction_high: 0.077,
        },
        max_pressure: Pressure::from_kilopascals(600.0),
        blocked_force: Force::from_newtons(135.7),
        effects: heapless::Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Length;

    #[test]
    fn every_wrong_number_is_named() {
        let wrong = |f: &dyn Fn(&mut MuscleTable)| {
            let mut t = example();
            f(&mut t);
            t.check()
        };
        assert_eq!(example().check(), Ok(()));
        assert!(MuscleTable::empty().check().is_err());
        assert_eq!(
            wrong(&|t| t.geometry.wall = Length::ZERO),
            Err(TableError::Geometry(GeometryError::Wall))
        );
        assert_eq!(wrong(&|t| t.deadband = Pressure::from_pascals(f32::NAN)), Err(TableError::Deadband));
        assert_eq!(wrong(&|t| t.nodes.clear()), Err(TableError::NoNodes));
        assert_eq!(wrong(&|t| t.nodes[3] = t.nodes[2]), Err(TableError::Node(3)));
        assert_eq!(wrong(&|t| t.elastic.clear()), Err(TableError::NoOrder));
        assert_eq!(wrong(&|t| t.elastic[1][0] = f32::INFINITY), Err(TableError::Elastic(2)));
        assert_eq!(wrong(&|t| t.friction[0] = 1.0), Err(TableError::Friction));
        assert_eq!(wrong(&|t| t.tested.contraction_high = -1.0), Err(TableError::Tested));
        assert_eq!(wrong(&|t| t.max_pressure = Pressure::ZERO), Err(TableError::MaxPressure));
        assert_eq!(
            wrong(&|t| t.blocked_force = Force::from_newtons(f32::NAN)),
            Err(TableError::BlockedForce)
        );
        let short = FittedEffect::new(crate::effects::EffectName::CoulombFriction, &[]);
        let with_effect = |t: &mut MuscleTable| t.effects = [short.clone()].into_iter().collect();
        assert_eq!(wrong(&with_effect), Err(TableError::Effect(0)));
    }

    #[test]
    fn a_number_at_its_limit_is_taken_and_the_next_one_is_not() {
        type Change = fn(&mut MuscleTable, f32);
        let cases: [(TableError, f32, f32, Change); 6] = [
            (TableError::Deadband, -1e5, 1e6, |t, v| t.deadband = Pressure::from_pascals(v)),
            (TableError::Elastic(3), -STIFFEST, STIFFEST, |t, v| t.elastic[2][5] = v),
            (TableError::Friction, -0.5, 0.95, |t, v| t.friction[5] = v),
            (TableError::Tested, f32::MIN, 552e3, |t, v| t.tested.pressure_low = Pressure::from_pascals(v)),
            (TableError::Tested, -1.0, 0.077, |t, v| t.tested.contraction_low = v),
            (TableError::MaxPressure, 0.0_f32.next_up(), HIGHEST, |t, v| {
                t.max_pressure = Pressure::from_pascals(v);
            }),
        ];
        for (error, low, high, change) in cases {
            let with = |value: f32| {
                let mut t = example();
                change(&mut t, value);
                t.check()
            };
            assert_eq!([with(low), with(high)], [Ok(()), Ok(())], "{error:?}");
            for value in [low.next_down(), high.next_up(), f32::NAN, f32::INFINITY] {
                assert_eq!(with(value), Err(error), "{value}");
            }
        }
    }

    #[test]
    fn nodes_that_are_too_close_and_curves_that_leave_their_limits_between_nodes_are_refused() {
        let with = |change: &dyn Fn(&mut MuscleTable)| {
            let mut t = example();
            change(&mut t);
            t.check()
        };
        let gap = |pascals: f32| with(&|t| t.nodes[1] = t.nodes[0] + pascals);
        assert_eq!(gap(5e3), Ok(()));
        assert_eq!([gap(1e3), gap(200.0)], [Err(TableError::Node(1)); 2]);
        // All values are within the limits; between them the curve goes to −0.7 and 1.15.
        assert_eq!(
            with(&|t| t.friction = [0.0, 0.0, 0.9, -0.5, -0.5, 0.9].into_iter().collect()),
            Err(TableError::Friction)
        );
        assert_eq!(with(&|t| t.friction = [0.0, 0.0, 0.4, 0.4, 0.0, 0.0].into_iter().collect()), Ok(()));
    }

    #[test]
    fn numbers_of_which_no_force_could_be_computed_are_refused() {
        let with = |change: &dyn Fn(&mut MuscleTable)| {
            let mut t = example();
            change(&mut t);
            t.check()
        };
        let length = Length::from_metres;
        let diameter = Err(TableError::Geometry(GeometryError::OuterDiameter));
        assert_eq!(with(&|t| t.geometry.outer_diameter = length(1e30)), diameter);
        assert_eq!(
            with(&|t| t.geometry.rest_length = length(1e20)),
            Err(TableError::Geometry(GeometryError::RestLength))
        );
        assert_eq!(
            with(&|t| (t.geometry.outer_diameter, t.geometry.wall) = (length(1e-38), length(1e-39))),
            diameter
        );
        // Fibres that are nearly axial widen a hundred times as the muscle contracts.
        assert_eq!(
            with(&|t| t.geometry.braid_angle = crate::units::Angle::from_radians(1.57)),
            Err(TableError::Tested)
        );
        assert_eq!(with(&|t| t.tested.contraction_high = 1.0), Err(TableError::Tested));
        assert_eq!(with(&|t| t.nodes[5] = 1e38), Err(TableError::Node(5)));
    }

    #[test]
    fn a_curve_has_one_value_for_each_node_and_an_effect_all_of_its_numbers() {
        let wrong = |change: fn(&mut MuscleTable)| {
            let mut t = example();
            let effect = crate::effects::EffectName::CoulombFriction;
            let parameters = [0.1; 8];
            t.effects.push(FittedEffect::new(effect, &parameters[..effect.parameter_count()])).expect("room");
            assert_eq!(t.check(), Ok(()));
            change(&mut t);
            t.check()
        };
        assert_eq!(
            wrong(|t| {
                t.elastic[0].pop();
            }),
            Err(TableError::Elastic(1))
        );
        assert_eq!(
            wrong(|t| {
                t.friction.pop();
            }),
            Err(TableError::Friction)
        );
        assert_eq!(wrong(|t| t.nodes[0] = f32::NAN), Err(TableError::Node(0)));
        assert_eq!(wrong(|t| t.nodes[5] = f32::INFINITY), Err(TableError::Node(5)));
        assert_eq!(wrong(|t| t.nodes[1] = 0.0), Err(TableError::Node(1)));
        assert_eq!(wrong(|t| t.effects[0].parameters[0] = f32::NAN), Err(TableError::Effect(0)));
        assert_eq!(
            wrong(|t| {
                let _ = t.effects[0].remembered.push(f32::NAN);
            }),
            Err(TableError::Effect(0))
        );
        assert_eq!(
            wrong(|t| t.tested.pressure_high = Pressure::from_pascals(f32::NAN)),
            Err(TableError::Tested)
        );
        assert_eq!(wrong(|t| t.tested.contraction_high = f32::NAN), Err(TableError::Tested));
        assert_eq!(example().order(), 4);
    }

    #[test]
    fn the_curves_of_the_example_rise_evenly_between_their_ends() {
        let ends = [[2.1e6, 2.6e6], [-1.5e6, -2.2e6], [1.1e6, 1.6e6], [-0.2e6, -0.4e6]];
        let t = example();
        for (curve, [low, high]) in t.elastic.iter().zip(ends) {
            let span = t.nodes[5] - t.nodes[0];
            for (value, node) in curve.iter().zip(&t.nodes) {
                let part = (node - 207e3) / span;
                assert!((value - (low * (1.0 - part) + high * part)).abs() < 1.0, "{value} at {node}");
            }
        }
    }
}
