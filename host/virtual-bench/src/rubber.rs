//! Memory of the bladder: relaxation, creep, softening by stretch and by work, heat.
//!
//! The laws are chosen apart from those of the diagnosis (Prony series, logarithm of time, Ogden–Roxburgh, count of cycles,
//! one thermal time constant).

use serde::{Deserialize, Serialize};

/// A spectrum of Maxwell branches whose strengths make a power law over decades of time (a sampled fractional element): the
/// driving quantity f has the history `q_i' = f' − q_i/τ_i`, and `Σ g_i q_i` is added.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// Strength of the fastest branch, per unit of the driving quantity.
    pub strength: f64,
    /// Time of the fastest branch, s.
    pub fastest: f64,
    /// Branches, a factor of √10 apart.
    pub branches: usize,
    /// Exponent of the power law: branch i has strength · (τ_i/τ_0)^−exponent.
    pub exponent: f64,
}

/// The branches of a [`Relaxation`].
#[derive(Debug, Clone, Default)]
pub struct Branches {
    maxwell: Vec<(f64, f64, f64)>,
    last: Option<f64>,
}

impl Branches {
    /// All branches relaxed; without a law there are none.
    pub fn new(law: Option<Relaxation>) -> Self {
        let maxwell = law.map_or(Vec::new(), |r| {
            (0..r.branches)
                .map(|i| {
                    let ratio = 10f64.powf(0.5 * i as f64);
                    (r.strength * ratio.powf(-r.exponent), r.fastest * ratio, 0.0)
                })
                .collect()
        });
        Self { maxwell, last: None }
    }

    /// What the branches add after the driving quantity has gone straight to `f` within `dt` (s).
    pub fn add(&mut self, f: f64, dt: f64) -> f64 {
        let change = f - self.last.unwrap_or(f);
        self.last = Some(f);
        let mut sum = 0.0;
        for (strength, tau, q) in &mut self.maxwell {
            let decay = (-dt / *tau).exp();
            let gain = if dt > 0.0 { (1.0 - decay) * *tau / dt } else { 1.0 };
            *q = *q * decay + change * gain;
            sum += *strength * *q;
        }
        sum
    }

    /// The loss against a driving quantity that has always been present: `Σ g_i (f − q_i)`, creep under load.
    pub fn lose(&mut self, f: f64, dt: f64) -> f64 {
        let whole: f64 = self.maxwell.iter().map(|b| b.0).sum();
        if self.last.is_none() {
            // The load is new at the first sight of it.
            self.last = Some(0.0);
        }
        whole * f - self.add(f, dt)
    }
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

/// Softening by work: damage grows with the path of stretching, `dD/ds = (1 − D)³/s0` with s the path of J, and the elastic
/// force is taken `1 − loss D`-fold. Rest does not heal it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wear {
    /// Loss at full damage.
    pub loss: f64,
    /// Path of I1 − 3 that brings the damage on, s0.
    pub path: f64,
}

/// Heat: what is rubbed and what the rubber does not give back warms the bladder, which cools into the fittings, and they
/// into the room.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Heat {
    /// Heat capacity of the bladder, J/K.
    pub capacity: f64,
    /// Conductance to the fittings, W/K.
    pub to_fittings: f64,
    /// Heat capacity of the fittings, J/K.
    pub fittings: f64,
    /// Conductance from the fittings to the room, W/K.
    pub to_room: f64,
    /// Relative change of the elastic force per kelvin.
    pub stiffness: f64,
    /// Relative change of the friction per kelvin.
    pub friction: f64,
    /// Part of the rate at which elastic energy is exchanged that becomes heat.
    pub hysteresis: f64,
}

/// Temperatures above the room, K.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Temperatures {
    /// Of the bladder.
    pub bladder: f64,
    /// Of the fittings.
    pub fittings: f64,
}

impl Temperatures {
    /// Advance by `dt` (s) with `heat` (J) set free in the bladder; implicit, stable at any step.
    pub fn advance(&mut self, law: &Heat, heat: f64, dt: f64) {
        let (a, b) = (dt * law.to_fittings / law.capacity, dt * law.to_fittings / law.fittings);
        let c = dt * law.to_room / law.fittings;
        let (r0, r1) = (self.bladder + heat / law.capacity, self.fittings);
        // (1 + a) x − a y = r0;  −b x + (1 + b + c) y = r1
        let det = (1.0 + a) * (1.0 + b + c) - a * b;
        self.bladder = (r0 * (1.0 + b + c) + a * r1) / det;
        self.fittings = ((1.0 + a) * r1 + b * r0) / det;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_relaxes_by_equal_parts_per_decade_when_the_exponent_is_zero() {
        let mut b =
            Branches::new(Some(Relaxation { strength: 0.01, fastest: 0.1, branches: 9, exponent: 0.0 }));
        b.add(0.0, 0.01);
        b.add(1.0, 1e-6);
        let (mut t, mut at) = (0.0, Vec::new());
        for stop in [1.0, 10.0, 100.0] {
            let mut last = 0.0;
            while t < stop {
                last = b.add(1.0, 0.05);
                t += 0.05;
            }
            at.push(last);
        }
        let (first, second) = (at[0] - at[1], at[1] - at[2]);
        assert!(first > 0.0 && (first / second - 1.0).abs() < 0.05, "{at:?}");
    }

    #[test]
    fn heat_ends_in_balance() {
        let law = Heat {
            capacity: 10.0,
            to_fittings: 0.1,
            fittings: 50.0,
            to_room: 0.2,
            stiffness: 0.0,
            friction: 0.0,
            hysteresis: 0.0,
        };
        let mut t = Temperatures::default();
        for _ in 0..20_000 {
            t.advance(&law, 0.5, 1.0);
        }
        assert!((t.fittings - 2.5).abs() < 1e-3 && (t.bladder - 7.5).abs() < 1e-3, "{t:?}");
    }
}
