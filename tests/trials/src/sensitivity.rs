//! How much the answers depend on each criterion: the trials of a development set, answered with one criterion scaled at a time.
//!
//! A release has its criteria as constants. The study builds the program once with `--cfg pam_study`, in which each run can scale one or
//! several of them (see `pam_data::criteria`). A study is continued where an earlier run stopped; the page lists what has not been
//! measured, too.
//!
//! Few criteria change an answer. The study therefore screens them in groups (Dorfman 1943, doi:10.1214/aoms/1177731363): all criteria of
//! a group are scaled together, and a group that changes no answer is done. A group that changes one is halved until the criteria are
//! found that change an answer alone.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

pub mod ablation;
mod page;

use clap::Args;
use pam_diagnose::criteria::{Criterion, PAGE, Source};
use serde::{Deserialize, Serialize};

use crate::answer::{self, Asking};
use crate::figures::big_and_visible;
use crate::ledger::{self, Ledger};
use crate::score::{self, Outcome};

/// The trials that a study answers again and again, and the program that answers.
#[derive(Args)]
struct Answering {
    /// A development set: its trials are answered again for each row of the table.
    set: PathBuf,
    /// Where to; a study that was interrupted there is continued.
    #[arg(short, long)]
    output: PathBuf,
    /// Longest time for one answer, s.
    #[arg(long, default_value_t = 300)]
    limit: u64,
    /// The program built earlier with `--cfg pam_study`; it is built in the output directory otherwise.
    #[arg(long)]
    host: Option<PathBuf>,
}

/// Scale criteria one by one and count false alarms, right classes and changed answers.
#[derive(Args)]
pub struct Study {
    #[command(flatten)]
    answering: Answering,
    /// These criteria only, in this order, each alone; all that decide a verdict otherwise, in groups.
    #[arg(long, value_name = "NAME")]
    criterion: Vec<String>,
    /// Begin no further row after this many minutes; the same command continues later.
    #[arg(long)]
    minutes: Option<f64>,
    /// Write the table as this page of the book, too.
    #[arg(long, conflicts_with = "criterion")]
    page: Option<PathBuf>,
}

/// Without these answers there is nothing to compare with.
const UNMEASURED: &str = "the answers with the criteria as they are were not measured";

/// Each criterion at half and at double its value.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Criteria that are scaled together at first. About one in fifteen changes an answer; groups of about the square root of that cost least
/// (Dorfman), and halving them again favours somewhat larger ones.
const GROUP: usize = 8;

/// Stages whose criteria loops of the virtual bench do not reach: comparisons with a reference, campaigns over months, isometric
/// runs, proposals of recordings, the health of a table on a controller, stocks of muscles.
const OTHER_DATA: [&str; 7] = ["reference", "history", "timeline", "experiment", "valve", "health", "stock"];

/// What the trials showed with one criterion scaled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Row {
    criterion: String,
    factor: f64,
    false_alarms: usize,
    nulls: usize,
    class_right: usize,
    exact: usize,
    judged: usize,
    wrong_class: usize,
    unanswered: usize,
    /// What each trial named, in order of the trials.
    named: Vec<Vec<String>>,
}

impl Row {
    fn of(criterion: &str, factor: f64, outcomes: &[Outcome]) -> Self {
        let nulls = || {
            outcomes.iter().filter(|o| {
                matches!(o.stratum, crate::spec::Stratum::NullClean | crate::spec::Stratum::NullNasty)
            })
        };
        let judged = || outcomes.iter().filter(|o| big_and_visible(o));
        let names = |o: &Outcome| o.named.iter().map(|n| n.0.clone()).collect();
        Self {
            criterion: criterion.into(),
            factor,
            false_alarms: nulls().filter(|o| !o.named.is_empty()).count(),
            nulls: nulls().count(),
            class_right: judged().filter(|o| o.class_right).count(),
            exact: judged().filter(|o| o.exact).count(),
            judged: judged().count(),
            wrong_class: judged().filter(|o| !o.named.is_empty() && !o.class_right).count(),
            unanswered: outcomes.iter().filter(|o| o.verdict.starts_with("failed")).count(),
            named: outcomes.iter().map(names).collect(),
        }
    }

