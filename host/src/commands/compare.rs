//! `host compare`: the difference between two recordings.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use super::recordings;
use super::reports::{self, Reports};
use crate::console::Console;
use crate::documents::{bench, text};
use pam_data::compare::compare;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{printed, to_standard_output};
use pam_data::progress::Progress;

use crate::progress::ProgressLine;
use pam_data::recording::{Import, Reader};
use pam_report::compare_page;

/// At most this many recordings of a file are listed.
const LISTED: usize = 6;

/// Arguments of `host compare`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host compare before.csv after.csv\n  host compare a.csv b.csv --report difference.html --json\n  \
    host compare --muscle mini.toml --import bench.toml a.txt b.txt\n  \
    host compare --import r.toml a.csv a.csv --where-a run=1 --where-b run=2"
)]
pub struct Arguments {
    /// The first recording; `-` is standard input.
    #[arg(value_name = "A.csv", value_parser = recordings::recording)]
    a: PathBuf,
    /// The second recording; `-` is standard input.
    #[arg(value_name = "B.csv", value_parser = recordings::recording)]
    b: PathBuf,
    /// The muscle's description, where files give lengths or contractions in place of a stroke.
    #[arg(long, value_name = "MUSCLE.toml")]
    muscle: Option<PathBuf>,
    /// An import description, for files that are not in the standard form.
    #[arg(long, value_name = "IMPORT.toml")]
    import: Option<PathBuf>,
    /// Take only rows of both where a column has this value, as `host fit --where`; may be given several times.
    #[arg(long = "where", value_name = "COLUMN=VALUE")]
    filters: Vec<String>,
    /// The same for the first recording only: picks a run of a file of many.
    #[arg(long = "where-a", value_name = "COLUMN=VALUE")]
    filters_a: Vec<String>,
    /// The same for the second recording only.
    #[arg(long = "where-b", value_name = "COLUMN=VALUE")]
    filters_b: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reports: Reports,
}

impl Arguments {
    /// Reads both, compares, writes.
    ///
    /// # Errors
    /// Files that cannot be read or written, recordings without a common stretch.
    pub fn run(self, console: &Console) -> Result<()> {
        let taken = to_standard_output(&[("--json", printed(self.json)), ("--report", self.reports.file())])?;
        // With JSON the caller is a program.
        let watched = if self.json { Console::silent() } else { console.clone() };
        let progress = Arc::new(ProgressLine::new(&watched, "reading"));
        let sizes = [&self.a, &self.b].into_iter().filter_map(|f| std::fs::metadata(f).ok());
        progress.total(sizes.map(|m| m.len()).sum());
        let muscle = self.muscle.as_ref().map(MuscleDescription::read).transpose()?;
        let import = self.import.as_ref().map(Import::read).transpose()?;
        let one = |path: &PathBuf, own: &[String], option: &str| {
            let mut reader = muscle.as_ref().map_or_else(Reader::new, Reader::of).import(import.as_ref());
            reader.progress = Some(progress.clone());
            for text in self.filters.iter().chain(own) {
                reader.filters.push(recordings::filter(text)?);
            }
            let mut all = reader.campaign([path])?.recordings;
            if all.len() == 1 {
                return Ok(all.remove(0));
            }
            let mut titles: Vec<String> = all.iter().take(LISTED).map(|r| r.title()).collect();
            if all.len() > LISTED {
                titles.push(format!("and {} more", all.len() - LISTED));
            }
            let label = all.first().and_then(|r| r.labels.last());
            let example = label.map_or("run=1".to_owned(), |(name, value)| format!("{name}={value}"));
            Err(Error::new(
                DataCode::CallInvalid,
                format!("the file holds {} recordings: {}", all.len(), titles.join("; ")),
            )
            .file(path)
            .help(format!("pick one with {option} {example}; the option may be given several times")))
        };
        let (a, b) =
            (one(&self.a, &self.filters_a, "--where-a")?, one(&self.b, &self.filters_b, "--where-b")?);
        drop(progress);
        let found = compare(&a, &b)?;
        self.reports.write(console, &reports::of_files(&[self.a.clone(), self.b.clone()]), || {
            compare_page::page(&a, &b, &found)
        })?;
        if self.json {
            console.result(text(&bench::Compare::of(&found))?);
        } else if taken {
            console.note(found.to_text());
        } else {
            console.result(found.to_text());
        }
        Ok(())
    }
}
