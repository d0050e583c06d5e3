//! One muscle: what it is ([`MuscleSpec`]), what is true of it ([`Truth`]) and how it moves ([`Muscle`]).

use crate::friction::{Braid, BraidFriction};
use crate::material::Hyperelastic;
use crate::physics::{Moment, Physics, PhysicsState};
use crate::surface::{Shape, Surface};
use crate::tube::{Geometry, Tube};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Which way the muscle works.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Pulls as it shortens.
    Contractile,
    /// Pushes a rod out as it shortens inside.
    Push,
}

/// Why the muscle does not pull immediately.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Deadband {
    /// Radial gap between bladder and braid at rest, m: the bladder is stretched across it before the braid feels anything.
    pub gap: f64,
    /// Pressure that is lost in addition, Pa.
    pub lost: f64,
}

/// Everything that is drawn or chosen for one muscle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MuscleSpec {
    /// Its name.
    pub name: String,
    /// Which way it works.
    pub kind: Kind,
    /// Ruler and protractor.
    pub geometry: Geometry,
    /// The bladder's rubber.
    pub material: Hyperelastic,
    /// Gap and lost pressure.
    pub deadband: Deadband,
    /// Departure from the cylinder.
    pub shape: Shape,
    /// Friction of the braid.
    pub friction: BraidFriction,
    /// Pressure it is rated for, Pa.
    pub max_pressure: f64,
    /// Physics beyond the quasi-static muscle; all off by default.
    #[serde(default)]
    pub physics: Physics,
}

impl MuscleSpec {
    /// The bladder at rest.
    pub fn tube(&self) -> Tube {
        let outer = self.geometry.radius - self.deadband.gap;
        Tube {
            rest_length: self.geometry.rest_length,
            outer,
            wall: self.geometry.wall.min(0.9 * outer),
            material: self.material,
        }
    }

    /// Choose the gap so that the blocked core force begins at `deadband` (Pa). Where even a gap of 30 % of the radius does not
    /// suffice, the rest is taken as lost pressure.
    pub fn with_deadband(mut self, deadband: f64) -> Self {
        let (mut low, mut high) = (0.0, 0.3 * self.geometry.radius);
        self.deadband.lost = 0.0;
        for _ in 0..60 {
            self.deadband.gap = 0.5 * (low + high);
            if self.cylinder_intercept() < deadband {
                low = self.deadband.gap;
            } else {
                high = self.deadband.gap;
            }
        }
        self.deadband.lost = deadband - self.cylinder_intercept();
        self
    }

    /// Free contraction of the cylinder at the rated pressure.
    fn cylinder_free_contraction(&self) -> f64 {
        let (g, tube) = (&self.geometry, self.tube());
        let (mut low, mut high) = (0.0, 0.45);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            let l = g.rest_length * (1.0 - middle);
            let stored = tube.stored(l, g.braid_radius(l));
            let elastic = stored.by_length + stored.by_radius * g.braid_radius_slope(l);
            if (self.max_pressure - self.deadband.lost) * g.pulling_area(l) + elastic > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Pressure at which the blocked force of the cylinder begins, Pa.
    fn cylinder_intercept(&self) -> f64 {
        let (g, l0) = (&self.geometry, self.geometry.rest_length);
        let stored = self.tube().stored(l0, g.radius);
        self.deadband.lost
            - (stored.by_length + stored.by_radius * g.braid_radius_slope(l0)) / g.pulling_area(l0)
    }

    /// Scale the rubber's stiffness (the deadband held) until the free contraction at `pressure` is `contraction`.
    pub fn with_free_contraction(mut self, pressure: f64, contraction: f64) -> Self {
        let deadband = self.cylinder_intercept();
        let material = self.material;
        let (mut low, mut high) = (0.02f64, 50.0f64);
        for _ in 0..40 {
            let middle = (low * high).sqrt();
            self.material = material.scaled(middle);
            self = self.with_deadband(deadband);
            let l = self.geometry.rest_length * (1.0 - contraction);
            let stored = self.tube().stored(l, self.geometry.braid_radius(l));
            let elastic = stored.by_length + stored.by_radius * self.geometry.braid_radius_slope(l);
            let pull = (pressure - self.deadband.lost) * self.geometry.pulling_area(l) + elastic;
            if pull > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        self
    }

    /// The muscle description file of the host tools (TOML).
    pub fn description(&self) -> String {
        let g = &self.geometry;
        format!(
            "name = \"{}\"\nkind = \"{}\"\nrest_length_mm = {:.4}\nbraid_angle_deg = {:.4}\n\
             bladder_outer_diameter_mm = {:.4}\nbladder_wall_mm = {:.4}\nmax_pressure_kPa = {:.1}\n",
            self.name,
            if self.kind == Kind::Push { "push" } else { "contractile" },
            g.rest_length * 1e3,
            g.braid_angle.to_degrees(),
            g.radius * 2e3,
            g.wall * 1e3,
            self.max_pressure * 1e-3,
        )
    }
}

/// What is true of a muscle, for judging what a fit found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Name of the muscle.
    pub muscle: String,
    /// Pressure at which the blocked core force begins (its intercept on the pressure axis from the working range), kPa.
    #[serde(rename = "deadband_kPa")]
    pub deadband_kpa: f64,
    /// Young's modulus of the rubber at small strain, MPa.
    #[serde(rename = "young_modulus_MPa")]
    pub young_mpa: f64,
    /// For each requested pressure.
    pub pressures: Vec<TruthAt>,
}

/// What is true at one pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TruthAt {
    /// Pressure, kPa.
    #[serde(rename = "pressure_kPa")]
    pub pressure_kpa: f64,
    /// Friction factor of full sliding.
    #[serde(rename = "k_F")]
    pub k_f: f64,
    /// Blocked force without friction, N.
    #[serde(rename = "blocked_force_N")]
    pub blocked_force: f64,
    /// Contraction at which the friction-free force vanishes.
    pub free_contraction: f64,
}

