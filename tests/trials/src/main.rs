//! `trials`: makes sealed trials, has the tool answer them, opens the seals and scores the answers.

mod answer;
mod baselines;
mod binomial_interval;
#[cfg(test)]
mod book;
mod campaign;
mod comparison;
mod festo;
mod festo_comparison;
mod festo_history;
mod festo_tables;
mod figures;
mod fitted;
mod generate;
mod held_length;
mod inject;
mod ledger;
mod limits;
mod locate;
mod maps;
mod martens;
mod names;
mod oracle;
mod paired_test;
mod processed;
mod progress;
mod proof_page;
mod queue;
mod rate;
mod reference;
mod reference_bench;
mod report;
mod residuals;
mod score;
mod scoring;
mod second_round;
mod selective_risk;
mod semi;
mod sensitivity;
mod sensors;
mod spec;
mod stock;
mod tool;

use clap::{Args, Parser, Subcommand};
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

/// Which set of which kind.
#[derive(Args)]
struct Kind {
    /// dev (public seed) or final (secret seed from the system, or --seed).
    #[arg(long = "set", default_value = "dev")]
    kind: String,
    #[command(flatten)]
    what: Set,
}

/// Which set.
#[derive(Args)]
struct Set {
    /// How many trials; the mixture of the final set is kept.
    #[arg(long, default_value_t = 345)]
    n: usize,
    /// Single effects and pairs of the set are these, in turn: names, or two names joined by +. For development.
    #[arg(long, value_delimiter = ',')]
    effects: Vec<String>,
    /// Only trials of this protocol.
    #[arg(long, value_parser = spec::PROTOCOLS)]
    protocol: Option<String>,
    /// Make and score only this number of first trials: a stratified share, where time is short.
    #[arg(long)]
    take: Option<usize>,
    /// Seed instead of the set's own.
    #[arg(long)]
    seed: Option<u64>,
    /// Real recordings whose residuals half of the trials get as noise, where they are.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// Directory of the set; an interrupted run there is continued.
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
            tables: true,
            environment: Vec::new(),
        }
    }
}

/// Options of the trials on the real recordings of the 10 mm fluidic muscle.
#[derive(Args)]
struct Real {
    /// Directory that holds aarl-festo-10mm-2021 and -2022.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// Directory of the results.
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
        /// dev (public seed), or with a secret seed from the system (or --seed): final; nulls (no effects); plays (backlash of 0.02 to
        /// 2 % of the stroke, alone and beside thermal softening).
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
    /// recordings: the reference of all gains.
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
        /// End the answers of an incomplete set permanently, and score those that exist.
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
    /// Diagnose the unchanged real recordings of the 10 mm fluidic muscle, and compare the answers with the published findings.
    Festo(Real),
    /// The same for settled points only: writes the section of the page on the memory of the bladder.
    FestoHistory(Real),
    /// Unseen runs of these recordings through the table only: writes that section of the page.
    FestoTables(Real),
    /// Diagnose the real sets of the 10 mm fluidic muscle as stocks, and predict unseen contractions and lengths with them.
    Stock(Real),
    /// Fit static force maps of commercial muscles and predict them between lengths and pressures, beside published models.
    Maps(Real),
    /// Answer a development set again with each criterion at half and at double its value.
    Sensitivity(sensitivity::Study),
    Ablation(sensitivity::ablation::Ablation),
    /// Spoil one recording of clean campaigns in every way that sensors and loggers fail, and count what is found.
    Sensors(sensors::Sensors),
    /// Diagnose clean recordings that were filtered, thinned, rounded or made noisy, and count false alarms.
    Processed(processed::Processed),
    /// Diagnose muscles of the virtual bench whose length was held, clean ones and with one effect.
    Held(held_length::Held),
    /// Diagnose changes: changes added to later runs of real recordings, untouched pairs, a cylinder whose seal was replaced.
    Reference(reference::Reference),
    /// Diagnose changes between two campaigns of the virtual bench, of which the later one has one effect: a sealed set.
    ReferenceBench(reference_bench::Options),
    /// Two simultaneous changes, and changes that begin within the later runs, added to real recordings.
    ReferenceFurther(reference::further::Further),
    /// Campaigns that choose their own steps, compared with protocol C for the same time, random steps, and single proposals.
    Campaign(campaign::Campaigns),
    /// Generate, answer and score; each step continues where an earlier run was interrupted.
    Prove {
        /// dev, final, nulls or plays.
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
        Command::Answer { set, tool } => {
            answer::ask(&set, &tool.asking()).map(|all| report_missing(&set, all))
        }
        Command::Oracle { set, tool } => oracle::ask(&set, &tool.asking()).map(|all| {
            if !all {
                println!("not every trial has its oracle; `oracle` continues");
            }
        }),
        Command::Score { set, host, no_held_out, close, page } => {
            let closed = if close { answer::close(&set).map(|_| ()) } else { Ok(()) };
            closed.and_then(|()| scoring::score(&set, &host, !no_held_out)).and_then(|_| match &page {
                Some(page) => proof_page::write(&set, page),
                None => Ok(()),
            })
        }
        Command::Again { set, host, data, minutes } => {
            let draw = |seed, set: &str, n| spec::draw(seed, set, spec::Composition::of(set, n));
            let until = minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0)));
            second_round::run(&set, &host, &residuals::Residuals::read(&data), until, draw)
        }
        Command::Semi(real) => {
            semi::run(&real.data, &real.output, &real.host).and_then(|()| real.copy_to_book("semi.md"))
        }
        Command::Festo(real) => {
            festo::run(&real.data, &real.output, &real.host).and_then(|()| real.copy_to_book("festo.md"))
        }
        Command::Stock(real) => {
            stock::run(&real.data, &real.output, &real.host).and_then(|()| real.copy_to_book("stock.md"))
        }
        Command::Maps(real) => {
            maps::run(&real.data, &real.output, &real.host).and_then(|()| real.copy_to_book("force-maps.md"))
        }
        Command::FestoHistory(real) => {
            festo::run_history(&real.data, &real.output, &real.host, real.page.as_deref())
        }
        Command::FestoTables(real) => festo::run_tables(&real.data, &real.output, real.page.as_deref()),
        Command::Campaign(what) => campaign::run(&what),
        Command::Sensitivity(study) => sensitivity::run(&study),
        Command::Ablation(ablation) => sensitivity::ablation::run(&ablation),
        Command::Sensors(what) => sensors::run(&what),
        Command::Processed(what) => processed::run(&what),
        Command::Held(what) => held_length::run(&what),
        Command::Reference(what) => reference::run(&what),
        Command::ReferenceFurther(what) => reference::further::run(&what),
        Command::ReferenceBench(what) => {
            let specs = specs(&what.set.kind, &what.set.what);
            specs.and_then(|(seed, _, specs)| reference_bench::run(&what, seed, specs))
        }
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

