//! Fit and diagnosis of one muscle.

use std::sync::Arc;

use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Hashes, Import, Reader};
use pam_diagnose::diagnose_described;
use pam_diagnose::reference::{Against, ChangeReport, Options as Compared, compare};
use pam_fit::table_file::{self, TableFile};
use pam_fit::{Fit, fit};
use pam_report::{change_page, diagnose_page, fit_page};

use crate::batch::{Options, Task};
use crate::failures::{Failure, Stage};
use crate::results::Answer;
use crate::work_item::{Inputs, Role, WorkItem};

/// What is known about a muscle in the end.
#[derive(Default)]
pub(crate) struct Analysis {
    pub fit: Option<Fit>,
    pub answer: Option<Answer>,
    pub failures: Vec<Failure>,
    /// Further files of the muscle's folder.
    pub files: Vec<(String, Vec<u8>)>,
}

impl Analysis {
    fn fail(&mut self, stage: Stage, error: &Error, item: &WorkItem) {
        self.failures.push(Failure::of(stage, error, &item.folder));
    }
}

/// A muscle's description and recordings.
struct Loaded {
    muscle: Option<MuscleDescription>,
    import: Option<Import>,
    campaign: Campaign,
}

/// Reads, fits and diagnoses one muscle. A failure of one step does not prevent the others.
pub(crate) fn analyse(item: &WorkItem, inputs: &Inputs, options: &Options) -> Analysis {
    let mut result = Analysis::default();
    if let Some(error) = &inputs.error {
        result.fail(Stage::Read, error, item);
        return result;
    }
    let loaded = match load(item, inputs) {
        Ok(loaded) => loaded,
        Err(error) => {
            result.fail(Stage::Read, &inputs.with_original_name(error), item);
            return result;
        }
    };
    if let Some(muscle) = loaded.muscle.as_ref().filter(|_| options.task != Task::Diagnose) {
        match fit(&loaded.campaign, muscle, &options.fit) {
            Ok(fitted) => keep_fit(&mut result, fitted, item, inputs, &loaded, options),
            Err(error) => result.fail(Stage::Fit, &inputs.with_original_name(error), item),
        }
    }
    if options.task != Task::Fit {
        diagnose(&mut result, item, inputs, &loaded, options);
    }
    result
}

fn diagnose(result: &mut Analysis, item: &WorkItem, inputs: &Inputs, loaded: &Loaded, options: &Options) {
    if !item.reference.is_empty() {
        match changes(item, inputs, loaded) {
            Ok(report) => {
                if options.reports {
                    let page = change_page::page(&report, &loaded.campaign);
                    result.files.push(("diagnosis.html".into(), page.html().into_bytes()));
                }
                result.answer = Some(Answer::Change(Box::new(report)));
            }
            Err(error) => result.fail(Stage::Diagnose, &inputs.with_original_name(error), item),
        }
        return;
    }
    let Some(muscle) = &loaded.muscle else { return };
    let geometry = muscle.geometry();
    let asked = pam_diagnose::Options { muscle: item.muscle.clone(), ..Default::default() };
    let answer = match &result.fit {
        Some(fitted) => diagnose_described(&loaded.campaign, muscle, &asked, Ok(fitted)),
        None => {
            let own = fit(&loaded.campaign, muscle, &options.fit);
            diagnose_described(&loaded.campaign, muscle, &asked, own.as_ref())
        }
    };
    match answer {
        Ok(answer) => {
            if options.reports {
                let page = diagnose_page::page(&answer, &geometry, &loaded.campaign);
                result.files.push(("diagnosis.html".into(), page.html().into_bytes()));
            }
            result.answer = Some(Answer::Diagnosis(Box::new(answer)));
        }
        Err(error) => result.fail(Stage::Diagnose, &inputs.with_original_name(error), item),
    }
}

fn load(item: &WorkItem, inputs: &Inputs) -> Result<Loaded> {
    let muscle = inputs.paths(Role::Description).first().map(MuscleDescription::read).transpose()?;
    let import = inputs.paths(Role::Import).first().map(Import::read).transpose()?;
    let hashes = Arc::new(Hashes::default());
    let files = inputs.paths(Role::Recording);
    let mut reader = reader(item, muscle.as_ref(), import.as_ref());
    reader.hashes = Some(Arc::clone(&hashes));
    let campaign = reader.campaign(&files)?;
    let now = hashes.of(&files)?;
    if let Some(at) = now.iter().zip(inputs.hashes(Role::Recording)).position(|(now, before)| *now != before)
    {
        return Err(Error::new(DataCode::FileUnreadable, "the file changed while it was read")
            .file(&files[at])
            .help("run the batch again when the file is complete"));
    }
    Ok(Loaded { muscle, import, campaign })
}

fn reader<'a>(
    item: &WorkItem,
    muscle: Option<&'a MuscleDescription>,
    import: Option<&'a Import>,
) -> Reader<'a> {
    let mut reader = muscle.map_or_else(Reader::new, Reader::of).import(import);
    reader.filters.clone_from(&item.filters);
    reader
}

fn keep_fit(
    result: &mut Analysis,
    fitted: Fit,
    item: &WorkItem,
    inputs: &Inputs,
    loaded: &Loaded,
    options: &Options,
) {
    let names = inputs.list.iter().filter(|i| i.role == Role::Recording);
    let files = inputs.paths(Role::Recording);
    let mut sources = table_file::sources(&loaded.campaign, &files, inputs.hashes(Role::Recording));
    for (source, input) in sources.iter_mut().zip(names) {
        source.path.clone_from(&input.name);
    }
    let mut table = fitted.table_file(options.tool.clone());
    table.about.muscle.clone_from(&item.muscle);
    // The date of the run would make equal inputs give different files.
    table.about.date = item.tags.get("date").cloned().unwrap_or_default();
    table.about.sources = sources;
    match table.to_bytes() {
        Ok(bytes) => result.files.push(("table.pam".into(), bytes)),
        Err(error) => result.fail(Stage::Fit, &inputs.with_original_name(error), item),
    }
    if options.reports {
        let page = fit_page::page(&fitted, &loaded.campaign, &options.fit);
        result.files.push(("fit.html".into(), page.html().into_bytes()));
    }
    result.fit = Some(fitted);
}

/// What has changed since the reference.
fn changes(item: &WorkItem, inputs: &Inputs, loaded: &Loaded) -> Result<ChangeReport> {
    let asked = Compared {
        muscle: Some(item.muscle.clone()),
        rest_length: loaded.muscle.as_ref().map(MuscleDescription::rest_length),
        ..Compared::default()
    };
    let files = inputs.paths(Role::Reference);
    let is_table = |p: &std::path::PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("pam"));
    if let [one] = files.as_slice()
        && is_table(one)
    {
        let table = TableFile::read(one)?;
        return compare(&loaded.campaign, Against::Table(&table, &item.reference[0]), &asked);
    }
    if let Some(table) = files.iter().find(|f| is_table(f)) {
        return Err(Error::new(DataCode::CallInvalid, "a table among several references")
            .file(table)
            .help("name either one table (.pam) or recordings as the reference"));
    }
    let before = reader(item, loaded.muscle.as_ref(), loaded.import.as_ref()).campaign(&files)?;
    compare(&loaded.campaign, Against::Recordings(&before), &asked)
}
