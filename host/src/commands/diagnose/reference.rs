//! `host diagnose --reference`: what has changed since earlier recordings of the same actuator.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::super::recordings::{Recordings, filter as filter_of};
use super::super::reports;
use super::Arguments;
use crate::console::Console;
use pam_data::date;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;
use pam_data::recording::{Campaign, Import, Reader};
use pam_diagnose::reference::correction::{self, Done};
use pam_diagnose::reference::{Against, ChangeReport, Mounted, Options as ReferenceOptions, compare};
use pam_fit::table_file::{self, TableFile};
use pam_report::wording::change as wording;
use pam_report::{change_page, document};

/// m: with lengths and no rest length, strokes count from this one; differences between mountings are all that matters.
const ANY_LENGTH: f64 = 10.0;

/// Options of the comparison.
#[derive(Debug, Clone, Default, Args)]
pub struct Options {
    /// Say what has changed since these earlier recordings of the same actuator, or since one table (.pam). Before any evidence four in
    /// five pairs of campaigns count as unchanged, strokes of a cylinder one in two; see --prior-changed.
    #[arg(long, value_name = "REF", num_args = 1.., help_heading = "Comparison")]
    pub reference: Vec<PathBuf>,
    /// Take only rows of the reference where a column has this value, instead of --where; may be given several times.
    #[arg(long, value_name = "COLUMN=VALUE", requires = "reference", help_heading = "Comparison")]
    reference_where: Vec<String>,
    /// The actuator was not taken off the bench in between. Without this option recordings of several files count as remounted, unless
    /// their clock is one.
    #[arg(long, requires = "reference", conflicts_with = "remounted", help_heading = "Comparison")]
    same_mounting: bool,
    /// The actuator was taken off and remounted, although files or clock look like one visit.
    #[arg(long, requires = "reference", help_heading = "Comparison")]
    remounted: bool,
    /// Probability of a change before any evidence, 0.01 to 0.99.
    #[arg(long, value_name = "P", requires = "reference", help_heading = "Comparison")]
    prior_changed: Option<f64>,
}

impl Options {
    fn mounted(&self) -> Mounted {
        match (self.same_mounting, self.remounted) {
            (true, _) => Mounted::Same,
            (_, true) => Mounted::Anew,
            _ => Mounted::Found,
        }
    }
}

/// Reads recordings of an actuator that may not be described: a length needs no rest length, and without any column of displacement,
/// length or contraction the length counts as held.
///
/// # Errors
/// What is wrong with a file, or with an option.
pub(crate) fn read(
    recordings: &Recordings,
    muscle: Option<&MuscleDescription>,
    console: &Console,
) -> Result<Campaign> {
    if let Some(muscle) = muscle {
        return recordings.read_watched(Reader::of(muscle), console);
    }
    match recordings.read_watched(Reader::new(), console) {
        Err(e) if e.code() == DataCode::RecordingRestLength && e.cause().contains("`length`") => {
            recordings.read_watched(Reader::with_rest_length(ANY_LENGTH), console)
        }
        Err(e) if e.code() == DataCode::RecordingMissingColumn && e.cause().contains("displacement") => {
            held(recordings, console)
        }
        read => read,
    }
}

/// Reads with the stroke as a constant.
fn held(recordings: &Recordings, console: &Console) -> Result<Campaign> {
    let mut import = match &recordings.import {
        Some(path) => Import::read(path)?,
        None => Import { comment: Some('#'), ..Import::default() },
    };
    import.constants.insert("displacement_mm".into(), 0.0);
    let mut reader = Reader::new().import(Some(&import));
    for filter in &recordings.filters {
        reader.filters.push(filter_of(filter)?);
    }
    reader.absent_values = recordings.absent_values;
    console.warning("no column of displacement, length or contraction: the length counts as held");
    reader.campaign(&recordings.files)
}

/// The reference: recordings, or one table.
enum Before {
    Recordings(Campaign),
    Table(Box<TableFile>, PathBuf),
}

fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pam"))
}

fn before(arguments: &Arguments, muscle: Option<&MuscleDescription>, console: &Console) -> Result<Before> {
    let files = &arguments.changed.reference;
    match files.as_slice() {
        [one] if is_table(one) => Ok(Before::Table(Box::new(TableFile::read(one)?), one.clone())),
        many if many.iter().any(|f| is_table(f)) => {
            Err(Error::new(DataCode::CallInvalid, "a table among several references")
                .help("give --reference either one table (.pam) or recordings"))
        }
        _ => {
            let own = &arguments.changed.reference_where;
            let filters = if own.is_empty() { arguments.recordings.filters.clone() } else { own.clone() };
            // Values of --where may be of the other side only.
            let recordings = Recordings {
                files: files.clone(),
                filters,
                absent_values: own.is_empty(),
                ..arguments.recordings.clone()
            };
            Ok(Before::Recordings(read(&recordings, muscle, console)?))
        }
    }
}

