//! A batch: every muscle of a manifest, each computed once, in parallel.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Mutex, PoisonError};

use pam_data::error::{DataCode, Error, Result};
use pam_data::progress::Progress;
use serde::Serialize;

use crate::analysis::{Analysis, analyse};
use crate::error::FleetCode;
use crate::failures::{Failure, Stage};
use crate::manifest::{Entry, Manifest};
use crate::partition::Output;
use crate::results::{self, Provenance};
use crate::shard::Shard;
use crate::work_item::{Inputs, WorkItem};

/// The version of the stored results: a new one computes everything again.
const FORMAT: u32 = 1;
/// Failures that a summary lists; the table `failures` lists all.
const MOST_LISTED: usize = 100;

/// What is computed of each muscle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// The table only.
    Fit,
    /// The diagnosis only.
    Diagnose,
    /// The table and the diagnosis.
    Both,
}

/// Options of a batch.
#[derive(Debug, Clone)]
pub struct Options {
    /// Options of every fit.
    pub fit: pam_fit::Options,
    /// What is computed.
    pub task: Task,
    /// Whether each muscle's reports are written too.
    pub reports: bool,
    /// Which muscles of the manifest are this run's.
    pub shard: Shard,
    /// Muscles at a time.
    pub jobs: usize,
    /// The program and its version, for the results.
    pub tool: String,
}

impl Options {
    /// Everything beside the inputs that the results depend on. The number of jobs and the shard are not among it.
    fn settings(&self) -> String {
        format!("format {FORMAT}; {}; {:?}; reports {}; {:?}", self.tool, self.task, self.reports, self.fit)
    }
}

/// A failure with its muscle.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Listed {
    /// The muscle.
    pub muscle: String,
    /// What went wrong.
    pub failure: Failure,
}

/// What a batch did.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Muscles of this shard.
    pub muscles: u64,
    /// Computed by this run.
    pub computed: u64,
    /// Left as they were: an earlier run had computed them from the same inputs.
    pub reused: u64,
    /// Muscles with at least one failure, among those of this shard.
    pub failed: u64,
}

/// What a batch did, with its failures.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Numbers of muscles.
    pub counts: Counts,
    /// The first failures of muscles computed by this run, by name of the muscle.
    pub failures: Vec<Listed>,
}

/// State that the workers share.
struct Shared<'a> {
    options: &'a Options,
    settings: String,
    output: Output,
    progress: &'a dyn Progress,
    total: AtomicU64,
    summary: Mutex<Summary>,
    /// The first failure to write results, which ends the batch: every further muscle would fail likewise.
    broken: Mutex<Option<Error>>,
}

/// Computes the muscles of a manifest into a folder.
///
/// Muscles whose results are there for the same inputs and settings are left alone. A muscle that fails is listed in its `failures`, and the
/// others are computed.
///
/// # Errors
/// A manifest that cannot be read, or results that cannot be written.
pub fn run(manifest: &Path, output: &Path, options: &Options, progress: &dyn Progress) -> Result<Summary> {
    // Counted first: the remaining time needs the number, and a manifest that cannot be read is reported before anything is computed.
    let mine = |entry: &Entry| options.shard.holds(entry.label());
    let muscles = Manifest::open(manifest)?.filter(mine).count() as u64;
    let entries = Manifest::open(manifest)?.filter(mine);
    progress.total(muscles);
    let shared = Shared {
        options,
        settings: options.settings(),
        output: Output::open(output)?,
        progress,
        total: AtomicU64::new(muscles),
        summary: Mutex::default(),
        broken: Mutex::default(),
    };
    let jobs = options.jobs.clamp(1, usize::try_from(muscles.max(1)).unwrap_or(usize::MAX));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // Each worker computes in threads of its own, so that muscles do not wait for each other.
    let threads = (cores / jobs).max(1);
    let (sender, receiver) = sync_channel::<Entry>(2 * jobs);
    let receiver = Mutex::new(receiver);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| work(&receiver, &shared, threads));
        }
        for entry in entries {
            if shared.is_broken() || sender.send(entry).is_err() {
                break;
            }
        }
        drop(sender);
    });
    if let Some(error) = shared.broken.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let mut summary = shared.summary.into_inner().unwrap_or_else(PoisonError::into_inner);
    summary.counts.muscles = muscles;
    Ok(summary)
}

