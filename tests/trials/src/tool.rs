//! The call of the tool that is judged, put together in one place.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::answer::{Answer, recordings, run_limited};

/// Longest time for one answer.
const LIMIT: Duration = Duration::from_secs(180);

/// `host diagnose` on a muscle's recordings, the answer as JSON into a file; a caller may add to it.
pub fn diagnose(host: &Path, muscle: &Path, recordings: &[PathBuf], json: &Path) -> Command {
    let mut command = Command::new(host);
    command.arg("diagnose").arg("--quiet").arg("--muscle").arg(muscle);
    command.args(recordings).arg("--json").arg(json);
    command
}

/// With the checks of the bench that lie beside a trial's recordings.
pub fn add_checks(command: &mut Command, trial: &Path) {
    for check in recordings(&trial.join("checks")) {
        command.arg("--check").arg(check);
    }
}

/// What `host diagnose` answers about recordings of the muscle described in a directory; the JSON stays there as `answer.json`.
pub fn answer(host: &Path, dir: &Path, recordings: &[PathBuf]) -> Result<Answer, String> {
    let json = dir.join("answer.json");
    run_limited(&mut diagnose(host, &dir.join("muscle.toml"), recordings, &json), LIMIT)?;
    let text = std::fs::read_to_string(&json).map_err(|e| e.to_string())?;
    serde_json::from_str(&text).map_err(|e| e.to_string())
}