    /// Trials whose names differ from those of the criteria as they are.
    fn changed(&self, nominal: &Self) -> usize {
        self.named.iter().zip(&nominal.named).filter(|(a, b)| a != b).count()
    }
}

/// The folder of a run: its first criterion, and how many follow.
fn folder(group: &[String], factor: f64) -> String {
    match group {
        [] => "nominal".into(),
        [only] => format!("{only}@{factor}"),
        [first, others @ ..] => format!("{first}+{}@{factor}", others.len()),
    }
}

/// Whether a factor is applied to it, and the trials can show it.
fn decides(stage: &str, c: &Criterion) -> bool {
    let other = OTHER_DATA.iter().any(|s| stage.to_lowercase().contains(s));
    !other && c.source != Source::Cost && c.scalable
}

/// The last stages first: they turn evidence into names.
fn all_that_decide() -> Vec<String> {
    let of = |s: &'static pam_diagnose::criteria::Stage| {
        s.criteria.iter().filter(|c| decides(s.title, c)).map(|c| c.name.to_owned())
    };
    PAGE.iter().rev().flat_map(of).collect()
}

/// The program whose criteria can be scaled. The packages are those of the usual build, so that the features of dependencies agree.
fn build(output: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let target = output.join("build");
    let mut cargo = Command::new("cargo");
    cargo.args(["build", "--quiet", "--release", "--locked", "--workspace", "--bin", "host", "--target-dir"]);
    let flags = std::env::var("RUSTFLAGS").unwrap_or_default();
    cargo.arg(&target).env("RUSTFLAGS", format!("{flags} --cfg pam_study"));
    if !cargo.status()?.success() {
        return Err("the build for the study failed".into());
    }
    Ok(target.join("release/host"))
}

/// The environment in which the study's program scales criteria. Its threads are left to the trials beside it.
fn environment(group: &[String], factor: f64) -> Vec<(&'static str, String)> {
    let mut all = vec![("RAYON_NUM_THREADS", "1".to_owned())];
    if !group.is_empty() {
        all.push(("PAM_CRITERION", group.join(",")));
        all.push(("PAM_CRITERION_FACTOR", factor.to_string()));
    }
    all
}

/// A folder that shares the set's trials and truths and has answers of its own.
fn share(set: &Path, to: &Path) -> Result<(), Box<dyn Error>> {
    if to.join("ledger.json").exists() {
        return Ok(());
    }
    std::fs::create_dir_all(to)?;
    let set = set.canonicalize()?;
    for part in ["trials", "sealed"] {
        let link = to.join(part);
        if !link.exists() {
            std::os::unix::fs::symlink(set.join(part), link)?;
        }
    }
    let ledger = Ledger {
        answers: Vec::new(),
        tool: String::new(),
        seconds: Vec::new(),
        ..ledger::read_ledger(&set)?
    };
    ledger::write_ledger(to, &ledger)
}

fn outcomes(dir: &Path) -> Result<Vec<Outcome>, Box<dyn Error>> {
    let ledger = ledger::read_ledger(dir)?;
    (0..ledger.answers.len())
        .map(|id| {
            let answer = answer::frozen(dir, &ledger, id)?;
            Ok(score::judge(&ledger::open(dir, &ledger, id)?, &answer, 0.0, None))
        })
        .collect()
}

/// The rows that have been measured, and what has not been for lack of time.
struct Measurements<'a> {
    answering: &'a Answering,
    host: PathBuf,
    until: Option<Instant>,
}