/// Refuses options that belong to the other question.
fn check(arguments: &Arguments) -> Result<()> {
    let foreign = [
        ("--table", arguments.table.is_some(), "give the table as --reference"),
        (
            "--check",
            !arguments.check.is_empty(),
            "checks of the bench are for the diagnosis without --reference",
        ),
        ("--with", !arguments.with.is_empty(), "given effects are for the diagnosis without --reference"),
        ("--next", arguments.next.is_some(), "what to do stands with each change"),
    ];
    if let Some((option, _, help)) = foreign.iter().find(|f| f.1) {
        return Err(
            Error::new(DataCode::CallInvalid, format!("{option} does not go with --reference")).help(*help)
        );
    }
    if arguments.changed.prior_changed.is_some_and(|p| !(0.01..=0.99).contains(&p)) {
        return Err(Error::new(DataCode::CallInvalid, "--prior-changed must lie between 0.01 and 0.99"));
    }
    if arguments.output.is_some() && arguments.muscles.first().is_none() {
        return Err(Error::new(
            DataCode::CallInvalid,
            "-o writes a muscle's table, and no muscle is described",
        )
        .help("give --muscle M.toml, or leave -o out"));
    }
    Ok(())
}

/// Does what was requested. `taken`: standard output belongs to a file.
///
/// # Errors
/// Files that cannot be read or written, sides that cannot be compared.
pub fn run(arguments: &Arguments, console: &Console, taken: bool) -> Result<()> {
    check(arguments)?;
    let start = Instant::now();
    let muscle = arguments.muscles.first().map(MuscleDescription::read).transpose()?;
    let watched = if arguments.json.is_some() { Console::silent() } else { console.clone() };
    let after = match before_table(arguments)? {
        // A table knows its rest length.
        Some(rest) if muscle.is_none() => {
            arguments.recordings.read_watched(Reader::with_rest_length(rest), &watched)?
        }
        _ => read(&arguments.recordings, muscle.as_ref(), &watched)?,
    };
    let before = before(arguments, muscle.as_ref(), &watched)?;
    let mut warnings = after.warnings.clone();
    if let Before::Recordings(campaign) = &before {
        warnings.extend(campaign.warnings.iter().cloned());
    }
    warnings.iter().for_each(|w| console.warning(w));
    let options = ReferenceOptions {
        muscle: muscle.as_ref().map(|m| m.name.clone()),
        rest_length: muscle.as_ref().map(MuscleDescription::rest_length),
        geometry: muscle.as_ref().map(MuscleDescription::geometry),
        mounted: arguments.changed.mounted(),
        prior_changed: arguments.changed.prior_changed,
    };
    let path;
    let against = match &before {
        Before::Recordings(campaign) => Against::Recordings(campaign),
        Before::Table(table, file) => {
            path = file.display().to_string();
            Against::Table(table, &path)
        }
    };
    let report = compare(&after, against, &options)?;
    console.detail(format!("compared in {:.3} s", start.elapsed().as_secs_f64()));
    if let Some(path) = &arguments.json {
        write_whole(path, (document::change_json(&report) + "\n").as_bytes())?;
    }
    let files: Vec<PathBuf> =
        arguments.recordings.files.iter().chain(&arguments.changed.reference).cloned().collect();
    let from = muscle.iter().fold(reports::of_files(&files), |from, muscle| from.muscle(muscle));
    arguments.reports.write(console, &from, || change_page::page(&report, &after))?;
    if arguments.json.as_deref() != Some(Path::new("-")) {
        let text = wording::summary(&report);
        if taken { console.note(text.trim_end()) } else { console.result(text.trim_end()) }
    }
    // Last, so that the answer is there where no table can be written.
    if let (Some(output), Some(muscle)) = (&arguments.output, &muscle) {
        let note = write_table(arguments, output, &report, &before, &after, muscle)?;
        console.note(note);
    }
    Ok(())
}

/// Rest length of the table that is the reference, m.
fn before_table(arguments: &Arguments) -> Result<Option<f64>> {
    match arguments.changed.reference.as_slice() {
        [one] if is_table(one) => {
            let file = TableFile::read(one)?;
            Ok(Some(f64::from(file.table.geometry.rest_length.metres())))
        }
        _ => Ok(None),
    }
}

fn write_table(
    arguments: &Arguments,
    output: &Path,
    report: &ChangeReport,
    before: &Before,
    after: &Campaign,
    muscle: &MuscleDescription,
) -> Result<String> {
    let old = || match before {
        Before::Table(table, _) => Ok((**table).clone()),
        Before::Recordings(campaign) => correction::fitted(campaign, muscle),
    };
    let (mut file, done) = correction::table(report, old, after, muscle)?;
    let (campaign, files) = match (done, before) {
        (Done::Refitted, _) => (after, &arguments.recordings.files),
        (_, Before::Recordings(campaign)) => (campaign, &arguments.changed.reference),
        (_, Before::Table(..)) => {
            file.write(output)?;
            return Ok(written(output, done));
        }
    };
    let hashes = files.iter().map(table_file::sha256).collect::<Result<Vec<_>>>()?;
    file.about.date = date::now_utc();
    file.about.sources = table_file::sources(campaign, files, hashes);
    file.write(output)?;
    Ok(written(output, done))
}

fn written(output: &Path, done: Done) -> String {
    let what = match done {
        Done::Unchanged => "the table of before: nothing changed",
        Done::Corrected => {
            "the table of before with a correction of the bench beside it; a controller gets the same table as before"
        }
        Done::Updated => {
            "the table of before with the change of the actuator applied; a whole campaign after the change allows a new fit"
        }
        Done::Refitted => "the table fitted again to the recordings after the change",
    };
    format!("{}: {what}", output.display())
}
