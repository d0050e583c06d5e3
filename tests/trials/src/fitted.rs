//! How well tables predict held-out recordings: run by `host fit` and `host predict` after the answers are frozen.

use crate::answer::{recordings, run_limited};
use crate::generate::TrialTruth;
use crate::ledger::name;
use crate::oracle;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Rms error on held-out recordings, N.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// A plain fit of the campaign.
    #[serde(rename = "plain_N")]
    pub plain: f64,
    /// The tool's diagnosed table.
    #[serde(rename = "diagnosed_N")]
    pub diagnosed: f64,
    /// A plain fit of the twin without the effect, on the twin's held-out recordings: nothing is missing there.
    #[serde(rename = "twin_N")]
    pub twin: f64,
    /// The true structure refitted by the tool; absent where it was not asked, or nothing of the muscle is hidden.
    #[serde(rename = "oracle_N", default)]
    pub oracle: Option<f64>,
}

/// Least part of the plain error that the true structure must take for a gain to be measured against it.
pub const WORTH: f64 = 0.1;

impl HeldOut {
    /// How much of what the true structure gains, refitted by the same tool, the diagnosed table gains; where that is something.
    pub fn gain(&self) -> Option<f64> {
        let possible = self.plain - self.oracle?;
        (possible >= WORTH * self.plain).then(|| (self.plain - self.diagnosed) / possible)
    }

    /// The same against the muscle without the effect, to which nothing is missing, where something could be gained: what the effect
    /// costs a plain fit must be at least half of the error that is there without it.
    pub fn gain_against_twin(&self) -> Option<f64> {
        let possible = self.plain - self.twin;
        (possible > 0.5 * self.twin).then(|| (self.plain - self.diagnosed) / possible)
    }

    /// What the true structure refitted gains of that.
    pub fn oracle_against_twin(&self) -> Option<f64> {
        let possible = self.plain - self.twin;
        let oracle = self.oracle?;
        (possible > 0.5 * self.twin).then(|| (self.plain - oracle) / possible)
    }

    /// Whether the diagnosed table is worse than the plain one by more than 2 %.
    pub fn harmed(&self) -> bool {
        self.diagnosed > 1.02 * self.plain
    }
}

const LIMIT: Duration = Duration::from_secs(60);

fn fit(host: &Path, muscle: &Path, files: &[PathBuf], table: &Path) -> Result<(), String> {
    let mut c = Command::new(host);
    run_limited(c.arg("fit").arg("--muscle").arg(muscle).args(files).arg("-o").arg(table), LIMIT)
}

/// Rms over the last files of a prediction that runs through all of them.
pub fn predict(
    host: &Path,
    table: &Path,
    history: &[PathBuf],
    held: &[PathBuf],
    json: &Path,
) -> Result<f64, String> {
    let mut c = Command::new(host);
    c.arg("predict").arg("--table").arg(table).args(history).args(held).arg("--json").arg(json);
    run_limited(&mut c, LIMIT)?;
    let text = std::fs::read_to_string(json).map_err(|e| e.to_string())?;
    let said: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let files = said.get("recordings").and_then(|r| r.as_array()).ok_or("no recordings in the prediction")?;
    let mut sum = 0.0;
    let mut n = 0.0;
    for f in files.iter().rev().take(held.len()) {
        let rms = f.get("rms_N").and_then(serde_json::Value::as_f64).ok_or("no rms_N")?;
        let samples = f.get("samples").and_then(serde_json::Value::as_f64).ok_or("no samples")?;
        sum += rms * rms * samples;
        n += samples;
    }
    Ok((sum / f64::max(n, 1.0)).sqrt())
}

/// Where a trial's tables and predictions lie.
pub fn work(set: &Path, id: usize) -> Result<PathBuf, String> {
    let work = set.join("work").join(name(id));
    std::fs::create_dir_all(&work).map_err(|e| format!("{}: {e}", work.display()))?;
    Ok(work)
}

/// Judge one trial's tables.
pub fn held_out(set: &Path, host: &Path, truth: &TrialTruth) -> Result<HeldOut, String> {
    let id = name(truth.id);
    let (trial, sealed) = (set.join("trials").join(&id), set.join("sealed").join(&id));
    let work = work(set, truth.id)?;
    let oracle = oracle::read(set, truth.id).and_then(|o| o.error);
    let known = work.join("held_out.json");
    if let Some(done) = std::fs::read(&known).ok().and_then(|b| serde_json::from_slice::<HeldOut>(&b).ok()) {
        return Ok(HeldOut { oracle, ..done });
    }
    let muscle = trial.join("muscle.toml");
    let (history, held) = (recordings(&trial), recordings(&sealed.join("held_out")));
    let plain_table = work.join("plain.pam");
    fit(host, &muscle, &history, &plain_table)?;
    let plain = predict(host, &plain_table, &history, &held, &work.join("plain.json"))?;
    let diagnosed_table = set.join("answers").join(format!("{id}.pam"));
    let diagnosed = if diagnosed_table.exists() {
        predict(host, &diagnosed_table, &history, &held, &work.join("diagnosed.json"))?
    } else {
        plain
    };
    let twin_history = recordings(&sealed.join("twin"));
    let twin = if twin_history.is_empty() {
        plain
    } else {
        let table = work.join("twin.pam");
        fit(host, &muscle, &twin_history, &table)?;
        let held = recordings(&sealed.join("twin_held_out"));
        predict(host, &table, &twin_history, &held, &work.join("twin.json"))?
    };
    let all = HeldOut { plain, diagnosed, twin, oracle };
    let text = serde_json::to_string(&all).map_err(|e| e.to_string())?;
    std::fs::write(known, text).map_err(|e| e.to_string())?;
    Ok(all)
}
