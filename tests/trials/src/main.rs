//! `trials`: make sealed trials, have the tool answer them, open the seals and judge.

mod again;
mod answer;
mod baselines;
mod campaign;
mod clopper;
mod festo;
mod festo_history;
mod fitted;
mod generate;
mod inject;
mod ledger;
mod limits;
mod locate;
mod names;
mod oracle;
mod progress;
mod queue;
mod reference;
mod report;
mod residuals;
mod score;
mod semi;
mod sensitivity;
mod sensors;
mod spec;
mod tool;

use clap::{Args, Parser, Subcommand};
use rayon::prelude::*;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Sealed trials of the diagnosis.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    /// Trials at a time.
    #[arg(long, global = true, default_value_t = 2)]
    jobs: usize,
    #[command(subcommand)]
    command: Command,
}

/// Which set.
#[derive(Args)]
struct Set {
    /// How many trials; the mixture of the final set is kept.
    #[arg(long, default_value_t = 330)]
    n: usize,
    /// Make and judge only this number of first trials: a stratified share, where time is short.
    #[arg(long)]
    take: Option<usize>,
    /// Seed instead of the set's own.
    #[arg(long)]
    seed: Option<u64>,
    /// Real recordings whose residuals half of the trials get as noise, where they are.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// Where to. What an earlier run has done there is gone on with.
    #[arg(short, long)]
    output: PathBuf,
}

/// How the tool is called.
#[derive(Args)]
struct Tool {
    /// The tool.
    #[arg(long, default_value = "target/release/host")]
    host: PathBuf,
    /// Longest time for one answer, s.
    #[arg(long, default_value_t = 120)]
    limit: u64,
    /// Begin no further trial after this many minutes; the same command continues later.
    #[arg(long)]
    minutes: Option<f64>,
}

impl Tool {
    fn asking(&self) -> answer::Asking {
        answer::Asking {
            host: self.host.clone(),
            limit: Duration::from_secs(self.limit),
            until: self.minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0))),
        }
    }
}

/// Options of the trials on the real recordings of the 10 mm fluidic muscle.
#[derive(Args)]
struct Real {
    /// Directory that holds aarl-festo-10mm-2021 and -2022.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// Where to.
    #[arg(short, long)]
    output: PathBuf,
    /// The tool.
    #[arg(long, default_value = "target/release/host")]
    host: PathBuf,
    /// Write the tables as this page of the book, too.
    #[arg(long)]
    page: Option<PathBuf>,
}

impl Real {
    /// Copies what was written to the page of the book, where one is requested.
    fn copy_to_book(&self, written: &str) -> Result<(), Box<dyn Error>> {
        if let Some(page) = &self.page {
            std::fs::copy(self.output.join(written), page)?;
        }
        Ok(())
    }
}

