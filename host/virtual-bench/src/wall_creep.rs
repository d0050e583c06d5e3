//! A wall whose stress creeps with the logarithm of time, as a convolution over its whole load history.
//!
//! ```text
//! F(t) = r ∫ log10(1 + (t − t′)/t_0) du(t′)        u = (F_w − F_0) tanh(P/P_w)
//! ```
//! `F_w`, N, is the wall's share of the pull. At `F_0` nothing creeps; below it the creep reverses. There is no branch, no state per decade,
//! and no end of the creep, unlike in the model, which has a sum of exponentials.

use serde::{Deserialize, Serialize};

/// The law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WallCreep {
    /// Share of the load that creeps in a decade.
    pub per_decade: f64,
    /// Time from which it creeps, s.
    pub from: f64,
    /// Load without creep, N.
    pub balance: f64,
    /// Pressure over which the wall meets the braid, Pa.
    pub contact: f64,
}

/// Changes of the wall's load: when, and by how much.
#[derive(Debug, Clone, Default)]
pub(crate) struct LoadHistory {
    changes: Vec<(f64, f64)>,
    clock: f64,
    last: f64,
}

/// Changes within this time count as one, s.
const TOGETHER: f64 = 0.02;
/// Beyond this number of changes the older ones are merged in pairs.
const MOST: usize = 1024;

impl LoadHistory {
    /// The creep's force, N, after the wall has taken `wall` (N) at a pressure (Pa) for a step `dt` (s).
    pub fn creep(&mut self, law: &WallCreep, wall: f64, pressure: f64, dt: f64) -> f64 {
        self.clock += dt;
        let load = (wall - law.balance) * (pressure / law.contact.max(1.0)).tanh();
        let change = load - self.last;
        self.last = load;
        match self.changes.last_mut() {
            Some((when, sum)) if self.clock - *when < TOGETHER => *sum += change,
            _ if change != 0.0 => self.changes.push((self.clock, change)),
            _ => {}
        }
        if self.changes.len() > MOST {
            let (old, new) = self.changes.split_at(MOST / 2);
            let pair = |c: &[(f64, f64)]| {
                let size = c.iter().map(|(_, u)| u.abs()).sum::<f64>();
                let when = c.iter().map(|(t, u)| t * u.abs()).sum::<f64>() / size.max(f64::MIN_POSITIVE);
                (when, c.iter().map(|(_, u)| u).sum())
            };
            self.changes = old.chunks(2).map(pair).chain(new.iter().copied()).collect();
        }
        let crept =
            |(when, change): &(f64, f64)| change * (1.0 + (self.clock - when) / law.from.max(1e-3)).log10();
        law.per_decade * self.changes.iter().map(crept).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_creeps_by_as_much_in_each_decade_and_turns_round_below_its_balance() {
        let law = WallCreep { per_decade: 0.05, from: 1.0, balance: 10.0, contact: 5e4 };
        for (wall, sign) in [(50.0, 1.0), (2.0, -1.0)] {
            let mut history = LoadHistory::default();
            let mut at = |until: f64, step: f64| {
                let mut force = 0.0;
                while history.clock < until {
                    force = history.creep(&law, wall, 5e5, step);
                }
                force
            };
            let (first, second) = (at(100.0, 0.05), at(1000.0, 0.5));
            assert!(first * sign > 0.0);
            assert!((second - first - 0.05 * (wall - 10.0)).abs() < 0.02 * first.abs(), "{first} {second}");
        }
    }

    #[test]
    fn putting_old_changes_together_hardly_shows() {
        let law = WallCreep { per_decade: 0.05, from: 1.0, balance: 0.0, contact: 5e4 };
        let mut history = LoadHistory::default();
        let mut direct = Vec::new();
        let (mut force, mut last) = (0.0, 0.0);
        for i in 1..=1500 {
            let wall = 30.0 + 20.0 * (0.01 * f64::from(i)).sin();
            force = history.creep(&law, wall, 5e6, 0.1);
            direct.push((0.1 * f64::from(i), wall - last));
            last = wall;
        }
        let exact: f64 = direct.iter().map(|(t, du)| 0.05 * du * (1.0 + (150.0 - t)).log10()).sum();
        assert!((force - exact).abs() < 0.005 * exact, "{force} {exact}");
        assert!(history.changes.len() <= MOST);
    }
}
