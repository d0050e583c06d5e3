//! The oracle: the tool receives the hidden effect and fits it, after the answers are frozen. What it then predicts of recordings that
//! were held out is the upper bound for a right name with these laws.

use crate::answer::{Asking, recordings};
use crate::fitted::{predict, work};
use crate::generate::TrialTruth;
use crate::ledger::{self, name};
use crate::names::{Owner, owner};
use crate::progress::Progress;
use crate::queue::in_order;
use crate::tool;
use crate::{answer, ledger::Ledger};
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// What the true structure, refitted, leaves on held-out recordings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Oracle {
    /// Rms error, N; absent where the tool gave no table.
    #[serde(rename = "oracle_N")]
    pub error: Option<f64>,
}

/// Whether a truth has an oracle: effects of the muscle alone, all of them in the catalogue.
pub fn applies(truth: &TrialTruth) -> bool {
    !truth.effects.is_empty() && truth.effects.iter().all(|e| owner(&e.name) == Some(Owner::Muscle))
}

/// Give the tool the truth of every answered trial that has an oracle; continues where it was interrupted. True when all are done.
pub fn ask(set: &Path, how: &Asking) -> Result<bool, Box<dyn Error>> {
    let ledger: Ledger = ledger::read_ledger(set)?;
    if ledger.answers.is_empty() {
        return Err("the set has not been answered: no truth is opened before the answers are frozen".into());
    }
    if answer::version(&how.host) != ledger.tool {
        return Err(format!("the answers are another tool's ({}); its oracle is its own", ledger.tool).into());
    }
    let mut open = Vec::new();
    for id in 0..ledger.answers.len() {
        let truth = ledger::open(set, &ledger, id)?;
        if applies(&truth) && read(set, id).is_none() {
            open.push(truth);
        }
    }
    let progress = Progress::new("given the true effects", open.len());
    in_order(&open, |truth: &TrialTruth| {
        if how.until.is_none_or(|t| Instant::now() <= t) {
            let answer = Oracle {
                error: tell(set, how, truth).map_err(|e| eprintln!("trial {}: {e}", truth.id)).ok(),
            };
            let text = serde_json::to_string(&answer).map_err(|e| e.to_string())?;
            std::fs::write(work(set, truth.id)?.join("oracle.json"), text).map_err(|e| e.to_string())?;
        }
        progress.one();
        Ok(())
    })?;
    Ok(open.iter().all(|t| read(set, t.id).is_some()))
}

/// What the oracle of a trial answered, where it ran.
pub fn read(set: &Path, id: usize) -> Option<Oracle> {
    let bytes = std::fs::read(set.join("work").join(name(id)).join("oracle.json")).ok()?;
    serde_json::from_slice(&bytes).ok()
}

fn tell(set: &Path, how: &Asking, truth: &TrialTruth) -> Result<f64, String> {
    let trial = set.join("trials").join(name(truth.id));
    let work = work(set, truth.id)?;
    let table = work.join("oracle.pam");
    let names: Vec<&str> = truth.effects.iter().map(|e| e.name.as_str()).collect();
    let history = recordings(&trial);
    let json = work.join("oracle_answer.json");
    let mut command = tool::diagnose(&how.host, &trial.join("muscle.toml"), &history, &json);
    tool::add_checks(&mut command, &trial);
    command.arg("--with").arg(names.join(",")).arg("-o").arg(&table);
    answer::run_limited(&mut command, how.limit)?;
    let held = recordings(&set.join("sealed").join(name(truth.id)).join("held_out"));
    predict(&how.host, &table, &history, &held, &work.join("oracle_predicted.json"))
}
