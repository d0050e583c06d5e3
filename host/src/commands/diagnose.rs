//! `host diagnose`: which effects the model lacks, where it is wrong, and how certain that is; with `--reference`, what has changed; with several
//! muscles, what a stock shares.

pub(crate) mod reference;
pub(crate) mod stock;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use clap::{Args, FromArgMatches};
use model_core::muscle::Muscle;

use super::effects;
use super::recordings::Recordings;
use super::reports::{self, Reports};
use crate::console::Console;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::{FolderLock, to_standard_output, write_whole};
use pam_data::progress::SharedProgress;
use pam_diagnose::remark::Remark;
use pam_diagnose::{
    Diagnosis, Options, diagnose_described,
    next_experiment::{self, next_experiment},
    refitted_table,
};
use pam_fit::checks::Checks;
use pam_fit::predict::predict;
use pam_fit::table_faults::table_faults;
use pam_fit::{RecordingResidual, recording_table};

use crate::progress::ProgressLine;
use pam_data::recording::{Campaign, Reader};
use pam_fit::table_file::{self, TableFile};
use pam_report::{diagnose_page, document, history_text, wording};

/// Arguments of `host diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    host diagnose --muscle mini.toml loops/*.csv\n  \
    host diagnose --muscle mini.toml loops/*.csv -o corrected.pam \\\n      \
        --report answer.html --json answer.json\n  \
    host diagnose --muscle mini.toml loops/*.csv --with backlash,force-offset\n  \
    host diagnose --muscle a.toml a/*.csv --muscle b.toml b/*.csv \\\n      \
        --muscle c.toml c/*.csv\n  \
    host diagnose today/*.csv --reference march/*.csv --report changed.html\n  \
    host diagnose --muscle mini.toml today/*.csv --reference mini.pam")]
#[command(mut_arg("import", stock::several_imports))]
pub struct Arguments {
    #[command(flatten)]
    muscles: stock::Muscles,
    #[command(flatten)]
    changed: reference::Options,
    #[command(flatten)]
    recordings: Recordings,
    /// A table whose error on the recordings is reported; by default one is fitted.
    #[arg(long, value_name = "T.pam")]
    table: Option<PathBuf>,
    /// A check of the bench (dead weights, rigid bar, reference gauge, weighing, closed valve). The recordings are corrected for what it measures.
    /// May be given more than once.
    #[arg(long, value_name = "CHECK.csv")]
    check: Vec<PathBuf>,
    /// Effects that are known to be present, such as backlash. They are fitted and stored in the table in any case, no others are
    /// searched for, and the answer says whether the recordings support them. `host effects` lists the names.
    #[arg(long, value_name = "EFFECT", value_delimiter = ',')]
    with: Vec<String>,
    /// Write the table refitted with the named effects; corrections of the bench are stored separately.
    #[arg(short, long, value_name = "T2.pam")]
    output: Option<PathBuf>,
    /// Write the diagnosis as JSON to a file; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    reports: Reports,
    /// Write the protocol of the next experiment, which separates confusable effects.
    #[arg(long, value_name = "P.toml")]
    next: Option<PathBuf>,
}

impl Arguments {
    /// The arguments of a call that another command makes.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] for arguments that the command does not take.
    pub(super) fn of(arguments: Vec<std::ffi::OsString>) -> Result<Self> {
        let command = Self::augment_args(clap::Command::new("diagnose"));
        let matches = command.try_get_matches_from(arguments);
        matches
            .and_then(|m| Self::from_arg_matches(&m))
            .map_err(|e| Error::new(DataCode::CallInvalid, e.to_string()))
    }

    /// Runs the command.
    ///
    /// # Errors
    /// Files that cannot be read or written, recordings without force.
    pub fn run(self, console: &Console) -> Result<()> {
        let taken = to_standard_output(&[
            ("-o", self.output.as_deref()),
            ("--json", self.json.as_deref()),
            ("--report", self.reports.file()),
            ("--next", self.next.as_deref()),
        ])?;
        if self.muscles.several() {
            return stock::run(&self, console, taken);
        }
        self.muscles.one_import()?;
        if !self.changed.reference.is_empty() {
            return reference::run(&self, console, taken);
        }
        let start = Instant::now();
        let given = self.with.iter().map(|name| effects::by_name(name.trim())).collect::<Result<Vec<_>>>()?;
        let Some(path) = self.muscles.first() else {
            return Err(Error::new(DataCode::CallInvalid, "the muscle's description is missing")
                .help("give --muscle M.toml"));
        };
        let muscle = MuscleDescription::read(path)?;
        // With JSON the caller is a program.
        let watched = if self.json.is_some() { Console::silent() } else { console.clone() };
        let (campaign, hashes) = self.recordings.read_hashed(Reader::of(&muscle), &watched)?;
        for warning in &campaign.warnings {
            console.warning(warning);
        }
        let table = self.table.as_ref().map(TableFile::read).transpose()?;
        let progress = SharedProgress::new(Arc::new(ProgressLine::new(&watched, "diagnosing")));
        let checks = Checks::read(&self.check)?;
        let options = Options { muscle: muscle.name.clone(), checks, given, progress };
        let plain = pam_fit::fit(&campaign, &muscle, &pam_fit::Options::default());
        let mut answer = diagnose_described(&campaign, &muscle, &options, plain.as_ref())?;
        let plain = plain.ok().filter(|_| answer.judged());
        let diagnosed = start.elapsed();
        if let Some(rms) = table.map(|table| predict(&table, &campaign)).transpose()?.and_then(|p| p.rms) {
            answer.misfit_rms_N = rms;
        }
        let refitted = self.refit(&campaign, &muscle, &answer, &options);
        // The progress line is removed before other output.
        drop(options);
        console.detail(format!("diagnosed in {:.3} s", diagnosed.as_secs_f64()));
        let _lock = FolderLock::of([
            self.output.as_deref(),
            self.json.as_deref(),
            self.next.as_deref(),
            self.reports.file(),
            self.reports.figures.as_deref(),
        ])?;
        let from = reports::provenance().muscle(&muscle).files(&self.recordings.files, &hashes);
        match refitted {
            Some(Ok(refitted)) => self.with_model(console, &campaign, hashes, refitted, &mut answer)?,
            // Without a requested table a failed refit only costs the advice.
            Some(Err(e)) if self.output.is_some() => return Err(e),
            Some(Err(e)) => answer.remarks.push(Remark::NoAdvice(e.to_string())),
            None => {}
        }
        if let (Some(path), None) = (&self.next, &answer.next_experiment) {
            console.warning(format!(
                "{} is not written: no protocol of the program separates the named effects further; \"What to do\" says what else helps",
                path.display()
            ));
        }
        if let Some(path) = &self.json {
            write_whole(path, (document::diagnosis_json(&answer) + "\n").as_bytes())?;
        }
        let residuals = plain.as_ref().map_or(&[][..], |plain| &plain.summary.recordings);
        self.reports.write(console, &from, || {
            diagnose_page::page_with_residuals(&answer, &muscle.geometry(), &campaign, residuals)
        })?;
        if self.json.as_deref() != Some(Path::new("-")) {
            let text = summary(&answer, residuals);
            if taken { console.note(text.trim_end()) } else { console.result(text.trim_end()) }
        }
        console.detail(format!("done in {:.3} s", start.elapsed().as_secs_f64()));
        Ok(())
    }

    /// The table with the named effects, where it is written or the advice depends on it.
    fn refit(
        &self,
        campaign: &Campaign,
        muscle: &MuscleDescription,
        answer: &Diagnosis,
        options: &Options,
    ) -> Option<Result<refitted_table::Refitted>> {
        (self.output.is_some() || next_experiment::is_open(answer)).then(|| {
            options.progress.stage("fitting the table with the named effects", 0);
            refitted_table::refit(campaign, muscle, answer)
        })
    }

    fn with_model(
        &self,
        console: &Console,
        campaign: &Campaign,
        hashes: Vec<String>,
        mut refitted: refitted_table::Refitted,
        answer: &mut Diagnosis,
    ) -> Result<()> {
        let tested = refitted.file.table.tested;
        let (low, high) = (tested.pressure_low.pascals(), tested.pressure_high.pascals());
        if let Ok(muscle) = Muscle::<f64>::build(&refitted.file.table) {
            answer.next_experiment = next_experiment(answer, &muscle, f64::from(low), f64::from(high))?;
        }
        if let (Some(path), Some(next)) = (&self.next, &answer.next_experiment) {
            write_whole(path, next.protocol.as_bytes())?;
        }
        let Some(path) = &self.output else { return Ok(()) };
        for warning in &refitted.warnings {
            console.detail(warning);
        }
        let files = &self.recordings.files;
        refitted.file.about.date = date::now_utc();
        refitted.file.about.sources = table_file::sources(campaign, files, hashes);
        refitted.file.write(path)?;
        let about = &refitted.file.about;
        let faults = table_faults(&refitted.file.table, about.uncertainty.as_ref(), &about.fit);
        if !faults.is_empty() {
            console.warning(format!("{} is useless for control: {}", path.display(), faults.join(". ")));
        }
        if let Some(comparison) = refitted.comparison {
            answer.remarks.push(Remark::Table { file: path.display().to_string(), comparison });
        } else if let Some((plain, with)) = refitted.left_out.filter(|(plain, with)| with < plain) {
            console.note(format!(
                "{}: mean error at a pressure left out of the fit: {with:.2} % of blocked force with the named effects, {plain:.2} % without",
                path.display()
            ));
        } else if refitted.rms_after < refitted.rms_before {
            console.note(format!(
                "{}: error on these recordings: {:.3} N rms with the named effects, {:.3} N without",
                path.display(),
                refitted.rms_after,
                refitted.rms_before
            ));
        }
        Ok(())
    }
}

/// The answer as text, with the residuals of the table without effects by recording.
fn summary(answer: &Diagnosis, residuals: &[RecordingResidual]) -> String {
    let mut text = wording::summary(answer);
    let table = recording_table(residuals);
    if !table.is_empty() {
        text += &format!("\nOf the table without effects: {table}\n");
    }
    if let Some(history) = &answer.history {
        text += &format!("\n{}", history_text::text(history));
    }
    text
}