/// Push at which a slack muscle buckles, part of the blocked force at the rated pressure.
pub(crate) const BUCKLING: f64 = 0.001;

/// A muscle at work: tables built once, and its state. Clones share the tables.
#[derive(Debug, Clone)]
pub struct Muscle {
    spec: Arc<MuscleSpec>,
    surface: Arc<Surface>,
    tube_volume: f64,
    braid: Braid,
    buckling: f64,
    physics: PhysicsState,
    last: Option<(f64, f64)>,
}

/// Forces and internal readings after a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drive {
    /// Force the muscle gives to its load, N.
    pub force: f64,
    /// Without friction, N.
    pub core: f64,
    /// Bladder temperature, °C.
    pub temperature: f64,
}

impl Muscle {
    /// Build the tables of a muscle.
    pub fn new(spec: MuscleSpec) -> Self {
        let tube = spec.tube();
        let shortest = 1.0 - 1.25 * (spec.cylinder_free_contraction() + 0.01);
        let surface = Surface::new(spec.geometry, tube, spec.shape, spec.max_pressure, shortest);
        let braid = Braid::new(&spec.friction);
        let physics = PhysicsState::new(&spec.physics);
        let mut muscle = Self {
            tube_volume: tube.volume(),
            surface: Arc::new(surface),
            braid,
            buckling: 0.0,
            physics,
            spec: Arc::new(spec),
            last: None,
        };
        muscle.buckling = BUCKLING * muscle.straight_parts(muscle.spec.max_pressure, 0.0).0.max(0.0);
        muscle
    }

    /// What it was built from.
    pub fn spec(&self) -> &MuscleSpec {
        &self.spec
    }

    /// Back to rest, the way of the last motion and all memory forgotten.
    pub fn reset(&mut self) {
        self.braid = Braid::new(&self.spec.friction);
        self.physics = PhysicsState::new(&self.spec.physics);
        self.last = None;
    }

    /// Active length at a stroke (m), after permanent set and slip.
    fn length(&self, stroke: f64) -> f64 {
        self.spec.geometry.rest_length - stroke
    }

    /// Quasi-static force (N) at pressure `p` (Pa) and contraction stroke (m), friction and memory left out.
    pub fn quasi_static(&self, p: f64, stroke: f64) -> f64 {
        let (pressure, elastic) = self.quasi_parts(p, stroke);
        pressure + elastic
    }

    /// The same in its two parts: what the pressure gives and what the stored energy takes, N.
    ///
    /// Below contact the bladder stands alone and pushes its ends apart in proportion to the pressure; at contact the two
    /// descriptions agree. A muscle that pushes buckles: it goes slack at a push of [`BUCKLING`] of its blocked force.
    pub(crate) fn quasi_parts(&self, p: f64, stroke: f64) -> (f64, f64) {
        let (pressure, elastic) = self.straight_parts(p, stroke);
        let force = pressure + elastic;
        if force >= 0.0 || self.buckling <= 0.0 {
            return (pressure, elastic);
        }
        let slack = -self.buckling * (1.0 - (force / self.buckling).exp());
        (slack - elastic, elastic)
    }