impl<'a> Measurements<'a> {
    /// Begins or continues a study: measures the answers with the criteria as they are.
    fn begin(answering: &'a Answering) -> Result<(Self, Row), Box<dyn Error>> {
        std::fs::create_dir_all(&answering.output)?;
        let host = answering.host.clone().map_or_else(|| build(&answering.output), Ok)?;
        let measurements = Self { answering, host, until: None };
        let nominal = measurements.row(&[], 1.0)?.ok_or(UNMEASURED)?;
        let begun_with = ledger::read_ledger(&answering.output.join(folder(&[], 1.0)))?.tool;
        if begun_with != answer::version(&measurements.host) {
            return Err("this study was begun with another program; name that one with --host, or choose another output directory".into());
        }
        Ok((measurements, nominal))
    }

    /// The answers with a group of criteria scaled; read again where they have been measured. None where the time is over.
    fn row(&self, group: &[String], factor: f64) -> Result<Option<Row>, Box<dyn Error>> {
        let dir = self.answering.output.join(folder(group, factor));
        let label = if group.is_empty() { "nominal".to_owned() } else { group.join(",") };
        let kept = dir.join("row.json");
        if let Ok(text) = std::fs::read_to_string(&kept) {
            let row: Row = serde_json::from_str(&text)?;
            if row.criterion != label {
                return Err(format!(
                    "{} holds other criteria: choose another output directory",
                    dir.display()
                )
                .into());
            }
            return Ok(Some(row));
        }
        if self.until.is_some_and(|t| Instant::now() > t) {
            return Ok(None);
        }
        let start = Instant::now();
        share(&self.answering.set, &dir)?;
        if ledger::read_ledger(&dir)?.answers.is_empty() {
            let limit = Duration::from_secs(self.answering.limit);
            let environment = environment(group, factor);
            answer::ask(
                &dir,
                &Asking { host: self.host.clone(), limit, until: None, tables: false, environment },
            )?;
        }
        let row = Row::of(&label, factor, &outcomes(&dir)?);
        std::fs::write(&kept, serde_json::to_string_pretty(&row)?)?;
        println!(
            "{label} × {factor}: false alarms {} of {}, class right {} of {} ({:.0} s)",
            row.false_alarms,
            row.nulls,
            row.class_right,
            row.judged,
            start.elapsed().as_secs_f64()
        );
        Ok(Some(row))
    }

    /// A row for each criterion of a group. Where the group together changes no answer, each has the answers of the nominal row. None
    /// for what has not been measured.
    fn screen(
        &self,
        nominal: &Row,
        group: &[String],
        factor: f64,
    ) -> Result<Vec<Option<Row>>, Box<dyn Error>> {
        let Some(together) = self.row(group, factor)? else { return Ok(vec![None; group.len()]) };
        if together.changed(nominal) == 0 {
            let unchanged = |name: &String| Row { criterion: name.clone(), factor, ..nominal.clone() };
            return Ok(group.iter().map(|name| Some(unchanged(name))).collect());
        }
        if group.len() == 1 {
            return Ok(vec![Some(together)]);
        }
        let (first, second) = group.split_at(group.len() / 2);
        let mut rows = self.screen(nominal, first, factor)?;
        rows.extend(self.screen(nominal, second, factor)?);
        Ok(rows)
    }
}

fn check_names(names: &[String]) -> Result<(), Box<dyn Error>> {
    let all: BTreeSet<&str> = PAGE.iter().flat_map(|s| s.criteria).map(|c| c.name).collect();
    match names.iter().find(|n| !all.contains(n.as_str())) {
        Some(n) => {
            Err(format!("no criterion `{n}`; `cargo run -p pam-diagnose --example criteria` lists them")
                .into())
        }
        None => Ok(()),
    }
}

