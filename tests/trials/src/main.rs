//! `trials`: make sealed trials, have the tool answer them, open the seals and judge.

mod generate;
mod inject;
mod ledger;
mod names;
mod spec;

use clap::{Parser, Subcommand};
use std::error::Error;
use std::path::PathBuf;
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
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Generate { set, n, seed, output } => generate(&set, n, seed, &output),
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

fn generate(set: &str, n: usize, seed: Option<u64>, output: &std::path::Path) -> Result<(), Box<dyn Error>> {
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
