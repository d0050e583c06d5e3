//! Every number that decides, on one page: symbol, unit, value, statistical meaning, source.
//!
//! One file per stage of the diagnosis. Guards against division by zero and steps of numerical derivatives are not criteria; they stand
//! where they are used. Two ideas of inexactness meet here with several values, on purpose:
//!
//! | criterion | inexactness of | as a share of |
//! | --- | --- | --- |
//! | `selection::SELECTION_FLOOR` | the base model, below which nothing is selected | blocked force |
//! | `judgement::LACK_OF_FIT` | the base model with everything it admits, for the verdict | blocked force |
//! | `candidates::LAW_ERROR` | a law in its sensitivities, as a penalty of its score | the law's own trace |
//! | `selection::COMPETITOR_FLOOR` | a law, when two are compared by what they leave | the excess error |
//! | `uncertainty::LAW_DEVIATION` | a law in its parameters, for their intervals | the parameter |
//!
//! `cargo run -p pam-diagnose --example criteria` prints the page. The criteria of the motion stand with it, in `pam-data`.

pub use pam_data::criteria::{Criterion, Source, Stage};
use pam_data::recording::motion;

pub(crate) mod baseline;
pub(crate) mod candidates;
pub(crate) mod history;
pub(crate) mod judgement;
pub(crate) mod location;
pub(crate) mod noise;
pub(crate) mod planning;
pub(crate) mod reference;
pub(crate) mod rest_friction;
pub(crate) mod rows;
pub(crate) mod selection;
pub(crate) mod stock;
pub(crate) mod table_health;
pub(crate) mod timeline;
pub(crate) mod uncertainty;
pub(crate) mod valve_pulses;

/// Lack of fit of the base model with everything that it admits, share of the blocked force: for those who plan with it.
#[must_use]
pub fn lack_of_fit() -> f64 {
    judgement::LACK_OF_FIT
}

/// The whole page, stage by stage in the order in which they decide.
pub const PAGE: [Stage; 17] = [
    motion::CRITERIA,
    valve_pulses::STAGE,
    rows::STAGE,
    baseline::STAGE,
    rest_friction::STAGE,
    noise::STAGE,
    candidates::STAGE,
    selection::STAGE,
    uncertainty::STAGE,
    judgement::STAGE,
    location::STAGE,
    planning::STAGE,
    history::STAGE,
    reference::STAGE,
    timeline::STAGE,
    stock::STAGE,
    table_health::STAGE,
];

/// The page as Markdown tables.
#[must_use]
pub fn markdown() -> String {
    pam_data::criteria::markdown(&PAGE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_criterion_has_a_unique_name_and_a_meaning() {
        let mut names: Vec<&str> = PAGE.iter().flat_map(|s| s.criteria).map(|c| c.name).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all, "a name scales one criterion");
        for c in PAGE.iter().flat_map(|s| s.criteria) {
            assert!(c.meaning.len() > 20 && !c.symbol.is_empty() && !c.unit.is_empty(), "{}", c.name);
        }
        assert_eq!(markdown().lines().filter(|l| l.starts_with("| `")).count(), all);
    }

    /// A number that decides belongs on the page: no other file of the crate declares one, outside tests.
    #[test]
    fn no_other_file_declares_a_criterion() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut folders = vec![root.clone()];
        let mut stray = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
                let path = entry.path();
                if path.is_dir() && !path.ends_with("criteria") && !path.ends_with("tests") {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "rs")
                    && !path.ends_with("criteria.rs")
                    && !path.ends_with("tests.rs")
                {
                    let text = std::fs::read_to_string(&path).expect("a source file");
                    let production = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
                    let declares = |line: &&str| {
                        let line = line
                            .trim_start()
                            .trim_start_matches("pub(crate) ")
                            .trim_start_matches("pub(super) ");
                        line.starts_with("const ")
                            && [": f64 =", ": usize =", ": u32 =", ": [f64;"].iter().any(|t| line.contains(t))
                    };
                    stray.extend(
                        production.lines().filter(declares).map(|l| format!("{}: {l}", path.display())),
                    );
                }
            }
        }
        assert_eq!(stray, [""; 0], "move these into criteria");
    }
}
