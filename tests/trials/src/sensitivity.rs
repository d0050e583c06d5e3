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
mod subjects;

use clap::Args;
use pam_diagnose::criteria::{Criterion, PAGE, Source};
use serde::{Deserialize, Serialize};

use crate::answer;
use crate::ledger;
use subjects::Subject;

/// The trials that a study answers again and again, and the programs that answer.
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
    /// The directory with `host` and `trials` built earlier with `--cfg pam_study`; they are built in the output directory otherwise.
    #[arg(long)]
    programs: Option<PathBuf>,
}

/// Scale criteria one by one and count false alarms, right classes and changed answers.
#[derive(Args)]
pub struct Study {
    #[command(flatten)]
    answering: Answering,
    /// These criteria only, in this order, each alone; all that decide a verdict otherwise, in groups.
    #[arg(long, value_name = "NAME")]
    criterion: Vec<String>,
    /// Only these trials; the page keeps its sections of the others.
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Subject>,
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

/// The counts of some trials with one criterion scaled.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// The program that answered.
    #[serde(default)]
    tool: String,
}

impl Row {
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
fn decides(subject: Subject, stage: &str, c: &Criterion) -> bool {
    subject.reaches(stage) && c.source != Source::Cost && c.scalable
}

/// The last stages first: they turn evidence into names.
fn all_that_decide(subject: Subject) -> Vec<String> {
    let of = |s: &'static pam_diagnose::criteria::Stage| {
        s.criteria.iter().filter(move |c| decides(subject, s.title, c)).map(|c| c.name.to_owned())
    };
    PAGE.iter().rev().flat_map(of).collect()
}

/// Builds the programs whose criteria can be scaled. The packages are those of the usual build, so that the features of dependencies agree.
fn build(output: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let target = output.join("build");
    let mut cargo = Command::new("cargo");
    cargo.args([
        "build",
        "--quiet",
        "--release",
        "--locked",
        "--workspace",
        "--bin",
        "host",
        "--bin",
        "trials",
        "--target-dir",
    ]);
    let flags = std::env::var("RUSTFLAGS").unwrap_or_default();
    cargo.arg(&target).env("RUSTFLAGS", format!("{flags} --cfg pam_study"));
    if !cargo.status()?.success() {
        return Err("the build for the study failed".into());
    }
    Ok(target.join("release"))
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

/// The rows that have been measured, and what has not been for lack of time.
struct Measurements<'a> {
    answering: &'a Answering,
    subject: Subject,
    /// Directory of `host` and `trials`, built with `--cfg pam_study`.
    programs: PathBuf,
    until: Option<Instant>,
}

impl<'a> Measurements<'a> {
    /// Begins or continues a study of some trials: measures the answers with the criteria as they are.
    fn begin(
        answering: &'a Answering,
        subject: Subject,
        programs: &Path,
    ) -> Result<(Self, Row), Box<dyn Error>> {
        let measurements = Self { answering, subject, programs: programs.into(), until: None };
        let nominal = measurements.row(&[], 1.0)?.ok_or(UNMEASURED)?;
        if nominal.tool != answer::version(&programs.join("host")) {
            return Err("this study was begun with another program; name its directory with --programs, or choose another output directory".into());
        }
        Ok((measurements, nominal))
    }

    /// The answers with a group of criteria scaled; read again where they have been measured. None where the time is over.
    fn row(&self, group: &[String], factor: f64) -> Result<Option<Row>, Box<dyn Error>> {
        let dir = self.answering.output.join(self.subject.folder()).join(folder(group, factor));
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
        let answered = self.subject.answer(self, &dir, &environment(group, factor))?;
        let tool = answer::version(&self.programs.join("host"));
        let row = Row { criterion: label.clone(), factor, tool, ..answered };
        std::fs::write(&kept, serde_json::to_string_pretty(&row)?)?;
        println!(
            "{}: {label} × {factor}: false alarms {} of {}, class right {} of {} ({:.0} s)",
            self.subject.folder(),
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

/// The rows of some trials.
struct Table {
    subject: Subject,
    nominal: Row,
    /// Each criterion at half and at double its value.
    rows: Vec<(Row, Row)>,
    /// Criteria that have not been measured.
    open: Vec<String>,
}

impl Study {
    fn table(
        &self,
        subject: Subject,
        programs: &Path,
        until: Option<Instant>,
    ) -> Result<Table, Box<dyn Error>> {
        let (measurements, nominal) = Measurements::begin(&self.answering, subject, programs)?;
        let measurements = Measurements { until, ..measurements };
        let all = all_that_decide(subject);
        let (names, size) = match self.criterion.as_slice() {
            [] => (all, GROUP),
            some => (some.iter().filter(|c| all.contains(c)).cloned().collect(), 1),
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
        Ok(Table { subject, nominal, rows, open })
    }
}

/// Runs the study and writes `sensitivity.md`.
pub fn run(study: &Study) -> Result<(), Box<dyn Error>> {
    check_names(&study.criterion)?;
    let until = study.minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0)));
    let answering = &study.answering;
    std::fs::create_dir_all(&answering.output)?;
    let programs = answering.programs.clone().map_or_else(|| build(&answering.output), Ok)?;
    let wanted = |s: &Subject| study.only.is_empty() || study.only.contains(s);
    let tables: Result<Vec<Table>, _> = Subject::ALL
        .into_iter()
        .filter(wanted)
        .map(|subject| study.table(subject, &programs, until))
        .collect();
    let (set, tables) = (ledger::read_ledger(&answering.set)?, tables?);
    std::fs::write(answering.output.join("sensitivity.md"), page::markdown(&set, &tables, ""))?;
    if let Some(path) = &study.page {
        let earlier = std::fs::read_to_string(path).unwrap_or_default();
        std::fs::write(path, page::markdown(&set, &tables, &earlier))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_study_scales_criteria_that_decide_and_no_limit_of_time() {
        let all = all_that_decide(Subject::Loops);
        assert!(all.iter().any(|n| n == "FAMILY_ALPHA"), "{all:?}");
        assert!(!all.iter().any(|n| n == "MOST_REPORTED" || n == "NOISE_SAMPLES"), "{all:?}");
        assert!(all_that_decide(Subject::Changes).iter().any(|n| n == "PRIOR_NONE"));
        assert!(all_that_decide(Subject::HeldLengths).iter().any(|n| n == "STAIRCASE_TURN"));
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
            tool: String::new(),
            named: named.iter().map(|n| vec![(*n).to_owned()]).collect(),
        }
    }

    #[test]
    fn a_group_that_changes_an_answer_is_halved_until_one_criterion_does() {
        let output = std::env::temp_dir().join(format!("sensitivity-{}", std::process::id()));
        let answering = Answering { set: PathBuf::new(), output: output.clone(), limit: 1, programs: None };
        let nominal = row("nominal", 1.0, ["leak", "inertia"]);
        let names: Vec<String> = ["A", "B", "C", "D", "E", "F"].map(String::from).to_vec();
        let measured = |group: &[String], named| {
            let dir = answering.output.join(Subject::Loops.folder()).join(folder(group, 2.0));
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
        let measurements = Measurements {
            answering: &answering,
            subject: Subject::Loops,
            programs: PathBuf::new(),
            until: Some(Instant::now()),
        };
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
