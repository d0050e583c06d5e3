//! Physics beyond the quasi-static muscle, each of which can be switched on apart: [`Physics`] names what is on,
//! `PhysicsState` carries the memory.

use crate::rubber::Temperatures;
pub use crate::rubber::{Branches, Heat, Mullins, Relaxation, Wear};
use crate::rubbing::RubbingState;
pub use crate::rubbing::{Activated, Ageing, Relays, Seal, Slow, StrandContact, Viscous};
use crate::wall_creep::LoadHistory;
pub use crate::wall_creep::WallCreep;
use serde::{Deserialize, Serialize};

/// What is switched on; everything off is the quasi-static muscle with bristle friction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Physics {
    /// Viscous drag.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous: Option<Viscous>,
    /// A guide or a push-rod's seal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seal: Option<Seal>,
    /// Strand friction by pressure and contact area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strands: Option<StrandContact>,
    /// Contacts that age at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ageing: Option<Ageing>,
    /// Friction that falls with speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow: Option<Slow>,
    /// Friction that rises with speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub activated: Option<Activated>,
    /// Memory of reversals.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relays: Option<Relays>,
    /// Relaxation of the elastic force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Relaxation>,
    /// Creep of the wall's stress over its load history.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_creep: Option<WallCreep>,
    /// Creep of the whole force under load.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub creep: Option<Relaxation>,
    /// Softening of rubber that was stretched before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mullins: Option<Mullins>,
    /// Softening by work.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wear: Option<Wear>,
    /// Heat of friction and hysteresis, which changes elastic force and friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heat: Option<Heat>,
    /// The bladder meets the braid unevenly as it widens: pressure lost is `p (1 − (R0/R)²)`, p in Pa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven_contact: Option<f64>,
    /// Strands lock towards a stroke.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jam: Option<Jam>,
    /// An end slips.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip: Option<Slip>,
    /// Rest length that yields under load.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<Set>,
    /// A linear spring beside the muscle (a stiff hose), N/m: outside the catalogue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hose_spring: Option<f64>,
    /// A fold of the bladder that snaps through: outside the catalogue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fold: Option<Fold>,
    /// Bristles that are damped as they bend: outside the catalogue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bristle_damping: Option<BristleDamping>,
    /// A room whose temperature swings and stiffens the rubber with it: relative amplitude, and period in s. Outside the
    /// catalogue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub room_swing: Option<(f64, f64)>,
}

/// Strands that lock: the force falls by `F exp((x − x_j)/w)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Jam {
    /// Force at x_j, N.
    pub force: f64,
    /// Stroke x_j, m.
    pub stroke: f64,
    /// Width w, m.
    pub width: f64,
}

/// An end that slips once: the rest length grows by `travel` over a few hundredths of a second when the clock passes `time`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slip {
    /// Bench clock, s.
    pub time: f64,
    /// Travel, m.
    pub travel: f64,
}

/// Set: `s' = (s_max − s) |F|/(F_r τ)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Set {
    /// Final change of the rest length s_max, m.
    pub travel: f64,
    /// Reference force F_r, N.
    pub force: f64,
    /// Time at the reference force τ, s.
    pub time: f64,
}

/// A fold: a bump `F exp(−((x − x_f)/w)²)` that is there on the way out only.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fold {
    /// Height, N.
    pub force: f64,
    /// Stroke, m.
    pub stroke: f64,
    /// Width, m.
    pub width: f64,
}

/// The rate-dependent part of LuGre's bristles (C. Canudas de Wit et al., doi 10.1109/9.376053): `c dz/dt`, a pulse at each reversal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BristleDamping {
    /// Damping c per bristle deflection, N s.
    pub damping: f64,
    /// Breaking travel, m.
    pub travel: f64,
}

/// What the muscle is doing in a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Moment {
    /// Step, s.
    pub dt: f64,
    /// Pressure in the muscle, Pa.
    pub pressure: f64,
    /// Stroke from the worn rest length, m.
    pub stroke: f64,
    /// Change of the stroke, m.
    pub dx: f64,
    /// Mean I1 − 3 of the rubber.
    pub stretch: f64,
    /// Area of the cylinder against that at rest, (R/R0)(L/L0).
    pub area: f64,
    /// Temperature of the room, °C.
    pub ambient: f64,
}

impl Moment {
    fn speed(&self) -> f64 {
        if self.dt > 0.0 { self.dx / self.dt } else { 0.0 }
    }
}

/// Memory of everything in [`Physics`].
#[derive(Debug, Clone)]
pub(crate) struct PhysicsState {
    on: Physics,
    relaxation: Branches,
    creep: Branches,
    wall: LoadHistory,
    rubbing: RubbingState,
    largest: f64,
    last_stretch: Option<f64>,
    damage: f64,
    warm: Temperatures,
    ambient: f64,
    clock: f64,
    set: f64,
    exchanged: f64,
    bristle: f64,
}

impl PhysicsState {
    /// Fresh memory.
    pub fn new(on: &Physics) -> Self {
        Self {
            relaxation: Branches::new(on.relaxation),
            creep: Branches::new(on.creep),
            wall: LoadHistory::default(),
            rubbing: RubbingState::new(on.relays),
            largest: on.mullins.map_or(0.0, |m| m.conditioned),
            last_stretch: None,
            damage: 0.0,
            warm: Temperatures::default(),
            ambient: 22.0,
            clock: 0.0,
            set: 0.0,
            exchanged: 0.0,
            bristle: 0.0,
            on: on.clone(),
        }
    }

