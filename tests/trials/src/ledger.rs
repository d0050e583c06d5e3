//! Files of a set: what the tool may see, what is sealed, and the ledger of hashes that is written first.

use crate::generate::{Trial, TrialTruth, make};
use crate::progress::Progress;
use crate::queue::in_order;
use crate::residuals::Residuals;
use crate::spec::Spec;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::error::Error;
use std::io::Read as _;
use std::path::Path;
use virtual_bench::recording::{Columns, Recording};

/// The ledger of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// `dev` or `final`.
    pub set: String,
    /// The SHA-256 of the seed's decimal digits; the seed itself lies in sealed/seed.txt.
    pub seed_sha256: String,
    /// SHA-256 of each sealed truth file, in order of the trials.
    pub truths: Vec<String>,
    /// How many trials were drawn; the truths are those of the first of them, or of the first of a protocol.
    #[serde(default)]
    pub drawn: usize,
    /// The protocol whose trials are in the set; those of all protocols where absent.
    #[serde(default)]
    pub protocol: Option<String>,
    /// SHA-256 of each frozen answer, in order of the trials; empty before.
    pub answers: Vec<String>,
    /// Version and hash of the tool that answered.
    #[serde(default)]
    pub tool: String,
    /// Time of each answer, s.
    #[serde(default)]
    pub seconds: Vec<f64>,
}

/// The ledger of a set.
pub fn read_ledger(set: &Path) -> Result<Ledger, Box<dyn Error>> {
    let path = set.join("ledger.json");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?)
}

/// Write the ledger again.
pub fn write_ledger(set: &Path, ledger: &Ledger) -> Result<(), Box<dyn Error>> {
    put(&set.join("ledger.json"), &serde_json::to_string_pretty(ledger)?)?;
    Ok(())
}

/// Open a seal: the truth of a trial, its hash checked.
pub fn open(set: &Path, ledger: &Ledger, id: usize) -> Result<TrialTruth, Box<dyn Error>> {
    let path = set.join("sealed").join(name(id)).join("truth.json");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    if ledger.truths.get(id) != Some(&sha256(text.as_bytes())) {
        return Err(format!("{}: not the truth that was sealed", path.display()).into());
    }
    Ok(serde_json::from_str(&text)?)
}

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// A seed from the operating system.
pub fn secret_seed() -> Result<u64, Box<dyn Error>> {
    let mut bytes = [0u8; 8];
    std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}

/// Directory name of a trial.
pub fn name(id: usize) -> String {
    format!("{id:04}")
}

fn put(path: &Path, text: &str) -> Result<(), String> {
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

fn directory(path: &Path) -> Result<(), String> {
    std::fs::create_dir_all(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn put_recordings(dir: &Path, files: &[Recording]) -> Result<(), String> {
    directory(dir)?;
    for f in files {
        put(&dir.join(format!("{}.csv", f.name)), &f.csv(Columns::default()))?;
    }
    Ok(())
}

fn put_trial(output: &Path, trial: &Trial) -> Result<String, String> {
    let id = name(trial.truth.id);
    let open = output.join("trials").join(&id);
    put_recordings(&open, &trial.recordings)?;
    put(&open.join("muscle.toml"), &trial.description)?;
    let sealed = output.join("sealed").join(&id);
    put_recordings(&sealed.join("held_out"), &trial.held_out)?;
    if !trial.twin.0.is_empty() {
        put(&sealed.join("trace.csv"), &trial.trace)?;
        put_recordings(&sealed.join("twin"), &trial.twin.0)?;
        put_recordings(&sealed.join("twin_held_out"), &trial.twin.1)?;
    }
    if !trial.checks.is_empty() {
        let checks = open.join("checks");
        directory(&checks)?;
        for c in &trial.checks {
            put(&checks.join(format!("{}.csv", c.name)), &c.csv)?;
        }
    }
    let truth = serde_json::to_string_pretty(&trial.truth).map_err(|e| e.to_string())?;
    // Whole or not at all: a truth that is there means that the trial is.
    let unfinished = sealed.join("truth.unfinished");
    put(&unfinished, &truth)?;
    std::fs::rename(&unfinished, sealed.join("truth.json")).map_err(|e| e.to_string())?;
    Ok(sha256(truth.as_bytes()))
}

/// What is done to make a set.
#[derive(Debug, Clone, Copy)]
pub struct Plan<'a> {
    /// `dev` or `final`.
    pub set: &'a str,
    /// Its seed.
    pub seed: u64,
    /// How many trials were drawn, of which the first are made.
    pub drawn: usize,
    /// The protocol whose trials are made, if not those of all.
    pub protocol: Option<&'a str>,
    /// What noise is resampled from.
    pub residuals: &'a Residuals,
}

/// The seed of a set that was begun and not finished.
pub fn begun(output: &Path) -> Option<u64> {
    std::fs::read_to_string(output.join("sealed").join("seed.txt")).ok()?.trim().parse().ok()
}

/// Make and write a set; the ledger comes last, when every hash is known, and before any answer. A set that was begun is gone
/// on with: a trial's truth is the last of its files.
pub fn write_set(output: &Path, plan: &Plan<'_>, specs: &[Spec]) -> Result<(), Box<dyn Error>> {
    if output.join("ledger.json").exists() {
        return Err(
            format!("{}: there is a set already; a set is never overwritten", output.display()).into()
        );
    }
    if begun(output).is_some_and(|seed| seed != plan.seed) {
        return Err(format!("{}: another set was begun here", output.display()).into());
    }
    directory(&output.join("sealed"))?;
    put(&output.join("sealed").join("seed.txt"), &plan.seed.to_string())?;
    let progress = Progress::new("made", specs.len());
    let truths = in_order(specs, |s| {
        let truth = output.join("sealed").join(name(s.id)).join("truth.json");
        let hash = match std::fs::read(&truth) {
            Ok(bytes) => Ok(sha256(&bytes)),
            Err(_) => put_trial(output, &make(s, plan.residuals)),
        };
        progress.one();
        hash
    });
    let ledger = Ledger {
        set: plan.set.into(),
        seed_sha256: sha256(plan.seed.to_string().as_bytes()),
        truths: truths?,
        drawn: plan.drawn,
        protocol: plan.protocol.map(str::to_owned),
        answers: Vec::new(),
        tool: String::new(),
        seconds: Vec::new(),
    };
    put(&output.join("ledger.json"), &serde_json::to_string_pretty(&ledger)?)?;
    Ok(())
}
