//! How much the answers depend on each criterion: the trials of a development set, answered with one criterion scaled at a time.
//!
//! A release has its criteria as constants. The study builds the program once with `--cfg pam_study`, in which each run can scale one of
//! them (see `pam_data::criteria`). A study is continued where an earlier run stopped; the page lists what has not been measured, too.

use std::collections::BTreeSet;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use clap::Args;
use pam_diagnose::criteria::{Criterion, PAGE, Source};
use serde::{Deserialize, Serialize};

use crate::answer::{self, Asking};
use crate::figures::big_and_visible;
use crate::ledger::{self, Ledger};
use crate::rate::Rate;
use crate::score::{self, Outcome};

/// Scale criteria one by one and count false alarms, right classes and changed answers.
#[derive(Args)]
pub struct Study {
    /// A development set: its trials are answered again for each row of the table.
    set: PathBuf,
    /// Where to.
    #[arg(short, long)]
    output: PathBuf,
    /// These criteria only, in this order; all that decide a verdict otherwise.
    #[arg(long, value_name = "NAME")]
    criterion: Vec<String>,
    /// Longest time for one answer, s.
    #[arg(long, default_value_t = 300)]
    limit: u64,
    /// The program built earlier with `--cfg pam_study`; it is built in the output directory otherwise.
    #[arg(long)]
    host: Option<PathBuf>,
    /// Begin no further row after this many minutes; the same command continues later.
    #[arg(long)]
    minutes: Option<f64>,
    /// Write the table as this page of the book, too.
    #[arg(long)]
    page: Option<PathBuf>,
}

/// Each criterion at half and at double its value.
const FACTORS: [f64; 2] = [0.5, 2.0];

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

fn folder(criterion: &str, factor: f64) -> String {
    format!("{criterion}@{factor}")
}

/// Whether a factor is applied to it, and the trials can tell.
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

