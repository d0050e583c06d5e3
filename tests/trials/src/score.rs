//! Judging one trial: the frozen answer against the opened truth.
//!
//! Everything here was fixed before a final set was drawn: what counts as visible, as right, as a wrong alarm.

use crate::answer::{Answer, Missing};
use crate::generate::TrialTruth;
use crate::locate::Located;
use crate::names::class;
use crate::spec::Stratum;
use serde::Serialize;

/// An effect counts as visible when a stiff base leaves at least this many noise deviations (rms) of it. Below, the right
/// answer is silence.
pub const VISIBLE: f64 = 0.5;

/// Effects of which loops of one muscle show nothing or next to nothing: other means must.
const CONCEALED: [&str; 5] = ["tip-effect", "gravity", "contact-loss", "gauge-gain", "force-offset"];

/// What was said of a concealed effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Concealed {
    /// It is in the set, or the answer states that it could be there at its true size, unseen or within a check's bound.
    pub admitted: bool,
    /// And nothing more is to be done about it (it is named, or a check has bounded it at its true size), or the answer states what to do about
    /// this very effect: a recording that splits the set it is in, or what to measure.
    pub advised: bool,
}

/// A parameter as stated, and as it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Interval {
    /// Effect and parameter.
    pub of: String,
    /// The truth's size, SI.
    pub truth: f64,
    /// The size stated.
    pub stated: f64,
    /// Its standard deviation as stated.
    pub std: f64,
}

impl Interval {
    /// How many stated standard deviations it is off.
    pub fn z(&self) -> f64 {
        (self.stated - self.truth) / self.std
    }

    /// Whether the stated interval of 95 % holds the truth.
    pub fn holds(&self) -> bool {
        self.z().abs() <= 1.96
    }
}

/// What one trial showed.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Number in the set.
    pub id: usize,
    /// What the trial was for.
    pub stratum: Stratum,
    /// Its protocol.
    pub protocol: String,
    /// What was hidden: name and size in percent of blocked force.
    pub truth: Vec<(String, f64)>,
    /// Whether what was hidden can be seen at all through a stiff base.
    pub visible: bool,
    /// Largest size, percent.
    pub amplitude_pct: f64,
    /// The tool's verdict; `failed: …` when it gave none.
    pub verdict: String,
    /// What it named, most probable first, with probabilities.
    pub named: Vec<(String, f64)>,
    /// Its set: names and what they are confusable with.
    pub set: Vec<String>,
    /// The first name is one that was hidden.
    pub exact: bool,
    /// The first name is of the class of one that was hidden.
    pub class_right: bool,
    /// Every hidden effect is in the set.
    pub in_set: bool,
    /// Something was said to be wrong.
    pub alarmed: bool,
    /// How the stated region meets the true one; absent where none was stated.
    pub located: Option<Located>,
    /// For an effect of the concealed kind: what was said of it; absent for others.
    pub concealed: Option<Concealed>,
    /// Stated intervals of parameters whose truth is one number on both sides.
    pub intervals: Vec<Interval>,
    /// A recording was proposed.
    pub proposed: bool,
    /// Time of the answer, s.
    pub seconds: f64,
}

impl Outcome {
    /// What would be listed as a failure, and why.
    pub fn failure(&self) -> Option<&'static str> {
        if self.verdict.starts_with("failed") {
            return Some("no answer");
        }
        match self.stratum {
            Stratum::NullClean | Stratum::NullNasty => (!self.named.is_empty()).then_some("false alarm"),
            Stratum::Outside => {
                self.named.iter().any(|n| n.1 > 0.8).then_some("confident name outside the library")
            }
            _ if !self.visible => {
                (!self.named.is_empty() && !self.class_right).then_some("named an invisible effect")
            }
            _ if self.named.is_empty() => Some("not named"),
            _ if !self.class_right => Some("wrong class"),
            _ if !self.in_set => Some("truth not in set"),
            _ => None,
        }
    }
}

/// Judge an answer.
pub fn judge(
    truth: &TrialTruth,
    answer: &Result<Answer, String>,
    seconds: f64,
    located: Option<Located>,
) -> Outcome {
    let empty = Answer::default();
    let (a, verdict) = match answer {
        Ok(a) => (a, a.verdict.clone()),
        Err(e) => (&empty, format!("failed: {e}")),
    };
    let mut missing: Vec<&Missing> = a.missing.iter().collect();
    missing.sort_by(|x, y| y.probability.unwrap_or(0.0).total_cmp(&x.probability.unwrap_or(0.0)));
    let named: Vec<(String, f64)> =
        missing.iter().map(|m| (m.effect.clone(), m.probability.unwrap_or(0.0))).collect();
    let mut set: Vec<String> = named.iter().map(|n| n.0.clone()).collect();
    for m in &missing {
        for c in &m.confusable_with {
            if !set.contains(c) {
                set.push(c.clone());
            }
        }
    }
    let hidden: Vec<&str> = truth.effects.iter().map(|e| e.name.as_str()).collect();
    let first = named.first().map(|n| n.0.as_str());
    let tared = truth.protocol != "A";
    let visible = truth.effects.iter().any(|e| {
        // Tares show a zero error that no loop shows.
        let zero = tared && matches!(e.name.as_str(), "force-offset" | "gravity");
        e.left_stiff >= VISIBLE * truth.noise || zero && e.amplitude_pct > 0.3
    });
    Outcome {
        id: truth.id,
        stratum: truth.stratum,
        protocol: truth.protocol.clone(),
        truth: truth.effects.iter().map(|e| (e.name.clone(), e.amplitude_pct)).collect(),
        visible,
        amplitude_pct: truth.effects.iter().map(|e| e.amplitude_pct).fold(0.0, f64::max),
        exact: first.is_some_and(|f| hidden.contains(&f)),
        class_right: first.is_some_and(|f| hidden.iter().any(|h| class(h) == class(f))),
        in_set: !hidden.is_empty() && hidden.iter().all(|h| set.iter().any(|s| s == h)),
        alarmed: !named.is_empty()
            || matches!(a.verdict.as_str(), "unexplained" | "partly-explained" | "explained"),
        located,
        concealed: concealed(truth, a, &set),
        intervals: intervals(truth, &missing),
        proposed: a.next_experiment.as_ref().is_some_and(|n| !n.is_null()),
        verdict,
        named,
        set,
        seconds,
    }
}

