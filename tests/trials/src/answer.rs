//! The tool's answers: asked once per trial, frozen by their hashes before any seal is opened.

use crate::ledger::{Ledger, name, read_ledger, sha256, write_ledger};
use crate::progress::Progress;
use crate::queue::in_order;
use crate::tool;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
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
    /// Where the misfit is.
    #[serde(rename = "where")]
    pub regions: Vec<Region>,
    /// What is named.
    pub missing: Vec<Missing>,
    /// The unexplained residual.
    pub unexplained: Unexplained,
    /// The proposed recording.
    pub next_experiment: Option<serde_json::Value>,
    /// What was tested and not taken.
    pub considered: Vec<Considered>,
    /// Other remarks.
    pub remarks: Vec<String>,
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
    /// Effects that it is confounded with.
    pub confusable_with: Vec<String>,
    /// Whether a check of the bench measured it.
    pub checked: bool,
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

/// The residual.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Unexplained {
    /// Share of the misfit.
    pub share: Option<f64>,
}

/// An effect that was tested.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct Considered {
    /// Its name.
    pub effect: String,
    /// Why it was not taken.
    pub why_not: String,
    /// Up to which force it could be there unseen, N; absent where it cannot be seen at all.
    #[serde(rename = "hidden_up_to_N")]
    pub hidden_up_to: Option<f64>,
    /// Whether a check of the bench reported it.
    pub checked: bool,
    /// Share of its trace that the base does not absorb.
    pub visible: Option<f64>,
}

/// How a set is answered.
#[derive(Debug, Clone)]
pub struct Asking {
    /// The tool.
    pub host: PathBuf,
    /// Longest time for one trial.
    pub limit: Duration,
    /// Trials that are not begun by then stay unanswered.
    pub until: Option<Instant>,
    /// Whether the tool writes diagnosed tables, where it makes them.
    pub tables: bool,
    /// Variables of the tool's environment.
    pub environment: Vec<(&'static str, String)>,
}

/// A line of `frozen.jsonl`: an answer's hash, written as soon as the answer is there, so that a run that was interrupted can go
/// on without asking anything twice.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Frozen {
    id: usize,
    sha256: String,
    seconds: f64,
    tool: String,
}

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

fn frozen_so_far(set: &Path) -> Vec<Frozen> {
    let text = std::fs::read_to_string(set.join("frozen.jsonl")).unwrap_or_default();
    text.lines().filter_map(|l| serde_json::from_str(l).ok()).collect()
}

/// Ask the tool about every trial that has no answer yet and freeze what it says. True when all are answered.
pub fn ask(set: &Path, how: &Asking) -> Result<bool, Box<dyn Error>> {
    let mut ledger: Ledger = read_ledger(set)?;
    if !ledger.answers.is_empty() {
        return Err("this set has been answered; answers are given once".into());
    }
    let answers = set.join("answers");
    std::fs::create_dir_all(&answers)?;
    let tool = version(&how.host);
    let so_far = frozen_so_far(set);
    if let Some(other) = so_far.iter().find(|f| f.tool != tool) {
        return Err(format!("answers were begun by another tool ({}); a set has one", other.tool).into());
    }
    let help = help(&how.host);
    let total = ledger.truths.len();
    let open: Vec<usize> = (0..total).filter(|id| so_far.iter().all(|f| f.id != *id)).collect();
    let file = std::fs::OpenOptions::new().create(true).append(true).open(set.join("frozen.jsonl"))?;
    let lines = Mutex::new(file);
    let progress = Progress::new("answered", open.len());
    let one = |&id: &usize| -> Result<(), String> {
        if how.until.is_some_and(|t| Instant::now() > t) {
            return Ok(());
        }
        let trial = set.join("trials").join(name(id));
        let json = answers.join(format!("{}.json", name(id)));
        let table = answers.join(format!("{}.pam", name(id)));
        // What an earlier run left must not pass for an answer.
        let _ = (std::fs::remove_file(&json), std::fs::remove_file(&table));
        let mut command = tool::diagnose(&how.host, &trial.join("muscle.toml"), &recordings(&trial), &json);
        command.envs(how.environment.iter().map(|(name, value)| (name, value)));
        if how.tables && help.tables {
            command.arg("-o").arg(&table);
        }
        if help.checks {
            tool::add_checks(&mut command, &trial);
        }
        let start = Instant::now();
        let failed = run_limited(&mut command, how.limit).err();
        let seconds = (start.elapsed().as_secs_f64() * 100.0).round() / 100.0;
        if failed.is_some() || !json.exists() {
            let said = serde_json::json!({ "schema": "none", "failed": failed.unwrap_or("no JSON".into()) });
            std::fs::write(&json, said.to_string()).map_err(|e| e.to_string())?;
        }
        let sha256 = hash_of(set, id).map_err(|e| e.to_string())?;
        let line = Frozen { id, sha256, seconds, tool: tool.clone() };
        let mut text = serde_json::to_string(&line).map_err(|e| e.to_string())?;
        text.push('\n');
        let mut file = lines.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.write_all(text.as_bytes()).map_err(|e| e.to_string())?;
        progress.one();
        Ok(())
    };
    // One at a time per core: the tool is threaded itself, and the time of an answer must mean something.
    in_order(&open, one)?;
    let mut all = frozen_so_far(set);
    if all.len() < total {
        return Ok(false);
    }
    all.sort_by_key(|f| f.id);
    ledger.seconds = all.iter().map(|f| f.seconds).collect();
    ledger.answers = all.into_iter().map(|f| f.sha256).collect();
    ledger.tool = tool;
    write_ledger(set, &ledger)?;
    Ok(true)
}

