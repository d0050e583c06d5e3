//! Friction other than the braid's own law: seals, strand contact, ageing contacts, speed, memory of reversals.

use serde::{Deserialize, Serialize};

/// Drag in proportion to speed, N s/m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Viscous {
    /// Drag per speed, N s/m.
    pub drag: f64,
    /// Further drag per speed and pressure, N s/m/Pa.
    #[serde(default)]
    pub per_pressure: f64,
}

/// A guide or a rod seal: `(F0 + a P)(1 + b/(1 + (v/v_s)²)) z`, with a bristle z of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Seal {
    /// Friction without pressure F0, N.
    pub dry: f64,
    /// Friction per pressure a, N/Pa.
    #[serde(default)]
    pub per_pressure: f64,
    /// Travel in which the lip gives, m.
    pub travel: f64,
    /// Additional friction at rest, relative.
    #[serde(default)]
    pub slow: f64,
    /// Speed at which half of it is gone v_s, m/s.
    #[serde(default)]
    pub slow_speed: f64,
}

/// Strands pressed on the bladder: friction `μ P A` with the contact area growing as the cylinder's does, `A = A0 (R/R0)(L/L0)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StrandContact {
    /// μ A0, m².
    pub area: f64,
}

/// Contacts that age (J. H. Dieterich, doi 10.1029/JB084iB05p02161): `θ' = 1 − |v| θ/D`, and the braid's friction is
/// `1 + b ln(1 + θ/θ0)`-fold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ageing {
    /// Strength b.
    pub strength: f64,
    /// Time after which ageing shows θ0, s.
    pub time: f64,
    /// Travel that renews the contacts D, m.
    pub travel: f64,
}

/// Friction that falls with speed: the braid's friction is `1 + b/(1 + (v/v_s)²)`-fold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slow {
    /// Additional friction at rest b.
    pub strength: f64,
    /// Speed at which half of it is gone v_s, m/s.
    pub speed: f64,
}

/// Thermally activated slip (Eyring): the braid's friction is `1 + b asinh(|v|/v0)`-fold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Activated {
    /// Strength b.
    pub strength: f64,
    /// Reference speed v0, m/s.
    pub speed: f64,
}

/// Memory of reversals: Preisach's relays over the stroke, `force = −a P Σ s(α, β)/n`, each relay switching to +1
/// above α and to −1 below β.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Relays {
    /// Force per pressure at full switching a, N/Pa.
    pub area: f64,
    /// Stroke that the relays cover, m.
    pub span: f64,
    /// Widest relay, part of the span.
    pub widest: f64,
}

/// Relays per side of Preisach's triangle.
const RELAYS: usize = 24;

/// State of everything in this file.
#[derive(Debug, Clone, Default)]
pub(crate) struct RubbingState {
    seal: f64,
    theta: f64,
    relays: Vec<(f64, f64, bool)>,
}

impl RubbingState {
    /// Fresh contacts.
    pub fn new(relays: Option<Relays>) -> Self {
        let relays = relays.map_or(Vec::new(), |r| {
            let place = |i: usize| r.span * (i as f64 + 0.5) / RELAYS as f64;
            let pairs = (0..RELAYS).flat_map(|i| (0..=i).map(move |j| (i, j)));
            pairs
                .map(|(i, j)| (place(i), place(j)))
                .filter(|(a, b)| a - b <= r.widest * r.span)
                .map(|(a, b)| (a, b, true))
                .collect()
        });
        Self { seal: 0.0, theta: 1.0, relays }
    }

    /// Force of a seal against motion, N.
    pub fn seal(&mut self, law: &Seal, p: f64, dx: f64, v: f64) -> f64 {
        let way = if dx > 0.0 { 1.0 } else { -1.0 };
        self.seal = way + (self.seal - way) * (-dx.abs() / law.travel.max(1e-9)).exp();
        let ratio = if law.slow_speed > 0.0 { v / law.slow_speed } else { 0.0 };
        (law.dry + law.per_pressure * p.max(0.0)) * (1.0 + law.slow / (1.0 + ratio * ratio)) * self.seal
    }

    /// Factor on the braid's friction by ageing.
    pub fn aged(&mut self, law: &Ageing, v: f64, dt: f64) -> f64 {
        // Solved exactly for a constant speed within the step.
        let rate = v.abs() / law.travel.max(1e-9);
        self.theta = if rate * dt > 1e-9 {
            let decay = (-rate * dt).exp();
            self.theta * decay + (1.0 - decay) / rate
        } else {
            self.theta + dt
        };
        1.0 + law.strength * (self.theta / law.time.max(1e-9)).ln_1p()
    }

    /// Force of the relays, N, opposing shortening.
    pub fn remembered(&mut self, law: &Relays, p: f64, stroke: f64) -> f64 {
        let mut sum = 0.0;
        for (up, down, low) in &mut self.relays {
            if stroke >= *up {
                *low = false;
            } else if stroke < *down {
                *low = true;
            }
            sum += if *low { -1.0 } else { 1.0 };
        }
        let n = self.relays.len().max(1) as f64;
        // Without hysteresis the relays would follow the stroke: that part belongs to the elastic force and is taken out.
        let even = (2.0 * stroke / law.span - 1.0).clamp(-1.0, 1.0);
        law.area * p.max(0.0) * (even - sum / n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_age_at_rest_and_are_renewed_by_travel() {
        let law = Ageing { strength: 0.1, time: 1.0, travel: 1e-4 };
        let mut s = RubbingState::new(None);
        let sliding = (0..2000).map(|_| s.aged(&law, 1e-3, 0.01)).last().expect("steps");
        let rested = (0..6000).map(|_| s.aged(&law, 0.0, 0.01)).last().expect("steps");
        let after = (0..100).map(|_| s.aged(&law, 1e-3, 0.01)).last().expect("steps");
        assert!(rested > sliding + 0.3 && (after - sliding).abs() < 0.01, "{sliding} {rested} {after}");
    }

    #[test]
    fn a_minor_loop_closes_where_it_began() {
        let law = Relays { area: 1e-4, span: 10e-3, widest: 0.5 };
        let mut s = RubbingState::new(Some(law));
        let mut go = |from: f64, to: f64| {
            let mut last = 0.0;
            for i in 1..=200 {
                last = s.remembered(&law, 1e5, from + (to - from) * f64::from(i) / 200.0);
            }
            last
        };
        let first = go(0.0, 8e-3);
        go(8e-3, 4e-3);
        let back = go(4e-3, 8e-3);
        assert!((first - back).abs() < 1e-9, "return-point memory: {first} {back}");
        let lower = go(8e-3, 4e-3);
        go(4e-3, 0.0);
        let upper = go(0.0, 4e-3);
        assert!(upper > lower, "the branches differ: {upper} {lower}");
    }
}