#[derive(Subcommand)]
enum Command {
    /// Make a set: trials/ID for the tool, sealed/ID for the judge, ledger.json with the seals' hashes.
    Generate {
        /// dev (public seed) or final (secret seed from the system, or --seed).
        #[arg(long, default_value = "dev")]
        set: String,
        #[command(flatten)]
        what: Set,
    },
    /// Ask `host diagnose` about every trial of a set, once, and freeze the answers; continues where it was interrupted.
    Answer {
        /// The set's directory.
        set: PathBuf,
        #[command(flatten)]
        tool: Tool,
    },
    /// Give the tool the hidden effects of an answered set, and evaluate the true structure, refitted, on held-out
    /// recordings: what gains are measured against.
    Oracle {
        /// The set's directory.
        set: PathBuf,
        #[command(flatten)]
        tool: Tool,
    },
    /// Open the seals of an answered set and write report.md and report.json.
    Score {
        /// The set's directory.
        set: PathBuf,
        /// The tool, for the errors on held-out recordings.
        #[arg(long, default_value = "target/release/host")]
        host: PathBuf,
        /// Leave the held-out recordings alone (quicker).
        #[arg(long)]
        no_held_out: bool,
        /// End the answering of a set of which a part only is answered, permanently, and judge that part.
        #[arg(long)]
        close: bool,
        /// Write the report as this page of the book, too.
        #[arg(long)]
        page: Option<PathBuf>,
    },
    /// The second round of an answered set: make the recordings that the tool proposed, and random ones of the menu, and ask again.
    Again {
        /// The set's directory.
        set: PathBuf,
        /// The tool.
        #[arg(long, default_value = "target/release/host")]
        host: PathBuf,
        /// Real recordings whose residuals half of the trials have as noise.
        #[arg(long, default_value = "../shared/data")]
        data: PathBuf,
        /// Begin no further trial after this many minutes; the same command continues later.
        #[arg(long)]
        minutes: Option<f64>,
    },
    /// Add effects to the real recordings of the 10 mm fluidic muscle and diagnose them.
    Semi(Real),
    /// Diagnose the real recordings of the 10 mm fluidic muscle as they are, and compare the answers with the published findings.
    Festo(Real),
    /// The same for settled points only: writes the section of the page on what the muscles remember.
    FestoHistory(Real),
    /// Answer a development set again with each criterion at half and at double its value.
    Sensitivity(sensitivity::Study),
    /// Spoil one recording of clean campaigns in every way that sensors and loggers fail, and count what is found.
    Sensors(sensors::Sensors),
    /// Diagnose changes: changes added to later runs of real recordings, untouched pairs, a cylinder whose seal was replaced.
    Reference(reference::Reference),
    /// Campaigns that choose their own steps, beside protocol C for the same time, a random menu, and the proposal of today.
    Campaign(campaign::Campaigns),
    /// Generate, answer and score in one go; each continues where an earlier run was interrupted.
    Prove {
        /// dev or final.
        #[arg(long, default_value = "final")]
        set: String,
        #[command(flatten)]
        what: Set,
        #[command(flatten)]
        tool: Tool,
        /// The short version: no held-out recordings, and fail where a wrong name was given to a clean null or, with
        /// confidence, to something outside the library, or where any answer is missing.
        #[arg(long)]
        check: bool,
    },
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    // A second pool cannot be made: this is the only call.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(cli.jobs.max(1)).build_global();
    let done = match cli.command {
        Command::Generate { set, what } => generate(&set, &what),
        Command::Answer { set, tool } => answer::ask(&set, &tool.asking()).map(|all| told(&set, all)),
        Command::Oracle { set, tool } => oracle::ask(&set, &tool.asking()).map(|all| {
            if !all {
                println!("not every trial has its oracle; `oracle` continues");
            }
        }),
        Command::Score { set, host, no_held_out, close, page } => {
            let closed = if close { answer::close(&set).map(|_| ()) } else { Ok(()) };
            closed.and_then(|()| score(&set, &host, !no_held_out)).and_then(|_| match &page {
                Some(page) => write_page(&set, page),
                None => Ok(()),
            })
        }
        Command::Again { set, host, data, minutes } => {
            let draw = |seed, set: &str, n| spec::draw(seed, set, composition(n));
            let until = minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0)));
            again::run(&set, &host, &residuals::Residuals::read(&data), until, draw)
        }
        Command::Semi(real) => {
            semi::run(&real.data, &real.output, &real.host).and_then(|()| real.copy_to_book("semi.md"))
        }
        Command::Festo(real) => {
            festo::run(&real.data, &real.output, &real.host).and_then(|()| real.copy_to_book("festo.md"))
        }
        Command::FestoHistory(real) => {
            festo::run_history(&real.data, &real.output, &real.host, real.page.as_deref())
        }
        Command::Campaign(what) => campaign::run(&what),
        Command::Sensitivity(study) => sensitivity::run(&study),
        Command::Sensors(what) => sensors::run(&what),
        Command::Reference(what) => reference::run(&what),
        Command::Prove { set, what, tool, check } => prove(&set, &what, &tool, check),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("trials: {e}");
            ExitCode::FAILURE
        }
    }
}

