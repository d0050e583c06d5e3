//! Opening the seals: the score of every answer, and the report.

use crate::figures::{Figures, Scored};
use crate::names::{SINGLES, class};
use crate::{answer, comparison, fitted, ledger, locate, report, score, second_round};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

/// Opens the seals of an answered set, scores every answer, and writes report.md and report.json.
pub fn score(set: &Path, host: &Path, held_out: bool) -> Result<Vec<Scored>, Box<dyn Error>> {
    let ledger = ledger::read_ledger(set)?;
    if ledger.answers.is_empty() {
        return Err("the set has not been answered: seals stay closed until the answers are frozen".into());
    }
    let mut scored: Vec<Scored> = Vec::new();
    let mut truths = Vec::new();
    for id in 0..ledger.answers.len() {
        let answer = answer::frozen(set, &ledger, id)?;
        let truth = ledger::open(set, &ledger, id)?;
        let seconds = ledger.seconds.get(id).copied().unwrap_or(0.0);
        let located = answer.as_ref().ok().and_then(|a| locate::judge(set, id, &a.regions));
        scored.push((score::judge(&truth, &answer, seconds, located), None));
        truths.push(truth);
    }
    if held_out {
        let tables: Vec<Result<fitted::HeldOut, String>> =
            truths.par_iter().map(|t| fitted::held_out(set, host, t)).collect();
        for (s, t) in scored.iter_mut().zip(tables) {
            match t {
                Ok(h) => s.1 = Some(h),
                Err(e) => eprintln!("trial {}: no held-out errors: {e}", s.0.id),
            }
        }
    }
    let comparison = comparison::compare(set, &truths, &scored);
    let drawn = ledger.drawn.max(ledger.truths.len());
    let share = if truths.len() < drawn { format!(" (the first of {drawn} drawn)") } else { String::new() };
    let title = format!(
        "Sealed trials: set \"{}\", {} trials{share}, tool {}",
        ledger.set,
        truths.len(),
        ledger.tool
    );
    let mut text = report::markdown(&title, &scored, &comparison);
    if let Some((process, tool, n)) = comparison.others.as_ref().and_then(|o| o.gains(&scored)) {
        let at = text.find("\n## Calibration").unwrap_or(text.len());
        let line = format!(
            "\nMedian held-out gain on the {n} single effects where a gain was possible: a Gaussian process over pressure, contraction, \
             direction and speed {process:.2}, this tool {tool:.2}. The process gives no names.\n"
        );
        text.insert_str(at, &line);
    }
    if let Some(second) = second_round::read(set) {
        let at = text.find("\n## Every failure").unwrap_or(text.len());
        text.insert_str(at, &second_round::markdown(&second));
    }
    std::fs::write(set.join("report.md"), &text)?;
    let every: Vec<&Scored> = scored.iter().collect();
    let per = |p: &str| Figures::of(&scored.iter().filter(|s| s.0.protocol == p).collect::<Vec<_>>());
    let json = serde_json::json!({
        "schema": "pam-trials/1",
        "set": ledger.set,
        "tool": ledger.tool,
        "classes": SINGLES.iter().map(|(effect, _)| (*effect, class(effect))).collect::<BTreeMap<_, _>>(),
        "all": Figures::of(&every),
        "A": per("A"),
        "D": per("D"),
        "C": per("C"),
        "trials": scored.iter().map(|(o, h)| serde_json::json!({ "outcome": o, "held_out": h })).collect::<Vec<_>>(),
    });
    std::fs::write(set.join("report.json"), serde_json::to_string_pretty(&json)?)?;
    let end = text.find("\n## Every failure").unwrap_or(text.len());
    println!("{}", &text[..end]);
    println!("Failures one by one: {}", set.join("report.md").display());
    Ok(scored)
}

/// The conditions of the short version.
pub fn check(all: &[Scored]) -> Result<(), Box<dyn Error>> {
    let f = Figures::of(&all.iter().collect::<Vec<_>>());
    let silent = all.iter().filter(|s| s.0.verdict.starts_with("failed")).count();
    let wrong = [
        ("clean nulls were given a name", f.false_alarms_clean.k),
        ("effects outside the library were named with confidence", f.outside_confident.k),
        ("campaigns got no answer", silent),
    ];
    if let Some((what, n)) = wrong.iter().find(|w| w.1 > 0) {
        return Err(format!("{n} {what}").into());
    }
    // No names at all would meet the conditions so far.
    let named = f.class_right_when_named;
    if f.class_right.k == 0 || 2 * named.k < named.n {
        return Err(
            format!("of the large visible effects that were named the class is right in {named}").into()
        );
    }
    Ok(())
}