    /// The elastic force with its memory, N, from the hyperelastic one.
    pub fn elastic(&mut self, hyperelastic: f64, m: &Moment) -> f64 {
        let mut force = hyperelastic;
        if let Some(law) = self.on.mullins {
            self.largest = self.largest.max(m.stretch);
            if self.largest > 0.0 {
                force *= 1.0 - law.loss * ((self.largest - m.stretch) / (law.width * self.largest)).tanh();
            }
        }
        if let Some(law) = self.on.wear {
            let path = (m.stretch - self.last_stretch.unwrap_or(m.stretch)).abs();
            self.damage += path / law.path.max(1e-9) * (1.0 - self.damage).powi(3);
            self.damage = self.damage.min(1.0);
            force *= 1.0 - law.loss * self.damage;
        }
        self.last_stretch = Some(m.stretch);
        if let Some(law) = self.on.heat {
            self.exchanged = law.hysteresis * (force * m.dx).abs();
            force *= 1.0 + law.stiffness * self.warm.bladder;
        }
        if let Some((part, period)) = self.on.room_swing {
            force *= 1.0 + part * (std::f64::consts::TAU * self.clock / period.max(1e-3)).sin();
        }
        if self.on.relaxation.is_some() {
            force += self.relaxation.add(force, m.dt);
        }
        if let Some(law) = &self.on.wall_creep {
            force += self.wall.creep(law, -hyperelastic, m.pressure, m.dt);
        }
        force
    }

    /// The force with creep and what is beside the muscle, N.
    pub fn whole(&mut self, force: f64, m: &Moment) -> f64 {
        let mut whole = force;
        if self.on.creep.is_some() {
            whole -= self.creep.lose(force, m.dt);
        }
        if let Some(j) = self.on.jam {
            whole -= j.force * ((m.stroke - j.stroke) / j.width.max(1e-9)).min(6.0).exp();
        }
        if let Some(k) = self.on.hose_spring {
            whole -= k * m.stroke;
        }
        if let Some(f) = self.on.fold
            && m.dx > 0.0
        {
            let u = (m.stroke - f.stroke) / f.width.max(1e-9);
            whole -= f.force * (-u * u).exp();
        }
        whole
    }

    /// Level of the braid's friction, N, from its plain level.
    pub fn braid(&mut self, plain: f64, m: &Moment) -> f64 {
        let v = m.speed();
        let mut level = plain;
        if let Some(law) = self.on.strands {
            level += law.area * m.area * m.pressure.max(0.0);
        }
        if let Some(law) = self.on.ageing {
            level *= self.rubbing.aged(&law, v, m.dt);
        }
        if let Some(law) = self.on.slow {
            let ratio = v / law.speed.max(1e-9);
            level *= 1.0 + law.strength / (1.0 + ratio * ratio);
        }
        if let Some(law) = self.on.activated {
            level *= 1.0 + law.strength * (v.abs() / law.speed.max(1e-12)).asinh();
        }
        if let Some(law) = self.on.heat {
            level *= (1.0 + law.friction * self.warm.bladder).max(0.1);
        }
        level
    }

    /// Forces that oppose motion in addition to the braid's friction, N.
    pub fn drag(&mut self, m: &Moment) -> f64 {
        let v = m.speed();
        let mut drag = self.on.viscous.map_or(0.0, |c| (c.drag + c.per_pressure * m.pressure) * v);
        if let Some(law) = self.on.seal {
            drag += self.rubbing.seal(&law, m.pressure, m.dx, v);
        }
        if let Some(law) = self.on.relays {
            drag += self.rubbing.remembered(&law, m.pressure, m.stroke);
        }
        if let Some(law) = self.on.bristle_damping
            && m.dt > 0.0
        {
            let way = if m.dx > 0.0 { 1.0 } else { -1.0 };
            let bent = way + (self.bristle - way) * (-m.dx.abs() / law.travel.max(1e-9)).exp();
            drag += law.damping * (bent - self.bristle) / m.dt;
            self.bristle = bent;
        }
        drag
    }

    /// After the forces of a step are known: heat, set, the clock. `rubbed` is the work of friction in J.
    pub fn after(&mut self, rubbed: f64, force: f64, m: &Moment) {
        self.clock += m.dt;
        self.ambient = m.ambient;
        if let Some(law) = self.on.heat {
            self.warm.advance(&law, rubbed.max(0.0) + self.exchanged, m.dt);
        }
        if let Some(law) = self.on.set {
            let rate = force.abs() / (law.force * law.time).max(1e-12);
            self.set += (law.travel - self.set) * (1.0 - (-rate * m.dt).exp());
        }
    }

    /// How much longer the muscle has become, m.
    pub(crate) fn rest_shift(&self) -> f64 {
        let slipped = self.on.slip.map_or(0.0, |s| s.travel * ((self.clock - s.time) / 0.05).clamp(0.0, 1.0));
        slipped + self.set
    }

    /// Pressure that does not reach the braid because the bladder lies unevenly, Pa; `ratio` is R/R0.
    pub fn uneven(&self, ratio: f64) -> f64 {
        self.on.uneven_contact.map_or(0.0, |p| p * (1.0 - 1.0 / (ratio * ratio).max(0.25)))
    }

    /// Bladder temperature, °C.
    pub fn temperature(&self) -> f64 {
        self.ambient + self.warm.bladder
    }
}