fn concealed(truth: &TrialTruth, a: &Answer, set: &[String]) -> Option<Concealed> {
    let [effect] = &truth.effects[..] else { return None };
    if !CONCEALED.contains(&effect.name.as_str()) {
        return None;
    }
    let peak = 0.01 * effect.amplitude_pct * truth.blocked_force;
    let named = a.missing.iter().any(|m| m.effect == effect.name);
    let entry = a.considered.iter().find(|c| c.effect == effect.name);
    // Without a number the answer is: of any size.
    let hidden = entry.is_some_and(|c| c.hidden_up_to.is_none_or(|n| n >= 0.8 * peak));
    let in_set = set.contains(&effect.name);
    let admitted = in_set || hidden;
    let proposed = in_set && a.next_experiment.as_ref().is_some_and(|n| !n.is_null());
    let checked = entry.is_some_and(|c| c.checked);
    let measures = ["weigh", "photo", "gauge", "tare", "calliper", "dead weight", "vented", "held lengths"];
    let measure_named = entry.is_some_and(|c| measures.iter().any(|m| c.why_not.contains(m)));
    Some(Concealed { admitted, advised: admitted && (named || checked || proposed || measure_named) })
}

/// Effects whose parameter means the same on both sides.
const COMPARABLE: [&str; 13] = [
    "coulomb-friction",
    "viscous-damping",
    "end-slip",
    "leak",
    "force-offset",
    "gravity",
    "force-gain",
    "gauge-gain",
    "cross-talk",
    "rig-compliance",
    "backlash",
    "displacement-offset",
    "pressure-sensor-lag",
];

/// A true value as the tool's parameter of that name means it.
fn as_meant(effect: &str, value: f64) -> f64 {
    match effect {
        // The bench gives the leak as a part of the line's conductance; the part of the pressure that is lost is less.
        "leak" => value / (1.0 + value),
        // A gauge that reads (1 + g) of the truth has to be corrected by 1/(1 + g) − 1.
        "gauge-gain" => value / (1.0 + value),
        // The bench's joint bears softly on a tenth of its play at either side: what is free is the rest.
        "backlash" => 0.8 * value,
        _ => value,
    }
}

/// A value in the SI unit of its dimension, where the unit is known.
fn si(value: f64, unit: &str) -> Option<(f64, &'static str)> {
    let unit = unit.replace(['·', '⋅', '*'], " ").replace(['²', '^'], "2");
    Some(match unit.trim() {
        "N" => (value, "N"),
        "m" => (value, "m"),
        "mm" => (value * 1e-3, "m"),
        "um" | "µm" => (value * 1e-6, "m"),
        "s" => (value, "s"),
        "ms" => (value * 1e-3, "s"),
        "N s/m" => (value, "N s/m"),
        "N s/mm" => (value * 1e3, "N s/m"),
        "N/m" => (value, "N/m"),
        "N/mm" => (value * 1e3, "N/m"),
        "mm/N" => (1e3 / value, "N/m"),
        "m/N" => (1.0 / value, "N/m"),
        "N/Pa" | "m2" | "m22" => (value, "m2"),
        "N/kPa" => (value * 1e-3, "m2"),
        "N/MPa" => (value * 1e-6, "m2"),
        "mm2" | "mm22" => (value * 1e-6, "m2"),
        "" | "-" | "–" => (value, ""),
        "%" => (value * 1e-2, ""),
        _ => return None,
    })
}

fn intervals(truth: &TrialTruth, missing: &[&Missing]) -> Vec<Interval> {
    let mut compared = Vec::new();
    for effect in truth.effects.iter().filter(|e| COMPARABLE.contains(&e.name.as_str())) {
        let Some(m) = missing.iter().find(|m| m.effect == effect.name) else { continue };
        for p in &effect.parameters {
            let Some((want, dimension)) = si(as_meant(&effect.name, p.value), &p.unit) else { continue };
            let candidates: Vec<(f64, f64)> = m
                .parameters
                .iter()
                .filter_map(|v| {
                    let (value, d) = si(v.value?, &v.unit)?;
                    let std = v.std? * (value / v.value?).abs();
                    (d == dimension && std.is_finite() && std > 0.0).then_some((value, std))
                })
                .collect();
            if let [(value, std)] = candidates[..] {
                // Signs are a convention of the correction; sizes are compared.
                compared.push(Interval {
                    of: format!("{}: {}", effect.name, p.name),
                    truth: want.abs(),
                    stated: value.abs(),
                    std,
                });
            }
        }
    }
    compared
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_come_to_one_dimension() {
        assert_eq!(si(2.0, "N·s/mm"), Some((2000.0, "N s/m")));
        assert_eq!(si(5.0, "mm²").map(|s| s.1), Some("m2"));
        assert_eq!(si(1.0, "furlong"), None);
    }
}
