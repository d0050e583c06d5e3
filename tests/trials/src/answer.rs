//! The tool's answers: asked once per trial, frozen by their hashes before any seal is opened.

use crate::ledger::{Ledger, name, read_ledger, sha256, write_ledger};
use rayon::prelude::*;
use serde::Deserialize;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// What is read of `host diagnose --json`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Answer {
    /// consistent, explained, partly-explained or unexplained.
    pub verdict: String,
    /// Noise as the tool sees it, N.
    #[serde(rename = "noise_N")]
    pub noise: Option<f64>,
    /// Where the misfit sits.
    #[serde(rename = "where")]
    pub regions: Vec<Region>,
    /// What is named.
    pub missing: Vec<Missing>,
    /// What is left without a name.
    pub unexplained: Unexplained,
    /// The proposed recording.
    pub next_experiment: Option<serde_json::Value>,
    /// What was weighed and not taken.
    pub considered: Vec<Considered>,
}

/// A region of the misfit.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Region {
    /// Coordinate's name.
    pub coordinate: String,
    /// Begin.
    pub from: Option<f64>,
    /// End.
    pub to: Option<f64>,
    /// Share of the misfit's energy above noise.
    pub share: Option<f64>,
}

/// A named effect.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Missing {
    /// Its name.
    pub effect: String,
    /// The tool's probability.
    pub probability: Option<f64>,
    /// Its parameters.
    pub parameters: Vec<Value>,
    /// What it cannot be told from.
    pub confusable_with: Vec<String>,
}

/// A parameter with its error bar.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Value {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Option<f64>,
    /// Its standard deviation.
    pub std: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// What is left.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Unexplained {
    /// Share of the misfit.
    pub share: Option<f64>,
}

/// An effect that was weighed.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Considered {
    /// Its name.
    pub effect: String,
    /// Why it was not taken.
    pub why_not: String,
}

/// Longest time for one trial.
const LIMIT: Duration = Duration::from_secs(120);

/// CSV files of a directory in order of their names, which is the order of time.
pub fn recordings(dir: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(dir)
        .map(|d| {
            d.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "csv")).collect()
        })
        .unwrap_or_default();
    files.sort();
    files
}

/// Run a command with a time limit; gives whether it succeeded, or what went wrong.
pub fn run_limited(command: &mut Command, limit: Duration) -> Result<(), String> {
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| format!("cannot start: {e}"))?;
    let start = Instant::now();
    loop {
        match child.try_wait().map_err(|e| e.to_string())? {
            Some(status) if status.success() => return Ok(()),
            Some(status) => {
                let mut said = String::new();
                if let Some(mut pipe) = child.stderr.take() {
                    let _ = std::io::Read::read_to_string(&mut pipe, &mut said);
                }
                let short: String = said.lines().take(4).collect::<Vec<_>>().join(" | ");
                return Err(format!("{status}: {short}"));
            }
            None if start.elapsed() > limit => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("no answer within {} s", limit.as_secs()));
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

/// Ask the tool about every trial and freeze what it says.
pub fn ask(set: &Path, host: &Path) -> Result<(), Box<dyn Error>> {
    let mut ledger: Ledger = read_ledger(set)?;
    if !ledger.answers.is_empty() {
        return Err("this set has been answered; answers are given once".into());
    }
    let answers = set.join("answers");
    std::fs::create_dir_all(&answers)?;
    let tables = writes_tables(host);
    if !tables {
        eprintln!("this tool's diagnose has no -o: there will be no held-out gain");
    }
    let done = AtomicUsize::new(0);
    let total = ledger.truths.len();
    let one = |id: usize| {
        let trial = set.join("trials").join(name(id));
        let json = answers.join(format!("{}.json", name(id)));
        let mut command = Command::new(host);
        command.arg("diagnose").arg("--quiet").arg("--muscle").arg(trial.join("muscle.toml"));
        command.args(recordings(&trial)).arg("--json").arg(&json);
        if tables {
            command.arg("-o").arg(answers.join(format!("{}.pam", name(id))));
        }
        let start = Instant::now();
        // What an earlier run left must not pass for an answer.
        let _ = std::fs::remove_file(&json);
        let failed = run_limited(&mut command, LIMIT).err();
        if failed.is_some() || !json.exists() {
            let said = serde_json::json!({ "schema": "none", "failed": failed.unwrap_or("no JSON".into()) });
            std::fs::write(&json, said.to_string()).map_err(|e| e.to_string())?;
        }
        let bytes = std::fs::read(&json).map_err(|e| e.to_string())?;
        let table = std::fs::read(answers.join(format!("{}.pam", name(id)))).unwrap_or_default();
        let n = done.fetch_add(1, Ordering::Relaxed) + 1;
        if n.is_multiple_of(10) || n == total {
            eprintln!("answered {n} of {total}");
        }
        Ok((sha256(&[bytes, table].concat()), start.elapsed().as_secs_f64()))
    };
    // One at a time per core: the tool is threaded itself, and the time of an answer should mean something.
    let got: Result<Vec<(String, f64)>, String> =
        (0..total).collect::<Vec<_>>().par_iter().with_max_len(1).map(|&id| one(id)).collect();
    let got = got?;
    ledger.seconds = got.iter().map(|g| (g.1 * 100.0).round() / 100.0).collect();
    ledger.answers = got.into_iter().map(|g| g.0).collect();
    ledger.tool = version(host);
    write_ledger(set, &ledger)?;
    Ok(())
}

/// Whether the tool's diagnosis can write the diagnosed table.
fn writes_tables(host: &Path) -> bool {
    let said = Command::new(host).arg("diagnose").arg("--help").output();
    // A tool without help is given the option: the interface fixes it.
    said.map_or(true, |o| {
        let text = String::from_utf8_lossy(&o.stdout).into_owned();
        text.is_empty() || text.lines().any(|l| l.trim_start().starts_with("-o"))
    })
}

fn version(host: &Path) -> String {
    let said =
        Command::new(host).arg("--version").output().map(|o| String::from_utf8_lossy(&o.stdout).into_owned());
    let hash = std::fs::read(host).map(|b| sha256(&b)).unwrap_or_default();
    format!("{} ({})", said.unwrap_or_default().trim(), hash.get(..16).unwrap_or(""))
}

/// The frozen answer of a trial, its hash checked.
pub fn frozen(set: &Path, ledger: &Ledger, id: usize) -> Result<Result<Answer, String>, Box<dyn Error>> {
    let dir = set.join("answers");
    let bytes = std::fs::read(dir.join(format!("{}.json", name(id))))?;
    let table = std::fs::read(dir.join(format!("{}.pam", name(id)))).unwrap_or_default();
    let expected = ledger.answers.get(id).ok_or("the set has not been answered")?;
    if sha256(&[bytes.clone(), table].concat()) != *expected {
        return Err(format!("answer {} was changed after it was frozen", name(id)).into());
    }
    let value: serde_json::Value = serde_json::from_slice(&bytes)?;
    if let Some(failed) = value.get("failed").and_then(|f| f.as_str()) {
        return Ok(Err(failed.into()));
    }
    Ok(serde_json::from_value(value).map_err(|e| format!("not the agreed JSON: {e}")))
}
