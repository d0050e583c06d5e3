//! Friction of braid on bladder and strand on strand, with a state.
//!
//! Bristles between the sliding surfaces bend before they slip. Bristle i, with share `a_i` and breaking travel `δ_i`, obeys
//! Dahl's law (P. R. Dahl, 1968; also the rate-free part of LuGre, doi 10.1109/9.376053)
//!
//! `dz_i/dξ = (1 − z_i sgn dξ)/δ_i`,  `friction = W Σ a_i z_i`,
//!
//! so that in full sliding the friction is `W sgn v`. `W = k_F(P) |F_core|`: what presses the strands together is the braid's
//! tension, and with it the muscle's force. The travel `dξ = dx + s dP` counts, in addition to the stroke, what the strands slip
//! under the ends while the pressure changes at held length (fibres stretch and settle): filling acts like shortening. This
//! makes the gap between filling and emptying that isometric recordings show. Changes within the lock `±h` of the last
//! pressure that moved the strands are carried by their static friction and move nothing: a regulator's ripple does not
//! shake the friction loose.

use serde::{Deserialize, Serialize};

/// Constants of the braid's friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BraidFriction {
    /// Nodes (P in Pa, k_F) in rising pressure; straight between, the end slopes go on outside, never below a fifth of the
    /// smallest node.
    pub factor: Vec<(f64, f64)>,
    /// Bristles: (share, breaking travel in m). The shares add to one.
    pub bristles: Vec<(f64, f64)>,
    /// Slip of the strands per pressure at held length s, m/Pa.
    pub slip: f64,
    /// Change of pressure that static friction carries, half-width h, Pa.
    #[serde(default)]
    pub lock: f64,
    /// How much the friction differs between the ways: shortening has `1 + asymmetry` times W, lengthening `1 − asymmetry`.
    #[serde(default)]
    pub asymmetry: f64,
}

impl BraidFriction {
    /// k_F at a pressure (Pa).
    pub fn factor(&self, p: f64) -> f64 {
        let n = &self.factor;
        let smallest = n.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
        if !smallest.is_finite() {
            return 0.0;
        }
        if n.len() < 2 {
            return smallest;
        }
        let i = n.iter().position(|f| f.0 > p).unwrap_or(n.len()).clamp(1, n.len() - 1);
        let (a, b) = (n[i - 1], n[i]);
        (a.1 + (b.1 - a.1) * (p - a.0) / (b.0 - a.0)).max(0.2 * smallest)
    }
}

/// State of the bristles.
#[derive(Debug, Clone)]
pub(crate) struct Braid {
    z: Vec<f64>,
    /// Pressure since the strands last moved, Pa, within ±h.
    carried: f64,
}

impl Braid {
    /// Bristles upright: no one knows which way the muscle last moved.
    pub fn new(friction: &BraidFriction) -> Self {
        Self { z: vec![0.0; friction.bristles.len()], carried: 0.0 }
    }

    /// Slide by `dx` (m, shortening positive) while the pressure changes by `dp` (Pa) under a friction level `w` (N);
    /// gives the force that opposes shortening, N.
    ///
    /// The bristles' law is solved exactly over the step, so a step of any size is stable.
    pub fn slide(&mut self, friction: &BraidFriction, w: f64, dx: f64, dp: f64) -> f64 {
        let reached = self.carried + dp;
        self.carried = reached.clamp(-friction.lock, friction.lock);
        let travel = dx + friction.slip * (reached - self.carried);
        let way = if travel > 0.0 { 1.0 } else { -1.0 };
        let mut sum = 0.0;
        for (z, (share, delta)) in self.z.iter_mut().zip(&friction.bristles) {
            *z = way + (*z - way) * (-travel.abs() / delta.max(1e-12)).exp();
            sum += share * *z;
        }
        w * sum * (1.0 + friction.asymmetry * sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn friction() -> BraidFriction {
        BraidFriction {
            factor: vec![(200e3, 0.14), (600e3, 0.06)],
            bristles: vec![(0.7, 1e-5), (0.3, 5e-5)],
            slip: 4e-10,
            lock: 0.0,
            asymmetry: 0.0,
        }
    }

    #[test]
    fn sliding_reaches_the_level_and_a_loop_loses_energy() {
        let f = friction();
        let mut b = Braid::new(&f);
        let (mut work, mut last) = (0.0, 0.0);
        for i in 0..4000 {
            let dx = if i / 1000 % 2 == 0 { 1e-6 } else { -1e-6 };
            last = b.slide(&f, 10.0, dx, 0.0);
            if i >= 2000 {
                work += last * dx;
            }
        }
        assert!((last + 10.0).abs() < 1e-3, "full sliding while lengthening: {last}");
        assert!(work > 0.9 * 4.0 * 10.0 * 5e-4, "loop area {work} J");
    }

    #[test]
    fn a_step_may_be_cut_without_changing_the_end() {
        let f = friction();
        let (mut a, mut b) = (Braid::new(&f), Braid::new(&f));
        let whole = a.slide(&f, 5.0, 3e-5, 0.0);
        let mut parts = 0.0;
        for _ in 0..300 {
            parts = b.slide(&f, 5.0, 1e-7, 0.0);
        }
        assert!((whole - parts).abs() < 1e-9, "{whole} {parts}");
    }

    #[test]
    fn at_held_length_filling_rubs_like_shortening() {
        let f = friction();
        let mut b = Braid::new(&f);
        assert!(b.slide(&f, 5.0, 0.0, 400e3) > 4.0);
        assert!(b.slide(&f, 5.0, 0.0, -400e3) < -4.0);
    }

    #[test]
    fn ripple_within_the_lock_moves_nothing() {
        let f = BraidFriction { lock: 3e3, ..friction() };
        let mut b = Braid::new(&f);
        let held = b.slide(&f, 5.0, 1e-3, 0.0);
        let mut last = held;
        for i in 0..1000 {
            last = b.slide(&f, 5.0, 0.0, if i % 2 == 0 { 1e3 } else { -1e3 });
        }
        assert!((last - held).abs() < 1e-9, "{last} {held}");
        assert!(b.slide(&f, 5.0, 0.0, -400e3) < -4.0);
    }

    #[test]
    fn the_factor_is_straight_between_nodes_and_never_negative() {
        let f = friction();
        assert!((f.factor(400e3) - 0.10).abs() < 1e-12);
        assert!(f.factor(5e6) > 0.0);
    }
}