fn told(set: &Path, all: bool) {
    if !all {
        println!(
            "not every trial is answered; `answer` continues, `score --close {}` judges what there is",
            set.display()
        );
    }
}

fn prove(set: &str, what: &Set, tool: &Tool, check: bool) -> Result<(), Box<dyn Error>> {
    let output = &what.output;
    if !output.join("ledger.json").exists() {
        generate(set, what)?;
    }
    if ledger::read_ledger(output)?.answers.is_empty() && !answer::ask(output, &tool.asking())? {
        told(output, false);
        return Ok(());
    }
    if !check {
        oracle::ask(output, &tool.asking())?;
    }
    let all = score(output, &tool.host, !check)?;
    if check { short(&all) } else { Ok(()) }
}

/// The report as a page of the book: what it is, how it came about, and the whole of it.
fn write_page(set: &Path, page: &Path) -> Result<(), Box<dyn Error>> {
    let ledger = ledger::read_ledger(set)?;
    let report = std::fs::read_to_string(set.join("report.md"))?;
    let body = report.split_once('\n').map_or("", |(_, rest)| rest).replace("\n## ", "\n### ");
    let title = report.lines().next().unwrap_or("").trim_start_matches("# ");
    let text = format!(
        "# The proof: sealed trials\n\n\
         Muscles of a bench that shares no equation with the model conceal one effect of the catalogue, two, none, or something that no \
         name describes. Truths are sealed by their hashes before the tool runs, answers are frozen by theirs before a seal is \
         opened; the seed of the final set comes from the operating system. Half of the trials carry noise resampled from residuals of \
         real recordings, where these are. Protocol A is the classic one (ascending levels, one slow speed), D the extended one \
         (shuffled levels, one of them twice, three speeds, dwells, nested loops, tares). C is the complete one (more of each, tares \
         between levels, half an hour of rest, checks of the bench); `tests/trials/README.md` and `host/virtual-bench/src/campaigns.rs` describe \
         them in full.\n\n\
         ```text\n\
         cargo run --release -p trials -- prove -o DIR\n\
         cargo run --release -p trials -- oracle DIR\n\
         cargo run --release -p trials -- again DIR\n\
         python3 tests/trials/baselines.py DIR\n\
         cargo run --release -p trials -- score DIR --page docs/src/proof.md\n\
         ```\n\n\
         wrote this page; nothing on it is typed by hand. A trial's bound is the one that was set before the seed was drawn; what misses it \
         stands here as missed. Rates have exact 95 % intervals. An effect counts as visible where a base with one bladder for all \
         pressures leaves half a noise deviation of it; where it is not, silence is right. Held-out gain is \
         (plain − diagnosed)/(plain − oracle), rms errors on recordings at other pressures and speeds, where the oracle is the true \
         structure refitted: the same tool, told what is hidden (`host diagnose --with`) after the answers were frozen. It is taken over \
         visible effects of the muscle where the oracle takes a tenth of the plain error or more. Beside it stands the stricter figure \
         against a plain table of the same muscle without the effect, to which nothing is missing, and which no refit can pass; and what \
         the oracle itself reaches of that.\n\n\
         ## {title}\n\nSHA-256 of the seed: `{}`; the hashes of all truths and answers lie in the set's `ledger.json` (SHA-256 of \
         that file: `{}`).\n{body}",
        ledger.seed_sha256,
        ledger::sha256(&std::fs::read(set.join("ledger.json"))?),
    );
    std::fs::write(page, text)?;
    println!("{}", page.display());
    Ok(())
}

/// The development set's seed is public.
const DEVELOPMENT: u64 = 20_261_121;

fn composition(n: usize) -> spec::Composition {
    if n == 330 { spec::Composition::FINAL } else { spec::Composition::scaled(n) }
}

