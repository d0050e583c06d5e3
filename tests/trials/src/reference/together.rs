//! Two simultaneous changes in the later runs of real recordings.

use rayon::prelude::*;
use serde::Serialize;

use super::injection::{EFFECTS, Slopes, inject};
use super::staircases::Muscle;
use super::{class, compared};

/// % of the largest force rms, each.
pub const SIZES: [f64; 2] = [3.0, 5.0];

/// One trial.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    /// Muscle.
    pub muscle: String,
    /// What was put in.
    pub effects: [&'static str; 2],
    /// %, each.
    pub percent: f64,
    /// Names.
    pub named: Vec<String>,
    /// Names, and those that each of them may be mistaken for.
    pub set: Vec<String>,
    /// Whether one of the two is a lag between channels.
    pub lag: bool,
    /// Whether both are of one class.
    pub alike: bool,
}

impl Trial {
    /// How many of the two are named exactly.
    pub fn exact(&self) -> usize {
        self.effects.iter().filter(|e| self.named.iter().any(|n| n == *e)).count()
    }

    /// Of how many of the two the class is named. Two of one class need two names of it.
    pub fn classes(&self) -> usize {
        let mut open: Vec<&String> = self.named.iter().collect();
        self.effects
            .iter()
            .filter(|e| match open.iter().position(|n| class(n) == class(e)) {
                Some(at) => {
                    open.remove(at);
                    true
                }
                None => false,
            })
            .count()
    }

    /// How many of the two are named or in a set.
    pub fn in_set(&self) -> usize {
        self.effects.iter().filter(|e| self.set.iter().any(|n| n == *e)).count()
    }

    /// Whether a name is of neither class.
    pub fn is_false(&self) -> bool {
        self.named.iter().any(|n| self.effects.iter().all(|e| class(e) != class(n)))
    }
}

fn ask(muscle: &Muscle, slopes: &Slopes, effects: [&'static str; 2], percent: f64) -> Result<Trial, String> {
    let middle = (muscle.runs / 2).max(1);
    let before = muscle.between(1, middle);
    let mut after = muscle.between(middle + 1, muscle.runs);
    after.sort_by_key(|r| (r.run, r.mounting));
    for effect in effects {
        (after, _) = inject(&after, effect, percent, slopes, &muscle.name, middle, 0.5);
    }
    let report = compared(&before, &after).map_err(|e| format!("{} {effects:?}: {e}", muscle.name))?;
    let named: Vec<String> = report.missing.iter().map(|m| m.effect.clone()).collect();
    let mut set = named.clone();
    set.extend(report.missing.iter().flat_map(|m| m.confusable_with.iter().cloned()));
    set.extend(report.set.iter().cloned());
    let lag = effects.iter().any(|e| matches!(*e, "sensor-delay" | "pressure-sensor-lag"));
    let alike = class(effects[0]) == class(effects[1]);
    Ok(Trial { muscle: muscle.name.clone(), effects, percent, named, set, lag, alike })
}

/// Every pair of effects, in every muscle.
///
/// # Errors
/// A trial without an answer.
pub fn run(muscles: &[(&Muscle, &Slopes)]) -> Result<Vec<Trial>, String> {
    let mut jobs = Vec::new();
    for (muscle, slopes) in muscles {
        for (i, a) in EFFECTS.into_iter().enumerate() {
            for b in EFFECTS.into_iter().skip(i + 1) {
                for percent in SIZES {
                    jobs.push((*muscle, *slopes, [a, b], percent));
                }
            }
        }
    }
    jobs.par_iter().map(|(m, s, effects, percent)| ask(m, s, *effects, *percent)).collect()
}
