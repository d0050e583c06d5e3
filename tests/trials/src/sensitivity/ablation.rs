//! The diagnosis without one of its rules at a time: criteria are scaled so far that the rule holds always, or never.

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::subjects::Subject;
use super::{Answering, Measurements, Row, UNMEASURED, build, check_names};
use crate::ledger::{self, Ledger};
use crate::rate::Rate;

/// Leave each rule of the diagnosis out once, and count false alarms, right classes and changed answers.
#[derive(Args)]
pub struct Ablation {
    #[command(flatten)]
    answering: Answering,
    /// Write the table as this page of the book, too.
    #[arg(long)]
    page: Option<PathBuf>,
}

/// A rule that is left out.
struct Rule {
    /// What the rule does.
    what: &'static str,
    criteria: &'static [&'static str],
    factor: f64,
}

const RULES: [Rule; 15] = [
    rule("friction at rest is followed before effects are selected", &["FEWEST_MOVING_ROWS"], 1e3),
    rule(
        "rows at the beginning of a recording are set aside while their friction is unknown",
        &["BEGINNING_UNKNOWN"],
        1e6,
    ),
    rule("rows of correlated noise count as fewer independent rows", &["LONGEST_LAG"], 1e3),
    rule("an error of a law counts as few independent rows", &["SYSTEMATIC_ROWS"], 1e6),
    rule("laws are inexact", &["LAW_ERROR"], 1e-6),
    rule("a test by whole blocks and its family-wise probability", &["FAMILY_ALPHA"], 1e3),
    rule("the deviance falls by more than chance gives", &["LEAST_SCORE", "LEAST_SCORE_ALONE"], 1e-6),
    rule("errors of the base model itself select nothing", &["SELECTION_FLOOR"], 1e-6),
    rule("static effects are selected from a size on", &["STATIC_PEAK", "STATIC_MOVED"], 1e-6),
    rule("effects that the tables conceal are not selected", &["CONCEALED", "TWIN_OF_TABLES"], 1e-9),
    rule("a concealed effect that scores more keeps another from being selected", &["SHADOW"], 1e6),
    rule("the joint fit keeps what the single fit promised", &["KEPT_GAIN"], 1e-6),
    rule("a selected effect is exchanged for a better one", &["EXCHANGE_LEAVES"], 1e-6),
    rule("an effect lowers the error on held-out rows", &["HELD_OUT_LEAVES"], 1e6),
    rule("the interval of a size excludes zero", &["SIZE_ERRORS"], 1e-6),
];

const fn rule(what: &'static str, criteria: &'static [&'static str], factor: f64) -> Rule {
    Rule { what, criteria, factor }
}

/// Runs the ablation and writes `ablation.md`.
pub fn run(ablation: &Ablation) -> Result<(), Box<dyn Error>> {
    let answering = &ablation.answering;
    std::fs::create_dir_all(&answering.output)?;
    let programs = answering.programs.clone().map_or_else(|| build(&answering.output), Ok)?;
    let (measurements, nominal) = Measurements::begin(answering, Subject::Loops, &programs)?;
    let mut rows = Vec::new();
    for rule in &RULES {
        let group: Vec<String> = rule.criteria.iter().map(|c| (*c).to_owned()).collect();
        check_names(&group)?;
        rows.push((rule, measurements.row(&group, rule.factor)?.ok_or(UNMEASURED)?));
    }
    let page = markdown(&ledger::read_ledger(&answering.set)?, &nominal, &rows);
    std::fs::write(answering.output.join("ablation.md"), &page)?;
    if let Some(path) = &ablation.page {
        std::fs::write(path, &page)?;
    }
    Ok(())
}

fn markdown(set: &Ledger, nominal: &Row, rows: &[(&Rule, Row)]) -> String {
    let protocol = set.protocol.as_ref().map_or(String::new(), |p| format!(" --protocol {p}"));
    let mut m = format!(
        "# The diagnosis without one of its rules\n\n\
         Each rule of the diagnosis is left out once, on the same trials of a development set of the virtual bench. A rule is left out by scaling its \
         criteria so far that it holds always, or never. \"Class right\", \"exact\" and \"wrong class\" count visible effects of 2 % of the blocked \
         force and more. \"Answers changed\" counts trials that name something else than with all rules. The set is public, and the rules were \
         made with such sets.\n\n\
         ```text\n\
         cargo run --release -p trials -- generate --set {} --n {}{protocol} --take {} -o SET\n\
         cargo run --release -p trials -- ablation SET -o DIR --page docs/src/ablation.md\n\
         ```\n\n\
         These commands wrote this page.\n\n\
         | without the rule | criteria, factor | false alarms | class right | exact | wrong class | answers changed |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
        set.set,
        set.drawn,
        nominal.named.len()
    );
    let mut line = |what: &str, how: &str, row: &Row| {
        let rate = |k: usize, n: usize| Rate::new(k, n).to_string();
        let _ = writeln!(
            m,
            "| {what} | {how} | {} | {} | {} | {} | {} |",
            rate(row.false_alarms, row.nulls),
            rate(row.class_right, row.judged),
            rate(row.exact, row.judged),
            rate(row.wrong_class, row.judged),
            row.changed(nominal)
        );
    };
    line("**all rules**", "", nominal);
    for (rule, row) in rows {
        let names: Vec<String> = rule.criteria.iter().map(|c| format!("`{c}`")).collect();
        line(rule.what, &format!("{} × {:e}", names.join(", "), rule.factor), row);
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_left_out_by_criteria_that_a_study_can_scale() {
        let scalable: Vec<&str> = pam_diagnose::criteria::PAGE
            .iter()
            .flat_map(|s| s.criteria)
            .filter(|c| c.scalable)
            .map(|c| c.name)
            .collect();
        for name in RULES.iter().flat_map(|r| r.criteria) {
            assert!(scalable.contains(name), "{name}");
        }
    }
}
