//! `host history`: quantities and effects of one actuator over several campaigns.

mod campaigns;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::reports::{self, Reports};
use crate::console::Console;
use crate::documents::{history as document, text};
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{FolderLock, to_standard_output, write_whole};
use pam_diagnose::reference::Mounted;
use pam_diagnose::timeline::{Options, timeline};
use pam_report::timeline_page;
use pam_report::wording::timeline as wording;

/// Arguments of `host history`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host history 2026-01-05 2026-02-03 2026-03-02 --report life.html\n  \
    host history bench/* --muscle mini.toml --csv life.csv --json life.json\n  \
    host history loops_2026-*.csv --reference loops_2026-03-02.csv\n\n\
    A folder is one campaign, and so are files whose names carry the same date. Campaigns are sorted by date. \
    The date is from the name (2026-01-05, 20260105, with or without a time of day), else from a column (date, timestamp, or a time that \
    counts from 1970) or a remark above the header. Otherwise it is the time of modification. The answer says which.")]
pub struct Arguments {
    /// Folders or files with the recordings of one actuator.
    #[arg(required = true, value_name = "CAMPAIGN")]
    campaigns: Vec<PathBuf>,
    /// The muscle's description: its table is fitted to each campaign. Without it any pneumatic actuator can be followed.
    #[arg(long, value_name = "M.toml")]
    muscle: Option<PathBuf>,
    /// The campaign that the others are compared with, one of those given [default: the first].
    #[arg(long, value_name = "CAMPAIGN")]
    reference: Option<PathBuf>,
    /// How to read files that are not in the usual form: an import description.
    #[arg(long, value_name = "IMPORT.toml")]
    import: Option<PathBuf>,
    /// Take only rows where a column has this value; may be given several times.
    #[arg(long = "where", value_name = "COLUMN=VALUE")]
    filters: Vec<String>,
    /// The actuator was not taken off the bench between the campaigns; smaller offsets of the stroke can be found then.
    #[arg(long)]
    same_mounting: bool,
    /// Write the history as JSON to a file; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write one row per campaign and quantity as CSV; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    reports: Reports,
}

impl Arguments {
    /// Reads, compares, writes.
    ///
    /// # Errors
    /// Files that cannot be read or written, campaigns that cannot be compared.
    pub fn run(self, console: &Console) -> Result<()> {
        let taken = to_standard_output(&[
            ("--json", self.json.as_deref()),
            ("--csv", self.csv.as_deref()),
            ("--report", self.reports.file()),
        ])?;
        let start = Instant::now();
        let watched =
            if self.json.is_some() || self.csv.is_some() { Console::silent() } else { console.clone() };
        let muscle = self.muscle.as_ref().map(MuscleDescription::read).transpose()?;
        let visits = campaigns::read(&self.request(muscle.as_ref()), &watched)?;
        let reference = match &self.reference {
            None => 0,
            Some(path) => campaigns::position(&visits, path).ok_or_else(|| {
                Error::new(DataCode::CallInvalid, "the reference is none of the campaigns")
                    .value(path.display().to_string())
                    .help("give --reference one of the folders or files that are listed as campaigns")
            })?,
        };
        let visits: Vec<_> = visits.into_iter().map(|v| v.visit).collect();
        for visit in &visits {
            for warning in &visit.campaign.warnings {
                console.warning(format!("{}: {warning}", visit.name));
            }
        }
        let mounted = if self.same_mounting { Mounted::Same } else { Mounted::Anew };
        let options = Options { muscle: muscle.as_ref(), reference, mounted };
        let found = timeline(&visits, &options)?;
        console.detail(format!("compared in {:.3} s", start.elapsed().as_secs_f64()));
        let _lock = FolderLock::of([
            self.json.as_deref(),
            self.csv.as_deref(),
            self.reports.file(),
            self.reports.figures.as_deref(),
        ])?;
        if let Some(path) = &self.json {
            let json = text(&document::History::of(&visits, &found, muscle.as_ref()))?;
            write_whole(path, (json + "\n").as_bytes())?;
        }
        if let Some(path) = &self.csv {
            write_whole(path, wording::csv(&visits, &found).as_bytes())?;
        }
        self.reports.write(console, &reports::provenance(), || timeline_page::page(&visits, &found))?;
        let printed = |p: &Option<PathBuf>| p.as_deref() == Some(Path::new("-"));
        if !printed(&self.json) && !printed(&self.csv) {
            let text = wording::summary(&visits, &found);
            if taken { console.note(text.trim_end()) } else { console.result(text.trim_end()) }
        }
        Ok(())
    }

    fn request<'a>(&'a self, muscle: Option<&'a MuscleDescription>) -> campaigns::Request<'a> {
        campaigns::Request {
            paths: &self.campaigns,
            muscle,
            import: self.import.as_ref(),
            filters: &self.filters,
        }
    }
}