/// The environment in which the study's program scales one criterion. Its threads are left to the trials beside it.
fn environment(criterion: &str, factor: f64) -> Vec<(&'static str, String)> {
    let mut all = vec![("RAYON_NUM_THREADS", "1".to_owned())];
    if factor != 1.0 {
        all.push(("PAM_CRITERION", criterion.to_owned()));
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

/// One row of the table; read again where it has been measured.
fn measure(study: &Study, host: &Path, criterion: &str, factor: f64) -> Result<Row, Box<dyn Error>> {
    let dir = study.output.join(folder(criterion, factor));
    let kept = dir.join("row.json");
    if let Ok(text) = std::fs::read_to_string(&kept) {
        return Ok(serde_json::from_str(&text)?);
    }
    let start = Instant::now();
    share(&study.set, &dir)?;
    let limit = Duration::from_secs(study.limit);
    if ledger::read_ledger(&dir)?.answers.is_empty() {
        let environment = environment(criterion, factor);
        answer::ask(&dir, &Asking { host: host.to_owned(), limit, until: None, tables: false, environment })?;
    }
    let row = Row::of(criterion, factor, &outcomes(&dir)?);
    std::fs::write(&kept, serde_json::to_string_pretty(&row)?)?;
    println!(
        "{criterion} × {factor}: false alarms {} of {}, class right {} of {} ({:.0} s)",
        row.false_alarms,
        row.nulls,
        row.class_right,
        row.judged,
        start.elapsed().as_secs_f64()
    );
    Ok(row)
}

fn known(names: &[String]) -> Result<(), Box<dyn Error>> {
    let all: BTreeSet<&str> = PAGE.iter().flat_map(|s| s.criteria).map(|c| c.name).collect();
    match names.iter().find(|n| !all.contains(n.as_str())) {
        Some(n) => {
            Err(format!("no criterion `{n}`; `cargo run -p pam-diagnose --example criteria` lists them")
                .into())
        }
        None => Ok(()),
    }
}

/// A criterion as the page of criteria has it.
fn criterion(name: &str) -> Option<&'static Criterion> {
    PAGE.iter().flat_map(|s| s.criteria).find(|c| c.name == name)
}

/// The table of all criteria that change an answer, those that change none, and those that have not been measured.
fn markdown(nominal: &Row, rows: &[(Row, Row)], open: &[String]) -> String {
    let mut m = format!(
        "# Sensitivity of the diagnosis to its criteria\n\n\
         Each criterion of `host/diagnose/src/criteria` at half and at double its value, on the same trials of a development set of the \
         virtual bench. \"Class right\" counts visible effects of 2 % of the blocked force and more whose first name is of the right class. \
         \"Answers changed\" counts trials that name something else than with the criteria as they are.\n\n\
         ```text\n\
         cargo run --release -p trials -- generate --set dev --n {} -o SET\n\
         cargo run --release -p trials -- sensitivity SET -o DIR --page docs/src/sensitivity.md\n\
         ```\n\n\
         These commands wrote this page. The set is public, and the criteria were chosen with such sets: the table shows how much depends \
         on each of them, not how good they are.\n\n",
        nominal.named.len()
    );
    let rate = |k: usize, n: usize| Rate::new(k, n).to_string();
    let _ = writeln!(
        m,
        "With the criteria as they are: false alarms {}; class right {}; exact {}; wrong class {}; trials {}.\n",
        rate(nominal.false_alarms, nominal.nulls),
        rate(nominal.class_right, nominal.judged),
        rate(nominal.exact, nominal.judged),
        rate(nominal.wrong_class, nominal.judged),
        nominal.named.len()
    );
    m.push_str(
        "| criterion | value | false alarms at ½, ×2 | class right at ½, ×2 | exact at ½, ×2 | wrong class at ½, ×2 | answers changed at ½, ×2 |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
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
    let names = |of: Vec<&str>| of.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
    let still: Vec<&str> = still.iter().map(|(half, _)| half.criterion.as_str()).collect();
    let _ = writeln!(m, "\n{} of {} criteria measured change no answer.", still.len(), rows.len());
    for (what, of) in [("Without effect", still), ("Not measured", open.iter().map(String::as_str).collect())]
    {
        if !of.is_empty() {
            let _ = writeln!(m, "\n{what} ({}): {}.", of.len(), names(of));
        }
    }
    m.push_str(
        "\nNot in this study: limits of computing time, sizes of arrays, and the criteria of comparisons with a reference, of campaigns \
         over months, of isometric runs, of proposed recordings, of the health of a table on a controller, and of stocks. Loops of the virtual \
         bench do not reach them.\n",
    );
    m
}

/// Runs the study and writes `sensitivity.md`.
pub fn run(study: &Study) -> Result<(), Box<dyn Error>> {
    known(&study.criterion)?;
    let until = study.minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0)));
    std::fs::create_dir_all(&study.output)?;
    let host = study.host.clone().map_or_else(|| build(&study.output), Ok)?;
    let nominal = measure(study, &host, "nominal", 1.0)?;
    if ledger::read_ledger(&study.output.join(folder("nominal", 1.0)))?.tool != answer::version(&host) {
        return Err("this study was begun with another program; name that one with --host, or choose another output directory".into());
    }
    let mut wanted = study.criterion.clone();
    let rest = all_that_decide();
    wanted.extend(rest.into_iter().filter(|n| !study.criterion.contains(n)));
    let (mut rows, mut open) = (Vec::new(), Vec::new());
    for (i, name) in wanted.iter().enumerate() {
        let asked = study.criterion.is_empty() || i < study.criterion.len();
        let measured = FACTORS.iter().all(|f| study.output.join(folder(name, *f)).join("row.json").exists());
        if !measured && (!asked || until.is_some_and(|t| Instant::now() > t)) {
            open.push(name.clone());
            continue;
        }
        rows.push((measure(study, &host, name, FACTORS[0])?, measure(study, &host, name, FACTORS[1])?));
    }
    let page = markdown(&nominal, &rows, &open);
    std::fs::write(study.output.join("sensitivity.md"), &page)?;
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
        assert!(known(&["FAMILY_ALPHA".into()]).is_ok());
        assert!(known(&["FAMILY_BETA".into()]).is_err());
    }

    #[test]
    fn the_page_counts_changed_answers_and_lists_what_is_open() {
        let row = |criterion: &str, factor, named: [&str; 2]| Row {
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
        };
        let nominal = row("nominal", 1.0, ["leak", "inertia"]);
        let rows = [
            (row("ALPHA", 0.5, ["leak", "backlash"]), row("ALPHA", 2.0, ["leak", "inertia"])),
            (row("GAMMA", 0.5, ["leak", "inertia"]), row("GAMMA", 2.0, ["leak", "inertia"])),
        ];
        let page = markdown(&nominal, &rows, &["BETA".into()]);
        assert!(page.contains("| `ALPHA` |  | 0, 0 | 1, 1 | 1, 1 | 0, 0 | 1, 0 |"), "{page}");
        assert!(page.contains("Without effect (1): `GAMMA`.") && page.contains("(1): `BETA`."), "{page}");
    }
}
