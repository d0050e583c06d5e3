//! `trials reference-bench`: pairs of campaigns of one simulated muscle, of which the later one has an effect that the earlier one had
//! not; each asked of the diagnosis against a reference.
//!
//! Bounds, fixed before the first scored run: class right in 92 % of the single effects of at least 2 % of the blocked force, on every
//! protocol; a name on at most 2 % of the unchanged pairs; the truth in the set in 95 %. The hash of the set's seed is written before its
//! first pair is made; a pair is answered once, and a set that was begun is continued with its own seed.

mod page;

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::Args;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_diagnose::reference::{Against, Options as Asked, Verdict, compare};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::generate;
use crate::names::class;
use crate::residuals::Residuals;
use crate::spec::{Spec, Stratum};

/// Single effects of at least this peak count, percent of the blocked force.
const LEAST: f64 = 2.0;
/// Class right, of those.
const CLASS: f64 = 0.92;
/// Named, of unchanged pairs.
const FALSE: f64 = 0.02;
/// Truth in the set, of those that count.
const IN_SET: f64 = 0.95;

/// What is run.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    pub set: crate::Kind,
    /// Begin no further pair after this many minutes; the same command continues later.
    #[arg(long)]
    minutes: Option<f64>,
    /// Write this section of the book, too.
    #[arg(long)]
    page: Option<PathBuf>,
    /// Only pairs with this effect, for development.
    #[arg(long)]
    only: Option<String>,
    /// Write the recordings, too.
    #[arg(long)]
    keep: bool,
}

/// One pair, answered and opened.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Outcome {
    /// Number in the set.
    pub id: usize,
    /// What it is for.
    pub stratum: Stratum,
    /// A, D or C.
    pub protocol: String,
    /// The effects that AFTER has, with their peak in percent of the blocked force.
    pub effects: Vec<(String, f64)>,
    /// Names in the order in which they were found, with their probability.
    pub named: Vec<(String, f64)>,
    /// The set of causes.
    pub set: Vec<String>,
    /// The first probabilities.
    pub probabilities: Vec<(String, f64)>,
    /// Verdict, as in the JSON.
    pub verdict: String,
    /// Why there is no answer.
    pub refused: Option<String>,
    /// s.
    pub seconds: f64,
}

impl Outcome {
    /// Whether it is a single effect that counts.
    pub fn counts(&self) -> bool {
        self.stratum == Stratum::Single && self.effects.iter().all(|e| e.1 >= LEAST)
    }

    /// Whether nothing changed.
    pub fn is_null(&self) -> bool {
        self.effects.is_empty()
    }

    fn truth(&self) -> &str {
        self.effects.first().map_or("", |e| e.0.as_str())
    }

    /// Whether the first name is of the class of the effect.
    pub fn class_right(&self) -> bool {
        self.named.first().is_some_and(|n| class(&n.0) == class(self.truth()))
    }

    /// Whether the first name is the effect.
    pub fn exact(&self) -> bool {
        self.named.first().is_some_and(|n| n.0 == self.truth())
    }

    fn in_set(&self) -> bool {
        self.set.iter().any(|s| s == self.truth())
    }
}

fn recording(made: &virtual_bench::recording::Recording) -> Recording {
    let column =
        |of: &dyn Fn(&virtual_bench::recording::Row) -> f64| made.rows.iter().map(of).collect::<Vec<f64>>();
    Recording {
        name: made.name.clone(),
        source: made.name.clone().into(),
        time: column(&|r| r.time),
        pressure: column(&|r| r.pressure),
        stroke: column(&|r| r.stroke),
        force: Some(column(&|r| r.force)),
        ..Recording::default()
    }
}

fn campaign(files: &[virtual_bench::recording::Recording]) -> Campaign {
    Campaign::new(files.iter().filter(|f| f.rows.len() > 1).map(recording).collect())
}

