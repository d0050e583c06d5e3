//! A printed cylinder whose seal was swapped on one rig: pairs of which is known what changed.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::Path;

use pam_data::recording::{Campaign, Import, Reader};
use pam_diagnose::reference::shapes::Class;
use pam_diagnose::reference::{Against, Options, compare};
use rayon::prelude::*;
use serde::Serialize;

/// Configurations; the last three are reruns of the fourth.
const CONFIGURATIONS: [&str; 8] = [
    "kdn",
    "pk",
    "o-ring",
    "o-ring257",
    "x-ring257",
    "rerun_1_o-ring257",
    "rerun_2_o-ring257",
    "rerun_3_o-ring257",
];
const LEVELS: [&str; 4] = ["1bar", "3bar", "5bar", "7bar"];

/// One pair with its answer.
#[derive(Debug, Clone, Serialize)]
pub struct Pair {
    /// Before.
    pub before: String,
    /// After.
    pub after: String,
    /// Classes that are known to have changed.
    pub known: BTreeSet<Class>,
    /// Classes that are named.
    pub named: BTreeSet<Class>,
    /// Probability that nothing changed.
    pub none: f64,
}

impl Pair {
    /// Whether the main change is named and nothing false.
    pub fn right(&self) -> bool {
        let main = if self.known.contains(&Class::Gain) { Class::Gain } else { Class::Friction };
        if self.known.is_empty() {
            self.named.is_empty()
        } else {
            self.named.contains(&main) && self.named.is_subset(&self.known)
        }
    }
}

fn seal(configuration: &str) -> &str {
    if configuration.contains("o-ring") { "o-ring" } else { configuration.trim_end_matches("257") }
}

/// Another seal is another friction; another bore another gain.
fn known_classes(a: &str, b: &str) -> BTreeSet<Class> {
    let mut all = BTreeSet::new();
    if a.contains("257") != b.contains("257") {
        all.insert(Class::Gain);
    }
    if seal(a) != seal(b) {
        all.insert(Class::Friction);
    }
    all
}

/// Every directed pair of configurations that are there.
///
/// # Errors
/// Files that are there and cannot be read, pairs without an answer.
pub fn run(data: &Path, short: bool) -> Result<Vec<Pair>, Box<dyn Error>> {
    let folder = data.join("tudelft-printed-cylinder");
    let import = Import::default();
    let mut campaigns: Vec<(&str, Campaign)> = Vec::new();
    for name in CONFIGURATIONS.iter().take(if short { 5 } else { 8 }) {
        let files: Vec<_> = LEVELS.iter().map(|l| folder.join(format!("{name}_{l}.csv"))).collect();
        if files.iter().all(|f| f.exists()) {
            campaigns.push((
                name,
                Reader::new().import(Some(&import)).campaign(&files).map_err(|e| e.to_string())?,
            ));
        } else {
            println!("no {name} in {}: left out", folder.display());
        }
    }
    let pairs: Vec<(usize, usize)> = (0..campaigns.len())
        .flat_map(|a| (0..campaigns.len()).filter(move |b| *b != a).map(move |b| (a, b)))
        .collect();
    let answered = pairs.par_iter().map(|(a, b)| -> Result<Pair, String> {
        let ((before, old), (after, new)) = (&campaigns[*a], &campaigns[*b]);
        let report = compare(new, Against::Recordings(old), &Options::default())
            .map_err(|e| format!("{before} {after}: {e}"))?;
        Ok(Pair {
            before: (*before).into(),
            after: (*after).into(),
            known: known_classes(before, after),
            named: report.missing.iter().map(|m| m.class).collect(),
            none: report.probability("none"),
        })
    });
    Ok(answered.collect::<Result<_, _>>()?)
}
