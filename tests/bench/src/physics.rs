//! Physics beyond the quasi-static muscle, each of which can be switched on apart: [`Physics`] names what is on,
//! [`PhysicsState`] carries the memory.

use crate::friction::BraidFriction;
use serde::{Deserialize, Serialize};

/// What is switched on; everything off is the quasi-static muscle with bristle friction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Physics {
    /// Viscous drag.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous: Option<Viscous>,
    /// Stress relaxation of the rubber.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Relaxation>,
    /// Softening of rubber that was stretched before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mullins: Option<Mullins>,
    /// Friction of a push-rod's seal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seal: Option<Seal>,
}

/// Drag in proportion to speed: `c v`, N s/m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Viscous {
    /// Drag per speed c, N s/m.
    pub drag: f64,
    /// Further drag per speed and pressure, N s/m/Pa.
    #[serde(default)]
    pub per_pressure: f64,
}

/// A spectrum of Maxwell branches whose strengths make a power law over decades of time: the elastic force's history
/// `q_i' = F_el' − q_i/τ_i` adds `Σ g_i q_i`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// Strength of the fastest branch, per unit of elastic force.
    pub strength: f64,
    /// Time of the fastest branch, s.
    pub fastest: f64,
    /// Branches, a factor of √10 apart.
    pub branches: usize,
    /// Exponent of the power law: branch i has strength · (τ_i/τ_0)^−exponent.
    pub exponent: f64,
}

/// Softening by the largest stretch so far, in the hyperbolic form of network damage (A. Dorfmann, R. W. Ogden, doi
/// 10.1016/j.ijsolstr.2003.11.014): below the largest stretch J_m (J = I1 − 3) the elastic force is taken
/// `1 − r tanh((J_m − J)/(m J_m))`-fold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mullins {
    /// Largest loss r, 0..1.
    pub loss: f64,
    /// Width m.
    pub width: f64,
    /// Largest I1 − 3 that the muscle has seen before the first recording.
    #[serde(default)]
    pub conditioned: f64,
}

/// A rod seal: friction `F0 + a P`, bristle travel δ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Seal {
    /// Friction without pressure F0, N.
    pub dry: f64,
    /// Friction per pressure a, N/Pa.
    pub per_pressure: f64,
    /// Travel in which the lip gives, m.
    pub travel: f64,
}

/// Memory of everything in [`Physics`].
#[derive(Debug, Clone)]
pub struct PhysicsState {
    on: Physics,
    maxwell: Vec<(f64, f64, f64)>,
    last_elastic: Option<f64>,
    largest: f64,
    seal: f64,
    temperature: f64,
}

impl PhysicsState {
    /// Fresh memory.
    pub fn new(on: &Physics) -> Self {
        let maxwell = on.relaxation.map_or(Vec::new(), |r| {
            (0..r.branches)
                .map(|i| {
                    let ratio = 10f64.powf(0.5 * i as f64);
                    (r.strength * ratio.powf(-r.exponent), r.fastest * ratio, 0.0)
                })
                .collect()
        });
        Self {
            maxwell,
            last_elastic: None,
            largest: on.mullins.map_or(0.0, |m| m.conditioned),
            seal: 0.0,
            temperature: 22.0,
            on: on.clone(),
        }
    }

    /// The elastic force with its memory, N, from the hyperelastic one at stretch `j` (mean I1 − 3).
    pub fn elastic(&mut self, hyperelastic: f64, j: f64, _stroke: f64, dt: f64) -> f64 {
        let mut force = hyperelastic;
        if let Some(m) = self.on.mullins {
            self.largest = self.largest.max(j);
            if self.largest > 0.0 {
                force *= 1.0 - m.loss * ((self.largest - j) / (m.width * self.largest)).tanh();
            }
        }
        let change = force - self.last_elastic.unwrap_or(force);
        self.last_elastic = Some(force);
        for (strength, tau, q) in &mut self.maxwell {
            // Exact for an elastic force that moves straight during the step.
            let decay = (-dt / *tau).exp();
            let gain = if dt > 0.0 { (1.0 - decay) * *tau / dt } else { 1.0 };
            *q = *q * decay + change * gain;
            force += *strength * *q;
        }
        force
    }

    /// Level of the braid's friction, N.
    pub fn friction_level(
        &mut self,
        f: &BraidFriction,
        core: f64,
        p: f64,
        _x: f64,
        _dx: f64,
        _dt: f64,
    ) -> f64 {
        f.factor(p) * core.abs()
    }

    /// Forces that oppose motion besides the braid's friction, N.
    pub fn drag(&mut self, p: f64, _core: f64, dx: f64, dt: f64) -> f64 {
        let v = if dt > 0.0 { dx / dt } else { 0.0 };
        let mut drag = self.on.viscous.map_or(0.0, |c| (c.drag + c.per_pressure * p) * v);
        if let Some(s) = self.on.seal {
            let way = if dx > 0.0 { 1.0 } else { -1.0 };
            self.seal = way + (self.seal - way) * (-dx.abs() / s.travel.max(1e-9)).exp();
            drag += (s.dry + s.per_pressure * p.max(0.0)) * self.seal;
        }
        drag
    }

    /// After the forces of a step are known: heat and wear.
    pub fn after(&mut self, _heat: f64, _core: f64, _dt: f64, ambient: f64, _stroke: f64) {
        self.temperature = ambient;
    }

    /// How much the rest length has changed, m of stroke.
    pub fn rest_shift(&self) -> f64 {
        0.0
    }

    /// Bladder temperature, °C.
    pub fn temperature(&self) -> f64 {
        self.temperature
    }
}