fn ask(spec: &Spec, residuals: &Residuals, keep: Option<&Path>) -> Outcome {
    let pair = generate::pair(spec, residuals);
    if let Some(folder) = keep {
        for (side, files) in [("before", &pair.before), ("after", &pair.after)] {
            let folder = folder.join(format!("{:04}", spec.id)).join(side);
            // For a developer's eyes only: what cannot be written is missing.
            let _ = std::fs::create_dir_all(&folder);
            for f in files {
                let _ = std::fs::write(folder.join(format!("{}.csv", f.name)), f.csv(Default::default()));
            }
            let _ = std::fs::write(folder.join("../muscle.toml"), &pair.description);
        }
    }
    let start = Instant::now();
    let answer = MuscleDescription::parse(&pair.description).and_then(|described| {
        let options = Asked {
            rest_length: Some(described.rest_length()),
            geometry: Some(described.geometry()),
            ..Asked::default()
        };
        compare(&campaign(&pair.after), Against::Recordings(&campaign(&pair.before)), &options)
    });
    let mut outcome = Outcome {
        id: spec.id,
        stratum: spec.stratum,
        protocol: spec.protocol.into(),
        effects: pair.effects,
        named: Vec::new(),
        set: Vec::new(),
        probabilities: Vec::new(),
        verdict: String::new(),
        refused: None,
        seconds: start.elapsed().as_secs_f64(),
    };
    match answer {
        Ok(report) => {
            outcome.named = report.missing.iter().map(|m| (m.effect.clone(), m.probability)).collect();
            outcome.set.clone_from(&report.set);
            outcome.probabilities =
                report.probabilities.iter().take(6).map(|p| (p.cause.clone(), p.probability)).collect();
            outcome.verdict = verdict(report.verdict).into();
        }
        Err(e) => outcome.refused = Some(e.to_string()),
    }
    outcome
}

fn verdict(v: Verdict) -> &'static str {
    match v {
        Verdict::Consistent => "consistent",
        Verdict::Explained => "explained",
        Verdict::PartlyExplained => "partly-explained",
        Verdict::Unexplained => "unexplained",
    }
}

/// The answers of a set, a line of JSON each.
const ANSWERS: &str = "answers.jsonl";

/// The answers that a file holds. A line that was cut off when a run was interrupted is none.
fn answered(path: &Path) -> BTreeMap<usize, Outcome> {
    std::fs::read_to_string(path)
        .unwrap_or_default()
        .lines()
        .filter_map(|l| serde_json::from_str::<Outcome>(l).ok())
        .map(|o| (o.id, o))
        .collect()
}

/// The answers of a set in its directory, in order.
///
/// # Errors
/// No answers there.
pub fn outcomes(dir: &Path) -> Result<Vec<Outcome>, String> {
    let all: Vec<Outcome> = answered(&dir.join(ANSWERS)).into_values().collect();
    if all.is_empty() { Err(format!("{}: no answers", dir.join(ANSWERS).display())) } else { Ok(all) }
}

/// Answers the set, as far as time allows, and scores what there is.
///
/// # Errors
/// Files that cannot be read or written, or another seed than the one that was begun.
pub fn run(what: &Options, seed: u64, specs: Vec<Spec>) -> Result<(), Box<dyn Error>> {
    let output = &what.set.what.output;
    std::fs::create_dir_all(output.join("sealed"))?;
    std::fs::write(output.join("sealed").join("seed.txt"), seed.to_string())?;
    let hash = Sha256::digest(seed.to_string().as_bytes());
    let hash: String = hash.iter().map(|b| format!("{b:02x}")).collect();
    println!("{} pairs; SHA-256 of the seed: {hash}", specs.len());
    let path = output.join(ANSWERS);
    let mut done = answered(&path);
    let residuals = Residuals::read(&what.set.what.data);
    let until = what.minutes.map(|m| Instant::now() + Duration::from_secs_f64(60.0 * m.max(0.0)));
    let file = Mutex::new(std::fs::OpenOptions::new().create(true).append(true).open(&path)?);
    let wanted = |s: &&Spec| {
        let own = what.only.as_ref().is_none_or(|o| s.effects.iter().any(|e| e.0.name == o));
        own && !done.contains_key(&s.id)
    };
    let open: Vec<&Spec> = specs.iter().filter(wanted).collect();
    let answered: Vec<Outcome> = open
        .par_iter()
        .with_max_len(1)
        .filter(|_| until.is_none_or(|u| Instant::now() < u))
        .filter_map(|spec| {
            let outcome = ask(spec, &residuals, what.keep.then_some(output.as_path()));
            let line = serde_json::to_string(&outcome).ok()?;
            let mut file = file.lock().ok()?;
            writeln!(file, "{line}").ok()?;
            Some(outcome)
        })
        .collect();
    done.extend(answered.into_iter().map(|o| (o.id, o)));
    let all: Vec<Outcome> = done.into_values().collect();
    let text = page::page(&all, specs.len(), &hash);
    print!("{text}");
    std::fs::write(output.join("reference-bench.md"), &text)?;
    if let Some(page) = &what.page {
        std::fs::write(page, &text)?;
    }
    Ok(())
}
