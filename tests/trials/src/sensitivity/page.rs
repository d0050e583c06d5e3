//! The page of the study.

use std::fmt::Write as _;

use pam_diagnose::criteria::{Criterion, PAGE, Stage};

use super::subjects::{Subject, UNREACHED};
use super::{GROUP, Row, Table};
use crate::ledger::Ledger;
use crate::rate::Rate;

/// A criterion as the page of criteria has it.
fn criterion(name: &str) -> Option<&'static Criterion> {
    PAGE.iter().flat_map(|s| s.criteria).find(|c| c.name == name)
}

/// The tables of all criteria that change an answer, those that change none, and those that have not been measured. Trials that were
/// not answered now keep their section of an earlier page.
pub(super) fn markdown(set: &Ledger, tables: &[Table], earlier: &str) -> String {
    let protocol = set.protocol.as_ref().map_or(String::new(), |p| format!(" --protocol {p}"));
    let mut m = format!(
        "# Sensitivity of the diagnosis to its criteria\n\n\
         Each [criterion](criteria.md) at half and at double its value, on the same trials of the virtual bench. Criteria of \
         comparisons with a reference are measured on pairs of campaigns, those of isometric campaigns on muscles at held length, all others on \
         force-stroke loops.\n\n\
         ```text\n\
         cargo run --release -p trials -- generate --set {} --n {}{protocol} --take {} -o SET\n\
         cargo run --release -p trials -- sensitivity SET -o DIR --page docs/src/sensitivity.md\n\
         ```\n\n\
         These commands wrote this page. Criteria are scaled in groups of {GROUP} at first. Where a group changes no answer, none of its \
         criteria is counted as changing one; this misses two that cancel each other. Where it changes one, the group is halved until \
         the criteria are found that change an answer alone. The sets are public, and the criteria were chosen with such sets: the tables show how \
         much depends on each of them, not how good they are.\n",
        set.set,
        set.drawn,
        set.truths.len()
    );
    for subject in Subject::ALL {
        match tables.iter().find(|t| t.subject == subject) {
            Some(table) => section(&mut m, table),
            None => m.push_str(section_of(earlier, subject)),
        }
    }
    let _ = writeln!(
        m,
        "\n{NOT_MEASURED}\n\n\
         Limits of computing time and sizes of arrays are not scaled. No trial here reaches these stages: {}. Doubled, `TABLE_ORDER` exceeds the \
         largest order of a table, and `KEPT_GAIN` exceeds one: no effect can be named then.",
        UNREACHED.map(|s| format!("\"{s}\"")).join(", ")
    );
    m
}

/// The last section.
const NOT_MEASURED: &str = "## Not in this study";

/// The section of some trials in an earlier page, with the line break before it; empty where the page has none.
fn section_of(page: &str, subject: Subject) -> &str {
    let Some(start) = page.find(&format!("\n## {}\n", subject.title())) else { return "" };
    let end = page[start + 1..].find("\n## ").map_or(page.len(), |n| start + 1 + n);
    &page[start..end]
}

fn section(m: &mut String, table: &Table) {
    let Table { subject, nominal, rows, open } = table;
    let rate = |k: usize, n: usize| Rate::new(k, n).to_string();
    let _ = write!(
        m,
        "\n## {}\n\n{}\n\n\
         With the criteria as they are: false alarms {}; class right {}; exact {}; wrong class {}; trials {}.\n\n\
         | criterion | value | false alarms at ½, ×2 | class right at ½, ×2 | exact at ½, ×2 | wrong class at ½, ×2 | answers changed at ½, ×2 |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
        subject.title(),
        subject.counted(),
        rate(nominal.false_alarms, nominal.nulls),
        rate(nominal.class_right, nominal.judged),
        rate(nominal.exact, nominal.judged),
        rate(nominal.wrong_class, nominal.judged),
        nominal.named.len()
    );
    let (mut moving, still): (Vec<_>, Vec<_>) =
        rows.iter().partition(|(half, double)| half.changed(nominal) + double.changed(nominal) > 0);
    moving.sort_by_key(|(half, double)| std::cmp::Reverse(half.changed(nominal) + double.changed(nominal)));
    for (half, double) in moving {
        let pair = |of: &dyn Fn(&Row) -> usize| format!("{}, {}", of(half), of(double));
        let _ = writeln!(
            m,
            "| `{}` | {} | {} | {} | {} | {} | {} |",
            half.criterion,
            criterion(&half.criterion).map_or("", |c| c.value),
            pair(&|r| r.false_alarms),
            pair(&|r| r.class_right),
            pair(&|r| r.exact),
            pair(&|r| r.wrong_class),
            pair(&|r| r.changed(nominal))
        );
    }
    let _ = writeln!(m, "\n{} of {} criteria measured change no answer.\n", still.len(), rows.len());
    m.push_str("| stage | without effect | not measured |\n| --- | --- | --- |\n");
    let names = |stage: &Stage, of: &dyn Fn(&str) -> bool| {
        let own = stage.criteria.iter().map(|c| c.name).filter(|name| of(name));
        own.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
    };
    for stage in PAGE {
        let without = names(&stage, &|name| still.iter().any(|(half, _)| half.criterion == name));
        let not_measured = names(&stage, &|name| open.iter().any(|o| o == name));
        if !(without.is_empty() && not_measured.is_empty()) {
            let _ = writeln!(m, "| {} | {without} | {not_measured} |", stage.title);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::row;
    use super::*;

    #[test]
    fn the_page_counts_changed_answers_and_lists_what_is_open() {
        let nominal = row("nominal", 1.0, ["leak", "inertia"]);
        let rows = [
            (row("ALPHA", 0.5, ["leak", "backlash"]), row("ALPHA", 2.0, ["leak", "inertia"])),
            (row("FAMILY_ALPHA", 0.5, ["leak", "inertia"]), row("FAMILY_ALPHA", 2.0, ["leak", "inertia"])),
        ];
        let set = Ledger {
            set: "dev".into(),
            seed_sha256: String::new(),
            truths: vec![String::new(); 2],
            drawn: 345,
            protocol: Some("A".into()),
            answers: Vec::new(),
            tool: String::new(),
            seconds: Vec::new(),
        };
        let table =
            Table { subject: Subject::Loops, nominal, rows: rows.into(), open: vec!["LEAST_SCORE".into()] };
        let page = markdown(&set, &[table], "");
        assert!(page.contains("generate --set dev --n 345 --protocol A --take 2 -o SET"), "{page}");
        assert!(page.contains("| `ALPHA` |  | 0, 0 | 1, 1 | 1, 1 | 0, 0 | 1, 0 |"), "{page}");
        assert!(page.contains("| `FAMILY_ALPHA` | `LEAST_SCORE` |"), "{page}");
        // Trials that are not answered again keep their section, byte for byte, between the others.
        let nominal = row("nominal", 1.0, ["leak", "inertia"]);
        let changes = Table { subject: Subject::Changes, nominal, rows: Vec::new(), open: Vec::new() };
        let both = markdown(&set, &[changes], &page);
        let kept = section_of(&both, Subject::Loops);
        assert_eq!(kept, section_of(&page, Subject::Loops));
        assert!(kept.contains("`ALPHA`") && both.contains("## Changes between two campaigns"), "{both}");
        assert_eq!(both.matches(NOT_MEASURED).count(), 1);
    }
}