fn work(entries: &Mutex<Receiver<Entry>>, shared: &Shared<'_>, threads: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    loop {
        let next = entries.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok(entry) = next else { return };
        // After a failure to write the queue is emptied, or the reader of the manifest would never end.
        if shared.is_broken() {
            continue;
        }
        let one = || shared.compute(&entry);
        let done = match &pool {
            Ok(pool) => pool.install(one),
            // Without threads of its own the worker shares the program's.
            Err(_) => one(),
        };
        if let Err(error) = done {
            shared.broken.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }
}

impl Shared<'_> {
    fn is_broken(&self) -> bool {
        self.broken.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    fn compute(&self, entry: &Entry) -> Result<()> {
        let muscle = entry.label();
        let (from, analysis) = match entry {
            Entry::Muscle(item) => {
                let inputs = Inputs::of(item);
                let key = inputs.key(item, &self.settings);
                if self.output.has(muscle, &key) {
                    self.reused(muscle);
                    return Ok(());
                }
                let analysis = caught(item, &inputs, self.options);
                (self.provenance(item, &inputs, key), analysis)
            }
            Entry::Invalid { label, error } => {
                let folder = error.place().file.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
                let failure = Failure::of(Stage::Manifest, error, folder);
                let key = Inputs::key_of_failure(label, &failure, &self.settings);
                if self.output.has(muscle, &key) {
                    self.reused(muscle);
                    return Ok(());
                }
                let from = Provenance {
                    muscle: label.clone(),
                    key,
                    tool: self.options.tool.clone(),
                    inputs: "[]".into(),
                    tags: "{}".into(),
                };
                (from, Analysis { failures: vec![failure], ..Analysis::default() })
            }
        };
        self.output.publish(muscle, &files(&from, &analysis)?)?;
        self.computed(muscle, analysis.failures);
        Ok(())
    }

    fn provenance(&self, item: &WorkItem, inputs: &Inputs, key: String) -> Provenance {
        Provenance {
            muscle: item.muscle.clone(),
            key,
            tool: self.options.tool.clone(),
            inputs: inputs.json(),
            tags: serde_json::to_string(&item.tags).unwrap_or_default(),
        }
    }

    fn reused(&self, muscle: &str) {
        let failed = self.output.has_failures(muscle);
        // What needs no computing does not show the remaining time.
        let total = self.total.fetch_sub(1, Ordering::Relaxed) - 1;
        self.progress.total(total);
        let mut summary = self.summary.lock().unwrap_or_else(PoisonError::into_inner);
        summary.counts.reused += 1;
        summary.counts.failed += u64::from(failed);
    }

    fn computed(&self, muscle: &str, failures: Vec<Failure>) {
        let mut summary = self.summary.lock().unwrap_or_else(PoisonError::into_inner);
        summary.counts.computed += 1;
        summary.counts.failed += u64::from(!failures.is_empty());
        let muscle = muscle.to_owned();
        summary
            .failures
            .extend(failures.into_iter().map(|failure| Listed { muscle: muscle.clone(), failure }));
        summary.failures.sort();
        summary.failures.truncate(MOST_LISTED);
        drop(summary);
        self.progress.step();
    }
}

/// The analysis, or a failure where the computation ended abnormally: one muscle must not end the batch.
fn caught(item: &WorkItem, inputs: &Inputs, options: &Options) -> Analysis {
    catch_unwind(AssertUnwindSafe(|| analyse(item, inputs, options))).unwrap_or_else(|_| {
        let error = Error::new(FleetCode::FleetAborted, "the computation of this muscle ended abnormally");
        Analysis { failures: vec![Failure::of(Stage::Fit, &error, &item.folder)], ..Analysis::default() }
    })
}

/// The files of a muscle's folder.
fn files(from: &Provenance, analysis: &Analysis) -> Result<Vec<(String, Vec<u8>)>> {
    let unwritable = |e: parquet::errors::ParquetError| {
        Error::new(DataCode::FileUnwritable, format!("the results cannot be encoded: {e}"))
    };
    let mut files = vec![
        ("fits.parquet".to_owned(), results::fits(from, analysis.fit.as_ref()).map_err(unwritable)?),
        ("tables.parquet".to_owned(), results::tables(from, analysis.fit.as_ref()).map_err(unwritable)?),
        (
            "diagnoses.parquet".to_owned(),
            results::diagnoses(from, analysis.answer.as_ref()).map_err(unwritable)?,
        ),
        ("failures.parquet".to_owned(), results::failures(from, &analysis.failures).map_err(unwritable)?),
    ];
    files.extend(analysis.files.iter().cloned());
    Ok(files)
}
