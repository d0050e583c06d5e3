//! The call of the tool that is judged, put together in one place.

use crate::generate::Trial;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use virtual_bench::recording::Columns;

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

/// Writes the recordings and the description of a trial into a directory, and has them diagnosed.
///
/// # Errors
/// A directory that cannot be written, or a tool that gives no answer.
pub fn answer_to(host: &Path, dir: &Path, trial: &Trial) -> Result<Answer, String> {
    let at = |path: &Path, e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    std::fs::create_dir_all(dir).map_err(|e| at(dir, &e))?;
    let put = |name: &str, text: &str| {
        let path = dir.join(name);
        std::fs::write(&path, text).map_err(|e| at(&path, &e))
    };
    put("muscle.toml", &trial.description)?;
    for r in &trial.recordings {
        put(&format!("{}.csv", r.name), &r.csv(Columns::default()))?;
    }
    answer(host, dir, &recordings(dir)).map_err(|e| at(dir, &e))
}
