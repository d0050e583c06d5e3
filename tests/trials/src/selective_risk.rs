//! Selective risk: how often answers are wrong, against how many trials are answered; and how reliable the probabilities of each class are.

use crate::names::{CLASSES, class};
use crate::rate::Rate;
use crate::score::Outcome;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Only names of at least this probability count as an answer.
const LEVELS: [f64; 7] = [0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95];

/// Trials in which an answer is one: everything with a hidden effect and everything without, as a name given to a null is an error, too.
fn answered<'a>(all: &[&'a Outcome], level: f64) -> Vec<&'a Outcome> {
    let sure = |o: &&&Outcome| o.named.first().is_some_and(|n| n.1 >= level);
    all.iter().filter(sure).copied().collect()
}

/// Both tables as Markdown.
pub fn write(m: &mut String, all: &[&Outcome]) {
    m.push_str(
        "\n## Selective risk: errors against answers\n\nAll trials, those without an effect included. An answer is a first name with at least \
         this probability.\n\n| probability | answered | first name wrong | its class wrong |\n| --- | --- | --- | --- |\n",
    );
    for level in LEVELS {
        let some = answered(all, level);
        let wrong = |right: fn(&Outcome) -> bool| Rate::of(some.iter().copied(), |o| !right(o));
        let _ = writeln!(
            m,
            "| ≥ {level} | {} | {} | {} |",
            Rate::new(some.len(), all.len()),
            wrong(|o| o.exact),
            wrong(|o| o.class_right)
        );
    }
    m.push_str(
        "\n## Reliability by class\n\nEvery name that was given, by its class.\n\n| class of the name | names | mean stated probability | \
         exact | class right |\n| --- | --- | --- | --- | --- |\n",
    );
    for (name, names) in by_class(all) {
        let n = names.len();
        let stated = names.iter().map(|s| s.probability).sum::<f64>() / n.max(1) as f64;
        let rate = |of: fn(&Stated) -> bool| Rate::new(names.iter().filter(|s| of(s)).count(), n);
        let _ = writeln!(
            m,
            "| {name} | {n} | {stated:.2} | {} | {} |",
            rate(|s| s.exact),
            rate(|s| s.class_right)
        );
    }
}

/// A name that was given.
struct Stated {
    probability: f64,
    exact: bool,
    class_right: bool,
}

/// Every name by its class: the registered classes first, in their order.
fn by_class<'a>(all: &[&'a Outcome]) -> Vec<(&'a str, Vec<Stated>)> {
    let mut by: BTreeMap<(usize, &str), Vec<Stated>> = BTreeMap::new();
    for o in all {
        for (name, p) in &o.named {
            let c = class(name);
            let place = CLASSES.iter().position(|r| r.0 == c).unwrap_or(CLASSES.len());
            by.entry((place, c)).or_default().push(Stated {
                probability: *p,
                exact: o.truth.iter().any(|t| t.0 == *name),
                class_right: o.truth.iter().any(|t| class(&t.0) == c),
            });
        }
    }
    by.into_iter().map(|(key, names)| (key.1, names)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Stratum;

    fn outcome(truth: &str, named: &[(&str, f64)]) -> Outcome {
        let first = named.first().map(|n| n.0);
        Outcome {
            id: 0,
            stratum: Stratum::Single,
            protocol: "A".into(),
            truth: vec![(truth.into(), 3.0)],
            visible: true,
            amplitude_pct: 3.0,
            verdict: "explained".into(),
            named: named.iter().map(|n| (n.0.into(), n.1)).collect(),
            set: Vec::new(),
            exact: first == Some(truth),
            class_right: first.is_some_and(|f| class(f) == class(truth)),
            in_set: true,
            alarmed: true,
            located: None,
            concealed: None,
            intervals: Vec::new(),
            proposed: false,
            seconds: 1.0,
        }
    }

    #[test]
    fn answers_below_the_threshold_do_not_count_and_errors_count_among_answers_only() {
        let outcomes = [
            outcome("gravity", &[("force-offset", 0.6)]),
            outcome("backlash", &[("backlash", 0.99)]),
            outcome("leak", &[("backlash", 0.4)]),
            outcome("leak", &[]),
        ];
        let all: Vec<&Outcome> = outcomes.iter().collect();
        let mut m = String::new();
        write(&mut m, &all);
        let line = |level: &str| {
            m.lines().find(|l| l.starts_with(&format!("| ≥ {level} |"))).unwrap_or("").to_owned()
        };
        assert!(line("0").contains("3 of 4") && line("0").contains("2 of 3") && line("0").contains("1 of 3"));
        assert!(
            line("0.5").contains("2 of 4")
                && line("0.5").contains("| 1 of 2")
                && line("0.5").contains("0 of 2")
        );
        assert!(line("0.9").contains("1 of 4") && line("0.9").contains("0 of 1"));
        let zero = m.lines().find(|l| l.starts_with("| zero |")).unwrap_or("");
        assert!(zero.contains("| 1 | 0.60 | 0 of 1") && zero.contains("1 of 1"), "{zero}");
        assert!(m.contains("| backlash | 2 |"));
    }
}
