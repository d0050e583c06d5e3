//! The answers to the recordings of the 10 mm muscle beside the published description of these recordings.

use std::fmt::Write as _;

use serde_json::Value;

use crate::answer::Answer;
use crate::stock::StockAnswer;

/// A statement of the published description, and the answers that agree with it.
struct Published {
    what: &'static str,
    effects: &'static [&'static str],
    /// Effects that agree where a finding of the report shows one of them to be the cause.
    as_cause: &'static [&'static str],
    /// The kinds of documented findings that are about it.
    findings: &'static [&'static str],
    regions: &'static [&'static str],
    keywords: &'static [&'static str],
}

const PUBLISHED: [Published; 5] = [
    Published {
        what: "The first run of a mounting is low: the muscle runs in, and again whenever the mounting is changed",
        effects: &[
            "log-creep",
            "mullins-softening",
            "cyclic-softening",
            "permanent-set",
            "breakaway-friction",
        ],
        as_cause: &[],
        findings: &["first-run-deficit"],
        regions: &["recording", "cycle", "time"],
        keywords: &[],
    },
    Published {
        what: "At constant pressure and length the force creeps, and remembers earlier runs",
        effects: &["stress-relaxation", "log-creep", "permanent-set"],
        as_cause: &[],
        findings: &["creep"],
        regions: &["hold-time", "time"],
        keywords: &["at rest", "creep"],
    },
    Published {
        what: "A gap between filling and emptying that grows with contraction",
        effects: &[
            "friction-asymmetry",
            "coulomb-friction",
            "pressure-friction",
            "seal-friction",
            "presliding-hysteresis",
            "minor-loop-memory",
        ],
        as_cause: &["log-creep"],
        findings: &["filling-emptying-gap"],
        regions: &["direction", "contraction"],
        keywords: &[],
    },
    Published {
        what: "Ends that are not cylinders: the blocked force grows with the muscle's length",
        effects: &["tip-effect", "contact-loss", "braid-elasticity"],
        as_cause: &[],
        findings: &[],
        regions: &[],
        keywords: &["ends that are not"],
    },
    Published {
        what: "Mounted lengths by tape measure, to within a millimetre",
        effects: &["displacement-offset", "end-slip"],
        as_cause: &[],
        findings: &["slip"],
        regions: &["contraction"],
        keywords: &["mounting"],
    },
];

/// Paragraph on the published description, and the header of its table.
pub const COMPARISON: &str = "### Comparison with the published description\n\n\"Named\": one of the listed effects is named. \"In a set\": such an \
    effect is confusable with a named one. \"Located there\": the excess error is located on such a coordinate. \"Could be hidden\": such an \
    effect is possible at more than 1 % of the blocked force. \"Measured\": a finding of the report measures it, its interval excludes none, \
    and a named effect is its cause. The published description calls most of the run-in a creep that does not recover between runs, so \
    log-creep agrees with it. It gives no cause of the gap. There log-creep counts where it is named and a finding measures the gap and shows \
    that memory to be the cause; \"In a set\" counts friction that unseen runs do not exclude in its place, too. \"Named in the stock\": in the diagnosis of \
    all muscles together ([Muscles of one stock](stock.md)); an error of the mounted lengths counts where it lowers the error of left-out mountings by \
    35 % or more.\n\n\
    | published | effects that agree | named | in a set | measured, with its cause | located there | could be hidden | named in the stock |\n";

/// Compares the answers to all muscles, each with its label and its whole JSON, with the published description.
pub fn comparison(text: &mut String, diagnosed: &[(&str, &Answer, &Value)], stock: &StockAnswer) {
    let _ = writeln!(text, "\n{COMPARISON}| --- | --- | --- | --- | --- | --- | --- | --- |");
    for w in &PUBLISHED {
        let says = |name: &str| w.effects.contains(&name);
        let field = |f: &Value, name: &str| f.get(name).and_then(Value::as_str).unwrap_or("").to_owned();
        // Findings about it, with what they show to be the cause.
        let shown = |v: &Value| -> Vec<(String, Vec<String>)> {
            let findings = v.pointer("/history/findings").and_then(Value::as_array);
            let counts = |f: &&Value| {
                let found = f.get("found").and_then(Value::as_bool) == Some(true);
                found && w.findings.contains(&field(f, "kind").as_str()) && !field(f, "cause").is_empty()
            };
            let others = |f: &Value| {
                let all = f.get("alternatives").and_then(Value::as_array).into_iter().flatten();
                all.filter_map(|a| a.as_str().map(str::to_owned)).collect()
            };
            findings.into_iter().flatten().filter(counts).map(|f| (field(f, "cause"), others(f))).collect()
        };
        let is_cause = |effect: &str, v: &Value| {
            w.as_cause.contains(&effect) && shown(v).iter().any(|(cause, _)| cause == effect)
        };
        let who = |test: &dyn Fn(&Answer, &Value) -> bool| {
            let k = diagnosed.iter().filter(|(_, a, v)| test(a, v)).count();
            format!("{k} of {}", diagnosed.len())
        };
        let mut named = who(&|a, v| a.missing.iter().any(|m| says(&m.effect) || is_cause(&m.effect, v)));
        if !w.as_cause.is_empty() {
            let others = who(&|a, _| a.missing.iter().any(|m| says(&m.effect)));
            let _ = write!(named, " ({others} without {})", w.as_cause.join(", "));
        }
        let set = who(&|a, v| {
            let confusable = a.missing.iter().any(|m| m.confusable_with.iter().any(|c| says(c)));
            confusable || shown(v).iter().any(|(_, others)| others.iter().any(|o| says(o)))
        });
        let measured = who(&|_, v| !shown(v).is_empty());
        let placed = who(&|a, _| {
            let remarked = a.remarks.iter().any(|r| w.keywords.iter().any(|x| r.contains(x)));
            remarked || a.regions.iter().any(|r| w.regions.contains(&r.coordinate.as_str()))
        });
        let hidden = who(&|a, v| {
            let blocked = v.get("blocked_force_N").and_then(Value::as_f64).unwrap_or(f64::NAN);
            a.considered.iter().any(|c| says(&c.effect) && c.hidden_up_to.is_none_or(|n| n > 0.01 * blocked))
        });
        let in_stock = match stock.muscles_of(w.effects) {
            0 => "–".to_owned(),
            count => format!("{count} of {}", stock.muscles),
        };
        let _ = writeln!(
            text,
            "| {} | {} | {named} | {set} | {measured} | {placed} | {hidden} | {in_stock} |",
            w.what,
            [w.effects, w.as_cause].concat().join(", ")
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_description_is_compared_by_names_of_the_catalogue() {
        for name in PUBLISHED.iter().flat_map(|w| w.effects) {
            assert!(crate::names::owner(name).is_some(), "{name}");
        }
    }
}