/// Runs the study and writes `sensitivity.md`.
pub fn run(study: &Study) -> Result<(), Box<dyn Error>> {
    check_names(&study.criterion)?;
    let until = study.minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0)));
    let (measurements, nominal) = Measurements::begin(&study.answering)?;
    let measurements = Measurements { until, ..measurements };
    let (names, size) = match study.criterion.as_slice() {
        [] => (all_that_decide(), GROUP),
        some => (some.to_vec(), 1),
    };
    let (mut rows, mut open) = (Vec::new(), Vec::new());
    for group in names.chunks(size) {
        let half = measurements.screen(&nominal, group, FACTORS[0])?;
        let double = measurements.screen(&nominal, group, FACTORS[1])?;
        for ((name, half), double) in group.iter().zip(half).zip(double) {
            match (half, double) {
                (Some(half), Some(double)) => rows.push((half, double)),
                _ => open.push(name.clone()),
            }
        }
    }
    let page = page::markdown(&ledger::read_ledger(&study.answering.set)?, &nominal, &rows, &open);
    std::fs::write(study.answering.output.join("sensitivity.md"), &page)?;
    if let Some(path) = &study.page {
        std::fs::write(path, &page)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_study_scales_criteria_that_decide_and_no_limit_of_time() {
        let all = all_that_decide();
        assert!(all.iter().any(|n| n == "FAMILY_ALPHA"), "{all:?}");
        assert!(!all.iter().any(|n| n == "MOST_REPORTED" || n == "NOISE_SAMPLES"), "{all:?}");
        assert!(check_names(&["FAMILY_ALPHA".into()]).is_ok());
        assert!(check_names(&["FAMILY_BETA".into()]).is_err());
    }

    pub(super) fn row(criterion: &str, factor: f64, named: [&str; 2]) -> Row {
        Row {
            criterion: criterion.into(),
            factor,
            false_alarms: 0,
            nulls: 1,
            class_right: 1,
            exact: 1,
            judged: 1,
            wrong_class: 0,
            unanswered: 0,
            named: named.iter().map(|n| vec![(*n).to_owned()]).collect(),
        }
    }

    #[test]
    fn a_group_that_changes_an_answer_is_halved_until_one_criterion_does() {
        let output = std::env::temp_dir().join(format!("sensitivity-{}", std::process::id()));
        let answering = Answering { set: PathBuf::new(), output: output.clone(), limit: 1, host: None };
        let nominal = row("nominal", 1.0, ["leak", "inertia"]);
        let names: Vec<String> = ["A", "B", "C", "D", "E", "F"].map(String::from).to_vec();
        let measured = |group: &[String], named| {
            let dir = answering.output.join(folder(group, 2.0));
            std::fs::create_dir_all(&dir).unwrap();
            let text = serde_json::to_string(&row(&group.join(","), 2.0, named)).unwrap();
            std::fs::write(dir.join("row.json"), text).unwrap();
        };
        let changed = ["leak", "backlash"];
        measured(&names[..4], changed);
        measured(&names[..2], ["leak", "inertia"]);
        measured(&names[2..4], changed);
        measured(&names[2..3], changed);
        // D and the group of E and F have not been measured, and the time is over.
        let measurements =
            Measurements { answering: &answering, host: PathBuf::new(), until: Some(Instant::now()) };
        let mut rows = measurements.screen(&nominal, &names[..4], 2.0).unwrap();
        rows.extend(measurements.screen(&nominal, &names[4..], 2.0).unwrap());
        let found: Vec<_> =
            rows.iter().map(|r| r.as_ref().map(|r| (r.criterion.as_str(), r.changed(&nominal)))).collect();
        assert_eq!(found, [Some(("A", 0)), Some(("B", 0)), Some(("C", 1)), None, None, None]);
        // Another grouping in the same directory is an error, and not read as this one.
        let others: Vec<String> = ["A", "C", "D", "E"].map(String::from).to_vec();
        assert!(measurements.screen(&nominal, &others, 2.0).is_err());
        std::fs::remove_dir_all(output).unwrap();
    }
}