fn report_missing(set: &Path, all: bool) {
    if !all {
        println!(
            "not every trial is answered; `answer` continues, `score --close {}` scores the existing answers",
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
        report_missing(output, false);
        return Ok(());
    }
    if !check {
        oracle::ask(output, &tool.asking())?;
    }
    let all = scoring::score(output, &tool.host, !check)?;
    if check { scoring::check(&all) } else { Ok(()) }
}

/// The development set's seed is public.
const DEVELOPMENT: u64 = 20_261_121;

/// The seed of a set, its size, and those of its trials that are taken.
fn specs(set: &str, what: &Set) -> Result<(u64, usize, Vec<spec::Spec>), Box<dyn Error>> {
    let output = &what.output;
    let seed = match (what.seed, set) {
        (Some(s), _) => s,
        (None, "dev") => DEVELOPMENT,
        // A final set that was begun keeps its seed.
        (None, "final" | "nulls" | "plays") => ledger::begun(output).map_or_else(ledger::secret_seed, Ok)?,
        (None, other) => return Err(format!("no set \"{other}\": take dev, final, nulls or plays").into()),
    };
    let composition = spec::Composition::of(set, what.n);
    let mut specs = if what.effects.is_empty() {
        spec::draw(seed, set, composition)
    } else {
        spec::draw_of(seed, set, what.n, &spec::effects_by_name(&what.effects)?)
    };
    let drawn = specs.len();
    if let Some(only) = &what.protocol {
        specs.retain(|s| s.protocol == only);
        specs.iter_mut().enumerate().for_each(|(id, s)| s.id = id);
    }
    specs.truncate(what.take.unwrap_or(drawn).max(1));
    Ok((seed, drawn, specs))
}

fn generate(set: &str, what: &Set) -> Result<(), Box<dyn Error>> {
    let output = &what.output;
    let (seed, drawn, specs) = specs(set, what)?;
    let residuals = residuals::Residuals::read(&what.data);
    if residuals.is_empty() {
        eprintln!("no real recordings in {}: all noise is synthetic", what.data.display());
    }
    let start = Instant::now();
    ledger::write_set(
        output,
        &ledger::Plan { set, seed, drawn, protocol: what.protocol.as_deref(), residuals: &residuals },
        &specs,
    )?;
    println!("{} trials in {} ({:.1} s)", specs.len(), output.display(), start.elapsed().as_secs_f64());
    Ok(())
}