    /// The two parts of a muscle that is kept from buckling.
    fn straight_parts(&self, p: f64, stroke: f64) -> (f64, f64) {
        let l = self.length(stroke);
        let lost = self.spec.deadband.lost;
        let touch = self.surface.contact_pressure(l) + lost.max(0.0);
        if p < touch {
            let alone = self.surface.contact_force(l) * (p / touch).max(0.0);
            return (0.0, alone);
        }
        let parts = self.surface.parts(p - lost, l);
        ((p - lost) * parts.area, parts.elastic)
    }

    /// Contraction stroke (m) at which the friction-free force vanishes at pressure `p`; 0 below the deadband.
    pub fn free_stroke(&self, p: f64) -> f64 {
        let (mut low, mut high) = (0.0, 0.45 * self.spec.geometry.rest_length);
        if self.quasi_static(p, 0.0) <= 0.0 {
            return 0.0;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.quasi_static(p, middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Inner volume at a stroke, m³.
    pub fn volume(&self, stroke: f64) -> f64 {
        self.surface.volume(self.tube_volume, self.length(stroke))
    }

    /// Mean I1 − 3 of the bladder's rubber at a stroke.
    pub fn stretch(&self, stroke: f64) -> f64 {
        self.surface.stretch(self.length(stroke))
    }

    /// What is true of this muscle at these pressures (Pa).
    pub fn truth(&self, pressures: &[f64]) -> Truth {
        // The blocked core force is straight in the pressure once the bladder lies against the braid.
        let (a, b) = (0.6 * self.spec.max_pressure, self.spec.max_pressure);
        let (fa, fb) = (self.quasi_static(a, 0.0), self.quasi_static(b, 0.0));
        let at = |&p: &f64| TruthAt {
            pressure_kpa: p * 1e-3,
            k_f: self.spec.friction.factor(p),
            blocked_force: self.quasi_static(p, 0.0),
            free_contraction: self.free_stroke(p) / self.spec.geometry.rest_length,
        };
        Truth {
            muscle: self.spec.name.clone(),
            deadband_kpa: (a - fa * (b - a) / (fb - fa)) * 1e-3,
            young_mpa: self.spec.material.young() * 1e-6,
            pressures: pressures.iter().map(at).collect(),
        }
    }

    /// The force (N) after a step of `dt` (s) to a contraction stroke (m) and pressure (Pa) that is not made.
    pub(crate) fn force_after(&self, dt: f64, stroke: f64, p: f64, ambient: f64) -> f64 {
        self.clone().advance(dt, stroke, p, ambient).force
    }

    /// Advance by `dt` (s) to a contraction stroke (m) and pressure (Pa) and give the force there.
    pub fn advance(&mut self, dt: f64, stroke: f64, p: f64, ambient: f64) -> Drive {
        let (x0, p0) = self.last.unwrap_or((stroke, p));
        self.last = Some((stroke, p));
        let (dx, dp) = (stroke - x0, p - p0);
        // A muscle that has become longer is shortened by as much more at the same crosshead.
        let worn = stroke + self.physics.rest_shift();
        let ratio = self.spec.geometry.braid_radius(self.length(worn)) / self.spec.geometry.radius;
        let (pressure_part, elastic) = self.quasi_parts(p - self.physics.uneven(ratio), worn);
        let moment = Moment {
            dt,
            pressure: p,
            stroke: worn,
            dx,
            stretch: self.surface.stretch(self.length(worn)),
            area: ratio * self.length(worn) / self.spec.geometry.rest_length,
            ambient,
        };
        let core = pressure_part + self.physics.elastic(elastic, &moment);
        let core = self.physics.whole(core, &moment);
        let level = self.physics.braid(self.spec.friction.factor(p) * core.abs(), &moment);
        let rub = self.braid.slide(&self.spec.friction, level, dx, dp);
        let drag = self.physics.drag(&moment);
        self.physics.after((rub + drag) * dx, core, &moment);
        Drive { force: core - rub - drag, core, temperature: self.physics.temperature() }
    }
}
