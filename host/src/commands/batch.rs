//! `host batch`: every muscle of a manifest, fitted and diagnosed.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use pam_data::error::{Error, Result};
use pam_data::pluralise::pluralise;
use pam_fleet::Shard;
use pam_fleet::batch::{self, Options, Summary, Task};
use pam_fleet::error::FleetCode;

use crate::console::{Console, name};
use crate::documents::{fleet, text};
use crate::progress::ProgressLine;

/// Failures that are printed; the others are counted.
const MOST_PRINTED: usize = 10;

/// Arguments of `host batch`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host batch fleet.csv -o results\n  \
    host batch fleet.parquet -o results --shard 3/64 --jobs 8 --json\n  \
    host batch fleet.csv -o results --only fit --reports --strict\n\n\
    The manifest (CSV or Parquet) has one row per muscle: muscle, description, files (several and patterns, separated by `;`), and \
    optionally reference, import, where, tags (key=value, separated by `;`). Other columns are tags. Paths are relative to the \
    manifest.\n\n\
    The results are Parquet tables, one folder per muscle: OUT/muscle=NAME/fits.parquet, tables.parquet, diagnoses.parquet, \
    failures.parquet, and the table file table.pam. A folder appears whole or not at all. A muscle whose results are there for the same \
    inputs, options and program is not computed again: after an interruption run the same command again.\n\n\
    Exit status: 0 when all muscles were processed, even if some failed: see `failures`. With --strict 1 if a muscle failed.")]
pub struct Arguments {
    /// One row per muscle, CSV or Parquet.
    #[arg(value_name = "MANIFEST")]
    manifest: PathBuf,
    /// The folder of the results.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Compute only this share of the muscles, such as 3/64. Shards can run at the same time, also into the same folder.
    #[arg(long, value_name = "i/n", default_value_t = Shard::WHOLE, hide_default_value = true)]
    shard: Shard,
    /// Muscles at a time; by default as many as there are cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Compute the table or the diagnosis alone.
    #[arg(long, value_enum, value_name = "TASK")]
    only: Option<Only>,
    /// Also write fit.html and diagnosis.html of each muscle.
    #[arg(long)]
    reports: bool,
    /// Order M of the elastic polynomial.
    #[arg(long, default_value_t = 4, value_name = "M", value_parser = clap::value_parser!(u8).range(1..=6))]
    order: u8,
    /// Shorten the load-bearing length by the rounded ends (L′ instead of L).
    #[arg(long)]
    tip_correction: bool,
    /// Exit with status 1 if a muscle failed.
    #[arg(long)]
    strict: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// What to compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Only {
    /// The table.
    Fit,
    /// The diagnosis.
    Diagnose,
}

impl Arguments {
    /// Runs the batch.
    ///
    /// # Errors
    /// A manifest that cannot be read, results that cannot be written, and with `--strict` a muscle that failed.
    pub fn run(self, console: &Console) -> Result<()> {
        let start = Instant::now();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let tool = format!("host {}", env!("CARGO_PKG_VERSION"));
        let options = Options {
            fit: pam_fit::Options {
                order: usize::from(self.order),
                tip_correction: self.tip_correction,
                ..pam_fit::Options::default()
            },
            task: match self.only {
                None => Task::Both,
                Some(Only::Fit) => Task::Fit,
                Some(Only::Diagnose) => Task::Diagnose,
            },
            reports: self.reports,
            shard: self.shard,
            jobs: self.jobs.map_or(cores, usize::from),
            tool: tool.clone(),
        };
        let progress = ProgressLine::new(console, "muscles");
        let summary = batch::run(&self.manifest, &self.output, &options, &progress)?;
        drop(progress);
        let seconds = start.elapsed().as_secs_f64();
        if self.json {
            console.result(text(&self.document(&tool, &summary, seconds))?);
        } else {
            self.print(console, &summary, seconds);
        }
        let failed = summary.counts.failed;
        if self.strict && failed > 0 {
            let cause =
                format!("{} of {} failed", failed, pluralise(summary.counts.muscles as usize, "muscle"));
            return Err(Error::new(FleetCode::FleetFailed, cause).file(&self.output));
        }
        Ok(())
    }

    fn document<'a>(&self, tool: &'a str, summary: &'a Summary, seconds: f64) -> fleet::Batch<'a> {
        let failure = |f: &'a batch::Listed| fleet::MuscleFailure {
            muscle: &f.muscle,
            stage: f.failure.stage.name(),
            code: &f.failure.code,
            cause: &f.failure.cause,
            place: &f.failure.place,
            remedy: &f.failure.remedy,
        };
        fleet::Batch {
            schema: "pam-batch/1",
            tool,
            manifest: self.manifest.display().to_string(),
            output: self.output.display().to_string(),
            shard: self.shard.to_string(),
            muscles: summary.counts.muscles,
            computed: summary.counts.computed,
            reused: summary.counts.reused,
            failed: summary.counts.failed,
            seconds,
            failures: summary.failures.iter().map(failure).collect(),
        }
    }

    fn print(&self, console: &Console, summary: &Summary, seconds: f64) {
        let counts = &summary.counts;
        console.result(format!(
            "{}: {} computed, {} reused, {} failed",
            pluralise(counts.muscles as usize, "muscle"),
            counts.computed,
            counts.reused,
            counts.failed
        ));
        console.detail(format!("done in {seconds:.1} s"));
        for listed in summary.failures.iter().take(MOST_PRINTED) {
            let failure = &listed.failure;
            let place =
                if failure.place.is_empty() { String::new() } else { format!(" ({})", failure.place) };
            console.warning(format!("{}: {}{place} [{}]", name(&listed.muscle), failure.cause, failure.code));
        }
        if summary.failures.len() > MOST_PRINTED {
            console.warning(format!(
                "{} more failures: read {}",
                summary.failures.len() - MOST_PRINTED,
                self.output.join("*/failures.parquet").display()
            ));
        }
    }
}
