//! `trials`: make sealed trials, have the tool answer them, open the seals and judge.

mod answer;
mod baselines;
mod clopper;
mod fitted;
mod generate;
mod inject;
mod ledger;
mod locate;
mod names;
mod report;
mod score;
mod semi;
mod spec;

use clap::{Parser, Subcommand};
use rayon::prelude::*;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Sealed trials of the diagnosis.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a set: trials/ID for the tool, sealed/ID for the judge, ledger.json with the seals' hashes.
    Generate {
        /// dev (public seed) or final (secret seed from the system, or --seed).
        #[arg(long, default_value = "dev")]
        set: String,
        /// How many trials; the mixture of the final set is kept.
        #[arg(long, default_value_t = 330)]
        n: usize,
        /// Seed instead of the set's own.
        #[arg(long)]
        seed: Option<u64>,
        /// Where to.
        #[arg(short, long)]
        output: PathBuf,
    },
    /// Ask `host diagnose` about every trial of a set, once, and freeze the answers.
    Answer {
        /// The set's directory.
        set: PathBuf,
        /// The tool.
        #[arg(long, default_value = "target/release/host")]
        host: PathBuf,
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
    },
    /// Put effects into the real recordings of the 10 mm fluidic muscle and ask what was put in.
    Semi {
        /// Directory that holds aarl-festo-10mm-2022.
        #[arg(long, default_value = "../shared/data")]
        data: PathBuf,
        /// Where to.
        #[arg(short, long)]
        output: PathBuf,
        /// The tool.
        #[arg(long, default_value = "target/release/host")]
        host: PathBuf,
    },
    /// Generate, answer and score in one go.
    Prove {
        /// dev or final.
        #[arg(long, default_value = "final")]
        set: String,
        /// How many trials.
        #[arg(long, default_value_t = 330)]
        n: usize,
        /// Seed instead of the set's own.
        #[arg(long)]
        seed: Option<u64>,
        /// Where to.
        #[arg(short, long)]
        output: PathBuf,
        /// The tool.
        #[arg(long, default_value = "target/release/host")]
        host: PathBuf,
        /// The short version: no held-out recordings, and fail where a wrong name was given to a clean null or, with
        /// confidence, to something outside the library, or where any answer is missing.
        #[arg(long)]
        check: bool,
    },
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Generate { set, n, seed, output } => generate(&set, n, seed, &output),
        Command::Answer { set, host } => answer::ask(&set, &host),
        Command::Score { set, host, no_held_out } => score(&set, &host, !no_held_out).map(|_| ()),
        Command::Semi { data, output, host } => semi::run(&data, &output, &host),
        Command::Prove { set, n, seed, output, host, check } => generate(&set, n, seed, &output)
            .and_then(|()| answer::ask(&output, &host))
            .and_then(|()| score(&output, &host, !check))
            .and_then(|all| if check { short(&all) } else { Ok(()) }),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("trials: {e}");
            ExitCode::FAILURE
        }
    }
}

/// The development set's seed is public.
const DEVELOPMENT: u64 = 20_261_121;

fn generate(set: &str, n: usize, seed: Option<u64>, output: &Path) -> Result<(), Box<dyn Error>> {
    let seed = match (seed, set) {
        (Some(s), _) => s,
        (None, "dev") => DEVELOPMENT,
        (None, "final") => ledger::secret_seed()?,
        (None, other) => return Err(format!("no set \"{other}\": take dev or final").into()),
    };
    let composition = if n == 330 { spec::Composition::FINAL } else { spec::Composition::scaled(n) };
    let specs = spec::draw(seed, composition);
    let start = std::time::Instant::now();
    ledger::write_set(output, set, seed, &specs)?;
    println!("{} trials in {} ({:.1} s)", specs.len(), output.display(), start.elapsed().as_secs_f64());
    Ok(())
}

fn score(set: &Path, host: &Path, held_out: bool) -> Result<Vec<report::Scored>, Box<dyn Error>> {
    let ledger = ledger::read_ledger(set)?;
    if ledger.answers.len() != ledger.truths.len() {
        return Err("the set has not been answered: seals stay closed until the answers are frozen".into());
    }
    let mut scored: Vec<report::Scored> = Vec::new();
    let mut truths = Vec::new();
    for id in 0..ledger.truths.len() {
        let answer = answer::frozen(set, &ledger, id)?;
        let truth = ledger::open(set, &ledger, id)?;
        let seconds = ledger.seconds.get(id).copied().unwrap_or(0.0);
        let located = answer.as_ref().ok().and_then(|a| locate::hit(set, id, &a.regions));
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
    let title =
        format!("Sealed trials: set \"{}\", {} trials, tool {}", ledger.set, truths.len(), ledger.tool);
    let text = report::markdown(&title, &scored, &baselines);
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
    match wrong.iter().find(|w| w.1 > 0) {
        Some((what, n)) => Err(format!("{n} {what}").into()),
        None => Ok(()),
    }
}
