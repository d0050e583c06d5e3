//! `host fit`: recordings to a table.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::recordings::Recordings;
use super::reports::{self, Reports};
use crate::console::Console;
use crate::documents::text;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{FolderLock, to_standard_output, write_whole};
use pam_data::pluralise::pluralise;
use pam_fit::{Options, Summary, fit_with_progress};

use crate::progress::ProgressLine;
use pam_data::recording::Reader;
use pam_fit::error::FitCode;
use pam_fit::table_file::{self, TableFile};
use pam_report::fit_page;

/// Arguments of `host fit`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host fit --muscle mini.toml loops/*.csv -o mini.pam --report mini.html\n  \
    host fit --muscle festo.toml --import bench.toml run*.csv -o festo.pam\n\n\
    Recordings: CSV or tab-separated text (also .gz and .zst), Parquet, MATLAB or HDF5, whose column names end in \
    their unit (time_s, pressure_kPa, displacement_mm, force_N); other forms need --import.")]
pub struct Arguments {
    /// The muscle's description.
    #[arg(long, value_name = "MUSCLE.toml")]
    muscle: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// Where to write the table.
    #[arg(short, long, value_name = "TABLE.pam")]
    output: Option<PathBuf>,
    /// Write the results as JSON to a file; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    reports: Reports,
    /// Order M of the elastic polynomial.
    #[arg(long, default_value_t = 4, value_name = "M", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(1..=6))]
    order: u8,
    /// Shorten the load-bearing length by the rounded ends (L′ instead of L).
    #[arg(long)]
    tip_correction: bool,
    /// Weight of the penalty on curvature over pressure; by default chosen by cross-validation over pressures.
    #[arg(long, value_name = "WEIGHT", allow_negative_numbers = true)]
    smoothing: Option<f64>,
    /// Fit effective dimensions (braid angle, bladder diameter, wall) too, within bounds.
    #[arg(long)]
    fit_geometry: bool,
    /// Correct the length of every mounting (a stroke held through whole recordings) by up to 1 mm.
    #[arg(long)]
    fit_lengths: bool,
    /// Keep the described dimensions and lengths, also where recordings at held lengths require others.
    #[arg(long, conflicts_with_all = ["fit_geometry", "fit_lengths"])]
    as_described: bool,
    /// Write the table even if it is useless for control (negative P0 or friction, a large error, an inverse that fails).
    #[arg(long)]
    force: bool,
    /// Constrain the bladder's stress to rise with strain, and report the error with and without.
    #[arg(long)]
    physical: bool,
}

impl Arguments {
    /// Reads, fits, writes.
    ///
    /// # Errors
    /// What is wrong with the input, or an output that cannot be written.
    pub fn run(self, console: &Console) -> Result<()> {
        self.check_smoothing()?;
        let table = ("-o", self.output.as_deref());
        to_standard_output(&[table, ("--json", self.json.as_deref()), ("--report", self.reports.file())])?;
        let start = Instant::now();
        let muscle = MuscleDescription::read(&self.muscle)?;
        // With JSON the caller is a program.
        let watched = if self.json.is_some() { Console::silent() } else { console.clone() };
        let (campaign, hashes) = self.recordings.read_hashed(Reader::of(&muscle), &watched)?;
        console.detail(format!(
            "read {} in {:.3} s",
            pluralise(campaign.samples(), "row"),
            start.elapsed().as_secs_f64()
        ));
        let started = Instant::now();
        let options = self.options();
        let progress = ProgressLine::new(&watched, "fitting");
        let fitted = fit_with_progress(&campaign, &muscle, &options, &progress)?;
        drop(progress);
        console.detail(format!("fitted in {:.3} s", started.elapsed().as_secs_f64()));
        let from = reports::provenance().muscle(&muscle).files(&self.recordings.files, &hashes);
        let mut table = fitted.table_file(format!("host {}", env!("CARGO_PKG_VERSION")));
        table.about.date = date::now_utc();
        table.about.sources = table_file::sources(&campaign, &self.recordings.files, hashes);
        let _lock = FolderLock::of([
            self.output.as_deref(),
            self.json.as_deref(),
            self.reports.file(),
            self.reports.figures.as_deref(),
        ])?;
        self.write(&table, &fitted.summary)?;
        self.reports.write(console, &from, || fit_page::page(&fitted, &campaign, &options))?;
        for warning in &fitted.summary.warnings {
            console.warning(warning);
        }
        if self.json.as_deref() != Some(Path::new("-")) {
            console.note(fitted.summary.to_string());
            let written = self.output.as_ref().filter(|_| self.writes(&fitted.summary));
            if let Some(path) = written.filter(|path| *path != Path::new("-")) {
                console.note(format!("wrote {}", path.display()));
            }
        }
        console.detail(format!("done in {:.3} s", start.elapsed().as_secs_f64()));
        self.judge(&fitted.summary.faults, console)
    }

    fn check_smoothing(&self) -> Result<()> {
        match self.smoothing {
            Some(weight) if !(weight.is_finite() && weight >= 0.0) => {
                Err(Error::new(DataCode::CallInvalid, "a smoothing weight must be a number from 0 up")
                    .value(weight.to_string())
                    .help("1e-3 allows much curvature, 10 is nearly straight; without the option it is chosen automatically"))
            }
            _ => Ok(()),
        }
    }

    fn options(&self) -> Options {
        Options {
            order: usize::from(self.order),
            tip_correction: self.tip_correction,
            smoothing: self.smoothing,
            fit_geometry: self.fit_geometry,
            fit_lengths: self.fit_lengths,
            physical: self.physical,
            as_described: self.as_described,
        }
    }

    /// Writes the table, unless it is useless for control and not forced, and the figures.
    fn write(&self, table: &TableFile, summary: &Summary) -> Result<()> {
        let json = text(summary)?;
        if let Some(path) = self.output.as_ref().filter(|_| self.writes(summary)) {
            table.write(path)?;
        }
        match &self.json {
            Some(path) => write_whole(path, format!("{json}\n").as_bytes()),
            None => Ok(()),
        }
    }

    /// Whether a table with these faults is written.
    fn writes(&self, summary: &Summary) -> bool {
        summary.faults.is_empty() || self.force
    }

    /// A table with faults is an error, or a warning with `--force`.
    fn judge(&self, faults: &[String], console: &Console) -> Result<()> {
        if faults.is_empty() {
            return Ok(());
        }
        if self.force {
            console.warning(format!("the table is useless for control: {}", faults.join(". ")));
            return Ok(());
        }
        let unwritten = if self.output.is_some() { ", and it was not written" } else { "" };
        Err(Error::new(
            FitCode::FitImplausible,
            format!("the table is useless for control{unwritten}: {}", faults.join(". ")),
        ))
    }
}