/// End the answering of a set of which a part only was answered: the rest is left out permanently. What is judged is the part of
/// the numbers, in order, that is answered without a gap; trials are mixed, so that it is a stratified share.
pub fn close(set: &Path) -> Result<usize, Box<dyn Error>> {
    let mut ledger: Ledger = read_ledger(set)?;
    if !ledger.answers.is_empty() {
        return Ok(ledger.answers.len());
    }
    let mut all = frozen_so_far(set);
    all.sort_by_key(|f| f.id);
    let n = all.iter().enumerate().take_while(|(i, f)| *i == f.id).count();
    if n == 0 {
        return Err("nothing has been answered".into());
    }
    all.truncate(n);
    ledger.tool = all[0].tool.clone();
    ledger.seconds = all.iter().map(|f| f.seconds).collect();
    ledger.answers = all.into_iter().map(|f| f.sha256).collect();
    write_ledger(set, &ledger)?;
    Ok(n)
}

/// Hash of an answer: its JSON and its table.
fn hash_of(set: &Path, id: usize) -> std::io::Result<String> {
    let dir = set.join("answers");
    let bytes = std::fs::read(dir.join(format!("{}.json", name(id))))?;
    let table = std::fs::read(dir.join(format!("{}.pam", name(id)))).unwrap_or_default();
    Ok(sha256(&[bytes, table].concat()))
}

/// What a tool's diagnosis can be given.
struct Help {
    /// Whether it can write the diagnosed table.
    tables: bool,
    /// Whether it takes checks of the bench.
    checks: bool,
}

fn help(host: &Path) -> Help {
    let said = Command::new(host).arg("diagnose").arg("--help").output();
    let text = said.map_or(String::new(), |o| String::from_utf8_lossy(&o.stdout).into_owned());
    // A tool without help is given what the interface fixes.
    let has = |option: &str| text.lines().any(|l| l.trim_start().starts_with(option));
    Help { tables: text.is_empty() || has("-o"), checks: has("--check ") || has("--check=") }
}

/// A tool's version and hash.
pub fn version(host: &Path) -> String {
    let said =
        Command::new(host).arg("--version").output().map(|o| String::from_utf8_lossy(&o.stdout).into_owned());
    let hash = std::fs::read(host).map(|b| sha256(&b)).unwrap_or_default();
    format!("{} ({})", said.unwrap_or_default().trim(), hash.get(..16).unwrap_or(""))
}

/// The frozen answer of a trial, its hash checked.
pub fn frozen(set: &Path, ledger: &Ledger, id: usize) -> Result<Result<Answer, String>, Box<dyn Error>> {
    let expected = ledger.answers.get(id).ok_or("the set has not been answered")?;
    let bytes = std::fs::read(set.join("answers").join(format!("{}.json", name(id))))?;
    if hash_of(set, id)? != *expected {
        return Err(format!("answer {} was changed after it was frozen", name(id)).into());
    }
    let value: serde_json::Value = serde_json::from_slice(&bytes)?;
    if let Some(failed) = value.get("failed").and_then(|f| f.as_str()) {
        return Ok(Err(failed.into()));
    }
    Ok(serde_json::from_value(value).map_err(|e| format!("not the agreed JSON: {e}")))
}