fn generate(set: &str, what: &Set) -> Result<(), Box<dyn Error>> {
    let output = &what.output;
    let seed = match (what.seed, set) {
        (Some(s), _) => s,
        (None, "dev") => DEVELOPMENT,
        // A final set that was begun keeps its seed.
        (None, "final") => ledger::begun(output).map_or_else(ledger::secret_seed, Ok)?,
        (None, other) => return Err(format!("no set \"{other}\": take dev or final").into()),
    };
    let mut specs = spec::draw(seed, set, composition(what.n));
    let drawn = specs.len();
    specs.truncate(what.take.unwrap_or(drawn).max(1));
    let residuals = residuals::Residuals::read(&what.data);
    if residuals.is_empty() {
        eprintln!("no real recordings in {}: all noise is synthetic", what.data.display());
    }
    let start = Instant::now();
    ledger::write_set(output, &ledger::Plan { set, seed, drawn, residuals: &residuals }, &specs)?;
    println!("{} trials in {} ({:.1} s)", specs.len(), output.display(), start.elapsed().as_secs_f64());
    Ok(())
}

fn score(set: &Path, host: &Path, held_out: bool) -> Result<Vec<report::Scored>, Box<dyn Error>> {
    let ledger = ledger::read_ledger(set)?;
    if ledger.answers.is_empty() {
        return Err("the set has not been answered: seals stay closed until the answers are frozen".into());
    }
    let mut scored: Vec<report::Scored> = Vec::new();
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
    let baselines = baselines::all(set, &truths, &scored)?;
    let drawn = ledger.drawn.max(ledger.truths.len());
    let share = if truths.len() < drawn { format!(" (the first of {drawn} drawn)") } else { String::new() };
    let title = format!(
        "Sealed trials: set \"{}\", {} trials{share}, tool {}",
        ledger.set,
        truths.len(),
        ledger.tool
    );
    let mut text = report::markdown(&title, &scored, &baselines);
    if let Some((process, tool, n)) = baselines::Others::read(set).and_then(|o| o.gains(&scored)) {
        let at = text.find("\n## Calibration").unwrap_or(text.len());
        let line = format!(
            "\nHeld-out gain on the {n} single effects where something could be gained, median: a Gaussian process over pressure, \
             contraction, direction and speed {process:.2}, this tool {tool:.2}. The process names nothing.\n"
        );
        text.insert_str(at, &line);
    }
    if let Some(second) = again::read(set) {
        let at = text.find("\n## Every failure").unwrap_or(text.len());
        text.insert_str(at, &again::markdown(&second));
    }
    std::fs::write(set.join("report.md"), &text)?;
    let every: Vec<&report::Scored> = scored.iter().collect();
    let per = |p: &str| report::Figures::of(&scored.iter().filter(|s| s.0.protocol == p).collect::<Vec<_>>());
    let json = serde_json::json!({
        "schema": "pam-trials/1",
        "set": ledger.set,
        "tool": ledger.tool,
        "all": report::Figures::of(&every),
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

/// What must hold in the short version, whatever else improves or not.
fn short(all: &[report::Scored]) -> Result<(), Box<dyn Error>> {
    let f = report::Figures::of(&all.iter().collect::<Vec<_>>());
    let silent = all.iter().filter(|s| s.0.verdict.starts_with("failed")).count();
    let wrong = [
        ("clean nulls were given a name", f.false_alarms_clean.k),
        ("effects outside the library were named with confidence", f.outside_confident.k),
        ("campaigns got no answer", silent),
    ];
    if let Some((what, n)) = wrong.iter().find(|w| w.1 > 0) {
        return Err(format!("{n} {what}").into());
    }
    // Silence alone is no proof.
    let named = f.class_right_when_named;
    if f.class_right.k == 0 || 2 * named.k < named.n {
        return Err(
            format!("of the large visible effects that were named the class is right in {named}").into()
        );
    }
    Ok(())
}
